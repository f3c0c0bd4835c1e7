"""Which solids of an assembly touch, and how: fits of cylinders, faces that lie on each other, aligned holes, overlap.

The smallest thing that can move is a solid, not a part: a servo drawn as one part has its horn in it. Boxes come first (axis-parallel,
in the assembly's frame), then analytic features, exact to the CAD kernel's rounding, then the triangles' distance and overlap
(Manifold, Lalish 2022), which also sees what is not analytic.
"""

# The compiled module OCP has no type stubs that pyright can follow.
# pyright: reportAttributeAccessIssue=false, reportMissingModuleSource=false, reportMissingImports=false

import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.cad.files.assembly import Assembly
from rille.cad.geometry import VolumeProperties, solids, tessellate, volume_properties
from rille.cad.suggestion.features import Cylinder, Plane, Sphere, cylinders, planes, spheres

Array = NDArray[np.float64]

TOUCH = 1e-4  # [m] closer than this is touching: CAD models leave gaps and overlaps of some hundredths of a millimetre
PARALLEL = 2e-3  # [rad] directions that differ less are parallel (0.1 deg)
COAXIAL = 1e-4  # [m] axes that are closer are one axis, also where the clearance would allow more
LOOSE = 0.2  # clearance of a fit over its radius; a medium clearance hole of an M3 screw has 0.13 (ISO 273)
WRAP = math.radians(150)  # a hole that surrounds less of its shaft does not hold it: it is a relief or a saddle
TIGHT = -0.25  # the same for a shaft that is drawn thicker than its hole: a thread (core over nominal diameter of M3 is 0.80)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedSolid:
    """One solid where it stands in the assembly. Lengths in metres, in the assembly's frame.

    instance : index into the assembly's instances. low, high : bounding box, shape (3,). volume [m^3]. center of mass, shape (3,).
    body : its triangles as a Manifold [mm], or None where they do not close.
    """

    instance: int
    path: str
    prototype: str
    cylinders: tuple[Cylinder, ...]
    planes: tuple[Plane, ...]
    spheres: tuple[Sphere, ...]
    low: Array
    high: Array
    volume: float
    center: Array
    body: Any

    @property
    def size(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.linalg.norm(self.high - self.low))

    @property
    def corners(self) -> Array:
        """Of the bounding box [m], shape (8, 3)."""
        unit = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
        return self.low + unit * (self.high - self.low)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fit:
    """A shaft in a hole on one axis.

    point : on the axis, middle of the engagement [m]. axis : unit. hole, shaft : radii [m]. length of the engagement [m]. offset between
    the two axes [m]. sweep : what both surround [rad]. hole_owner : index of the solid with the hole.
    rolling : number of balls that fill a wide gap.
    """

    point: Array
    axis: Array
    hole: float
    shaft: float
    length: float
    offset: float
    sweep: float
    hole_owner: int
    rolling: int = 0

    @property
    def clearance(self) -> float:
        """Radial clearance [m], below zero where the shaft is drawn thicker than the hole (thread, press fit)."""
        return self.hole - self.shaft


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FaceContact:
    """Two planar faces on each other. point : centre of the common area [m]. normal : out of the first solid. area [m^2]. gap [m].

    round_axis : the point where the axis of a round face passes (both round: they are concentric), else None. round_radius : of the
    smaller round face [m]. both_round : whether both are. rotor : the round face ends a disc that stands in an annular gap of its own
    solid, as the output of an actuator does whose rotor is drawn as one with its housing.
    """

    point: Array
    normal: Array
    area: float
    gap: float
    round_axis: Array | None = None
    round_radius: float = 0.0
    both_round: bool = False
    rotor: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AlignedHoles:
    """Two holes on one axis, one behind the other, in two solids: a place for a screw or a pin that need not be drawn."""

    point: Array
    axis: Array
    radius: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ball:
    """A ball in a socket. center [m], radius of the ball [m], clearance [m]."""

    center: Array
    radius: float
    clearance: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contact:
    """How two solids (indices first < second) meet.

    gap : distance of their triangles [m], 0 where they touch or overlap, NaN where it is above ``TOUCH``. overlap [m^3] and thickness of
    the overlap [m] (twice its volume over its surface).
    """

    first: int
    second: int
    fits: tuple[Fit, ...] = ()
    faces: tuple[FaceContact, ...] = ()
    aligned: tuple[AlignedHoles, ...] = ()
    balls: tuple[Ball, ...] = ()
    gap: float = math.nan
    overlap: float = 0.0
    thickness: float = 0.0

    @property
    def touches(self) -> bool:
        """Whether the two meet at all: a shaft in a hole meets it across its clearance."""
        return bool(self.fits or self.faces or self.balls) or not math.isnan(self.gap)


