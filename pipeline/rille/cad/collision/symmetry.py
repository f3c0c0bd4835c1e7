"""Rotational symmetry of a part: its axis, its order, and the grousers on its rim.

The part is cut by planes across a candidate axis, and every cut by rays from that axis. On the ray at the angle theta the
signed powers of the radii where it meets the surface, m_p(theta) = Sum +-r^p, say how much material lies where: p = 1 its
length, p = 2 its area. A rotation by 2 pi/n about the axis maps the part onto itself exactly if only the harmonics 0, n, 2n, ...
of m_p(theta) are there, so the order is the greatest common divisor of the harmonics that stand above the noise of the tessellation.
"""

# The compiled module OCP has no type stubs that pyright can follow.
# pyright: reportAttributeAccessIssue=false, reportMissingModuleSource=false, reportMissingImports=false

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.cad.geometry import MM, tessellate, volume_properties

Array = NDArray[np.float64]

ANGLES = 5040  # rays per cut: divisible by every number up to 10, by 12, 14, 15, 16, 18, 20, 24, 30, 36, ...
FINE_ANGLES = 40320  # rays per cut for the thickness of grousers
CUTS = 36
FINENESS = 2e-4  # of the tessellation that symmetry is read from, relative to the part's half diagonal
NOISE = 1.5  # harmonics up to this multiple of the tessellation's relative fineness are noise
EQUAL_MOMENTS = 0.03  # principal moments this near to each other (relative) are worth a look
INNER_DEFECT = 0.02  # share of the volume that may lack the symmetry of the outside: keyways, set screws, cables
OUTER_DEFECT = 0.01  # share of the outside that may lack it: a hole in the rim
BLOCKS = 0.4  # share of the circumference from which blocks on a rim are a tread
HIGHEST_LUG = 0.35  # of the radius: what is higher is a spoke or a blade, no grouser
WIDEST_LUG = 0.55  # share of the circumference: beyond, the gaps are grooves in a rim
POLYGON = math.radians(32)  # facets that turn by more are edges of a prism, not facets of a coarse cylinder


@dataclass(frozen=True, slots=True, kw_only=True)
class RotationalSymmetry:
    """Rotational symmetry of a part, in the part's frame.

    point : on the axis, in the middle of the width [m], shape (3,). axis : unit vector, shape (3,), its largest component positive.
    reference : unit vector across the axis, shape (3,), that turns with the part: where the strongest harmonic of the material peaks.
    order : n of n-fold (n >= 3), 0 for a body of revolution, 1 where only the outside is symmetric (24 grousers over 5 spokes).
    radius : outermost [m]. rim_radius : of the rim without grousers [m]. width : of the rim along the axis [m].
    grouser_count, grouser_height above the rim [m], grouser_thickness along the rim [m] : of outward features on a round rim, 0 when
    there are none. round : the rim is round, as that of a wheel; a nut's is not. asymmetry : share of the volume that the rotation
    does not map onto the part: 0, or up to 0.02 where a keyway or a hole in the rim is forgiven, or more where the order is 1.
    """

    point: Array
    axis: Array
    reference: Array
    order: int
    radius: float
    rim_radius: float
    width: float
    grouser_count: int = 0
    grouser_height: float = 0.0
    grouser_thickness: float = 0.0
    round: bool = False
    asymmetry: float = 0.0


@dataclass(frozen=True, slots=True)
class _Triangles:
    """A surface (corners, shape (m, 3, 3) [m]) that is within ``fineness`` [m] of what it stands for."""

    corners: Array
    fineness: float | None


@dataclass(frozen=True, slots=True)
class _Cuts:
    """Cuts across an axis: ``moments`` m_p / radius^p, shape (2, cuts, angles), and outermost radius [m], shape (cuts, angles)."""

    moments: Array
    outer: Array


