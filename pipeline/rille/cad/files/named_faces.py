"""Faces that the CAD file names, as geometry: a joint may stand on a named face, never on a face's number."""

# The compiled module OCP has no type stubs that pyright can follow.
# pyright: reportAttributeAccessIssue=false, reportMissingModuleSource=false, reportMissingImports=false

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rille.cad.files.assembly import Prototype
from rille.cad.geometry import MM, faces
from rille.model import InputRefused, nearest_names

Kind = Literal["plane", "cylinder", "cone", "sphere", "torus"]


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedFace:
    """An analytic face in the part frame.

    point : [m], shape (3,): centre of area of a plane's face, centre of a sphere or torus; for a cylinder or cone the point of the
    axis in the middle of the face. axis : unit vector, shape (3,): outward normal of a plane, axis of the rest; a sphere has
    none of its own and takes z. radius : [m]; of a cone in the middle of the face, of a torus the larger one; 0 for a plane.
    """

    kind: Kind
    point: NDArray[np.float64]
    axis: NDArray[np.float64]
    radius: float = 0.0


def named_face(prototype: Prototype, name: str) -> NamedFace:
    """The face (or the pieces of one face) that the CAD file calls ``name``.

    Raises
    ------
    InputRefused : for a name that the part does not have, pieces that lie on different surfaces, a free-form surface.
    """
    if name not in prototype.named_faces:
        raise InputRefused(
            f"part '{prototype.name}' has no face named '{name}'; {nearest_names(name, prototype.named_faces)}; name the face in CAD, "
            "or state an axis or coordinates"
        )
    found = faces(prototype.shape)
    pieces = [_describe(found[k], prototype.name, name) for k in prototype.named_faces[name]]
    first = pieces[0]
    size = max(float(np.linalg.norm(prototype.bounds[1] - prototype.bounds[0])), 1e-9)
    for other in pieces[1:]:
        if not _same(first, other, size):
            raise InputRefused(f"part '{prototype.name}' has {len(pieces)} faces named '{name}' on different surfaces; rename one in CAD")
    point = np.mean([piece.point for piece in pieces], axis=0)
    return NamedFace(kind=first.kind, point=point, axis=first.axis, radius=first.radius)


def _same(a: NamedFace, b: NamedFace, size: float) -> bool:
    """Do two faces lie on one surface (1e-6 of the part's size, 1e-6 rad)?"""
    if a.kind != b.kind or abs(a.radius - b.radius) > 1e-6 * size:
        return False
    apart = b.point - a.point
    if a.kind in ("sphere", "torus"):
        return float(np.linalg.norm(apart)) <= 1e-6 * size
    if np.linalg.norm(np.cross(a.axis, b.axis)) > 1e-6:
        return False
    off = apart @ a.axis if a.kind == "plane" else np.linalg.norm(np.cross(apart, a.axis))
    return bool(abs(off) <= 1e-6 * size)


def _describe(face: Any, part: str, name: str) -> NamedFace:
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_SurfaceType
    from OCP.TopAbs import TopAbs_Orientation

    surface = BRepAdaptor_Surface(face)
    kind = surface.GetType()
    if kind == GeomAbs_SurfaceType.GeomAbs_Plane:
        plane = surface.Plane()
        flip = face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
        axis = _vector(plane.Axis().Direction()) * (-1.0 if flip != (not plane.Direct()) else 1.0)
        return NamedFace(kind="plane", point=_center(face) * MM, axis=axis)
    if kind == GeomAbs_SurfaceType.GeomAbs_Cylinder:
        cylinder = surface.Cylinder()
        middle = _vector(surface.Value(surface.FirstUParameter(), _middle_v(surface)))
        point, axis = _on_axis(cylinder, middle)
        return NamedFace(kind="cylinder", point=point * MM, axis=axis, radius=cylinder.Radius() * MM)
    if kind == GeomAbs_SurfaceType.GeomAbs_Cone:
        middle = _vector(surface.Value(surface.FirstUParameter(), _middle_v(surface)))
        point, axis = _on_axis(surface.Cone(), middle)
        return NamedFace(kind="cone", point=point * MM, axis=axis, radius=float(np.linalg.norm(middle - point)) * MM)
    if kind == GeomAbs_SurfaceType.GeomAbs_Sphere:
        sphere = surface.Sphere()
        return NamedFace(kind="sphere", point=_vector(sphere.Location()) * MM, axis=np.array([0.0, 0.0, 1.0]), radius=sphere.Radius() * MM)
    if kind == GeomAbs_SurfaceType.GeomAbs_Torus:
        torus = surface.Torus()
        axis = _vector(torus.Axis().Direction())
        return NamedFace(kind="torus", point=_vector(torus.Location()) * MM, axis=axis, radius=torus.MajorRadius() * MM)
    raise InputRefused(
        f"face '{name}' of part '{part}' is free-form ({kind.name.removeprefix('GeomAbs_')}), so it has no axis; "
        "name a plane, cylinder, cone, sphere or torus"
    )


def _middle_v(surface: Any) -> float:
    return (surface.FirstVParameter() + surface.LastVParameter()) / 2


def _on_axis(quadric: Any, middle: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Foot of a point on the axis of a quadric, and the axis."""
    origin, axis = _vector(quadric.Axis().Location()), _vector(quadric.Axis().Direction())
    return origin + ((middle - origin) @ axis) * axis, axis


def _center(face: Any) -> NDArray[np.float64]:
    """Centre of area [mm]."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties)
    return _vector(properties.CentreOfMass())


def _vector(value: Any) -> NDArray[np.float64]:
    """Components of a gp_Pnt or gp_Dir."""
    return np.array([value.X(), value.Y(), value.Z()])
