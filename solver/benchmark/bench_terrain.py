"""What composing terrain costs: 100 000 craters on 10 000 x 10 000 heights, and moving one landform among them.

python bench_terrain.py        prints the section that bench.py holds
python bench_terrain.py SCENE  builds that scene and prints its seconds and peak memory; the benchmark calls it so, to measure memory
"""

import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from rille import terrain
from rille.model import Population
from rille.terrain.composition import Composition
from rille.terrain.grid import Grid, Window
from rille.terrain.scene import composed
from rille.terrain.stamping import stamp
from rille.terrain.surface import Surface, evaluate

SIDE, POSTING = 10_000, 0.25  # values per side, [m]
CRATERS = 100_000
SMALLEST = math.sqrt(10**-1.1 * ((SIDE - 1) * POSTING) ** 2 / CRATERS)  # [m] Trask: so many are at least as large, 10^-1.1 D^-2 per m^2
NUMPY_SHARE = 20  # every so many of the craters are stamped with numpy
SCENE = """
name = "benchmark"
soil = "lunar_sourcebook"
base = {{ kind = "flat", size = [{size}, {size}], posting = {posting} }}

[[population]]
name = "craters"
landform = "crater"
law = "trask"
diameter = [{smallest}, 300.0]
count = {count}
region = [-{half}, -{half}, {half}, {half}]

[[landform]]
name = "moved"
landform = "crater"
x = {x}
y = 20.0
drivers = {{ diameter = "96 m" }}
"""


def measure_terrain() -> dict[str, float]:
    """Seconds to stamp in memory, beside numpy; to build the scene in tiles, with its peak memory; and to evaluate it after a move."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["RILLE_CACHE"] = f"{folder}/cache"
        scene = Path(folder) / "scene.toml"
        _write(scene, x=0.0)
        with composed(scene) as (read, composition, *_):
            found = _stamping(composition.grid, read.populations[0])
        child = subprocess.run([sys.executable, __file__, str(scene)], check=True, capture_output=True, text=True)
        built = json.loads(child.stdout)
        found |= {"terrain_build_s": built["build_s"], "terrain_peak_bytes": built["peak_bytes"]}
        print(
            f"the same scene read, drawn and evaluated in tiles into a file: {built['build_s']:.1f} s, "
            f"peak memory {built['peak_bytes'] / 1e9:.2f} GB (budget 1.5)"
        )
        return found | _moving(scene)


def _write(scene: Path, x: float) -> None:
    size = (SIDE - 1) * POSTING
    scene.write_text(SCENE.format(size=size, half=size / 2, posting=POSTING, smallest=SMALLEST, count=CRATERS, x=x))


def _stamping(grid: Grid, craters: Population) -> dict[str, float]:
    """All craters by the compiled loop on one and two threads; a share of them by the loop and by numpy."""
    landform = terrain.landforms()["crater"]
    heights = np.zeros(grid.shape)
    seconds = {1: np.inf, 2: np.inf}
    for threads in (2, 1, 2, 1):
        heights[:] = 0.0  # also touches the memory, which is not what is measured
        begin = time.perf_counter()
        stamp(heights, grid.whole, grid, landform, craters, threads=threads)
        seconds[threads] = min(seconds[threads], time.perf_counter() - begin)
    some = _every(craters, NUMPY_SHARE)
    heights[:] = 0.0
    stamp(heights, grid.whole, grid, landform, some, threads=2)
    begin = time.perf_counter()
    by_numpy = np.zeros(grid.shape)
    by_numpy[:] = 0.0
    empty = time.perf_counter() - begin
    _stamp_with_numpy(by_numpy, grid, some)
    numpy_seconds = (time.perf_counter() - begin - empty) * NUMPY_SHARE
    off = float(np.abs(heights - by_numpy).max())
    print(
        f"terrain: {CRATERS} craters on {SIDE} x {SIDE} heights: {seconds[2]:.2f} s on two threads (budget 5), {seconds[1]:.2f} s on one\n"
        f"numpy, crater by crater: {numpy_seconds:.1f} s (every {NUMPY_SHARE}th, scaled), {numpy_seconds / seconds[1]:.1f} times as long "
        f"as the compiled loop on one thread; largest difference {1e3 * off:.2g} mm"
    )
    return {"terrain_stamp_s": seconds[2], "terrain_stamp_one_thread_s": seconds[1], "terrain_stamp_numpy_s": numpy_seconds}


def _every(craters: Population, n: int) -> Population:
    """Every n-th crater, from the middle one of the first n on when sorted by size, so that the sum of areas is about that share."""
    chosen = np.argsort(craters.drivers["diameter"])[n // 2 :: n]
    return Population(
        name="some",
        landform=craters.landform,
        x=craters.x[chosen],
        y=craters.y[chosen],
        heading=craters.heading[chosen],
        drivers={name: values[chosen] for name, values in craters.drivers.items()},
    )


def _stamp_with_numpy(heights: np.ndarray, grid: Grid, craters: Population) -> None:
    """What one would write without a compiled loop: per crater, the profile on the window that it touches."""
    profile = terrain.landforms()["crater"].profile
    for k in range(len(craters.x)):
        drivers = {name: float(values[k]) for name, values in craters.drivers.items()}
        half = 0.75 * drivers["diameter"]
        window = grid.around(craters.x[k], craters.y[k], half, half, 0.0)
        if not window.empty:
            x, y = grid.axes(window)
            heights[window.slices] += profile(x[None, :] - craters.x[k], y[:, None] - craters.y[k], drivers)


def _moving(scene: Path) -> dict[str, float]:
    """Seconds to evaluate the scene again after a crater of 96 m was moved by 10 m, several times; and all that a build does then."""
    evaluations, builds = [], []
    for x in (10.0, 20.0, 30.0, 40.0):
        _write(scene, x=x)
        begin = time.perf_counter()
        with composed(scene) as (_, composition, store, datums):
            ready = time.perf_counter()
            heights = evaluate(composition, store, datums)
            evaluations.append(time.perf_counter() - ready)
            builds.append(time.perf_counter() - begin)
            _require_right(composition, heights)
        del heights  # as long as a surface is read, another evaluation of its scene starts from nothing
    least, build = min(evaluations), min(builds)
    print(f"one crater moved by 10 m: rendered again in {1e3 * least:.0f} ms (budget 100); with the scene read and drawn, {build:.2f} s\n")
    return {"terrain_move_s": least, "terrain_move_build_s": build}


def _require_right(composition: Composition, heights: Surface) -> None:
    """The benchmark must not measure what does not happen."""
    window = Window(row0=4700, row1=5300, col0=4700, col1=5400)
    if not np.array_equal(heights[window.slices], composition.render(composition.grid, window)):
        raise SystemExit("the benchmark's terrain was not evaluated again where it changed")


def _build(scene: Path) -> None:
    """Build a scene; print its seconds and the peak memory of this process.

    VmHWM counts from the start of this program; ru_maxrss would count the parent's memory, too.
    """
    begin = time.perf_counter()
    terrain.build(scene)
    seconds = time.perf_counter() - begin
    peak = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    print(json.dumps({"build_s": seconds, "peak_bytes": int(peak.split()[1]) * 1024}))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        _build(Path(sys.argv[1]))
    else:
        measure_terrain()
