"""Wavefront OBJ: a text mesh with all digits of every height."""

from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from rille.model import Terrain
from rille.model.solid_mesh import hull_points, hull_triangles, stated_obstacles
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.mesh_rows import require_size, triangles, vertices
from rille.terrain.delivery.strips import Progress


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Mesh in W, z up, metres; its comments say so. Stated obstacles are objects of their own, ``obstacle_NAME``.

    Raises
    ------
    InputRefused : for a mesh that is too large, or if it cannot be written.
    """
    require_size(terrain, "mesh")
    n_rows, n_cols = terrain.heights.shape
    with appearing(path) as folder, (folder / path.name).open("w", encoding="ascii", errors="replace") as file:
        file.write(f"# terrain {terrain.name!a}: {n_rows} x {n_cols} heights, a vertex each; metres, z up, x and y of frame W\n")
        file.write(f"# map height = z + {terrain.map_origin[2]!r}\no terrain\n")
        count = 0
        for points in vertices(terrain, f"writing {path.name}", progress):
            write_points(file, points)
            count += len(points)
        for corners in triangles(terrain, f"writing {path.name}", progress):
            write_triangles(file, corners)
        for obstacle in stated_obstacles(terrain):
            points = hull_points(obstacle)
            file.write(f"o {'_'.join(['obstacle', *obstacle.name.split()])}\n")
            write_points(file, points)
            write_triangles(file, hull_triangles(points) + count)
            count += len(points)


def write_points(file: TextIO, points: NDArray[np.float64]) -> None:
    """Vertices (n, 3) [m]."""
    file.writelines([f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist()])


def write_triangles(file: TextIO, triangles: NDArray[np.int64]) -> None:
    """Triangles (m, 3) of vertices numbered from 0 in the whole file; OBJ counts from 1."""
    file.writelines([f"f {a} {b} {c}\n" for a, b, c in (triangles + 1).tolist()])
