"""What a law without a name does beside an answer, where that acts: better, as well with fewer numbers, or nearly as well.

The catalogue does not hold all that there is. Drag with the root of the speed is followed by drag in proportion to it, a cable at a joint
by a push, a seal that drags one way by dry friction and a drift of the sensor beside it: each of them to the noise, in a short recording.
So what has a name competes with laws that have none (``formulas.py``), fitted at the same place under starts of their own. What decides is
chi-squared and what the numbers cost (Schwarz 1978):

    d = (chi2 of the law - chi2 of the answer) / kappa + (numbers of the law - numbers of the answer) log n
    odds of the law = PRIOR exp(-d / (2 temperature)),   temperature : as of ``weights.py``

Only numbers that the recordings tell cost anything: an open one has fitted nothing. But what is about a moment, a push, is made for the one
recording; all its numbers count. Two causes that meet at one place are rarer than one law, so there both begin alike; before one cause a
law without a name has something to make up.

One cause with many numbers at a body (a cable that comes taut) follows any spring that begins somewhere: where such a law does as well with
fewer numbers, told or not, the two are even. So are two words for one thing: at a wheel that never reverses a constant torque is dry
friction, and what little they differ by, where it stands at first, is no reason to give up the name while it tells less than ``TIED``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from rille.diagnosis.evidence.evidence import Evidence
from rille.diagnosis.hypotheses.formulas import TargetKind, sharper
from rille.diagnosis.hypotheses.natural import Natural
from rille.diagnosis.inference.confound import SAME, TIED
from rille.diagnosis.inference.fit import is_told
from rille.diagnosis.inference.found import Found, with_doubt
from rille.diagnosis.inference.judge import Judge, cosine
from rille.diagnosis.inference.moments import is_momentary
from rille.diagnosis.inference.unknown import Progress, Unknown, find_unknown, share_explained
from rille.diagnosis.inference.weights import calibration
from rille.model.diagnosis import NamedTerm
from rille.model.hypothesis import Hypothesis, Setting
from rille.model.machine import Machine
from rille.model.recording import Channel

PRIOR, PRIOR_OF_SEVERAL = 1 / 3, 1.0  # odds of a law without a name before one cause, and before several
MANY = 4  # numbers of one cause at a body, from which on fewer are a matter of taste
EVEN = 0.5  # probability of none of the catalogue, where one law without a name does what one with a name does
WORTH_A_WORD = 0.15  # the same, from which on it is told
STANDS = 0.5  # the same, above which the law stands instead
SHARPER = 0.1  # of the speed over which its sign changes: dry friction of a machine turns round faster than a screen needs
BEHIND = 0.2  # share of what is beyond the noise, that a law explains less than the answer, from which on other starts cannot help it
INSTEAD = (
    "{answer} would explain it, too, but a law without a name at {place}, {formula}, does {well}: it only acts like what is missing, or is "
    "not alone"
)
BESIDE = "a law without a name at {place}, {formula}, does nearly as well as {answer}: it may be either"
Place = tuple[TargetKind, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rival:
    """A law at a place. better [nats] : than the answer, by chi-squared alone. cost, full_cost : d with the answer's numbers that are told,
    and with all of them.
    """

    law: Unknown
    place: Place
    judge: Judge
    better: float
    cost: float
    full_cost: float


def beside_nameless(
    evidence: Evidence,
    found: Found,
    machine: Machine,
    scales: Natural,
    channels: Sequence[Channel],
    *,
    floor: float,
    on_progress: Progress = None,
) -> tuple[Found, Unknown | None]:
    """The answer beside laws without a name where it acts. The best of them stands instead, and is returned, too, where it is more likely
    than not; else the answer is as likely as it leaves. As it is where no law can act, and where only numbers of the model are wrong.

    Parameters
    ----------
    evidence : beside the base model. found : an answer that names causes. floor : as of ``search``.
    """
    if all(term.hypothesis.cause == "parameter" for term in found.setting) or len(found.terms) != len(found.setting):
        return found, None
    rivals = [
        rival
        for place in places_of(found.setting, machine, channels)
        if (rival := _at_place(evidence, found, machine, scales, place, floor, on_progress)) is not None
    ]
    if not rivals:
        return found, None
    best = min(rivals, key=lambda one: one.cost)
    none = _probability(rivals, found.setting, lambda law: _likeness(evidence, found, law.judge))
    answer = " + ".join(term.hypothesis.title for term in found.setting)
    told = {"answer": answer, "formula": best.law.formula, "place": f"{best.place[0]} '{best.place[1]}'"}
    if none > STANDS:
        well = "better" if best.judge.chi2 < found.chi2_after else "as well with fewer numbers"
        note = INSTEAD.format(**told, well=well)
        instead = replace(
            with_doubt(found, none),
            verdict="unknown",
            setting=(),
            terms=(),
            evidence=best.judge.evidence,
            chi2_after=best.judge.chi2,
            degrees_after=best.judge.degrees,
            notes=(*found.notes, note),
        )
        return instead, best.law
    if none < WORTH_A_WORD:
        return with_doubt(found, none), None
    verdict = found.verdict if found.verdict == "sensor_fault" else "group"
    return replace(with_doubt(found, none), verdict=verdict, notes=(*found.notes, BESIDE.format(**told))), None


def _probability(rivals: Sequence[_Rival], setting: Setting, likeness: Callable[[_Rival], float]) -> float:
    """Of a law without a name, where an answer has these rivals. likeness : correlation of what one and the answer change; it takes two
    replays, and is asked where it matters.
    """
    best = min(rivals, key=lambda one: one.cost)
    none = _odds(best.cost, PRIOR_OF_SEVERAL if len(setting) > 1 else PRIOR)
    if _is_wide(setting) and all(one.better < TIED for one in rivals):
        none = _odds(min(one.full_cost for one in rivals), 1.0)
    elif not (best.better < TIED and likeness(best) > SAME):
        return none
    return min(EVEN, none)


def places_of(setting: Setting, machine: Machine, channels: Sequence[Channel]) -> list[Place]:
    """Where one law could do what a setting does: the joints through which each of its terms may act, and the body that it acts on; of
    several terms only where all of them may. What acts on all joints acts on any that another term is at, and has no place of its own.
    """
    each = [_places(term.hypothesis, machine, channels) for term in setting if term.hypothesis.target != "*"]
    return [place for place in each[0] if all(place in others for others in each[1:])] if each else []


def _places(hypothesis: Hypothesis, machine: Machine, channels: Sequence[Channel]) -> list[Place]:
    joints = [j.name for j in machine.joints if j.kind in ("hinge", "prismatic")]
    target = hypothesis.target
    if hypothesis.cause == "sensor":
        target = next((c.target for c in channels if c.name == target), "")
    driven = next((d.joint for d in machine.drives if d.name == target), target)
    if driven in joints:
        return [("joint", driven)]
    if target not in {body.name for body in machine.bodies}:
        return []
    return [*(("joint", name) for name in _carrying(machine, target) if name in joints), ("body", target)]


def _carrying(machine: Machine, body: str) -> list[str]:
    """Joints between a body and the world or the root, its own first."""
    found, by_child = [], {j.child: j for j in machine.joints}
    while body in by_child and by_child[body].name not in found:
        found.append(by_child[body].name)
        body = by_child[body].parent
    return found


def _is_wide(setting: Setting) -> bool:
    """Whether it is one effect at a body with many numbers, and lasts."""
    hypothesis = setting[0].hypothesis
    return len(setting) == 1 and hypothesis.target_kind == "body" and len(hypothesis.free) >= MANY and not is_momentary(hypothesis)


def _odds(cost: float, prior: float) -> float:
    """Probability of a law without a name by d."""
    return float(expit(np.log(prior) - 0.5 * cost / calibration().temperature))


def _at_place(
    evidence: Evidence, found: Found, machine: Machine, scales: Natural, place: Place, floor: float, on_progress: Progress
) -> _Rival | None:
    """The best law without a name at a place, beside the answer; None if none changes anything, or the best is far behind."""
    law = find_unknown(evidence, machine, scales, targets=[place], most=2, nameless=True, on_progress=on_progress)
    if law is None or law.explained < share_explained(found.chi2_before, found.chi2_after, found.degrees) - BEHIND:
        return None
    shapes = [law.setting, sharper(law.setting, SHARPER)]
    judges = [Judge(evidence.relinearised(setting), setting, floor=floor) for setting in shapes]
    judge = min(judges, key=lambda one: one.chi2)
    least = min(judge.chi2 / max(judge.degrees, 1.0), found.chi2_after / max(found.degrees_after, 1.0))
    more = (judge.chi2 - found.chi2_after) / max(floor, least)
    each = np.log(max(judge.degrees, 2.0))
    return _Rival(
        law=replace(law, setting=judge.on_top),
        place=place,
        judge=judge,
        better=-0.5 * more,
        cost=more + (law.numbers - sum(_told(term) for term in found.terms)) * each,
        full_cost=more + (law.numbers - sum(len(term.term.hypothesis.free) for term in found.terms)) * each,
    )


def _likeness(evidence: Evidence, found: Found, law: Judge) -> float:
    """Correlation of what an answer and a law change in what the base leaves."""
    base, answer = Judge(evidence).base, Judge(found.evidence, found.setting).base
    return cosine(answer - base, law.base - base)


def _told(named: NamedTerm) -> int:
    """Numbers of a term that cost something: those that the recordings tell, of what is about a moment all; at least one."""
    free = named.term.hypothesis.free
    if is_momentary(named.term.hypothesis):
        return len(free)
    return max(1, sum(is_told(number, estimate) for number, estimate in zip(free, named.estimates, strict=True)))
