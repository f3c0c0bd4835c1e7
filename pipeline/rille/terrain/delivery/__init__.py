"""Delivery: one evaluated terrain, written in the formats that other programs read.

Everywhere: metres; heights at points, n values bound n - 1 cells. Rasters on the map (geotiff, cog, pds4, ascii) hold map heights, that is
z in W plus ``map_origin`` z, at the centres of their cells, row 0 north. Everything else holds z in W and says so in a sidecar or comment.
"""

import hashlib
from collections.abc import Sequence
from pathlib import Path

from rille.model import InputRefused, Terrain
from rille.model.solid_mesh import stated_obstacles
from rille.terrain.delivery.formats import FORMATS, Format, find_format
from rille.terrain.delivery.strips import Progress

__all__ = ["FORMATS", "Format", "deliver", "find_format", "left_out", "plan"]


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
    InputRefused : before anything is written, if a file is one that the terrain was made of; at the first that cannot be written,
        and those before it stay.
    """
    for entry, path in outputs:
        for file in entry.files(path):
            if _made_of(terrain, file):
                raise InputRefused(f"'{file}' is a file that terrain '{terrain.name}' is made of, and stays; write to another name")
    written = []
    for entry, path in outputs:
        written += entry.write(terrain, path, progress)
    return written


def left_out(terrain: Terrain, outputs: Sequence[tuple[Format, Path]]) -> str:
    """A sentence on stated obstacles that formats of a plan leave out; "" if none is."""
    stones = stated_obstacles(terrain)
    without = [path.name for entry, path in outputs if not entry.obstacles]
    if not (stones and without):
        return ""
    number = f"{len(stones)} obstacle{'s' * (len(stones) != 1)} of the scene"
    holding = ", ".join(dict.fromkeys(entry.endings[0] for entry in FORMATS.values() if entry.obstacles))
    return f"{', '.join(without)}: the ground alone, without the {number}; {holding} and .db hold them"


def _made_of(terrain: Terrain, file: Path) -> bool:
    """Whether a file is the scene, or a DEM or sheet, that the terrain was read from."""
    known = {source.sha256 for source in terrain.sources if source.file == file.name}
    if not known or not file.is_file():
        return False
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest() in known