def place_solids(assembly: Assembly, progress: Callable[[str, float], None] | None = None) -> list[PlacedSolid]:
    """All solids of an assembly where they stand, with their features; parts without a solid have none."""
    say = progress or (lambda what, fraction: None)
    drawn: dict[int, list[PlacedSolid]] = {}
    found = []
    for count, instance in enumerate(assembly.instances):
        if instance.prototype not in drawn:
            prototype = assembly.prototypes[instance.prototype]
            say(f"features of {prototype.name}", count / len(assembly.instances))
            shapes = solids(prototype.shape)
            known = prototype.volume if len(shapes) == 1 else None
            drawn[instance.prototype] = [one for shape in shapes if (one := _solid(shape, prototype.name, known)) is not None]
        found += [_placed(one, count, instance.path, instance.matrix) for one in drawn[instance.prototype]]
    return found


def find_contacts(bodies: list[PlacedSolid], progress: Callable[[str, float], None] | None = None) -> list[Contact]:
    """All pairs of solids that touch or fit into each other."""
    say = progress or (lambda what, fraction: None)
    pairs = near_pairs(bodies, TOUCH)
    found = []
    for count, (i, j) in enumerate(pairs):
        if count % 20 == 0:
            say(f"contacts of {bodies[i].path}", count / len(pairs))
        contact = _contact(bodies[i], bodies[j], i, j)
        if contact.touches:
            found.append(contact)
    return found


def near_pairs(bodies: list[PlacedSolid], reach: float) -> list[tuple[int, int]]:
    """Pairs (i < j) whose bounding boxes come closer than ``reach`` [m]."""
    if not bodies:
        return []
    low = np.array([b.low for b in bodies]) - reach / 2
    high = np.array([b.high for b in bodies]) + reach / 2
    found = []
    for i in range(len(bodies)):
        near = np.all((low[i] <= high[i + 1 :]) & (low[i + 1 :] <= high[i]), axis=1)
        found += [(i, i + 1 + int(k)) for k in np.flatnonzero(near)]
    return found


def opposed_faces(a: PlacedSolid, b: PlacedSolid, reach: float) -> list[FaceContact]:
    """Planar faces that look at each other across a gap of at most ``reach`` [m]."""
    return _face_contacts(a, b, *_common_box(a, b, reach), reach)


def facing(a: PlacedSolid, b: PlacedSolid, reach: float) -> list[FaceContact]:
    """As :func:`opposed_faces`, with at least one of the two faces round."""
    return [f for f in opposed_faces(a, b, reach) if f.round_axis is not None]


def coaxial(bodies: list[PlacedSolid], i: int, j: int) -> list[Fit]:
    """Shafts of one solid that run in larger holes of the other, whatever the clearance: what is between them is not drawn."""
    a, b = bodies[i], bodies[j]
    return [f for f in _fits(a, b, i, j, *_common_box(a, b, 0.0), math.inf) if f.clearance > 0]


def seat_balls(bodies: list[PlacedSolid], contacts: list[Contact]) -> list[Contact]:
    """Replace the balls of rolling bearings by what they do: the rings that they run between fit into each other.

    A ball keeps the contact with the larger of its neighbours only, so it moves with that one.
    """
    around: dict[int, dict[int, Contact]] = {i: {} for i, body in enumerate(bodies) if is_ball(body)}
    for c in contacts:
        for ball, other in ((c.first, c.second), (c.second, c.first)):
            if ball in around and other not in around:
                around[ball][other] = c
    dropped: set[int] = set()
    between: Counter[tuple[int, int]] = Counter()
    for held in around.values():
        rings = sorted(held, key=lambda k: (-bodies[k].size, k))
        dropped.update(id(held[k]) for k in rings[1:])
        between.update((min(x, y), max(x, y)) for x, y in itertools.combinations(rings, 2))
    kept = [c for c in contacts if id(c) not in dropped]
    for (i, j), count in between.items():
        fits = coaxial(bodies, i, j)
        if count >= 3 and fits:
            best = min(fits, key=lambda f: (f.clearance, -f.length))
            kept.append(Contact(first=i, second=j, fits=(replace(best, rolling=count),)))
    return kept


def is_ball(body: PlacedSolid) -> bool:
    """Whether a solid is little else than a sphere."""
    area = sum(s.area for s in body.spheres if not s.concave)
    return area > sum(c.area for c in body.cylinders) + sum(p.area for p in body.planes)


