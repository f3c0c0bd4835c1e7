"""Bench points beside what the bench gives for them: curves, repeatability, residuals.

A curve is the points that differ in one condition only (mostly slip); it takes the place that a window has in time. Repeats are points of
equal conditions; their pooled scatter is the noise: sigma^2 = sum_g sum_i (y_gi - mean y_g)^2 / sum_g (n_g - 1).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rille.model import BenchPoints, InputRefused
from rille.model.bench_curve import curve_label
from rille.model.comparison import ComparedChannel, CompareWindow, Comparison, Regimes
from rille.model.recording import Channel, Recording

Array = NDArray[np.float64]
Labels = NDArray[np.int64]
PointSimulator = Callable[[BenchPoints], tuple[BenchPoints, Sequence[str]]]
"""conditions -> the same with calculated responses, and per point ``done`` or why it has none."""

RESPONSES = {
    "wheel.sinkage": "sinkage",
    "wheel.drawbar_pull": "drawbar_pull",
    "wheel.side_force": "side_force",
    "wheel.drive_torque": "drive_torque",
}
REGIMES = {"slip_ratio": "slip_ratio", "load": "normal_load", "slip_angle": "slip_angle"}  # condition -> name in ``Regimes.values``
ENOUGH = 5  # degrees of freedom from which on a scatter is worth its name: 1 sigma of sigma is then 32 %
WIDTH = {"slip_ratio": 0.01, "slip_angle": 0.01, "load": 0.25}  # [-], [rad], [of the load]: conditions that count as repeated
SWEPT = 0.01  # in the same units: of the condition that is swept
GAP = {"slip_ratio": 0.05, "slip_angle": 0.02, "load": 0.2}  # the same units: distance between curves


@dataclass(frozen=True, slots=True, kw_only=True)
class Scatter:
    """1 sigma of a channel. origin : ``stated``, ``repeats``, ``differences`` or ``assumed``. degrees : of freedom; groups : of repeats.

    least, most : of single curves, NaN where that cannot be told.
    """

    sigma: float
    origin: str
    degrees: int = 0
    groups: int = 0
    least: float = np.nan
    most: float = np.nan

    @property
    def known_by(self) -> float:
        """Degrees of freedom, infinite where it was not estimated from these points."""
        return float(self.degrees) if self.origin in ("repeats", "differences") else float("inf")


@dataclass(frozen=True, slots=True, kw_only=True)
class Curves:
    """Points in curves. sweep : the condition that varies along them. label : (n,) number of the curve. order : (n,) along the curves."""

    sweep: str
    label: Labels
    order: Labels


def _scaled(points: BenchPoints, name: str) -> Array:
    """A condition in which equal steps are equally different: loads by their logarithm."""
    return np.log(points.load) if name == "load" else getattr(points, name)


def _commanded(values: Array) -> Labels | None:
    """Classes of values that were set, so that most of them occur more than once exactly; None if they were not."""
    known, label = np.unique(np.round(values, 9), return_inverse=True)
    return label.ravel() if 2 * len(known) <= len(values) else None


def _within(values: Array, width: float) -> Labels:
    """Classes of at most that width, from the lowest value up."""
    label = np.empty(len(values), dtype=np.int64)
    first, number = -np.inf, -1
    for k in np.argsort(values, kind="stable"):
        if values[k] - first > width:
            first, number = values[k], number + 1
        label[k] = number
    return label


def _apart(values: Array, gap: float) -> Labels:
    """Classes with more than that gap between them."""
    order = np.argsort(values, kind="stable")
    label = np.empty(len(values), dtype=np.int64)
    label[order] = np.concatenate([[0], np.cumsum(np.diff(values[order]) > gap)])
    return label


def _nested(points: BenchPoints, names: Sequence[str], split: Callable[[Array, str], Labels]) -> Labels:
    """Numbers of classes by one condition after the other, each within the classes before it."""
    label = np.zeros(len(points), dtype=np.int64)
    for name in names:
        values, finer, next_label = _scaled(points, name), np.empty_like(label), 0
        for number in range(label.max(initial=-1) + 1):
            here = np.flatnonzero(label == number)
            part = split(values[here], name)
            finer[here] = next_label + part
            next_label += part.max() + 1
        label = finer
    return label


def repeat_groups(points: BenchPoints, sweep: str = "slip_ratio") -> Labels:
    """Number of the group of equal conditions that each point belongs to, (n,). Loads count as equal within 25 %, unless they are swept."""

    def split(values: Array, name: str) -> Labels:
        set_values = _commanded(values)
        return _within(values, SWEPT if name == sweep else WIDTH[name]) if set_values is None else set_values

    return _nested(points, ("slip_angle", "slip_ratio", "load"), split)


def find_curves(points: BenchPoints) -> Curves:
    """Points as curves over slip ratio; over load or slip angle where that is what was swept."""
    counts = {name: int(_within(_scaled(points, name), WIDTH[name]).max(initial=-1)) + 1 for name in REGIMES}
    sweep = "slip_ratio" if counts["slip_ratio"] >= 3 else max(REGIMES, key=lambda name: counts[name])

    def split(values: Array, name: str) -> Labels:
        set_values = _commanded(values)
        return _apart(values, GAP[name]) if set_values is None else set_values

    label = _nested(points, [name for name in ("slip_angle", "slip_ratio", "load") if name != sweep], split)
    return Curves(sweep=sweep, label=label, order=np.lexsort((getattr(points, sweep), label)))


def scatter_of_repeats(values: Array, groups: Labels) -> Scatter:
    """Pooled standard deviation of the finite values (n,) within groups; sigma is NaN without repeats."""
    known = np.isfinite(values)
    label, counts = groups[known], np.bincount(groups[known])
    with np.errstate(invalid="ignore"):
        mean = np.bincount(label, values[known]) / counts
    degrees = int((counts - 1).clip(min=0).sum())
    squares = float(((values[known] - mean[label]) ** 2).sum())
    return Scatter(
        sigma=np.sqrt(squares / degrees) if degrees else np.nan, origin="repeats", degrees=degrees, groups=int((counts > 1).sum())
    )


def scatter_of_differences(values: Array, x: Array, label: Labels) -> Scatter:
    """Scatter about the straight line through the neighbours on the curve: e_i = a y_(i-1) + b y_(i+1) - y_i, a + b = 1, weighted by place.

    sigma^2 = mean of e_i^2 / (a^2 + b^2 + 1) (Gasser, Sroka, Jennen-Steinmetz 1986, Biometrika 73:625, eq. 2). Curvature makes it
    too large, never too small.
    """
    squares: list[float] = []
    for number in np.unique(label):
        here = np.flatnonzero((label == number) & np.isfinite(values))
        here = here[np.argsort(x[here], kind="stable")]
        if len(here) < 3:
            continue
        before, at, after = x[here[:-2]], x[here[1:-1]], x[here[2:]]
        span = after - before
        b = np.where(span > 0, (at - before) / np.where(span > 0, span, 1), 0.5)
        e = (1 - b) * values[here[:-2]] + b * values[here[2:]] - values[here[1:-1]]
        squares.extend(e**2 / ((1 - b) ** 2 + b**2 + 1))
    return Scatter(sigma=float(np.sqrt(np.mean(squares))) if squares else np.nan, origin="differences", degrees=len(squares))


def find_scatter(channel: Channel, simulated: Array, points: BenchPoints, groups: Labels, curves: Curves) -> Scatter:
    """Noise of a channel at these points: stated, else of repeats, else about the curves, else 3 % of the range.

    Repeats differ a little in load and slip: what the model says of these differences is taken out, where that makes them agree better.
    Never below the resolution over sqrt(12).
    """
    step = (channel.resolution or 0.0) / np.sqrt(12)
    if channel.noise is not None:
        return Scatter(sigma=float(np.hypot(channel.noise, step)), origin="stated")
    kinds = [(scatter_of_repeats(values, groups), values) for values in (channel.value, channel.value - simulated)]
    full = [kind for kind in kinds if kind[0].degrees == kinds[0][0].degrees]
    found, values = min(full, key=lambda kind: kind[0].sigma)
    if found.degrees >= ENOUGH and found.sigma > 0:
        single = [scatter_of_repeats(np.where(curves.label == k, values, np.nan), groups) for k in np.unique(curves.label)]
        sigmas = [one.sigma for one in single if one.degrees >= ENOUGH] or [np.nan]
        return replace(found, sigma=max(found.sigma, step), least=min(sigmas), most=max(sigmas))
    about = scatter_of_differences(channel.value, _scaled(points, curves.sweep), curves.label)
    if about.degrees >= ENOUGH and about.sigma > 0:
        return replace(about, sigma=max(about.sigma, step))
    known = channel.value[np.isfinite(channel.value)]
    return Scatter(sigma=max(0.03 * float(np.ptp(known) or np.abs(known).max()), step, 1e-9), origin="assumed")


def compare_bench(
    simulator: PointSimulator, recording: Recording, conditions: BenchPoints, *, model: str = "", wheel: str = ""
) -> Comparison:
    """Points of a bench beside the simulated ones, as curves.

    Parameters
    ----------
    simulator : the bench. recording : of kind points. conditions : of all of its points, (n,), NaN where one is missing.
    model, wheel : names, for the regimes and the report.

    Returns
    -------
    Comparison : one window per curve; time is the rank of the point in the order of curves. Points without a value on either side are
    left out of their channel. Notes say how many, what the curves are, and where the noise comes from.

    Raises
    ------
    InputRefused : if nothing that was measured is anything that the bench gives, or no point has a simulated value.
    """
    stated = np.isfinite(conditions.load) & np.isfinite(conditions.slip_ratio) & np.isfinite(conditions.slip_angle)
    observed = [c for c in recording.with_role("observed") if c.quantity in RESPONSES]
    if not observed:
        raise InputRefused(f"recording '{recording.name}' has no observed channel that the bench gives; it gives {', '.join(RESPONSES)}")
    if not stated.any():
        raise InputRefused(f"no point of recording '{recording.name}' has a load, a slip ratio and a slip angle; check its channels")
    points = conditions.where(stated)
    answer, status = simulator(points)
    failed = np.array([word != "done" for word in status], dtype=bool)
    if failed.all():
        raise InputRefused(
            f"no point of recording '{recording.name}' can be simulated: {_counted(status)}; check the wheel, soil and loads"
        )
    curves = find_curves(points)
    groups = repeat_groups(points, curves.sweep)
    rank = np.empty(len(points))
    rank[curves.order] = np.arange(len(points))
    bad = recording.flagged("bad_channel", "stuck")
    unknown_zero: Sequence[str] = recording.setup.get("unknown_zero") or ()  # pyright: ignore[reportAssignmentType]
    compared, notes = [], []
    for channel in observed:
        here = replace(channel, value=channel.value[stated], time=channel.time[stated])
        simulated = np.where(failed, np.nan, getattr(answer, RESPONSES[channel.quantity]))
        known = np.isfinite(here.value) & np.isfinite(simulated)
        if not known.any():
            notes.append(f"{channel.name} has no point with both a measured and a simulated value")
            continue
        if channel.name in unknown_zero:
            shift = float(np.mean(here.value[known] - simulated[known]))
            here = replace(here, value=here.value - shift)
            notes.append(
                f"the zero of {channel.name} is not known; {shift:.4g} {channel.unit} were taken off, so that it agrees in the mean"
            )
        scatter = find_scatter(here, simulated, points, groups, curves)
        notes.append(_scatter_note(here, scatter))
        order = curves.order[known[curves.order]]
        made = ComparedChannel(
            channel=replace(channel, time=np.empty(0), value=np.empty(0)),
            time=rank[order],
            measured=here.value[order],
            simulated=simulated[order],
            window=curves.label[order],
            noise=scatter.sigma,
            noise_from=scatter.origin,
            noise_degrees=scatter.known_by,
            left_out="the data gate flags it" if channel.name in bad else "",
        )
        compared.append(made)
    if not compared:
        raise InputRefused(f"recording '{recording.name}' has no measured value at a point that can be simulated; check its channels")
    conditions_of = {f"wheel.{regime}" for regime in REGIMES.values()}
    others = [c.name for c in recording.with_role("observed") if c.quantity not in RESPONSES and c.quantity not in conditions_of]
    if others:
        notes.append(f"the bench does not give what {', '.join(others)} measured")
    if not stated.all():
        notes.append(f"{int((~stated).sum())} points lack a load above 0, a slip ratio or a slip angle and are left out")
    if failed.any():
        notes.append(f"{int(failed.sum())} of {len(points)} points have no simulated value and are left out: {_counted(status)}")
    order = curves.order
    number = np.flatnonzero(stated)[order].astype(float)
    values = {f"{regime}/{wheel}": getattr(points, name)[order] for name, regime in REGIMES.items()}
    regimes = Regimes(time=rank[order], window=curves.label[order], values=values | {"point": number})
    windows, labels = _windows(points, curves, rank, failed, status)
    return Comparison(
        recording=recording.name,
        model=model,
        scenario="",
        mode="points",
        channels=tuple(compared),
        windows=windows,
        regimes=regimes,
        notes=(*labels, *notes),
    )


def _counted(status: Sequence[str]) -> str:
    words = sorted({word for word in status if word != "done"})
    return "; ".join(f"{sum(word == other for other in status)} x {word.replace('_', ' ')}" for word in words)


def _scatter_note(channel: Channel, scatter: Scatter) -> str:
    head = f"noise of {channel.name} {scatter.sigma:.3g} {channel.unit}"
    if scatter.origin == "repeats":
        between = f", from curve to curve {scatter.least:.3g} to {scatter.most:.3g}" if scatter.most > scatter.least else ""
        return f"{head}: pooled over {scatter.groups} groups of repeats, {scatter.degrees} degrees of freedom{between}"
    if scatter.origin == "differences":
        return f"{head}: scatter about its curves at {scatter.degrees} points, for it has too few repeats"
    return f"{head}: {'stated' if scatter.origin == 'stated' else '3 % of its range, assumed: it has no repeats'}"


def _windows(
    points: BenchPoints, curves: Curves, rank: Array, failed: NDArray[np.bool_], status: Sequence[str]
) -> tuple[tuple[CompareWindow, ...], list[str]]:
    windows, labels = [], []
    for number in range(int(curves.label.max()) + 1):
        here = curves.label == number
        label = curve_label({regime: getattr(points, name)[here] for name, regime in REGIMES.items()}, REGIMES[curves.sweep])
        labels.append(f"window {number}: {label}, {int(here.sum())} points over {curves.sweep.replace('_', ' ')}")
        ended = _counted([word for word, inside in zip(status, here, strict=True) if inside]) if failed[here].any() else ""
        windows.append(CompareWindow(number=number, start=float(rank[here].min()), stop=float(rank[here].max()), ended=ended))
    return tuple(windows), labels
