"""What may be wrong about a bench: numbers that are open from the beginning, effects on wheels, faults of what measured.

Numbers of a soil are open: published values of one soil differ by a factor of two, so that a law is missing only where no numbers of the
soil explain the points. What a law says only of a condition that was never changed on its own (speed of the carriage, width of the wheel)
the points cannot tell from the soil; ``conditional`` says of which hypotheses that is so.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.bench.bench_rig import FAULTS, LOAD, LOG, WHOLE, BenchRig, responses
from rille.diagnosis.bench.soil_fit import PARAMETERS
from rille.diagnosis.hypotheses.parameter_hypotheses import DOUBTS
from rille.model import EffectKind, InputRefused
from rille.model.bench import RESPONSES
from rille.model.hypothesis import FreeNumber, Hypothesis, Setting
from rille.model.recording import Channel

FELT = 1e-6  # [of the response] change below which a number has no influence on a bench
FARTHEST = 3.0  # [1 sigma] of a load from what the manifest says
SAME = 0.05  # [of the mean] range up to which a condition counts as the same
APART = 0.03  # [of its change] by which a number must do something else than the amplitudes
REFERENCE = "reference_"  # begins the name of a number that is a convention: the value of a condition that an amplitude belongs to
ZERO_SPREAD = 10.0  # [ranges of the channel] 1 sigma of a zero that is not known


def open_terms(rigs: Sequence[BenchRig], fixed_soils: Sequence[str] = ()) -> Setting:
    """Numbers that are open from the beginning, at their values: those of the soils, loads and zeros that manifests call unknown.

    fixed_soils : soils that are known from elsewhere, and stay as they are.
    """
    terms = []
    for soil in {rig.soil.name: rig.soil for rig in rigs if rig.soil.name not in fixed_soils}.values():
        for name, how in PARAMETERS.items():
            value = float(getattr(soil, name))
            solver = f"soil.{soil.name}.{name}"
            if how.log:
                if value <= 0:
                    continue
                lower, upper = (float(np.log(np.clip(bound, 1e-300, None) / value)) for bound in (how.lower, how.upper))
                number = FreeNumber(
                    name=LOG, unit="1", amplitude=True, lower=min(lower, 0.0), upper=max(upper, 0.0), start=0.0, spread=how.spread
                )
                moves = ((LOG, solver, value),)
            else:
                lower, upper = min(how.lower, value), max(how.upper, value)
                number = FreeNumber(
                    name=name,
                    unit=unit_of_soil(name),
                    amplitude=True,
                    lower=lower,
                    upper=upper,
                    start=value,
                    spread=how.spread,
                    absent=value,
                )
                moves = ((name, solver, 1.0),)
            made = Hypothesis(cause="parameter", kind=name, target=soil.name, target_kind="soil", free=(number,), moves=moves)
            if _felt(rigs, made, {number.name: number.absent + 0.1 * number.spread}):
                terms.append(made.at())
    for load, error in {rig.stated_load: rig.load_error for rig in rigs if rig.load_error > 0}.items():
        number = FreeNumber(name=LOG, unit="1", amplitude=True, lower=-FARTHEST * error, upper=FARTHEST * error, start=0.0, spread=error)
        moves = ((LOG, "bench.load", 1.0),)
        terms.append(Hypothesis(cause="parameter", kind=LOAD, target=load, target_kind="load", free=(number,), moves=moves).at())
    for rig in rigs:
        for name in rig.unknown_zeros:
            known = rig.recording.channel(name).value
            size = ZERO_SPREAD * float(np.ptp(known[np.isfinite(known)]))
            unit = rig.recording.channel(name).unit
            number = FreeNumber(name="offset", unit=unit, amplitude=True, lower=-10 * size, upper=10 * size, start=0.0, spread=size)
            target = f"{rig.recording.name}/{name}"
            terms.append(Hypothesis(cause="sensor", kind="bias", target=target, target_kind="channel", free=(number,)).at())
    return tuple(terms)


def bench_hypotheses(rigs: Sequence[BenchRig], kinds: Sequence[EffectKind]) -> tuple[Hypothesis, ...]:
    """Every effect of the catalogue on every wheel (and on all of them) that changes what the bench gives, and faults of the channels."""
    wheels = list(dict.fromkeys(rig.wheel for rig in rigs))
    made = [
        _effect(rigs, kind, target) for kind in kinds if kind.target == "wheel" for target in [*wheels, *(["*"] if len(wheels) > 1 else [])]
    ]
    made += [_fault(rig, channel.name, kind) for kind in kinds if kind.name in FAULTS for rig in rigs for channel in _measured(rig)]
    return tuple(hypothesis for hypothesis in made if hypothesis is not None)


def soil_hypotheses(open_numbers: Setting) -> tuple[Hypothesis, ...]:
    """Each open number of a soil as the only one that is wrong."""
    return tuple(term.hypothesis for term in open_numbers if term.hypothesis.target_kind == "soil")


def unit_of_soil(name: str) -> str:
    """Unit of a number of a soil."""
    return DOUBTS["soil"][name].unit


def conditional(rigs: Sequence[BenchRig], kinds: Sequence[EffectKind]) -> dict[str, str]:
    """Effects that speak of a condition which was the same at all points, with that condition: {"plate_size": "width"}."""
    same = [name for name, values in _conditions(rigs).items() if np.ptp(values) <= SAME * np.mean(values)]
    return {
        kind.name: parameter.name.removeprefix(REFERENCE)
        for kind in kinds
        for parameter in kind.parameters
        if parameter.name.startswith(REFERENCE) and parameter.name.removeprefix(REFERENCE) in same
    }


def _conditions(rigs: Sequence[BenchRig]) -> Mapping[str, list[float]]:
    """What a rig was run with, and an effect may have a reference for."""
    return {"speed": [rig.speed for rig in rigs], "width": [rig.shape.width for rig in rigs]}


def _measured(rig: BenchRig) -> list[Channel]:
    bad = rig.recording.flagged("bad_channel", "stuck")
    given = {f"wheel.{name}" for name in RESPONSES}
    return [c for c in rig.recording.with_role("observed") if c.quantity in given and c.name not in (*bad, *rig.unknown_zeros)]


def _effect(rigs: Sequence[BenchRig], kind: EffectKind, target: str) -> Hypothesis | None:
    """An effect on a wheel with the numbers that are felt free; None if nothing of it is felt.

    References are the means of the conditions; where these are the same at all points and nothing is felt there, those of the catalogue.
    """
    means = {f"{REFERENCE}{name}": float(np.exp(np.mean(np.log(values)))) for name, values in _conditions(rigs).items()}
    return _effect_about(rigs, kind, target, means) or _effect_about(rigs, kind, target, {})


def _effect_about(rigs: Sequence[BenchRig], kind: EffectKind, target: str, natural: Mapping[str, float]) -> Hypothesis | None:
    """With these references."""
    varied = {f"{REFERENCE}{name}" for name, values in _conditions(rigs).items() if np.ptp(values) > SAME * np.mean(values)}
    fixed = {p.name: natural.get(p.name, p.typical) for p in kind.parameters if not p.amplitude}
    free = [
        FreeNumber(
            name=p.name,
            unit=p.unit,
            amplitude=p.amplitude,
            lower=p.lower,
            upper=p.upper,
            start=natural.get(p.name, p.typical),
            spread=0.3 * natural[p.name] if p.name in natural else p.spread,
            search=p.search if p.search in ("local", "scale", "phase", "order", "place", "time") else "local",  # pyright: ignore[reportArgumentType]
        )
        for p in kind.parameters
    ]
    whole = Hypothesis(cause="effect", kind=kind.name, target=target, target_kind="wheel", free=tuple(free), passive=kind.passive, fixed={})
    # An amplitude that is usual in size, and not 0 where it may have either sign.
    usual = {n.name: (n.start if n.start != 0 else n.spread) if n.amplitude else fixed[n.name] for n in free}
    try:
        if not _felt(rigs, whole, usual, {name: 0.0 for name, n in zip(usual, free, strict=True) if n.amplitude}):
            return None
        left = []
        for p, number in zip(kind.parameters, free, strict=True):
            # A reference that is a convention is one no more where the condition varies and the soil is known.
            told = p.name in varied if p.name in natural else p.search != "fixed"
            if number.amplitude or (told and _tells(rigs, whole, usual, number)):
                left.append(number)
    except InputRefused:  # an effect that this wheel or soil cannot have
        return None
    names = {number.name for number in left}
    return Hypothesis(
        cause="effect",
        kind=kind.name,
        target=target,
        target_kind="wheel",
        free=tuple(left),
        fixed={name: value for name, value in fixed.items() if name not in names},
        passive=kind.passive,
    )


def _tells(rigs: Sequence[BenchRig], whole: Hypothesis, usual: Mapping[str, float], number: FreeNumber) -> bool:
    """Whether a number changes something, and something else than the amplitudes do."""
    change = _change(rigs, whole, usual, {number.name: _other(number)})
    if np.abs(change).max(initial=0.0) <= FELT:
        return False
    if not number.name.startswith(REFERENCE):
        return True
    small = _change(rigs, whole, usual, {number.name: usual[number.name] * 1.01})
    near = np.stack([_change(rigs, whole, usual, {n.name: 0.99 * usual[n.name]}) for n in whole.free if n.amplitude], axis=1)
    left = small - near @ np.linalg.lstsq(near, small, rcond=None)[0]
    return float(np.linalg.norm(left)) > APART * float(np.linalg.norm(small))


def _other(number: FreeNumber) -> float:
    """A value of a number that is clearly another than its first guess."""
    return number.start + number.spread if number.start + number.spread <= number.upper else number.start - number.spread


def _fault(rig: BenchRig, channel: str, kind: EffectKind) -> Hypothesis | None:
    """A fault of a channel; its sizes in proportion to what was measured."""
    values = rig.recording.channel(channel).value
    largest = float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else 0.0
    if largest == 0:
        return None
    target = f"{rig.recording.name}/{channel}"
    if kind.name in WHOLE:
        return Hypothesis(cause="sensor", kind=kind.name, target=target, target_kind="channel", free=(), fixed=WHOLE[kind.name])
    sizes = {"SI": largest, "1/SI": 1 / largest}
    unit = rig.recording.channel(channel).unit
    free = [
        FreeNumber(
            name=p.name,
            unit=p.unit.replace("SI", unit),
            amplitude=p.amplitude,
            lower=p.lower,
            upper=p.upper,
            start=0.1 * sizes[p.unit] if p.unit in sizes else p.typical,
            spread=0.1 * sizes[p.unit] if p.unit in sizes else p.spread,
        )
        for p in kind.parameters
    ]
    return Hypothesis(cause="sensor", kind=kind.name, target=target, target_kind="channel", free=tuple(free))


def _felt(rigs: Sequence[BenchRig], hypothesis: Hypothesis, values: Mapping[str, float], other: Mapping[str, float] | None = None) -> bool:
    """Whether something that was measured changes between these numbers and the others (None: those of the model)."""
    return bool(np.abs(_change(rigs, hypothesis, values, other)).max(initial=0.0) > FELT)


def _change(
    rigs: Sequence[BenchRig], hypothesis: Hypothesis, values: Mapping[str, float], other: Mapping[str, float] | None
) -> NDArray[np.float64]:
    """What changes in all that was measured, relative to the largest of each response; 1 where a point is carried with one of them only."""
    usual = hypothesis.at(values)
    base: Setting = () if other is None else (hypothesis.at({**values, **other}),)
    parts = [np.empty(0)]
    for rig in rigs:
        measured = {c.quantity.rpartition(".")[2] for c in rig.recording.with_role("observed")}
        points = rig.conditions.where(np.isfinite(rig.conditions.load + rig.conditions.slip_ratio + rig.conditions.slip_angle))
        one, two = responses(rig, points, base)[0], responses(rig, points, (usual,))[0]
        for name in sorted(measured & set(RESPONSES)):
            a, b = getattr(one, name), getattr(two, name)
            size = float(np.nanmax(np.abs(a), initial=1e-12))
            parts.append(np.where(np.isfinite(a) & np.isfinite(b), (b - a) / size, np.isfinite(a) != np.isfinite(b)))
    return np.concatenate(parts)
