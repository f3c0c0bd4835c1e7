"""``make bench``: speed of the example rover, and what a larger step costs in truth.

Prints steps per second at 1 kHz, the real-time factor at 0.25, 0.5, 1, 2 and 5 ms, and how far mean drawbar pull, drive torque and path are
from those of the finest step. Times are taken in process, without storing results, on the composed terrain. The result is
appended to ``results/<machine>.csv`` only on request (``--save``).
"""

import argparse
import csv
import datetime
import platform
import re
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from rille._solver import Simulation

from rille import cad, store, terrain
from rille.simulate import read_scenario_file

HERE = Path(__file__).parent
EXAMPLES = HERE.parent.parent / "examples"
STEPS = (0.25e-3, 0.5e-3, 1e-3, 2e-3, 5e-3)  # [s]
SIMULATED = 60.0  # [s]


def processor() -> str:
    """Name of the processor."""
    found = re.search(r"model name\s*:\s*(.*)", Path("/proc/cpuinfo").read_text()) if Path("/proc/cpuinfo").is_file() else None
    return found.group(1).strip() if found else platform.processor() or platform.machine()


def make_model(folder: Path) -> Path:
    """The demo's model."""
    rover = cad.build(EXAMPLES / "rover/rover.toml")
    path = folder / "rover.db"
    store.create(path)
    store.write_rover(path, rover)
    store.write_terrain(path, terrain.build(EXAMPLES / "terrain/composed.toml"))
    modes = {drive.name: drive.mode for drive in rover.drives}
    store.write_scenario(path, read_scenario_file(EXAMPLES / "first_drive/traverse.toml", modes))
    return path


def drive(path: Path, step: float) -> dict[str, float]:
    """60 s of the traverse at a step: speed, and means over time sampled every 50 ms."""
    simulation = Simulation(str(path), step=step)
    simulation.settle()
    stride = round(0.05 / step)
    pulls, torques, wall = [], [], 0.0
    for _ in range(round(SIMULATED / 0.05)):
        begin = time.perf_counter()
        outcome = simulation.step(stride)
        wall += time.perf_counter() - begin
        if outcome != "running":
            raise SystemExit(f"the benchmark's drive ended early: {simulation.message}")
        wheels = simulation.wheels()
        pulls.append(np.abs(wheels[:, 8]).mean())
        torques.append(wheels[:, 10].mean())
    end = simulation.bodies()[0, :3]
    return {
        "step_ms": 1e3 * step,
        "steps_per_s": SIMULATED / step / wall,
        "real_time_factor": SIMULATED / wall,
        "pull": float(np.mean(pulls)),
        "torque": float(np.mean(torques)),
        "x": float(end[0]),
        "y": float(end[1]),
    }


def main() -> None:
    """Measure, print, save if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--save", action="store_true", help="append the result to results/<machine>.csv")
    save = parser.parse_args().save
    with tempfile.TemporaryDirectory() as folder:
        path = make_model(Path(folder))
        drive(path, 5e-3)  # warm caches
        rows = [drive(path, step) for step in STEPS]
    finest = rows[0]
    print(f"{processor()}, one core, six wheels on Wong-Reece soil, 20 degrees of freedom, {SIMULATED:g} s of the demo's traverse\n")
    print(f"{'step [ms]':>9} {'steps/s':>10} {'real-time factor':>17} {'mean |pull|':>13} {'mean torque':>13} {'end of path':>13}")
    for row in rows:
        off = np.hypot(row["x"] - finest["x"], row["y"] - finest["y"])
        row["pull_change"] = row["pull"] / finest["pull"] - 1
        row["torque_change"] = row["torque"] / finest["torque"] - 1
        row["path_change_m"] = float(off)
        print(
            f"{row['step_ms']:9g} {row['steps_per_s']:10.0f} {row['real_time_factor']:17.1f} {100 * row['pull_change']:+11.2f} % "
            f"{100 * row['torque_change']:+11.2f} % {1e3 * off:10.1f} mm"
        )
    print("\nchanges are against the finest step; target: 25 000 steps/s at 1 ms on one core")
    if save:
        _save(rows)


def _save(rows: list[dict[str, float]]) -> None:
    folder = HERE / "results"
    folder.mkdir(exist_ok=True)
    name = re.sub(r"\W+", "_", processor().lower()).strip("_")
    file = folder / f"{name}.csv"
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, cwd=HERE, check=False).stdout.strip()
    columns = ["step_ms", "steps_per_s", "real_time_factor", "pull_change", "torque_change", "path_change_m"]
    fresh = not file.exists()
    with file.open("a", newline="") as out:
        writer = csv.writer(out)
        if fresh:
            writer.writerow(["date", "commit", *columns])
        for row in rows:
            writer.writerow([datetime.date.today().isoformat(), commit, *(f"{row[c]:.6g}" for c in columns)])
    print(f"saved to {file}")


if __name__ == "__main__":
    main()
