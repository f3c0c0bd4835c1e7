"""Diagnosis of recordings of bench points: soil first, then what is missing, judged by curves that were left out."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from rille.diagnosis.answer.data_problems import data_problems
from rille.diagnosis.answer.prove import NOT_CARRIED, carries_over, none_by
from rille.diagnosis.answer.statement import statement
from rille.diagnosis.bench.bench_answer import ablation, accepted_terms, applied, proof, ranking, soil_terms
from rille.diagnosis.bench.bench_calibration import calibrate_shared, free_numbers, plain
from rille.diagnosis.bench.bench_evidence import BenchEvidence, gather_bench
from rille.diagnosis.bench.bench_experiment import next_points
from rille.diagnosis.bench.bench_hypotheses import bench_hypotheses, conditional, open_terms, soil_hypotheses
from rille.diagnosis.bench.bench_rig import BenchRig, responses
from rille.diagnosis.bench.bench_search import BenchFound, search_bench, simpler
from rille.diagnosis.comparison.bench_difference import compare_bench
from rille.diagnosis.comparison.difference import find_difference
from rille.diagnosis.inference.found import less_probable
from rille.diagnosis.inference.weights import none_of_these, probabilities
from rille.model import EffectKind
from rille.model.comparison import Comparison
from rille.model.diagnosis import NAMING, Diagnosis, Experiment, Group, Location, NamedTerm, Proof, RankedHypothesis, TargetScore, Verdict
from rille.model.difference import Difference
from rille.model.hypothesis import Hypothesis, Setting

Stage = Callable[[str, Callable[[], Any]], Any]
UNKNOWN = 0.3  # share of the excess left, beyond which the catalogue has no name for the rest
FOR_EACH = 3.0  # measured numbers per open number, below which a fit says nothing of what is missing
PREDICTS = 2.0  # RMS [noise] of what was left out, up to which a soil explains the points
FALSE_ALARM = "the comparison calls something different, but that may be chance: the noise is not known well, or the excess is small"
SEVERAL = (
    "several numbers of the soil together bend the curves as laws of slip or load do, none of them alone: plate and shear tests of this "
    "soil would tell its numbers, and whether a law is left"
)
ONE_SLIP = 0.05  # range of slip ratios below which they were one


def diagnose_bench(
    rigs: Sequence[BenchRig],
    held_out: Sequence[BenchRig] = (),
    *,
    kinds: Sequence[EffectKind],
    model: str = "",
    most: int = 4,
    chosen: Callable[[Sequence[Hypothesis]], Sequence[Hypothesis]] = tuple,
    known_soils: Sequence[str] = (),
    stage: Stage = lambda name, compute: compute(),
    on_progress: Callable[[str, float], None] = lambda what, share: None,
) -> Diagnosis:
    """What wheel and soil of a bench lack.

    Parameters
    ----------
    rigs, held_out : recordings of points with their benches; of all rigs parts are left out in turn, ``held_out`` are not fitted at all.
    kinds : the catalogue. most : pieces of an answer at most. chosen : which hypotheses to try. known_soils : that are not fitted; those
    whose provenance is ``measured`` never are. stage : keeps what is computed under a name. on_progress : told what is done, and its share.

    Raises
    ------
    InputRefused : as of ``compare_bench`` and ``gather_bench``.
    """
    begin = perf_counter()
    base: list[Comparison] = stage("comparisons", lambda: [_compared(rig, (), model) for rig in rigs])
    difference: Difference = stage("difference", lambda: find_difference(base))
    evidence = gather_bench(rigs)
    fixed = (*known_soils, *(rig.soil.name for rig in rigs if rig.soil.provenance == "measured"))
    held = tuple(dict.fromkeys(rig.soil.name for rig in rigs if rig.soil.name in fixed))
    limits = _limits(evidence, rigs, kinds)
    answer = Diagnosis(
        model=model,
        scenario="",
        recordings=tuple(rig.recording.name for rig in rigs),
        held_out=tuple(rig.recording.name for rig in held_out),
        verdict="nothing_missing",
        sentence="",
        location=_location(difference),
        data_problems=data_problems([rig.recording for rig in (*rigs, *held_out)]),
        limits=limits,
        notes=tuple(f"the soil {name} is known from earlier points and was not fitted" for name in held),
    )
    if not difference.judged:
        limits = (difference.sentence, *limits)
        sentence = statement("cannot_know", (), (), answer.location, 0.0, None, (), limits)
        return replace(answer, verdict="cannot_know", limits=limits, sentence=sentence)
    if not difference.differs:
        return replace(answer, sentence=statement("nothing_missing", (), (), answer.location, 0.0, None, (), ()))
    open_numbers = open_terms(rigs, fixed)
    hypotheses = tuple(chosen(bench_hypotheses(rigs, kinds)))

    def searched() -> BenchFound:
        numbers = soil_hypotheses(open_numbers)
        free = tuple(term for term in open_numbers if term.hypothesis.target_kind != "soil")
        closed = search_bench(
            evidence,
            (*hypotheses, *chosen(numbers)),
            calibrate_shared(evidence, free),
            most=most,
            on_progress=lambda what, part: on_progress(what, 0.05 + 0.15 * part),
        )
        if not numbers or not closed.differs:
            return closed
        on_progress("calibrating the soil", 0.2)
        opened = search_bench(
            evidence,
            hypotheses,
            calibrate_shared(evidence, open_numbers),
            most=most,
            on_progress=lambda what, part: on_progress(what, 0.3 + 0.6 * part),
        )
        return simpler(evidence, closed, opened)

    found: BenchFound = stage("search", searched)
    catalogue = {kind.name: kind for kind in kinds}
    ranked, groups = ranking(found, evidence, catalogue)
    terms = accepted_terms(found, evidence, catalogue)
    if not found.differs and not any(term.hypothesis.target_kind == "soil" for term in found.first.whole.setting):
        sentence = statement("nothing_missing", (), (), answer.location, 0.0, None, (), ())
        return replace(answer, sentence=sentence, notes=(*answer.notes, FALSE_ALARM))
    verdict, limit = _verdict(found, evidence, groups, conditional(rigs, kinds))
    if verdict == "group" and not any(group.number == 0 for group in groups):
        members = (ranked[0].title, "another law of slip or load")
        groups = (Group(number=0, members=members, probability=ranked[0].probability, correlation=1.0, sentence=limit), *groups)
    if verdict == "parameter" and not terms:
        terms = soil_terms(found.best.whole, len(evidence.labels))
        row = _soil_row(found, terms)
        ranked, groups = (row,), ()
        if sum(term.hypothesis.target_kind == "soil" for term in found.best.whole.setting) > 1:  # one alone does not do it
            verdict, limit = "group", SEVERAL
            ranked = (replace(row, probability=row.probability / 2),)
            members = (row.title, "several laws of slip or load at once")
            groups = (Group(number=0, members=members, probability=ranked[0].probability, correlation=1.0, sentence=limit),)
    foreign = [rig.soil.name for rig in rigs if not rig.own_soil]
    told = found.best.whole.setting if verdict != "cannot_know" else ()
    setting, notes = applied(plain(_moved(told)), _smooth(rigs), _needing(kinds), foreign)
    on_progress("proof", 0.92)
    proven: Proof | None = stage("proof", lambda: _proof(evidence, rigs, found, held_out))
    on_progress("planning the next points", 0.96)
    if proven is not None and held_out and verdict in NAMING:
        factor = (1.0 - none_by(proven)) / (1.0 - none_of_these(found.leftover))
        ranked, groups = less_probable(ranked, groups, min(factor, 1.0))
        if not carries_over(proven):
            verdict, notes = "unknown", (*notes, NOT_CARRIED)
    experiments: tuple[Experiment, ...] = stage("experiments", lambda: _experiments(evidence, found, groups))
    stage("improved", lambda: [_compared(rig, found.best.whole.setting, model) for rig in rigs])
    limits = (*((limit,) if limit else ()), *limits)
    return replace(
        answer,
        verdict=verdict,
        sentence=statement(verdict, terms[:3], ranked, answer.location, found.leftover, proven, (), limits),
        setting=setting,
        ranked=ranked,
        groups=groups,
        proof=proven,
        experiments=experiments,
        limits=limits,
        leftover=found.leftover,
        notes=(*answer.notes, *notes),
        seconds={"bench": perf_counter() - begin},
    )


def _compared(rig: BenchRig, setting: Setting, model: str) -> Comparison:
    """Points beside what the rig gives under a setting."""
    return compare_bench(lambda points: responses(rig, points, setting), rig.recording, rig.conditions, model=model, wheel=rig.wheel)


def _verdict(found: BenchFound, evidence: BenchEvidence, groups: Sequence[Group], conditions: dict[str, str]) -> tuple[Verdict, str]:
    """What it is, and what stands in the way of saying more."""
    n, p = len(evidence.window), len(free_numbers(found.first.whole.setting))
    accepted = found.best.extra
    if p and n < FOR_EACH * p:
        return "cannot_know", f"{n} measured numbers are too few for the {p} numbers of the soil and a law beside them"
    if not accepted:
        predicted = float(np.sqrt(np.mean(found.first.held_out**2)))
        if not found.differs:
            if predicted <= PREDICTS:
                return "parameter", ""
            return (
                "cannot_know",
                f"numbers of the soil explain the points, but not those that were left out (RMS {predicted:.2g} times the noise)",
            )
        if not found.rounds:
            return "unknown", ""
        one = found.rounds[0]
        share = 1 - one.rivals[0].whole.chi2 / max(one.base.whole.chi2, 1e-12)
        return ("cannot_know" if share > 1 - UNKNOWN else "unknown"), ""
    if found.leftover > UNKNOWN:
        return "unknown", ""
    tied = [term.hypothesis for one in found.rounds[: len(accepted)] for k in one.group for term in one.rivals[k].extra]
    members = [*(term.hypothesis for term in accepted), *tied]
    for hypothesis in members:
        if hypothesis.cause == "effect" and hypothesis.kind in conditions:
            what = conditions[hypothesis.kind]
            return "group", (
                f"the {what} was the same at all points, so that {hypothesis.title} cannot be told from another law of slip or load; "
                f"points at two or more values of the {what} would tell"
            )
    causes = {hypothesis.cause for hypothesis in members}
    if causes == {"sensor"}:
        return "sensor_fault", ""
    if causes == {"parameter"}:
        return "parameter", ""
    return ("group" if groups else "named"), ""


def _soil_row(found: BenchFound, terms: Sequence[NamedTerm]) -> RankedHypothesis:
    """Numbers of the soil as the one answer."""
    title = f"numbers of {', '.join(dict.fromkeys(t.term.hypothesis.target for t in terms)) or 'the soil'}"
    weight, _ = probabilities(np.zeros(1), np.zeros(1), found.leftover)
    return RankedHypothesis(
        terms=tuple(terms),
        title=title,
        cause="parameter",
        probability=float(weight[0]),
        gain=float("nan"),
        gain_error=float("nan"),
        explained=1.0,
    )


def _moved(setting: Setting) -> Setting:
    """Terms whose numbers are not where they are absent."""
    return tuple(
        term
        for term in setting
        if any(value != number.absent for value, number in zip(term.values, term.hypothesis.free, strict=True) if number.amplitude)
    )


def _proof(evidence: BenchEvidence, rigs: Sequence[BenchRig], found: BenchFound, held_out: Sequence[BenchRig]) -> Proof | None:
    """On recordings that were held out, else on the parts that each fit has not seen. The base is the model with its soil calibrated."""
    if held_out:
        other = gather_bench(held_out)
        settings = (found.first.whole.setting, found.best.whole.setting) if found.best.extra else ((), found.best.whole.setting)
        before, after = other.residuals(settings)
        names = ", ".join(f"'{rig.recording.name}'" for rig in held_out)
        return proof(other, before, after, other.window, names)
    if found.best.extra:
        before, after = found.first.held_out, found.best.held_out
    else:
        before, after = evidence.residuals([()])[0], found.first.held_out
    parts = len(np.unique(evidence.run))
    return proof(evidence, before, after, evidence.run[evidence.window], f"points left out in {parts} parts", ablation(evidence, found))


def _experiments(evidence: BenchEvidence, found: BenchFound, groups: Sequence[Group]) -> tuple[Experiment, ...]:
    """Points that would tell the members of the best group apart."""
    if not found.rounds or not any(group.number == 0 for group in groups):
        return ()
    return next_points(evidence, found.rounds[max(len(found.best.extra) - 1, 0)])


def _location(difference: Difference) -> Location:
    """Where it differs, as far as points have a where: at which wheel, in which conditions."""
    targets = tuple(TargetScore(kind=t.kind, name=t.name, share=t.share, size=t.excess, differs=t.differs) for t in difference.targets)
    if not difference.differs:
        return Location(shape="nowhere", targets=targets, sentence="")
    regimes = tuple(
        f"{row.channel} grows with {row.regime.partition('/')[0].replace('_', ' ')} (trend {row.trend:+.2g} +- {row.trend_error:.2g} noise)"
        for row in difference.regimes[:3]
        if np.isfinite(row.trend) and abs(row.trend) > 2 * row.trend_error
    )
    worst = max((t for t in difference.targets if t.differs), key=lambda t: t.share, default=None)
    place = f"it differs at {worst.name}, most in {worst.channels[0]}" if worst is not None else difference.sentence
    return Location(shape="regime" if regimes else "everywhere", targets=targets, regimes=regimes, sentence=place)


def _limits(evidence: BenchEvidence, rigs: Sequence[BenchRig], kinds: Sequence[EffectKind]) -> tuple[str, ...]:
    """What these points cannot tell."""
    found = []
    loads = np.concatenate([points.load for points in evidence.points])
    if np.ptp(np.log(loads)) < np.log(1.5):
        found.append(
            f"the load was {loads.min():.3g} to {loads.max():.3g} N only, so that cohesion and friction of the soil cannot be told apart"
        )
    slips = np.concatenate([points.slip_ratio for points in evidence.points])
    if np.ptp(slips) < ONE_SLIP:
        found.append(
            f"all points have one slip, {np.median(slips):.2g}: what grows with slip cannot be told from the rest; record a sweep of slip"
        )
    if not any(part.response == "drive_torque" for part in evidence.parts):
        found.append("no torque was measured, so that shear strength and shear modulus of the soil are weakly known")
    for kind, what in conditional(rigs, kinds).items():
        found.append(f"the {what} was the same at all points, so that {kind} cannot be told from numbers of the soil or another law")
    return tuple(found)


def _smooth(rigs: Sequence[BenchRig]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(rig.wheel for rig in rigs if not rig.shape.grouser_count))


def _needing(kinds: Sequence[EffectKind]) -> tuple[str, ...]:
    return tuple(kind.name for kind in kinds if kind.needs == "grousers")
