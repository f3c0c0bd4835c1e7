"""Axes of exact faces that are found once and kept by the digest of the part, so that a rebuild opens no CAD kernel."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rille.cad.files import cache
from rille.cad.files.assembly import Prototype

Array = NDArray[np.float64]


def cylinder_lines(prototype: Prototype) -> tuple[Array, Array, Array]:
    """Radii (n,), middles (n, 3) and unit axes (n, 3) of the cylinders of a part [m], in its own frame."""

    def find() -> dict[str, Array]:
        from rille.cad.suggestion.features import cylinders

        found = cylinders(prototype.shape)
        return {
            "radius": np.array([c.radius for c in found]),
            "middle": np.array([c.point + c.axis * (c.low + c.high) / 2 for c in found]).reshape(-1, 3),
            "axis": np.array([c.axis for c in found]).reshape(-1, 3),
        }

    kept = _kept(f"cylinders {prototype.digest}", find)
    return kept["radius"], kept["middle"], kept["axis"]


def face_line(prototype: Prototype, name: str) -> tuple[Array, Array | None]:
    """Point [m] and unit normal or axis (None: the face has none) of a face that the file names."""

    def find() -> dict[str, Array]:
        from rille.cad.files.named_faces import named_face

        found = named_face(prototype, name)
        return {"point": found.point, "axis": np.zeros(0) if found.axis is None else found.axis}

    indices = " ".join(map(str, prototype.named_faces[name]))
    kept = _kept(f"face {indices} of {prototype.digest}", find)
    return kept["point"], kept["axis"] if len(kept["axis"]) else None


def _kept(key: str, find: Callable[[], dict[str, Array]]) -> dict[str, Array]:
    kept = cache.get(key)
    if kept is None:
        kept = find()
        cache.put(key, kept)
    return kept
