"""Question: how do 603 windows of drives, kept as arrays, become a table that can be imported?

Writes ``out/husky/drives.parquet``: one row per sample, with the number of its window.

    .venv/bin/python examples/husky/make_table.py
"""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rille.model.sheet import expand

HERE = Path(__file__).parent
OUT = HERE.parents[1] / "out/husky/drives.parquet"
SOURCE = "${RILLE_DATA}/data/recordings/husky_drive_windows.npz"
CHANNELS = ("cmd_left", "cmd_right", "left_wheel_vel", "right_wheel_vel", "icp_x", "icp_y", "icp_yaw", "imu_yaw")


def table(path: Path) -> pa.Table:
    """The windows (n, samples) one below the other; ``steady`` is 1 where the makers judged that the drive had settled."""
    with np.load(path) as arrays:
        n_windows, n_samples = arrays["cmd_left"].shape
        columns = {
            "window": np.repeat(np.arange(n_windows), n_samples),
            "time": np.tile(np.arange(n_samples) * float(arrays["dt"]), n_windows),
            "steady": np.repeat(arrays["steady_state_mask"].astype(np.int64), n_samples),
        }
        return pa.table(columns | {name: arrays[name].ravel() for name in CHANNELS})


if __name__ == "__main__":
    OUT.parent.mkdir(parents=True, exist_ok=True)
    rows = table(expand(SOURCE, HERE))
    pq.write_table(rows, OUT, compression="zstd")
    print(f"wrote {rows.num_rows} rows to {OUT}")
