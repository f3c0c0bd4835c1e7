"""Analytic features of a B-rep: its cylinders, planes and spheres, in metres and in the frame of the shape.

CAD programs split what a person sees as one hole into two half cylinders, and cross holes split it again; faces that lie on the
same surface and turn the same side outwards are one feature here.
"""

# The compiled module OCP has no type stubs that pyright can follow.
# pyright: reportAttributeAccessIssue=false, reportMissingModuleSource=false, reportMissingImports=false

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rille.cad.geometry import MM

Vector3 = NDArray[np.float64]

Feature = TypeVar("Feature")

SAME_LENGTH = 1e-6  # [m] faces on one surface agree to this; CAD kernels work to 1e-7 m
SAME_ANGLE = 1e-5  # [rad] the same for directions
CHORD = 0.1  # [rad] step of a polygon along a curved edge
MAX_VERTICES = 400  # of one wire's polygon


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cylinder:
    """A cylindrical surface, all its faces together.

    point : on the axis [m], shape (3,), the foot of the origin of the frame. axis : unit, shape (3,), the sign is arbitrary.
    radius [m]. low, high : extent along the axis, from ``point`` [m]. concave : a hole (True) or a shaft (False). sweep : angle that
    the faces cover, summed [rad], 2 pi for a full turn. area [m^2].
    """

    point: Vector3
    axis: Vector3
    radius: float
    low: float
    high: float
    concave: bool
    sweep: float
    area: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plane:
    """A planar face. point : centre of its area [m]. normal : outward unit. area [m^2].

    outline : the outer wire as a polygon, shape (n, 3), and holes : the inner wires, shapes (m, 3) [m].
    """

    point: Vector3
    normal: Vector3
    area: float
    outline: Vector3
    holes: tuple[Vector3, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sphere:
    """A spherical surface. center [m], radius [m], concave : a socket (True) or a ball (False), area [m^2]."""

    center: Vector3
    radius: float
    concave: bool
    area: float


def cylinders(shape: Any) -> list[Cylinder]:
    """The cylinders of a TopoDS_Shape, largest area first.

    Free-form faces that are cylinders to 1e-6 m count, too: exporters write them as splines.
    """
    found: list[Cylinder] = []
    for one in _analytic(shape, _cylinder):
        for i, other in enumerate(found):
            if _same_cylinder(one, other):
                found[i] = _joined(one, other)
                break
        else:
            found.append(one)
    return sorted(found, key=lambda c: -c.area)


def planes(shape: Any) -> list[Plane]:
    """The planar faces of a TopoDS_Shape, largest area first."""
    return sorted(_analytic(shape, _plane), key=lambda p: -p.area)


def spheres(shape: Any) -> list[Sphere]:
    """The spheres of a TopoDS_Shape, largest area first."""
    found: list[Sphere] = []
    for one in _analytic(shape, _sphere):
        for i, other in enumerate(found):
            same = one.concave == other.concave and abs(one.radius - other.radius) < SAME_LENGTH
            if same and np.linalg.norm(one.center - other.center) < SAME_LENGTH:
                found[i] = Sphere(center=other.center, radius=other.radius, concave=other.concave, area=one.area + other.area)
                break
        else:
            found.append(one)
    return sorted(found, key=lambda s: -s.area)


def _analytic(shape: Any, feature_of: Callable[[Any], Feature | None]) -> Iterator[Feature]:
    """Features of the faces of a shape; a broken face, which OCCT cannot evaluate, has none."""
    from OCP.Standard import Standard_Failure
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while explorer.More():
        face = TopoDS.Face_s(explorer.Current())
        explorer.Next()
        try:
            feature = feature_of(face)
        except Standard_Failure:
            continue
        if feature is not None:
            yield feature


def _cylinder(face: Any) -> Cylinder | None:
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_SurfaceType

    surface = BRepAdaptor_Surface(face, True)
    kind = surface.GetType()
    if kind == GeomAbs_SurfaceType.GeomAbs_Cylinder:
        round_ = surface.Cylinder()
        u0, u1, v0, v1 = surface.FirstUParameter(), surface.LastUParameter(), surface.FirstVParameter(), surface.LastVParameter()
        area = _area(face)
        radius = round_.Radius()
        sweep = min(u1 - u0, area / (radius * max(v1 - v0, 1e-12))) if v1 > v0 else u1 - u0
        # The normal of the surface points away from the axis if its frame is right-handed; a reversed face turns it.
        concave = _reversed(face) != (not round_.Direct())
    elif kind in (
        GeomAbs_SurfaceType.GeomAbs_BSplineSurface,
        GeomAbs_SurfaceType.GeomAbs_BezierSurface,
        GeomAbs_SurfaceType.GeomAbs_SurfaceOfExtrusion,
        GeomAbs_SurfaceType.GeomAbs_SurfaceOfRevolution,
    ):
        round_ = _recognised(face, "cylinder")
        if round_ is None:
            return None
        area, radius = _area(face), round_.Radius()
        direction, location = round_.Axis().Direction(), round_.Location()
        point, normal = _a_point_and_normal(surface, face)
        away = point - _xyz(location)
        away -= (away @ _xyz(direction)) * _xyz(direction)
        concave = float(normal @ away) < 0
        v0, v1 = _along(face, _xyz(location), _xyz(direction))
        sweep = min(2 * math.pi, area / (radius * max(v1 - v0, 1e-12)))
    else:
        return None
    axis = _xyz(round_.Axis().Direction())
    axis /= np.linalg.norm(axis)
    location = _xyz(round_.Location()) * MM
    along = float(location @ axis)
    point = location - along * axis
    axis, low, high = _signed(axis, along + v0 * MM, along + v1 * MM)
    return Cylinder(point=point, axis=axis, radius=radius * MM, low=low, high=high, concave=concave, sweep=float(sweep), area=area * MM**2)


def _signed(axis: Vector3, low: float, high: float) -> tuple[Vector3, float, float]:
    """Turn an axis so that its largest component is positive: two halves of one hole may be drawn in opposite senses."""
    if axis[np.argmax(np.abs(axis) > np.abs(axis).max() - 1e-6)] < 0:
        return -axis, -high, -low
    return axis, low, high


def _same_cylinder(a: Cylinder, b: Cylinder) -> bool:
    if a.concave != b.concave or abs(a.radius - b.radius) > SAME_LENGTH or np.linalg.norm(a.axis - b.axis) > SAME_ANGLE:
        return False
    if np.linalg.norm(a.point - b.point) > SAME_LENGTH:
        return False
    # Two rims of one bore apart from each other are two features: a hinge through both ears of a fork is worth more than one hole.
    return min(a.high, b.high) >= max(a.low, b.low) - SAME_LENGTH


def _joined(a: Cylinder, b: Cylinder) -> Cylinder:
    low, high = min(a.low, b.low), max(a.high, b.high)
    area = a.area + b.area
    return Cylinder(
        point=b.point,
        axis=b.axis,
        radius=b.radius,
        low=low,
        high=high,
        concave=b.concave,
        sweep=min(2 * math.pi, max(a.sweep, b.sweep, area / (b.radius * max(high - low, 1e-12)))),
        area=area,
    )


def _plane(face: Any) -> Plane | None:
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepGProp import BRepGProp
    from OCP.GeomAbs import GeomAbs_SurfaceType
    from OCP.GProp import GProp_GProps

    surface = BRepAdaptor_Surface(face, True)
    kind = surface.GetType()
    if kind == GeomAbs_SurfaceType.GeomAbs_Plane:
        flat = surface.Plane()
        normal = _xyz(flat.Axis().Direction()) * (1.0 if flat.Direct() else -1.0)
        normal = -normal if _reversed(face) else normal
    elif kind in (GeomAbs_SurfaceType.GeomAbs_BSplineSurface, GeomAbs_SurfaceType.GeomAbs_BezierSurface):
        if _recognised(face, "plane") is None:
            return None
        normal = _a_point_and_normal(surface, face)[1]
    else:
        return None
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties)
    area = properties.Mass()
    if not area > 0:
        return None
    outline, holes = _wires(face)
    if outline is None or len(outline) < 3:
        return None
    return Plane(
        point=_xyz(properties.CentreOfMass()) * MM,
        normal=normal / np.linalg.norm(normal),
        area=area * MM**2,
        outline=outline,
        holes=holes,
    )


