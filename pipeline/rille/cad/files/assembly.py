"""What was read from a STEP file or a script: parts once, their occurrences many times. Importing this imports no OCCT."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.cad.geometry import VolumeProperties, bounds, brep_hash, volume_properties
from rille.model import InputRefused, Material


@dataclass(frozen=True, slots=True, kw_only=True)
class Prototype:
    """A part as drawn once, in its own frame.

    digest : SHA-256 of its B-rep. n_solids : how many solids of it have a volume. bounds : lowest and highest corner [m],
    shape (2, 3). color : ``#rrggbb`` or None. face_colors : colour of every face in the order of
    :func:`rille.cad.geometry.faces`; empty where the file colours no single face. material : as the file states it, for
    advice. named_faces : indices of the faces that the file names, by name. load : fetches the TopoDS_Shape [mm].
    """

    name: str
    digest: str
    n_solids: int
    volume: VolumeProperties
    bounds: NDArray[np.float64]
    load: Callable[[], Any] = field(repr=False, compare=False)
    color: str | None = None
    face_colors: tuple[str | None, ...] = ()
    material: Material | None = None
    named_faces: Mapping[str, tuple[int, ...]] = field(default_factory=dict)

    @property
    def shape(self) -> Any:
        """TopoDS_Shape in the part's frame, millimetres; the first call fetches it (and imports OCCT)."""
        return self.load()

    @staticmethod
    def of_shape(
        shape: Any,
        name: str,
        *,
        color: str | None = None,
        face_colors: tuple[str | None, ...] = (),
        material: Material | None = None,
        named_faces: Mapping[str, tuple[int, ...]] | None = None,
    ) -> "Prototype":
        """Weigh and measure a TopoDS_Shape [mm] that is at hand."""
        digest = brep_hash(shape)  # first: triangles would change it
        volume = volume_properties(shape)
        return Prototype(
            name=name,
            digest=digest,
            n_solids=volume.n_solids,
            volume=volume,
            bounds=bounds(shape),
            load=lambda: shape,
            color=color,
            face_colors=face_colors,
            material=material,
            named_faces=named_faces or {},
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedPart:
    """An occurrence of a prototype. matrix : shape (4, 4), part frame -> assembly frame, metres."""

    path: str
    prototype: int
    matrix: NDArray[np.float64]
    color: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Assembly:
    """A file as read. notes : what was found and left out, a sentence each. tables : sheet tables that a script declares."""

    file: Path
    prototypes: tuple[Prototype, ...]
    instances: tuple[PlacedPart, ...]
    notes: tuple[str, ...] = ()
    tables: dict[str, Any] = field(default_factory=dict)


def require_solids(assembly: Assembly) -> None:
    """Refuse a file of which nothing can be weighed.

    Raises
    ------
    InputRefused : if no solid of it is closed.
    """
    if any(p.n_solids for p in assembly.prototypes):
        return
    n_open = sum(p.volume.n_open for p in assembly.prototypes)
    why = f"{n_open} solids, none of them closed" if n_open else "no solid"
    raise InputRefused(
        f"'{assembly.file}' has {why}, so nothing in it has a mass; export closed solids, not surfaces (`rille cad inspect` shows what is "
        "there)"
    )
