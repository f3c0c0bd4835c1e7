"""glTF 2.0: a mesh in single precision around its middle, for viewers and game engines. GLB (one file) or glTF with a .bin beside."""

import json
import shutil
import struct
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from rille.model import Terrain
from rille.model.solid_mesh import hull_points, hull_triangles, stated_obstacles
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.mesh_rows import require_size, triangles, vertices
from rille.terrain.delivery.strips import Progress, facts

Array = NDArray[np.float64]


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Meshes in glTF's axes (x east, y up, z south), metres, one of the ground and one of each stated obstacle; their nodes are moved to
    the middle of what they show, so that single precision costs 6e-8 of its size and not of its coordinates. What the numbers mean
    stands in ``asset.extras``.

    Raises
    ------
    InputRefused : for a mesh that is too large, or if it cannot be written.
    """
    require_size(terrain, "mesh")
    n_rows, n_cols = terrain.heights.shape
    middle = np.array([terrain.x_west + (n_cols - 1) / 2 * terrain.posting_x, terrain.y_north - (n_rows - 1) / 2 * terrain.posting_y, 0.0])
    whole = path.suffix.lower() == ".glb"
    with appearing(path) as folder:
        data = folder / f"{path.stem}.bin"
        what = f"writing {path.name}"
        with data.open("wb") as file:
            parts = [_write_part(file, terrain.name, middle, vertices(terrain, what, progress), triangles(terrain, what, progress))]
            for obstacle in stated_obstacles(terrain):
                points = hull_points(obstacle)
                parts.append(_write_part(file, obstacle.name, np.array(obstacle.pose.position), [points], [hull_triangles(points)]))
        page = _page(terrain, parts, None if whole else data.name)
        if not whole:
            (folder / path.name).write_text(json.dumps(page, indent=1) + "\n")
            return
        text = json.dumps(page).encode()
        text += b" " * (-len(text) % 4)
        size = data.stat().st_size
        with (folder / path.name).open("wb") as file:
            file.write(struct.pack("<III", 0x46546C67, 2, 12 + 8 + len(text) + 8 + size))
            file.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
            file.write(struct.pack("<II", size, 0x004E4942))
            with data.open("rb") as source:
                shutil.copyfileobj(source, file, 1 << 24)
        data.unlink()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Part:
    """A mesh in the data. middle : of its node in W [m]. low, high : of its vertices [m], in glTF's axes from there."""

    name: str
    middle: Array
    n_vertices: int
    n_indices: int
    low: Array
    high: Array


def _write_part(
    file: BinaryIO, name: str, middle: Array, points: Iterable[Array], triangles_of_points: Iterable[NDArray[np.int64]]
) -> _Part:
    """Vertices (n, 3) [m] in W from ``middle``, turned into glTF's axes, and triangles (m, 3) of their numbers."""
    n_vertices, n_indices = 0, 0
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for block in points:
        local = block - middle
        turned = np.stack([local[:, 0], local[:, 2], -local[:, 1]], axis=1).astype("<f4")
        if len(turned):
            low, high = np.minimum(low, turned.min(axis=0)), np.maximum(high, turned.max(axis=0))
        n_vertices += len(turned)
        file.write(turned.tobytes())
    for corners in triangles_of_points:
        n_indices += corners.size
        file.write(corners.astype("<u4").tobytes())
    return _Part(name=name, middle=middle, n_vertices=n_vertices, n_indices=n_indices, low=low, high=high)


def _page(terrain: Terrain, parts: list[_Part], uri: str | None) -> dict[str, Any]:
    accessors, views, at = [], [], 0
    for part in parts:
        limits = {"min": [float(v) for v in part.low], "max": [float(v) for v in part.high]}
        accessors.append({"bufferView": len(views), "componentType": 5126, "count": part.n_vertices, "type": "VEC3", **limits})
        accessors.append({"bufferView": len(views) + 1, "componentType": 5125, "count": part.n_indices, "type": "SCALAR"})
        views.append({"buffer": 0, "byteOffset": at, "byteLength": 12 * part.n_vertices, "target": 34962})
        views.append({"buffer": 0, "byteOffset": at + 12 * part.n_vertices, "byteLength": 4 * part.n_indices, "target": 34963})
        at += 12 * part.n_vertices + 4 * part.n_indices
    numbered = range(len(parts))
    return {
        "asset": {"version": "2.0", "generator": "rille", "extras": facts(terrain, axes="glTF x = x, y = z, z = -y of W")},
        "scene": 0,
        "scenes": [{"nodes": list(numbered)}],
        "nodes": [
            {"name": part.name, "mesh": k, "translation": [float(part.middle[0]), float(part.middle[2]), -float(part.middle[1])]}
            for k, part in enumerate(parts)
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 2 * k}, "indices": 2 * k + 1, "material": min(k, 1)}]} for k in numbered],
        "materials": [_material([0.6, 0.57, 0.53, 1]), _material([0.44, 0.42, 0.39, 1])][: len(parts)],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": at} | ({} if uri is None else {"uri": uri})],
    }


def _material(color: list[float]) -> dict[str, Any]:
    return {"doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": color, "metallicFactor": 0}}