def rotational_symmetry(shape: Any) -> RotationalSymmetry | None:
    """Find the rotational symmetry of a TopoDS_Shape (one or more solids, anywhere, at any attitude); None if it has none.

    A candidate axis passes the centre of mass along a principal axis whose two other moments are equal, or is the axis of faces of
    revolution that passes near the centre. The shape itself is left as it is (it gets no triangles).
    """
    properties = volume_properties(shape)
    if properties.n_solids == 0 or properties.volume <= 0:
        return None
    axes = _principal_axes(properties.inertia)
    if not axes:
        return None
    candidates = [(properties.com, axis) for axis in axes]
    size = half_diagonal(shape)
    faces = [(p, a) for p, a in _face_axes(shape) if _distance(properties.com, p, a) < INNER_DEFECT * size]
    if len(axes) == 1:
        faces = [(p, a) for p, a in faces if abs(a @ axes[0]) > math.cos(0.05)]
    mesh = tessellate(without_triangles(shape), FINENESS * size)
    if mesh is None:
        return None
    surface = _Triangles(mesh.vertices.astype(float)[mesh.triangles], FINENESS * size)
    return _best(surface, _distinct([*faces[:6], *candidates], size))


def rotational_symmetry_of_mesh(vertices: NDArray[Any], triangles: NDArray[Any]) -> RotationalSymmetry | None:
    """As :func:`rotational_symmetry`, of triangles: vertices [m], shape (n, 3), and triangles, shape (m, 3). They need not be closed.

    Centre and principal axes are those of the surface. Facets that turn by less than 32 degrees stand for a round surface.
    """
    corners = np.asarray(vertices, float)[np.asarray(triangles)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2
    total = float(areas.sum())
    if not total > 0:
        return None
    corners, normals, areas = corners[areas > 0], normals[areas > 0], areas[areas > 0]
    middles = corners.mean(axis=1)
    center = areas @ middles / total
    # Integral of x x^T over a triangle: area / 12 (Sum of the corners' + 9 of the middle's).
    offsets = corners - center
    second = (
        np.einsum("t,tci,tcj->ij", areas, offsets, offsets) + 9 * np.einsum("t,ti,tj->ij", areas, middles - center, middles - center)
    ) / 12
    axes = _principal_axes(np.trace(second) * np.eye(3) - second)
    if len(axes) > 1:
        axes = [*axes, *_flat_directions(normals)]
    size = float(np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0))) / 2
    return _best(_Triangles(corners, None), _distinct([(np.asarray(center), axis) for axis in axes], size))


def order_about(vertices: Array, triangles: NDArray[Any], axis: Array) -> int:
    """Order of triangles about an axis through the origin: n of n-fold, 0 for a body of revolution, 1 for none."""
    found = _about(_Triangles(vertices[triangles], None), np.zeros(3), axis)
    return 1 if found is None else found.order


def _best(surface: _Triangles, candidates: list[tuple[Array, Array]]) -> RotationalSymmetry | None:
    """The highest symmetry among the candidate axes: a body of revolution first, then the highest order."""
    found = [s for point, axis in candidates if (s := _about(surface, point, axis)) is not None]
    return min(found, key=lambda s: (s.order != 0, -s.order, round(s.asymmetry, 4)), default=None)


def _about(surface: _Triangles, point: Array, axis: Array) -> RotationalSymmetry | None:
    """Symmetry about one axis."""
    frame = frame_along(_upright(axis))
    corners = (surface.corners - point) @ frame.T
    radii = np.hypot(corners[..., 0], corners[..., 1])
    radius = float(radii.max())
    if not radius > 0:
        return None
    low, high = float(corners[..., 2].min()), float(corners[..., 2].max())
    levels = low + (high - low) * (np.arange(CUTS) + 0.5 + 0.1 * (math.sqrt(2) - 1)) / CUTS
    cuts = _cut(corners, levels, ANGLES, radius)
    usual, coarsest = _sagitta(corners, radius) if surface.fineness is None else (surface.fineness, surface.fineness)
    noise = NOISE * usual / radius
    order, asymmetry = _order(corners, levels, radius, cuts, noise)
    if order is None:
        return None
    rim, count, height, thickness = _grousers(corners, levels, radius, cuts.outer, coarsest)
    tread = corners[..., 2][radii >= 0.8 * rim]
    middle = float(tread.min() + tread.max()) / 2
    return RotationalSymmetry(
        point=point + middle * frame[2],
        axis=frame[2],
        reference=_reference(cuts.moments[1], order) @ frame[:2],
        order=order,
        radius=radius,
        rim_radius=rim,
        width=float(np.ptp(tread)),
        grouser_count=count,
        grouser_height=height,
        grouser_thickness=thickness,
        round=count > 0 or _is_round(cuts.outer, radius, noise),
        asymmetry=asymmetry,
    )


