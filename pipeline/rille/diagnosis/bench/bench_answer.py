"""The answer of a bench search as a diagnosis says it: ranking, groups, intervals, proof."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import t as t_distribution

from rille.diagnosis.answer.prove import left_share
from rille.diagnosis.bench.bench_calibration import Calibrated, free_numbers
from rille.diagnosis.bench.bench_evidence import BenchEvidence
from rille.diagnosis.bench.bench_hypotheses import unit_of_soil
from rille.diagnosis.bench.bench_rig import LOG
from rille.diagnosis.bench.bench_search import BenchFound, Rival, Round, without
from rille.diagnosis.comparison.pooled import root_mean_square
from rille.diagnosis.evidence.evidence import Array, Whole
from rille.diagnosis.inference.found import named_terms
from rille.diagnosis.inference.weights import probabilities
from rille.model import EffectKind
from rille.model.diagnosis import ChannelFit, Estimate, Group, NamedTerm, Proof, RankedHypothesis
from rille.model.hypothesis import Setting, Term

AT_BOUND = 1e-6  # [spread]


def term_estimates(fitted: Calibrated, windows: int) -> list[tuple[Estimate, ...]]:
    """Of each term its numbers with 95 % intervals; the misfit that is left counts as noise. windows : that the points came in."""
    numbers = free_numbers(fitted.setting)
    values = [value for term in fitted.setting for value in term.values]
    n, p = fitted.jacobian.shape
    kappa = max(1.0, fitted.chi2 / max(n - p, 1))
    precision = fitted.jacobian.T @ fitted.jacobian / kappa
    covariance = np.linalg.pinv(precision + 1e-2 * np.eye(p), hermitian=True)
    alone = 1 / np.maximum(np.diagonal(precision) + 1e-2, 1e-12)
    quantile = float(t_distribution.ppf(0.975, max(windows - 1, 1)))
    found = []
    for k, (number, value) in enumerate(zip(numbers, values, strict=True)):
        error = quantile * number.spread * float(np.sqrt(covariance[k, k]))
        bound = "lower" if value - number.lower <= AT_BOUND * number.spread else ""
        bound = "upper" if number.upper - value <= AT_BOUND * number.spread else bound
        found.append(
            Estimate(
                name=number.name,
                unit=number.unit,
                value=value,
                low=max(value - error, number.lower),
                high=min(value + error, number.upper),
                at_bound=bound,
                conditioning=float(np.sqrt(max(0.0, 1 - alone[k] / covariance[k, k]))),
            )
        )
    result = []
    for term in fitted.setting:
        count = len(term.hypothesis.free)
        result.append(tuple(found[:count]))
        found = found[count:]
    return result


def shown(estimates: Sequence[tuple[Estimate, ...]], setting: Setting, kinds: Mapping[str, EffectKind]) -> tuple[NamedTerm, ...]:
    """Terms with their intervals; a parameter in its own unit instead of the logarithm of a factor."""
    return named_terms([_absolute(term, each) for term, each in zip(setting, estimates, strict=True)], setting, kinds)


def _absolute(term: Term, estimates: tuple[Estimate, ...]) -> tuple[Estimate, ...]:
    hypothesis = term.hypothesis
    if hypothesis.target_kind != "soil" or hypothesis.free[0].name != LOG:
        return estimates
    ((_, _, value),) = hypothesis.moves
    (one,) = estimates
    low, mid, high = (value * float(np.exp(x)) for x in (one.low, one.value, one.high))
    return (replace(one, name=hypothesis.kind, unit=unit_of_soil(hypothesis.kind), value=mid, low=low, high=high),)


def soil_terms(fitted: Calibrated, windows: int) -> tuple[NamedTerm, ...]:
    """Numbers of the soil that a calibration has moved beyond their interval, in the units of the model, the surest first."""
    rows = []
    for term, each in zip(fitted.setting, term_estimates(fitted, windows), strict=True):
        hypothesis = term.hypothesis
        if hypothesis.target_kind != "soil":
            continue
        (number,), (one,) = hypothesis.free, each
        if not one.low <= number.absent <= one.high:
            surety = abs(one.value - number.absent) / max(one.high - one.low, 1e-12)
            rows.append((surety, NamedTerm(term=term, estimates=_absolute(term, each))))
    return tuple(named for _, named in sorted(rows, key=lambda row: -row[0]))


def ranking(
    found: BenchFound, evidence: BenchEvidence, kinds: Mapping[str, EffectKind]
) -> tuple[tuple[RankedHypothesis, ...], tuple[Group, ...]]:
    """Rivals of the round that gave the last piece (of the first round if none did), best first; groups of all rounds with a piece."""
    if not found.rounds:
        return (), ()
    accepted = len(found.best.extra)
    last = found.rounds[max(accepted - 1, 0)]
    weight, _ = probabilities(np.maximum(last.behind, 0.0), last.behind_error, found.leftover if accepted else 1.0)
    ranked = tuple(_row(last, k, float(weight[k]), evidence, kinds) for k in range(len(last.rivals)))
    groups = []
    for number, one in enumerate(found.rounds[: max(accepted, 1)]):
        if len(one.group) < 2:
            continue
        members = tuple(one.rivals[k].title for k in one.group)
        own = one is last
        groups.append(
            Group(
                number=0 if own else 100 + number,
                members=members,
                probability=float(sum(weight[k] for k in one.group)) if own else float("nan"),
                correlation=_likeness(one),
                sentence=f"{', '.join(members)}: each predicts curves that were left out about as well as the others",
            )
        )
    return ranked, tuple(groups)


def _row(one: Round, k: int, probability: float, evidence: BenchEvidence, kinds: Mapping[str, EffectKind]) -> RankedHypothesis:
    rival = one.rivals[k]
    numbers = term_estimates(rival.whole, len(evidence.labels))
    count = len(rival.extra)
    excess = one.base.whole.chi2 - len(evidence.window)
    loses = ""
    if k not in one.group:
        loses = (
            f"predicts points left out {one.behind[k]:.1f} +- {one.behind_error[k]:.1f} nats worse than {one.rivals[0].title}: "
            f"RMS {root_mean_square(rival.held_out):.2f} against {root_mean_square(one.rivals[0].held_out):.2f} times the noise"
        )
    elif k > 0:
        loses = (
            f"it is {one.behind[k]:.1f} +- {one.behind_error[k]:.1f} nats behind: that is not enough to tell it from {one.rivals[0].title}"
        )
    return RankedHypothesis(
        terms=shown(numbers[len(numbers) - count :], rival.extra, kinds),
        title=rival.title,
        cause=rival.extra[-1].hypothesis.cause,
        probability=probability,
        gain=float(one.gain[k]),
        gain_error=float(one.error[k]),
        explained=float((one.base.whole.chi2 - rival.whole.chi2) / excess) if excess > 0 else float("nan"),
        group=0 if k in one.group else 1 + k,
        behind=float(one.behind[k]),
        behind_error=float(one.behind_error[k]),
        loses_because=loses,
    )


def _likeness(one: Round) -> float:
    """Largest correlation of what the members of the group change with what the first does."""
    changes = [one.rivals[k].whole.residual - one.base.whole.residual for k in one.group]
    first = changes[0]
    return max(float(first @ c / max(np.linalg.norm(first) * np.linalg.norm(c), 1e-12)) for c in changes[1:])


def gap_closed(before: Array, after: Array) -> float:
    """G = (R0 - R1)/(R0 - 1) of residuals in sigmas."""
    first, second = root_mean_square(before), root_mean_square(after)
    return (first - second) / (first - 1) if first > 1 else 0.0


def proof(
    evidence: BenchEvidence, before: Array, after: Array, part: Whole, how: str, ablation: tuple[tuple[str, float], ...] = ()
) -> Proof:
    """Residuals (N,) of points that were not fitted, before and after. part (N,) : what is left out for the interval (jackknife)."""
    whole = gap_closed(before, after)
    names = np.unique(part)
    n = len(names)
    leave = np.array([gap_closed(before[part != p], after[part != p]) for p in names])
    error = float(np.sqrt((n - 1) / n * ((leave - leave.mean()) ** 2).sum())) if n > 1 else float("nan")
    reach = float(t_distribution.ppf(0.975, max(n - 1, 1))) * error
    rows = []
    for p in evidence.parts:
        sigma = float(evidence.sigma[p.place][0]) if len(p.place) else float("nan")
        rows.append(
            ChannelFit(
                recording=evidence.rigs[p.rig].recording.name,
                channel=p.channel.name,
                held_out=True,
                unit=p.channel.unit,
                rms_before=sigma * root_mean_square(before[p.place]),
                rms_after=sigma * root_mean_square(after[p.place]),
                floor=sigma,
            )
        )
    return Proof(
        gap_closed=whole,
        low=whole - reach,
        high=min(whole + reach, 1.0),
        before=root_mean_square(before),
        after=root_mean_square(after),
        floor=1.0,
        held_out=how,
        left=_left(evidence, before, after),
        channels=tuple(rows),
        ablation=ablation,
    )


def _left(evidence: BenchEvidence, before: Array, after: Array) -> float:
    """``left_share`` of residuals (N,), whose noise may not be known well."""
    n = len(after)
    chance = float(np.hypot(np.sqrt(2.0 * n), evidence.noise_error))
    return left_share((float(before @ before) - n, float(after @ after) - n), (chance, chance))


def ablation(evidence: BenchEvidence, found: BenchFound) -> tuple[tuple[str, float], ...]:
    """(title, gap that is not closed without it) of each piece of an answer with several."""
    if len(found.best.extra) < 2:
        return ()
    whole = gap_closed(found.first.held_out, found.best.held_out)
    return tuple(
        (term.hypothesis.title, whole - gap_closed(found.first.held_out, without(evidence, found, k).held_out))
        for k, term in enumerate(found.best.extra)
    )


def accepted_terms(found: BenchFound, evidence: BenchEvidence, kinds: Mapping[str, EffectKind]) -> tuple[NamedTerm, ...]:
    """The pieces of the answer with intervals."""
    best: Rival = found.best
    numbers = term_estimates(best.whole, len(evidence.labels))
    return shown(numbers[len(numbers) - len(best.extra) :] if best.extra else [], best.extra, kinds)


def applied(
    setting: Setting, without_lugs: Sequence[str], needs_lugs: Sequence[str], foreign_soils: Sequence[str] = ()
) -> tuple[Setting, tuple[str, ...]]:
    """What of a setting can be put in a model, and sentences on what cannot.

    without_lugs : wheels that the model knows no grousers of. needs_lugs : kinds of effects that need them. foreign_soils : that the model
    does not have.
    """
    kept, notes = [], []
    foreign: dict[str, list[str]] = {}
    for term in setting:
        hypothesis = term.hypothesis
        if hypothesis.target_kind in ("load", "channel"):
            values = ", ".join(f"{name} {value:.4g}" for name, value in term.numbers.items())
            notes.append(f"{hypothesis.title} was found along with it ({values}); it is of the recording and is not put into the model")
        elif hypothesis.target_kind == "soil" and hypothesis.target in foreign_soils:
            foreign.setdefault(hypothesis.target, []).extend(f"{name} {value:.4g}" for name, value in term.numbers.items())
        elif hypothesis.kind in needs_lugs and (hypothesis.target in without_lugs or (hypothesis.target == "*" and without_lugs)):
            notes.append(
                f"{hypothesis.title} cannot be put into the model, which knows no grousers of {', '.join(without_lugs)}; "
                "state their number and height, and diagnose again"
            )
        else:
            kept.append(term)
    notes += [
        f"the model does not have the soil '{soil}', so that these numbers of it are not put there: {', '.join(values)}; write them into "
        "[bench.soil_values] of the manifest"
        for soil, values in foreign.items()
    ]
    return tuple(kept), tuple(notes)
