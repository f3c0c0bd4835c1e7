"""How busy a study keeps the machine, and what a Dask cluster costs against processes.

Usage: python benchmark/sweep/bench.py [--cases 1000] [--workers 2] [--seconds 1]

So many short drives of the example rover on flat soft ground, by local processes and by a local Dask cluster of as many workers of one
thread. Busy: processor time of the workers over workers times real time, both from the first results that are stored to the last look at
which cases were waiting; cores: the same with the process that writes their results down, as many cores as workers; whole: the same of the
whole program, its start and the statistics at its end included. Says how much of the machine others had (load before). Run it on a machine
that does nothing else.
"""

import argparse
import contextlib
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil
from distributed import LocalCluster

from rille import store
from rille.model import InputRefused

REPOSITORY = Path(__file__).resolve().parents[2]
RILLE = str(Path(sys.executable).parent / "rille")
LOOK = 1.0  # [s] between looks at a sweep: looking costs, too
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


def spent_by(processes: Sequence[psutil.Process]) -> float:
    """Processor time of processes [s]."""
    return sum(times.user + times.system for times in (process.cpu_times() for process in processes))


@dataclass
class Swept:
    """Wall time and processor time [s] of one sweep, program start included; busy, cores: shares of the workers' time that they used,
    and that they and the sweep used, NaN of a cluster.
    """

    seconds: float
    processor: float
    busy: float
    cores: float


def swept(sheet: Path, output: Path, workers: int, *options: str) -> Swept:
    """Run a sweep and look at its workers meanwhile."""
    before, began = children(), time.perf_counter()
    process = subprocess.Popen(
        [RILLE, "sweep", str(sheet), "-o", str(output), *options], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    seen: list[tuple[float, float, float]] = []  # real time, processor time of workers and of the sweep [s], while cases wait
    while process.poll() is None:
        time.sleep(LOOK)
        with contextlib.suppress(InputRefused, psutil.NoSuchProcess):
            waiting = len(store.waiting_cases(output))
            if 0 < waiting < len(store.read_study(output).status):
                own = psutil.Process(process.pid)
                workers_own = [child for child in own.children() if "spawn_main" in " ".join(child.cmdline())]
                seen.append((time.perf_counter(), spent_by(workers_own), spent_by([own])))
    if process.returncode:
        raise SystemExit(f"the sweep ended with {process.returncode}")
    took = time.perf_counter() - began
    busy = cores = float("nan")
    if len(seen) > 1 and seen[-1][1] > seen[0][1]:
        passed, by_workers, by_sweep = (last - first for first, last in zip(seen[0], seen[-1], strict=True))
        busy, cores = by_workers / (workers * passed), (by_workers + by_sweep) / (workers * passed)
    return Swept(took, children() - before, busy, cores)


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
        local = swept(sheet, folder / "local.db", options.workers, "--workers", str(options.workers))
        with LocalCluster(n_workers=options.workers, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster:
            dask = swept(sheet, folder / "dask.db", options.workers, "--scheduler", cluster.scheduler_address)
    found = {
        "machine": platform.processor() or platform.machine(),
        "load_before": load,
        "cases": options.cases,
        "simulated_s": options.seconds,
        "local_s": local.seconds,
        "busy": local.busy,
        "cores": local.cores,
        "whole": local.processor / (options.workers * local.seconds),
        "dask_s": dask.seconds,
        "dask_over_local": dask.seconds / local.seconds,
    }
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
