"""What the search has found, put in the words of a diagnosis: ranking, groups, probabilities, verdict."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rille.diagnosis.evidence.evidence import Evidence
from rille.diagnosis.inference.accept import noise_of
from rille.diagnosis.inference.confound import Confounded, described, groups, title_of, why_it_loses
from rille.diagnosis.inference.fit import Fitted, estimates
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.rank import TWINS, Scores, rank
from rille.diagnosis.inference.weights import probabilities
from rille.model.diagnosis import NAN, Estimate, Group, NamedTerm, RankedHypothesis, Verdict
from rille.model.effect import EffectKind
from rille.model.hypothesis import Setting

UNKNOWN = 0.3  # share of the excess left by one piece, beyond which the catalogue has no name for the rest
EACH_MORE = 0.5  # factor on that for each further piece: several pieces fit anything better
FETCHED = 0.3  # factor on that for what is far-fetched
MOST_MEMBERS = 8  # kinds of one group, beyond which nothing could be told


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """The answer of ``search``.

    setting : accepted terms at their fitted values, those that were always there first. terms : the accepted ones with intervals.
    leftover : share of the base's excess that the setting leaves. chi2_before, degrees : of the base; chi2_after, degrees_after : of the
    setting, starts fitted under it. kappa : over-dispersion that is left. nothing : probability of none of the catalogue. evidence :
    relinearised at ``setting``. replays : settings that were run.
    """

    verdict: Verdict
    setting: Setting
    terms: tuple[NamedTerm, ...]
    ranked: tuple[RankedHypothesis, ...]
    groups: tuple[Group, ...]
    leftover: float
    chi2_before: float
    chi2_after: float
    degrees: float
    degrees_after: float
    kappa: float
    nothing: float
    evidence: Evidence
    replays: int
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """Alternatives, fitted and ranked. judge : of the base, under its own starts. Entry i of ``fitted`` is i + 1 of the scores."""

    judge: Judge
    fitted: tuple[Fitted, ...]
    scores: Scores
    confounded: Confounded


def stand(judge: Judge, evidence: Evidence, fitted: Sequence[Fitted]) -> Standing:
    """Fitted alternatives among each other. judge : of the base. evidence : in the same windows, whatever its starts."""
    scores = rank(evidence, fitted, judge=judge)
    return Standing(judge=judge, fitted=tuple(fitted), scores=scores, confounded=groups(scores, fitted, judge.metric.edges))


def leftover_share(before: Judge, after: Judge) -> float:
    """Share of the excess of one judge's base that another's leaves, chance set aside; NaN where there was no excess."""
    noise = noise_of(before, after.chi2, after.degrees)
    excess = before.chi2 - noise * before.degrees
    chance = 2.0 * noise * float(np.sqrt(2.0 * after.degrees))
    return max(0.0, after.chi2 - noise * after.degrees - chance) / excess if excess > 0 else NAN


def named_terms(numbers: Sequence[tuple[Estimate, ...]], setting: Setting, kinds: Mapping[str, EffectKind]) -> tuple[NamedTerm, ...]:
    """Terms with their intervals, and what the catalogue says of them."""
    found = []
    for each, term in zip(numbers, setting, strict=True):
        kind = kinds.get(term.hypothesis.kind) if term.hypothesis.cause != "parameter" else None
        found.append(NamedTerm(term=term, estimates=tuple(each), equation=kind.equation if kind else "", source=kind.source if kind else "",
                               meaning=kind.meaning if kind else ""))  # fmt: skip
    return tuple(found)


def ranked(
    standing: Standing, always: int, leftover: float, kinds: Mapping[str, EffectKind]
) -> tuple[tuple[RankedHypothesis, ...], tuple[Group, ...], float]:
    """Alternatives with probabilities, best first; groups; probability of none. always : leading terms that are no part of the answer."""
    scores, confounded, order = standing.scores, standing.confounded, standing.confounded.order
    if not order:
        return (), (), 1.0
    best = order[0]
    edges = standing.judge.metric.edges
    titles = ["the model as it is"] + [title_of(one.setting[always:]) for one in standing.fitted]
    judged = [i for i in order if confounded.needless[i] < 0]
    behind = np.maximum(np.array([scores.ahead[best, i] for i in (*judged, 0)]), 0.0)
    weight, none = probabilities(behind, np.array([scores.ahead_error[best, i] for i in (*judged, 0)]), leftover)
    probability = [0.0] * len(titles)
    for i, p in zip(judged, weight[:-1], strict=True):
        probability[i] = float(p)
    lowest = min(standing.fitted, key=lambda one: one.chi2)
    excess = standing.judge.chi2 - noise_of(standing.judge, lowest.chi2, lowest.degrees) * standing.judge.degrees
    found = []
    for i in order:
        one = standing.fitted[i - 1]
        numbers = estimates(one, edges)[always:]
        flat = [e for term in numbers for e in term]
        found.append(
            RankedHypothesis(
                terms=named_terms(numbers, one.setting[always:], kinds),
                title=titles[i],
                cause=one.setting[-1].hypothesis.cause,
                probability=probability[i],
                gain=float(scores.gain[i]),
                gain_error=float(scores.ahead_error[i, 0]),
                explained=float((scores.chi2[0] - scores.chi2[i]) / excess) if excess > 0 else NAN,
                group=confounded.number[i],
                behind=float(scores.ahead[best, i]),
                behind_error=float(scores.ahead_error[best, i]),
                bic=float(scores.bic[i]),
                loses_because=why_it_loses(
                    i, best, scores, confounded, titles, standing.fitted, standing.judge.evidence.channels, excess, flat
                ),
            )
        )
    return tuple(found), described(confounded, scores, titles, probability), min(1.0, none + float(weight[-1]))


def with_doubt(found: Found, none: float) -> Found:
    """The answer with at least this probability of none of the catalogue; all others in proportion."""
    if none <= found.nothing:
        return found
    ranked, groups = less_probable(found.ranked, found.groups, (1.0 - none) / max(1.0 - found.nothing, 1e-12))
    return replace(found, nothing=none, ranked=ranked, groups=groups)


def less_probable(
    ranked: Sequence[RankedHypothesis], groups: Sequence[Group], factor: float
) -> tuple[tuple[RankedHypothesis, ...], tuple[Group, ...]]:
    """Alternatives and their groups with probabilities times a factor."""
    return (
        tuple(replace(row, probability=row.probability * factor) for row in ranked),
        tuple(replace(group, probability=group.probability * factor) for group in groups),
    )


def _is_a_number_by_another_name(standing: Standing, best: int, i: int) -> bool:
    """Whether the best only changes numbers of the model, and i is a law that does the very same: no physics need be missing then."""
    one, other = ({t.hypothesis.cause for t in standing.fitted[k - 1].setting if t not in standing.judge.on_top} for k in (best, i))
    return one == {"parameter"} and "effect" in other and abs(float(standing.scores.likeness[best, i])) > TWINS


def verdict_of(standing: Standing, accepted: Setting, leftover: float) -> Verdict:
    """Of an answer with accepted terms."""
    most = UNKNOWN * (FETCHED if any(term.is_far_fetched for term in accepted) else 1.0)
    if leftover > most * EACH_MORE ** (len(accepted) - 1):
        return "unknown"
    confounded = standing.confounded
    members = [i for i in confounded.order if confounded.number[i] == 0 and confounded.needless[i] < 0]
    members = [i for i in members if not _is_a_number_by_another_name(standing, members[0], i)]
    terms = [t.hypothesis for i in members for t in standing.fitted[i - 1].setting] or [t.hypothesis for t in accepted]
    if len({t.kind for t in terms}) > MOST_MEMBERS:
        return "cannot_know"
    own = {t.hypothesis.cause for t in accepted}
    causes = own | {t.cause for t in terms}
    if causes == {"parameter"}:
        return "parameter"
    if causes == {"sensor"}:
        return "sensor_fault"
    return "group" if len(members) > 1 else "named"
