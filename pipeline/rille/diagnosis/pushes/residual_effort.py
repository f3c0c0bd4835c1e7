"""Residual effort of a mechanism that the world holds: what pushed its joints besides all that the model and the commands know.

From every instant of a fine grid the model is run over one interval of it from the recorded motion; what its speeds then lack is an effort,
r = M (v - v_simulated) / h. Dry friction that holds and commands that jump act in that run as they do in the machine. Smoothed over
``resolution`` it is the residual effort. Errors of the speed at one instant enter two neighbours with opposite signs, so they fade with
the width of the smoothing as width^-3/2.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from rille.diagnosis.comparison.compare import why_unfit
from rille.diagnosis.starts.kinematic_smoother import Series
from rille.diagnosis.starts.noise_floor import noise_of
from rille.diagnosis.starts.start_states import series_of
from rille.diagnosis.starts.state_coordinates import N_ROOT, Coordinate, coordinates_of
from rille.diagnosis.starts.steady_turns import with_steady_turns
from rille.model import InputRefused
from rille.model.recording import Recording

Array = NDArray[np.float64]
RESOLUTION = 0.02  # [s] 1 sigma of the smoothing of efforts, where the sampling allows it
FINE = 2  # median sampling intervals from one run of the model to the next
BEFORE = 0.4  # resolutions of smoothing of the motion before the model is run from it: dry friction turns noise of the speed into effort
ROUGH = 3.0  # resolutions that the smoothing is wider by which roughness is measured
WITHIN = 6.0  # resolutions over which roughness is averaged
GAP = 4.0  # fine intervals without a sample that are a hole
SPAN = 0.004  # [s] of a run that only serves to compare two models
EDGE = 3.0  # resolutions beside an end or a hole that are left out


@dataclass(frozen=True, slots=True, kw_only=True)
class ResidualEffort:
    """One recording, n instants ``interval`` [s] apart (but for holes), of C coordinates named by their joints.

    time (n,) [s]. value (n, C) [N m or N]. rough (n, C): root mean square, around the instant, of what ``ROUGH`` times as wide a smoothing
    takes away: vibration, and noise of the sensors. position, speed, applied (n, C) [rad or m, per second, N m or N]: smoothed alike;
    ``applied`` is what the drives gave in the model. applied_rate, applied_bend (n, C): its derivatives [per s, s^2].
    turns (C,): hinges, whose position is an angle.
    """

    recording: str
    coordinates: tuple[str, ...]
    resolution: float
    interval: float
    turns: tuple[bool, ...]
    time: Array
    value: Array
    rough: Array
    position: Array
    speed: Array
    applied: Array
    applied_rate: Array
    applied_bend: Array


def residual_effort(
    simulator: Any, recording: Recording, *, resolution: float = RESOLUTION, on_progress: Callable[[int, int, str], None] | None = None
) -> ResidualEffort:
    """Residual effort of every coordinate of a mechanism that the world holds.

    Parameters
    ----------
    simulator : as ``rille.simulate.Replayer``. resolution : [s] 1 sigma of the smoothing; at least two sampling intervals are taken.

    Raises
    ------
    InputRefused : for a machine with a free root, a joint whose position is not recorded, or too short a recording.
    """
    simulator.drive_by(recording)
    if simulator.root:
        raise InputRefused(
            f"residual efforts need a mechanism that the world holds, but '{simulator.root}' is free; look for pushes on its parts instead"
        )
    observed = with_steady_turns(recording.with_role("observed"))
    fit = [(channel, noise_of(channel)[0]) for channel in observed if not why_unfit(channel, recording)]
    coordinates = coordinates_of("", simulator.joints, simulator.ratios)
    series = [series_of(c, fit, "", simulator.joints) for c in coordinates]
    missing = [c.name for c, found in zip(coordinates, series, strict=True) if not any(s.order == 0 for s in found)]
    if missing:
        raise InputRefused(
            f"residual efforts need the position of every joint; recording '{recording.name}' lacks that of {', '.join(missing)}; "
            "compare forward, in windows, instead"
        )
    sampling = max(float(np.median(np.diff(s.time))) for found in series for s in found if s.order == 0)
    fine = max(1, round(FINE * sampling / simulator.step)) * simulator.step
    resolution = max(resolution, 2 * sampling)
    grid = _grid(series, fine, simulator.step)
    if len(grid) * fine < 10 * resolution:
        raise InputRefused(f"recording '{recording.name}' is too short for residual efforts: {len(grid) * fine:.3g} s")
    before = BEFORE * resolution
    motion = [_motion(found, grid, fine, before) for found in series]
    position, speed = np.stack([m[0] for m in motion], axis=1), np.stack([m[1] for m in motion], axis=1)
    whole = np.all([m[2] for m in motion], axis=0)
    states = _states(len(simulator.joints), coordinates, grid, position, speed)
    if on_progress:
        on_progress(1, 2, "residual effort")
    given, lacking = simulator.missing_efforts(states[:-1], fine, states[1:, N_ROOT + len(simulator.joints) :])
    applied, value = _along(coordinates, given), _along(coordinates, lacking)
    whole = whole[:-1] & whole[1:] & np.isfinite(applied).all(axis=1) & np.isfinite(value).all(axis=1)
    return _thinned(
        recording.name, simulator, coordinates, resolution, fine, before, grid[:-1] + fine / 2, whole, value, applied, position, speed
    )


def efforts_at(simulator: Any, effort: ResidualEffort, rows: NDArray[np.int64]) -> Array:
    """(m, C) residual efforts in another model at some instants of a recording that drives it, from its smoothed motion: derivatives by
    what is changed in the model are smooth; the values themselves are not.
    """
    coordinates = coordinates_of("", simulator.joints, simulator.ratios)
    n = len(simulator.joints)
    time = np.round(effort.time[rows] / simulator.step) * simulator.step
    span = max(1, round(SPAN / simulator.step)) * simulator.step
    states = _states(n, coordinates, time, effort.position[rows], effort.speed[rows])
    return _along(coordinates, simulator.missing_efforts(states, span, states[:, N_ROOT + n :])[1])


def _grid(series: Sequence[Sequence[Series]], fine: float, step: float) -> Array:
    first = max(min(s.time[0] for s in found if s.order == 0) for found in series)
    last = min(max(s.time[-1] for s in found if s.order == 0) for found in series)
    return np.ceil(first / step) * step + fine * np.arange(max(0, int((last - first) / fine)))


def _motion(series: Sequence[Series], grid: Array, fine: float, before: float) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Position and rate (n,) of one coordinate on the grid, smoothed over ``before`` [s], and where there are samples. Sensors of one
    quantity count by their noise.
    """
    finest = grid[0] + fine / FINE * np.arange(FINE * (len(grid) - 1) + 1)
    found: dict[int, list[tuple[Array, float]]] = {0: [], 1: []}
    whole = np.ones(len(grid), dtype=bool)
    for s in series:
        seen = np.isfinite(s.value)
        time, value = s.time[seen], s.value[seen]
        found[s.order].append((np.interp(finest, time, value), max(s.noise, 1e-12) ** -2))
        after = np.clip(np.searchsorted(time, grid), 1, len(time) - 1)
        whole &= time[after] - time[after - 1] <= GAP * fine
    mean = {order: np.asarray(sum(v * w for v, w in rows) / sum(w for _, w in rows)) for order, rows in found.items() if rows}
    position = gaussian_filter1d(mean[0], before * FINE / fine, mode="nearest")
    rate = gaussian_filter1d(mean[1], before * FINE / fine, mode="nearest") if 1 in mean else np.gradient(position, fine / FINE)
    return position[::FINE], rate[::FINE], whole


