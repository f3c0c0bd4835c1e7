"""Poses that a mechanism can take: ranges, gears, differentials and loops respected."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.cad.checks.linkage import FREEDOM, Linkage
from rille.model import Rover
from rille.model.kinematics import forward_kinematics

Array = NDArray[np.float64]
Positions = dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Coordinate:
    """A joint that may be set, with those that gears and differentials move with it.

    lower, upper : range that all of them can go through [rad or m]. ratios : position of every coupled joint per position of this one
    (itself: 1). stop_lower, stop_upper : which joint's limit ends the range; None for a hinge that turns freely.
    """

    name: str
    kind: str
    lower: float
    upper: float
    ratios: dict[str, float]
    stop_lower: str | None
    stop_upper: str | None

    def at(self, position: float) -> Positions:
        """Positions of the joints that it moves."""
        return {name: ratio * position for name, ratio in self.ratios.items()}


class PoseSampler:
    """Poses of a rover within the ranges of its joints."""

    def __init__(self, rover: Rover) -> None:
        self.rover = rover
        self.linkage = Linkage(rover)
        self.notes: list[str] = []
        self.coordinates = tuple(self._coordinates())
        self._frames = {body.name: np.array(body.frame) for body in rover.bodies}

    def _coordinates(self) -> Iterator[Coordinate]:
        links: dict[str, list[tuple[str, float]]] = {}
        for a, b, ratio in self.linkage.couplings():
            links.setdefault(a, []).append((b, ratio))
            if ratio != 0:
                links.setdefault(b, []).append((a, 1 / ratio))
        done: set[str] = set()
        for joint in self.rover.joints:
            if FREEDOM[joint.kind] != 1 or joint.name in done:
                if joint.kind == "spherical":
                    self.notes.append(f"ball joint '{joint.name}' has no range, so it was held at the zero pose")
                continue
            ratios = {joint.name: 1.0}
            queue = [joint.name]
            while queue:
                at = queue.pop()
                for other, ratio in links.get(at, []):
                    if other not in ratios:
                        ratios[other] = ratios[at] * ratio
                        queue.append(other)
            done.update(ratios)
            coordinate = self._range(joint.name, joint.kind, ratios)
            if coordinate is not None:
                yield coordinate

    def _range(self, name: str, kind: str, ratios: dict[str, float]) -> Coordinate | None:
        lower, upper, low_stop, high_stop = -np.inf, np.inf, None, None
        for other, ratio in ratios.items():
            limit = self.linkage.joints[other].limit
            if limit is None or ratio == 0:
                continue
            low, high = sorted((limit.lower / ratio, limit.upper / ratio))
            if low > lower:
                lower, low_stop = low, other
            if high < upper:
                upper, high_stop = high, other
        if kind == "prismatic" and not np.isfinite([lower, upper]).all():
            self.notes.append(f"slide '{name}' has no limits, so it was held at the zero pose; give it limits to have its range looked at")
            return None
        if lower < -np.pi and kind == "hinge" and upper - max(lower, -np.pi) >= np.pi:
            lower, low_stop = -np.pi, None  # more than a turn brings nothing new
        if upper > np.pi and kind == "hinge" and min(upper, np.pi) - lower >= np.pi:
            upper, high_stop = np.pi, None
        if not lower < upper:
            return None
        return Coordinate(name=name, kind=kind, lower=lower, upper=upper, ratios=ratios, stop_lower=low_stop, stop_upper=high_stop)

    def poses(self, positions: Mapping[str, float]) -> dict[str, Array]:
        """Where the bodies have gone: motion of every body from the zero pose, (4, 4), in M."""
        moved = {}
        for body, matrix in forward_kinematics(self.rover, dict(positions)).items():
            motion = np.array(matrix, float)
            motion[:3, 3] -= motion[:3, :3] @ self._frames[body]
            moved[body] = motion
        return moved

    def closed(self, positions: Positions, held: frozenset[str]) -> Positions | None:
        """Positions near the given ones that close all loops, found by Newton steps of least length; None where there are none.

        held : joints that keep their position.
        """
        if not self.rover.loop_closures:
            return positions
        movable = [c for c in self.coordinates if c.name not in held]
        places = self.linkage.columns()
        width = max(place.stop for place in places.values())
        basis = np.zeros((width, len(movable)))
        for k, coordinate in enumerate(movable):
            for name, ratio in coordinate.ratios.items():
                basis[places[name], k] = ratio
        now = dict(positions)
        for _ in range(30):
            matrix, error = self.linkage.jacobian(forward_kinematics(self.rover, now))
            if float(np.abs(error).max()) < 1e-9:
                return now if self._inside(now) else None
            if not movable:
                return None
            step = np.linalg.lstsq(matrix @ basis, -error, rcond=1e-8)[0]
            step *= min(1.0, 0.3 / max(float(np.abs(step).max()), 1e-12))
            for coordinate, change in zip(movable, step, strict=True):
                for name, ratio in coordinate.ratios.items():
                    now[name] = now.get(name, 0.0) + ratio * float(change)
        return None

    def _inside(self, positions: Positions) -> bool:
        limits = [(joint.limit, positions.get(joint.name, 0.0)) for joint in self.rover.joints if joint.limit is not None]
        return all(limit.lower - 1e-6 <= q <= limit.upper + 1e-6 for limit, q in limits)

    def sweep(self, coordinate: Coordinate, end: float, step: float) -> Iterator[tuple[float, Positions | None]]:
        """One coordinate from zero to an end of its range, the others at zero (loops: where they must be)."""
        start = min(max(0.0, coordinate.lower), coordinate.upper)
        count = max(2, int(np.ceil(abs(end - start) / step)))
        now: Positions = {}
        for position in np.linspace(start, end, count + 1):
            if position == 0.0:
                continue
            made = self.closed({**now, **coordinate.at(float(position))}, frozenset(coordinate.ratios))
            now = made or now
            yield float(position), made

    def combinations(self, count: int, seed: int) -> Iterator[Positions | None]:
        """All coordinates together: a scrambled Sobol sequence (Joe & Kuo 2008), every other pose with each joint at an end of its range or
        at zero, where machines collide most."""
        if not self.coordinates or count <= 0:
            return
        from scipy.stats import qmc

        lower = np.array([c.lower for c in self.coordinates])
        upper = np.array([c.upper for c in self.coordinates])
        size = int(np.ceil(np.log2(max(count, 2) / 2)))
        # two sequences: every second point of one is no even sample
        inner, ends = (
            qmc.Sobol(len(self.coordinates), scramble=True, rng=np.random.default_rng([seed, k])).random_base2(size) for k in (0, 1)
        )
        for k in range(count):
            if k % 2:
                draw, middle = ends[k // 2], np.clip(0.0, lower, upper)
                values = np.where(draw < 0.4, lower, np.where(draw > 0.6, upper, middle))
            else:
                values = lower + inner[k // 2] * (upper - lower)
            positions: Positions = {}
            for coordinate, value in zip(self.coordinates, values, strict=True):
                positions.update(coordinate.at(float(value)))
            yield self.closed(positions, frozenset())
