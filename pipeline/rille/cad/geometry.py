"""Exact geometry of one B-rep shape: mass properties, digest, tessellation. Lengths leave this module in metres."""

# The compiled module OCP has no type stubs that pyright can follow.
# pyright: reportAttributeAccessIssue=false, reportMissingModuleSource=false, reportMissingImports=false

import hashlib
import io
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import Mesh

MM = 1e-3  # OCCT delivers geometry in millimetres, whatever the unit of the file


@dataclass(frozen=True, slots=True, kw_only=True)
class VolumeProperties:
    """Volume integrals of the solids of a shape, at unit density.

    volume : [m^3]. com : centre [m], shape (3,). inertia : about that centre [m^5], shape (3, 3), axes of the shape.
    n_solids : number of solids. Open shells and loose faces have no volume and are not in it.
    """

    volume: float
    com: NDArray[np.float64]
    inertia: NDArray[np.float64]
    n_solids: int


def solids(shape: Any) -> list[Any]:
    """The solids of a TopoDS_Shape."""
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    found = []
    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
    while explorer.More():
        found.append(explorer.Current())
        explorer.Next()
    return found


def volume_properties(shape: Any) -> VolumeProperties:
    """Integrate volume, centre and inertia over the exact surfaces of the solids of a TopoDS_Shape.

    OCCT's matrix of inertia is about the centre of mass in the axes of the shape; several solids are joined by the
    parallel-axis theorem. Only solids count: an open shell would corrupt the sum.
    """
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    parts = []
    for solid in solids(shape):
        properties = GProp_GProps()
        BRepGProp.VolumeProperties_s(solid, properties)
        volume = properties.Mass()
        center = properties.CentreOfMass()
        matrix = properties.MatrixOfInertia()
        inertia = np.array([[matrix.Value(i, j) for j in (1, 2, 3)] for i in (1, 2, 3)])
        sign = -1.0 if volume < 0 else 1.0  # a solid whose faces point inwards
        com = np.array([center.X(), center.Y(), center.Z()])
        parts.append((sign * volume * MM**3, com * MM, sign * inertia * MM**5))
    total, com, inertia = compose(parts)
    return VolumeProperties(volume=total, com=com, inertia=inertia, n_solids=len(parts))


def compose(
    parts: list[tuple[float, NDArray[np.float64], NDArray[np.float64]]],
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Join (mass, centre, inertia about that centre), all in the same axes, by the parallel-axis theorem.

    I = Sum I_k + m_k (|d_k|^2 E - d_k d_k^T), d_k = c_k - c  (Huygens-Steiner).
    """
    total = sum(mass for mass, _, _ in parts)
    if not parts or total <= 0:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    com = sum((mass * center for mass, center, _ in parts), np.zeros(3)) / total
    inertia = np.zeros((3, 3))
    for mass, center, own in parts:
        d = center - com
        inertia += own + mass * (d @ d * np.eye(3) - np.outer(d, d))
    return total, com, inertia


def brep_hash(shape: Any) -> str:
    """SHA-256 of the binary B-rep, without triangles. Take it before tessellation, which changes the B-rep."""
    from OCP.BinTools import BinTools, BinTools_FormatVersion

    stream = io.BytesIO()
    BinTools.Write_s(shape, stream, False, False, BinTools_FormatVersion.BinTools_FormatVersion_VERSION_4)
    return hashlib.sha256(stream.getvalue()).hexdigest()


def tessellate(shape: Any, tolerance: float) -> Mesh | None:
    """Triangles within ``tolerance`` [m] of the exact surface; None if the shape has no face."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    # OCCT overshoots the deflection it is asked for (by 1.55 at the poles of a sphere): ask for half.
    BRepMesh_IncrementalMesh(shape, 0.5 * tolerance / MM, False, 0.35, False)
    vertices: list[tuple[float, float, float]] = []
    triangles: list[tuple[int, int, int]] = []
    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while explorer.More():
        face = TopoDS.Face_s(explorer.Current())
        explorer.Next()
        location = TopLoc_Location()
        triangulation = BRep_Tool.Triangulation_s(face, location)
        if triangulation is None:
            continue
        transform = location.Transformation()
        first = len(vertices)
        for i in range(1, triangulation.NbNodes() + 1):
            p = triangulation.Node(i).Transformed(transform)
            vertices.append((p.X(), p.Y(), p.Z()))
        reverse = face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
        for i in range(1, triangulation.NbTriangles() + 1):
            a, b, c = triangulation.Triangle(i).Get()
            if reverse:
                b, c = c, b
            triangles.append((first + a - 1, first + b - 1, first + c - 1))
    if not triangles:
        return None
    return Mesh(
        vertices=np.array(vertices, np.float32) * np.float32(MM),
        triangles=np.array(triangles, np.int32),
        tolerance=tolerance,
    )
