"""Bodies that run into each other within the ranges of their joints: sampled poses, exact intersections of solids."""

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rille.cad.checks.body_shape import BodyShape, body_shapes
from rille.cad.checks.overlap import SMALLEST, BodySolid, Pair
from rille.cad.checks.poses import Coordinate, PoseSampler, Positions
from rille.model import Mesh, Rover

if TYPE_CHECKING:
    from manifold3d import Manifold

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Interference:
    """The worst overlap of two bodies that is not there at the zero pose.

    volume [m^3]. depth : mean thickness of the thickest overlap, 2 volume / area [m]. rest_volume : overlap at the zero pose [m^3].
    positions : of the joints, in the worst pose [rad or m]. overlap : the region, in M. count : poses in which the two overlap.
    approximate : a body is no closed surface and was taken by its convex hull.
    """

    body_a: str
    body_b: str
    volume: float
    depth: float
    rest_volume: float
    positions: dict[str, float]
    overlap: Mesh
    count: int
    approximate: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """A joint that, moved alone, runs into something before its limit.

    joint : whose limit is not reached. reached : last position without overlap. limit : end of the range (both [rad or m]).
    """

    joint: str
    kind: str
    reached: float
    limit: float
    body_a: str
    body_b: str
    approximate: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class RestOverlap:
    """Overlap of two bodies at the zero pose: ``volume`` [m^3], and its part of the smaller body's volume."""

    body_a: str
    body_b: str
    volume: float
    fraction: float


@dataclass(frozen=True, slots=True, kw_only=True)
class InterferenceReport:
    """Everything found, the largest depth first (approximate ones last).

    rest : overlaps at the zero pose. poses : looked at. impossible : that loops do not allow. complete : whether time was enough.
    notes : what was left out or only approximated.
    """

    found: tuple[Interference, ...]
    reaches: tuple[Reach, ...]
    rest: tuple[RestOverlap, ...]
    poses: int
    impossible: int
    complete: bool
    seconds: float
    notes: tuple[str, ...]


