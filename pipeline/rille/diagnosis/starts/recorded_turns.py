"""An orientation that was recorded whole (a quaternion, or roll, pitch and yaw at once) and its rates, smoothed where no axis is special.

Near an instant the orientation is exp(phi) times a reference, phi the rotation vector in the axes of W. Samples of phi, and of its rate

    d phi/dt = J(phi)^-1 omega,   J^-1 = I - [phi]/2 + (1/a^2 - (1 + cos a)/(2 a sin a)) [phi]^2,   a = |phi|

(Bullo & Murray 1995, eq. 6), are smoothed as any coordinate. Roll and yaw of a body that points up are no smooth numbers, phi is.

While one of the angles is lost (its range ended, its radio failed) a gyro goes on: between two orientations its rates are integrated, and
what they miss at the end is taken off in proportion to time, as in strapdown navigation (Titterton & Weston 2004, ch. 3).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.starts.kinematic_smoother import LocalMotion, Series, reach, smooth
from rille.model.quaternion import conjugate, exponential, from_angles, logarithm, product
from rille.model.recording import ANGLES, Channel

Array = NDArray[np.float64]
Shown = Mapping[str, tuple[Channel, float]]
"""Channels with their noise by component."""
FARTHEST = 2.0  # [rad] from the reference: a rotation vector near half a turn is not smooth
GAP = 3.0  # usual intervals between samples, beyond which none is made up for what lies in between
COARSER = 3.0  # times the noise of an orientation, that one between two is taken to have which a gyro carries on: all share their errors
MISSED = 0.5  # [rad] that a gyro may miss at the end of a gap; more, and it says nothing of what lies in between
LOST = 0.5  # share of its samples that a component of an instrument may lack beside another (its range ended, its radio failed)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedTurns:
    """time (n,) [s] : delays taken off. turn (n, 4). made (n,) : carried on by a gyro. noise [rad] : of the others. rates : for each
    instrument instants (m,) [s], orientation there (m, 4), angular velocity in W (m, 3) [rad/s], its noise. alone : by axis, rates about
    axes of W of which not all three are recorded; they are taken as those of the rotation vector.
    """

    time: Array
    turn: Array
    made: NDArray[np.bool_]
    noise: float
    rates: tuple[tuple[Array, Array, Array, float], ...]
    alone: Mapping[str, Series] = field(default_factory=dict)

    def reference(self, times: Array) -> Array:
        """(k, 4) orientation that was recorded next to each instant (k,) [s]."""
        return self.turn[np.clip(np.searchsorted(self.time, times), 0, len(self.time) - 1)]

    def smooth(self, times: Array, references: Array, widest: float, widths: Sequence[Array] | None = None) -> list[LocalMotion]:
        """Rotation vectors from ``references`` (k, 4) and their rates at ``times`` (k,) [s] by axes of W. The rest as in ``smooth``."""
        parts: list[list[LocalMotion]] = [[], [], []]
        widest = reach(widest, self.time)
        for k, (instant, reference) in enumerate(zip(times, references, strict=True)):
            at, away, near = _near(self.time, self.turn, reference, instant, widest)
            made = self.made[near]
            kinds = [(~made, self.noise), *([(made, COARSER * self.noise)] if made.any() else [])]
            turning = []
            for time, turn, rate, noise in self.rates:
                when, where, chosen = _near(time, turn, reference, instant, widest)
                turning.append((when, _rates_of_vector(where, rate[chosen]), noise))
            for axis in range(3):
                series = [Series(order=0, time=at[here], value=away[here, axis], noise=noise) for here, noise in kinds]
                series += [Series(order=1, time=when, value=rate[:, axis], noise=noise) for when, rate, noise in turning]
                series += [self.alone["xyz"[axis]]] if "xyz"[axis] in self.alone else []
                fixed = None if widths is None else widths[axis][k : k + 1]
                parts[axis].append(smooth(times[k : k + 1], series, widest=widest, widths=fixed))
        return [_joined(motions) for motions in parts]


def recorded_turns(orientation: Shown, rates: Sequence[tuple[Shown, bool]]) -> RecordedTurns | None:
    """What is recorded of an orientation; None where it is not recorded whole, by one instrument.

    rates : angular velocities by components x, y, z, and whether they are along the axes of the body; along the body those that
    lack one are left out.
    """
    for names in (tuple("wxyz"), ANGLES):
        if not _whole(orientation, names):
            continue
        time, values, noise = _together(orientation, names)
        if names == ANGLES:
            turn = from_angles(values)
        else:  # a turn by a changes a component of a quaternion by at most a/2
            turn, noise = values / np.linalg.norm(values, axis=1, keepdims=True), 2.0 * noise
        gyros = [(*_together(shown, tuple("xyz")), in_body) for shown, in_body in rates if _whole(shown, tuple("xyz"))]
        time, turn, made = _carried_on(time, turn, gyros)
        turning = tuple(_turning(at, rate, own, in_body, time, turn, noise) for at, rate, own, in_body in gyros)
        single = {k: c for shown, in_body in rates if not in_body and not _whole(shown, tuple("xyz")) for k, c in shown.items()}
        alone = {k: Series(order=1, time=c.time - c.delay, value=c.value, noise=own) for k, (c, own) in single.items()}
        return RecordedTurns(time=time, turn=turn, made=made, noise=noise, rates=turning, alone=alone) if len(time) else None
    return None


def _whole(shown: Shown, names: Sequence[str]) -> bool:
    """Whether all components are there, of one instrument: about as many samples of each, though one may be believed to be late and some
    may be lost.
    """
    counts = [len(shown[name][0].time) for name in names if name in shown]
    return len(counts) == len(names) and min(counts) >= LOST * max(counts)


def _together(shown: Shown, names: Sequence[str]) -> tuple[Array, Array, float]:
    """Instants (n,) [s] of the component with the fewest samples, values (n, k) of all (interpolated to these), and noise, where all are
    known.
    """
    instants = [shown[name][0].time - shown[name][0].delay for name in names]
    fewest = min(instants, key=len)
    values = [_at(fewest, own, shown[name][0].value, name in ANGLES) for own, name in zip(instants, names, strict=True)]
    table = np.stack(values, axis=1)
    known = np.isfinite(table).all(axis=1)
    return fewest[known], table[known], float(np.mean([shown[name][1] for name in names]))


def _at(instants: Array, time: Array, value: Array, turns: bool) -> Array:
    """Values at ``instants`` (m,) [s] of samples (n,) at ``time`` (n,) [s]; NaN outside, and in gaps. turns : they are angles."""
    if np.array_equal(time, instants):
        return value
    known = np.isfinite(value)
    time, shown = time[known], np.unwrap(value[known]) if turns else value[known]
    if len(time) < 2:
        return np.full(len(instants), np.nan)
    after, near, usual = _behind(time, instants)
    at_one = np.minimum(np.abs(time[after] - instants), np.abs(instants - time[after - 1])) < 1e-3 * usual
    found = np.interp(instants, time, shown, left=np.nan, right=np.nan)
    return np.where(near | at_one, found, np.nan)


def _behind(time: Array, instants: Array) -> tuple[NDArray[np.int64], NDArray[np.bool_], float]:
    """Places (m,) in ``time`` (n,) [s], two or more, of the samples behind instants (m,) [s]; whether these are near the ones before them,
    within ``GAP`` usual intervals; and the usual interval [s].
    """
    after = np.clip(np.searchsorted(time, instants), 1, len(time) - 1)
    usual = float(np.median(np.diff(time)))
    return after, time[after] - time[after - 1] <= GAP * usual, usual


def _carried_on(time: Array, turn: Array, gyros: Sequence[tuple[Array, Array, float, bool]]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Instants (n,) [s] and orientations (n, 4), with those between that a gyro carries on where none is near; and which these are.

    gyros : instants (m,) [s], rates (m, 3) [rad/s], their noise, and whether they are along the axes of the body; the first that goes on
    through a gap is taken.
    """
    usual = float(np.median(np.diff(time))) if len(time) > 1 else np.inf
    found = [(time, turn, np.zeros(len(time), dtype=bool))]
    for first in np.flatnonzero(np.diff(time) > GAP * usual):
        between = np.linspace(time[first], time[first + 1], round((time[first + 1] - time[first]) / usual) + 1)
        for at, rate, _, in_body in gyros:
            path = _path(between, turn[first], turn[first + 1], at, rate, in_body)
            if path is not None:
                found.append((between[1:-1], path, np.ones(len(between) - 2, dtype=bool)))
                break
    times, turns, made = (np.concatenate(one) for one in zip(*found, strict=True))
    order = np.argsort(times, kind="stable")
    return times[order], turns[order], made[order]


