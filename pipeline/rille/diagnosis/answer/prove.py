"""How much better recordings are reproduced that no fit has seen."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.comparison.block_errors import DRAWS
from rille.diagnosis.comparison.pooled import root_mean_square
from rille.diagnosis.evidence.applied import Simulators, of_scenario
from rille.diagnosis.evidence.evidence import Metric
from rille.diagnosis.evidence.floor import chi2_floor
from rille.diagnosis.evidence.held_out import Parts
from rille.diagnosis.evidence.part_comparison import comparison_of
from rille.diagnosis.evidence.replay_evidence import ReplayEvidence, gather
from rille.diagnosis.inference.accept import SIGNIFICANT
from rille.diagnosis.inference.weights import none_of_these
from rille.model.comparison import Comparison
from rille.model.diagnosis import ChannelFit, Gap, NamedTerm, Proof
from rille.model.hypothesis import Setting

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Progress = Callable[[int, int, str], None] | None
FLOOR = 1.0  # [sigma] root mean square of noise
LEAST = 4  # blocks of windows that an interval needs
LEAST_GAP, PLAIN = 0.7, 1.2  # that an answer closes at least, where what was held out is so far beyond the noise [sigma]
HARM = 0.1  # of the gap: what surely closes less than that, and widens it by as much, does harm
TOUCHED = 0.01  # of the noise: mean square by which an answer changes a channel that it touches
SEEN = 2.0  # standard deviations of chi-squared from which on an excess is one
FINER = (4, 16)  # times finer than the model's own step, where what is left may be the step's
LESS = 0.98  # of the root mean square, that a finer step must leave at most to be taken
LESS_LIKELY = 5.0  # [nats] by which no right answer makes what was held out less likely: 3 sigma, whatever it changes there
LIKELIER = 0.5  # probability of none of the catalogue, beyond which nothing of it is named
NOT_CARRIED = "what explains the recordings that were fitted does not explain those that were held out: it may only do alike there"
BLOCK = 4  # windows side by side that are drawn together: neighbours are alike


def prove(
    simulators: Simulators,
    parts: Parts,
    setting: Setting,
    *,
    noise: Mapping[str, tuple[float, str]],
    window: float,
    rough: float | None = None,
    terms: Sequence[NamedTerm] = (),
    training: tuple[Sequence[Comparison], Sequence[Comparison]] = ((), ()),
    on_progress: Progress = None,
) -> tuple[Proof, list[Comparison]]:
    """Replays what was held out with the base model and with the setting on top.

    G = (R0 - R1) / (R0 - 1) with R the root of chi-squared per degree of freedom, starts marginalised; an R below that of noise, 1,
    counts as 1. Its interval is from a bootstrap of blocks of windows. G is NaN if nothing was held out, or the base model is at the noise
    already.

    Parameters
    ----------
    simulators, noise, window, rough : as of ``gather``. terms : as the answer names them; each is left out once if there are several.
    training : the part that was fitted, beside the base model and beside the improved one.

    Returns
    -------
    The proof; the recordings beside the improved model, training part first.
    """
    rows = [_fit(b, a, held_out=False) for b, a in zip(*training, strict=True)]
    if not parts.held_out:
        nothing = Proof(gap_closed=np.nan, low=np.nan, high=np.nan, before=np.nan, after=np.nan, floor=FLOOR, held_out="")
        return _with_channels(nothing, rows), [*training[1]]
    held, after, sizes = _held_out(simulators, parts, setting, on_progress, window=window, noise=noise, rough=rough)
    improved = [comparison_of(part) for part in after.parts]
    rows += [_fit(comparison_of(old), new, held_out=True) for old, new in zip(held.parts, improved, strict=True)]
    floor = chi2_floor(held, noise)
    touched = _touched(after, setting)
    proof = Proof(
        **asdict(_gap_of(*(size.sum(axis=1) for size in sizes), floor=floor)),
        floor=FLOOR,
        held_out=parts.how,
        touched=None if touched.all() else _gap_of(*(size[:, touched].sum(axis=1) for size in sizes), floor=floor),
        ablation=tuple(
            _without(after, setting, number, terms, _whole(sizes[0])) for number in range(len(setting) if len(setting) > 1 else 0)
        ),
    )
    return _with_channels(proof, rows), [*training[1], *improved]


def _gap_of(before: Array, after: Array, floor: float) -> Gap:
    """The gap by windows. before, after : (2, W) chi-squared and degrees. floor : chi-squared per degree of noise."""
    first, second = before.sum(axis=1), after.sum(axis=1)
    kappa = max(floor, float(min(_root(first), _root(second))) ** 2)
    low, high = _interval(before, after)
    return Gap(
        gap_closed=_gap(first, second),
        low=low,
        high=high,
        before=_root(first),
        after=_root(second),
        left=_left(before, after, floor),
        likelier=float(first[0] - second[0]) / (2.0 * kappa),
    )


def _touched(evidence: ReplayEvidence, setting: Setting) -> Mask:
    """(channels,) which of them a setting changes; all, if it changes none."""
    metric = Metric(evidence.window, evidence.start_gain)
    without, with_it = metric.whitened(evidence.residuals([(), setting]))
    count = len(evidence.channels)
    change = np.bincount(evidence.channel, (with_it - without) ** 2, count)
    touched = change > TOUCHED * np.bincount(evidence.channel, metric.own_degrees, count)
    return touched if touched.any() else ~touched


def _held_out(
    simulators: Simulators, parts: Parts, setting: Setting, on_progress: Progress, **like: Any
) -> tuple[ReplayEvidence, ReplayEvidence, list[Array]]:
    """What was held out beside the base model and beside the setting, and chi-squared and degrees of both, as of ``_chi2``.

    The step of the replays is as large as the recordings that were fitted allow. Where others move faster, what is left may be the step's:
    it is made smaller as long as that leaves clearly less.
    """
    own = of_scenario(simulators, parts.held_out[0].scenario).own_step
    found = None
    for step in (None, *(own / finer for finer in FINER)):
        more: dict[str, Any] = like if step is None else like | {"rough": None}
        held = gather(_stepping(simulators, step), parts.held_out, on_progress=on_progress, **more)
        after = held.relinearised(setting, on_progress)
        sizes = [_chi2(held, ()), _chi2(after, setting)]
        if found is not None and not _root(_whole(sizes[1])) < LESS * _root(_whole(found[2][1])):
            break
        found = held, after, sizes
        chi2, degrees = _whole(sizes[1])
        if chi2 < degrees + SIGNIFICANT * np.sqrt(2.0 * degrees):
            break
    assert found is not None
    return found


def _stepping(simulators: Simulators, step: float | None) -> Simulators:
    """Simulators with a step [s]; None: as they are."""
    return simulators if step is None else lambda scenario: of_scenario(simulators, scenario).changed(step=step)


def _with_channels(proof: Proof, rows: Sequence[Sequence[ChannelFit]]) -> Proof:
    return replace(proof, channels=tuple(row for part in rows for row in part))


def _chi2(evidence: ReplayEvidence, setting: Setting) -> Array:
    """(2, channels, W) chi-squared and degrees of freedom of every channel in every window."""
    metric = Metric(evidence.window, evidence.start_gain)
    left = metric.whitened(evidence.residuals([setting]))[0]
    cell = evidence.channel * metric.n_windows + evidence.window
    shape = len(evidence.channels), metric.n_windows
    sums = [np.bincount(cell, of, shape[0] * shape[1]).reshape(shape) for of in (left**2, metric.own_degrees)]
    return np.stack(sums).astype(float)


def _whole(size: Array) -> Array:
    """(2,) sums of (2, ...) chi-squared and degrees."""
    return size.reshape(2, -1).sum(axis=1)


def _root(size: NDArray[Any]) -> Any:
    """R of (2, ...) chi-squared and degrees of freedom."""
    return np.sqrt(size[0] / np.maximum(size[1], 1e-9))


def _gap(before: NDArray[Any], after: NDArray[Any]) -> Any:
    """G of (2, ...) chi-squared and degrees before and after."""
    first, second = np.maximum(_root(before), FLOOR), np.maximum(_root(after), FLOOR)
    return np.where(first > FLOOR, (first - second) / np.where(first > FLOOR, first - FLOOR, 1.0), np.nan)[()]


def _left(before: Array, after: Array, floor: float) -> float:
    """``left_share`` of windows. before, after : (2, W) chi-squared and degrees. floor : chi-squared per degree of noise."""
    (c0, d0), (c1, d1) = before.sum(axis=1), after.sum(axis=1)
    chance = [floor * float(np.sqrt(2.0 * max(d, 1.0))) for d in (d0, d1)]
    return left_share((c0 - floor * d0, c1 - floor * d1), (chance[0], chance[1]))


def left_share(excess: tuple[float, float], chance: tuple[float, float]) -> float:
    """Share of the excess of chi-squared that stays, chance set aside; where there was none, 1 if now there is, else NaN.

    excess : beyond noise, before and after. chance : standard deviations of chi-squared, before and after.
    """
    before, after = excess
    if before <= SEEN * chance[0]:
        return 1.0 if after > max(SIGNIFICANT * chance[1], 2.0 * max(before, 0.0)) else float("nan")
    return min(1.0, max(0.0, after - SEEN * chance[1]) / before)


def _interval(before: Array, after: Array) -> tuple[float, float]:
    """95 % interval of G by bootstrap of blocks of windows, seeded; NaN for fewer than ``LEAST`` windows."""
    windows = before.shape[1]
    if windows < LEAST:
        return np.nan, np.nan
    size = max(1, min(BLOCK, windows // LEAST))
    n = windows // size
    block = np.minimum(np.arange(windows) // size, n - 1)
    sums = [np.stack([np.bincount(block, row) for row in part]) for part in (before, after)]
    drawn = np.random.default_rng(7).multinomial(n, np.full(n, 1 / n), size=DRAWS).T
    gaps = _gap(sums[0] @ drawn, sums[1] @ drawn)
    low, high = np.nanpercentile(gaps, [2.5, 97.5]) if np.isfinite(gaps).any() else (np.nan, np.nan)
    return float(low), float(high)


def _without(evidence: ReplayEvidence, setting: Setting, number: int, terms: Sequence[NamedTerm], before: Array) -> tuple[str, float]:
    """A term's title and the G that is left without it. before : (2,) chi-squared and degrees of the base model."""
    rest = tuple(term for k, term in enumerate(setting) if k != number)
    title = (terms[number].term if len(terms) == len(setting) else setting[number]).hypothesis.title
    return title, float(_gap(before, _whole(_chi2(evidence, rest))))


