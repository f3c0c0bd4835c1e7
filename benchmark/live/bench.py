"""How quick and how steady a live session is: round trips, frames, memory.

Usage: python benchmark/live/bench.py [--viewers 10] [--minutes 10]

A server of its own on loopback, so many viewers that take every frame, and a commander that steers ten times a second. Prints one line a
minute, then round trips of commands [ms] at 60 frames/s, frames per second of each viewer, simulated per real time, and what the server's
memory (VmRSS) grew from the end of the first minute on.
"""

import argparse
import json
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from rille.live.client import Client

REPOSITORY = Path(__file__).resolve().parents[2]
RILLE = str(Path(sys.executable).parent / "rille")


def model(folder: Path) -> Path:
    """The example rover on its composed terrain."""
    path = folder / "rover.db"
    for words in (("cad", "build", "examples/rover/rover.toml"), ("terrain", "build", "examples/terrain/composed.toml")):
        subprocess.run([RILLE, *words, "-o", str(path)], cwd=REPOSITORY, check=True, capture_output=True)
    return path


def memory(process: int) -> float:
    """Resident memory of a process [MB]."""
    for line in Path(f"/proc/{process}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return float("nan")


def processor_time(process: int) -> float:
    """Processor time of a process [s]."""
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / 100


def measure(address: str, process: int, viewers: int, minutes: float) -> dict:
    """Steer for so long, and say what was seen."""
    with Client(address, "bench") as rover:
        others = [Client(address, f"viewer-{k}") for k in range(viewers)]
        rover.take()
        rover.start()
        trips: list[float] = []
        sizes: list[float] = []
        frames = [other.frames for other in others]
        began, simulated, spent = time.perf_counter(), rover.time, processor_time(process)
        following = began + 60
        while (now := time.perf_counter()) < began + 60 * minutes:
            rover.steer(0.05, 0.15)  # a circle: it stays on its terrain however long it takes
            trips.append(time.perf_counter() - now)
            if now >= following:
                following += 60
                sizes.append(memory(process))
                print(f"{(now - began) / 60:.0f} min: {sizes[-1]:.1f} MB, round trip {1e3 * np.median(trips[-500:]):.2f} ms", flush=True)
            time.sleep(max(0.0, 0.1 - (time.perf_counter() - now)))
        wall = time.perf_counter() - began
        milliseconds = 1e3 * np.array(trips)
        rates = [(other.frames - before) / wall for other, before in zip(others, frames, strict=True)]
        found = {
            "viewers": viewers,
            "minutes": wall / 60,
            "round_trip_median_ms": float(np.median(milliseconds)),
            "round_trip_99_percent_ms": float(np.percentile(milliseconds, 99)),
            "round_trip_largest_ms": float(milliseconds.max()),
            "frames_per_second": [min(rates), max(rates)] if rates else [],
            "simulated_per_real_time": (rover.time - simulated) / wall,
            "processor_share": (processor_time(process) - spent) / wall,
            "memory_mb": sizes,
            "growth_mb": sizes[-1] - sizes[0] if len(sizes) > 1 else None,
        }
        for other in others:
            other.close()
    return found


def main() -> None:
    """Measure, print, exit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--viewers", type=int, default=10)
    parser.add_argument("--minutes", type=float, default=1.0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = model(Path(folder))
        scenario = REPOSITORY / "examples/first_drive/traverse.toml"
        command = [RILLE, "serve", str(path), "--scenario", str(scenario), "--port", "0"]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert server.stdout is not None
        try:
            address = server.stdout.readline().strip()
            patience = time.monotonic() + 60
            while True:
                try:
                    Client(address, "knock").close()
                    break
                except Exception:
                    if time.monotonic() > patience:
                        raise
                    time.sleep(0.2)
            found = measure(address, server.pid, options.viewers, options.minutes)
        finally:
            server.terminate()
            server.wait(30)
    print(json.dumps({"machine": platform.processor() or platform.machine(), **found}, indent=1))


if __name__ == "__main__":
    main()
