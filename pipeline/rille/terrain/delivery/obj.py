"""Wavefront OBJ: a text mesh with all digits of every height."""

from pathlib import Path

from rille.model import Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.mesh_rows import require_size, triangles, vertices
from rille.terrain.delivery.strips import Progress


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Mesh in W, z up, metres; its comments say so.

    Raises
    ------
    InputRefused : for a mesh that is too large, or if it cannot be written.
    """
    require_size(terrain, "mesh")
    n_rows, n_cols = terrain.heights.shape
    with appearing(path) as folder, (folder / path.name).open("w", encoding="ascii", errors="replace") as file:
        file.write(f"# terrain {terrain.name!a}: {n_rows} x {n_cols} heights, a vertex each; metres, z up, x and y of frame W\n")
        file.write(f"# map height = z + {terrain.map_origin[2]!r}\no terrain\n")
        for points in vertices(terrain, f"writing {path.name}", progress):
            file.writelines([f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist()])
        for corners in triangles(terrain, f"writing {path.name}", progress):
            file.writelines([f"f {a} {b} {c}\n" for a, b, c in (corners + 1).tolist()])
