"""Start states of windows by maximum a posteriori: the smoothed state as prior, the window's samples as data, the simulator between them.

Minimises, of every window, sum_i rho((y_i - h_i(x))/sigma_i) + |z|^2/2 with x = x_smoothed + L z and |z_k| <= 5, by Gauss-Newton with step
control; rho is Huber's (quadratic up to three sigma). A window that cannot be fitted near its smoothed start is tried in all directions
that it shows, and by continuation; one that still cannot shows an error of the model, which is not white: its samples then count as few
independent ones with the variance that is left, and it is fitted again from the smoothed start. So a model that is wrong cannot hide its
error in the start; blame stays where it belongs. Derivatives are differences through the simulator, all windows at once; directions that
no sample can see within the prior are left alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.starts.start_states import Starts
from rille.diagnosis.starts.state_coordinates import moved
from rille.model.recording import Channel

Array = NDArray[np.float64]
HUBER = 3.0  # [sigma]
FARTHEST = 5.0  # [standard deviations of the prior]
FAR = 1 / 3  # share of windows: if more are not fitted near their smoothed start, the model is wrong and not the starts
INDEPENDENT = 20.0  # samples that a window counts as where the model does not fit it
UNFIT = 6.0  # standard errors of chi-squared beyond which it does not
HOPELESS = 3.0  # times as many, beyond which a window is not fitted anew for what the step does
FARTHER = 100.0  # the same where that was too near
HORIZONS = (0.1, 0.25, 0.5, 0.75, 1.0)  # shares of a window that is tried once more
NUDGE, CLOSELY = 0.3, 0.03  # [standard deviations of the prior] of a difference; where that foretells no step
VISIBLE = 0.3  # chi-squared of a window per standard deviation of the prior, below which a direction is left alone
UNTOUCHED = 0.1  # of that, below which a channel does not answer to a direction
SCREENED, SECONDS = (2, 5), 8.0  # windows, and how long [s] together, in which all directions are tried at first; one of four at most
WORTH = 0.1  # decrease of a window's cost below which it is left as it is
BENT = 0.3  # share by which a step's gain misses the promised one, beyond which derivatives are taken anew
ROUNDS, LONG = 8, 32  # at most; of windows whose next step still promises a share ``STILL`` of what is left
STILL = 0.01
ENDED = 10.0  # [sigma] counted for a sample that the run did not reach


@dataclass(frozen=True, slots=True, kw_only=True)
class Directions:
    """Directions (coordinate, order: 0 value, 1 rate) that samples can see. touches : (n_directions, n_channels) whether a channel answers.

    groups : directions that no channel answers to two of; they are tried together (Curtis, Powell & Reid 1974).
    """

    columns: tuple[tuple[int, int], ...]
    touches: NDArray[np.bool_]
    groups: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class StartFit:
    """states : (n_windows, n) fitted. shift : (n_windows,) root mean square of z over directions that the recording shows. gain : of each
    channel (m,) [unit] standard deviation that the uncertainty of the start gives to a sample. unfit : windows that
    no start near the recorded one fits. standard : (n_windows, n_coordinates, 2) z. directions : that were fitted. slopes : of each channel
    (n_directions, m) derivatives of what is simulated by z [sigma].
    """

    states: Array
    shift: Array
    gain: list[Array]
    unfit: NDArray[np.int64]
    standard: Array
    directions: Directions
    slopes: list[Array]


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """Samples of one channel in windows. window : (m,) ascending. time : (m,) [s] delays taken off. value : (m,). noise : 1 sigma."""

    channel: Channel
    window: NDArray[np.int64]
    time: Array
    value: Array
    noise: float

    def where(self, flags: NDArray[np.bool_]) -> "Samples":
        """Only the samples that ``flags`` (m,) are true of."""
        return replace(self, window=self.window[flags], time=self.time[flags], value=self.value[flags])


def is_more_than_noise(mean_square: Array, count: Array, times: float = 1.0) -> NDArray[np.bool_]:
    """Whether mean squares [noise^2] of so many samples are beyond what chance makes of noise, by ``times`` ``UNFIT`` standard errors."""
    return np.asarray(mean_square > 1 + times * UNFIT * np.sqrt(2 / count))


def residuals(samples: Samples, predicted: Array) -> Array:
    """value - predicted (..., m); angles wrapped; components of quaternions with the sign of their window, since q and -q are one turn."""
    if samples.channel.component in ("roll", "pitch", "yaw"):
        return (samples.value - predicted + np.pi) % (2 * np.pi) - np.pi
    if samples.channel.quantity == "part.orientation" and len(samples.window):
        firsts = np.flatnonzero(np.r_[True, np.diff(samples.window) > 0])
        along = np.add.reduceat(np.nan_to_num(samples.value * predicted), firsts, axis=-1)
        sign = np.where(along < 0, -1.0, 1.0)
        return samples.value - np.repeat(sign, np.diff(np.r_[firsts, len(samples.window)]), axis=-1) * predicted
    return samples.value - predicted


def between(samples: Samples, after: Array, before: Array) -> Array:
    """after - before (..., m) of two predictions of the samples, as ``residuals`` takes differences."""
    return residuals(replace(samples, value=after), before)


class _Problem:
    """Standardised residuals of all windows for start states moved by standard deviations."""

    def __init__(self, simulator: Any, starts: Starts, stops: Array, samples: Sequence[Samples], rough: Any = None) -> None:
        self.simulator, self.starts, self.stops, self.samples, self.rough = simulator, starts, stops, samples, rough or simulator
        self.n_windows = len(stops)
        self.horizon = 1.0  # share of every window that counts
        begin = starts.states[:, 0]
        self._shares = [(s.time - begin[s.window]) / (stops - begin)[s.window] for s in samples]

    def states(self, standard: Array) -> Array:
        """(..., n_windows, n) for ``standard`` (..., n_windows, n_coordinates, 2)."""
        base = np.broadcast_to(self.starts.states, (*standard.shape[:-3], *self.starts.states.shape))
        return moved(base, self.starts.coordinates, self.starts.change(standard))

    def near(self, number: int) -> NDArray[np.bool_]:
        """Samples of a channel (m,) within the horizon."""
        return self._shares[number] <= self.horizon + 1e-6

    def standardised(self, standard: Array, windows: NDArray[np.int64], simulator: Any = None) -> list[Array]:
        """Residuals (k, m) in sigmas of each channel, of samples in ``windows`` within the horizon; others are NaN.

        standard : (k, n_windows, n_coordinates, 2). simulator : another one, for derivatives.
        """
        model = simulator or self.simulator
        run = np.arange(self.n_windows) if model.has_memory else windows  # what is hidden goes on from window to window, up to their ends
        states = self.states(standard)[:, run]
        asked, place = np.isin(np.arange(self.n_windows), windows), np.full(self.n_windows, -1)
        place[run] = np.arange(len(run))
        chosen = [asked[s.window] & self.near(number) for number, s in enumerate(self.samples)]
        picks = [(place[s.window[here]], s.time[here]) for s, here in zip(self.samples, chosen, strict=True)]
        begin = states[0, :, 0]
        stops = begin + (1.0 if model.has_memory else self.horizon) * (self.stops[run] - begin)
        answers = model.predict(states, stops, [s.channel for s in self.samples], picks)
        result = []
        for s, here, answer in zip(self.samples, chosen, answers, strict=True):
            full = np.full((len(standard), len(s.time)), np.nan)
            left = residuals(s.where(here), answer) / s.noise
            full[:, here] = np.where(np.isfinite(left), left, ENDED)
            result.append(full)
        return result


def fit_starts(
    simulator: Any,
    starts: Starts,
    stops: Array,
    samples: Sequence[Samples],
    on_progress: Callable[[int, int, str], None] | None = None,
    *,
    say: Sequence[bool] | None = None,
    far: float = 1.0,
    error: Callable[[Array], Sequence[Array]] | None = None,
    known: tuple[Directions, Sequence[Array]] | None = None,
    near: Array | None = None,
    rough: Any = None,
) -> StartFit:
    """Fitted start states.

    Parameters
    ----------
    say : of each channel of ``samples``, whether it takes part in the fit; the others get their derivatives only. None: all do.
    far : share of the windows; if more than that are not fitted near their smoothed starts, none is tried far from it: then the model is
        what is wrong. error : of states (n_windows, n), what the simulator's step does to each channel (m,) [unit]; starts are fitted to
        what it would show without. None: nothing.
    known : directions and slopes of a model much alike to begin with, taken anew in windows where they do not foretell what steps do. None:
        they are found.
    near : z (n_windows, n_coordinates, 2) that windows begin from which cannot be fitted from their smoothed starts. None: there is none.
    rough : a simulator with larger steps, that is good enough for derivatives. None: there is none.
    """
    problem = _Problem(simulator, starts, stops, samples, rough)
    directions = known[0] if known is not None else _visible(problem, _screened(problem))
    descent = _Descent(problem, directions, say, known[1] if known is not None else None)
    descent.run(np.arange(problem.n_windows), on_progress, "fitting starts")
    if error is not None:
        descent.correct(error(problem.states(descent.standard[None])[0]))
        descent.run(np.setdiff1d(np.arange(problem.n_windows), descent.hopeless()), on_progress, "fitting starts")
    if near is not None:
        descent.begin_again(descent.unfit(), near, on_progress)
    unfit = descent.unfit()
    if 0 < len(unfit) <= far * problem.n_windows:
        wider = _visible(problem, unfit, directions)
        if len(wider.columns) > len(directions.columns):
            directions, descent = wider, _Descent(problem, wider, say, None)
            descent.run(np.arange(problem.n_windows), on_progress, "fitting starts in more directions")
        descent.extend(descent.unfit(), on_progress)
    unfit = descent.unfit()
    if len(unfit):
        descent.temper(unfit)
        descent.run(unfit, on_progress, "fitting starts where the model differs")
    standard = descent.standard
    counted = np.maximum(starts.seen.sum(axis=1) * 2, 1)
    shift = np.sqrt((standard**2 * starts.seen[:, :, None]).sum(axis=(1, 2)) / counted)
    return StartFit(
        states=problem.states(standard[None])[0],
        shift=shift,
        gain=descent.gains(),
        unfit=unfit,
        standard=standard,
        directions=directions,
        slopes=descent.jacobian,
    )


def fit_starts_doubting(
    simulator: Any, starts: Starts, stops: Array, samples: Sequence[Samples], *args: Any, far: float = 1.0, **options: Any
) -> StartFit:
    """As ``fit_starts``; where a few windows are not fitted (``FAR``, at most ``far``), their smoothed starts are doubted
    (``Starts.doubted``), and those that fit then count.
    """
    fit = fit_starts(simulator, starts, stops, samples, *args, far=far, **options)
    if not 0 < len(fit.unfit) <= min(FAR, far) * len(stops):
        return fit
    doubted = fit_starts(simulator, starts.doubted(fit.unfit), stops, samples, *args, far=far, **options)
    saved = np.setdiff1d(fit.unfit, doubted.unfit)
    if not len(saved):
        return fit
    return doubted if not len(doubted.unfit) else fit_starts(simulator, starts.doubted(saved), stops, samples, *args, far=far, **options)


def _linearised(
    problem: _Problem, standard: Array, directions: Directions, windows: NDArray[np.int64], *, closely: bool = False
) -> tuple[list[Array], list[Array]]:
    """Derivatives (n_directions, m) of predicted samples in sigmas per standard deviation, and residuals (m,) in sigmas, of each channel.

    closely : by smaller differences, of the simulator itself in place of a rough one.
    """
    nudge, model = (CLOSELY, problem.simulator) if closely else (NUDGE, problem.rough)
    sides = np.repeat(standard[None], len(directions.groups) + 1, axis=0)
    for number, group in enumerate(directions.groups):
        for k in group:
            sides[(number + 1, slice(None), *directions.columns[k])] += nudge
    blocks = problem.standardised(sides, windows, model)
    left = problem.standardised(standard[None], windows) if model is not problem.simulator else blocks
    derivatives = []
    for channel, block in enumerate(blocks):
        slopes = np.zeros((len(directions.columns), block.shape[1]))
        for number, group in enumerate(directions.groups):
            for k in group:
                if directions.touches[k, channel]:
                    slopes[k] = np.nan_to_num(-(block[number + 1] - block[0]) / nudge)
        derivatives.append(slopes)
    return derivatives, [np.nan_to_num(block[0]) for block in left]


def _screened(problem: _Problem) -> NDArray[np.int64]:
    """A few windows, spread over all."""
    length = float(np.median(problem.stops - problem.starts.states[:, 0]))
    count = max(1, min(int(np.clip(SECONDS / length, *SCREENED)), problem.n_windows // 4))
    return np.asarray(((np.arange(count) + 0.5) * problem.n_windows / count), dtype=np.int64)


def _visible(problem: _Problem, tried: NDArray[np.int64], known: Directions | None = None) -> Directions:
    """Directions that some sample of the windows ``tried`` can see within the prior, beside those that are known.

    What is driven stiffly in one window is free in another: where no start fits, a direction may be lacking.
    """
    n_coordinates = len(problem.starts.coordinates)
    columns = tuple((c, order) for c in range(n_coordinates) for order in range(2))
    every = Directions(
        columns=columns,
        touches=np.ones((len(columns), len(problem.samples)), dtype=bool),
        groups=tuple((k,) for k in range(len(columns))),
    )
    jacobian, _ = _linearised(problem, np.zeros((problem.n_windows, n_coordinates, 2)), every, tried)
    power = np.zeros((len(columns), len(problem.samples), problem.n_windows))
    for channel, (block, s) in enumerate(zip(jacobian, problem.samples, strict=True)):
        for k in range(len(columns)):
            power[k, channel] = np.bincount(s.window, weights=block[k] ** 2, minlength=problem.n_windows)
    visible = power.sum(axis=1).max(axis=1, initial=0.0) > VISIBLE
    touches = power.max(axis=2, initial=0.0) > VISIBLE * UNTOUCHED
    if known is not None:
        places = [columns.index(column) for column in known.columns]
        visible[places] = True
        touches[places] |= known.touches
    seen = np.flatnonzero(visible)
    touches = touches[seen]
    groups: list[list[int]] = []
    for k in np.argsort(-touches.sum(axis=1), kind="stable").tolist():
        for group in groups:
            if not (touches[group].any(axis=0) & touches[k]).any():
                group.append(k)
                break
        else:
            groups.append([k])
    return Directions(columns=tuple(columns[k] for k in seen), touches=touches, groups=tuple(tuple(g) for g in groups))


class _Descent:
    """Gauss-Newton of all windows side by side. ``share`` (n_windows,): weight of a window's samples."""

    def __init__(self, problem: _Problem, directions: Directions, say: Sequence[bool] | None, slopes: Sequence[Array] | None) -> None:
        self.problem, self.directions, self.columns = problem, directions, directions.columns
        self.say = [1.0 if heard else 0.0 for heard in (say if say is not None else [True] * len(problem.samples))]
        n_windows = problem.n_windows
        self.standard = np.zeros((n_windows, len(problem.starts.coordinates), 2))
        self.where = [np.searchsorted(s.window, np.arange(n_windows + 1)) for s in problem.samples]
        self.share, self.farthest = np.ones(n_windows), FARTHEST
        self.closely = np.zeros(n_windows, dtype=bool)  # windows whose derivatives are taken by small differences
        if slopes is None:
            self.jacobian, self.left = _linearised(problem, self.standard, directions, np.arange(n_windows))
        else:
            self.jacobian = [block.copy() for block in slopes]
            self.left = [np.nan_to_num(block[0]) for block in problem.standardised(self.standard[None], np.arange(n_windows))]
        self.at_start = [(slopes.copy(), block.copy()) for slopes, block in zip(self.jacobian, self.left, strict=True)]
        self.cost = self._costs(self.left, self.standard)

    def run(self, active: NDArray[np.int64], on_progress: Callable[[int, int, str], None] | None, stage: str) -> None:
        """Rounds until no active window gains any more.

        Derivatives that a step shows to have changed follow by its secant (Broyden 1965), and are taken anew where that does not help, and
        at the end. Where even those foretell no step, they are taken more closely.
        """
        damping = np.zeros(self.problem.n_windows)
        stale = np.zeros(self.problem.n_windows, dtype=bool)
        for number in range(LONG if self.columns else 0):
            if on_progress:
                on_progress(number, LONG, stage)
            trial, promised = self.standard.copy(), np.zeros(self.problem.n_windows)
            for window in active:
                trial[window], promised[window] = self._step(int(window), float(damping[window]))
            active = active[promised[active] > np.maximum(WORTH, STILL * self.cost[active] if number >= ROUNDS else 0.0)]
            if len(active) == 0:
                if not stale.any():
                    break
                active = np.flatnonzero(stale)
                stale[active] = False
                self._bend(active)
                continue
            tried = [block[0] for block in self.problem.standardised(trial[None], active)]
            gained = np.where(np.isin(np.arange(len(promised)), active), self.cost - self._costs(tried, trial), 0.0)
            better, worse = active[gained[active] > 0], active[gained[active] <= 0]
            bent = better[(np.abs(gained[better] / promised[better] - 1) > BENT) & (gained[better] > 10 * WORTH)]
            for window in bent:
                self._turn(int(window), trial[window] - self.standard[window], tried)
            self.standard[better] = trial[better]
            for block, fresh, s in zip(self.left, tried, self.problem.samples, strict=True):
                here = np.isin(s.window, better)
                block[here] = np.nan_to_num(fresh[here])
            self.cost[better] -= gained[better]
            vague = worse[~stale[worse] & (damping[worse] > 0) & ~self.closely[worse]]  # a shorter step has failed as well
            self.closely[vague] = True
            damping[worse] = np.maximum(1.0, 10 * damping[worse])
            damping[better] *= 0.1
            failed = np.union1d(worse[stale[worse]], vague)
            stale[bent], stale[failed] = True, False
            if len(failed):
                self._bend(failed)
            active = np.setdiff1d(active, better[gained[better] < WORTH])
        if stale.any():
            self._bend(np.flatnonzero(stale))
        if on_progress:
            on_progress(LONG, LONG, stage)

    def correct(self, error: Sequence[Array]) -> None:
        """Takes what the step does to each channel (m,) [unit] off what is simulated."""
        self.problem.samples = [replace(s, value=s.value + e) for s, e in zip(self.problem.samples, error, strict=True)]
        for blocks in (self.left, [block for _, block in self.at_start]):
            for block, s, e in zip(blocks, self.problem.samples, error, strict=True):
                block += np.where(np.abs(block) < ENDED, e / s.noise, 0.0)
        self.cost = self._costs(self.left, self.standard)

    def _excess(self) -> tuple[Array, Array]:
        """Chi-squared per sample (n_windows,) of those within the horizon, and how many they are."""
        chi2, count = np.zeros(len(self.share)), np.zeros(len(self.share))
        for number, (block, edges) in enumerate(zip(self.left, self.where, strict=True)):
            near = self.problem.near(number) & (self.say[number] > 0)
            chi2 += np.diff(np.r_[0.0, np.cumsum(np.where(near, np.minimum(block**2, ENDED**2 * 1e4), 0.0))][edges])
            count += np.diff(np.r_[0, np.cumsum(near)][edges])
        return chi2 / np.maximum(count, 1), np.maximum(count, 1)

    def unfit(self) -> NDArray[np.int64]:
        """Windows whose residual is more than noise."""
        excess, count = self._excess()
        return np.flatnonzero(is_more_than_noise(excess, count))

    def hopeless(self) -> NDArray[np.int64]:
        """Windows whose residual stays more than noise, and far more, if their next step keeps what it promises."""
        excess, count = self._excess()
        promised = np.array([self._step(window, 0.0)[1] for window in range(len(self.share))]) if self.columns else 0.0
        return np.flatnonzero(is_more_than_noise(excess - 2 * promised / count, count, HOPELESS))

    def begin_again(self, windows: NDArray[np.int64], at: Array, on_progress: Callable[[int, int, str], None] | None) -> None:
        """From z ``at`` (n_windows, n_coordinates, 2); windows that are not fitted from there either go back."""
        if not len(windows) or not self.columns:
            return
        before = self._fitted_so_far()
        self.standard[windows] = at[windows]
        self._bend(windows)
        self.run(windows, on_progress, "fitting starts from others")
        self._go_back(np.intersect1d(windows, self.unfit()), before)

    def _fitted_so_far(self) -> tuple[Array, list[Array], list[Array]]:
        return self.standard.copy(), [block.copy() for block in self.left], [block.copy() for block in self.jacobian]

    def _go_back(self, windows: NDArray[np.int64], before: tuple[Array, list[Array], list[Array]]) -> None:
        self.standard[windows] = before[0][windows]
        for number, s in enumerate(self.problem.samples):
            here = np.isin(s.window, windows)
            self.left[number][here], self.jacobian[number][:, here] = before[1][number][here], before[2][number][:, here]
        self.cost = self._costs(self.left, self.standard)

    def extend(self, windows: NDArray[np.int64], on_progress: Callable[[int, int, str], None] | None) -> None:
        """Tries again far from the smoothed start, by continuation: first the beginning of a window, then ever more of it.

        Violent motion makes the smoothed start worse than it says, and the end of a window answer to its start in no linear way. What is
        fitted to the noise in the end is the start; where that fails the model is wrong, and the start goes back.
        """
        if not len(windows) or not self.columns:
            return
        before, tried = self._fitted_so_far(), windows
        self.farthest = FARTHER
        self.standard[windows] = 0
        for horizon in HORIZONS:
            self.problem.horizon = horizon
            self._bend(windows)
            self.run(windows, on_progress, "fitting starts once more")
            windows = np.setdiff1d(windows, self.unfit())
            if not len(windows):
                break
        self.farthest, self.problem.horizon = FARTHEST, 1.0
        self._go_back(np.setdiff1d(tried, windows), before)

    def temper(self, windows: NDArray[np.int64]) -> None:
        """Takes weight from the samples of windows that the model does not fit, and puts them back to their smoothed start."""
        excess, count = self._excess()
        softly = np.minimum(1.0, excess[windows] - 1)  # a small misfit changes little
        self.share[windows] = np.minimum(1.0, INDEPENDENT / count[windows]) ** softly / excess[windows]
        self.standard[windows] = 0
        for slopes, block, start, s in zip(self.jacobian, self.left, self.at_start, self.problem.samples, strict=True):
            here = np.isin(s.window, windows)
            slopes[:, here], block[here] = start[0][:, here], start[1][here]
        self.cost = self._costs(self.left, self.standard)

    def _turn(self, window: int, move: Array, tried: list[Array]) -> None:
        """Derivatives of one window so that they say what a move (n_coordinates, 2) does: the residuals become those that were tried."""
        along = np.array([move[column] for column in self.columns])
        for slopes, old, new, edges in zip(self.jacobian, self.left, tried, self.where, strict=True):
            here = slice(edges[window], edges[window + 1])
            before, after = old[here], np.nan_to_num(new[here])
            known = (before != ENDED) & (after != ENDED)
            missed = np.where(known, before - after - along @ slopes[:, here], 0.0)
            slopes[:, here] += np.outer(along, missed) / (along @ along)

    def _bend(self, windows: NDArray[np.int64]) -> None:
        """Derivatives and residuals anew."""
        for closely in (False, True):
            chosen = windows[self.closely[windows] == closely]
            if not len(chosen):
                continue
            fresh, left = _linearised(self.problem, self.standard, self.directions, chosen, closely=closely)
            for number, s in enumerate(self.problem.samples):
                here = np.isin(s.window, chosen)
                self.jacobian[number][:, here], self.left[number][here] = fresh[number][:, here], left[number][here]
        self.cost[windows] = self._costs(self.left, self.standard)[windows]

    def _costs(self, left: list[Array], standard: Array) -> Array:
        """Cost (n_windows,) as minimised."""
        cost = np.zeros(len(self.share))
        for block, edges, heard in zip(left, self.where, self.say, strict=True):
            if not heard:
                continue
            size = np.abs(np.nan_to_num(block))
            each = np.where(size <= HUBER, 0.5 * size**2, HUBER * (size - 0.5 * HUBER))
            cost += np.diff(np.r_[0.0, np.cumsum(each)][edges])
        return self.share * cost + 0.5 * (standard**2).sum(axis=(1, 2))

    def _rows(self, blocks: list[Array], window: int) -> Array:
        return np.concatenate([b[..., e[window] : e[window + 1]] for b, e in zip(blocks, self.where, strict=True)], axis=-1)

    def _heard(self, window: int) -> Array:
        """(m,) 1 for samples of channels that take part."""
        return np.concatenate([np.full(e[window + 1] - e[window], heard) for heard, e in zip(self.say, self.where, strict=True)])

    def _step(self, window: int, damping: float) -> tuple[Array, float]:
        """Next z of one window (n_coordinates, 2), and the decrease of the cost that its linear model promises."""
        slope, rest = self._rows(self.jacobian, window), self._rows(self.left, window)
        weight = self.share[window] * _weights(rest) * self._heard(window)
        now = np.array([self.standard[window][c] for c in self.columns])
        normal = (slope * weight) @ slope.T + np.eye(len(self.columns))
        gradient = (slope * weight) @ rest - now
        change = _bounded_step(normal + damping * np.eye(len(normal)), gradient, -self.farthest - now, self.farthest - now)
        after = self.standard[window].copy()
        for (coordinate, order), move in zip(self.columns, change, strict=True):
            after[coordinate, order] += move
        return after, float(gradient @ change - 0.5 * change @ normal @ change)

    def gains(self) -> list[Array]:
        """Of each channel (m,): sqrt(j P j^T) in the channel's unit, P the posterior covariance of the window's start."""
        gains = [np.zeros(len(s.time)) for s in self.problem.samples]
        for window in range(self.problem.n_windows if self.columns else 0):
            slope, rest = self._rows(self.jacobian, window), self._rows(self.left, window)
            covariance = np.linalg.inv((slope * self.share[window] * _weights(rest) * self._heard(window)) @ slope.T + np.eye(len(slope)))
            for gain, block, edges, s in zip(gains, self.jacobian, self.where, self.problem.samples, strict=True):
                here = slice(edges[window], edges[window + 1])
                gain[here] = s.noise * np.sqrt(np.maximum(np.einsum("km,kl,lm->m", block[:, here], covariance, block[:, here]), 0))
        return gains


def _weights(left: Array) -> Array:
    return np.minimum(1.0, HUBER / np.maximum(np.abs(left), HUBER))


def _bounded_step(normal: Array, gradient: Array, lower: Array, upper: Array) -> Array:
    """Minimum of s N s/2 - g s between bounds: those that are passed are held there, and the rest is solved again."""
    change, free = np.zeros(len(gradient)), np.ones(len(gradient), dtype=bool)
    while free.any():
        held = ~free
        change[free] = np.linalg.solve(normal[np.ix_(free, free)], gradient[free] - normal[np.ix_(free, held)] @ change[held])
        beyond = free & ((change < lower) | (change > upper))
        if not beyond.any():
            break
        change = np.clip(change, lower, upper)
        free &= ~beyond
    return change