def _order(corners: Array, levels: Array, radius: float, cuts: _Cuts, noise: float) -> tuple[int | None, float]:
    """Order (0: any angle, None: no symmetry) and the share of the volume that does not follow it."""
    inside = _spectrum(cuts.moments)
    if inside.max() <= noise:
        return 0, 0.0
    for order in sorted(_divisors(inside, noise), reverse=True):
        if order >= 3:
            fine = _cut(corners, levels, order * math.ceil(ANGLES / order), radius)
            if _off_order(_spectrum(fine.moments), order).max() <= noise:
                return order, 0.0
    outside = _spectrum(cuts.outer[None] / radius)
    stray = {}
    for order in {0, *_divisors(outside, noise)} - {1, 2}:
        fine = cuts if order == 0 else _cut(corners, levels, order * math.ceil(ANGLES / order), radius)
        stray[order] = _stray(fine.outer, order, 2 * noise * radius), _unmapped(fine.moments[1], order)
    least = min((outer for outer, _ in stray.values()), default=1.0)
    # Any divisor of the order maps the outside as well: the highest that does is the order.
    fit = [order for order, (outer, _) in stray.items() if outer <= min(least + 0.2 * OUTER_DEFECT, OUTER_DEFECT)]
    for order in sorted(fit, key=lambda order: order or math.inf, reverse=True):
        if stray[order][1] <= INNER_DEFECT:
            return order, stray[order][1]
    return (1, min(stray[order][1] for order in fit)) if fit else (None, 1.0)


