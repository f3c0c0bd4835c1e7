"""glTF 2.0: a mesh in single precision around its middle, for viewers and game engines. GLB (one file) or glTF with a .bin beside."""

import json
import shutil
import struct
from pathlib import Path
from typing import Any

import numpy as np

from rille.model import Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.mesh_rows import require_size, triangles, vertices
from rille.terrain.delivery.strips import Progress, facts


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Mesh in glTF's axes (x east, y up, z south), metres; its node is moved to the middle of the terrain, so that single precision
    costs 6e-8 of the terrain's size and not of its coordinates. What the numbers mean stands in ``asset.extras``.

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
        n_vertices, n_indices = 0, 0
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        with data.open("wb") as file:
            for points in vertices(terrain, f"writing {path.name}", progress):
                local = points - middle
                turned = np.stack([local[:, 0], local[:, 2], -local[:, 1]], axis=1).astype("<f4")
                if len(turned):
                    low, high = np.minimum(low, turned.min(axis=0)), np.maximum(high, turned.max(axis=0))
                n_vertices += len(turned)
                file.write(turned.tobytes())
            for corners in triangles(terrain, f"writing {path.name}", progress):
                n_indices += corners.size
                file.write(corners.astype("<u4").tobytes())
        page = _page(terrain, middle, n_vertices, n_indices, low, high, None if whole else data.name)
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


def _page(terrain: Terrain, middle: Any, n_vertices: int, n_indices: int, low: Any, high: Any, uri: str | None) -> dict[str, Any]:
    buffer: dict[str, Any] = {"byteLength": 12 * n_vertices + 4 * n_indices}
    if uri is not None:
        buffer["uri"] = uri
    return {
        "asset": {"version": "2.0", "generator": "rille", "extras": facts(terrain, axes="glTF x = x, y = z, z = -y of W")},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": terrain.name, "mesh": 0, "translation": [float(middle[0]), float(middle[2]), -float(middle[1])]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.57, 0.53, 1], "metallicFactor": 0}}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": n_vertices,
                "type": "VEC3",
                "min": [float(v) for v in low],
                "max": [float(v) for v in high],
            },
            {"bufferView": 1, "componentType": 5125, "count": n_indices, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 12 * n_vertices, "target": 34962},
            {"buffer": 0, "byteOffset": 12 * n_vertices, "byteLength": 4 * n_indices, "target": 34963},
        ],
        "buffers": [buffer],
    }
