"""What a diagnosis is worth, when the truth is known."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from making import Truth
from subjects import subject
from trials import trial_named

from rille.diagnosis.bench.bench_rig import LOG
from rille.model.diagnosis import NAMING, Diagnosis, RankedHypothesis
from rille.model.hypothesis import Hypothesis, Term
from rille.proof.scoring import SYNONYMS
from rille.proof.subject import Subject, near

CLASS_OF = {"none": "nothing_missing", "parameter": "parameter", "sensor": "sensor_fault"}  # verdict that says what it is


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """One trial. top : the best answer is the truth alone. grouped : the truth is in the group of the best. abstained : no name was given.
    wrong : a name was given, and the truth is not in its group. target : the best answer's target is right. located : the truth's place is
    among those found to differ most. classed : the verdict says what sort of thing it is. error : of the amplitudes, relative; NaN unless
    the truth was named. gap : G. answer : title of the best. probability : of its group.
    """

    trial: str
    strength: float
    verdict: str
    answer: str
    top: bool
    grouped: bool
    abstained: bool
    wrong: bool
    target: bool
    located: bool
    classed: bool
    error: float
    gap: float
    probability: float
    leftover: float = float("nan")
    seconds: float = 0.0
    behind: tuple[float, ...] = ()
    behind_error: tuple[float, ...] = ()
    place: int = -1  # of the truth among the ranked, -1: not there


def scored(truth: Truth, answer: Diagnosis, seconds: float) -> Score:
    """The score of one answer."""
    trial = trial_named(truth.trial)
    machine = subject(trial.machine)
    names = answer.verdict in NAMING
    ranked = answer.ranked
    best = ranked[0] if ranked else None
    right = [not trial.concealed and _is_truth(entry, truth, machine) for entry in ranked]
    top = names and bool(right) and right[0]
    grouped = names and any(ok for ok, entry in zip(right, ranked, strict=True) if best is not None and entry.group == best.group)
    if truth.cause == "none":
        top = grouped = False
    said = [term.term for term in best.terms] if best is not None else []
    group = next((g for g in answer.groups if best is not None and g.number == best.group), None)
    named = next((term for term in said if same(term.hypothesis, truth, machine)), None)
    wanted = CLASS_OF.get(truth.cause, answer.verdict if names and said and said[0].hypothesis.cause == "effect" else "")
    classed = answer.verdict == wanted or (truth.cause == "parameter" and top)  # a wrong mass is what the catalogue calls a change of mass
    return Score(
        trial=truth.trial,
        strength=truth.strength,
        verdict=answer.verdict,
        answer=best.title if names and best is not None else "",
        top=top,
        grouped=grouped,
        abstained=not names,
        wrong=names and not grouped,
        target=names and any(_same_target(term.hypothesis, truth, machine) for term in said),
        located=_located(answer, truth, machine),
        classed=answer.verdict in ("unknown", "cannot_know") if trial.concealed else classed,
        error=relative_error(named, truth, machine) if named is not None and names else float("nan"),
        gap=answer.proof.gap_closed if answer.proof is not None else float("nan"),
        probability=group.probability if group is not None else best.probability if best is not None else float("nan"),
        seconds=seconds,
        behind=tuple(entry.behind for entry in ranked),
        behind_error=tuple(entry.behind_error for entry in ranked),
        place=right.index(True) if True in right else -1,
        leftover=answer.leftover,
    )


def _is_truth(entry: RankedHypothesis, truth: Truth, machine: Subject) -> bool:
    """Whether an entry is the truth and nothing else."""
    return len(entry.terms) == 1 and same(entry.terms[0].term.hypothesis, truth, machine)


def same(hypothesis: Hypothesis, truth: Truth, machine: Subject) -> bool:
    """Whether a hypothesis says what is wrong."""
    kinds = (truth.kind, *SYNONYMS.get((truth.cause, truth.kind), ()))
    if hypothesis.kind != truth.kind and hypothesis.target_kind == "soil":  # every wheel stands on it
        return hypothesis.kind in kinds
    return hypothesis.kind in kinds and _same_target(hypothesis, truth, machine)


def _same_target(hypothesis: Hypothesis, truth: Truth, machine: Subject) -> bool:
    if truth.cause == "sensor":
        whole = truth.kind == "clock_skew" and truth.target.startswith(hypothesis.target.rpartition(" of ")[2])  # all that the clock stamps
        return hypothesis.cause == "sensor" and (hypothesis.target == truth.target or hypothesis.target_kind == "clock" or whole)
    if truth.target == "*":
        return hypothesis.target in ("*", "") or hypothesis.target_kind in ("world", "terrain")
    if hypothesis.target == "*":  # all of one
        return hypothesis.target_kind == "wheel" and len(machine.rover.wheels) == 1
    return hypothesis.target == truth.target


def _located(answer: Diagnosis, truth: Truth, machine: Subject) -> bool:
    """Whether the place of what is wrong is among the three targets that hold most of the difference. Neighbours in the chain of joints
    count: a friction moves the bodies on both sides. What acts on everything is everywhere.
    """
    found = [target.name for target in sorted(answer.location.targets, key=lambda t: -t.share) if target.differs][:3]
    if truth.target == "*":
        return bool(found)
    if truth.cause == "sensor":
        return any(truth.target.startswith(name) for name in found)
    return bool(set(near(machine, truth.target)) & set(found))


def relative_error(term: Term, truth: Truth, machine: Subject) -> float:
    """|estimate - truth| / |truth| of the amplitudes as one vector; of a wrong number of the model in proportion to the number itself."""
    numbers, hypothesis = term.numbers, term.hypothesis
    if truth.cause == "parameter":
        if hypothesis.kind == "mass_change":
            mass = next(b.properties.mass for b in machine.rover.bodies if b.name == truth.target)
            change = numbers["mass"] / mass
        else:
            free = hypothesis.free[0]
            value = numbers[free.name]
            change = float(np.expm1(value)) if free.name == LOG else value / free.absent - 1.0
        if truth.kind == "friction_angle":
            angle = next(soil.friction_angle for soil in machine.terrain.soils)  # type: ignore[union-attr]
            change = float(np.tan(angle * (1 + change)) / np.tan(angle)) - 1.0
        wanted = next(value for value in truth.numbers.values())
        return abs(change - wanted) / abs(1.0 + wanted)
    amplitudes = [free.name for free in hypothesis.free if free.amplitude and free.name in truth.numbers]
    given = np.array([truth.numbers[name] for name in amplitudes])
    said = np.array([numbers[name] for name in amplitudes])
    size = float(np.linalg.norm(given))
    return float(np.linalg.norm(said - given)) / size if size > 0 else float("nan")


def median(values: Sequence[float]) -> float:
    """Of the finite ones; NaN if there are none."""
    good = [value for value in values if np.isfinite(value)]
    return float(np.median(good)) if good else float("nan")
