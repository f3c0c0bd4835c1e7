"""Meshes of a URDF that are in another unit than the metre: far larger or smaller than the collision shape or the inertia of their link."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.cad.exchange.mesh_in import Piece
from rille.cad.exchange.urdf_file import Geometry, Link, Shape, UrdfFile

Array = NDArray[np.float64]
Pieces = Callable[[Geometry], tuple[Piece, ...]]

UNITS = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254}
APART = 20.0
"""Times: sizes that differ by more are in different units; a simplified collision shape is never so far off, inches are 39 times."""
BOX = float(np.sqrt(3.0))
"""Half the diagonal of a homogeneous box over its radius of gyration sqrt(tr(I) / 2m), whatever its proportions."""
MADE_UP = 10.0
"""Times: how much further off than a collision shape an inertia must be, since many are guessed."""


def wrong_units(file: UrdfFile, pieces: Pieces) -> list[str]:
    """A sentence on every mesh file that is far larger than its link weighs or collides, or that with all else of its link is far smaller.

    A small mesh alone may be a screw. pieces : meshes of a shape.
    """
    found: dict[str, str] = {}
    for link in file.links.values():
        meshes = [shape for shape in link.visuals if shape.geometry.kind == "mesh" and shape.geometry.file not in found]
        reference, what, apart = _reference(link, pieces)
        if not meshes or reference == 0:
            continue
        small = 0 < _size(link.visuals, pieces) < reference / apart
        for shape in meshes:
            size = _size([shape], pieces)
            if size > apart * reference or (small and size > 0):
                found[shape.geometry.file] = _sentence(link.name, shape.geometry, size, reference, what)
    return list(found.values())


def _reference(link: Link, pieces: Pieces) -> tuple[float, str, float]:
    """What a mesh of a link is compared with: a size [m], its name, and the factor that is too much; 0 where there is nothing."""
    drawn = {shape.geometry.file for shape in link.visuals if shape.geometry.kind == "mesh"}
    own = [shape for shape in link.collisions if shape.geometry.file not in drawn]
    size = _size(own, pieces)
    if size > 0:
        return size, "its collision shape", APART
    inertial = link.inertial
    if inertial is None or not inertial.mass > 0:
        return 0.0, "", APART
    gyration = float(np.sqrt(max(np.trace(inertial.inertia), 0.0) / (2 * inertial.mass)))
    return 2 * BOX * gyration, "a box with its mass and inertia", MADE_UP * APART


def _size(shapes: Sequence[Shape], pieces: Pieces) -> float:
    """Diagonal of the box around shapes, in the link's frame [m]; 0 without any."""
    clouds = [piece.vertices @ shape.origin[:3, :3].T + shape.origin[:3, 3] for shape in shapes for piece in pieces(shape.geometry)]
    return float(np.linalg.norm(np.ptp(np.concatenate(clouds), axis=0))) if clouds else 0.0


def _sentence(link: str, mesh: Geometry, size: float, reference: float, what: str) -> str:
    ratio = size / reference
    start = f"mesh '{mesh.file}' of link '{link}' is {size:.3g} m large, {_times(ratio)} times {what} ({reference:.3g} m)"
    if ratio < 1:
        return f"{start}; correct its scale, a URDF counts in metres"
    unit = min(UNITS, key=lambda name: abs(np.log(ratio * UNITS[name])))
    scale = " ".join(f"{factor * UNITS[unit]:g}" for factor in mesh.scale)
    return f'{start}, so it is likely in {unit}; write <mesh ... scale="{scale}"/>, a URDF counts in metres'


def _times(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}"
