"""Parts and assemblies in the cache: what a child process leaves there, and what the tool makes of it without OCCT."""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from rille.cad.files import cache
from rille.cad.files.assembly import Assembly, PlacedPart, Prototype
from rille.cad.geometry import VolumeProperties, bounds, brep_bytes, shape_of, tessellate, volume_properties
from rille.model import Material, Mesh


class CacheFull(OSError):
    """The cache cannot take what must go through it."""


def keep(shape: Any, name: str, **marks: Any) -> Prototype:
    """Make a prototype as :meth:`Prototype.of_shape` does; its B-rep goes into the cache, its weight is taken from there.

    Raises
    ------
    CacheFull : when the B-rep cannot be written.
    """
    brep = brep_bytes(shape)
    digest = hashlib.sha256(brep).hexdigest()
    keep_brep(digest, brep)
    weights = cache.get(f"weights {digest}")
    if weights is None:
        volume, box = volume_properties(shape), bounds(shape)
        weights = {
            "volume": np.array([volume.volume, volume.n_solids, volume.n_open], float),
            "com": volume.com,
            "inertia": volume.inertia,
            "bounds": box,
        }
        cache.put(f"weights {digest}", weights)
    volume, n_solids, n_open = (float(v) for v in weights["volume"])
    return Prototype(
        name=name,
        digest=digest,
        n_solids=int(n_solids),
        volume=VolumeProperties(volume=volume, com=weights["com"], inertia=weights["inertia"], n_solids=int(n_solids), n_open=int(n_open)),
        bounds=weights["bounds"],
        load=lambda: shape,
        **marks,
    )


def keep_brep(digest: str, brep: bytes) -> None:
    """Put a B-rep into the cache."""
    key = f"brep {digest}"
    if not cache.has(key) and not cache.put(key, {"brep": np.frombuffer(brep, np.uint8)}):
        raise CacheFull(f"the cache '{cache.folder()}' cannot take {len(brep)} bytes")


def has_shape(digest: str) -> bool:
    """Is a B-rep in the cache?"""
    return cache.has(f"brep {digest}")


def brep_size(digest: str) -> int:
    """Bytes of a B-rep in the cache; 0 if it is not there."""
    arrays = cache.get(f"brep {digest}")
    return 0 if arrays is None else len(arrays["brep"])


def saved_shape(digest: str) -> Any | None:
    """The TopoDS_Shape of a digest; None if it is not in the cache (any more)."""
    arrays = cache.get(f"brep {digest}")
    return None if arrays is None else shape_of(arrays["brep"].tobytes())


def saved_mesh(digest: str, tolerance: float) -> tuple[Mesh | None] | None:
    """The mesh of a digest, in a tuple (None for a shape without a face); None if it is not in the cache."""
    arrays = cache.get(f"mesh {digest} {tolerance!r}")
    if arrays is None:
        return None
    if not len(arrays["triangles"]):
        return (None,)
    return (Mesh(vertices=arrays["vertices"], triangles=arrays["triangles"], tolerance=tolerance),)


def keep_mesh(digest: str, tolerance: float) -> None:
    """Tessellate a shape that is in the cache.

    Raises
    ------
    CacheFull : when the triangles cannot be written. LookupError : when the shape is not there.
    """
    shape = saved_shape(digest)
    if shape is None:
        raise LookupError(f"the B-rep {digest} is not in the cache")
    mesh = tessellate(shape, tolerance)
    vertices = np.zeros((0, 3), np.float32) if mesh is None else mesh.vertices
    triangles = np.zeros((0, 3), np.int32) if mesh is None else mesh.triangles
    if not cache.put(f"mesh {digest} {tolerance!r}", {"vertices": vertices, "triangles": triangles}):
        raise CacheFull(f"the cache '{cache.folder()}' cannot take {vertices.nbytes + triangles.nbytes} bytes")


def keep_structure(key: str, values: Mapping[str, Any]) -> None:
    """Put what :func:`plain` gives into the cache."""
    cache.put(key, {"json": np.frombuffer(json.dumps(values).encode(), np.uint8)})


def structure(key: str) -> dict[str, Any] | None:
    """What was put under a key; None if nothing is there."""
    entry = cache.get(key)
    return None if entry is None else json.loads(entry["json"].tobytes())


def plain(assembly: Assembly) -> dict[str, Any]:
    """An assembly without its shapes, as JSON has it (numbers exactly)."""
    return {
        "prototypes": [
            {
                "name": p.name,
                "digest": p.digest,
                "volume": [float(p.volume.volume), p.volume.com.tolist(), p.volume.inertia.tolist(), p.volume.n_solids, p.volume.n_open],
                "bounds": p.bounds.tolist(),
                "color": p.color,
                "face_colors": p.face_colors,
                "material": None if p.material is None else asdict(p.material),
                "named_faces": p.named_faces,
            }
            for p in assembly.prototypes
        ],
        "instances": [[i.path, i.prototype, i.matrix.tolist(), i.color] for i in assembly.instances],
        "notes": assembly.notes,
        "tables": assembly.tables,
    }


def restored(values: Mapping[str, Any], file: Path, load: Callable[[str], Any]) -> Assembly:
    """The assembly of :func:`plain`; ``load`` fetches the shape of a digest."""
    prototypes = []
    for p in values["prototypes"]:
        volume, com, inertia, n_solids, n_open = p["volume"]
        prototypes.append(
            Prototype(
                name=p["name"],
                digest=p["digest"],
                n_solids=n_solids,
                volume=VolumeProperties(volume=volume, com=np.array(com), inertia=np.array(inertia), n_solids=n_solids, n_open=n_open),
                bounds=np.array(p["bounds"]),
                load=_loader(load, p["digest"]),
                color=p["color"],
                face_colors=tuple(p["face_colors"]),
                material=None if p["material"] is None else Material(**p["material"]),
                named_faces={name: tuple(faces) for name, faces in p["named_faces"].items()},
            )
        )
    instances = tuple(PlacedPart(path=path, prototype=k, matrix=np.array(m), color=c) for path, k, m, c in values["instances"])
    return Assembly(
        file=file, prototypes=tuple(prototypes), instances=instances, notes=tuple(values["notes"]), tables=dict(values["tables"])
    )


def _loader(load: Callable[[str], Any], digest: str) -> Callable[[], Any]:
    """Fetches once, then remembers."""
    fetched: list[Any] = []

    def fetch() -> Any:
        if not fetched:
            fetched.append(load(digest))
        return fetched[0]

    return fetch
