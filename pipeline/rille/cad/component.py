"""What instances are made of, whatever it came from: a drawn part, a part of another database, a lumped mass, a mirror image."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rille.cad.collision.decompose import Decomposition, Method
from rille.cad.collision.kept_pieces import mesh_digest, pieces_of
from rille.cad.files.assembly import Prototype
from rille.cad.files.kept_lines import cylinder_lines, face_line
from rille.cad.files.reading import mesh_of
from rille.cad.geometry import VolumeProperties
from rille.model import InputRefused, Material, Mesh, Part, nearest_names
from rille.model.rotation import pose_matrix, pose_of

Vector = NDArray[np.float64]
Line = tuple[Vector, Vector | None]
"""A point [m] and a unit direction (None: only a point), in the frame of the component."""

NOTHING = VolumeProperties(volume=0.0, com=np.zeros(3), inertia=np.zeros((3, 3)), n_solids=0)


class Component(Protocol):
    """A part as drawn once. Everything is in its own frame, in metres.

    drawn_as : name that the rules of the sheet speak of. digest : of its geometry. material : as its file states it. volume : integrals
    of its solids. ready : part of a database, whose mass is known already.
    """

    @property
    def name(self) -> str: ...
    @property
    def drawn_as(self) -> str: ...
    @property
    def digest(self) -> str: ...
    @property
    def color(self) -> str | None: ...
    @property
    def material(self) -> Material | None: ...
    @property
    def volume(self) -> VolumeProperties: ...
    @property
    def ready(self) -> Part | None: ...

    def mesh(self, tolerance: float) -> Mesh | None:
        """Triangles within ``tolerance`` [m]; None if there is nothing to see."""
        ...

    def pieces(self, method: Method, tolerance: float) -> Decomposition:
        """Convex pieces for collisions; see :func:`rille.cad.collision.decompose.decompose`."""
        ...

    def face(self, name: str, subject: str) -> Line:
        """Centre and normal or axis of a named face."""
        ...

    def cylinder(self, radius: float, near: Vector, subject: str) -> Line:
        """Middle and axis of the cylinder of that radius whose axis passes nearest to a point."""
        ...


@dataclass(frozen=True, kw_only=True)
class DrawnPart:
    """A prototype of a STEP file or CadQuery script."""

    prototype: Prototype
    name: str
    color: str | None = None
    ready: None = None

    @property
    def drawn_as(self) -> str:
        """Its name."""
        return self.name

    @property
    def digest(self) -> str:
        """SHA-256 of the B-rep."""
        return self.prototype.digest

    @property
    def material(self) -> Material | None:
        """As the STEP file states it."""
        return self.prototype.material

    @property
    def volume(self) -> VolumeProperties:
        """Of its solids."""
        return self.prototype.volume

    def mesh(self, tolerance: float) -> Mesh | None:
        """Triangles of the exact faces."""
        return mesh_of(self.prototype, tolerance)

    def pieces(self, method: Method, tolerance: float) -> Decomposition:
        """Pieces of the exact shape, kept from the last time."""
        return pieces_of(self.prototype.digest, lambda: self.prototype.shape, method, tolerance)

    def face(self, name: str, subject: str) -> Line:
        """Centre and normal or axis of a face that the file names."""
        names = self.prototype.named_faces
        if name not in names:
            known = nearest_names(name, names) if names else "the file names no faces of it; use `cylinder`, or point and axis"
            raise InputRefused(f"{subject} names the face '{name}' of part '{self.name}', which is not there; {known}")
        return face_line(self.prototype, name)

    def cylinder(self, radius: float, near: Vector, subject: str) -> Line:
        """Middle and axis of a cylindrical face."""
        radii, middles, axes = cylinder_lines(self.prototype)
        fitting = np.flatnonzero(np.abs(radii - radius) <= 1e-3 * radius + 1e-7)
        if len(fitting) == 0:
            sizes = ", ".join(f"{1e3 * r:g}" for r in sorted(set(radii.round(6)))) or "none"
            raise InputRefused(
                f"{subject} looks for a cylinder of radius {1e3 * radius:g} mm on part '{self.name}', which has the radii {sizes} (mm)"
            )
        distances = np.linalg.norm(np.cross(axes[fitting], near - middles[fitting]), axis=1)
        best = fitting[np.argmin(distances)]
        return middles[best], axes[best]


@dataclass(frozen=True, kw_only=True)
class ReadyPart:
    """A part whose mass is known: of another database, of the part library, of a URDF, or a lumped mass without geometry."""

    ready: Part
    material: Material | None = None
    name: str

    @property
    def drawn_as(self) -> str:
        """Its name."""
        return self.name

    @property
    def digest(self) -> str:
        """As it came."""
        return self.ready.brep_hash

    @property
    def color(self) -> str | None:
        """As it came."""
        return self.ready.color

    @property
    def volume(self) -> VolumeProperties:
        """Volume as it came, its other integrals from the mass properties at an even density."""
        p = self.ready.properties
        scale = self.ready.volume / p.mass if p.mass > 0 else 0.0
        return VolumeProperties(volume=self.ready.volume, com=p.com, inertia=scale * p.inertia, n_solids=1 if self.ready.volume > 0 else 0)

    def mesh(self, tolerance: float) -> Mesh | None:
        """As it came, whatever the tolerance."""
        return next((m for m in self.ready.meshes if m.purpose == "visual"), None)

    def pieces(self, method: Method, tolerance: float) -> Decomposition:
        """Pieces of the mesh."""
        mesh = self.mesh(tolerance)
        if mesh is None:
            return pieces_of(self.name, lambda: None, "none", tolerance)
        return pieces_of(mesh_digest(mesh), lambda: mesh, method, tolerance)

    def face(self, name: str, subject: str) -> Line:
        """Refused: a mesh names no faces."""
        raise InputRefused(
            f"{subject} names the face '{name}' of part '{self.name}', which is a mesh without exact faces; give point and axis"
        )

    def cylinder(self, radius: float, near: Vector, subject: str) -> Line:
        """Refused: a mesh has no exact cylinders."""
        raise InputRefused(
            f"{subject} looks for a cylinder on part '{self.name}', which is a mesh without exact faces; give point and axis"
        )


@dataclass(frozen=True, kw_only=True)
class MirroredPart:
    """Mirror image of a part in the plane through its own origin with the normal ``axis`` (0, 1, 2): the shape, not the placement."""

    original: Component
    axis: int
    name: str
    ready: Part | None = None

    @property
    def drawn_as(self) -> str:
        """Name of the original: the same rules hold."""
        return self.original.drawn_as

    @property
    def reflection(self) -> Vector:
        """S, shape (3, 3)."""
        diagonal = np.ones(3)
        diagonal[self.axis] = -1
        return np.diag(diagonal)

    @property
    def digest(self) -> str:
        """That of the original, with the plane."""
        return f"{self.original.digest}:mirror_{'xyz'[self.axis]}"

    @property
    def color(self) -> str | None:
        """Of the original."""
        return self.original.color

    @property
    def material(self) -> Material | None:
        """Of the original."""
        return self.original.material

    @property
    def volume(self) -> VolumeProperties:
        """Volume V, centre S c, inertia S I S."""
        v, s = self.original.volume, self.reflection
        return VolumeProperties(volume=v.volume, com=s @ v.com, inertia=s @ v.inertia @ s, n_solids=v.n_solids)

    def mesh(self, tolerance: float) -> Mesh | None:
        """Mirrored triangles, turned so that their outside stays outside."""
        mesh = self.original.mesh(tolerance)
        return None if mesh is None else mirrored_mesh(mesh, self.axis)

    def pieces(self, method: Method, tolerance: float) -> Decomposition:
        """Mirrored pieces: boxes and cylinders are their own mirror images in their own frames."""
        made = self.original.pieces(method, tolerance)
        s = self.reflection
        turned = []
        for piece in made.pieces:
            matrix = pose_matrix(piece.pose)
            matrix[:3, :3], matrix[:3, 3] = s @ matrix[:3, :3] @ s, s @ matrix[:3, 3]
            vertices = None if piece.vertices is None else piece.vertices @ s
            turned.append(replace(piece, pose=pose_of(matrix), vertices=vertices))
        return replace(made, pieces=tuple(turned))

    def face(self, name: str, subject: str) -> Line:
        """Mirrored."""
        return self._reflected(self.original.face(name, subject))

    def cylinder(self, radius: float, near: Vector, subject: str) -> Line:
        """Mirrored."""
        return self._reflected(self.original.cylinder(radius, self.reflection @ near, subject))

    def _reflected(self, line: Line) -> Line:
        point, axis = line
        return self.reflection @ point, None if axis is None else self.reflection @ axis


def mirrored_mesh(mesh: Mesh, axis: int) -> Mesh:
    """Mirror image of a mesh in the plane through the origin with the normal ``axis`` (0, 1, 2)."""
    vertices = mesh.vertices.copy()
    vertices[:, axis] *= -1
    return replace(mesh, vertices=vertices, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]))


def mirrored_ready(part: Part, axis: int, name: str) -> Part:
    """Mirror image of a part whose mass is known."""
    diagonal = np.ones(3)
    diagonal[axis] = -1
    s = np.diag(diagonal)
    p = part.properties
    return replace(
        part,
        name=name,
        properties=replace(p, com=s @ p.com, inertia=s @ p.inertia @ s),
        meshes=tuple(mirrored_mesh(mesh, axis) for mesh in part.meshes),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Placed:
    """An instance. matrix : (4, 4), component -> drawing, metres."""

    path: str
    component: Component
    matrix: Vector
    color: str | None = None
