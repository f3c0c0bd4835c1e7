"""Binary STL: triangles in single precision."""

from pathlib import Path

import numpy as np

from rille.model import Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.mesh_rows import require_size
from rille.terrain.delivery.strips import Progress, strips

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Triangles in W, z up, metres, two a cell; cells beside a missing height are left out. Single precision: 6e-8 of a coordinate.

    Raises
    ------
    InputRefused : for a mesh that is too large, or if it cannot be written.
    """
    require_size(terrain, "mesh")
    n_cols = terrain.heights.shape[1]
    x = terrain.x_west + np.arange(n_cols, dtype=np.float64) * terrain.posting_x
    above = np.empty((0, n_cols, 3))
    count = 0
    with appearing(path) as folder, (folder / path.name).open("wb") as file:
        file.write(f"rille terrain {terrain.name!a}, metres, z up, frame W"[:80].encode("ascii").ljust(80))
        file.write(np.uint32(0).tobytes())
        for row0, z in strips(terrain, f"writing {path.name}", progress):
            y = terrain.y_north - np.arange(row0, row0 + len(z), dtype=np.float64) * terrain.posting_y
            rows = np.concatenate([above, np.stack([*np.broadcast_arrays(x[None, :], y[:, None]), z], axis=-1)])
            above = rows[-1:]
            nw, ne, sw, se = rows[:-1, :-1], rows[:-1, 1:], rows[1:, :-1], rows[1:, 1:]
            full = np.isfinite(nw[..., 2] + ne[..., 2] + sw[..., 2] + se[..., 2])
            corners = np.stack([nw[full], sw[full], se[full], nw[full], se[full], ne[full]], axis=1).reshape(-1, 3, 3)
            normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            facets = np.zeros(len(corners), TRIANGLE)
            facets["corners"] = corners
            facets["normal"] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
            file.write(facets.tobytes())
            count += len(corners)
        file.seek(80)
        file.write(np.uint32(count).tobytes())
