"""A scene of ours read back from its glTF: what films are drawn from."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pygltflib as gl
from numpy.typing import NDArray

from rille.model.rotation import matrix_of

Array = NDArray[Any]
_DTYPES = {gl.FLOAT: "<f4", gl.UNSIGNED_INT: "<u4", gl.UNSIGNED_SHORT: "<u2"}
_WIDTHS = {gl.SCALAR: 1, gl.VEC3: 3, gl.VEC4: 4}


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A mesh in the frame of its top node: vertices (n, 3) [m], triangles (m, 3), colour (3,) or colours (n, 3), sRGB 0..1."""

    vertices: Array
    triangles: Array
    color: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """A top node: what it is (``extras``) and its pieces."""

    extras: dict[str, Any]
    pieces: tuple[Piece, ...]


def things(glb: bytes) -> tuple[Thing, ...]:
    """The top nodes of a scene."""
    gltf: Any = gl.GLTF2.load_from_bytes(glb)
    blob = gltf.binary_blob() or b""

    def values(number: int) -> Array:
        accessor = gltf.accessors[number]
        view = gltf.bufferViews[accessor.bufferView]
        width = _WIDTHS[accessor.type]
        found = np.frombuffer(blob, _DTYPES[accessor.componentType], accessor.count * width, view.byteOffset or 0).reshape(-1, width)
        return found / 65535.0 if accessor.normalized else found

    def pieces(number: int, rotation: Array, position: Array, top: bool) -> list[Piece]:
        node = gltf.nodes[number]
        if not top:
            x, y, z, w = node.rotation or (0.0, 0.0, 0.0, 1.0)
            position = position + rotation @ np.array(node.translation or (0.0, 0.0, 0.0))
            rotation = rotation @ matrix_of((w, x, y, z))
        found = []
        if node.mesh is not None:
            for primitive in gltf.meshes[node.mesh].primitives:
                vertices = values(primitive.attributes.POSITION).astype(float) @ rotation.T + position
                stored = primitive.attributes.COLOR_0
                pbr = gltf.materials[primitive.material].pbrMetallicRoughness
                color = values(stored)[:, :3] if stored is not None else np.array(pbr.baseColorFactor[:3])
                found.append(Piece(vertices=vertices, triangles=values(primitive.indices).reshape(-1, 3).astype(int), color=screen(color)))
        for child in node.children or []:
            found += pieces(child, rotation, position, False)
        return found

    return tuple(
        Thing(extras=gltf.nodes[number].extras, pieces=tuple(pieces(number, np.eye(3), np.zeros(3), True)))
        for number in gltf.scenes[gltf.scene].nodes
    )


def screen(color: Array) -> Array:
    """sRGB of linear light 0..1 (IEC 61966-2-1)."""
    color = np.clip(np.asarray(color, dtype=float), 0, 1)
    return np.where(color <= 0.0031308, 12.92 * color, 1.055 * color ** (1 / 2.4) - 0.055)
