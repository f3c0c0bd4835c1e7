"""Triangles of a mesh file, in metres, z up."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.model.quantity import to_si

Array = NDArray[np.float64]

MESH_SUFFIXES = (".stl", ".obj", ".ply", ".off", ".glb", ".gltf")
METRES = (".glb", ".gltf")  # the format says so: glTF 2.0, 3.4, "the units for all linear distances are meters", +Y up
LARGEST = 1e7  # coordinate [m] of a solid: beyond, it is damaged or has another unit
TO_Z = {  # axis that points up -> x, y, z of the turned form as (axis of the file, sign): the shortest turn that brings it to z
    "z": ((0, 1), (1, 1), (2, 1)),
    "-z": ((0, 1), (1, -1), (2, -1)),  # half a turn about x
    "y": ((0, 1), (2, -1), (1, 1)),  # x stays, as other programs import glTF
    "-y": ((0, 1), (2, 1), (1, -1)),
    "x": ((2, -1), (1, 1), (0, 1)),  # y stays
    "-x": ((2, 1), (1, 1), (0, -1)),
}


def read_triangles(path: Path, unit: str | None) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (n, 3) [m] and triangles (m, 3) of a mesh file.

    unit : of the coordinates ("mm"); needed by all formats but glTF, which is in metres.

    Raises
    ------
    InputRefused : for a file that is missing or no mesh, and for a unit that is missing.
    """
    path = Path(path)
    if not path.is_file():
        raise InputRefused(f"there is no mesh '{path}'")
    if path.suffix.lower() not in MESH_SUFFIXES:
        raise InputRefused(f"the mesh '{path}' is of a kind that is not read; convert it to {', '.join(MESH_SUFFIXES)}")
    if unit is None:
        if path.suffix.lower() not in METRES:
            raise InputRefused(f"'{path}' does not say the unit of its coordinates; state it, for example --unit mm")
        unit = "m"
    factor = to_si(f"1 {unit}" if not unit[:1].isdigit() else unit, "length", f"unit of '{path}'")
    if not factor > 0:
        raise InputRefused(f"unit of '{path}' is {unit}; it must be above 0")
    import trimesh

    try:
        with np.errstate(all="ignore"):  # what cannot be reckoned with is refused below
            mesh = trimesh.load_scene(path).to_mesh()
            vertices, triangles = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    except Exception as error:  # trimesh raises whatever a damaged file makes it stumble on
        raise InputRefused(f"the mesh '{path}' cannot be read: {' '.join(str(error).split()) or type(error).__name__}") from None
    if len(triangles) == 0:
        raise InputRefused(f"the mesh '{path}' holds no triangles")
    if vertices.shape[1:] != (3,):
        raise InputRefused(f"the mesh '{path}' has points of {vertices.shape[-1]} coordinates; 3 are needed, export it again")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        wrong = int(triangles.min() if triangles.min() < 0 else triangles.max())
        raise InputRefused(f"the mesh '{path}' names the vertex {wrong}, but has {len(vertices)}; it is damaged, export it again")
    used = factor * vertices[np.unique(triangles)]
    if not (np.abs(used) <= LARGEST).all():
        raise InputRefused(f"the mesh '{path}' has a coordinate of {np.abs(used).max():g} m; repair it in CAD, or check --unit")
    return factor * vertices, triangles


def up_axis(path: Path) -> str:
    """Axis that points up where none is stated: y of glTF (by its definition), else z."""
    return "y" if path.suffix.lower() in METRES else "z"


def turn_up(vertices: Array, up: str) -> Array:
    """Vertices (n, 3) with the axis ``up`` ("z", "-y", ...) along z, by the shortest turn: of "y", x stays and y becomes -z of the file.

    Raises
    ------
    InputRefused : if it is no axis.
    """
    name = up.lower().removeprefix("+")
    if name not in TO_Z:
        raise InputRefused(f"the axis that points up is '{up}'; give one of {', '.join(TO_Z)}")
    return np.stack([sign * vertices[:, axis] for axis, sign in TO_Z[name]], axis=1)
