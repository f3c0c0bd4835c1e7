"""What building a model from CAD costs: from nothing, and again."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rille import cad
from rille.cad.collision.decompose import decompose

RILLE = Path(sys.executable).with_name("rille")


def measure_cad(sheet: Path) -> dict[str, float]:
    """Seconds of ``rille cad build`` with an empty cache and with a filled one, start included; and of a wheel's collision shape."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["RILLE_CACHE"] = f"{folder}/cache"
        command = [str(RILLE), "cad", "build", str(sheet), "-o", f"{folder}/model.db", "--json"]
        times = [_seconds(command) for _ in range(6)]
    first, again = times[0], min(times[1:])
    print(f"CAD: first build {first:.1f} s, unchanged rebuild {again:.2f} s (budget 1), {first / again:.0f} times as fast")
    assembly = cad.read_step(sheet.parent / "rover.step")
    shape = next(p.shape for p in assembly.prototypes if p.name.startswith("wheel"))
    start = time.perf_counter()
    made = decompose(shape, "symmetric")
    wheel = time.perf_counter() - start
    print(
        f"wheel of 24 grousers in {len(made.pieces)} convex pieces: {wheel:.2f} s (budget 2), volume ratio {made.volume_ratio:.3f} (1.1)\n"
    )
    return {
        "cad_first_build_s": first,
        "cad_unchanged_rebuild_s": again,
        "wheel_decomposition_s": wheel,
        "wheel_volume_ratio": float(made.volume_ratio),
    }


def _seconds(command: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - start