def _solid(shape: Any, prototype: str, known: VolumeProperties | None) -> PlacedSolid | None:
    properties = known or volume_properties(shape)
    found = cylinders(shape), planes(shape), spheres(shape)
    body, low, high = _triangles(shape)
    if low is None or high is None:
        return None
    return PlacedSolid(
        instance=-1,
        path="",
        prototype=prototype,
        cylinders=tuple(found[0]),
        planes=tuple(found[1]),
        spheres=tuple(found[2]),
        low=low,
        high=high,
        volume=properties.volume,
        center=properties.com,
        body=body,
    )


def _triangles(shape: Any) -> tuple[Any, Array | None, Array | None]:
    """The triangles of a shape as a Manifold in millimetres (None if they do not close), and their bounding box in metres."""
    import manifold3d
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy

    own = BRepBuilderAPI_Copy(shape, True, False).Shape()  # triangles would change the B-rep of the original, and its digest
    low = high = None
    for tolerance in (1e-4, 3e-5, 3e-4):
        mesh = tessellate(own, tolerance)
        if mesh is None:
            break
        low, high = mesh.vertices.min(axis=0).astype(float), mesh.vertices.max(axis=0).astype(float)
        vertices = (mesh.vertices * 1e3).astype(np.float32)
        _, first, index = np.unique(np.round(vertices / 1e-4).astype(np.int64), axis=0, return_index=True, return_inverse=True)
        triangles = index.ravel()[mesh.triangles]
        whole = (triangles[:, 0] != triangles[:, 1]) & (triangles[:, 1] != triangles[:, 2]) & (triangles[:, 0] != triangles[:, 2])
        net = manifold3d.Mesh(vert_properties=vertices[first], tri_verts=triangles[whole].astype(np.uint32))
        net.merge()
        body = manifold3d.Manifold(net)
        if body.status() == manifold3d.Error.NoError and not body.is_empty():
            return body, low, high
    return None, low, high


def _placed(solid: PlacedSolid, instance: int, path: str, matrix: Array) -> PlacedSolid:
    rotation, shift = matrix[:3, :3], matrix[:3, 3]
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    box = (solid.low + corners * (solid.high - solid.low)) @ rotation.T + shift
    body, low, high = solid.body, box.min(axis=0), box.max(axis=0)
    if body is not None:
        transform = np.column_stack([rotation, shift * 1e3])
        body = body.transform(transform)
        bounds = np.array(body.bounding_box()) * 1e-3
        low, high = bounds[:3], bounds[3:]
    return PlacedSolid(
        instance=instance,
        path=path,
        prototype=solid.prototype,
        cylinders=tuple(_placed_cylinder(c, rotation, shift) for c in solid.cylinders),
        planes=tuple(
            Plane(
                point=rotation @ p.point + shift,
                normal=rotation @ p.normal,
                area=p.area,
                outline=p.outline @ rotation.T + shift,
                holes=tuple(h @ rotation.T + shift for h in p.holes),
            )
            for p in solid.planes
        ),
        spheres=tuple(Sphere(center=rotation @ s.center + shift, radius=s.radius, concave=s.concave, area=s.area) for s in solid.spheres),
        low=low,
        high=high,
        volume=solid.volume,
        center=rotation @ solid.center + shift,
        body=body,
    )


def _placed_cylinder(c: Cylinder, rotation: Array, shift: Array) -> Cylinder:
    """``point`` stays where it was on the axis, so ``low`` and ``high`` stay, too."""
    return Cylinder(
        point=rotation @ c.point + shift,
        axis=rotation @ c.axis,
        radius=c.radius,
        low=c.low,
        high=c.high,
        concave=c.concave,
        sweep=c.sweep,
        area=c.area,
    )


def _common_box(a: PlacedSolid, b: PlacedSolid, reach: float) -> tuple[Array, Array]:
    return np.maximum(a.low, b.low) - reach - TOUCH, np.minimum(a.high, b.high) + reach + TOUCH


def _contact(a: PlacedSolid, b: PlacedSolid, i: int, j: int) -> Contact:
    low, high = _common_box(a, b, 0.0)
    gap, overlap, thickness = _mesh_contact(a, b)
    faces = tuple(_face_contacts(a, b, low, high, TOUCH))
    return Contact(
        first=i,
        second=j,
        fits=tuple(_fits(a, b, i, j, low, high, LOOSE)),
        faces=faces,
        aligned=tuple(_aligned(a, b, low, high)) if faces or not math.isnan(gap) else (),
        balls=tuple(_balls(a, b)),
        gap=gap,
        overlap=overlap,
        thickness=thickness,
    )