def _reference(area: Array, order: int) -> Array:
    """Direction (x, y) in which a harmonic of the material peaks: that of the order, or the strongest of its multiples if that is faint."""
    harmonics = np.fft.rfft(area.sum(axis=0))[: ANGLES // 4]
    allowed = np.arange(1, len(harmonics))
    allowed = allowed[allowed % max(order, 1) == 0]
    strongest = int(allowed[np.argmax(np.abs(harmonics[allowed]))])
    k = order if order > 0 and abs(harmonics[order]) > 0.1 * abs(harmonics[strongest]) else strongest
    angle = -np.angle(harmonics[k]) / k + math.pi / ANGLES  # the first ray stands half a step from x
    return np.array([math.cos(angle), math.sin(angle)])


def _is_round(outer: Array, radius: float, noise: float) -> bool:
    """Whether the cuts near the largest radius are round, or have a tread of wide blocks."""
    rim = outer[outer.max(axis=1) > 0.9 * radius]
    if len(rim) == 0:
        return False
    blocks = rim.min() > 0.8 * radius and float(np.mean(rim > 0.98 * radius)) > BLOCKS
    return blocks or bool(_spectrum(rim[None] / radius).max() <= noise) or _stray(rim, 0, 2 * noise * radius) <= OUTER_DEFECT


def _stray(outer: Array, order: int, reach: float) -> float:
    """Share of rays whose outermost radius differs by more than ``reach`` [m] from what is usual in the sectors of the order."""
    sectors = outer.reshape(outer.shape[0], order or outer.shape[1], -1)
    return float(np.mean(np.abs(sectors - np.median(sectors, axis=1, keepdims=True)) > reach))


def _spectrum(values: Array) -> Array:
    """Root mean square over the cuts of the harmonics 1, 2, ... of each row, the larger of the quantities; shape (k,)."""
    harmonics = np.abs(np.fft.rfft(values, axis=-1)[..., 1 : ANGLES // 4]) / values.shape[-1]
    return np.sqrt((harmonics**2).mean(axis=1)).max(axis=0)


def _off_order(spectrum: Array, order: int) -> Array:
    """The harmonics that an n-fold part does not have."""
    return spectrum[np.arange(1, len(spectrum) + 1) % order != 0]


def _divisors(spectrum: Array, noise: float) -> set[int]:
    """Greatest common divisors of the harmonics above a level, for all levels from the strongest harmonic down to the noise."""
    found: set[int] = set()
    divisor = 0
    for k in np.argsort(-spectrum):
        if spectrum[k] <= noise or divisor == 1:
            break
        divisor = math.gcd(divisor, int(k) + 1)
        found.add(divisor)
    return found


def _unmapped(area: Array, order: int) -> float:
    """Share of the volume that a rotation by 2 pi/order does not map onto the part; any rotation for order 0."""
    n = order or area.shape[1]
    sectors = area.reshape(area.shape[0], n, -1)
    return float(np.abs(sectors - np.median(sectors, axis=1, keepdims=True)).sum() / np.abs(area).sum())


def _cut(corners: Array, levels: Array, angles: int, radius: float) -> _Cuts:
    """Cut triangles, shape (m, 3, 3) in the frame of the axis, at ``levels`` (rising) by rays at ``angles`` equal steps."""
    heights = corners[..., 2]
    first = np.searchsorted(levels, heights.min(axis=1), side="right")
    last = np.searchsorted(levels, heights.max(axis=1), side="right")
    triangle, level = _runs(first, last)
    above = heights[triangle] > levels[level, None]
    # The corner that is alone on its side, and the two edges that leave it.
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows = np.arange(len(triangle))
    tip, second, third = (corners[triangle, (alone + i) % 3] for i in range(3))

    def meet(end: Array) -> Array:
        share = (levels[level] - tip[:, 2]) / (end[:, 2] - tip[:, 2])
        return tip[:, :2] + share[:, None] * (end[:, :2] - tip[:, :2])

    start, end = meet(second), meet(third)
    upwards = above[rows, alone]  # so that material lies on the same side of every segment
    start, end = np.where(upwards[:, None], start, end), np.where(upwards[:, None], end, start)
    from_angle = np.arctan2(start[:, 1], start[:, 0])
    turn = np.arctan2(start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0], (start * end).sum(axis=1))
    step = 2 * math.pi / angles
    one, two = from_angle / step - 0.5, (from_angle + turn) / step - 0.5
    segment, ray = _runs(np.ceil(np.minimum(one, two)).astype(int), np.ceil(np.maximum(one, two)).astype(int))
    theta = (ray + 0.5) * step
    a, d = start[segment], (end - start)[segment]
    denominator = np.cos(theta) * d[:, 1] - np.sin(theta) * d[:, 0]
    numerator = a[:, 0] * d[:, 1] - a[:, 1] * d[:, 0]
    r = np.clip(np.divide(numerator, denominator, out=np.zeros_like(theta), where=denominator != 0), 0, radius)
    sign = np.sign(turn[segment])
    cell = level[segment] * angles + ray % angles
    size = len(levels) * angles
    moments = [np.bincount(cell, sign * (r / radius) ** p, size) for p in (1.0, 2.0)]
    outer = np.zeros(size)
    np.maximum.at(outer, cell, r)
    return _Cuts(np.array(moments, float).reshape(2, len(levels), angles), outer.reshape(len(levels), angles))


def _runs(first: NDArray[np.intp], last: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Owner and value of all integers in the half-open ranges [first, last)."""
    counts = np.maximum(last - first, 0)
    owner = np.repeat(np.arange(len(first)), counts)
    place = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return owner, first[owner] + place


def _sagitta(corners: Array, radius: float) -> tuple[float, float]:
    """How far the facets of a mesh stand off a round surface, usually and where it is coarse: radius (1 - cos(turn / 2)) [m].

    The turns are those of the edges that go round near the outside, their median and 95 %; more than that of a polygon is none.
    """
    a, b = (corners[:, order].reshape(-1, 3) for order in ([0, 1, 2], [1, 2, 0]))
    near = np.minimum(np.hypot(a[:, 0], a[:, 1]), np.hypot(b[:, 0], b[:, 1])) > 0.8 * radius
    a, b = a[near], b[near]
    turn = np.abs(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]))
    turn = turn[(turn > 1e-3) & (turn < POLYGON)]
    if len(turn) == 0:
        return FINENESS * radius, FINENESS * radius
    usual, coarsest = radius * (1 - np.cos(np.percentile(turn, [50, 95]) / 2))
    return float(usual), float(coarsest)


def _grousers(corners: Array, levels: Array, radius: float, outer: Array, fineness: float) -> tuple[float, int, float, float]:
    """Radius of the rim, and count, height and thickness of what stands out of it (zeros: nothing does)."""
    nothing = (radius, 0, 0.0, 0.0)
    lugs = [
        (i, level, count) for i, row in enumerate(outer) if (level := _rim_level(row, radius, fineness)) for count in [_count(row, level)]
    ]
    if not lugs:
        return nothing
    counts = [count for _, _, count in lugs]
    usual = max(set(counts), key=lambda c: (counts.count(c), c))
    chosen = [(i, level) for i, level, count in lugs if count == usual]
    if usual < 3:
        return nothing
    rim = float(np.percentile([level for _, level in chosen], 90))
    radii = np.hypot(corners[..., 0], corners[..., 1])
    exact = radii[(radii > rim - fineness) & (radii < rim + 2 * fineness)]  # corners lie on the round surface, chords inside it
    rim = float(np.median(exact)) if len(exact) else rim
    rows = [i for i, _ in chosen]
    rows = rows[:: max(1, len(rows) // 8)]
    fine = _cut(corners, levels[rows], usual * math.ceil(FINE_ANGLES / usual), radius).outer
    heights, widths = zip(*(_lug(row, usual, rim) for row in fine), strict=True)
    return rim, usual, float(np.median(heights)), float(np.median(widths))


def _rim_level(row: Array, radius: float, fineness: float) -> float | None:
    """Radius of the rim in one cut if lugs stand on it there: a round valley, steep flanks, not too high, not too wide."""
    top = float(row.max())
    if top < 0.9 * radius:
        return None
    kept = row[row >= (1 - HIGHEST_LUG) * top]
    shares, edges = np.histogram(kept, bins=100, range=((1 - HIGHEST_LUG) * top, top))
    # The lowest level that holds a fifth of the circumference, over two bins: a level may lie on the edge of one.
    pairs = shares + np.append(shares[1:], 0)
    levels = np.flatnonzero(pairs >= 0.2 * len(row))
    if len(levels) == 0:
        return None
    near = kept[(kept >= edges[levels[0]]) & (kept <= edges[min(levels[0] + 2, 100)])]
    rim = float(np.median(near))
    height = top - rim
    if height < max(0.005 * radius, 2 * fineness):
        return None
    valley = np.mean(np.abs(row - rim) <= max(0.1 * height, 2 * fineness))
    flank = np.mean((row > rim + 0.1 * height) & (row < rim + 0.9 * height))
    lug = np.mean(row > rim + 0.5 * height)
    return rim if valley >= flank and lug <= WIDEST_LUG else None


def _count(row: Array, rim: float) -> int:
    high = row > (rim + row.max()) / 2
    return int(np.sum(high & ~np.roll(high, 1)))


def _lug(row: Array, count: int, rim: float) -> tuple[float, float]:
    """Height above the rim in the middle of a lug, and its thickness along the rim at half its height [m]."""
    top = float(row.max())
    half = (rim + top) / 2
    high = row > half
    share = float(high.mean()) * 2 * math.pi / count
    starts = np.flatnonzero(high & ~np.roll(high, 1))
    middles = (starts + round(share / (4 * math.pi) * len(row))) % len(row)
    middle = float(np.median(row[middles]))
    height = middle if middle - rim > 0.8 * (top - rim) else top
    return height - rim, 2 * half * math.sin(share / 2)


def _principal_axes(inertia: Array) -> list[Array]:
    """Principal axes about which the two other moments are equal: one, or all three where all moments are equal."""
    moments, vectors = np.linalg.eigh(inertia)
    axes = np.asarray(vectors, np.float64)
    scale = EQUAL_MOMENTS * moments[2]
    pairs = [(abs(moments[(i + 1) % 3] - moments[(i + 2) % 3]), i) for i in range(3)]
    return [axes[:, i] for gap, i in sorted(pairs) if gap <= scale]


def frame_along(axis: Array) -> Array:
    """Rows x, y, z of a right-handed frame whose z is the unit vector ``axis``, shape (3, 3)."""
    x = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = x - (x @ axis) * axis
    x = x / np.linalg.norm(x)
    return np.array([x, np.asarray(np.cross(axis, x), float), axis])


def _upright(axis: Array) -> Array:
    """Unit vector along the axis whose largest component is positive (the first of equal ones)."""
    unit = axis / np.linalg.norm(axis)
    return unit if unit[np.argmax(np.abs(unit) - 1e-9 * np.arange(3))] > 0 else -unit


def _distance(point: Array, on_axis: Array, axis: Array) -> float:
    return float(np.linalg.norm(np.cross(point - on_axis, axis)))


def _distinct(candidates: list[tuple[Array, Array]], size: float) -> list[tuple[Array, Array]]:
    """Candidates without those that repeat an earlier one (1e-6 rad, 1e-6 of the size)."""
    kept: list[tuple[Array, Array]] = []
    for point, axis in candidates:
        if not any(np.linalg.norm(np.cross(axis, a)) < 1e-6 and _distance(point, p, a) < 1e-6 * size for p, a in kept):
            kept.append((point, axis))
    return kept


def _flat_directions(normals: Array) -> list[Array]:
    """The three directions of a mesh's normals (area vectors) that hold the largest area."""
    areas = np.linalg.norm(normals, axis=1)
    units = normals / areas[:, None]
    units *= np.where(units[np.arange(len(units)), np.argmax(np.abs(units), axis=1)] > 0, 1, -1)[:, None]
    keys, inverse = np.unique(np.round(units, 3), axis=0, return_inverse=True)
    weight = np.bincount(inverse.ravel(), areas, len(keys))
    return [keys[i] / np.linalg.norm(keys[i]) for i in np.argsort(-weight)[:3]]


def _face_axes(shape: Any) -> list[tuple[Array, Array]]:
    """Axes (point [m], direction) of the faces of revolution, those with the largest area first, each once."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepGProp import BRepGProp
    from OCP.GeomAbs import GeomAbs_SurfaceType as Kind
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    found: list[tuple[Array, Array]] = []
    weights: list[float] = []
    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while explorer.More():
        face = TopoDS.Face_s(explorer.Current())
        explorer.Next()
        surface = BRepAdaptor_Surface(face)
        kind = surface.GetType()
        if kind == Kind.GeomAbs_Cylinder:
            axis = surface.Cylinder().Axis()
        elif kind == Kind.GeomAbs_Cone:
            axis = surface.Cone().Axis()
        elif kind == Kind.GeomAbs_Torus:
            axis = surface.Torus().Axis()
        elif kind == Kind.GeomAbs_SurfaceOfRevolution:
            axis = surface.AxeOfRevolution()
        else:
            continue
        area = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, area)
        at, along = axis.Location(), axis.Direction()
        point, direction = MM * np.array([at.X(), at.Y(), at.Z()]), np.array([along.X(), along.Y(), along.Z()])
        for i, (p, a) in enumerate(found):
            if np.linalg.norm(np.cross(direction, a)) < 1e-5 and _distance(point, p, a) < 1e-6:
                weights[i] += area.Mass()
                break
        else:
            found.append((point, direction))
            weights.append(area.Mass())
    return [found[i] for i in np.argsort(-np.array(weights))] if found else []


def half_diagonal(shape: Any) -> float:
    """Half the diagonal of the bounding box [m]; 0 for a shape without extent."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    return 0.0 if box.IsVoid() else MM * math.sqrt(box.SquareExtent()) / 2


def without_triangles(shape: Any) -> Any:
    """The same geometry without triangles: those that are made of it do not stay with the part."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy

    return BRepBuilderAPI_Copy(shape, False, False).Shape()
