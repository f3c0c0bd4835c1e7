"""Question: are short pushes found that nobody told of?

Finds the torque pulses of the disturbed runs after learning from clean runs only, and scores them against the truth file, which nothing
else may read. A pulse counts as found if joint and sign are right and its peak lies within 0.15 s; each truth counts once.

    .venv/bin/python examples/double_pendulum/score_pulses.py pendulum.db                 # learn from all clean runs
    .venv/bin/python examples/double_pendulum/score_pulses.py pendulum.db --learn first   # from the first five of each kind; others test

Into ``pendulum.db`` acrobot.toml, pendubot.toml, sysid.toml and disturbed.toml must have been imported.
"""

import argparse
import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rille import store
from rille.diagnosis.pushes.pushes import PushCalibration, calibrate_pushes, find_pushes
from rille.model.diagnosis import Transient
from rille.model.recording import Recording
from rille.model.sheet import expand
from rille.simulate import Replayer

HERE = Path(__file__).parent
TRUTH = "${RILLE_DATA}/data/recordings/double_pendulum_acrobot_disturbed_truth.csv"
NEAR = 0.15  # [s]
JOINTS = ("shoulder", "elbow")
DELAYS = {"shoulder": 0.0070, "elbow": 0.0092}  # [s] as the gate finds them in the clean runs, and as disturbed.toml states them


def runs(database: Path, manifest: str) -> list[Recording]:
    """Recordings of a manifest in the order of their runs, commands late as the motors are."""
    names = [n for n in store.recording_names(database) if n.startswith(f"{manifest}/")]
    found = [store.read_recording(database, name) for name in sorted(names, key=lambda n: (len(n), n))]
    return [replace(r, channels=tuple(replace(c, delay=DELAYS[c.target]) if c.role == "command" else c for c in r.channels)) for r in found]


def learnt(database: Path, half: str) -> tuple[PushCalibration, list[Recording]]:
    """What the clean runs of a half (``first``, ``second`` or ``all``) teach, and the acrobot's and pendubot's others."""
    parts = {"first": (slice(0, 5), slice(5, None)), "second": (slice(5, None), slice(0, 5)), "all": (slice(None), slice(0, 0))}
    taken, left = parts[half]
    by_manifest = {manifest: runs(database, manifest) for manifest in ("acrobot", "pendubot", "sysid")}
    clean = [r for found in by_manifest.values() for r in found[taken]]
    others = [r for manifest in ("acrobot", "pendubot") for r in by_manifest[manifest][left]]
    return calibrate_pushes(Replayer(database), clean, store.effect_kinds()), others


@dataclass(frozen=True, slots=True, kw_only=True)
class Pulse:
    """One row of the truth file."""

    recording: str
    joint: str
    peak_time: float
    amplitude: float


def truth() -> list[Pulse]:
    """The pulses that were put in."""
    with expand(TRUTH, HERE).open(newline="") as file:
        return [
            Pulse(
                recording=f"disturbed/{int(float(row['exp']))}",
                joint=JOINTS[int(float(row["joint"])) - 1],
                peak_time=float(row["t_peak_s"]),
                amplitude=float(row["amp_Nm"]),
            )
            for row in csv.DictReader(file)
        ]


def matched(pulses: Sequence[Pulse], found: Sequence[Transient]) -> list[tuple[Pulse, Transient]]:
    """Pairs of a pulse and what was found of it, nearest first; none twice."""
    pairs = [
        (abs(p.peak_time - f.peak_time), p, f)
        for p in pulses
        for f in found
        if (p.recording, p.joint) == (f.recording, f.target) and p.amplitude * f.amplitude > 0 and abs(p.peak_time - f.peak_time) <= NEAR
    ]
    taken: list[tuple[Pulse, Transient]] = []
    for _, p, f in sorted(pairs, key=lambda row: row[0]):
        if all(p is not q and f is not g for q, g in taken):
            taken.append((p, f))
    return taken


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("database", type=Path)
    parser.add_argument("--learn", choices=("all", "first", "second"), default="all")
    options = parser.parse_args()
    calibration, others = learnt(options.database, options.learn)
    found = find_pushes(Replayer(options.database), runs(options.database, "disturbed"), calibration)
    false_on_clean = find_pushes(Replayer(options.database), others, calibration)
    pulses = truth()
    pairs = matched(pulses, found)
    for f in found:
        hit = next((p for p, g in pairs if g is f), None)
        beside = f"true {hit.amplitude:+.2f} N m at {hit.peak_time:.2f} s" if hit else "false"
        size = f"{f.amplitude:+.2f} +- {f.amplitude_error:.2f} N m"
        print(f"{f.recording:12} {f.target:8} {f.peak_time:5.2f} s {size}  score {f.score:5.1f}  {beside}")
    for p in pulses:
        if all(p is not q for q, _ in pairs):
            print(f"{p.recording:12} {p.joint:8} {p.peak_time:5.2f} s {p.amplitude:+.2f} N m  missed")
    print(f"found {len(pairs)} of {len(pulses)}; precision {len(pairs) / max(1, len(found)):.2f}")
    print(f"false on {len(others)} clean runs that nothing was learned from: {len(false_on_clean)}")
    if pairs:
        late = np.array([f.peak_time - p.peak_time for p, f in pairs])
        ratio = np.array([f.amplitude / p.amplitude for p, f in pairs])
        print(f"peak time off by {late.mean():+.3f} +- {late.std():.3f} s")
        print(f"amplitude over truth {np.median(ratio):.2f} ({ratio.min():.2f} to {ratio.max():.2f})")


if __name__ == "__main__":
    main()
