"""What recordings cost: import of many channels at 1 kHz, and a drive of the example rover compared with its own model."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

RILLE = Path(sys.executable).parent / "rille"
SENSORS = Path(__file__).parent.parent.parent / "examples/recording/sensors.toml"
CHANNELS, ROWS = 40, 1_000_000  # at 1 kHz
DRIVEN = 20.0  # [s]


def measure_recordings(model: Path) -> dict[str, float]:
    """Import with the data gate, program start included, and comparison, both against the time that was recorded."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        table = _table(folder)
        imported = _timed("import", table, "-o", folder / "import.db")
        _timed("record", model, "--sensors", SENSORS, "-o", folder / "drive.parquet", "--duration", DRIVEN)
        _timed("import", folder / "drive.toml", "-o", model)
        compared = _timed("compare", model)
    rate = CHANNELS * ROWS / imported
    print(f"{CHANNELS} channels of {ROWS / 1000:g} s at 1 kHz imported: {imported:.1f} s, {rate / 1e6:.2f} million samples/s (budget 2.4)")
    print(
        f"{DRIVEN:g} s of the rover with 34 channels compared with its model: {compared:.1f} s, {compared / DRIVEN:.2f} times the recording"
    )
    return {"import_samples_per_s": rate, "compare_over_recorded_time": compared / DRIVEN}


def _timed(*words: object) -> float:
    start = time.perf_counter()
    done = subprocess.run([str(RILLE), *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(done.stderr)
    return time.perf_counter() - start


def _table(folder: Path) -> Path:
    """Angles and rates of joints that swing at random frequencies, with noise, and the manifest of the table."""
    random = np.random.default_rng(1)
    t = np.arange(ROWS) * 1e-3
    columns, lines = {"time": t}, ['name = "table"', 'file = "table.parquet"', "[time]", 'column = "time"', 'unit = "s"']
    for k in range(CHANNELS // 2):
        pace, phase = random.uniform(0.5, 8), random.uniform(0, 6)
        angle, rate = np.sin(pace * t + phase), pace * np.cos(pace * t + phase)
        for name, value, unit in (("position", angle, "rad"), ("velocity", rate, "rad/s")):
            columns[f"{name}{k}"] = value + random.normal(0, 1e-3, ROWS)
            lines += ["[[channel]]", f'column = "{name}{k}"', f'quantity = "joint.{name}"', f'target = "joint{k}"', f'unit = "{unit}"']
            lines += ['role = "observed"']
    pq.write_table(pa.table(columns), folder / "table.parquet")
    manifest = folder / "table.toml"
    manifest.write_text("\n".join(lines) + "\n")
    return manifest