def _fit(before: Comparison, after: Comparison, held_out: bool) -> list[ChannelFit]:
    old = {c.channel.name: c for c in before.channels if not c.left_out and len(c.residual)}
    return [
        ChannelFit(
            recording=after.recording,
            channel=c.channel.name,
            held_out=held_out,
            unit=c.channel.unit,
            rms_before=root_mean_square(old[c.channel.name].residual),
            rms_after=root_mean_square(c.residual),
            floor=c.noise,
        )
        for c in after.channels
        if c.channel.name in old and len(c.residual)
    ]


def none_by(proof: Proof) -> float:
    """Probability of none of the catalogue, by what is left of what was held out, in the channels that the answer changes; 0 where nothing
    was to be explained there.
    """
    left = (proof.touched or proof).left
    return none_of_these(left) if np.isfinite(left) else 0.0


def carries_over(proof: Proof, *, pieces: int = 1) -> bool:
    """Whether the answer may hold for what it was not fitted to, by the channels that it changes: what a scale of one sensor leaves in
    others, where it changes nothing, does not speak against it.

    Not where so much is left that none of the catalogue is likelier. Nor where that is plainly beyond the noise, and stays so: the share
    that is left is surely more than the catalogue may leave unnamed. Nor where it surely closes nothing of the gap, and widens it on the
    whole. Nor where several pieces together, which fit anything better, may close nothing of it. Nor where it becomes less likely with the
    answer: a law that is right and changes chi-squared by d there lowers it by d, with a standard deviation of 2 sqrt(d).
    """
    gap = proof.touched or proof
    if gap.likelier < -LESS_LIKELY or (pieces > 1 and gap.low <= 0) or (gap.high < HARM and gap.gap_closed < -HARM):
        return False
    return none_by(proof) <= LIKELIER and not (gap.before > PLAIN and gap.high < LEAST_GAP)