def _sphere(face: Any) -> Sphere | None:
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_SurfaceType

    surface = BRepAdaptor_Surface(face, True)
    if surface.GetType() != GeomAbs_SurfaceType.GeomAbs_Sphere:
        return None
    ball = surface.Sphere()
    concave = _reversed(face) != (not ball.Direct())
    return Sphere(center=_xyz(ball.Location()) * MM, radius=ball.Radius() * MM, concave=concave, area=_area(face) * MM**2)


def _wires(face: Any) -> tuple[Vector3 | None, tuple[Vector3, ...]]:
    """Outer and inner wires of a face as polygons [m]."""
    from OCP.BRepTools import BRepTools
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    outer = BRepTools.OuterWire_s(face)
    outline, holes = None, []
    explorer = TopExp_Explorer(face, TopAbs_ShapeEnum.TopAbs_WIRE)
    while explorer.More():
        wire = TopoDS.Wire_s(explorer.Current())
        explorer.Next()
        polygon = _polygon(wire, face)
        if wire.IsSame(outer):
            outline = polygon
        elif len(polygon) >= 3:
            holes.append(polygon)
    return outline, tuple(holes)


def _polygon(wire: Any, face: Any) -> Vector3:
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.BRepTools import BRepTools_WireExplorer
    from OCP.GeomAbs import GeomAbs_CurveType
    from OCP.TopAbs import TopAbs_Orientation

    points: list[Vector3] = []
    explorer = BRepTools_WireExplorer(wire, face)
    while explorer.More() and len(points) < MAX_VERTICES:
        edge = explorer.Current()
        orientation = explorer.Orientation()
        explorer.Next()
        curve = BRepAdaptor_Curve(edge)
        first, last = curve.FirstParameter(), curve.LastParameter()
        kind = curve.GetType()
        if kind == GeomAbs_CurveType.GeomAbs_Line:
            count = 1
        elif kind in (GeomAbs_CurveType.GeomAbs_Circle, GeomAbs_CurveType.GeomAbs_Ellipse):
            count = max(2, math.ceil(abs(last - first) / CHORD))
        else:
            count = 16
        values = np.linspace(first, last, count + 1)
        if orientation == TopAbs_Orientation.TopAbs_REVERSED:
            values = values[::-1]
        points.extend(_xyz(curve.Value(float(v))) * MM for v in values[:-1])
    return np.array(points).reshape(-1, 3)


