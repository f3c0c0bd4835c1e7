"""Where every window starts: what the recording shows, smoothed without a model; what it does not show, carried on by the simulation."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.starts.kinematic_smoother import LocalMotion, Series, smooth
from rille.diagnosis.starts.noise_floor import steady_rounding
from rille.diagnosis.starts.recorded_turns import recorded_turns
from rille.diagnosis.starts.state_coordinates import N_ROOT, Coordinate, coordinates_of
from rille.model.quaternion import angle_axes, angles, conjugate, exponential, from_angles, logarithm, product
from rille.model.recording import ANGLES, Channel

Array = NDArray[np.float64]
KEPT = 3.0  # standard deviations of the recorded value within which what the ground decides is kept
KEPT_SHARE = 0.1  # of the recorded uncertainty that is then left to the fit
UNSURE = 3.0  # times the smoother's standard deviation: under violent motion it says too little
# How well the simulation knows what it carries on: value and rate, 1 sigma, in m and m/s, rad and rad/s.
CARRIED = {"position": (2e-3, 1e-2), "turn": (5e-3, 2e-2), "joint": (5e-3, 2e-2)}
CARRIED_WITH_BODY_RATES = 20.0  # times more of the rate where sensors in the body's axes measure it: the fit takes it from them


@dataclass(frozen=True, slots=True, kw_only=True)
class Starts:
    """Start states of windows.

    states : (n_windows, n). coordinates : what they can be moved along. factor : (n_windows, n_coordinates, 2, 2) lower triangular square
    root of the covariance of value and rate. seen : (n_windows, n_coordinates) whether the recording shows it. axes : (n_windows, 3, 3)
    columns: axes of W about which the three turns act. ended : of each window, why the simulation that leads to it ended early.
    kept : (n_windows, n_coordinates) where what the simulation says was left although it is recorded. widths : of each coordinate
    (n_windows,) half-widths [s] of the smoother, 0 where nothing is seen.
    """

    states: Array
    coordinates: tuple[Coordinate, ...]
    factor: Array
    seen: NDArray[np.bool_]
    axes: Array
    ended: tuple[str, ...]
    kept: NDArray[np.bool_]
    widths: tuple[Array, ...]

    def change(self, standard: Array) -> Array:
        """Changes (..., n_coordinates, 2) along the axes of W for ``standard`` (..., n_windows, n_coordinates, 2) standard deviations."""
        change = np.einsum("wcij,...wcj->...wci", self.factor, standard)
        turns = [k for k, c in enumerate(self.coordinates) if c.kind == "turn"]
        if turns:
            change[..., turns, :] = np.einsum("wij,...wjk->...wik", self.axes, change[..., turns, :])
        return change

    def doubted(self, windows: NDArray[np.int64]) -> "Starts":
        """With less trust in some windows: what is seen taken ``UNSURE`` times as uncertain, what contact decided as uncertain as recorded,
        since it decided with the model that is in doubt.
        """
        unsure = np.ones(self.seen.shape)
        unsure[windows] = np.where(self.kept, 1 / KEPT_SHARE, np.where(self.seen, UNSURE, 1.0))[windows]
        return replace(self, factor=self.factor * unsure[:, :, None, None])


def start_states(
    simulator: Any,
    channels: Sequence[tuple[Channel, float]],
    times: Array,
    *,
    widest: float,
    on_progress: Callable[[int, int, str], None] | None = None,
) -> Starts:
    """Start states at ``times`` (n_windows,) [s].

    Coordinates that channels show (positions and rates of joints and of the root, its orientation as a quaternion or as angles) are
    smoothed; all others are those of the simulation, which runs on from window to window: the first from rest where the recording begins,
    each next one from the last window's end, moved to the recorded place (the height with the ground below it). On the ground also height,
    roll, pitch and undriven joints go on from the simulation where they agree with the recording within its error: contact decides them,
    and to put noise into them would shake the wheels' loads.

    Parameters
    ----------
    channels : observed channels with their noise [unit]. widest : [s], see ``smooth``.
    """
    coordinates = coordinates_of(simulator.root, simulator.joints, simulator.ratios)
    n_windows = len(times)
    turns = _Turns(simulator.root, channels)
    motions = _motions(simulator, turns, coordinates, channels, times, widest, on_progress=on_progress)
    rotation = [m for m, c in zip(motions, coordinates, strict=True) if c.kind == "turn"] or [None] * 3

    seen = np.zeros((n_windows, len(coordinates)), dtype=bool)
    factor = np.zeros((n_windows, len(coordinates), 2, 2))
    unsure = CARRIED_WITH_BODY_RATES if any(_in_body(c, simulator.root) for c, _ in channels) else 1.0
    for k, (coordinate, motion) in enumerate(zip(coordinates, motions, strict=True)):
        value, rate = CARRIED[coordinate.kind]
        factor[:, k] = np.diag([value, rate * (unsure if coordinate.kind != "joint" else 1.0)])
        if motion is None:
            continue
        seen[:, k] = motion.seen & motion.placed
        rounding = _rounding(coordinate, channels, simulator.root, simulator.joints)
        for window in np.flatnonzero(motion.seen):
            covariance = motion.covariance[window, :2, :2].copy()
            if not motion.placed:
                covariance[0, 0] = value**2
            covariance[0, 0] += rounding**2
            factor[window, k] = np.linalg.cholesky(covariance + np.diag([1e-24, 1e-24]))

    placer = _Placer(simulator, coordinates, motions, turns, rotation)
    states, axes, ended, kept = _carry_on(simulator, placer, times, bool(seen.all()) and not simulator.has_ground, on_progress)
    factor[kept] *= KEPT_SHARE
    return Starts(
        states=states,
        coordinates=coordinates,
        factor=factor,
        seen=seen,
        axes=axes,
        ended=ended,
        kept=kept,
        widths=tuple(np.where(m.seen, m.width, 0.0) if m is not None else np.zeros(n_windows) for m in motions),
    )


def smoothed_values(
    simulator: Any, starts: Starts, channels: Sequence[tuple[Channel, float]], widest: float, touched: Sequence[str]
) -> Array:
    """(n_windows, n_coordinates, 2) value and rate of the coordinates that channels show, at the instants of the starts and with the
    smoother's widths as they were; 0 for coordinates that none of the channels named in ``touched`` shows, or that are not seen.

    The difference of two of them, of the channels as they were and changed, is what a change of the recording does to the start.
    """
    times, found = starts.states[:, 0], np.zeros((len(starts.states), len(starts.coordinates), 2))
    some = [(c, noise) for c, noise in channels if c.name in touched]
    turned = any(c.target == simulator.root and c.quantity in ("part.orientation", "part.angular_velocity") for c, _ in some)
    wanted = [turned if c.kind == "turn" else bool(series_of(c, some, simulator.root, simulator.joints)) for c in starts.coordinates]
    turns = _Turns(simulator.root, channels if turned else (), starts.states[:, 4:8])
    motions = _motions(simulator, turns, starts.coordinates, channels, times, widest, wanted=wanted, widths=starts.widths)
    for k, motion in enumerate(motions):
        if motion is not None:
            found[:, k] = np.where(motion.seen[:, None], motion.value[:, :2], 0.0)
    return found


def _motions(
    simulator: Any,
    turns: "_Turns",
    coordinates: Sequence[Coordinate],
    channels: Sequence[tuple[Channel, float]],
    times: Array,
    widest: float,
    *,
    wanted: Sequence[bool] | None = None,
    widths: Sequence[Array] | None = None,
    on_progress: Callable[[int, int, str], None] | None = None,
) -> list[LocalMotion | None]:
    """Motion of every coordinate as the channels show it; None where they do not, or it is not ``wanted``. widths : as in ``smooth``."""
    found: list[LocalMotion | None] = []
    for k, coordinate in enumerate(coordinates):
        skipped = coordinate.kind == "turn" or (wanted is not None and not wanted[k])
        series = [] if skipped else series_of(coordinate, channels, simulator.root, simulator.joints)
        found.append(None if not series else smooth(times, series, widest=widest, widths=None if widths is None else widths[k]))
        if on_progress:
            on_progress(k + 1, len(coordinates), "smoothing")
    places = [k for k, c in enumerate(coordinates) if c.kind == "turn" and (wanted is None or wanted[k])]
    if places:
        for k, motion in zip(places, turns.smooth(times, widest, None if widths is None else [widths[k] for k in places]), strict=True):
            found[k] = motion
    return found


def _carry_on(
    simulator: Any, placer: "_Placer", times: Array, all_seen: bool, on_progress: Callable[[int, int, str], None] | None
) -> tuple[Array, Array, tuple[str, ...], NDArray[np.bool_]]:
    state = placer.first(times[0])
    states, axes = np.zeros((len(times), len(state))), np.zeros((len(times), 3, 3))
    kept = np.zeros((len(times), placer.size), dtype=bool)
    ended: list[str] = []
    message = ""
    for window, time in enumerate(times):
        state = state.copy()
        state[0] = time
        states[window], axes[window], kept[window] = placer.put(state, window)
        ended.append(message)
        message = ""
        if not all_seen and window + 1 < len(times):
            state, message = simulator.advance(states[window], times[window + 1])
            if message or not np.isfinite(state).all():
                state = placer.first(times[window + 1], window + 1)
            if on_progress:
                on_progress(window + 1, len(times), "carrying on")
    return states, axes, tuple(ended), kept


class _Placer:
    """Puts into a state what the recording shows."""

    def __init__(
        self,
        simulator: Any,
        coordinates: Sequence[Coordinate],
        motions: Sequence[LocalMotion | None],
        turns: "_Turns",
        rotation: Sequence[LocalMotion | None],
    ) -> None:
        self._simulator, self._coordinates, self._motions = simulator, coordinates, motions
        self._turns, self._rotation = turns, rotation
        self.size = len(coordinates)
        driven = {simulator.joints.index(joint) for _, joint, _ in simulator.drives}
        self._by_contact = np.array(
            [
                simulator.has_ground
                and (
                    (c.kind == "joint" and not driven & set(c.factors))
                    or (c.kind == "position" and c.axis == 2)
                    or (c.kind == "turn" and c.axis < 2)
                )
                for c in coordinates
            ],
            dtype=bool,
        )

    def first(self, time: float, window: int = 0) -> Array:
        """A state at rest where the recording shows the root to be in that window."""
        state = self._simulator.rest()
        shown = [m.value[window, 0] if m is not None and m.seen[window] and m.placed else None for m in self._motions]
        if self._simulator.root and self._simulator.on_terrain and shown[0] is not None and shown[1] is not None:
            trial = self.put(state, window)[0]
            state = self._simulator.rest(shown[0], shown[1], float(angles(trial[4:8])[2]))
        state[0] = time
        return state

    def put(self, state: Array, window: int) -> tuple[Array, Array, NDArray[np.bool_]]:
        """State (n,) with the coordinates that are shown, the axes (3, 3) of its turns, and which coordinates were kept as they were."""
        state = state.copy()
        n_joints = (len(state) - N_ROOT) // 2
        kept = np.zeros(self.size, dtype=bool)
        before = state[1:4].copy()
        for coordinate, motion in zip(self._coordinates, self._motions, strict=True):
            if coordinate.kind != "position" or motion is None or not motion.seen[window] or coordinate.axis == 2:
                continue
            if motion.placed:
                state[1 + coordinate.axis] = motion.value[window, 0]
            state[8 + coordinate.axis] = motion.value[window, 1]
        if self._simulator.has_ground:
            heights = self._simulator.heights(np.stack([before[:2], state[1:3]]))
            if np.isfinite(heights).all():
                state[3] += heights[1] - heights[0]
        for k, (coordinate, motion) in enumerate(zip(self._coordinates, self._motions, strict=True)):
            if (
                motion is None
                or not motion.seen[window]
                or coordinate.kind == "turn"
                or (coordinate.kind == "position" and coordinate.axis < 2)
            ):
                continue
            places = {3: (1.0, 10)} if coordinate.kind == "position" else {}
            places |= {N_ROOT + place: (factor, N_ROOT + n_joints + place) for place, factor in coordinate.factors.items()}
            first, (factor, rate) = next(iter(places.items()))
            kept[k] = self._by_contact[k] and motion.placed and agrees(motion, window, state[first] / factor, state[rate] / factor)
            if kept[k]:
                continue
            for value, (factor, rate) in places.items():
                if motion.placed:
                    state[value] = factor * motion.value[window, 0]
                state[rate] = factor * motion.value[window, 1]
        turns = [k for k, c in enumerate(self._coordinates) if c.kind == "turn"]
        axes, kept_turns = self._turns.put(state, self._rotation, window, self._by_contact[turns] if turns else np.zeros(3, dtype=bool))
        kept[turns] = kept_turns[: len(turns)]
        return state, axes, kept


def agrees(motion: LocalMotion, window: int, value: float, rate: float) -> bool:
    """Whether a value and rate lie within ``KEPT`` standard deviations of the recorded ones."""
    error = np.abs(motion.value[window, :2] - (value, rate))
    return bool((error <= KEPT * np.sqrt(np.diag(motion.covariance[window])[:2])).all())


class _Turns:
    """Orientation of the root as recorded: whole (a quaternion; roll, pitch and yaw of one instant), some angles, or none."""

    def __init__(self, root: str, channels: Sequence[tuple[Channel, float]], references: Array | None = None) -> None:
        """references (n_windows, 4) : orientations that turns are counted from at the instants of ``smooth``; None: those that are recorded
        next to each.
        """
        of_root = [(c, noise) for c, noise in channels if root and c.target == root]
        shown = {c.component: (c, noise) for c, noise in of_root if c.quantity == "part.orientation"}
        rates = {
            frame: {c.component: (c, n) for c, n in of_root if c.quantity == "part.angular_velocity" and c.frame == frame}
            for frame in ("world", "body")
        }
        self._recorded = recorded_turns(shown, [(rates["world"], False), (rates["body"], True)])
        self._rates = rates["world"]
        self._angles = {} if self._recorded else {k: shown[k] for k in ANGLES if k in shown}
        self._reference, self._given = np.empty((0, 4)), references

    def smooth(self, times: Array, widest: float, widths: Sequence[Array] | None = None) -> list[LocalMotion | None]:
        """Motion about three axes: those of W from a reference near each instant, or roll, pitch and yaw. widths : as in ``smooth``."""
        if self._recorded:
            self._reference = self._recorded.reference(times) if self._given is None else self._given
            return [*self._recorded.smooth(times, self._reference, widest, widths)]
        found: list[LocalMotion | None] = []
        for angle, axis in zip(ANGLES, "xyz", strict=True):
            series = [self._unwrapped(*self._angles[angle])] if angle in self._angles else []
            near = angle == "yaw" or not self._angles  # the rate about z is that of the yaw where the machine stands upright
            if axis in self._rates and near:
                series.append(as_series(*self._rates[axis], 1))
            fixed = None if widths is None else widths["xyz".index(axis)]
            found.append(smooth(times, series, widest=widest, widths=fixed) if series else None)
        return found

    @staticmethod
    def _unwrapped(channel: Channel, noise: float) -> Series:
        seen = np.isfinite(channel.value)
        return Series(order=0, time=channel.time[seen] - channel.delay, value=np.unwrap(channel.value[seen]), noise=noise)

    def put(
        self, state: Array, rotation: Sequence[LocalMotion | None], window: int, by_contact: NDArray[np.bool_]
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Turns the root of ``state`` (changed in place) as recorded; returns the axes (3, 3) of the three turns and which were kept."""
        kept = np.zeros(3, dtype=bool)
        shown = np.array([m is not None and bool(m.seen[window]) for m in rotation])
        if not shown.any() or (self._recorded and not shown.all()):
            return np.eye(3), kept
        value = np.array([m.value[window] if m is not None else np.zeros(3) for m in rotation])
        placed = shown & np.array([m is not None and m.placed for m in rotation])
        if self._recorded:
            away = logarithm(product(exponential(value[:, 0]), product(self._reference[window], conjugate(state[4:8]))))
            kept = self._kept(rotation, window, value[:, 0] - away, state[11:14], by_contact)
            state[4:8] = product(exponential(np.where(kept, 0.0, away)), state[4:8])
            state[11:14] = np.where(kept, state[11:14], value[:, 1])
            return np.eye(3), kept
        if not placed.any():
            state[11:14] = np.where(shown, value[:, 1], state[11:14])
            return np.eye(3), kept
        now = angles(state[4:8])
        rates = np.asarray(np.linalg.solve(angle_axes(now), state[11:14]), dtype=float) if abs(np.cos(now[1])) > 1e-3 else np.zeros(3)
        kept = self._kept(rotation, window, now, rates, by_contact & placed)
        value[2, 0] = now[2] + (value[2, 0] - now[2] + np.pi) % (2 * np.pi) - np.pi
        now = np.where(placed & ~kept, value[:, 0], now)
        rates = np.where(shown & ~kept, value[:, 1], rates)
        state[4:8] = from_angles(now)
        axes = angle_axes(now)
        state[11:14] = axes @ rates
        return axes, kept

    @staticmethod
    def _kept(
        rotation: Sequence[LocalMotion | None], window: int, value: Array, rate: Array, by_contact: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        return np.array(
            [
                bool(contact) and motion is not None and agrees(motion, window, value[axis], rate[axis])
                for axis, (motion, contact) in enumerate(zip(rotation, by_contact, strict=True))
            ]
        )


def as_series(channel: Channel, noise: float, order: int, factor: float = 1.0) -> Series:
    """Samples of a channel at the instants that they speak of; its target moves by ``factor`` times the coordinate."""
    return Series(order=order, time=channel.time - channel.delay, value=channel.value / factor, noise=noise / abs(factor))


def series_of(coordinate: Coordinate, channels: Sequence[tuple[Channel, float]], root: str, joints: Sequence[str]) -> list[Series]:
    """What the recording shows of a coordinate."""
    orders = {"joint.position": 0, "joint.velocity": 1} if coordinate.kind == "joint" else {"part.position": 0, "part.linear_velocity": 1}
    found: list[Series] = []
    for channel, noise in channels:
        if channel.quantity not in orders:
            continue
        order = orders[channel.quantity]
        if coordinate.kind == "joint":
            place = list(joints).index(channel.target) if channel.target in joints else -1
            if place in coordinate.factors:
                found.append(as_series(channel, noise, order, coordinate.factors[place]))
        elif channel.target == root and channel.component == "xyz"[coordinate.axis] and (order == 0 or channel.frame == "world"):
            found.append(as_series(channel, noise, order))
    return found


def _rounding(coordinate: Coordinate, channels: Sequence[tuple[Channel, float]], root: str, joints: Sequence[str]) -> float:
    """Error of a coordinate [m or rad] at rest by which all samples that show it may be rounded alike: the least of its channels."""
    found = [
        steady_rounding(channel, noise) * series.noise / noise
        for channel, noise in channels
        for series in series_of(coordinate, [(channel, noise)], root, joints)
        if series.order == 0
    ]
    return min(found, default=0.0)


def _in_body(channel: Channel, root: str) -> bool:
    return channel.frame == "body" and channel.quantity in ("part.linear_velocity", "part.angular_velocity") and bool(root)
