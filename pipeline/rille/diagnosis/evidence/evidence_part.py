"""Windows of one recording as evidence: replayed from starts that were fitted once, under one setting."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.comparison.compare import RUN_UP, samples_of, why_unfit, with_a_say
from rille.diagnosis.evidence.applied import applied, sensor_terms
from rille.diagnosis.evidence.evidence import ENDED
from rille.diagnosis.hypotheses.sensor_faults import concerns, moves_time, repaired, said, true_instants
from rille.diagnosis.starts.noise_floor import quantisation, steady_rounding
from rille.diagnosis.starts.start_fit import FAR, FARTHEST, Directions, Samples, between, fit_starts, residuals
from rille.diagnosis.starts.start_states import Starts, smoothed_values, start_states
from rille.diagnosis.starts.state_coordinates import moved
from rille.diagnosis.starts.steady_turns import with_steady_turns
from rille.diagnosis.starts.step_error import finest, step_error, timing
from rille.diagnosis.starts.windows import Cut, cut, picked
from rille.model import InputRefused
from rille.model.hypothesis import Setting
from rille.model.recording import MOTION_QUANTITIES, Channel, Recording
from rille.model.scatter import difference_noise

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
Noise = Mapping[str, tuple[float, str]]
Progress = Callable[[int, int, str], None] | None
Memory = Literal["none", "fading", "lasting"]
LAG = 0.1  # [s] before a window's first sample that a simulation begins: delays of sensors up to this need what was before
SLOW = 0.25  # [noise] offset of a channel over a window that no sensor is known to be free of; averages are not trusted beyond it
NEAR = 3.0  # [standard deviations of the start] up to which what a repaired recording does to it is taken as linear
REPLAYS = 2  # from where it is then, at most
RUN_IN = 4.0  # [s] that lags, play and sloshing are run before a window that is looked at alone


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plan:
    """What the sensor faults of a setting ask for. change : (n_windows, n_coordinates, 2) z of the start that the repaired recording shows;
    None: the start stays. at : z of the fitted start from there. reread : whether other instants of the trajectories are needed.
    """

    faults: Setting
    change: Array | None
    at: Array
    reread: bool


@dataclass(frozen=True, kw_only=True)
class Part:
    """Windows of one recording, their starts and how their samples answer to them.

    simulator : the base model, driven by the recording. channels : observed ones with noise that are fit for use, with samples. shows :
    names of those that show the state. widest : [s], of the smoother. assumed : setting under which starts were fitted. starts : all
    doubted. standard : (n_windows, n_coordinates, 2) fitted z. states : (n_windows, n) there.
    first, last : (n_windows,) [s] what is compared. directions : of the start. samples, slopes : of each channel its samples, and
    (n_directions, m) derivatives of what is simulated by z [sigma]. noise_from : of each channel, "stated" or what it was taken from.
    error : of each channel (m,) [unit] what the step does to what is simulated. timing : what half of the finest step of time changes in
    it [sigma].
    rough : the simulator with larger steps for what is looked at first, None: there is none.
    whole, numbers : of a subset the part with all windows, and the numbers (n_windows,) that its windows have there.
    """

    simulator: Any
    recording: Recording
    channels: tuple[Channel, ...]
    shows: tuple[str, ...]
    widest: float
    assumed: Setting
    starts: Starts
    standard: Array
    states: Array
    first: Array
    last: Array
    directions: Directions
    samples: tuple[Samples, ...]
    slopes: tuple[Array, ...]
    noise_from: tuple[str, ...]
    error: tuple[Array, ...]
    timing: tuple[Array, ...]
    rough: Any = None
    whole: "Part | None" = None
    numbers: Whole | None = None

    @property
    def columns(self) -> tuple[tuple[int, int], ...]:
        """(coordinate, order) of the directions of the start."""
        return self.directions.columns

    @cached_property
    def order(self) -> Whole:
        """(m,) places of samples, channel after channel, in the order of evidence: by window, then channel, then time."""
        return np.argsort(np.concatenate([s.window for s in self.samples]), kind="stable")

    @cached_property
    def window(self) -> Whole:
        """(m,) windows of the samples, in the order of evidence: ascending."""
        return self.ordered([s.window for s in self.samples])

    def ordered(self, blocks: Sequence[NDArray[Any]]) -> NDArray[Any]:
        """Blocks (..., m) of the channels as one, in the order of evidence."""
        return np.concatenate(blocks, axis=-1)[..., self.order]

    @cached_property
    def start_gain(self) -> Array:
        """D (m, d) in the order of evidence: directions of the start; then of every channel its offset over the window, and a shift in time
        by half of the finest step, since a simulation knows no instant better; and the slope of noise that is known to be slow.
        """
        rows = [self.ordered([-slopes for slopes in self.slopes])]
        for number, (channel, s) in enumerate(zip(self.channels, self.samples, strict=True)):
            slow = max(channel.slow_noise or 0.0, steady_rounding(channel, s.noise))
            offset = np.full(len(s.time), max(SLOW, slow / s.noise))
            own = [offset, self.timing[number]]
            if channel.slow_noise:
                own.append(offset * (2 * (s.time - self.first[s.window]) / np.maximum(self.last - self.first, 1e-9)[s.window] - 1))
            rows.append(
                self.ordered([np.stack(own) if k == number else np.zeros((len(own), len(o.time))) for k, o in enumerate(self.samples)])
            )
        return np.ascontiguousarray(np.concatenate(rows).T)

    def subset(self, windows: Whole) -> "Part":
        """Only these windows (ascending), renumbered from 0."""
        place = np.full(len(self.first), -1)
        place[windows] = np.arange(len(windows))
        here = [place[s.window] >= 0 for s in self.samples]
        starts = replace(
            self.starts,
            states=self.starts.states[windows],
            factor=self.starts.factor[windows],
            seen=self.starts.seen[windows],
            axes=self.starts.axes[windows],
            ended=tuple(self.starts.ended[k] for k in windows),
            kept=self.starts.kept[windows],
            widths=tuple(width[windows] for width in self.starts.widths),
        )
        return replace(
            self,
            starts=starts,
            standard=self.standard[windows],
            states=self.states[windows],
            first=self.first[windows],
            last=self.last[windows],
            samples=tuple(replace(s.where(h), window=place[s.window[h]]) for s, h in zip(self.samples, here, strict=True)),
            slopes=tuple(slopes[:, h] for slopes, h in zip(self.slopes, here, strict=True)),
            error=tuple(error[h] for error, h in zip(self.error, here, strict=True)),
            timing=tuple(timing[h] for timing, h in zip(self.timing, here, strict=True)),
            whole=self.whole or self,
            numbers=windows if self.numbers is None else self.numbers[windows],
        )

    def roughly(self) -> "Part":
        """For a first look: replayed with larger steps, what they change under the setting that starts were fitted under taken off."""
        if self.rough is None:
            return self
        bare, picks = [s.channel for s in self.samples], [(s.window, s.time) for s in self.samples]
        models = [applied(one, self.assumed) for one in (self.simulator, self.rough)]
        fine, coarse = (model.predict(self.states[None], self.last, bare, picks) for model in models)
        changes = [np.nan_to_num(between(s, b[0], a[0])) for s, a, b in zip(self.samples, fine, coarse, strict=True)]
        return replace(self, simulator=self.rough, error=tuple(e + c for e, c in zip(self.error, changes, strict=True)))

    def only(self, windows: Whole) -> "Part":
        """``subset``, kept: the same few windows are asked for again and again."""
        key = windows.tobytes()
        if key not in self._subsets:
            self._subsets[key] = self.subset(windows)
        return self._subsets[key]

    @cached_property
    def _subsets(self) -> dict[bytes, "Part"]:
        return {}

    def with_noise(self, sigma: Mapping[str, float]) -> "Part":
        """With the noise [unit] of innovations of channels by name in place of its own."""
        new = [sigma.get(s.channel.name, s.noise) for s in self.samples]
        return replace(
            self,
            samples=tuple(replace(s, noise=n) for s, n in zip(self.samples, new, strict=True)),
            slopes=tuple(slopes * (s.noise / n) for slopes, s, n in zip(self.slopes, self.samples, new, strict=True)),
            timing=tuple(timing * (s.noise / n) for timing, s, n in zip(self.timing, self.samples, new, strict=True)),
            noise_from=tuple(
                "innovations" if n != s.noise else source for s, n, source in zip(self.samples, new, self.noise_from, strict=True)
            ),
        )

    def residuals(self, settings: Sequence[Setting]) -> Array:
        """(k, m) as of ``Evidence.residuals``; NaN of a setting that the model refuses."""
        result = np.full((len(settings), len(self.order)), np.nan)
        models, own = self._models(settings)
        plans = [self._plan(sensor_terms(setting)) for setting in settings]
        plain: dict[int, list[int]] = {}
        courses: dict[int, Any] = {}
        for k, (model, plan) in enumerate(zip(own, plans, strict=True)):
            if model is None:
                continue
            if plan.reread:
                if model not in courses:
                    courses[model] = self._course(models[model])
                read = self._reread(models[model], plan, courses[model])
                result[k] = self._displaced(models[model], plan, self._residual(read, plan))
            else:
                plain.setdefault(model, []).append(k)
        for memory in ("none", "fading", "lasting"):
            chosen = [m for m, asked in plain.items() if self._memory(models[m], settings[asked[0]]) == memory]
            answers = self._predicted([models[m] for m in chosen], memory) if chosen else []
            for place, m in enumerate(chosen):
                for k in plain[m]:
                    result[k] = self._displaced(models[m], plans[k], self._residual([a[place] for a in answers], plans[k]))
        return result

    def relinearised(self, setting: Setting, on_progress: Progress = None) -> "Part":
        """The same windows and noise, starts fitted under a setting."""
        whole = self.whole or self
        noise = {c.name: (s.noise, source) for c, s, source in zip(whole.channels, whole.samples, whole.noise_from, strict=True)}
        recording = replace(whole.recording, channels=tuple(c for c in whole.recording.channels if c.role != "observed" or c.name in noise))
        like: dict[str, Any] = {"window": whole.widest, "noise": noise, "kept": {s.channel.name: s.time for s in whole.samples}}
        like["rough"] = whole.rough.step if whole.rough is not None else None
        made = gather_part(whole.simulator, recording, assumed=setting, near=whole, on_progress=on_progress, **like)
        return made if self.numbers is None else made.subset(self.numbers)

    def _models(self, settings: Sequence[Setting]) -> tuple[list[Any], list[int | None]]:
        """Simulators without repetition, and of each setting its own; None where the model refuses it."""
        models: list[Any] = []
        known: dict[object, int | None] = {}
        own: list[int | None] = []
        for setting in settings:
            physics = tuple(term for term in setting if term.hypothesis.cause != "sensor")
            key = tuple(
                (t.hypothesis.cause, t.hypothesis.kind, t.hypothesis.target, repr(t.hypothesis.words), *sorted(t.numbers.items()))
                for t in physics
            )
            if key not in known:
                try:
                    models.append(applied(self.simulator, physics))
                    known[key] = len(models) - 1
                except InputRefused:
                    known[key] = None
            own.append(known[key])
        return models, own

    def _memory(self, model: Any, setting: Setting) -> Memory:
        """What a model of a setting knows of the time before a window: what wheels leave in the ground stays there, all else fades."""
        if not model.has_memory:
            return "none"
        own = any(term.hypothesis.memory and term.hypothesis.target_kind == "wheel" for term in setting)
        return "lasting" if own or self.simulator.has_memory else "fading"

    def _predicted(self, models: Sequence[Any], memory: Memory) -> list[Array]:
        """Of each channel (n_models, m) what the models say from the fitted starts; windows of a subset after those that lead to them."""
        whole, numbers = self.whole, self.numbers
        if memory == "none" or whole is None or numbers is None:
            return self._run(self, models, memory)
        found = []
        for stretch in _led_up_to(whole, numbers, RUN_IN if memory == "fading" else np.inf):
            part = whole.only(stretch)
            answers = self._run(part, models, memory)
            found.append([a[:, np.isin(stretch[s.window], numbers)] for a, s in zip(answers, part.samples, strict=True)])
        return [np.concatenate(pieces, axis=1) for pieces in zip(*found, strict=True)]

    def _run(self, part: "Part", models: Sequence[Any], memory: Memory) -> list[Array]:
        picks = [(s.window, s.time) for s in part.samples]
        bare = [s.channel for s in part.samples]
        return list(self.simulator.predict_many(models, part.states, part.last, bare, picks, carried=memory != "none"))

    def _plan(self, faults: Setting) -> _Plan:
        touched = [c for c in self.channels if c.name in self.shows and any(concerns(t, c) for t in (*faults, *sensor_terms(self.assumed)))]
        change = self._start_change(faults, [c.name for c in touched]) if touched else None
        at = self.standard if change is None else self.standard - change
        return _Plan(faults=faults, change=change, at=at, reread=any(moves_time(faults, c) for c in self.channels))

    def _start_change(self, faults: Setting, touched: Sequence[str]) -> Array:
        """z (n_windows, n_coordinates, 2) from the start that was smoothed to that of the recording without these faults."""
        before = self._smoothed_before.get(tuple(touched))
        if before is None:
            before = self._smoothed_before[tuple(touched)] = self._smoothed(sensor_terms(self.assumed), touched)
        after = self._smoothed(faults, touched)
        step = np.where(self.starts.kept[:, :, None], 0.0, after - before)
        turns = [k for k, c in enumerate(self.starts.coordinates) if c.kind == "turn"]
        step[:, turns, 0] = (step[:, turns, 0] + np.pi) % (2 * np.pi) - np.pi
        return np.asarray(np.linalg.solve(self.starts.factor, step[..., None])[..., 0], dtype=float)

    @cached_property
    def _smoothed_before(self) -> dict[tuple[str, ...], Array]:
        """By names of channels that a fault is about, what is smoothed of the recording as it was assumed to be."""
        return {}

    def _smoothed(self, faults: Setting, touched: Sequence[str]) -> Array:
        sigma = {s.channel.name: s.noise for s in self.samples}
        shown = [(repaired(faults, c), sigma[c.name]) for c in self.channels if c.name in self.shows]
        return smoothed_values(self.simulator, self.starts, shown, self.widest, touched)

    def _residual(self, answers: Sequence[Array], plan: _Plan, at: Array | None = None) -> Array:
        """(m,) from what is simulated, of each channel (m,), from starts at z ``at`` (None: as planned): as the faults say it, carried back
        to z = 0.
        """
        blocks = []
        moves = self._own_moves if at is None and plan.change is None else self.moves(plan.at if at is None else at)
        for s, answer, error, back in zip(self.samples, answers, self.error, moves, strict=True):
            left = residuals(s, said(plan.faults, s.channel, answer - error, s.time)) / s.noise
            blocks.append(np.where(np.isfinite(left), left + back, ENDED))
        return self.ordered(blocks)

    @cached_property
    def _own_moves(self) -> list[Array]:
        return self.moves(self.standard)

    def moves(self, standard: Array) -> list[Array]:
        """Of each channel (m,) [sigma] what starts at ``standard`` z have changed in what is simulated."""
        along = np.array([standard[:, c, order] for c, order in self.columns]).reshape(len(self.columns), len(standard))
        return [np.einsum("km,km->m", slopes, along[:, s.window]) for s, slopes in zip(self.samples, self.slopes, strict=True)]

    def _course(self, model: Any) -> Any:
        """Trajectories of a model from the fitted starts, those of the base model are kept; None of a model with memory."""
        if model.has_memory:
            return None
        if model is not self.simulator:
            return model.trajectories(self.states, self.last, [s.channel for s in self.samples])
        return self._own_course

    @cached_property
    def _own_course(self) -> Any:
        return self.simulator.trajectories(self.states, self.last, [s.channel for s in self.samples])

    def _reread(self, model: Any, plan: _Plan, course: Any) -> list[Array]:
        """Of each channel (m,) what a model says from the fitted starts at the instants that were true; read from its course, if given."""
        picks = [(s.window, true_instants(plan.faults, s.channel, s.time)) for s in self.samples]
        if course is not None:
            return course.read(picks)
        return [answer[0] for answer in model.predict(self.states[None], self.last, [s.channel for s in self.samples], picks)]

    def _displaced(self, model: Any, plan: _Plan, left: Array) -> Array:
        """What is ``left`` (m,), or what replays leave where the repaired recording puts the starts too far away for it.

        The best start is found by the derivatives that are known. Up to ``NEAR`` from where it is without the faults they tell what it
        changes; farther away it is replayed, and found again from there.
        """
        if plan.change is None:
            return left
        at = self._own_best - plan.change
        for _ in range(REPLAYS):
            best = self._fitted(left)
            if np.abs(best - at).max(initial=0.0) <= NEAR:
                break
            at = best
            left = self._from(model, plan, at)
        return left

    @cached_property
    def _own_best(self) -> Array:
        """z (n_windows, n_coordinates, 2) of the best starts under the setting that they were fitted under, by its derivatives."""
        plan = self._plan(sensor_terms(self.assumed))
        model = applied(self.simulator, self.assumed)
        return self._fitted(self._residual(self._reread(model, plan, self._course(model)), plan))

    def _from(self, model: Any, plan: _Plan, at: Array) -> Array:
        """(m,) replayed from starts at z ``at`` from where the repaired recording shows them."""
        states = moved(self.states, self.starts.coordinates, self.starts.change(at - plan.at))
        picks = [(s.window, true_instants(plan.faults, s.channel, s.time)) for s in self.samples]
        answers = model.predict(states[None], self.last, [s.channel for s in self.samples], picks)
        return self._residual([answer[0] for answer in answers], plan, at)

    @cached_property
    def _start_solvers(self) -> list[tuple[int, int, Array, Array]]:
        """Of each window its samples, D of its start, and (D^T D + 1)^-1."""
        gain = self.start_gain[:, : len(self.columns)]
        edges = np.searchsorted(self.window, np.arange(len(self.first) + 1))
        spans = [(int(a), int(b), gain[a:b]) for a, b in pairwise(edges)]
        return [(a, b, d, np.asarray(np.linalg.inv(d.T @ d + np.eye(d.shape[1])), dtype=float)) for a, b, d in spans]

    def best(self, setting: Setting) -> Array:
        """z (n_windows, n_coordinates, 2) of the best starts under a setting, by the derivatives that are known."""
        left = self.residuals([setting])[0]
        return self._fitted(left) if np.isfinite(left).all() else self.standard

    def _fitted(self, left: Array) -> Array:
        """z (n_windows, n_coordinates, 2) that minimises |r + D z|^2 + |z|^2 of residuals (m,) at z = 0, within ``FARTHEST``."""
        standard = np.zeros_like(self.standard)
        for k, (first, last, gain, solve) in enumerate(self._start_solvers):
            z = -solve @ (gain.T @ left[first:last])
            for (coordinate, order), value in zip(self.columns, np.clip(z, -FARTHEST, FARTHEST), strict=True):
                standard[k, coordinate, order] = value
        return standard


def _led_up_to(whole: Part, numbers: Whole, reach: float) -> list[Whole]:
    """Stretches of neighbouring windows that end in some, by their numbers: with those before them as far as ``reach`` [s]."""
    needed = np.zeros(len(whole.first), dtype=bool)
    for number in numbers:
        needed[: number + 1] |= whole.last[: number + 1] > whole.first[number] - reach
    chosen = np.flatnonzero(needed)
    return [*np.split(chosen, np.flatnonzero(np.diff(chosen) > 1) + 1)]


def gather_part(
    simulator: Any,
    recording: Recording,
    *,
    window: float,
    noise: Noise,
    assumed: Setting = (),
    grid: float | None = None,
    most: int | None = None,
    corrected: bool = True,
    kept: Mapping[str, Array] | None = None,
    near: Part | None = None,
    rough: float | None = None,
    on_progress: Progress = None,
) -> Part:
    """Windows of a recording with starts fitted under a setting.

    simulator : of the recording's scenario; it stays as it is. grid : [s], windows begin and end at whole multiples, None: its step.
    most : windows at most, spread over the recording. corrected : whether what the step does is found and taken off (``step_error``).
    kept : of channels by name the instants (m,) [s] of the samples that take part; None: of all but those at jumps.
    near : the same windows with starts fitted under another setting; its derivatives are good to begin with.
    rough : step [s] that is good enough for derivatives and first looks, a multiple of the simulator's; None: there is none.

    Raises
    ------
    InputRefused : as ``compare_windows``.
    """
    base = simulator.changed()
    base.drive_by(recording)
    channels = tuple(c for c in with_steady_turns(recording.with_role("observed")) if not why_unfit(c, recording) and noise[c.name][0] > 0)
    shows = [c for c in channels if c.quantity in MOTION_QUANTITIES]
    parts = cut(recording, shows, window, grid or rough or base.step, max(LAG, RUN_UP if base.has_ground else 0.0))
    if most is not None:
        parts = _some(parts, most)
    larger = base.changed(step=rough) if rough else None
    model, faults = applied(base, assumed), sensor_terms(assumed)
    parts = _reaching(parts, faults, channels, grid or rough or base.step)
    starts = start_states(
        model, [(repaired(faults, c), noise[c.name][0]) for c in shows], parts.begins, widest=window, on_progress=on_progress
    )
    starts = starts.doubted(np.arange(len(parts.begins)))
    samples = [samples_of(c, noise[c.name][0], parts) for c in channels]
    channels = tuple(c for c, s in zip(channels, samples, strict=True) if len(s.time))
    samples = [s for s in samples if len(s.time)]
    if kept is not None:
        samples = [s.where(np.isin(s.time, kept[s.channel.name])) for s in samples]
    known = _known(near, assumed, starts, samples) if near is not None else None
    alike = near if near is not None and known is not None and np.allclose(near.starts.states, starts.states) else None
    watched = _Watched(model, faults)
    heard = {c.name for c in with_a_say(watched, channels, noise, starts, parts)}

    def shown(states: Array) -> list[Array]:
        """What of the error the faulty sensors show."""
        both = zip(samples, step_error(model, states, parts.stops, _when_true(samples, faults))[0], strict=True)
        return [said(faults, s.channel, s.value + e, s.time) - said(faults, s.channel, s.value, s.time) for s, e in both]

    like = {
        "say": [c.name in heard for c in channels],
        "far": FAR,
        "error": shown if corrected else None,
        "near": _best_under(alike, assumed, starts) if alike is not None else None,
        "rough": _Watched(applied(larger, assumed), faults) if larger is not None else None,
    }
    fit = fit_starts(watched, starts, parts.stops, samples, on_progress, known=known, **like)
    error = tuple(np.zeros(len(s.time)) for s in samples)
    if corrected:
        error, jumps = step_error(model, fit.states, parts.stops, _when_true(samples, faults))
        if kept is None and any(jump.any() for jump in jumps):
            samples = [s.where(~jump) for s, jump in zip(samples, jumps, strict=True)]
            known = fit.directions, [slopes[:, ~jump] for slopes, jump in zip(fit.slopes, jumps, strict=True)]
            fit = fit_starts(watched, starts, parts.stops, samples, on_progress, known=known, **like)
            error, _ = step_error(model, fit.states, parts.stops, _when_true(samples, faults))
    placed = fit.states, parts.stops, samples
    return Part(
        simulator=base,
        recording=recording,
        channels=channels,
        shows=tuple(c.name for c in shows),
        widest=window,
        assumed=assumed,
        starts=starts,
        standard=fit.standard,
        states=fit.states,
        first=parts.starts,
        last=parts.stops,
        directions=fit.directions,
        samples=tuple(samples),
        slopes=tuple(fit.slopes),
        noise_from=tuple(noise[c.name][1] for c in channels),
        error=error,
        timing=timing(watched.predict, 0.5 * finest(model), *placed),
        rough=larger,
    )


def _reaching(parts: Cut, faults: Setting, channels: Sequence[Channel], step: float) -> Cut:
    """Windows that are simulated from as early, and until as late, as what faulty clocks stamp in them was true: nothing can be read off a
    run before it begins. As far as something was recorded; the samples of a window stay the same.
    """
    begins, stops = parts.begins.copy(), parts.stops.copy()
    for channel in channels:
        if moves_time(faults, channel):
            places, window = picked(channel, parts.starts, parts.stops)
            true = true_instants(faults, channel, channel.time[places] - channel.delay)
            np.minimum.at(begins, window, step * np.floor(true / step - 1))
            np.maximum.at(stops, window, step * np.ceil(true / step + 1))
    return Cut(begins=np.maximum(begins, parts.begins[0]), starts=parts.starts, stops=np.minimum(stops, parts.stops[-1]))


def _when_true(samples: Sequence[Samples], faults: Setting) -> list[Samples]:
    """Samples at the instants at which what they say was true."""
    return [replace(s, time=true_instants(faults, s.channel, s.time)) for s in samples]


def _known(near: Part, assumed: Setting, starts: Starts, samples: Sequence[Samples]) -> tuple[Directions, list[Array]] | None:
    """Directions of other starts of the same samples, and slopes by standard deviations of these starts; None where sensors lie."""
    if [len(s.time) for s in samples] != [len(s.time) for s in near.samples] or sensor_terms((*assumed, *near.assumed)):
        return None
    turned = np.linalg.solve(near.starts.factor, starts.factor)  # z of the others = turned z
    slopes = [np.zeros_like(block) for block in near.slopes]
    for k, (coordinate, order) in enumerate(near.columns):
        for source, (own, other) in enumerate(near.columns):
            if own != coordinate:
                continue
            for s, old, new in zip(samples, near.slopes, slopes, strict=True):
                new[k] += old[source] * turned[s.window, coordinate, other, order]
    return near.directions, slopes


def _best_under(near: Part, assumed: Setting, starts: Starts) -> Array:
    """z (n_windows, n_coordinates, 2) of the best starts under another setting, as far as derivatives under its own tell."""
    z = near.best(assumed)
    return np.asarray(np.linalg.solve(starts.factor, near.starts.factor @ z[..., None])[..., 0], dtype=float)


def _some(parts: Cut, most: int) -> Cut:
    chosen = np.unique(np.linspace(0, len(parts.starts) - 1, most).round().astype(np.int64))
    return Cut(begins=parts.begins[chosen], starts=parts.starts[chosen], stops=parts.stops[chosen])


class _Watched:
    """A simulator whose channels are seen through faulty sensors."""

    def __init__(self, simulator: Any, faults: Setting) -> None:
        self._simulator, self._faults = simulator, faults

    def __getattr__(self, name: str) -> Any:
        return getattr(self._simulator, name)

    def predict(self, states: Array, stops: Array, channels: Sequence[Channel], picks: Sequence[tuple[Whole, Array]]) -> list[Array]:
        """As ``Replayer.predict``, of what the channels say."""
        true = [(window, true_instants(self._faults, c, time)) for c, (window, time) in zip(channels, picks, strict=True)]
        answers = self._simulator.predict(states, stops, channels, true)
        return [said(self._faults, c, answer, time) for c, answer, (_, time) in zip(channels, answers, picks, strict=True)]


def innovation_noise(part: Part) -> dict[str, float]:
    """Noise [unit] of channels that state none, from what the simulation leaves; what was taken before where that is not less."""
    found = {}
    left = np.empty(len(part.order))
    left[part.order] = part.residuals([part.assumed])[0]
    edges = np.cumsum([0, *(len(s.time) for s in part.samples)])
    for channel, s, source, first in zip(part.channels, part.samples, part.noise_from, edges[:-1], strict=True):
        if source == "stated":
            continue
        own = np.argsort(s.time, kind="stable")
        sigma = difference_noise(s.time[own], (left[first : first + len(s.time)] * s.noise)[own])
        found[channel.name] = sigma if quantisation(channel) < sigma < s.noise else s.noise
    return found
