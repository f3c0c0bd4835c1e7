"""``make bench``: what rille costs, in times of one run on one machine, and what a larger step costs in truth.

    speed       steps per second of the demo's rover, and how far drawbar pull, drive torque and path are from those of the finest step
    sweep       one call of the bench: 3 laws x 4 loads x 17 slip ratios
    effects     time with each effect of the catalogue at its usual size against none; and with every one present at zero
    threads     two worlds on two threads against the same two on one
    cad         a model built from an empty cache, rebuilt unchanged; a wheel's collision shape
    recordings  import with the data gate; a drive compared with its own model
    terrain     100 000 craters on 10 000 x 10 000 heights: stamped in memory, beside numpy; in tiles into a file; after one landform moved

Every time is the least of several, taken in turns, so that what else the machine does strikes all alike. ``--save`` appends to
``results/<machine>.csv``.
"""

import argparse
import csv
import datetime
import platform
import re
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from bench_cad import measure_cad
from bench_recordings import measure_recordings
from bench_terrain import measure_terrain
from rille._solver import Model, Simulation, windows

from rille import cad, store, terrain
from rille.model import BenchWheel, Effect, EffectKind
from rille.simulate import bench, effect_rows, read_scenario_file

HERE = Path(__file__).parent
EXAMPLES = HERE.parent.parent / "examples"
STEPS = (0.25e-3, 0.5e-3, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3)  # [s]
SIMULATED = 60.0  # [s]
SAMPLING = 0.1  # [s]
CLOSE = 0.01  # change of drawbar pull and torque that counts as converged
LAWS = ("bekker", "bekker_wong", "reece")
LOADS = np.array([3.0, 5.0, 7.0, 20.0]) * 9.80665  # [N]
SLIPS = np.linspace(-0.8, 0.8, 17)
EFFECT_STEPS = 400

# What the catalogue cannot know: an expression needs a formula.
SPECIAL = {
    "expression": {
        "gain": 1.0,
        "formula": "-k*velocity",
        "output": "joint.effort",
        "target_kind": "joint",
        "constants": {"k": [0.1, "N m s/rad"]},
    },
}


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
    store.write_scenario(path, read_scenario_file(EXAMPLES / "first_drive/traverse.toml", rover.drive_units))
    return path


def least(times: int, *works: Callable[[], object]) -> list[float]:
    """Least wall time [s] of each work, all done in turns."""
    best = [np.inf] * len(works)
    for _ in range(times):
        for k, work in enumerate(works):
            begin = time.perf_counter()
            work()
            best[k] = min(best[k], time.perf_counter() - begin)
    return best


def drive(path: Path, step: float) -> dict[str, float]:
    """60 s of the traverse at a step: speed, and means over time."""
    simulation = Simulation(str(path), step=step)
    simulation.settle()
    stride = round(SAMPLING / step)
    pulls, torques, wall = [], [], 0.0
    for _ in range(round(SIMULATED / SAMPLING)):
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
        "steps_per_s": SIMULATED / step / wall,
        "real_time_factor": SIMULATED / wall,
        "pull": float(np.mean(pulls)),
        "torque": float(np.mean(torques)),
        "x": float(end[0]),
        "y": float(end[1]),
    }


def measure_speed(path: Path) -> dict[str, float]:
    """Table over steps; the fastest step whose drawbar pull and torque are within 1 % of the finest."""
    drive(path, 5e-3)  # warm caches
    rows = {step: drive(path, step) for step in STEPS}
    finest = rows[STEPS[0]]
    found: dict[str, float] = {}
    close_so_far = True
    print(f"{'step [ms]':>9} {'steps/s':>10} {'real-time factor':>17} {'mean |pull|':>13} {'mean torque':>13} {'end of path':>13}")
    for step, row in rows.items():
        off = float(np.hypot(row["x"] - finest["x"], row["y"] - finest["y"]))
        pull, torque = row["pull"] / finest["pull"] - 1, row["torque"] / finest["torque"] - 1
        print(
            f"{1e3 * step:9g} {row['steps_per_s']:10.0f} {row['real_time_factor']:17.1f} {100 * pull:+11.2f} % "
            f"{100 * torque:+11.2f} % {1e3 * off:10.1f} mm"
        )
        name = f"{1e3 * step:g}ms"
        found |= {f"steps_per_s_{name}": row["steps_per_s"], f"pull_change_{name}": pull, f"torque_change_{name}": torque}
        found |= {f"path_change_m_{name}": off}
        close_so_far = close_so_far and max(abs(pull), abs(torque)) < CLOSE
        if close_so_far:
            found |= {"largest_close_step_s": step, "real_time_factor_at_it": row["real_time_factor"]}
    print("changes are against the finest step; budget: 25 000 steps/s at 1 ms")
    print(
        f"real-time factor {found['real_time_factor_at_it']:.0f} at {1e3 * found['largest_close_step_s']:g} ms, the largest step with "
        "drawbar pull and torque within 1 % (budget 100)\n"
    )
    return found


