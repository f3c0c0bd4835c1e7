"""The shape of a rover's bodies as triangles: what checks and interference look at. Values of a Rover only, no B-rep."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rille.cad.solids import closed_solid, solid_gap, surface_gap
from rille.model import CollisionShape, Part, Rover
from rille.model.rotation import pose_matrix

if TYPE_CHECKING:
    from manifold3d import Manifold

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """One placed part of a body, in M at the zero pose.

    vertices : [m], shape (n, 3). triangles : shape (m, 3), counter-clockwise from outside. tolerance : largest distance from the exact
    surface [m]. solid : False for a part without volume (a free surface).
    """

    name: str
    vertices: Array
    triangles: NDArray[np.int64]
    tolerance: float
    solid: bool = True

    @cached_property
    def closed(self) -> "Manifold | None":
        """Its inside; None if the mesh is not closed."""
        return closed_solid(self.vertices, self.triangles, self.tolerance)

    def gap(self, other: "Piece", reach: float) -> float:
        """Distance to another piece [m], at most ``reach``."""
        if self.closed is not None and other.closed is not None:
            return solid_gap(self.closed, other.closed, reach)
        return surface_gap((self.vertices, self.triangles), (other.vertices, other.triangles), reach)

    def near(self, other: "Piece", reach: float) -> bool:
        """Whether another piece is nearer than ``reach`` [m]."""
        if self.closed is not None and other.closed is not None:
            return solid_gap(self.closed, other.closed, reach) < reach
        surfaces = (self.vertices, self.triangles), (other.vertices, other.triangles)
        return surface_gap(*surfaces, reach, enough=0.999 * reach) < reach


class BodyShape:
    """All pieces of one body."""

    def __init__(self, name: str, pieces: Iterable[Piece]) -> None:
        self.name = name
        self.pieces = tuple(pieces)

    @cached_property
    def vertices(self) -> Array:
        """All vertices [m], shape (n, 3)."""
        return np.concatenate([piece.vertices for piece in self.pieces]) if self.pieces else np.zeros((0, 3))

    @cached_property
    def tolerance(self) -> float:
        """Largest tolerance of its pieces [m]."""
        return max((piece.tolerance for piece in self.pieces), default=0.0)

    @cached_property
    def size(self) -> float:
        """Largest extent: diameter of the hull's farthest corner from the middle, twice [m]; does not depend on the axes."""
        if not self.pieces:
            return 0.0
        return 2 * float(np.linalg.norm(self.hull.points - self.hull.points.mean(axis=0), axis=1).max())

    @cached_property
    def hull(self) -> "Hull":
        """Convex hull of all vertices."""
        return Hull(self.vertices)

    @cached_property
    def surface(self) -> "Surface":
        """Area and its moments."""
        triangles = [piece.vertices[piece.triangles] for piece in self.pieces]
        return surface_of(np.concatenate(triangles) if triangles else np.zeros((0, 3, 3)))


class Hull:
    """Convex hull of points (n, 3); flat clouds get a thickness of a millionth of their size."""

    def __init__(self, vertices: Array) -> None:
        from scipy.spatial import ConvexHull

        middle = vertices.mean(axis=0)
        _, extent, axes = np.linalg.svd(vertices - middle, full_matrices=False)
        size = max(float(np.abs(vertices - middle).max()), 1e-9)
        for k in range(3):
            if len(extent) <= k or extent[k] < 1e-7 * size * np.sqrt(len(vertices)):
                direction = axes[k] if k < len(axes) else np.eye(3)[k]
                vertices = np.concatenate([vertices + 1e-6 * size * direction, vertices - 1e-6 * size * direction])
        hull = ConvexHull(vertices - middle)
        self.points: Array = vertices[hull.vertices]
        self.corners: Array = vertices[hull.simplices]  # triangles, shape (k, 3, 3); their sense is arbitrary
        self.normals: Array = hull.equations[:, :3]
        self.offsets: Array = hull.equations[:, 3] - self.normals @ middle

    def outside(self, point: Array) -> float:
        """How far a point lies outside, at least [m]: its largest height above a face; 0 inside."""
        return max(0.0, float((self.normals @ point + self.offsets).max()))

    def line_outside(self, point: Array, axis: Array) -> float:
        """How far a straight line passes by, at least [m]: distance in the plane across the line; 0 where it meets the hull."""
        basis = np.linalg.svd(axis[None, :])[2][1:]
        flat = (self.points - point) @ basis.T
        if len(flat) < 3:
            return float(np.linalg.norm(flat, axis=1).min())
        # the line misses a convex cloud exactly when all of it lies within half a turn around the line
        angles = np.sort(np.arctan2(flat[:, 1], flat[:, 0]))
        gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
        k = int(np.argmax(gaps))
        if gaps[k] <= np.pi:
            return 0.0
        middle = angles[k] + gaps[k] / 2 + np.pi  # direction of the middle of the cloud
        span = np.pi - gaps[k] / 2  # half of the angle under which it is seen
        turns = np.linspace(-(np.pi / 2 - span), np.pi / 2 - span, 61) + middle
        return max(0.0, float((flat @ np.array([np.cos(turns), np.sin(turns)])).min(axis=0).max()))

    def moments(self) -> tuple[float, Array, Array]:
        """Volume [m^3], centroid (3,) [m] and gyration tensor about it, I/V (3, 3) [m^2], of the hull filled with uniform mass."""
        apex = self.points.mean(axis=0)
        edges = self.corners - apex
        volumes = np.abs(np.linalg.det(edges)) / 6
        total = float(volumes.sum())
        sums = edges.sum(axis=1)
        centroid = (volumes[:, None] * sums).sum(axis=0) / (4 * total)
        second = np.einsum("k,kij,kil->jl", volumes, edges, edges) + np.einsum("k,kj,kl->jl", volumes, sums, sums)
        second = second / (20 * total) - np.outer(centroid, centroid)
        return total, centroid + apex, np.trace(second) * np.eye(3) - second


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """Area [m^2], its centroid (3,) [m] and its second moments about the centroid per area (3, 3) [m^2]."""

    area: float
    centroid: Array
    second: Array


