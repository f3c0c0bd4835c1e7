"""A closed body cut by planes into nearly convex pieces: exact where the body is made of flat faces, good elsewhere.

CAD bodies are concave along the edges where two features meet, and the plane of either feature is where a person would cut. So the
candidates are the planes of the faces at reflex edges, the planes that halve those edges' angles, and the middle of the piece;
the one that leaves the least hull volume is taken, always in the piece that has most to lose. Neighbours whose common hull adds
little are joined again at the end. Greedy, as the approximate convex decomposition of Lien & Amato (2007), but by volume.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHARP = 0.03  # sine of the angle from which the faces at a reflex edge are cut along
CANDIDATES = 24  # planes tried for a cut of a piece of few triangles
EASY = 1500  # triangles from which fewer are tried
FEWEST_CANDIDATES = 8
PIECE_COST = 0.1  # of a piece's excess: what a cut must save for every part beyond two that it makes
PREFERENCE = 1e-3  # of a piece's excess: of two planes that are as good, the one that more edges ask for
NUDGE = 1e-6  # of a piece's size
SLIVER = 1e-6  # of the body's volume


@dataclass(slots=True)
class _Piece:
    """A manifold, its volume, and its hull with the hull's volume [m^3]."""

    body: Any
    volume: float
    hull: Any
    hull_volume: float
    final: bool = False

    @property
    def excess(self) -> float:
        return self.hull_volume - self.volume


def convex_pieces(body: Any, *, threshold: float, most: int, frame: Array | None = None) -> list[Any]:
    """Convex hulls (manifold3d.Manifold) that cover a body and together exceed its volume by at most ``threshold`` (a share).

    Parameters
    ----------
    body : manifold3d.Manifold, not empty.
    most : largest number of pieces; with it reached the excess is what it is.
    frame : rows are three directions, shape (3, 3): pieces that no reflex edge helps to cut are cut through the middle across these.
    """
    frame = np.eye(3) if frame is None else frame
    total = body.volume()
    pieces = _components(body, SLIVER * total)
    goal = 0.6 * threshold * total  # joining gives the rest back
    while len(pieces) < most and sum(p.excess for p in pieces) > goal:
        open_pieces = [p for p in pieces if not p.final]
        if not open_pieces:
            break
        worst = max(open_pieces, key=lambda p: p.excess)
        if worst.excess <= 1e-3 * goal:
            break
        parts = _cut(worst, frame, SLIVER * total)
        if len(parts) < 2:
            worst.final = True
            continue
        pieces.remove(worst)
        pieces.extend(parts)
    return _joined(pieces, threshold * total)


def _components(body: Any, least: float) -> list[_Piece]:
    """The connected parts of a manifold with their hulls, slivers left out."""
    found = []
    for part in body.decompose():
        volume = part.volume()
        if volume <= least:
            continue
        hull = part.hull()
        found.append(_Piece(part, volume, hull, hull.volume()))
    return found


