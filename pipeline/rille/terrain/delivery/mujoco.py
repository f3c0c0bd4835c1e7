"""MuJoCo: a height field (.bin) and an MJCF file that places it, ready to be loaded."""

from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from rille.model import Obstacle, Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.spelling import numbers
from rille.terrain.delivery.strips import Progress, Relief, relief, require_whole, strips

BELOW = 1.0  # [m] how far the solid reaches below its lowest point


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """MJCF ``path`` and heights ``NAME.bin``: int32 rows, int32 columns, float32 heights z in W, row by row from the south, as MuJoCo
    wants them (an image would start in the north).

    MuJoCo maps heights to 0..1 and takes the extent from the MJCF: half lengths (n_cols - 1)/2 p_x and (n_rows - 1)/2 p_y, since its
    values are points, too; the geom stands in the middle of the grid at the lowest height, so that its surface passes through the heights
    to single precision of the relief. Between them it is two triangles a cell, not bilinear. Obstacles come as geoms.

    Raises
    ------
    InputRefused : if heights are missing, or it cannot be written.
    """
    found = relief(terrain)
    require_whole(terrain, found, "a MuJoCo height field")
    with appearing(path) as folder:
        heights = f"{path.stem}.bin"
        with (folder / heights).open("wb") as file:
            file.write(np.array(terrain.heights.shape, "<i4").tobytes())
            for _, block in strips(terrain, f"writing {heights}", progress, reverse=True):
                file.write((block - found.low).astype("<f4").tobytes())
        (folder / path.name).write_text(_mjcf(terrain, heights, found), encoding="utf-8")


def _mjcf(terrain: Terrain, heights: str, found: Relief) -> str:
    n_rows, n_cols = terrain.heights.shape
    half_x, half_y = (n_cols - 1) * terrain.posting_x / 2, (n_rows - 1) * terrain.posting_y / 2
    size = numbers(half_x, half_y, max(found.high - found.low, 1e-3), BELOW)
    place = numbers(terrain.x_west + half_x, terrain.y_north - half_y, found.low)
    assets, geoms = [], []
    for k, obstacle in enumerate(terrain.obstacles):
        if obstacle.vertices is not None:
            assets.append(f'    <mesh name="obstacle_{k}" vertex="{numbers(*obstacle.vertices.ravel())}"/>\n')
        geoms.append(f"    <geom name={quoteattr(obstacle.name)} {_shape(obstacle, k)}/>\n")
    return (
        f"<!-- Terrain {terrain.name.replace('--', '- -')}: metres, z up, frame W; {n_rows} x {n_cols} heights at points; map height = z + "
        f"{terrain.map_origin[2]!r}. -->\n<mujoco model={quoteattr(terrain.name)}>\n  <asset>\n"
        f'    <hfield name="terrain" file={quoteattr(heights)} size="{size}"/>\n{"".join(assets)}  </asset>\n  <worldbody>\n'
        f'    <geom name="terrain" type="hfield" hfield="terrain" pos="{place}" rgba="0.6 0.57 0.53 1"/>\n'
        f"{''.join(geoms)}  </worldbody>\n</mujoco>\n"
    )


def _shape(obstacle: Obstacle, number: int) -> str:
    """Type, size and place of an obstacle as attributes of a geom; MuJoCo's sizes are half lengths."""
    sizes = obstacle.size
    if obstacle.kind == "box":
        shape = f'type="box" size="{numbers(*(v / 2 for v in sizes))}"'
    elif obstacle.kind == "sphere":
        shape = f'type="sphere" size="{numbers(sizes[0])}"'
    elif obstacle.kind == "cylinder":
        shape = f'type="cylinder" size="{numbers(sizes[0], sizes[1] / 2)}"'
    else:
        shape = f'type="mesh" mesh="obstacle_{number}"'
    return f'{shape} pos="{numbers(*obstacle.pose.position)}" quat="{numbers(*obstacle.pose.rotation)}"'
