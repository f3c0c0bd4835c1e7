"""How far generator and solver are apart with nothing concealed: the whole maneuver in one go, no noise."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rille.proof.trials import Drawn

DRAWS = 3  # machines with a maneuver each
FINER = 0.025  # step of the solver, of the model's: what is compared is two descriptions, not two steps
FIRST = 1_000_000  # number of the first: no trial has it
ROUNDED = 12**-0.5  # 1 sigma of a value that is rounded, of its resolution


def agreements(asked: Sequence[tuple[str, str, int]]) -> list[tuple[str, float]]:
    """``agreement`` of several (beacon, machine, draw)."""
    return [agreement(*one) for one in asked]


def agreement(beacon: str, machine: str, draw: int) -> tuple[str, float]:
    """The machine, and the root mean square difference of the channel that differs most, in units of its sensor's noise."""
    from rille import store
    from rille.proof.generator.strange_laws import strange_kinds
    from rille.proof.trials import Drawn, Trial

    trial = Trial(number=FIRST + draw, sort="nothing", machine=machine, strength=0.0, beacon=beacon)
    differences = channel_differences(Drawn(trial, store.effect_kinds(), strange_kinds()))
    return machine, max(differences.values())


def channel_differences(drawn: "Drawn") -> dict[str, float]:
    """Channel -> root mean square difference in units of the sensor's noise, over the maneuver of the first recording."""
    return _of_points(drawn) if drawn.machine.kind == "points" else _over_time(drawn)


def _over_time(drawn: "Drawn") -> dict[str, float]:
    import numpy as np

    from rille import store
    from rille.cli.prove_making import write_model
    from rille.proof.generator import simulate
    from rille.proof.sensors import readings, sampling
    from rille.simulate.recorder import Wanted, record

    sensors, scenario, machine = drawn.sensors, drawn.scenarios[0], drawn.machine
    assert sensors is not None
    asked = readings(sensors, sampling(sensors, scenario.duration, seed=0))
    made = simulate(machine, scenario, [], asked)
    wanted = [
        Wanted(quantity=r.quantity, target=r.target, components=(r.component,) if r.component else (), frame=r.frame, times=r.times)
        for r in asked
    ]
    with tempfile.TemporaryDirectory(prefix="rille-agreement-") as place:
        path = Path(place) / "model.db"
        write_model(drawn, path)
        taken = record(path, scenario, store.read_rover(path), wanted, step=scenario.step * FINER)
    found = {}
    for sensor, mine, its in zip(sensors.sensors, made, taken.values, strict=True):
        off = mine - its[:, 0]
        if sensor.component in ("roll", "yaw"):
            off = (off + np.pi) % (2 * np.pi) - np.pi
        found[sensor.channel] = float(np.sqrt(np.mean(off**2))) / (sensor.noise or sensor.resolution * ROUNDED)
    return found


def _of_points(drawn: "Drawn") -> dict[str, float]:
    """The largest of the wheels and speeds that the recordings have."""
    import numpy as np

    from rille import simulate
    from rille.proof.generator.wheel_bench import bench_points
    from rille.proof.points import CONDITIONS, DESIGN, LAW, MEASURED, SLIPS_EACH, conditions, rim

    machine = drawn.machine
    assert machine.terrain is not None
    soil, gravity = machine.terrain.soils[0], abs(machine.gravity[2])
    where = conditions(drawn.trial.random("maneuver"), SLIPS_EACH)
    load, slip, angle = (where[word] for word in CONDITIONS)
    found = dict.fromkeys(MEASURED, 0.0)
    for which, pace in DESIGN.values():
        wheel, speed = rim(machine.rover.wheels[which]), machine.speeds[pace]
        mine = bench_points(wheel, soil, LAW, **where, laws=machine.effects, gravity=gravity, speed=speed)
        its = simulate.bench(
            LAW, soil, wheel, load=load, slip_ratio=slip, slip_angle=angle, effects=[], gravity=gravity, speed=speed, threads=1
        )
        for word, (_, _, sigma) in MEASURED.items():
            off = mine[word] - getattr(its.points, word)
            found[word] = max(found[word], float(np.sqrt(np.mean(off**2))) / sigma)
    return found
