"""What these recordings cannot tell apart, and why the others lose: groups and sentences."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rille.diagnosis.evidence.evidence import Whole
from rille.diagnosis.inference.fit import Fitted, estimates
from rille.diagnosis.inference.rank import Scores
from rille.model.diagnosis import Estimate, Group
from rille.model.hypothesis import Setting, Term
from rille.model.recording import Channel

TIED = 3.0  # [nats] differences below this never count
ALIKE = 0.95  # correlation of what two change, beyond which twice the usual errors are needed to tell them apart
LITTLE = 0.3  # of what a law changes: a number that may do more than this within its interval is not needless
NOTHING = 1e-6  # of the end of its interval: a lower bound that is reached is zero
SAME = 0.99  # correlation beyond which an additional number changes nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class Confounded:
    """order : indices into the scores, best first. number (m,) : group of each (0: that of the best). needless (m,) : of each its simpler
    form, whose group it shares, if it has numbers that explain nothing more, else -1.
    """

    order: tuple[int, ...]
    number: tuple[int, ...]
    needless: tuple[int, ...]


def title_of(terms: Setting) -> str:
    """In words."""
    return " + ".join(term.hypothesis.title for term in terms) or "the model as it is"


def groups(scores: Scores, fitted: Sequence[Fitted], edges: Whole) -> Confounded:
    """Order and group fitted settings (entry i of ``fitted`` is i + 1 of the scores).

    Two are of one group if the better is not ahead by the errors that count (twice as many if what they change correlates by more than
    ``ALIKE``). A law with numbers that vanish, or that a simpler one of the same target matches, stands behind the simpler one. A parameter
    of the model stands before an effect that predicts no better by more than ``TIED``, if it has no more numbers; a law at one target
    before the same law at all of them, which claims more than these recordings show. What is far-fetched stands behind all of its group,
    and is of a group only if it is as good within ``TIED``.
    """
    order = sorted(range(1, len(fitted) + 1), key=lambda i: -scores.gain[i])
    vanishing = {i: _vanishing(fitted[i - 1], estimates(fitted[i - 1], edges), float(scores.moved[i])) for i in order}
    needless = [-1] * (len(fitted) + 1)
    for i in order:
        simpler = (j for j in order if i != j and needless[j] < 0 and _is_needless(i, j, scores, fitted, vanishing[i]))
        needless[i] = next(simpler, -1)
    sound = [i for i in order if needless[i] < 0]
    number = [-1] * (len(fitted) + 1)
    if sound:
        best = next((j for j in sound if not _far_fetched(fitted[j - 1]) and _one_group(scores, sound[0], j)), sound[0])
        first = next((j for j in sound if j != best and _tied(scores, best, j) and _is_simpler(j, best, scores, fitted)), best)
        sound = [first] + [i for i in sound if i != first]
        heads = [best]
        for i in sound:
            number[i] = next((k for k, head in enumerate(heads) if i == head or _belongs(i, head, scores, fitted)), len(heads))
            if number[i] == len(heads):
                heads.append(i)
        for i in order:
            if needless[i] >= 0:
                number[i] = number[_simplest(i, needless)]
    return Confounded(order=(*sound, *(i for i in order if needless[i] >= 0)), number=tuple(number), needless=tuple(needless))


def _simplest(i: int, needless: Sequence[int]) -> int:
    """What is left of i without any number that explains nothing."""
    while needless[i] >= 0:
        i = needless[i]
    return i


def described(confounded: Confounded, scores: Scores, titles: Sequence[str], probability: Sequence[float]) -> tuple[Group, ...]:
    """Groups with more than one member, and that of the best; titles and probability by index of the scores."""
    found = []
    for number in sorted({confounded.number[i] for i in confounded.order}):
        members = [i for i in confounded.order if confounded.number[i] == number]
        if len(members) < 2 and number != 0:
            continue
        head, others = members[0], members[1:]
        likeness = max((abs(float(scores.likeness[head, i])) for i in others), default=0.0)
        parts = [f"{titles[i]} ({_beside(confounded, scores, head, i)})" for i in others]
        sentence = f"these recordings cannot tell {titles[head]} from {', '.join(parts)}" if others else ""
        summed = float(sum(probability[i] for i in members))
        names = tuple(titles[i] for i in members)
        found.append(Group(number=number, members=names, probability=summed, correlation=likeness, sentence=sentence))
    return tuple(found)


def _beside(confounded: Confounded, scores: Scores, head: int, i: int) -> str:
    """How entry i of a group compares with its head."""
    if confounded.needless[i] >= 0:
        return "a wider law that explains no more"
    return f"{scores.likeness[head, i]:+.0%} alike, {_behind(scores, head, i)}"


def why_it_loses(
    i: int,
    best: int,
    scores: Scores,
    confounded: Confounded,
    titles: Sequence[str],
    fitted: Sequence[Fitted],
    channels: Sequence[Channel],
    excess: float,
    numbers: Sequence[Estimate] = (),
) -> str:
    """A sentence on why entry i stands behind the best; '' for the best itself. excess : chi-squared of the base beyond noise."""
    if i == best:
        return ""
    if confounded.needless[i] >= 0:
        simpler = confounded.needless[i]
        more = len(fitted[i - 1].unknowns) - len(fitted[simpler - 1].unknowns)
        return f"it explains no more than {titles[simpler]} with {more} number{'s' if more > 1 else ''} more"
    if confounded.number[i] == confounded.number[best]:
        return f"it is {_behind(scores, best, i)}: that is not enough to tell it from {titles[best]}"
    share = [(scores.chi2[0] - scores.chi2[k]) / excess if excess > 0 else np.nan for k in (i, best)]
    words = f"it takes away {share[0]:.0%} of what is beyond the noise, {titles[best]} {share[1]:.0%}; it is {_behind(scores, best, i)}"
    lost = scores.channel_chi2[i] - scores.channel_chi2[best]
    if len(channels) > 1 and np.max(lost) > 0:
        worst = int(np.argmax(lost))
        sizes = [float(np.sqrt(scores.channel_chi2[k, worst] / max(scores.channel_count[worst], 1.0))) for k in (i, best)]
        words += f", most of it on {channels[worst].name} ({sizes[0]:.2f} noise left instead of {sizes[1]:.2f})"
    stuck = next((e for e in numbers if e.at_bound), None)
    if stuck is None:
        return words
    at_nothing = stuck.at_bound == "lower" and abs(stuck.value) < NOTHING * abs(stuck.high)
    beyond = "below zero" if at_nothing else f"beyond its bound {stuck.value:g} {stuck.unit}"
    return f"{words}; it would need {stuck.name} {beyond}"


def _behind(scores: Scores, best: int, i: int) -> str:
    behind, error = float(scores.ahead[best, i]), float(scores.ahead_error[best, i])
    return f"{abs(behind):.3g} +- {error:.2g} nats {'behind' if behind >= 0 else 'ahead'}"


def _tied(scores: Scores, best: int, i: int) -> bool:
    """Whether the odds between two are small: which of a group stands first is a matter of likelihoods, not of their errors."""
    return bool(scores.ahead[best, i] <= TIED)


def _one_group(scores: Scores, best: int, i: int) -> bool:
    """What numbers are charged with is no evidence of the recordings: it orders, but does not tell apart."""
    alike = 2.0 if abs(scores.likeness[best, i]) > ALIKE else 1.0
    behind = scores.ahead[best, i] - (scores.charged[i] - scores.charged[best])
    return bool(behind <= alike * max(scores.needed * scores.ahead_error[best, i], TIED))


def _belongs(i: int, head: int, scores: Scores, fitted: Sequence[Fitted]) -> bool:
    """Whether i is of the group of a head. Of two that are far-fetched neither has less to prove."""
    less = _far_fetched(fitted[i - 1]) and not _far_fetched(fitted[head - 1])
    return scores.ahead[head, i] <= TIED if less else _one_group(scores, head, i)


def _far_fetched(one: Fitted) -> bool:
    return any(term.is_far_fetched for term in one.setting)


def _is_simpler(i: int, j: int, scores: Scores, fitted: Sequence[Fitted]) -> bool:
    """Whether i is to stand before j, that it ties with: parameters where j has effects, with no more numbers; j's law with fewer, or at
    one target where j has it at all.
    """
    one, other = fitted[i - 1], fitted[j - 1]
    if _far_fetched(one) and not _far_fetched(other):
        return False
    if is_narrower(one.setting, other.setting):
        return True
    parameters = all(t.hypothesis.cause == "parameter" for t in one.setting) and any(
        t.hypothesis.cause != "parameter" for t in other.setting
    )
    if parameters:
        return one.count <= other.count
    return len(one.unknowns) < len(other.unknowns) and scores.likeness[i, j] > SAME and _targets(one, other) == _targets(other, one)


def is_narrower(one: Setting, other: Setting) -> bool:
    """Whether one is the other with laws at single targets where that has them at all ('*')."""
    mine, its = _different(one, other), _different(other, one)
    return bool(mine) and all(t.hypothesis.target == "*" for t in its) and _kinds(mine) == _kinds(its)


def _kinds(terms: Sequence[Term]) -> list[tuple[str, str]]:
    return sorted((t.hypothesis.cause, t.hypothesis.kind) for t in terms)


def _vanishing(one: Fitted, numbers: Sequence[Sequence[Estimate]], moved: float) -> list[bool]:
    """Of each term, whether an amplitude is not told from absence by twice its interval, and changes little (against ``moved``) in it."""
    found = [False] * len(one.setting)
    for k, unknown in enumerate(one.unknowns):
        names = [number.name for number in one.setting[unknown.term].hypothesis.free]
        e = numbers[unknown.term][names.index(unknown.number.name)]
        reach = float(np.linalg.norm(one.jacobian[k])) * max(e.high - e.value, e.value - e.low)
        untold = 2 * e.low - e.value <= unknown.number.absent <= 2 * e.high - e.value
        if unknown.number.amplitude and untold and reach < LITTLE * moved:
            found[unknown.term] = True
    return found


def _is_needless(i: int, j: int, scores: Scores, fitted: Sequence[Fitted], vanishing: Sequence[bool]) -> bool:
    """Whether i is j with numbers more that explain nothing."""
    one, other = fitted[i - 1], fitted[j - 1]
    if len(one.unknowns) <= len(other.unknowns) or not scores.likeness[i, j] > SAME or scores.clearly_ahead(i, j, TIED):
        return False
    mine = _different(one.setting, other.setting)
    if not _different(other.setting, one.setting):
        return True
    return _targets(other, one) <= _targets(one, other) and any(vanishing[k] for k, term in enumerate(one.setting) if term in mine)


def _targets(one: Fitted, other: Fitted) -> set[str]:
    return {t.hypothesis.target for t in _different(one.setting, other.setting)}


def _different(one: Setting, other: Setting) -> list[Term]:
    named = {(t.hypothesis.cause, t.hypothesis.kind, t.hypothesis.target) for t in other}
    return [t for t in one if (t.hypothesis.cause, t.hypothesis.kind, t.hypothesis.target) not in named]
