"""NPY: float64 heights for numpy, with a JSON sidecar."""

import json
from pathlib import Path

import numpy as np

from rille.model import Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.strips import Progress, facts, strips


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Heights z in W as an array (n_rows, n_cols) of little-endian float64, row 0 north, NaN = no value; facts in ``NAME.npy.json``.

    Raises
    ------
    InputRefused : if it cannot be written.
    """
    with appearing(path) as folder:
        with (folder / path.name).open("wb") as file:
            header = {"descr": "<f8", "fortran_order": False, "shape": tuple(terrain.heights.shape)}
            np.lib.format.write_array_header_1_0(file, header)
            for _, block in strips(terrain, f"writing {path.name}", progress):
                file.write(np.ascontiguousarray(block, "<f8").tobytes())
        (folder / f"{path.name}.json").write_text(json.dumps(facts(terrain, no_value="NaN"), indent=2) + "\n")
