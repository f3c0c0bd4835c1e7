"""The module rille._solver: models that change without reading again, states, windows in batch."""

import numpy as np
import pytest
from rille._solver import Model, Simulation, windows

from effect_rigs import EARTH, rows
from machines import cart, plane
from rille import simulate
from rille.model import Command, Effect, InputRefused, Scenario

CHANNELS = [("wheel.sinkage", "wheel_front_left", 0), ("part.position", "chassis", 0), ("joint.effort", "wheel_rear_right", 0)]


@pytest.fixture
def path(make_model):
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=5, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, commands=commands
    )
    return str(make_model(rover, scenario, plane(0.05)))


def test_a_parameter_set_in_memory_equals_one_in_the_database(path, make_model):
    from dataclasses import replace

    from machines import LUNAR_SOIL

    model = Model(path)
    assert model.get("soil.lunar_sourcebook.cohesion") == 170.0
    model.set("soil.lunar_sourcebook.cohesion", 340.0)
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=5, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, commands=commands
    )
    other = make_model(rover, scenario, plane(0.05, soil=replace(LUNAR_SOIL, cohesion=340.0)))
    answers = []
    for simulation in (Simulation(model), Simulation(str(other))):
        simulation.settle()
        answers.append(simulation.sample(500, 100, CHANNELS))
    assert np.array_equal(answers[0], answers[1])
    with pytest.raises(InputRefused, match="no parameter"):
        model.set("soil.lunar_sourcebook.colour", 1.0)
    with pytest.raises(InputRefused, match="nan"):
        model.set("soil.lunar_sourcebook.cohesion", float("nan"))


def test_effects_in_memory_equal_effects_in_the_database(path):
    from rille import store

    effect = Effect(kind="slip_sinkage", parameters={"slip_gain": 0.5})
    model = Model(path)
    model.set_effects(rows(effect))
    one = Simulation(model)
    store.write_effects(path, [effect])
    two = Simulation(path)
    for simulation in (one, two):
        simulation.settle()
    assert np.array_equal(one.sample(500, 100, CHANNELS), two.sample(500, 100, CHANNELS))
    assert model.get("effect.slip_sinkage.*.slip_gain") == 0.5


def test_a_restored_state_goes_on_bit_by_bit(path):
    simulation = Simulation(path)
    simulation.settle()
    simulation.step(300)
    state = simulation.save()
    first = simulation.sample(200, 20, CHANNELS)
    simulation.restore(state)
    assert np.array_equal(first, simulation.sample(200, 20, CHANNELS))


