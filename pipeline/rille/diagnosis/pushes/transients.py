"""Short pushes: when, at which joint, how strong, in which direction; how many is not told.

A pulse is added to the residual effort as a bell of unknown time, width and amplitude. Under the covariance of what the model is uncertain
about (``effort_uncertainty``) every bell has an amplitude and a standard error; the strongest is taken, then the strongest beside it, until
none is beyond what recordings in which nothing pushed show.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.stats import gumbel_r

from rille.diagnosis.pushes.effort_uncertainty import EffortUncertainty, Points, points_of, root_covariance
from rille.diagnosis.pushes.residual_effort import ResidualEffort
from rille.model.diagnosis import Transient

Array = NDArray[np.float64]
WIDTHS = (0.03, 0.045, 0.065, 0.095, 0.14, 0.2)  # [s] 1 sigma of the bells: 0.07 to 0.5 s at half their height
STEP = 1 / 3  # widths between neighbouring bells
ALONE = 0.3  # share of its own information that a bell must add to those already found
APART = 2.0  # sums of widths within which two bells are one push
REACH = 3.0  # widths around a bell in which it must stand out of the effort itself
LEAST_SCORE = 3.5  # whatever calibration says
LEAST_HEIGHT = 2.5  # usual residual efforts (1 sigma): the model is wrong by less every day
QUIET = 2.0  # score of a recording in which nothing stands out
FALSE_ALARMS = 0.04  # per recording that are accepted
MOST = 30  # pushes in one group of recordings
MOST_INSTANTS = 3000  # judged together
FULL_WIDTH = float(np.sqrt(2 * np.pi))  # a rectangle of the same height and area is so many widths long


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarm:
    """Scores that occur where nothing pushes: Gumbel distribution of the largest of a recording and coordinate, place and scale."""

    place: float
    scale: float

    def chance(self, score: float, coordinates: int) -> float:
        """Expected number of such scores in a recording."""
        return float(min(1.0, coordinates * gumbel_r.sf(abs(score), self.place, self.scale)))

    def threshold(self, coordinates: int) -> float:
        """Score from which a push is called one."""
        return max(LEAST_SCORE, float(gumbel_r.isf(FALSE_ALARMS / coordinates, self.place, self.scale)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Bell:
    """run : number of the recording. time, width [s]. amplitude, error [N m or N]. score : their ratio when it was found."""

    run: int
    time: float
    width: float
    amplitude: float
    error: float
    score: float


def alarms(groups: Sequence[Sequence[ResidualEffort]], uncertainty: EffortUncertainty) -> Alarm:
    """What scores the calibration recordings show, in which nothing pushed."""
    highest = []
    for group in groups:
        for c in range(len(uncertainty.coordinates)):
            for part in _parts(group):
                bells = _bells(points_of(part, c, uncertainty.usual), uncertainty.numbers[c], QUIET)
                for number in range(len(part)):
                    highest.append(max((abs(b.score) for b in bells if b.run == number), default=QUIET))
    place, scale = gumbel_r.fit(highest)
    return Alarm(place=float(place), scale=float(scale))


def find_pulses(
    efforts: Sequence[ResidualEffort],
    uncertainty: EffortUncertainty,
    alarm: Alarm,
    *,
    on_progress: Callable[[int, int, str], None] | None = None,
) -> tuple[Transient, ...]:
    """Pushes at the joints in recordings that were made together, in the order of the recordings and of time.

    What comes back in several of the recordings in the same state of the machine is taken as the model's error: give the recordings of one
    session together.
    """
    threshold = alarm.threshold(len(uncertainty.coordinates))
    found: list[Transient] = []
    for c, joint in enumerate(uncertainty.coordinates):
        if on_progress:
            on_progress(c, len(uncertainty.coordinates), "looking for pushes")
        for part in _parts(efforts):
            for bell in _bells(points_of(part, c, uncertainty.usual), uncertainty.numbers[c], threshold):
                found.append(_transient(part[bell.run].recording, joint, bell, alarm, len(uncertainty.coordinates)))
    order = {e.recording: k for k, e in enumerate(efforts)}
    return tuple(sorted(found, key=lambda t: (order[t.recording], t.start)))


def _transient(recording: str, joint: str, bell: Bell, alarm: Alarm, coordinates: int) -> Transient:
    duration = FULL_WIDTH * bell.width
    return Transient(
        recording=recording,
        kind="joint_pulse",
        target=joint,
        component="torque",
        start=bell.time - duration / 2,
        duration=duration,
        peak_time=bell.time,
        amplitude=bell.amplitude,
        amplitude_error=bell.error,
        score=bell.score,
        probability=1.0 - alarm.chance(bell.score, coordinates),
    )


def _parts(efforts: Sequence[ResidualEffort]) -> list[list[ResidualEffort]]:
    """Recordings in parts that can be judged together."""
    parts: list[list[ResidualEffort]] = [[]]
    for e in efforts:
        if parts[-1] and sum(len(o.time) for o in parts[-1]) + len(e.time) > MOST_INSTANTS:
            parts.append([])
        parts[-1].append(e)
    return parts


def _bells(p: Points, numbers: Array, threshold: float) -> list[Bell]:
    """Bells beyond the threshold, strongest first."""
    root = root_covariance(p, numbers)
    shapes, run, time, width = _shapes(p)
    plain = _plain(p, run, time, width)
    white = solve_triangular(root, shapes, lower=True, check_finite=False)
    left = solve_triangular(root, p.value, lower=True, check_finite=False)
    data = left.copy()
    own = (white**2).sum(axis=0)
    new, taken = own.copy(), np.zeros((len(left), 0))
    free = own > 0
    picks, scores = [], []
    while len(picks) < MOST:
        usable = free & (new > ALONE * own)
        size = np.sqrt(np.where(usable, new, 1.0))
        height = _smaller((white.T @ left) / size**2, plain)
        score = np.where(usable & (np.abs(height) > LEAST_HEIGHT * p.unit), height * size, 0.0)
        best = int(np.argmax(np.abs(score)))
        if abs(score[best]) < threshold:
            break
        picks.append(best)
        scores.append(float(score[best]))
        along = white[:, best] - taken @ (taken.T @ white[:, best])
        along /= np.linalg.norm(along)
        taken = np.c_[taken, along]
        left = left - along * (along @ left)
        new = new - (along @ white) ** 2
        free &= (run != run[best]) | (np.abs(time - time[best]) > APART * (width + width[best]))
    if not picks:
        return []
    chosen = white[:, picks]
    inverse = np.linalg.inv(chosen.T @ chosen)
    amplitude, error = inverse @ (chosen.T @ data), np.sqrt(np.diag(inverse))
    return [
        Bell(run=int(run[b]), time=float(time[b]), width=float(width[b]), amplitude=float(a), error=float(e), score=s)
        for b, a, e, s in zip(picks, amplitude, error, scores, strict=True)
    ]


def _smaller(first: Array, second: Array) -> Array:
    """The smaller in size of two, 0 where their signs differ."""
    return np.where(first * second > 0, np.sign(first) * np.minimum(np.abs(first), np.abs(second)), 0.0)


def _plain(p: Points, run: NDArray[np.int64], time: Array, width: Array) -> Array:
    """(m,) heights of bells above a straight line through their surroundings, without any model of the uncertainty: a push must show in the
    effort itself, not only against what the model's errors elsewhere would let one expect.
    """
    heights = np.zeros(len(time))
    for k, (r, t, w) in enumerate(zip(run, time, width, strict=True)):
        seen = float(np.hypot(w, p.resolution))
        first, last = np.searchsorted(p.run, (r, r + 1))
        first, last = first + np.searchsorted(p.time[first:last], (t - REACH * seen, t + REACH * seen))
        x = (p.time[first:last] - t) / seen
        columns = np.stack([w / seen * np.exp(-0.5 * x**2), np.ones_like(x), x], axis=1)
        if last - first > 3:
            heights[k] = np.linalg.lstsq(columns, p.value[first:last], rcond=None)[0][0]
    return heights


def _shapes(p: Points) -> tuple[Array, NDArray[np.int64], Array, Array]:
    """(n, m) bells of height 1, and of each its recording, time and width. The smoothing of the efforts widens and lowers them."""
    shapes, runs, times, widths = [], [], [], []
    for number in np.unique(p.run):
        here = p.run == number
        time = p.time[here]
        for width in WIDTHS:
            seen = np.hypot(width, p.resolution)
            for center in np.arange(time[0] + width, time[-1] - width, STEP * width):
                shape = np.zeros(len(p.time))
                shape[here] = width / seen * np.exp(-0.5 * ((time - center) / seen) ** 2)
                shapes.append(shape)
                runs.append(number)
                times.append(center)
                widths.append(width)
    return np.stack(shapes, axis=1), np.array(runs), np.array(times), np.array(widths)