def _recognised(face: Any, kind: str) -> Any | None:
    """gp_Cylinder or gp_Pln of a free-form face that is one, to 1e-6 m."""
    from OCP.gp import gp_Cylinder, gp_Pln
    from OCP.ShapeAnalysis import ShapeAnalysis_CanonicalRecognition

    recognition = ShapeAnalysis_CanonicalRecognition(face)
    tolerance = SAME_LENGTH / MM
    if kind == "cylinder":
        round_ = gp_Cylinder()
        return round_ if recognition.IsCylinder(tolerance, round_) else None
    flat = gp_Pln()
    return flat if recognition.IsPlane(tolerance, flat) else None


def _a_point_and_normal(surface: Any, face: Any) -> tuple[Vector3, Vector3]:
    """A point [mm] of a face and its outward normal there."""
    from OCP.BRepTools import BRepTools
    from OCP.gp import gp_Pnt, gp_Vec

    u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
    p, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
    surface.D1((u0 + u1) / 2, (v0 + v1) / 2, p, du, dv)
    normal = np.cross(_xyz(du), _xyz(dv))
    length = float(np.linalg.norm(normal))
    normal = normal / length if length > 0 else np.array([0.0, 0.0, 1.0])
    return _xyz(p), -normal if _reversed(face) else normal


def _along(face: Any, origin: Vector3, direction: Vector3) -> tuple[float, float]:
    """Extent of a face along a direction [mm], from the polygons of its wires."""
    outline, holes = _wires(face)
    rings = [ring for ring in (outline, *holes) if ring is not None and len(ring)]
    if not rings:
        return 0.0, 0.0
    heights = (np.concatenate(rings) / MM - origin) @ direction
    return float(heights.min()), float(heights.max())


def _area(face: Any) -> float:
    """Area of a face [mm^2]."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties)
    return abs(properties.Mass())


def _reversed(face: Any) -> bool:
    from OCP.TopAbs import TopAbs_Orientation

    return face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED


def _xyz(value: Any) -> Vector3:
    return np.array([value.X(), value.Y(), value.Z()])