def _path(between: Array, first: Array, last: Array, at: Array, rate: Array, in_body: bool) -> Array | None:
    """Orientations (k - 2, 4) at the inner ones of ``between`` (k,) [s], from ``first`` to ``last`` (4,), by rates (m, 3) [rad/s] at ``at``
    (m,) [s]; None where these are lost, too, or end elsewhere.
    """
    if len(at) < 2:
        return None
    inside = (at >= between[0]) & (at <= between[-1])
    nodes = np.unique(np.concatenate([between, at[inside]]))
    if not _behind(at, nodes)[1].all() or at[0] > between[0] or at[-1] < between[-1]:
        return None
    middle = 0.5 * (nodes[1:] + nodes[:-1])
    steps = exponential(np.diff(nodes)[:, None] * np.stack([np.interp(middle, at, rate[:, k]) for k in range(3)], axis=1))
    path = [first]
    for step in steps:
        path.append(product(path[-1], step) if in_body else product(step, path[-1]))
    missed = logarithm(product(last, conjugate(path[-1])))
    if np.linalg.norm(missed) > MISSED:
        return None
    share = (nodes - nodes[0]) / (nodes[-1] - nodes[0])
    ends_there = product(exponential(share[:, None] * missed), np.stack(path))
    return ends_there[np.searchsorted(nodes, between[1:-1])]


