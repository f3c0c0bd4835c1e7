"""Delivery: one evaluated terrain, written in the formats that other programs read.

Everywhere: metres; heights at points, n values bound n - 1 cells. Rasters on the map (geotiff, cog, pds4, ascii) hold map heights, that is
z in W plus ``map_origin`` z, at the centres of their cells, row 0 north. Everything else holds z in W and says so in a sidecar or comment.
"""

from collections.abc import Sequence
from pathlib import Path

from rille.model import InputRefused, Terrain
from rille.terrain.delivery.formats import FORMATS, Format, find_format
from rille.terrain.delivery.strips import Progress

__all__ = ["FORMATS", "Format", "deliver", "find_format", "plan"]


def plan(paths: Sequence[Path], name: str | None = None) -> list[tuple[Format, Path]]:
    """Formats of files to be written, checked before anything is evaluated.

    Raises
    ------
    InputRefused : for an unknown format, a missing folder, or two outputs that would write the same file.
    """
    outputs = [(find_format(path, name), Path(path)) for path in paths]
    writers: dict[Path, Path] = {}
    for entry, path in outputs:
        if not path.parent.is_dir():
            raise InputRefused(f"'{path}' cannot be written: there is no folder '{path.parent}'; create it first")
        for file in entry.files(path):
            if file.resolve() in writers:
                raise InputRefused(f"both '{writers[file.resolve()]}' and '{path}' would write '{file}'; give one of them another name")
            writers[file.resolve()] = path
    return outputs


def deliver(terrain: Terrain, outputs: Sequence[tuple[Format, Path]], progress: Progress | None = None) -> list[Path]:
    """Write a terrain in every format of a plan; returns all files that were written.

    Raises
    ------
    InputRefused : at the first that cannot be written; those before it stay.
    """
    written = []
    for entry, path in outputs:
        entry.write(terrain, path, progress)
        written += [file for file in entry.files(path) if file.exists()]
    return written