def measure_sweep() -> dict[str, float]:
    """One sweep of the bench."""
    soil = terrain.soils()["lunar_sourcebook"]
    wheel = BenchWheel(radius=0.15, width=0.165)
    load, slip = (a.ravel() for a in np.meshgrid(LOADS, SLIPS))

    def sweep(threads: int) -> None:
        for law in LAWS:
            bench(law, soil, wheel, load=load, slip_ratio=slip, threads=threads)

    one, two = least(7, lambda: sweep(1), lambda: sweep(2))
    print(
        f"sweep of {len(LAWS)} laws x {LOADS.size} loads x {SLIPS.size} slips: {1e3 * one:.1f} ms on one core, "
        f"{1e3 * two:.1f} ms on two (budget 50)\n"
    )
    return {"sweep_s": one, "sweep_two_threads_s": two}


def effect_of(kind: EffectKind, scale: float) -> Effect:
    """The effect at ``scale`` times its usual amplitude, on every wheel, joint or sensor, or on the chassis."""
    amplitudes = {p.name for p in kind.parameters if p.amplitude}
    usual = SPECIAL.get(kind.name) or {p.name: p.typical for p in kind.parameters if p.amplitude}
    target = "chassis" if kind.target == "body" else "*"
    return Effect(kind=kind.name, target=target, parameters={k: v * scale if k in amplitudes else v for k, v in usual.items()})  # type: ignore[operator]


def measure_effects(path: Path) -> dict[str, float]:
    """Ratio of times with and without each effect, on wheels, joints, bodies and sensors of the demo while it drives."""
    kinds = store.effect_kinds()
    base = Model(str(path))
    start = Simulation(base)
    start.settle()
    start.step(4000)
    motion = start.motion()[0]

    def simulation(effects: list[Effect]) -> Simulation:
        model = base.copy()
        model.set_effects(effect_rows(effects, kinds))
        made = Simulation(model)
        made.start_at(motion)
        made.step(50)
        return made

    def ratio(effects: list[Effect]) -> float:
        with_it, without = simulation(effects), simulation([])
        timed, bare = least(15, lambda: with_it.step(EFFECT_STEPS), lambda: without.step(EFFECT_STEPS))
        return timed / bare

    off = ratio([effect_of(kind, 0.0) for kind in kinds])
    cost = {kind.name: ratio([effect_of(kind, 1.0)]) for kind in kinds}
    dearest = sorted(cost, key=lambda name: -cost[name])
    print(f"effects, time against none: all at zero {off:.3f}; " + ", ".join(f"{name} {cost[name]:.3f}" for name in dearest[:6]))
    print(f"{sum(value < 1.05 for value in cost.values())} of {len(cost)} cost less than 5 % (budget: all)\n")
    return {"effects_all_at_zero": off} | {f"effect_{name}": value for name, value in cost.items()}


def measure_threads(path: Path) -> dict[str, float]:
    """Two worlds on two threads against the same two on one."""
    model = Model(str(path))
    simulation = Simulation(model)
    simulation.settle()
    simulation.step(4000)
    motion = simulation.motion()
    channels = [("part.position", simulation.body_names[0], 0)]
    one, two = least(5, *(lambda n=n: windows([model, model], motion, 10000, 100, channels, threads=n) for n in (1, 2)))
    print(f"two worlds on two threads: {one / two:.2f} times as fast as on one (budget 1.8)")
    return {"two_threads_speedup": one / two}


def main() -> None:
    """Measure, print, save if asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", action="store_true", help="append the result to results/<machine>.csv")
    save = parser.parse_args().save
    print(f"{processor()}, one core; six wheels on Wong-Reece soil, 20 degrees of freedom, {SIMULATED:g} s of the demo's traverse\n")
    with tempfile.TemporaryDirectory() as folder:
        path = make_model(Path(folder))
        found = measure_speed(path) | measure_sweep() | measure_effects(path) | measure_threads(path) | measure_recordings(path)
    found |= measure_cad(EXAMPLES / "rover" / "rover.toml") | measure_terrain()
    if save:
        _save(found)


def _save(found: dict[str, float]) -> None:
    folder = HERE / "results"
    folder.mkdir(exist_ok=True)
    file = folder / (re.sub(r"\W+", "_", processor().lower()).strip("_") + ".csv")
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, cwd=HERE, check=False).stdout.strip()
    fresh = not file.exists()
    with file.open("a", newline="") as out:
        writer = csv.writer(out)
        if fresh:
            writer.writerow(["date", "commit", "measure", "value"])
        writer.writerows([datetime.date.today().isoformat(), commit, name, f"{value:.6g}"] for name, value in found.items())
    print(f"saved to {file}")


if __name__ == "__main__":
    main()
