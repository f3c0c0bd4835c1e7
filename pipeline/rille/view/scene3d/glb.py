"""A binary glTF 2.0 that grows: meshes, nodes with extras, animations."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pygltflib as gl
from numpy.typing import NDArray

Array = NDArray[Any]
_COMPONENTS = {"f4": gl.FLOAT, "u4": gl.UNSIGNED_INT, "u2": gl.UNSIGNED_SHORT}
_KINDS = {1: gl.SCALAR, 3: gl.VEC3, 4: gl.VEC4}


def linear(color: Array) -> Array:
    """Linear light of sRGB colours 0..1 (IEC 61966-2-1): glTF stores colours so."""
    color = np.asarray(color, dtype=float)
    return np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)


def rgb(color: str) -> Array:
    """``#rrggbb`` as linear light (3,)."""
    return linear(np.array([int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)]))


class Glb:
    """A scene that is written piece by piece."""

    def __init__(self) -> None:
        self.gltf: Any = gl.GLTF2(scene=0, scenes=[gl.Scene(nodes=[])])  # its lists may be None by their types, and never are here
        self._blob = bytearray()
        self.gltf.asset = gl.Asset(version="2.0", generator="rille")
        self._materials: dict[tuple[float, ...], int] = {}

    def accessor(self, values: Array, *, target: int | None = None, normalized: bool = False, bounds: bool = False) -> int:
        """An accessor of values (n,) or (n, 3) or (n, 4) of float32, uint32 or uint16."""
        flat = np.ascontiguousarray(values).reshape(len(values), -1)
        view = gl.BufferView(buffer=0, byteOffset=len(self._blob), byteLength=flat.nbytes, target=target)
        self._blob += flat.tobytes()
        self._blob += b"\0" * (-len(self._blob) % 4)
        self.gltf.bufferViews.append(view)
        limits = {"min": flat.min(0).tolist(), "max": flat.max(0).tolist()} if bounds else {}
        made = gl.Accessor(
            bufferView=len(self.gltf.bufferViews) - 1,
            componentType=_COMPONENTS[flat.dtype.str[1:]],
            count=len(flat),
            type=_KINDS[flat.shape[1]],
            normalized=normalized,
            **limits,
        )
        self.gltf.accessors.append(made)
        return len(self.gltf.accessors) - 1

    def material(self, color: Array) -> int:
        """A rough material of a linear colour (3,); the same one for the same colour."""
        key = tuple(map(float, color))
        if key not in self._materials:
            pbr = gl.PbrMetallicRoughness(baseColorFactor=[*key, 1.0], metallicFactor=0.1, roughnessFactor=0.7)
            self.gltf.materials.append(gl.Material(pbrMetallicRoughness=pbr, doubleSided=True))
            self._materials[key] = len(self.gltf.materials) - 1
        return self._materials[key]

    def mesh(self, vertices: Array, triangles: Array, *, material: int, normals: Array | None = None, colors: Array | None = None) -> int:
        """A mesh: vertices (n, 3) [m], triangles (m, 3), normals (n, 3), linear colours 0..1 (n, 3)."""
        attributes = gl.Attributes(POSITION=self.accessor(np.asarray(vertices, "<f4"), target=gl.ARRAY_BUFFER, bounds=True))
        if normals is not None:
            attributes.NORMAL = self.accessor(np.asarray(normals, "<f4"), target=gl.ARRAY_BUFFER)
        if colors is not None:
            opaque = np.column_stack([np.clip(colors, 0, 1), np.ones(len(colors))])
            attributes.COLOR_0 = self.accessor(np.round(opaque * 65535).astype("<u2"), target=gl.ARRAY_BUFFER, normalized=True)
        indices = self.accessor(np.asarray(triangles, "<u4").ravel(), target=gl.ELEMENT_ARRAY_BUFFER)
        primitive = gl.Primitive(attributes=attributes, indices=indices, material=material)
        self.gltf.meshes.append(gl.Mesh(primitives=[primitive]))
        return len(self.gltf.meshes) - 1

    def node(
        self,
        name: str,
        *,
        mesh: int | None = None,
        position: Sequence[float] | Array | None = None,
        rotation: Sequence[float] | None = None,
        children: Sequence[int] = (),
        extras: dict[str, Any] | None = None,
        top: bool = False,
    ) -> int:
        """A node. rotation : quaternion w x y z. top : below the root of the scene."""
        made = gl.Node(name=name, mesh=mesh, children=list(children), extras=extras or {})
        if position is not None:
            made.translation = [float(v) for v in position]
        if rotation is not None:
            w, x, y, z = (float(v) for v in rotation)
            made.rotation = [x, y, z, w]
        self.gltf.nodes.append(made)
        number = len(self.gltf.nodes) - 1
        if top:
            self.gltf.scenes[0].nodes.append(number)
        return number

    def animate(self, name: str, time: Array, moves: dict[int, tuple[Array, Array]]) -> None:
        """An animation: of each node translations (n, 3) [m] and quaternions w x y z (n, 4) at times (n,) [s], linear in between."""
        clock = self.accessor(np.asarray(time, "<f4"), bounds=True)
        animation = gl.Animation(name=name, samplers=[], channels=[])
        for node, (positions, rotations) in moves.items():
            for path, values in (("translation", positions), ("rotation", rotations[:, [1, 2, 3, 0]])):
                sampler = gl.AnimationSampler(input=clock, output=self.accessor(np.asarray(values, "<f4")), interpolation=gl.ANIM_LINEAR)
                animation.samplers.append(sampler)
                target = gl.AnimationChannelTarget(node=node, path=path)
                animation.channels.append(gl.AnimationChannel(sampler=len(animation.samplers) - 1, target=target))
        self.gltf.animations.append(animation)

    def to_bytes(self) -> bytes:
        """The file."""
        self.gltf.buffers = [gl.Buffer(byteLength=len(self._blob))]
        self.gltf.set_binary_blob(bytes(self._blob))
        return b"".join(self.gltf.save_to_bytes())
