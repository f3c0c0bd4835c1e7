"""Numbers of the model that may be wrong: of soils, wheels, drives, bodies, gravity, and of the effects that the model has already.

Masses and centres of mass are laws of the catalogue (they carry the inertia along), and are proposed there.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from rille.diagnosis.hypotheses.natural import Natural, factor_of, matters, moving_bodies
from rille.model.effect import EffectKind, EffectParameter
from rille.model.hypothesis import FreeNumber, Hypothesis
from rille.model.machine import Machine

LEAST = 0.02  # share of its value that a number that is doubted in proportion keeps at least
MOST_SPREADS = 8.0  # a number that is this far off is another model, and would take the place of missing physics


@dataclass(frozen=True, slots=True, kw_only=True)
class Doubt:
    """How far off a number of the solver usually is: ``relative`` to its value, at least ``absolute`` [unit]."""

    unit: str
    relative: float = 0.0
    absolute: float = 0.0


# By the last word of the solver's parameter. Spreads of soils: scatter of published values for one soil (Wong 2008, table 2.3).
DOUBTS: Mapping[str, Mapping[str, Doubt]] = {
    "soil": {
        "sinkage_exponent": Doubt(unit="1", absolute=0.15),
        "cohesive_modulus": Doubt(unit="N/m^(n+1)", relative=0.3, absolute=500.0),
        "frictional_modulus": Doubt(unit="N/m^(n+2)", relative=0.3),
        "cohesion": Doubt(unit="Pa", relative=0.3, absolute=150.0),
        "friction_angle": Doubt(unit="rad", absolute=0.06),
        "shear_modulus": Doubt(unit="m", relative=0.3),
        "lateral_shear_modulus": Doubt(unit="m", relative=0.3),
        "peak_angle_offset": Doubt(unit="1", absolute=0.1),
        "peak_angle_slip": Doubt(unit="1", absolute=0.1),
        "exit_sinkage_ratio": Doubt(unit="1", absolute=0.2),
        "damping": Doubt(unit="Pa s/m", relative=0.5),
        "unit_weight": Doubt(unit="N/m^3", relative=0.15),
        "reece_cohesive_modulus": Doubt(unit="1", relative=0.3, absolute=10.0),
        "reece_frictional_modulus": Doubt(unit="1", relative=0.3),
    },
    "wheel": {
        "radius": Doubt(unit="m", relative=0.03),
        "width": Doubt(unit="m", relative=0.1),
        "lateral_offset": Doubt(unit="m", absolute=0.02),
    },
    "drive": {
        "max_torque": Doubt(unit="N m", relative=0.2),
        "position_gain": Doubt(unit="1/s", relative=0.2),
        "speed_gain": Doubt(unit="N m s/rad", relative=0.2),
        "integral_gain": Doubt(unit="N m/rad", relative=0.2),
    },
    "machine": {"track_width": Doubt(unit="m", relative=0.25)},  # wheels that scrub turn as if they were 1.4 to 2 times as far apart
}
# Numbers that are wrong together: (word, by what it is called, last words, target kind); one factor multiplies them all.
TOGETHER = (
    ("soil", "stiffness", ("cohesive_modulus", "frictional_modulus", "reece_cohesive_modulus", "reece_frictional_modulus"), 0.3),
    ("body", "inertia", ("ixx", "iyy", "izz"), 0.15),
)
GRAVITY = 0.01  # [-] spread of its size
FACTORS = (0.1, 10.0)  # that one number may be off by: another unit, another planet


def parameter_hypotheses(machine: Machine, kinds: Sequence[EffectKind], scales: Natural) -> tuple[Hypothesis, ...]:
    """One hypothesis for each number of the model that can be wrong, and one for numbers of like things that are wrong together.

    Parameters
    ----------
    kinds : the catalogue, for numbers of effects that the model has. scales : as of ``natural``.
    """
    return (
        *_single(machine),
        *_together(machine),
        *_shared(machine),
        *_gravity(machine),
        *_of_effects(machine, kinds, scales),
    )


def _single(machine: Machine) -> Iterable[Hypothesis]:
    for name, (value, lower, upper) in machine.parameters.items():
        family, target, word = _parts(name)
        doubt = DOUBTS.get(family, {}).get(word)
        if doubt is None or not _means_something(machine, family, target, word):
            continue
        spread = max(doubt.relative * abs(value), doubt.absolute)
        if doubt.relative and value > 0:
            lower = max(lower, LEAST * value)
        if spread > 0:
            yield _hypothesis(word, target, family, doubt.unit, value, spread, lower, upper, ((word, name, 1.0),))


def _together(machine: Machine) -> Iterable[Hypothesis]:
    for family, kind, words, spread in TOGETHER:
        targets = dict.fromkeys(t for f, t, _ in map(_parts, machine.parameters) if f == family)
        for target in targets:
            names = [f"{family}.{target}.{word}" for word in words if machine.parameters.get(f"{family}.{target}.{word}", (0.0,))[0] != 0]
            if names and _means_something(machine, family, target, kind):
                yield _factor(machine, kind, target, family, names, spread)


def _shared(machine: Machine) -> Iterable[Hypothesis]:
    """Numbers of all wheels or all drives together: one part from one drawing, one firmware."""
    for family in ("wheel", "drive"):
        for word, doubt in DOUBTS[family].items():
            names = [
                name
                for name in machine.parameters
                if (parts := _parts(name))[0] == family and parts[2] == word and _means_something(machine, family, parts[1], word)
            ]
            names = [name for name in names if machine.parameters[name][0] != 0]
            if len(names) > 1 and doubt.relative > 0:
                yield _factor(machine, word, "*", family, names, doubt.relative)


def _gravity(machine: Machine) -> Iterable[Hypothesis]:
    names = [f"gravity.{k}" for k in "xyz" if machine.parameters.get(f"gravity.{k}", (0.0,))[0] != 0]
    if names:
        yield _factor(machine, "gravity", "", "world", names, GRAVITY, far=True)


def _of_effects(machine: Machine, kinds: Sequence[EffectKind], scales: Natural) -> Iterable[Hypothesis]:
    known = {kind.name: kind for kind in kinds}
    for effect in machine.effects:
        kind = known.get(effect.kind)
        for number in kind.parameters if kind is not None else ():
            name = f"effect.{effect.kind}.{effect.target}.{number.name}"
            if kind is None or name not in machine.parameters or number.search == "fixed":
                continue
            value = machine.parameters[name][0]
            yield _hypothesis(
                f"{effect.kind}.{number.name}",
                effect.target,
                kind.target,
                number.unit,
                value,
                _spread(kind, number, effect.target, value, scales),
                number.lower,
                number.upper,
                ((number.name, name, 1.0),),
            )


def _spread(kind: EffectKind, number: EffectParameter, target: str, value: float, scales: Natural) -> float:
    """A fifth of what it is, where it is something; else what the catalogue calls usual on this machine."""
    usual = number.spread * factor_of(number.unit, kind.target, scales.at(kind.target, target))
    return max(0.2 * abs(value), 1e-3 * usual) if value else usual


def _parts(name: str) -> tuple[str, str, str]:
    """Family, target and word of a parameter of the solver: "soil.sand.cohesion"; the target may hold dots itself."""
    family, _, rest = name.partition(".")
    target, _, word = rest.rpartition(".")
    return (family, target, word) if rest else ("machine", "", family)


def _means_something(machine: Machine, family: str, target: str, word: str) -> bool:
    """Whether the number can do anything: soils and widths of soft ground, gains of the modes that use them."""
    if family == "soil":
        return machine.soft_ground and (not machine.soils or target in machine.soils)
    if family == "wheel":
        return (machine.has_ground or machine.soft_ground) and (machine.soft_ground or word != "width")
    if family == "drive":
        drive = next((d for d in machine.drives if d.name == target), None)
        uses = {
            "position": ("max_torque", "position_gain", "speed_gain", "integral_gain"),
            "speed": ("max_torque", "speed_gain", "integral_gain"),
        }
        return drive is not None and word in uses.get(drive.mode, ("max_torque",))
    if family == "body":
        return target in matters(machine, moving_bodies(machine))
    return True


def _hypothesis(
    kind: str,
    target: str,
    target_kind: str,
    unit: str,
    value: float,
    spread: float,
    lower: float,
    upper: float,
    moves: tuple[tuple[str, str, float], ...],
) -> Hypothesis:
    number = FreeNumber(
        name=moves[0][0],
        unit=unit,
        amplitude=True,
        lower=max(lower, value - MOST_SPREADS * spread),
        upper=min(upper, value + MOST_SPREADS * spread),
        start=value,
        spread=spread,
        absent=value,
    )
    return Hypothesis(cause="parameter", kind=kind, target=target, target_kind=target_kind, free=(number,), moves=moves)


def _factor(machine: Machine, kind: str, target: str, family: str, names: Sequence[str], spread: float, *, far: bool = False) -> Hypothesis:
    """Numbers that one factor multiplies: value x factor = value + value (factor - 1). far : as far as ``FACTORS``, though what is beyond
    the usual bounds is believed last.
    """
    moves = tuple(("factor", name, machine.parameters[name][0]) for name in names)
    found = _hypothesis(kind, target, family, "1", 1.0, spread, *FACTORS, moves)
    wide = replace(found.free[0], lower=FACTORS[0], upper=FACTORS[1], believed=MOST_SPREADS * spread)
    return replace(found, free=(wide,)) if far else found