def _states(n_joints: int, coordinates: Sequence[Coordinate], grid: Array, position: Array, speed: Array) -> Array:
    states = np.zeros((len(grid), N_ROOT + 2 * n_joints))
    states[:, 0], states[:, 4] = grid, 1.0
    for k, coordinate in enumerate(coordinates):
        for place, factor in coordinate.factors.items():
            states[:, N_ROOT + place] = factor * position[:, k]
            states[:, N_ROOT + n_joints + place] = factor * speed[:, k]
    return states


def _along(coordinates: Sequence[Coordinate], efforts: Array) -> Array:
    """(n, C) efforts along the coordinates from those at the joints (n, n_joints): joints that a ratio ties together work together."""
    return np.stack([sum((f * efforts[:, p] for p, f in c.factors.items()), np.zeros(len(efforts))) for c in coordinates], axis=1)


def _thinned(
    name: str,
    simulator: Any,
    coordinates: Sequence[Coordinate],
    resolution: float,
    fine: float,
    before: float,
    time: Array,
    whole: NDArray[np.bool_],
    value: Array,
    applied: Array,
    position: Array,
    speed: Array,
) -> ResidualEffort:
    """Smoothed over the resolution, and as many instants as that needs; none beside ends and holes."""
    width = resolution / fine

    def smooth(x: Array, by: float = width, order: int = 0) -> Array:
        return gaussian_filter1d(np.where(whole[:, None], x, 0.0), by, axis=0, order=order, mode="nearest") / fine**order

    smoothed = smooth(value + applied) - smooth(applied, float(np.hypot(width, before / fine)))  # the motion was smoothed before
    off = smoothed - gaussian_filter1d(smoothed, ROUGH * width, axis=0, mode="nearest")
    rough = np.sqrt(gaussian_filter1d(off**2, WITHIN * width, axis=0, mode="nearest"))
    far = int(np.ceil(EDGE * width))
    holes = np.concatenate([[0], np.cumsum(~whole)])
    place = np.arange(far, len(time) - far, max(1, round(width)))
    place = place[holes[place + far] - holes[place - far] == 0]
    kinds = {joint.name: joint.kind for joint in simulator.machine().joints}
    return ResidualEffort(
        recording=name,
        coordinates=tuple(c.name for c in coordinates),
        resolution=resolution,
        interval=max(1, round(width)) * fine,
        turns=tuple(kinds.get(c.name) != "prismatic" for c in coordinates),
        time=time[place],
        value=smoothed[place],
        rough=rough[place],
        position=smooth(position[:-1])[place],
        speed=smooth(speed[:-1])[place],
        applied=smooth(applied)[place],
        applied_rate=smooth(applied, order=1)[place],
        applied_bend=smooth(applied, order=2)[place],
    )