def find_interference(
    rover: Rover,
    *,
    samples: int = 256,
    angle_step: float = np.deg2rad(3.0),
    slide_steps: int = 40,
    seed: int = 0,
    time_limit: float = 120.0,
    shapes: Mapping[str, BodyShape] | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> InterferenceReport:
    """Look for bodies that overlap more than at the zero pose.

    Each joint goes alone from zero to both ends of its range (hinges in steps of ``angle_step`` [rad], slides in ``slide_steps`` steps; the
    first overlap is then found by bisection), then all joints go together through ``samples`` Sobol combinations. Gears, differentials
    and loops hold. Two bodies overlap if their solids share a region that they do not share at rest, more than 0.1 mm^3 and thicker than
    the tolerances of both meshes; the region of rest, carried along with either body, does not count.

    Parameters
    ----------
    samples : combinations of all joints; 0: only each joint alone.
    seed : of the combinations; the same seed gives the same poses.
    time_limit : [s]; what is not looked at by then is left out and noted.
    shapes : of the bodies, where they are known already (:func:`rille.cad.checks.body_shape.body_shapes`).
    progress : called with what is being done and the fraction done.
    """
    return _Search(rover, shapes or body_shapes(rover), progress or (lambda what, fraction: None), time_limit).run(
        samples, angle_step, slide_steps, seed
    )


@dataclass(slots=True)
class _Worst:
    volume: float
    depth: float
    positions: Positions
    region: "Manifold"
    motion: Array
    count: int = 1


class _Search:
    def __init__(self, rover: Rover, shapes: Mapping[str, BodyShape], progress: Callable[[str, float], None], time_limit: float) -> None:
        self.rover = rover
        self.progress = progress
        self.started = time.monotonic()
        self.deadline = self.started + time_limit
        self.sampler = PoseSampler(rover)
        self.notes = list(self.sampler.notes)
        self.solids: dict[str, BodySolid] = {}
        for name, shape in shapes.items():
            progress(f"solid of {name}", 0.0)
            solid = BodySolid(shape)
            if solid.approximated:
                self.notes.append(
                    f"{_some(solid.approximated, 'part')} of body '{name}' {_is(solid.approximated)} no closed surface, so interference "
                    "was looked "
                    "for with the convex hull; repair the drawing"
                )
            if solid.skipped:
                self.notes.append(f"{_some(solid.skipped, 'part')} of body '{name}' {_is(solid.skipped)} only a surface and was left out")
            if not solid.empty:
                self.solids[name] = solid
        self.pairs = self._pairs()
        self.worst: dict[tuple[str, str], _Worst] = {}
        self.reaches: dict[tuple[str, float], Reach] = {}
        self.poses = 0
        self.impossible = 0

    def run(self, samples: int, angle_step: float, slide_steps: int, seed: int) -> InterferenceReport:
        complete = self._sweeps(angle_step, slide_steps, 0.4 if samples else 1.0) and self._combinations(samples, seed)
        if not complete:
            self.notes.append(
                f"stopped after {time.monotonic() - self.started:.0f} s and {self.poses} poses, not all were looked at; allow more time "
                "or fewer samples"
            )
        self.progress("done", 1.0)
        found = [self._found(pair, worst) for pair, worst in self.worst.items()]
        return InterferenceReport(
            found=tuple(sorted(found, key=lambda i: (i.approximate, -i.depth, i.body_a, i.body_b))),
            reaches=tuple(self.reaches.values()),
            rest=tuple(
                RestOverlap(body_a=a, body_b=b, volume=pair.rest_volume, fraction=pair.rest_volume / min(pair.a.volume, pair.b.volume))
                for (a, b), pair in self.pairs.items()
                if pair.rest_volume > SMALLEST
            ),
            poses=self.poses,
            impossible=self.impossible,
            complete=complete,
            seconds=time.monotonic() - self.started,
            notes=tuple(self.notes),
        )

    def _pairs(self) -> dict[tuple[str, str], Pair]:
        pairs = {}
        names = list(self.solids)
        moving = {name for coordinate in self.sampler.coordinates for name in coordinate.ratios}
        for k, b in enumerate(names):
            for a in names[:k]:
                joints = self.sampler.linkage.between(a, b)
                if joints is not None and moving.intersection(joints):
                    pairs[a, b] = Pair(self.solids[a], self.solids[b], joints)
        return pairs

    def _sweeps(self, angle_step: float, slide_steps: int, share: float) -> bool:
        """Each coordinate alone, to either end."""
        loops = bool(self.rover.loop_closures)
        coordinates = self.sampler.coordinates
        for k, coordinate in enumerate(coordinates):
            self.progress(f"joint {coordinate.name} alone", share * k / len(coordinates))
            concerned = {key: p for key, p in self.pairs.items() if loops or p.joints.intersection(coordinate.ratios)}
            step = angle_step if coordinate.kind == "hinge" else (coordinate.upper - coordinate.lower) / slide_steps
            for end, stop in ((coordinate.lower, coordinate.stop_lower), (coordinate.upper, coordinate.stop_upper)):
                if not self._sweep(coordinate, end, stop, step, concerned):
                    return False
        return True

    def _sweep(self, coordinate: Coordinate, end: float, stop: str | None, step: float, pairs: dict[tuple[str, str], Pair]) -> bool:
        last, free = 0.0, True
        for position, positions in self.sampler.sweep(coordinate, end, step):
            if time.monotonic() > self.deadline:
                return False
            hit = self._look(positions, pairs)
            if hit and free and positions is not None:
                free = False
                if stop is not None:
                    self._reach(coordinate, stop, last, position, positions, end, hit[0])
            elif free and positions is not None:
                last = position
        return True

    def _reach(
        self, coordinate: Coordinate, stop: str, free: float, hit: float, at_hit: Positions, end: float, key: tuple[str, str]
    ) -> None:
        """Bisect for the first position with overlap."""
        pair = self.pairs[key]
        for _ in range(8):
            middle = (free + hit) / 2
            positions = self.sampler.closed({**at_hit, **coordinate.at(middle)}, frozenset(coordinate.ratios))
            if positions is None:
                break
            poses = self.sampler.poses(positions)
            if pair.overlap(poses[key[0]], poses[key[1]]):
                hit = middle
            else:
                free = middle
        ratio = coordinate.ratios[stop]
        self.reaches.setdefault(
            (stop, end * ratio),
            Reach(
                joint=stop,
                kind=self.sampler.linkage.joints[stop].kind,
                reached=free * ratio,
                limit=end * ratio,
                body_a=key[0],
                body_b=key[1],
                approximate=self._approximate(key),
            ),
        )

    def _combinations(self, samples: int, seed: int) -> bool:
        """All coordinates together; pairs that only one of them moves were seen before."""
        several = {
            key: pair
            for key, pair in self.pairs.items()
            if self.rover.loop_closures or sum(bool(pair.joints.intersection(c.ratios)) for c in self.sampler.coordinates) > 1
        }
        if not several:
            return True
        for k, positions in enumerate(self.sampler.combinations(samples, seed)):
            if k % 8 == 0:
                self.progress(f"combination {k + 1} of {samples}", 0.4 + 0.6 * k / samples)
            if time.monotonic() > self.deadline:
                return False
            self._look(positions, several)
        return True

    def _look(self, positions: Positions | None, pairs: dict[tuple[str, str], Pair]) -> list[tuple[str, str]]:
        """Look at one pose; the pairs that overlap in it."""
        if positions is None:
            self.impossible += 1
            return []
        self.poses += 1
        poses = self.sampler.poses(positions)
        hits = []
        for key, pair in pairs.items():
            new = pair.overlap(poses[key[0]], poses[key[1]])
            if new is None:
                continue
            hits.append(key)
            volume, depth, region = new
            before = self.worst.get(key)
            if before is None or depth > before.depth * (1 + 1e-6):
                count = 1 if before is None else before.count + 1
                self.worst[key] = _Worst(volume, depth, positions, region, poses[key[0]], count)
            else:
                before.count += 1
        return hits

    def _approximate(self, key: Iterable[str]) -> bool:
        return any(self.solids[name].approximated for name in key)

    def _found(self, key: tuple[str, str], worst: _Worst) -> Interference:
        mesh = worst.region.to_mesh64()
        vertices = np.array(mesh.vert_properties)[:, :3] @ worst.motion[:3, :3].T + worst.motion[:3, 3]
        pair = self.pairs[key]
        joints = {name: float(value) for name, value in worst.positions.items() if self.rover.loop_closures or name in pair.joints}
        return Interference(
            body_a=key[0],
            body_b=key[1],
            volume=worst.volume,
            depth=worst.depth,
            rest_volume=pair.rest_volume,
            positions=joints,
            overlap=Mesh(
                vertices=vertices.astype(np.float32), triangles=np.array(mesh.tri_verts).astype(np.int32), tolerance=pair.tolerance
            ),
            count=worst.count,
            approximate=self._approximate(key),
        )


def _some(names: list[str], what: str) -> str:
    return f"{what} '{names[0]}'" if len(names) == 1 else f"{len(names)} {what}s ('{names[0]}', ...)"


def _is(names: list[str]) -> str:
    return "is" if len(names) == 1 else "are"
