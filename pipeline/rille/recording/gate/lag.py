"""How one channel follows another: delay, gain and offset, each with its standard error."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rille.recording.gate.track import Track

Array = NDArray[np.float64]
LONGEST = 1.0  # [s] largest delay that is looked for
BLOCK = 5.0  # [s] or forty samples: offsets are free from block to block, as slow drift says nothing of delay or gain
POINTS = 30_000  # samples that a fit takes
FAR = 6.0  # times a delay, or the width of a window, from which on another one is the period of the motion, and no rival
UPRIGHT = 0.01  # of R^2, that a shorter delay with the right sign may fit worse
EVEN = 3.0  # standard errors of a gain that may be 1
COARSE = 2_000  # samples that the search takes


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """second(t) = gain first(t - delay) + offset, as means over windows of ``2 half`` [s].

    order : 1: the derivative of ``first`` is meant. agreement : R^2. gain_back : of the regression the other way round, as the same ratio
    second / first; noise puts the true gain between the two. bias : of second - gain first, with a gain of 1 where that may be it.
    count : windows.
    drift : of the delay over time [s/s]. spread : of ``second``, standard deviation. ambiguous : other delays fit as
    well, and are not many times longer.
    agreement_at_zero : R^2 without a delay. length : [s] of all windows together, with what lies between. open_delay : [s] by which the
    delay may be larger or smaller because commands are held. slow_delay : [s] by which slow changes follow, where it is another.
    """

    order: int
    half: float
    count: int
    agreement: float
    delay: float
    delay_error: float
    gain: float
    gain_error: float
    gain_back: float
    bias: float
    bias_error: float
    drift: float
    drift_error: float
    spread: float
    ambiguous: bool
    agreement_at_zero: float
    length: float
    open_delay: float = 0.0
    slow_delay: float | None = None


@dataclass(frozen=True, slots=True)
class _Centred:
    """Removes the mean of each block."""

    block: NDArray[np.intp]
    size: Array

    def __call__(self, value: Array) -> Array:
        return value - (np.bincount(self.block, weights=value) / self.size)[self.block]

    def sums(self, value: Array) -> Array:
        """Sum of each block."""
        return np.bincount(self.block, weights=value).astype(np.float64)


def fit_lag(first: Track, second: Track, order: int = 0, *, response: bool = False, reach: float = LONGEST) -> Fit | None:
    """The best fit over delay, gain and offset; None where there is too little to compare.

    The windows' width is that of two to a hundred samples which gives the smallest standard error of the delay, among those at which noise
    does not spoil the agreement. Noise of ``first`` draws the delay to half a sample, where interpolation smooths it most; windows of
    sixteen samples and more are free of that, and commands have no noise. The delay is searched on a grid and then found by Gauss-Newton;
    errors are those of blocks (sandwich), so that coloured residuals count as what they are.
    response : the machine answers a command. Fast changes then come through after the delay alone, slow ones lag longer, as behind a motor;
    where the widths disagree, the narrowest counts and ``slow_delay`` holds what the widest says.
    """
    step = max(first.step, second.step)
    longest = float(np.median(_lengths(second)))
    room = min(max(reach, 6 * step), longest / 8)
    fits: list[Fit] = []
    start: tuple[float, bool] | None = None
    for width in (4.0, 1.0, 2.0, 8.0, 16.0, 32.0, 64.0):
        half = width * step
        if width > 4 and half > longest / 8:
            break
        query = _queries(first, second, half + room, half)
        if len(query) < 16:
            continue
        start = start or _search(first, second, order, half, room, query)
        fit = _refine(first, second, order, half, room, query, *start)
        if fit is not None:
            fits.append(fit)
    if not fits:
        return None
    most = max(fit.agreement for fit in fits)
    wide = [] if response else [fit for fit in fits if fit.half > 7 * step]
    fair = [fit for fit in wide or fits if 1 - fit.agreement <= 2 * (1 - most) + 0.003]
    best = min(fair or fits, key=lambda fit: fit.delay_error)
    if response:
        fast, slow = min(fits, key=lambda fit: fit.half), max(fits, key=lambda fit: fit.half)
        if abs(fast.delay - best.delay) > 4 * np.hypot(fast.delay_error, best.delay_error) and fast.agreement > 0.5:
            best = replace(fast, slow_delay=slow.delay)
        return _with_hold(best, first, second)
    return best


def _with_hold(fit: Fit, first: Track, second: Track) -> Fit:
    """The fit with what held commands leave open: a delay may change until samples of the response fall on the next command.

    Where one regular clock stamps both, that is a whole interval, of which the middle is taken. Five percent of the samples must fall
    on another command to be noticed.
    """
    at = second.time[(second.time - fit.delay > first.time[0]) & (second.time - fit.delay < first.time[-1])] - fit.delay
    if not len(at):
        return fit
    before = np.searchsorted(first.time, at, side="right") - 1
    more = float(np.quantile(at - first.time[before], 0.05))
    less = float(np.quantile(first.time[np.minimum(before + 1, len(first.time) - 1)] - at, 0.05))
    more, less = min(more, 2 * first.step), min(less, 2 * first.step)
    return replace(fit, delay=fit.delay + (more - less) / 2, open_delay=(more + less) / 2)


def _lengths(track: Track) -> Array:
    """Lengths of the stretches [s]."""
    number = np.floor(track.time / track.apart + 0.25).astype(int)
    edges = np.flatnonzero(np.diff(number)) + 1
    first, last = np.concatenate([[0], edges]), np.concatenate([edges, [len(number)]]) - 1
    return track.time[last] - track.time[first]


def _queries(first: Track, second: Track, reach: float, half: float) -> Array:
    query = second.time if len(second.time) <= 4 * POINTS else second.time[:: len(second.time) // (4 * POINTS) + 1]
    query = query[first.whole(query, reach) & second.whole(query, half)]
    return query if len(query) <= POINTS else query[:: len(query) // POINTS + 1]


def _search(first: Track, second: Track, order: int, half: float, room: float, query: Array) -> tuple[float, bool]:
    step = max(first.step, second.step)
    if len(query) > COARSE:  # whole runs of samples, so that blocks keep their means
        query = query[(np.arange(len(query)) // 50) % (len(query) // COARSE + 1) == 0]
    centre = _blocks(query, step)
    wanted = centre(second.mean(query, half, 0))
    lags = np.arange(-np.ceil(room / half), np.ceil(room / half) + 1) * half
    lags = lags[np.abs(lags) <= room]
    score, along = np.empty(len(lags)), np.empty(len(lags))
    for k, lag in enumerate(lags):
        given = centre(first.mean(query - lag, half, order))
        along[k] = given @ wanted
        score[k] = along[k] ** 2 / max(float((given @ given) * (wanted @ wanted)), 1e-300)
    inner = np.arange(1, len(lags) - 1)
    peaks = inner[(score[inner] >= score[inner - 1]) & (score[inner] >= score[inner + 1])]
    height = score.copy()  # of the peaks between the grid's lags: what lies midway is not told from what lies on one otherwise
    bend = 2 * score[peaks] - score[peaks - 1] - score[peaks + 1]
    height[peaks] = np.minimum(score[peaks] + (score[peaks + 1] - score[peaks - 1]) ** 2 / np.maximum(8 * bend, 1e-300), 1.0)
    best = float(height.max())
    alike = [k for k in peaks if 1 - height[k] < 1.1 * (1 - best) + 1e-3]
    top = min(alike, key=lambda k: abs(lags[k])) if alike else int(np.argmax(score))
    if along[top] < 0:  # half a period later with the sign turned is rarer than a sensor that is a little late, or has needles
        upright = [k for k in peaks if along[k] > 0 and abs(lags[k]) < abs(lags[top]) and 1 - height[k] < 3 * (1 - best) + UPRIGHT]
        top = min(upright, key=lambda k: abs(lags[k]), default=top)
    near = FAR * max(abs(float(lags[top])), half)
    return float(lags[top]), any(abs(k - top) > 2 and abs(lags[k]) < near for k in alike)


def _blocks(query: Array, step: float) -> _Centred:
    block = np.unique(np.floor(query / max(BLOCK, 40 * step)), return_inverse=True)[1]
    return _Centred(block, np.maximum(np.bincount(block), 1).astype(float))


@dataclass(frozen=True, slots=True)
class _Solution:
    """At the best lag: given (n,) means of ``first``, across (n,) change of the residual with the delay, gain being free, residual (n,)."""

    lag: float
    gain: float
    given: Array
    across: Array
    residual: Array


def _descend(
    first: Track, order: int, half: float, room: float, query: Array, wanted: Array, centre: _Centred, lag: float
) -> _Solution | None:
    """Gauss-Newton over the delay; the gain is eliminated."""
    nudge = half / 8
    solution = None
    for _ in range(12):
        given = centre(first.mean(query - lag, half, order))
        slope = centre(first.mean(query - lag - nudge, half, order) - first.mean(query - lag + nudge, half, order)) / (2 * nudge)
        own = float(given @ given)
        if own <= 0:
            return None
        gain = float(given @ wanted) / own
        across = gain * (slope - given * float(slope @ given) / own)
        solution = _Solution(lag, gain, given, across, wanted - gain * given)
        force = float(across @ across)
        if force <= 0:
            return None
        move = float(np.clip(float(across @ solution.residual) / force, -half, half))
        lag = float(np.clip(lag + move, -room, room))
        if abs(move) < 1e-3 * half / np.sqrt(len(query)):
            break
    return solution


def _refine(first: Track, second: Track, order: int, half: float, room: float, query: Array, lag: float, ambiguous: bool) -> Fit | None:
    centre = _blocks(query, max(first.step, second.step))
    raw = second.mean(query, half, 0)
    wanted = centre(raw)
    power = float(wanted @ wanted)
    best = _descend(first, order, half, room, query, wanted, centre, lag) if power > 0 else None
    if best is None:
        return None
    residual, force = best.residual, float(best.across @ best.across)
    pulls, pushes = centre.sums(best.across * residual), centre.sums(best.given * residual)
    factor = len(pulls) / max(len(pulls) - 1, 1) * (1 + 4 / len(pulls)) ** 2  # few blocks show less than the true scatter
    delay_error = float(np.sqrt(factor * (pulls @ pulls))) / force
    white = float(np.sqrt(residual @ residual / max(len(query) - 3, 1) / force))
    weights = centre.sums(best.across**2)
    drift, drift_error = _drift(centre.sums(query) / centre.size, pulls / np.maximum(weights, 1e-300), weights, first.apart)
    unmoved = centre(first.mean(query, half, order))
    at_zero = float(unmoved @ wanted) ** 2 / max(float(unmoved @ unmoved) * power, 1e-300)
    gain_error = float(np.sqrt(factor * (pushes @ pushes))) / float(best.given @ best.given)
    gain_back = power / float(best.given @ wanted) if best.gain else np.inf
    low, high = sorted((best.gain, gain_back))
    even = low - EVEN * gain_error <= 1 <= high + EVEN * gain_error  # then that is the gain, and no error of it is in the bias
    given = first.mean(query - best.lag, half, order)
    offsets = centre.sums(raw - (1.0 if even else best.gain) * given) / centre.size
    bias = float(np.average(offsets, weights=centre.size))
    scatter = float(np.sqrt(np.average((offsets - bias) ** 2, weights=centre.size) / max(len(offsets) - 1, 1)))
    doubt = 0.0 if even else float(np.hypot(gain_error, (high - low) / 2)) * abs(float(given.mean()))
    return Fit(
        order=order,
        half=half,
        count=len(query),
        agreement=1 - float(residual @ residual) / power,
        delay=best.lag,
        delay_error=max(delay_error, white),
        gain=best.gain,
        gain_error=gain_error,
        gain_back=gain_back,
        bias=bias,
        bias_error=float(np.hypot(scatter, doubt)) if len(offsets) > 2 else np.inf,
        drift=drift,
        drift_error=drift_error,
        spread=float(np.sqrt(power / len(query))),
        ambiguous=ambiguous or abs(best.lag) >= room,
        agreement_at_zero=at_zero,
        length=float(query[-1] - query[0]),
    )


def _drift(time: Array, moves: Array, weights: Array, apart: float) -> tuple[float, float]:
    """Slope of the blocks' own delays over time, and its standard error."""
    if len(time) < 5 or time[-1] - time[0] > apart / 2:
        return 0.0, np.inf
    centre = np.average(time, weights=weights)
    lever = float(weights @ (time - centre) ** 2)
    slope = float((weights * (time - centre)) @ moves) / lever
    left = moves - np.average(moves, weights=weights) - slope * (time - centre)
    scatter = float(np.sqrt((weights**2 * (time - centre) ** 2) @ left**2)) / lever
    return slope, scatter * (1 + 6 / len(time))  # two numbers were fitted to few blocks
