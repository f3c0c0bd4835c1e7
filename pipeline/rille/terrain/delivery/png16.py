"""PNG with 16 bits of grey: heights in steps, with a JSON sidecar that says how large they are."""

import json
import struct
import zlib
from pathlib import Path
from typing import IO

import numpy as np

from rille.model import Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.strips import Progress, Relief, facts, relief, strips

TOP = 65535


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Heights z in W as 16-bit greys, z = offset + scale grey, and everything needed to read them in ``NAME.png.json``.

    0 is the lowest and 65535 the highest height; where heights are missing 0 means that, and 1 is the lowest.

    Raises
    ------
    InputRefused : if there is no height at all, or it cannot be written.
    """
    found = relief(terrain)
    scale, offset = steps(found)
    with appearing(path) as folder:
        write_image(terrain, folder / path.name, found, progress)
        notes = {
            "height_of_grey": "z = offset + scale * grey",
            "scale_m": scale,
            "offset_m": offset,
            "largest_error_m": scale / 2,
            "no_value": 0 if found.missing else None,
        }
        (folder / f"{path.name}.json").write_text(json.dumps(facts(terrain, **notes), indent=2) + "\n")


def steps(found: Relief) -> tuple[float, float]:
    """Scale and offset [m] of z = offset + scale grey; a flat terrain has steps of 1 m, so that nothing is divided by zero."""
    lowest = 1 if found.missing else 0
    scale = (found.high - found.low) / (TOP - lowest) or 1.0
    return scale, found.low - lowest * scale


def write_image(terrain: Terrain, path: Path, found: Relief, progress: Progress | None) -> None:
    """The image alone (PNG, ISO/IEC 15948), compressed row by row."""
    scale, offset = steps(found)
    n_rows, n_cols = terrain.heights.shape
    with path.open("wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        _chunk(file, b"IHDR", struct.pack(">IIBBBBB", n_cols, n_rows, 16, 0, 0, 0, 0))
        packer = zlib.compressobj(6)
        above = np.zeros((1, 2 * n_cols), np.uint8)
        for _, block in strips(terrain, f"writing {path.name}", progress):
            grey = np.where(np.isnan(block), 0, np.clip(np.rint((block - offset) / scale), 0, TOP))
            data = np.ascontiguousarray(grey, ">u2").view(np.uint8).reshape(len(grey), -1)
            up = data - np.concatenate([above, data[:-1]])  # filter 2: difference to the row above, modulo 256
            rows = np.concatenate([np.full((len(up), 1), 2, np.uint8), up], axis=1)
            _chunk(file, b"IDAT", packer.compress(rows.tobytes()))
            above = data[-1:]
        _chunk(file, b"IDAT", packer.flush())
        _chunk(file, b"IEND", b"")


def _chunk(file: IO[bytes], kind: bytes, data: bytes) -> None:
    if data or kind == b"IEND":
        file.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))
