"""How busy a study keeps the machine, and what a Dask cluster costs against processes.

Usage: python benchmark/sweep/bench.py [--cases 1000] [--workers 2] [--seconds 1]

So many short drives of the example rover on flat soft ground, by local processes and by a local Dask cluster of as many workers of one
thread. Busy: processor time of all workers over workers times the time from the first case to the last; says how much of the machine others
had (load before). Run it on a machine that does nothing else.
"""

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from distributed import LocalCluster

REPOSITORY = Path(__file__).resolve().parents[2]
RILLE = str(Path(sys.executable).parent / "rille")
SHEET = """
name = "bench"
model = "rover.db"
scenario = "drive.toml"
terrain = "slope.toml"
design = "latin_hypercube"
samples = {cases}
seed = 1

[[vary]]
name = "soil.lunar_soft.cohesion"
low = "50 Pa"
high = "1 kPa"

[[vary]]
name = "body.chassis.mass"
low = 0.7
high = 1.3
relative = true
"""


def study(folder: Path, cases: int, seconds: float) -> Path:
    """The example's model, ground and drive, shortened."""
    example = REPOSITORY / "examples/sweep"
    subprocess.run(
        [RILLE, "cad", "build", str(REPOSITORY / "examples/rover/rover.toml"), "-o", str(folder / "rover.db")],
        check=True,
        capture_output=True,
    )
    (folder / "slope.toml").write_text((example / "slope.toml").read_text())
    (folder / "drive.toml").write_text((example / "drive.toml").read_text().replace('"5 s"\nstep', f'"{seconds} s"\nstep'))
    path = folder / "study.toml"
    path.write_text(SHEET.format(cases=cases))
    return path


def children() -> float:
    """Processor time of all children that have ended [s]."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def swept(sheet: Path, output: Path, *options: str) -> tuple[float, float]:
    """Wall time and processor time of one sweep [s], program start included."""
    before, began = children(), time.perf_counter()
    subprocess.run([RILLE, "sweep", str(sheet), "-o", str(output), *options], check=True, capture_output=True)
    return time.perf_counter() - began, children() - before


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=1.0)
    options = parser.parse_args()
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        sheet = study(folder, options.cases, options.seconds)
        local, spent = swept(sheet, folder / "local.db", "--workers", str(options.workers))
        with LocalCluster(n_workers=options.workers, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster:
            dask, _ = swept(sheet, folder / "dask.db", "--scheduler", cluster.scheduler_address)
    found = {
        "machine": platform.processor() or platform.machine(),
        "load_before": load,
        "cases": options.cases,
        "simulated_s": options.seconds,
        "local_s": local,
        "busy": spent / (options.workers * local),
        "dask_s": dask,
        "dask_over_local": dask / local,
    }
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
