"""What to record next: maneuvers that run, and the one that tells two laws apart."""

from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation

from effect_rigs import particle
from machines import cart, chain, plane
from rille import simulate, store
from rille.diagnosis.answer.maneuvers import library, scenario_text
from rille.diagnosis.answer.next_experiment import ENOUGH, next_experiments
from rille.diagnosis.hypotheses.candidates import candidates
from rille.diagnosis.hypotheses.natural import natural
from rille.model import Command, Drive, Pose, Scenario
from rille.model.recording import Channel, Recording

KINDS = store.effect_kinds()
EARTH = (0.0, 0.0, -9.80665)
PENDULUM = replace(chain([0.3, 0.25], [0.5, 0.4]), drives=(Drive(name="m", joint="hinge1", mode="torque", max_torque=5.0),))
MACHINES = {
    "pendulum": (PENDULUM, Scenario(name="s", duration=2, gravity=EARTH), None),
    "servo": (
        replace(PENDULUM, drives=(replace(PENDULUM.drives[0], mode="position", speed_gain=2.0),)),
        Scenario(name="s", duration=2, gravity=EARTH),
        None,
    ),
    "cart": (
        cart(5.0, 0.15, 0.165),
        Scenario(
            name="s",
            duration=2,
            gravity=EARTH,
            step=2e-3,
            terrain="plane",
            placement="on_terrain",
            settle_time=2.0,
            start=Pose(position=(1.0, 2.0, 0.0)),
            commands=(Command(drive="wheel_front_left", time=0.0, value=2.0),),
        ),
        plane(0.02),
    ),
    "body": (particle(), Scenario(name="s", duration=2, gravity=EARTH, start=Pose(position=(0.0, 0.0, 30.0))), None),
}


def sensors(kind, count, seed=0):
    """One recording with that noise; the values only say how far things usually go."""
    time = np.arange(0, 4, 0.01)
    rng = np.random.default_rng(seed)
    found = []
    for name in count:
        quantity, target, component, unit, noise = (*name, *kind)
        value = np.sin(3 * time) + rng.normal(0, noise, len(time))
        found.append(
            Channel(
                name=f"{target}{component}",
                quantity=quantity,
                target=target,
                component=component,
                unit=unit,
                noise=noise,
                time=time,
                value=value,
            )
        )
    return Recording(name="r", channels=tuple(found))


@pytest.mark.parametrize("name", list(MACHINES))
def test_every_maneuver_is_a_scenario_that_runs(make_model, tmp_path, name):
    """As the file says it, through the reader that `rille run` uses; a second of it does not end early."""
    rover, scenario, terrain = MACHINES[name]
    path = make_model(rover, scenario, terrain)
    replayer = simulate.Replayer(path)
    machine = replayer.machine()
    maneuvers = library(machine, natural(machine, ()))
    assert len({m.name for m in maneuvers}) == len(maneuvers) >= 4
    state = replayer.rest()
    for maneuver in maneuvers:
        text = scenario_text(maneuver, machine, step=replayer.step, start=(*state[1:4], 0.0))
        file = tmp_path / f"{maneuver.name}.toml"
        file.write_text(text)
        read = simulate.read_scenario_file(file, rover)
        assert read.duration == maneuver.duration
        assert (read.placement == "on_terrain") == (name == "cart")
        assert np.asarray(read.start.position)[:2] == pytest.approx(scenario.start.position[:2], abs=0.01)
        assert sum(len(values) for values in maneuver.commands.values()) == len(read.commands)
        store.write_scenario(path, read)
        simulation = Simulation(str(path), maneuver.name)
        simulation.settle()
        assert simulation.step(round(1.0 / replayer.step)) == "running", simulation.message


def members(replayer, recording, *wanted):
    found = candidates(replayer.machine(), recording.channels, KINDS)
    return [(next(h for h in found if (h.kind, h.target) == (kind, target)).at(values),) for kind, target, values in wanted]


def test_dry_and_viscous_friction_are_told_apart(make_model):
    """Friction of a joint that hardly shows in a swing at one size shows in swings of two."""
    rover, scenario, _ = MACHINES["pendulum"]
    replayer = simulate.Replayer(make_model(rover, replace(scenario, integrator="semi_implicit_euler")))
    recording = sensors(("", "rad", 1e-3), [("joint.position", "hinge1"), ("joint.position", "hinge2")])
    dry, wet = members(
        replayer, recording, ("coulomb_friction", "hinge2", {"torque": 0.01}), ("viscous_friction", "hinge2", {"coefficient": 0.003})
    )
    first, *others = next_experiments(replayer, [recording], [dry, wet], now=0.5)
    assert first.separation > ENOUGH
    assert all(first.separation >= other.separation for other in others)
    assert "coulomb_friction of hinge2" in first.sentence
    assert "(the recordings: 0.5)" in first.sentence
    assert first.scenario.count("[[command]]") >= 1
    weak = next_experiments(replayer, [recording], [dry, (dry[0].hypothesis.at({"torque": 0.01 + 1e-9}),)], most=1)
    assert weak[0].separation < ENOUGH
    assert "no maneuver of the library" in weak[0].sentence


def test_one_member_or_no_sensor_asks_for_nothing(make_model):
    rover, scenario, _ = MACHINES["pendulum"]
    replayer = simulate.Replayer(make_model(rover, scenario))
    recording = sensors(("", "rad", 1e-3), [("joint.position", "hinge1")])
    (dry,) = members(replayer, recording, ("coulomb_friction", "hinge1", {"torque": 0.1}))
    assert next_experiments(replayer, [recording], [dry]) == ()
    assert next_experiments(replayer, [Recording(name="none")], [dry, ()]) == ()


def test_starts_that_cannot_be_known_count_for_nothing(make_model):
    """An offset of a position sensor is what another start would show: 8 s of it separate less than the samples alone promise."""
    rover, scenario, _ = MACHINES["body"]
    replayer = simulate.Replayer(make_model(rover, scenario))
    recording = sensors(("m", 1e-2), [("part.position", "body", c) for c in "xyz"])
    found = candidates(replayer.machine(), recording.channels, KINDS)
    offset = next(h for h in found if h.cause == "sensor" and h.target == "bodyx" and h.free[0].unit == "m")
    best = next_experiments(replayer, [recording], [(), (offset.at({offset.free[0].name: 0.03}),)])[0]
    assert best.separation < 0.5 * 3 * np.sqrt(300)  # 3 sigma in each of 300 samples
