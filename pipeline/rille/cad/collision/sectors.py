"""A part with rotational symmetry cut in one sector, whose pieces are turned round the axis: exact copies, and a fraction of the work.

A rim is taken off along its inner radius, and rim and inside are decomposed each by its own order: 24 grousers over 5 spokes.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.cad.collision.cuts import convex_pieces
from rille.cad.collision.symmetry import RotationalSymmetry, order_about

Array = NDArray[np.float64]

PHASES = 4  # of the sector tried, the half of them with the smaller hulls in full
REVOLUTION = (8, 12, 16, 24, 32, 48)  # sectors tried for a body of revolution
FEW = 8  # pieces of the inside as a whole that are better than sectors of it
FACETS = 120  # of the cylinder that takes the rim off
INSIDE = 0.6  # of what the whole may exceed by, the inside may; the rim gets what that leaves
DROP = 0.6  # the rim ends where the share of material drops by this

Copies = tuple[Array, list[tuple[Array, Array]]]
"""Corners of a convex piece [m], shape (n, 3), and the (rotation, shift) of every copy, the first of them the piece itself."""


def symmetric_pieces(bodies: list[Any], symmetry: RotationalSymmetry, *, tolerance: float, threshold: float, most: int) -> list[Copies]:
    """Convex pieces of a symmetric part, each with its copies; empty if there is no symmetry to use or ``most`` pieces do not suffice.

    bodies : closed bodies (manifold3d.Manifold) in the part's frame, within ``tolerance`` [m] of the part. threshold : share by which the
    pieces may exceed the part.
    """
    from manifold3d import Manifold, OpType

    frame = np.array([symmetry.reference, np.asarray(np.cross(symmetry.axis, symmetry.reference), float), symmetry.axis])
    whole = bodies[0] if len(bodies) == 1 else Manifold.batch_boolean(bodies, OpType.Add)
    local = whole.transform(np.column_stack([frame, -frame @ symmetry.point]))
    total = local.volume()
    rings = _rings(local, symmetry, tolerance)
    found: list[Copies] = []
    spent = 0.0
    for i, (ring, order) in enumerate(rings):
        last = i == len(rings) - 1
        allowed = max(threshold * total - spent, 0.3 * threshold * ring.volume()) if last else INSIDE * threshold * total
        share = allowed / ring.volume()
        excess, pieces, count = _fewest(ring, order, symmetry.asymmetry > 0, share, most, together=not last)
        spent += excess * ring.volume()
        most -= count * len(pieces)
        if not pieces or most < 0:
            return []
        poses = [_turned(symmetry, 2 * math.pi * k / count) for k in range(count)]
        found += [(piece @ frame + symmetry.point, poses) for piece in pieces]
    return found


def _rings(body: Any, symmetry: RotationalSymmetry, tolerance: float) -> list[tuple[Any, int]]:
    """The inside and the rim, or the whole where there is no rim, each with its order; nothing if none has a symmetry."""
    inner = _inner_radius(body, symmetry.rim_radius) if symmetry.round else None
    if inner is None:
        return [(body, symmetry.order)] if symmetry.order == 0 or symmetry.order >= 3 else []
    # A gap between the two, within the tolerance: the triangles of the rim's inner face stand inside of its radius, and a skin of rim on
    # the spokes would not be convex.
    rim = body - _cylinder(body, inner)
    inside = (body ^ _cylinder(body, inner - 2 * tolerance)).simplify(0.5 * tolerance)
    if inside.volume() <= 1e-3 * body.volume():
        return [(rim, symmetry.grouser_count)]
    mesh = inside.to_mesh64()
    order = order_about(np.array(mesh.vert_properties, np.float64)[:, :3], np.array(mesh.tri_verts, np.int64), np.array([0.0, 0.0, 1.0]))
    return [(inside, order), (rim, symmetry.grouser_count)]


def _fewest(body: Any, order: int, uneven: bool, threshold: float, most: int, *, together: bool) -> tuple[float, list[Array], int]:
    """Excess (a share), corners of the pieces of one sector, and the number of sectors: the fewest pieces that meet the threshold.

    together : a few pieces of the whole are looked for first.
    """
    if together or order in (1, 2):
        excess, pieces = _pieces(body, 1, 0.0, threshold, FEW if order not in (1, 2) else most)
        if excess <= threshold or order in (1, 2):
            return excess, pieces, 1
    if order == 0:
        tried = _revolved(body, threshold, most)
    elif order <= most:
        starts = [2 * math.pi / order * k / PHASES for k in range(PHASES)]
        sectors = [_fullest(body, order, start) if uneven else (_sector(body, order, start), start) for start in starts]
        sectors.sort(key=lambda made: sum(part.hull().volume() for part in made[0].decompose()))
        tried = [(*_pieces(s, order, start + math.pi / order, threshold, most), order) for s, start in sectors[: PHASES // 2]]
    else:
        tried = []
    return min(tried, key=lambda made: (max(made[0], threshold), made[2] * len(made[1])), default=(0.0, [], order))


def _revolved(body: Any, threshold: float, most: int) -> list[tuple[float, list[Array], int]]:
    """Excess, pieces and number of sectors of a body of revolution, for numbers of sectors that may need the fewest pieces."""
    tried: list[tuple[float, list[Array], int]] = []
    for count in REVOLUTION:
        met = [n * len(pieces) for excess, pieces, n in tried if excess <= threshold]
        if count > min([most, *met]):
            break
        tried.append((*_pieces(_sector(body, count, 0.0), count, math.pi / count, threshold, most), count))
    return tried


def _pieces(body: Any, count: int, middle: float, threshold: float, most: int) -> tuple[float, list[Array]]:
    """Share by which the pieces of one of ``count`` sectors exceed it, and their corners. middle : angle of the sector's middle."""
    radial = np.array([math.cos(middle), math.sin(middle), 0.0])
    frame = np.array([radial, [-radial[1], radial[0], 0.0], [0.0, 0.0, 1.0]])
    hulls = convex_pieces(body, threshold=threshold, most=max(1, most // count), frame=frame)
    excess = sum(hull.volume() for hull in hulls) / body.volume() - 1
    return excess, [np.array(hull.to_mesh64().vert_properties, np.float64)[:, :3] for hull in hulls]


def _sector(body: Any, count: int, start: float) -> Any:
    """What lies between the half planes at the angles ``start`` and start + 2 pi / count about z."""
    end = start + 2 * math.pi / count
    return body.trim_by_plane((-math.sin(start), math.cos(start), 0.0), 0.0).trim_by_plane((math.sin(end), -math.cos(end), 0.0), 0.0)


def _fullest(body: Any, order: int, start: float) -> tuple[Any, float]:
    """The sector with most material, and where it starts: a keyway that the part has once stays out of it."""
    starts = [start + 2 * math.pi * k / order for k in range(order)]
    sectors = [(_sector(body, order, angle), angle) for angle in starts]
    return max(sectors, key=lambda made: round(made[0].volume() / body.volume(), 6))


def _inner_radius(body: Any, rim: float) -> float | None:
    """The largest radius below the rim at which corners lie and inside of which there is much less material."""
    vertices = np.array(body.to_mesh64().vert_properties, np.float64)
    radii = np.round(np.hypot(vertices[:, 0], vertices[:, 1]) / (1e-4 * rim)) * 1e-4 * rim
    values, counts = np.unique(radii[(radii > 0.5 * rim) & (radii < 0.998 * rim)], return_counts=True)
    step = 2e-3 * rim
    for radius in sorted(values[np.argsort(-counts)[:12]], reverse=True):
        volumes = [(body ^ _cylinder(body, radius + k * step)).volume() for k in (-2, -1, 1, 2)]
        inside, outside = (volumes[1] - volumes[0]) / (radius - 1.5 * step), (volumes[3] - volumes[2]) / (radius + 1.5 * step)
        if inside < DROP * outside:
            return float(radius)
    return None


def _cylinder(body: Any, radius: float) -> Any:
    """A cylinder about z, longer than the body."""
    from manifold3d import Manifold

    low, high = body.bounding_box()[2], body.bounding_box()[5]
    return Manifold.cylinder(2 * (high - low), radius, radius, FACETS, True).translate((0.0, 0.0, (low + high) / 2))


def _turned(symmetry: RotationalSymmetry, angle: float) -> tuple[Array, Array]:
    """Rotation and shift, x -> R x + t, of a turn about the axis of the part (Rodrigues)."""
    x, y, z = symmetry.axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return rotation, symmetry.point - rotation @ symmetry.point
