"""Question: which of the 603 windows show a turn that had settled, with a pose that did not stand still?

Prints names of recordings of ``turning.toml``: sixteen to learn from and eight to hold out.

    .venv/bin/python examples/husky/steady_turns.py
"""

from pathlib import Path

import numpy as np

from rille.model.sheet import expand

HERE = Path(__file__).parent
SOURCE = "${RILLE_DATA}/data/recordings/husky_drive_windows.npz"
RADIUS, LEAST_TURN, LONGEST_HOLD = 0.165, 0.8, 0.3  # [m]; [m] way of one side before the other; [s] that a pose may stay


def longest_hold(values: np.ndarray, step: float) -> float:
    """Longest time [s] for which a series stays as it is."""
    changes = np.flatnonzero(np.abs(np.diff(values)) > 1e-9)
    return float(np.max(np.diff(np.r_[-1, changes, len(values) - 1]) - 1)) * step


def steady_turns() -> tuple[list[int], list[int]]:
    """Numbers of windows to learn from and to hold out, evenly along the 603."""
    with np.load(expand(SOURCE, HERE)) as arrays:
        step = float(arrays["dt"])
        ahead = (
            np.abs((arrays["right_wheel_vel"] - arrays["left_wheel_vel"]).mean(axis=1)) * RADIUS * step * (arrays["icp_yaw"].shape[1] - 1)
        )
        hold = np.array([longest_hold(row, step) for row in arrays["icp_yaw"]])
        good = np.flatnonzero(arrays["steady_state_mask"].astype(bool) & (ahead > LEAST_TURN) & (hold < LONGEST_HOLD)).tolist()
    learn = good[:: len(good) // 16][:16]
    return learn, [k for k in good[len(good) // 32 :: len(good) // 8][:8] if k not in learn]


if __name__ == "__main__":
    learn, aside = steady_turns()
    print(" ".join([*(f"turning/{k}" for k in learn), *(f"--held-out turning/{k}" for k in aside)]))