def _cut(piece: _Piece, frame: Array, least: float) -> list[_Piece]:
    """The piece cut by its best plane; one part or none if no plane cuts it."""
    best: list[_Piece] = []
    lowest = float("inf")
    tried = min(CANDIDATES, max(FEWEST_CANDIDATES, CANDIDATES * EASY // max(piece.body.num_tri(), 1)))
    for normal, offset in [*_reflex_planes(piece.body)[:tried], *_middle_planes(piece.body, frame)]:
        parts = [part for half in piece.body.split_by_plane(tuple(normal), offset) for part in _components(half, least)]
        cost = sum(p.hull_volume for p in parts) + PIECE_COST * piece.excess * (len(parts) - 2)
        if len(parts) > 1 and cost < lowest - PREFERENCE * piece.excess:
            best, lowest = parts, cost
    return best


def _middle_planes(body: Any, frame: Array) -> list[tuple[Array, float]]:
    """Planes across the frame's directions through the middle of a piece, the longest direction first."""
    along = _vertices(body) @ frame.T
    low, high = along.min(axis=0), along.max(axis=0)
    order = np.argsort(low - high)
    longest = (high - low).max()
    return [(frame[i], float(low[i] + high[i]) / 2) for i in order if high[i] - low[i] > 0.3 * longest]


def _vertices(body: Any) -> Array:
    return np.array(body.to_mesh64().vert_properties, np.float64)[:, :3]


def _reflex_planes(body: Any) -> list[tuple[Array, float]]:
    """Planes (unit normal, offset) at reflex edges: those of the faces beside sharp ones, else those that halve the angle."""
    mesh = body.to_mesh64()
    vertices = np.array(mesh.vert_properties, np.float64)[:, :3]
    triangles = np.array(mesh.tri_verts, np.int64)
    one = np.arange(len(vertices))
    one[np.array(mesh.merge_from_vert, np.int64)] = np.array(mesh.merge_to_vert, np.int64)
    triangles = one[triangles]
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals / np.where(lengths > 0, lengths, 1)[:, None]
    start, end = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    count = len(vertices)
    order = np.argsort(start * count + end)
    keys = start * count + end
    mate = order[np.searchsorted(keys[order], end * count + start).clip(max=len(order) - 1)]
    mine = np.arange(len(start)) // 3
    other = mate // 3
    edge = vertices[end] - vertices[start]
    # sin of the turn at the edge: positive where the neighbour rises above this face.
    sine = -np.einsum("ij,ij->i", np.cross(normals[mine], normals[other]), edge / np.maximum(np.linalg.norm(edge, axis=1), 1e-30)[:, None])
    paired = keys[mate] == end * count + start
    reflex = np.flatnonzero(paired & (sine > 1e-3) & (mine < other) & (lengths[mine] > 0) & (lengths[other] > 0))
    if len(reflex) == 0:
        return []
    weight = np.linalg.norm(edge[reflex], axis=1) * sine[reflex]
    sharp = sine[reflex] > SHARP
    point = vertices[start[reflex]]
    halving = np.cross(edge[reflex], normals[mine[reflex]] + normals[other[reflex]])
    halving /= np.maximum(np.linalg.norm(halving, axis=1), 1e-30)[:, None]
    size = float(np.ptp(vertices, axis=0).max())
    planes = np.concatenate([normals[mine[reflex]][sharp], normals[other[reflex]][sharp], halving])
    points = np.concatenate([point[sharp], point[sharp], point])
    weights = np.concatenate([weight[sharp], weight[sharp], 0.5 * weight])
    offsets = np.einsum("ij,ij->i", planes, points)
    # Just outside of the face: a cut in its very plane would leave the face, without thickness, on the other half.
    offsets[: 2 * np.count_nonzero(sharp)] += NUDGE * size
    return _strongest(planes, offsets, weights, size)


def _strongest(normals: Array, offsets: Array, weights: Array, size: float) -> list[tuple[Array, float]]:
    """The planes that carry most weight, equal ones (either side) taken together."""
    sign = np.where(normals[np.arange(len(normals)), np.argmax(np.abs(normals), axis=1)] > 0, 1.0, -1.0)
    normals, offsets = normals * sign[:, None], offsets * sign
    keys = np.column_stack([np.round(normals, 2), np.round(offsets / (2e-3 * size))])
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    total = np.bincount(inverse.ravel(), weights, len(first))
    return [(normals[first[i]], float(offsets[first[i]])) for i in np.argsort(-total)[:CANDIDATES]]


def _joined(pieces: list[_Piece], allowed: float) -> list[Any]:
    """Hulls of the pieces, neighbours joined while the hulls together exceed the body by no more than ``allowed`` [m^3]."""
    hulls = [(p.hull, p.hull_volume) for p in pieces]
    left = allowed - sum(p.excess for p in pieces)
    gains = {(i, j): _together(hulls[i], hulls[j]) for i in range(len(hulls)) for j in range(i)}
    alive = set(range(len(hulls)))
    while gains:
        (i, j), (added, hull) = min(gains.items(), key=lambda item: item[1][0])
        if added > left:
            break
        left -= max(added, 0.0)
        alive -= {i, j}
        gains = {pair: value for pair, value in gains.items() if i not in pair and j not in pair}
        hulls.append((hull, hull.volume()))
        new = len(hulls) - 1
        gains.update({(new, k): _together(hulls[new], hulls[k]) for k in alive})
        alive.add(new)
    return [hulls[i][0] for i in sorted(alive)]


def _together(one: tuple[Any, float], two: tuple[Any, float]) -> tuple[float, Any]:
    """Volume that the common hull of two hulls adds [m^3], and that hull; infinite where their boxes stand apart."""
    from manifold3d import Manifold

    low_one, high_one = (np.array(v) for v in (one[0].bounding_box()[:3], one[0].bounding_box()[3:]))
    low_two, high_two = (np.array(v) for v in (two[0].bounding_box()[:3], two[0].bounding_box()[3:]))
    gap = np.maximum(low_one, low_two) - np.minimum(high_one, high_two)
    if (gap > 0.05 * np.maximum(high_one - low_one, high_two - low_two).max()).any():
        return float("inf"), None
    hull = Manifold.batch_hull([one[0], two[0]])
    return hull.volume() - one[1] - two[1], hull