def test_a_state_that_is_refused_leaves_the_one_that_was_there(path):
    """A state that was cut off half way, restored at another time: what follows is the same bit by bit."""
    one, two = Simulation(path), Simulation(path)
    for simulation in (one, two):
        simulation.settle()
        simulation.step(300)
    state = one.save()
    for simulation in (one, two):
        simulation.step(150)
    for damaged in (state[:-3], state[: len(state) // 2], b"nonsense"):
        with pytest.raises(InputRefused, match="checkpoint"):
            one.restore(damaged)
    assert one.save() == two.save()
    assert np.array_equal(one.sample(200, 20, CHANNELS), two.sample(200, 20, CHANNELS))


def test_windows_are_the_same_on_any_number_of_threads_and_equal_single_runs(path):
    model = Model(path)
    simulation = Simulation(model)
    simulation.settle()
    motions = []
    for _ in range(6):
        simulation.step(150)
        motions.append(simulation.motion()[0])
    motions = np.array(motions)
    changed = model.copy()
    changed.set("soil.lunar_sourcebook.friction_angle", 0.7)
    one, two = (windows([model, changed], motions, 100, 25, CHANNELS, threads=n) for n in (1, 2))
    assert one.shape == (2, 6, 4, 3)
    assert np.array_equal(one, two)
    assert not np.array_equal(one[0], one[1])
    alone = Simulation(changed)
    alone.start_at(motions[3])
    assert np.array_equal(alone.sample(100, 25, CHANNELS), one[1, 3])
    with pytest.raises(InputRefused, match="needs"):
        windows([model], motions[:, :-1].copy(), 10, 1, CHANNELS)


def test_a_window_goes_on_as_the_run_did(path):
    """Started from the motion of a steady run, a window follows it: what is not motion (sides of rows) is no state of the physics."""
    simulation = Simulation(path)
    simulation.settle()
    simulation.step(1500)
    motion = simulation.motion()
    ahead = simulation.sample(200, 50, CHANNELS)
    window = windows([Model(path)], motion, 200, 50, CHANNELS)[0, 0]
    assert window == pytest.approx(ahead, rel=1e-9, abs=1e-12)


def test_a_window_with_slip_sinkage_starts_as_deep_as_the_run_was(path):
    """What the soil remembers is no motion; a window that starts in steady rolling takes it from there.

    The run has not quite reached its steady slip after 8 s: 1 % of the sinkage.
    """
    model = Model(path)
    model.set_effects(rows(Effect(kind="slip_sinkage", parameters={"slip_gain": 0.5})))
    simulation = Simulation(model)
    simulation.settle()
    simulation.step(8000)
    motion = simulation.motion()
    ahead = simulation.sample(200, 50, CHANNELS)
    window = windows([model], motion, 200, 50, CHANNELS)[0, 0]
    assert window[:, 0] == pytest.approx(ahead[:, 0], rel=0.01)


def test_inverse_dynamics_gives_back_the_efforts(path):
    """The accelerations of a step, put into inverse dynamics at its end, ask for the efforts of its drives.

    Steady drive: states at both ends of a step of 1 ms differ by 1e-3 of what changes, so 1 % is asked for, and no force on the root.
    """
    simulation = Simulation(path)
    simulation.settle()
    simulation.step(2000)
    effort = simulation.inverse_dynamics(np.zeros(simulation.n_v))[0]
    joints = dict(zip(simulation.joint_names, simulation.joints(), strict=True))
    measured = np.array([joints[name][2] for name in simulation.joint_names])
    assert effort[6:] == pytest.approx(measured, rel=0.01, abs=0.01)
    assert np.abs(effort[3:6]).max() < 0.02 * 20 * EARTH


def test_sensitivities_of_a_pendulum_are_those_of_its_period(make_model):
    """d position / d g of a small swing q = q0 cos(w t), w^2 = (3/2) g / l: -q0 sin(w t) t w / (2 g).

    Tolerance: amplitude 0.01 rad leaves 1e-5 of the period; the difference is of second order, (1e-3)^2.
    """
    from machines import chain
    from rille.model import InitialJointState

    start = InitialJointState(joint="hinge1", position=0.01, velocity=0.0)
    swing = Scenario(name="s", duration=2, gravity=(0, 0, -EARTH), initial_states=(start,))
    model = Model(str(make_model(chain([1.0], [2.0]), swing)))
    motion = Simulation(model).motion()
    channels = [("joint.position", "hinge1", 0)]
    got = simulate.sensitivities(model, {"gravity.z": 1e-3 * EARTH}, motion, n_steps=2000, every=100, channels=channels)
    assert got.shape == (1, 1, 20, 1)
    t = 0.1 * np.arange(1, 21)
    w = np.sqrt(1.5 * EARTH)
    assert got[0, 0, :, 0] == pytest.approx(0.01 * np.sin(w * t) * t * w / (2 * EARTH), abs=1e-4 * 0.01)


def test_a_parameter_outside_its_bounds_is_refused_and_the_model_kept(path):
    model = Model(path)
    for name, value in (("body.chassis.mass", 0.0), ("soil.lunar_sourcebook.shear_modulus", -1.0), ("wheel.wheel_front_left.radius", 1e9)):
        before = model.get(name)
        with pytest.raises(InputRefused, match=name):
            model.set(name, value)
        assert model.get(name) == before