def _turning(
    at: Array, rate: Array, own: float, in_body: bool, time: Array, turn: Array, noise: float
) -> tuple[Array, Array, Array, float]:
    """An entry of ``rates``, at the instants between two orientations that are near."""
    if len(time) < 2:
        return at[:0], turn[:0], rate[:0], own
    after, near, _ = _behind(time, at)
    share = (at - time[after - 1]) / (time[after] - time[after - 1])
    between = (share >= 0) & (share <= 1) & near
    after, share, at, rate = after[between], share[between], at[between], rate[between]
    before = turn[after - 1]
    here = product(exponential(share[:, None] * logarithm(product(turn[after], conjugate(before)))), before)
    if in_body:
        rate = product(product(here, np.c_[np.zeros(len(rate)), rate]), conjugate(here))[:, 1:]
        shared = max(1.0, len(rate) / len(time))  # rates that are turned by the same two orientations, and by their errors
        own = float(np.hypot(own, noise * np.sqrt(shared * np.mean(rate**2)))) if len(rate) else own
    return at, here, rate, own


def _near(time: Array, turn: Array, reference: Array, instant: float, widest: float) -> tuple[Array, Array, slice]:
    """Instants (m,) within ``widest`` of an instant, rotation vectors (m, 3) from the reference there, and their places."""
    first, last = np.searchsorted(time, (instant - widest, instant + widest))
    away = logarithm(product(turn[first:last], conjugate(reference)))
    far = np.linalg.norm(away, axis=1) > FARTHEST
    here = time[first:last]
    early, late = here[far & (here < instant)], here[far & (here >= instant)]
    begin = first + int(np.searchsorted(here, early[-1], side="right")) if len(early) else first
    end = first + int(np.searchsorted(here, late[0])) if len(late) else last
    return time[begin:end], away[begin - first : end - first], slice(int(begin), int(end))


def _rates_of_vector(vector: Array, rate: Array) -> Array:
    """d phi/dt (m, 3) of rotation vectors phi (m, 3) of orientations that turn at ``rate`` (m, 3) [rad/s] in W."""
    angle = np.maximum(np.linalg.norm(vector, axis=1, keepdims=True), 1e-4)
    factor = 1 / angle**2 - (1 + np.cos(angle)) / (2 * angle * np.sin(angle))
    once = np.cross(vector, rate)
    return rate - 0.5 * once + factor * np.cross(vector, once)


def _joined(motions: Sequence[LocalMotion]) -> LocalMotion:
    return LocalMotion(
        value=np.concatenate([m.value for m in motions]),
        covariance=np.concatenate([m.covariance for m in motions]),
        width=np.concatenate([m.width for m in motions]),
        seen=np.concatenate([m.seen for m in motions]),
        placed=True,
    )