def _mesh_contact(a: PlacedSolid, b: PlacedSolid) -> tuple[float, float, float]:
    if a.body is None or b.body is None:
        return math.nan, 0.0, 0.0  # only analytic features speak for a solid whose triangles do not close
    gap = a.body.min_gap(b.body, TOUCH * 1e3) * 1e-3
    if gap >= TOUCH * (1 - 1e-6):
        return math.nan, 0.0, 0.0
    common = a.body ^ b.body
    volume, surface = common.volume() * 1e-9, common.surface_area() * 1e-6
    if volume <= 0 or surface <= 0:
        return gap, 0.0, 0.0
    return gap, volume, 2 * volume / surface


def _fits(a: PlacedSolid, b: PlacedSolid, i: int, j: int, low: Array, high: Array, loose: float) -> list[Fit]:
    found = []
    for holes, shafts, owner in ((a, b, i), (b, a, j)):
        inner = [c for c in shafts.cylinders if not c.concave and _reaches(c, low, high)]
        if not inner:
            continue
        for hole in (c for c in holes.cylinders if c.concave and _reaches(c, low, high)):
            for shaft in inner:
                fit = _fit(hole, shaft, owner, loose)
                if fit is not None:
                    found.append(fit)
    return found


def _fit(hole: Cylinder, shaft: Cylinder, owner: int, loose: float) -> Fit | None:
    clearance = hole.radius - shaft.radius
    if not TIGHT * hole.radius <= clearance <= loose * hole.radius:
        return None
    if np.linalg.norm(np.cross(hole.axis, shaft.axis)) > PARALLEL or min(hole.sweep, shaft.sweep) < WRAP:
        return None
    centre = shaft.point + (shaft.low + shaft.high) / 2 * shaft.axis
    away = centre - hole.point
    along = float(away @ hole.axis)
    offset = float(np.linalg.norm(away - along * hole.axis))
    if offset > COAXIAL:
        return None
    half = (shaft.high - shaft.low) / 2
    low, high = max(hole.low, along - half), min(hole.high, along + half)
    if high - low < TOUCH:
        return None
    return Fit(
        point=hole.point + (low + high) / 2 * hole.axis,
        axis=hole.axis,
        hole=hole.radius,
        shaft=shaft.radius,
        length=high - low,
        offset=offset,
        sweep=min(hole.sweep, shaft.sweep),
        hole_owner=owner,
    )


def _aligned(a: PlacedSolid, b: PlacedSolid, low: Array, high: Array) -> list[AlignedHoles]:
    """Holes of the two that follow each other on one axis, closer than their radius and of similar width."""
    found = []
    second = [c for c in b.cylinders if c.concave and c.sweep > math.pi and _reaches(c, low, high)]
    for one in (c for c in a.cylinders if c.concave and c.sweep > math.pi and _reaches(c, low, high)):
        for other in second:
            if not 0.5 <= one.radius / other.radius <= 2.0 or np.linalg.norm(np.cross(one.axis, other.axis)) > PARALLEL:
                continue
            away = other.point + (other.low + other.high) / 2 * other.axis - one.point
            along = float(away @ one.axis)
            half = (other.high - other.low) / 2
            apart = max(one.low - (along + half), along - half - one.high)
            if np.linalg.norm(away - along * one.axis) < COAXIAL and apart < min(one.radius, other.radius):
                middle = (max(one.low, along - half) + min(one.high, along + half)) / 2
                found.append(AlignedHoles(point=one.point + middle * one.axis, axis=one.axis, radius=min(one.radius, other.radius)))
    return found


def _balls(a: PlacedSolid, b: PlacedSolid) -> list[Ball]:
    found = []
    for sockets, balls in ((a.spheres, b.spheres), (b.spheres, a.spheres)):
        for socket in (s for s in sockets if s.concave):
            for ball in (s for s in balls if not s.concave):
                clearance = socket.radius - ball.radius
                if np.linalg.norm(socket.center - ball.center) < COAXIAL and abs(clearance) <= LOOSE * socket.radius:
                    found.append(Ball(center=socket.center, radius=ball.radius, clearance=clearance))
    return found


