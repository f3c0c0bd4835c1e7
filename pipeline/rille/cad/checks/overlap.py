"""Overlap of two bodies in a pose, beyond what they share at rest."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rille.cad.checks.body_shape import BodyShape
from rille.cad.solids import hull_solid

if TYPE_CHECKING:
    from manifold3d import Manifold

Array = NDArray[np.float64]

HEAVY = 20_000
"""Bodies with more triangles than this are simplified within the tolerance of their mesh."""
SMALLEST = 1e-10
"""Overlaps below 0.1 mm^3 are none."""
PRESS_FIT = 1e-3
"""Overlap at rest that is thinner than this [m] (press fits, threads, plates drawn into each other) may slide along without being news."""


class Boxes:
    """Boxes around parts of a surface, (k, 2, 3): lowest and highest corners."""

    def __init__(self, boxes: Array) -> None:
        self.low, self.high = boxes[:, 0], boxes[:, 1]
        self.middle, self.half = (self.low + self.high) / 2, (self.high - self.low) / 2
        if len(boxes):
            self.least, self.most = self.low.min(axis=0), self.high.max(axis=0)
            self.center = (self.least + self.most) / 2
            self.radius = float(np.linalg.norm(self.most - self.least)) / 2

    def meet(self, other: "Boxes", relative: Array) -> bool:
        """Whether a box meets a box of the other, moved by ``relative`` (4, 4); or one set lies within the other's extent."""
        turn, shift = relative[:3, :3], relative[:3, 3]
        apart = turn @ other.center + shift - self.center
        if apart @ apart > (self.radius + other.radius) ** 2:
            return False
        middle, half = other.middle @ turn.T + shift, other.half @ np.abs(turn).T
        low, high = middle - half, middle + half
        least, most = low.min(axis=0), high.max(axis=0)
        if (self.least > most).any() or (least > self.most).any():
            return False
        if ((self.low[:, None] <= high) & (low <= self.high[:, None])).all(axis=2).any():
            return True
        # no surfaces near each other: apart, or one inside of the other
        return bool(((self.least <= least) & (most <= self.most)).all() or ((least <= self.least) & (self.most <= most)).all())


class BodySolid:
    """Solid of a body: the union of its pieces, in M at the zero pose.

    tolerance : largest distance from the exact surface [m]. approximated : pieces that are no closed surface, taken by their hulls;
    skipped : those without any inside.
    """

    def __init__(self, shape: BodyShape) -> None:
        from manifold3d import Manifold, OpType

        self.name = shape.name
        self.tolerance = shape.tolerance
        self.approximated: list[str] = []
        self.skipped: list[str] = []
        members: list[Manifold] = []
        for piece in shape.pieces:
            if piece.closed is not None:
                members.append(piece.closed)
            elif piece.solid and (hull := hull_solid(piece.vertices)) is not None:
                self.approximated.append(piece.name)
                members.append(hull)
            else:
                self.skipped.append(piece.name)
        if sum(member.num_tri() for member in members) > HEAVY:
            members = [member.simplify(shape.tolerance) for member in members]
            self.tolerance *= 2
        self.solid: Manifold = members[0] if len(members) == 1 else Manifold.batch_boolean(members, OpType.Add)
        mesh = self.solid.to_mesh64()
        self.corners: Array = np.array(mesh.vert_properties)[:, :3][np.array(mesh.tri_verts, np.int64)]
        self.volume = float(self.solid.volume())
        self.boxes = Boxes(_clusters(self.corners, 64))

    @property
    def empty(self) -> bool:
        """Whether there is no solid at all."""
        return len(self.corners) == 0


class Pair:
    """Two bodies: overlap at rest, and what comes on top of it in a pose."""

    def __init__(self, a: BodySolid, b: BodySolid, joints: tuple[str, ...]) -> None:
        self.a, self.b, self.joints = a, b, frozenset(joints)
        region = a.solid ^ b.solid if a.boxes.meet(b.boxes, np.eye(4)) else None
        self.rest = None if region is None or region.is_empty() else region
        self.rest_volume = 0.0 if self.rest is None else float(self.rest.volume())
        self.tolerance = a.tolerance + b.tolerance + 1e-6
        if self.rest is not None:
            self.tolerance += min(1.2 * _thickness(self.rest)[1], PRESS_FIT)

    def overlap(self, motion_a: Array, motion_b: Array) -> "tuple[float, float, Manifold] | None":
        """Volume [m^3], depth [m] and region (in the zero-pose frame of a) of the overlap that is new in a pose.

        motion_a, motion_b : of the bodies from the zero pose, (4, 4).
        """
        back = motion_a[:3, :3].T
        relative = np.eye(4)
        relative[:3, :3] = back @ motion_b[:3, :3]
        relative[:3, 3] = back @ (motion_b[:3, 3] - motion_a[:3, 3])
        if not self.a.boxes.meet(self.b.boxes, relative):
            return None
        other = self.b.solid.transform(relative[:3])
        region = self.a.solid ^ other
        volume, depth = _thickness(region, self.tolerance)
        if volume <= SMALLEST:
            return None
        if self.rest is None:
            return volume, depth, region
        region = region - self.rest - self.rest.transform(relative[:3])
        volume, depth = _thickness(region, self.tolerance)
        return (volume, depth, region) if volume > SMALLEST else None


def _thickness(region: "Manifold", least: float = 0.0) -> tuple[float, float]:
    """Volume of the pieces of a region that are thicker than ``least``, and the thickness 2 V / A of the thickest."""
    volume, depth = 0.0, 0.0
    for piece in region.decompose():
        v, area = float(piece.volume()), float(piece.surface_area())
        if area > 0 and 2 * v / area > least:
            volume += v
            depth = max(depth, 2 * v / area)
    return volume, depth


def _clusters(corners: Array, count: int) -> Array:
    """Boxes (k, 2, 3) around groups of neighbouring triangles, k <= count: halves along the longest side, again and again."""
    groups = [corners] if len(corners) else []
    while groups and len(groups) < count:
        groups.sort(key=len)
        group = groups.pop()
        if len(group) < 8:
            groups.append(group)
            break
        middles = group.mean(axis=1)
        order = np.argsort(middles[:, int(np.argmax(np.ptp(middles, axis=0)))])
        groups += [group[order[: len(group) // 2]], group[order[len(group) // 2 :]]]
    return np.array([[g.min(axis=(0, 1)), g.max(axis=(0, 1))] for g in groups]).reshape(-1, 2, 3)
