"""Mesh files that a robot description names: where they are, and what is in them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from rille.cad.exchange.urdf_file import Geometry
from rille.model import InputRefused

Array = NDArray[np.float64]
Triangles = NDArray[np.int32]

SUFFIXES = (".stl", ".obj", ".dae", ".ply", ".off", ".glb", ".gltf")
SECTORS = 48  # of drawn cylinders: the chord lies radius (1 - cos(pi/48)) = 0.0021 radius inside
ROUNDING = 1e-6  # [m] tolerance of a mesh that is the only source of its shape: float32 at lengths of metres


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """vertices (n, 3) [m], triangles (m, 3), counter-clockwise from outside; color "#rrggbb" of the file, None: not stated.

    tolerance : largest distance from the exact surface [m]. volume : [m^3], 0 unless closed.
    """

    vertices: Array
    triangles: Triangles
    color: str | None
    tolerance: float
    volume: float


def find_mesh(reference: str, folder: Path) -> Path:
    """The file that a URDF in ``folder`` means.

    ``package://name/rest`` and ``model://name/rest`` are looked for in the folders above the URDF: a package ``name`` there, or a folder
    that is the package itself (whatever it is called after a download). ``file://`` is absolute; everything else is relative to the URDF.

    Raises
    ------
    InputRefused : if there is no such file, with the place that was looked at.
    """
    scheme, separator, rest = reference.partition("://")
    if separator and scheme not in ("package", "model", "file"):
        raise InputRefused(f"the mesh '{reference}' is on the network; download it and name the file")
    if scheme == "file" and separator:
        candidates = [Path(unquote(rest))]
    elif separator:
        package, _, inside = unquote(rest).partition("/")
        above = [folder.resolve(), *folder.resolve().parents]
        candidates = [place / package / inside for place in above] + [place / inside for place in above[:3]]
    else:
        candidates = [folder / reference]
    try:
        for candidate in candidates:
            if candidate.is_file():
                return candidate
    except (OSError, ValueError) as error:
        raise InputRefused(f"the mesh '{reference[:80]}' is no name of a file: {error}") from None
    raise InputRefused(f"there is no mesh '{reference}' (looked for '{candidates[0]}')")


def load_mesh(path: Path, scale: tuple[float, float, float]) -> tuple[Piece, ...]:
    """What a mesh file holds, scaled; one piece for each colour in it. COLLADA is read in its own unit, all else in metres.

    Raises
    ------
    InputRefused : for a file that is no mesh, holds no triangles, or coordinates that are not finite.
    """
    import trimesh

    if path.suffix.lower() not in SUFFIXES:
        raise InputRefused(f"the mesh '{path}' is of a kind that is not read; convert it to {', '.join(SUFFIXES)}")
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused below
            scene = trimesh.load_scene(path, skip_materials=False, process=True)
            if path.suffix.lower() == ".dae" and scene.units not in (None, "meters"):
                scene = scene.convert_units("meters")
            meshes = [mesh for mesh in scene.dump() if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)]
            flat = next((mesh for mesh in meshes if np.shape(mesh.vertices)[1:] != (3,)), None)
    except Exception as error:  # trimesh and the readers below it raise whatever a damaged file makes them stumble on
        raise InputRefused(f"the mesh '{path}' cannot be read: {str(error) or type(error).__name__}") from None
    if not meshes:
        raise InputRefused(f"the mesh '{path}' holds no triangles")
    if flat is not None:
        raise InputRefused(f"the mesh '{path}' has points of {np.shape(flat.vertices)[-1]} coordinates; 3 are needed, export it again")
    by_color: dict[str | None, list[Any]] = {}
    for mesh in meshes:
        by_color.setdefault(_color(mesh), []).append(mesh)
    return tuple(_piece(trimesh.util.concatenate(group), color, scale, path) for color, group in by_color.items())


def draw(geometry: Geometry) -> Piece:
    """Mesh of a box, sphere or cylinder about its centre."""
    import trimesh

    if geometry.kind == "box":
        mesh, tolerance = trimesh.creation.box(geometry.size), ROUNDING
    elif geometry.kind == "sphere":
        mesh = trimesh.creation.icosphere(subdivisions=3, radius=geometry.size[0])
        tolerance = geometry.size[0] - float(np.linalg.norm(mesh.triangles_center, axis=1).min())
    else:
        mesh = trimesh.creation.cylinder(radius=geometry.size[0], height=geometry.size[1], sections=SECTORS)
        tolerance = geometry.size[0] * (1 - np.cos(np.pi / SECTORS))
    vertices, triangles = np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int32)
    return Piece(vertices=vertices, triangles=triangles, color=None, tolerance=float(tolerance), volume=float(mesh.volume))


def _piece(mesh: Any, color: str | None, scale: tuple[float, float, float], path: Path) -> Piece:
    vertices = np.asarray(mesh.vertices, dtype=float) * scale
    triangles = np.asarray(mesh.faces, dtype=np.int32)
    if np.prod(scale) < 0:  # a mirror image turns every triangle around
        triangles = triangles[:, ::-1]
    if not np.isfinite(vertices).all():
        raise InputRefused(f"the mesh '{path}' has a coordinate that is not finite")
    volume = abs(float(mesh.volume * np.prod(scale))) if mesh.is_watertight else 0.0
    return Piece(vertices=vertices, triangles=np.ascontiguousarray(triangles), color=color, tolerance=ROUNDING, volume=volume)


def _color(mesh: Any) -> str | None:
    """The colour that a mesh states for all of itself."""
    material = getattr(mesh.visual, "material", None)
    if material is not None:
        level = getattr(material, "main_color", None)
    elif mesh.visual.defined and mesh.visual.kind == "face":
        level = np.median(mesh.visual.face_colors, axis=0)
    else:
        level = None
    return None if level is None else "#" + "".join(f"{int(v):02x}" for v in np.asarray(level)[:3])