def _face_contacts(a: PlacedSolid, b: PlacedSolid, low: Array, high: Array, reach: float) -> list[FaceContact]:
    from shapely.errors import GEOSException

    firsts = [p for p in a.planes if _overlaps(p.outline, low, high)]
    seconds = [p for p in b.planes if _overlaps(p.outline, low, high)]
    if not firsts or not seconds:
        return []
    normals_a, normals_b = np.array([p.normal for p in firsts]), np.array([p.normal for p in seconds])
    points_a, points_b = np.array([p.point for p in firsts]), np.array([p.point for p in seconds])
    opposed = normals_a @ normals_b.T < -math.cos(PARALLEL)
    gap = np.einsum("ijk,ik->ij", points_b[None] - points_a[:, None], normals_a)
    found = []
    for i, j in np.argwhere(opposed & (gap > -TOUCH) & (gap < reach)):
        one, other = firsts[i], seconds[j]
        try:
            common = _polygon(one, one).intersection(_polygon(other, one))
        except GEOSException:
            continue
        if common.area < 1e-4 * min(one.area, other.area) or common.area < TOUCH**2:
            continue
        basis = _basis(one.normal)
        middle = common.centroid
        axis_point, radius, both, rotor = _round(one, other, a, b)
        found.append(
            FaceContact(
                point=one.point + middle.x * basis[0] + middle.y * basis[1],
                normal=one.normal,
                area=float(common.area),
                gap=float(gap[i, j]),
                round_axis=axis_point,
                round_radius=radius,
                both_round=both,
                rotor=rotor,
            )
        )
    return found


def _round(one: Plane, other: Plane, a: PlacedSolid, b: PlacedSolid) -> tuple[Array | None, float, bool, bool]:
    """Where the axis of the round face(s) of a contact passes, the smaller radius, whether both are round about it, and a rotor's."""
    first, second = _disc(one, a), _disc(other, b)
    if first is None and second is None:
        return None, 0.0, False, False
    if first is not None and second is not None:
        across = second[0] - first[0]
        across = across - (across @ one.normal) * one.normal
        if np.linalg.norm(across) < COAXIAL:
            return first[0], min(first[1], second[1]), True, first[2] or second[2]
    center, radius, rotor = min((d for d in (first, second) if d is not None), key=lambda d: d[1])
    return center, radius, False, rotor


def _disc(plane: Plane, solid: PlacedSolid) -> tuple[Array, float, bool] | None:
    """Centre and radius of a face that ends a shaft of its solid (its outline is the circle of that shaft), and whether it is a rotor."""
    for shaft in solid.cylinders:
        if shaft.concave or np.linalg.norm(np.cross(shaft.axis, plane.normal)) > PARALLEL:
            continue
        away = plane.outline - shaft.point
        along = away @ shaft.axis
        distance = np.linalg.norm(away - along[:, None] * shaft.axis, axis=1)
        ends = min(abs(along[0] - shaft.low), abs(along[0] - shaft.high)) < 0.25 * shaft.radius + TOUCH
        if ends and len(distance) >= 8 and np.ptp(distance) < TOUCH and 0.7 * shaft.radius < distance[0] < shaft.radius + TOUCH:
            return shaft.point + float(along[0]) * shaft.axis, float(distance[0]), _in_recess(shaft, solid)
    return None


def _in_recess(shaft: Cylinder, solid: PlacedSolid) -> bool:
    """Whether a shaft stands in a hole of its own solid with a running clearance."""
    holes = (c for c in solid.cylinders if c.concave and shaft.radius < c.radius < 1.1 * shaft.radius and c.sweep > WRAP)
    return any(_fit(hole, shaft, 0, LOOSE) is not None for hole in holes)


def _polygon(plane: Plane, frame: Plane) -> Any:
    """A plane's area as a shapely polygon in the axes of another plane that is parallel to it."""
    import shapely

    basis = _basis(frame.normal)
    flat = shapely.Polygon((plane.outline - frame.point) @ basis.T, [(h - frame.point) @ basis.T for h in plane.holes])
    return flat if flat.is_valid else flat.buffer(0)


def _basis(normal: Array) -> Array:
    """Two unit vectors across a normal, shape (2, 3)."""
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = np.cross(normal, helper)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(normal, first)], np.float64)


def _reaches(c: Cylinder, low: Array, high: Array) -> bool:
    ends = np.array([c.point + c.low * c.axis, c.point + c.high * c.axis])
    spread = c.radius * np.sqrt(np.maximum(0.0, 1 - c.axis**2))
    return bool(np.all(ends.min(axis=0) - spread <= high) and np.all(ends.max(axis=0) + spread >= low))


def _overlaps(points: Iterable[Array] | Array, low: Array, high: Array) -> bool:
    cloud = np.asarray(points)
    return bool(np.all(cloud.min(axis=0) <= high) and np.all(cloud.max(axis=0) >= low))
