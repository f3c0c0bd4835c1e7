"""Question: can a Husky tell from its motor currents and its shaking where the ground under it changes?

Runs of one terrain after the other (BorealTC, CC0: asphalt, flooring, ice, sandy loam, snow) are put in a row; ``find_changes`` is told
neither how many grounds there are nor where. There is no position in these recordings: slip cannot be known, only what the drive costs.

    .venv/bin/python examples/husky/ground_changes.py [--orders 10]
"""

import argparse
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from rille.diagnosis.pushes.changes import Change, find_changes
from rille.model.sheet import expand

HERE = Path(__file__).parent
SOURCE = "${{RILLE_DATA}}/data/recordings/husky_terrain_{}.parquet"
LONGEST, SHORTEST = 60.0, 15.0  # [s] of a run that is used; shorter runs are not
NEAR = 12.0  # [s] three blocks: so near counts as located


def columns(name: str) -> dict[str, np.ndarray]:
    """A table by column."""
    table = pq.read_table(expand(SOURCE.format(name), HERE))
    return {column: table[column].to_numpy() for column in table.column_names}


def drives(wheels: dict[str, np.ndarray], imu: dict[str, np.ndarray], terrain: str) -> list[np.ndarray]:
    """Runs on a terrain: time [s], currents [A] and speeds [m/s] left and right, logarithms of the shaking up and about the roll axis."""
    found = []
    of_terrain = wheels["terrain"] == terrain
    for run in np.unique(wheels["run"][of_terrain]):
        here = of_terrain & (wheels["run"] == run) & (wheels["time"] < LONGEST)
        there = (imu["terrain"] == terrain) & (imu["run"] == run)
        time = wheels["time"][here].astype(float)
        if len(time) == 0 or time[-1] < SHORTEST or there.sum() < 8:
            continue
        rolling = np.convolve(np.abs(np.diff(imu["wx"][there], prepend=imu["wx"][there][0])), np.full(7, 1 / 7), "same")
        shaking = (np.log(imu["az_std"][there] + 0.05), np.log(rolling + 0.01))
        found.append(
            np.column_stack(
                [
                    time,
                    *(wheels[c][here] for c in ("curL", "curR", "velL", "velR")),
                    *(np.interp(time, imu["time"][there], s) for s in shaking),
                ]
            )
        )
    return found


def conditions(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """What the machine does: sizes and directions of driving and turning, and how fast they change."""
    mean, turn = 0.5 * (left + right), right - left
    return np.column_stack(
        [
            *(part for v in (mean, turn) for part in (np.abs(v), np.tanh(np.abs(v) / 0.03), np.tanh(v / 0.05))),
            *(np.abs(np.gradient(v)) for v in (mean, turn)),
        ]
    )


def in_a_row(runs: dict[str, list[np.ndarray]], order: list[str]) -> tuple[np.ndarray, list[float]]:
    """All runs of one terrain after those of the other, and the times [s] at which the terrain changes."""
    rows, ends, now = [], [], 0.0
    for terrain in order:
        for run in runs[terrain]:
            rows.append(np.column_stack([run[:, 0] - run[0, 0] + now, run[:, 1:]]))
            now = float(rows[-1][-1, 0]) + 0.15
        ends.append(now)
    return np.concatenate(rows), ends[:-1]


def changes_of(rows: np.ndarray) -> tuple[Change, ...]:
    """Where the ground changes, from rows as of ``in_a_row``."""
    return find_changes(rows[:, 0], rows[:, [1, 2, 5, 6]], conditions(rows[:, 3], rows[:, 4]))


def main(orders: int) -> None:
    """Several orders of the terrains, drawn at random; prints where each change was located."""
    wheels, imu = columns("wheel_current"), columns("imu")
    names = sorted(np.unique(wheels["terrain"]).tolist())
    runs = {name: drives(wheels, imu, name) for name in names}
    rng = np.random.default_rng(0)
    located = wanted = others = 0
    for _ in range(orders):
        order = [names[k] for k in rng.permutation(len(names))]
        rows, truth = in_a_row(runs, order)
        found = sorted(changes_of(rows), key=lambda change: -change.gain)
        print(f"{' -> '.join(order)}, {rows[-1, 0] / 60:.0f} min")
        for at, before, after in zip(truth, order[:-1], order[1:], strict=True):
            nearest = min((abs(change.time - at), change) for change in found)[1] if found else None
            hit = nearest is not None and abs(nearest.time - at) <= NEAR
            located, wanted = located + hit, wanted + 1
            said = f"found at {nearest.time:.0f} s, {nearest.gain:.0f} nats" if hit and nearest is not None else "not found"
            print(f"  {before} -> {after} at {at:.0f} s: {said}")
        strange = [change for change in found if min(abs(change.time - at) for at in truth) > NEAR]
        others += len(strange)
        inside = [order[int(np.searchsorted(truth, change.time))] for change in strange]
        print("  others: " + (", ".join(f"{c.time:.0f} s in {t} ({c.gain:.0f})" for c, t in zip(strange, inside, strict=True)) or "none"))
    print(f"{located} of {wanted} changes of the terrain located within {NEAR:.0f} s; {others} others")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--orders", type=int, default=10)
    main(parser.parse_args().orders)