def surface_of(corners: Array) -> Surface:
    """Moments of triangles (k, 3, 3): exact, Int x x^T dA = A/12 (Sum v v^T + (Sum v)(Sum v)^T)."""
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    total = float(areas.sum())
    if total <= 0:
        return Surface(area=0.0, centroid=np.zeros(3), second=np.zeros((3, 3)))
    origin = corners.reshape(-1, 3).mean(axis=0)
    local = corners - origin
    sums = local.sum(axis=1)
    centroid = (areas[:, None] * sums).sum(axis=0) / (3 * total)
    second = np.einsum("k,kij,kil->jl", areas, local, local) + np.einsum("k,kj,kl->jl", areas, sums, sums)
    return Surface(area=total, centroid=centroid + origin, second=second / (12 * total) - np.outer(centroid, centroid))


def body_shapes(rover: Rover) -> dict[str, BodyShape]:
    """Shape of every body: the meshes of its parts (visual ones before those for collision), without any its collision shapes."""
    parts = {part.name: part for part in rover.parts}
    pieces: dict[str, list[Piece]] = {body.name: [] for body in rover.bodies}
    for instance in rover.instances:
        part = parts.get(instance.part)
        if part is None or instance.body not in pieces:
            continue
        piece = _placed(instance.path, part, pose_matrix(instance.pose))
        if piece is not None:
            pieces[instance.body].append(piece)
    for shape in rover.collision_shapes:
        if shape.body in pieces and not any(not p.name.startswith("collision shape ") for p in pieces[shape.body]):
            made = _collision_piece(shape, f"collision shape {len(pieces[shape.body]) + 1} of {shape.body}")
            if made is not None:
                pieces[shape.body].append(made)
    return {name: BodyShape(name, found) for name, found in pieces.items()}


def _placed(path: str, part: Part, matrix: Array) -> Piece | None:
    meshes = [m for m in part.meshes if m.purpose == "visual" and len(m.triangles)] or [m for m in part.meshes if len(m.triangles)]
    if not meshes:
        return None
    starts = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    vertices = np.concatenate([m.vertices.astype(float) for m in meshes])
    triangles = np.concatenate([m.triangles.astype(np.int64) + start for m, start in zip(meshes, starts, strict=False)])
    return Piece(
        name=path,
        vertices=vertices @ matrix[:3, :3].T + matrix[:3, 3],
        triangles=triangles,
        tolerance=max(m.tolerance for m in meshes),
        solid=part.volume > 0 or part.properties.mass > 0,
    )


def _collision_piece(shape: CollisionShape, name: str) -> Piece | None:
    from manifold3d import Manifold

    if shape.kind == "box":
        made = Manifold.cube(list(shape.size), True)
    elif shape.kind == "sphere":
        made = Manifold.sphere(shape.size[0], 64)
    elif shape.kind == "cylinder":
        made = Manifold.cylinder(shape.size[1], shape.size[0], shape.size[0], 96, True)
    else:
        made = Manifold.hull_points(np.ascontiguousarray(shape.vertices))
    mesh = made.to_mesh64()
    if len(mesh.tri_verts) == 0:
        return None
    matrix = pose_matrix(shape.pose)
    vertices = np.array(mesh.vert_properties)[:, :3]
    sagitta = 0.0 if shape.kind in ("box", "hull") else shape.size[0] * (1 - np.cos(np.pi / (64 if shape.kind == "sphere" else 96)))
    return Piece(
        name=name,
        vertices=vertices @ matrix[:3, :3].T + matrix[:3, 3],
        triangles=np.array(mesh.tri_verts, np.int64),
        tolerance=float(sagitta),
    )
