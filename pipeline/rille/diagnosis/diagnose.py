"""From recordings that a model does not reproduce to what is missing: the steps of a diagnosis in their order."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from rille.diagnosis.answer.data_problems import data_problems, took_no_part
from rille.diagnosis.answer.decide import decided
from rille.diagnosis.answer.limits import limits
from rille.diagnosis.answer.locate import locate
from rille.diagnosis.answer.next_experiment import next_experiments
from rille.diagnosis.answer.prove import NOT_CARRIED, carries_over, none_by, prove
from rille.diagnosis.answer.statement import statement
from rille.diagnosis.comparison.compare import compare_windows
from rille.diagnosis.comparison.difference import find_difference
from rille.diagnosis.evidence.floor import chi2_floor
from rille.diagnosis.evidence.held_out import Parts, extent, held_out_parts
from rille.diagnosis.evidence.part_comparison import comparison_of
from rille.diagnosis.evidence.replay_evidence import ReplayEvidence, gather
from rille.diagnosis.evidence.window_and_step import window_and_step_of_all
from rille.diagnosis.evidence.window_length import LENGTHS
from rille.diagnosis.hypotheses.candidates import candidates, of_kind, require_known
from rille.diagnosis.hypotheses.natural import natural
from rille.diagnosis.hypotheses.tries import place_tries
from rille.diagnosis.inference.doubt import DOUBTED
from rille.diagnosis.inference.found import Found, with_doubt
from rille.diagnosis.inference.nameless import beside_nameless
from rille.diagnosis.inference.patches import patch_tries, window_places
from rille.diagnosis.inference.search import search
from rille.diagnosis.inference.unknown import Unknown, find_unknown
from rille.diagnosis.second_look import EDGES, LEAST, SEAM, Look, may_hide, takes_over
from rille.diagnosis.staged import Progress, Stage, Staged, Told, at_once
from rille.diagnosis.starts.noise_floor import shared_noise
from rille.diagnosis.stuck import blamed, without_stuck
from rille.model import EffectKind
from rille.model.comparison import Comparison
from rille.model.diagnosis import NAMING, Diagnosis, Experiment, Location, Proof, Verdict
from rille.model.difference import Difference
from rille.model.machine import Machine
from rille.model.recording import Recording

Noise = dict[str, tuple[float, str]]
MOST_ENDED = 0.5  # share of the windows that may end early
MOST_RIVALS = 4  # members of a group that experiments are planned for
CLEARLY = 2.0  # times its noise: a channel that is off by so much is no false alarm
HIDDEN = (
    "a channel differs by {size:.2g} times its noise, but other starts of the windows would explain that as well: it may be something "
    "short where two windows meet; diagnose with another --window, or record it again"
)
UNPLACED = (
    "no channel shows the position of {joints}: windows begin where the model stood and its simulation carried it, and if that is not "
    "where the machine was, all that follows differs; record the position, or begin from a pose that the scenario states"
)
FALSE_ALARM = "the comparison calls something different, but no hypothesis and no excess of chi-squared bears it out"


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """window [s] : length of the windows, None: as ``window_length`` finds. most : of terms in an answer. only, without : causes,
    kinds or targets of hypotheses that are looked at alone, or not at all.
    """

    window: float | None = None
    most: int = 4
    only: tuple[str, ...] = ()
    without: tuple[str, ...] = ()


def diagnose(
    simulators: Callable[[str], Any],
    recordings: Sequence[Recording],
    held_out: Sequence[Recording] = (),
    *,
    kinds: Sequence[EffectKind],
    options: Options | None = None,
    stage: Stage = at_once,
    on_progress: Progress = lambda what, fraction: None,
) -> Diagnosis:
    """What the model lacks, where, how sure, and how much better it is with it.

    Parameters
    ----------
    simulators : of a scenario's name ('' = the only one) a fresh simulator as ``rille.simulate.Replayer``. recordings, held_out : with
        samples; see ``held_out_parts`` for what is held out if none is named. kinds : the catalogue. stage : ``stage(name, compute)``
        returns what was kept under that name, or computes and keeps it, so that an interrupted diagnosis goes on where it was.
    on_progress : told what is being done, and the fraction done.

    Raises
    ------
    InputRefused : as of ``compare_windows``, ``held_out_parts`` and ``require_known``.
    """
    chosen = options or Options()
    run = Staged(on_progress, stage)
    parts, stuck = without_stuck(held_out_parts(recordings, held_out, chosen.window or LENGTHS[-1]))
    if chosen.only or chosen.without:
        _require_known(simulators, parts, kinds, chosen)
    noise = shared_noise([*parts.training, *parts.held_out])
    window, step, rough = run.run(
        "windows and step", 0.0, 0.05, lambda told: window_and_step_of_all(simulators, parts.training, noise=noise, window=chosen.window)
    )

    def coarse(scenario: str) -> Any:
        simulator = simulators(scenario)
        return simulator if step == simulator.step else simulator.changed(step=step)

    like: dict[str, Any] = {"noise": noise, "window": window, "rough": rough}
    look = _diagnosed(coarse, parts, like, kinds, chosen, run)
    blame = partial(blamed, stuck=stuck, kinds=kinds, differing=look.differing)
    by, again = EDGES * window, run.again("other edges", 0.8)
    if not may_hide(look) or not all(last - first > LEAST * window for first, last in map(extent, (*parts.training, *parts.held_out))):
        return blame(look.diagnosis)
    other = _diagnosed(coarse, parts.later(by), like, kinds, chosen, again, short=True).diagnosis
    if takes_over(other, look.diagnosis):
        return blame(replace(other, look=again.look, notes=(*other.notes, SEAM.format(by=by))))
    return blame(replace(look.diagnosis, seconds=other.seconds))


def _require_known(simulators: Callable[[str], Any], parts: Parts, kinds: Sequence[EffectKind], options: Options) -> None:
    machine = simulators(parts.training[0].scenario or "").machine()
    channels = [channel for recording in parts.training for channel in recording.channels]
    require_known(candidates(machine, channels, kinds), kinds, options.only, options.without)


def _diagnosed(
    simulators: Callable[[str], Any],
    parts: Parts,
    like: dict[str, Any],
    kinds: Sequence[EffectKind],
    options: Options,
    run: Staged,
    *,
    short: bool = False,
) -> Look:
    """like : how evidence is gathered. short : whether something short is looked for, whatever the difference looks like."""
    base: list[Comparison] = run.run("comparisons", 0.05, 0.19, lambda told: _compared(simulators, parts, like, told))
    difference: Difference = run.run("difference", 0.19, 0.2, lambda told: find_difference(base))
    location = locate(difference, base)
    simulator = simulators(parts.training[0].scenario or "")
    machine = simulator.machine()
    cannot = limits(parts.training, machine, difference)
    why_not = _why_not_judged(base, difference)
    if why_not:
        return Look(_answer(simulator, parts, location, None, None, None, (), (why_not, *cannot), run, "cannot_know"), base, None)
    differing = tuple(row.name for row in difference.channels if row.differs)
    if not difference.differs:
        return Look(_answer(simulator, parts, location, None, None, None, (), cannot, run, "nothing_missing"), base, differing)
    asked = replace(location, shape="transient") if short else location
    found, unknown, improved = run.run(
        "search", 0.2, 0.8, lambda told: _search(simulators, machine, parts, like, base, asked, kinds, options, told)
    )
    size = max(row.normalised for row in difference.channels if row.differs)
    if found.verdict == "nothing_missing" and size > CLEARLY:
        found = replace(found, verdict="cannot_know", notes=(*found.notes, HIDDEN.format(size=size)))
    setting = (*found.setting, *(unknown.setting if unknown is not None else ()))
    proof = None
    if setting:
        shown = {"terms": found.terms, "training": (base, improved)}
        proof, _ = run.run("proof", 0.8, 0.95, lambda told: prove(simulators, parts, setting, **like, **shown, on_progress=told))
    if proof is not None and found.verdict in NAMING:
        found = with_doubt(found, none_by(proof))
        if not carries_over(proof, pieces=len(found.setting)):
            found = with_doubt(replace(found, verdict="unknown", notes=(*found.notes, NOT_CARRIED)), DOUBTED)
    experiments = run.run("experiments", 0.95, 1.0, lambda told: _experiments(simulator, parts, found, told))
    return Look(_answer(simulator, parts, location, found, unknown, proof, experiments, cannot, run, found.verdict), base, differing)


def _compared(simulators: Callable[[str], Any], parts: Parts, like: dict[str, Any], told: Told) -> list[Comparison]:
    """The training part beside the base model."""
    found = []
    for k, recording in enumerate(parts.training):

        def here(done: int, total: int, what: str, k: int = k) -> None:
            told(k + done / max(total, 1), len(parts.training), what)

        found.append(compare_windows(simulators(recording.scenario or ""), recording, **like, on_progress=here))
    return found


def _why_not_judged(comparisons: Sequence[Comparison], difference: Difference) -> str:
    """Why a comparison says nothing about the model; '' if it does."""
    ended = [window for comparison in comparisons for window in comparison.windows if window.ended]
    count = sum(len(comparison.windows) for comparison in comparisons)
    if len(ended) > MOST_ENDED * count:
        return (
            f"{len(ended)} of {count} windows cannot be replayed to their end, the first at {ended[0].start:.2f} s: {ended[0].ended}; "
            "mend the model, or take a smaller step"
        )
    if not difference.judged:
        return difference.sentence
    return ""


def _search(
    simulators: Callable[[str], Any],
    machine: Machine,
    parts: Parts,
    like: dict[str, Any],
    base: Sequence[Comparison],
    location: Location,
    kinds: Sequence[EffectKind],
    options: Options,
    told: Told,
) -> tuple[Found, Unknown | None, list[Comparison]]:
    """What explains the training part, a formula for what the catalogue has no name for, and the training part beside both."""
    channels = [channel for recording in parts.training for channel in recording.channels]
    hypotheses = of_kind(candidates(machine, channels, kinds, location=location), only=options.only, without=options.without)
    scales = natural(machine, channels)
    evidence = gather(simulators, parts.training, **like, on_progress=lambda done, total, what: told(0.25 * done, total, what))
    floor = chi2_floor(evidence, like["noise"])
    found = search(
        evidence,
        hypotheses,
        floor=floor,
        kinds={kind.name: kind for kind in kinds},
        most=options.most,
        tries={**place_tries(hypotheses, machine, scales, location), **patch_tries(evidence, hypotheses, window_places(evidence, base))},
        on_progress=lambda what, share: told(0.25 + 0.65 * share, 1, what),
    )
    unplaced = _unplaced(simulators(parts.training[0].scenario or ""), evidence)
    if found.verdict == "unknown" and unplaced:
        found = replace(found, verdict="cannot_know", notes=(*found.notes, UNPLACED.format(joints=", ".join(unplaced))))
    unknown = None
    if found.verdict in NAMING:
        found, unknown = beside_nameless(evidence, found, machine, scales, channels, floor=floor)
        if unknown is None:
            found = decided(simulators, parts, found, **like)
    after: Any = found.evidence
    if found.verdict == "unknown" and unknown is None:
        unknown = find_unknown(
            after,
            machine,
            scales,
            setting=found.setting,
            on_progress=lambda done, total, what: told(0.9 + 0.1 * done / max(total, 1), 1, what),
        )
    setting = (*found.setting, *(unknown.setting if unknown is not None else ()))
    if any([term.hypothesis for term in part.assumed] != [term.hypothesis for term in setting] for part in after.parts):
        after = after.relinearised(setting)
    return replace(found, evidence=None), unknown, [comparison_of(part, setting) for part in after.parts]


def _unplaced(simulator: Any, evidence: ReplayEvidence) -> list[str]:
    """Joints that swing freely, whose position no channel shows."""
    if simulator.has_ground:
        return []
    held = {d.joint for d in simulator.machine().drives if d.mode != "torque" and d.speed_gain is None}
    starts = evidence.parts[0].starts
    return [
        c.name
        for c, seen in zip(starts.coordinates, starts.seen.T, strict=True)
        if c.kind == "joint" and not seen.any() and c.name not in held
    ]


def _experiments(simulator: Any, parts: Parts, found: Found, told: Told) -> tuple[Experiment, ...]:
    """What would tell the members of the best group apart."""
    if not found.ranked:
        return ()
    best = found.ranked[0]
    members = [row for row in found.ranked if row.group == best.group and row.probability > 0][:MOST_RIVALS]
    if len(members) < 2:
        return ()
    settings = [tuple(term.term for term in row.terms) for row in members]
    now = math.sqrt(2 * max(0.0, min(row.behind for row in members[1:])))
    return next_experiments(simulator, parts.training, settings, titles=[row.title for row in members], now=now, on_progress=told)


def _answer(
    simulator: Any,
    parts: Parts,
    location: Location,
    found: Found | None,
    unknown: Unknown | None,
    proof: Proof | None,
    experiments: tuple[Experiment, ...],
    cannot: tuple[str, ...],
    run: Staged,
    verdict: Verdict,
) -> Diagnosis:
    leftover = found.leftover if found is not None else 0.0
    terms = found.terms if found is not None else ()
    ranked = found.ranked if found is not None else ()
    groups = found.groups if found is not None else ()
    notes = (*(found.notes if found is not None else ()), *((FALSE_ALARM,) if found is not None and verdict == "nothing_missing" else ()))
    return Diagnosis(
        model=str(simulator.path),
        scenario=simulator.scenario,
        recordings=tuple(recording.name for recording in parts.training),
        held_out=tuple(recording.name for recording in parts.held_out),
        verdict=verdict,
        sentence=statement(
            verdict,
            terms,
            ranked,
            location,
            leftover,
            proof,
            (),
            cannot,
            unknown.sentence if unknown is not None else "",
            took_no_part(parts.training),
        ),
        location=location,
        setting=(*(found.setting if found is not None else ()), *(unknown.setting if unknown is not None else ())),
        ranked=ranked,
        groups=groups,
        proof=proof,
        experiments=experiments,
        data_problems=data_problems([*parts.training, *parts.held_out]),
        limits=cannot,
        leftover=leftover,
        unknown_like=unknown.sentence if unknown is not None else "",
        notes=notes,
        seconds=dict(run.seconds),
    )
