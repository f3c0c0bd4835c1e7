"""Gazebo: a world (SDF) with a heightmap, and the 16-bit PNG that it reads."""

from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

from rille.model import InputRefused, Obstacle, Terrain
from rille.model.solid_mesh import hull_triangles, own_points, stated_obstacles
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.obj import write_points, write_triangles
from rille.terrain.delivery.png16 import steps, write_image
from rille.terrain.delivery.spelling import numbers
from rille.terrain.delivery.strips import Progress, Relief, relief, require_whole


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> list[Path]:
    """World ``path`` and image ``NAME.png``; z in W in 65535 steps over the relief, row 0 north. Stated obstacles are links of a static
    model, irregular rocks with a mesh each, ``NAME.rock_1.obj`` ..., which are returned.

    Gazebo stretches the image over ``size``: x and y from the first point to the last, (n - 1) postings, z from grey 0 to 65535; ``pos``
    puts the middle and the lowest height where they belong.

    Raises
    ------
    InputRefused : for a grid that is not 2^n + 1 points a side, if heights are missing, or if it cannot be written.
    """
    n_rows, n_cols = terrain.heights.shape
    width, length = (n_cols - 1) * terrain.posting_x, (n_rows - 1) * terrain.posting_y
    if n_rows != n_cols or (n_cols - 1) & (n_cols - 2):
        side = max(1 << (max(n_rows, n_cols) - 2).bit_length(), 2)
        raise InputRefused(
            f"terrain '{terrain.name}' has {n_cols} x {n_rows} points, but Gazebo takes 2^n + 1 on both sides; extract it with --posting "
            f"{width / side!r},{length / side!r} for {side + 1} x {side + 1}"
        )
    found = relief(terrain)
    require_whole(terrain, found, "a Gazebo heightmap")
    with appearing(path) as folder:
        image = f"{path.stem}.png"
        write_image(terrain, folder / image, found, progress)
        stones, meshes = stated_obstacles(terrain), {}
        for obstacle in stones:
            if obstacle.kind == "hull":
                meshes[obstacle.name] = f"{path.stem}.rock_{len(meshes) + 1}.obj"
                _write_mesh(folder / meshes[obstacle.name], obstacle)
        (folder / path.name).write_text(_world(terrain, image, found, width, length, _obstacles(stones, meshes)), encoding="utf-8")
    return [path.parent / mesh for mesh in meshes.values()]


def _write_mesh(path: Path, obstacle: Obstacle) -> None:
    """The hull of a rock, from its centre."""
    points = own_points(obstacle)
    with path.open("w", encoding="ascii") as file:
        file.write("# metres, from the centre of the rock\no rock\n")
        write_points(file, points)
        write_triangles(file, hull_triangles(points))


def _obstacles(stones: Sequence[Obstacle], meshes: dict[str, str]) -> str:
    """A static model with a link for every obstacle; "" without any. meshes : files of hulls by the name of the obstacle."""
    if not stones:
        return ""
    links = "".join(_link(obstacle, meshes.get(obstacle.name, "")) for obstacle in stones)
    return f'    <model name="obstacles">\n      <static>true</static>\n{links}    </model>\n'


def _link(obstacle: Obstacle, mesh: str) -> str:
    sizes = obstacle.size
    if obstacle.kind == "box":
        shape = f"<box><size>{numbers(*sizes)}</size></box>"
    elif obstacle.kind == "sphere":
        shape = f"<sphere><radius>{sizes[0]!r}</radius></sphere>"
    elif obstacle.kind == "cylinder":
        shape = f"<cylinder><radius>{sizes[0]!r}</radius><length>{sizes[1]!r}</length></cylinder>"
    else:
        shape = f"<mesh><uri>{escape(mesh)}</uri></mesh>"
    w, x, y, z = obstacle.pose.rotation
    return f"""      <link name={quoteattr(obstacle.name)}>
        <pose rotation_format="quat_xyzw">{numbers(*obstacle.pose.position, x, y, z, w)}</pose>
        <collision name="body"><geometry>{shape}</geometry></collision>
        <visual name="body"><geometry>{shape}</geometry></visual>
      </link>
"""


def _world(terrain: Terrain, image: str, found: Relief, width: float, length: float, obstacles: str) -> str:
    relief_height = 65535 * steps(found)[0] if found.high > found.low else 1e-3
    size = f"{width!r} {length!r} {relief_height!r}"
    place = f"{terrain.x_west + width / 2!r} {terrain.y_north - length / 2!r} {found.low!r}"
    geometry = f"<geometry><heightmap><uri>{escape(image)}</uri><size>{size}</size><pos>{place}</pos></heightmap></geometry>"
    return f"""<?xml version="1.0"?>
<!-- Metres, z up, frame W; row 0 of the image is the north; heights at points; map height = z + {terrain.map_origin[2]!r}. -->
<sdf version="1.9">
  <world name={quoteattr(terrain.name)}>
    <light name="sun" type="directional">
      <direction>0.5 0.3 -0.6</direction>
    </light>
    <model name="terrain">
      <static>true</static>
      <link name="ground">
        <collision name="ground">{geometry}</collision>
        <visual name="ground">{geometry}</visual>
      </link>
    </model>
{obstacles}  </world>
</sdf>
"""
