"""Sensors say what is there, at their own rates and in their own frames; watches act when and only when they should."""

from dataclasses import replace

import numpy as np
import pytest

from effect_rigs import EARTH, flywheel, free_space, particle
from machines import cart, chain, plane
from rille import store
from rille.model import Command, InitialJointState, Pose, Scenario, Sensor, Watch
from rille.simulate import run


def driven(watches=(), duration=4.0, value=1.0, slope=0.0, **more):
    """The cart on a plane of soil, all wheels at one speed [rad/s]."""
    commands = tuple(Command(drive=d.name, time=0.0, value=value) for d in cart(5.0, 0.15, 0.165).drives)
    return Scenario(
        name="s",
        duration=duration,
        gravity=(0, 0, -EARTH),
        terrain="plane",
        placement="on_terrain",
        settle_time=2,
        commands=commands,
        watches=tuple(watches),
        **more,
    )


def events(path):
    """(kind, subject, time) of the last run."""
    return [(e.kind, e.subject, e.time) for e in store.read_trace(path).events]


# ---------------------------------------------------------------- sensors


def test_every_sensor_keeps_its_own_rate(make_model):
    sensors = tuple(Sensor(name=f"at_{rate}", quantity="joint.position", target="hub", rate=rate) for rate in (7.0, 50.0, 333.0, 5000.0))
    path = make_model(flywheel(sensors=sensors), free_space(duration=2.0))
    run(path)
    samples = store.read_samples(path, 1)
    for rate in (7.0, 50.0, 333.0):
        time = samples[f"at_{rate}"][0]
        assert len(time) == pytest.approx(2 * rate, abs=1.5)
        assert np.abs(time - np.round(time * rate) / rate).max() < 1.1e-3  # on the step that ends there
    assert len(samples["at_5000.0"][0]) == pytest.approx(2000, abs=1)  # once a step, no more


def test_an_accelerometer_feels_what_carries_it(make_model):
    """At rest it reads g upward (a swing's end: along the rod g cos q, across nothing); in free fall nothing."""
    falling = particle(sensors=(Sensor(name="imu", quantity="part.linear_acceleration", target="body", rate=100.0),))
    path = make_model(falling, free_space(duration=0.5, gravity=(0, 0, -EARTH)))
    run(path)
    assert np.abs(store.read_samples(path, 1)["imu"][1][5:]).max() < 1e-6
    resting = replace(
        cart(5.0, 0.15, 0.165),
        sensors=(Sensor(name="imu", quantity="part.linear_acceleration", target="chassis", rate=100.0, frame="body"),),
    )
    path = make_model(resting, driven(value=0.0, duration=1.0), plane(0.2))
    run(path)
    reading = store.read_samples(path, 1)["imu"][1][-1]
    slope = np.arctan(0.2)
    assert reading == pytest.approx([EARTH * np.sin(slope), 0, EARTH * np.cos(slope)], abs=0.02)  # sinkage tilts it by a hair


def test_vectors_come_in_the_world_or_in_the_body(make_model):
    """A body that is turned by 90 degrees about z and flies along x moves along its own -y."""
    half = np.sqrt(0.5)
    sensors = tuple(Sensor(name=f, quantity="part.linear_velocity", target="body", rate=10.0, frame=f) for f in ("world", "body"))
    start = Pose(position=(0, 0, 0), rotation=(half, 0, 0, half))
    path = make_model(particle(sensors=sensors), free_space(duration=0.3, start=start, start_velocity=(2.0, 0, 0)))
    run(path)
    samples = store.read_samples(path, 1)
    assert samples["world"][1][-1] == pytest.approx([2, 0, 0], abs=1e-9)
    assert samples["body"][1][-1] == pytest.approx([0, -2, 0], abs=1e-9)


def test_current_and_voltage_of_a_motor(make_model):
    """i = tau / k; u = R i + k w."""
    sensors = (
        Sensor(name="i", quantity="motor.current", target="motor", rate=10.0),
        Sensor(name="u", quantity="motor.voltage", target="motor", rate=10.0),
    )
    machine = flywheel(mode="torque", sensors=sensors, torque_constant=0.5, resistance=2.0)
    path = make_model(machine, free_space(duration=1.0, commands=(Command(drive="motor", time=0.0, value=3.0),)))
    run(path)
    samples = store.read_samples(path, 1)
    assert samples["i"][1][-1, 0] == pytest.approx(6.0)
    speed = 3.0 / 2.0 * samples["u"][0][-1]  # torque over inertia
    assert samples["u"][1][-1, 0] == pytest.approx(12.0 + 0.5 * speed, rel=2e-3)


# ---------------------------------------------------------------- watches


def test_a_bound_that_is_passed_stops_the_run_and_keeps_it(make_model):
    """Rolling at 0.15 m/s with little slip, 0.3 m are behind it after about 2 s."""
    watch = Watch(name="far_enough", quantity="part.position", target="chassis", above=0.3, action="stop")
    path = make_model(cart(5.0, 0.15, 0.165), driven([watch]), plane())
    result = run(path)
    assert result.status == "stopped"
    assert "far_enough" in result.message
    trace = store.read_trace(path)
    assert trace.status == "stopped"
    assert 1.9 < trace.time[-1] < 3.5
    kind, subject, time = events(path)[-2]
    assert (kind, subject) == ("watch", "far_enough")
    assert time == pytest.approx(trace.time[-1], abs=2e-3)


def test_a_bound_must_be_held(make_model):
    """A pendulum of period 1.6 s is beyond 0.1 rad for 0.5 s at a time: a hold of 0.3 s is met, one of 0.7 s never."""
    short = Watch(name="short", quantity="joint.position", target="hinge1", above=0.1, hold=0.3, action="mark")
    long = replace(short, name="long", hold=0.7)
    inside = Watch(name="inside", quantity="joint.position", target="hinge1", above=-0.05, below=0.05, action="mark")
    start = InitialJointState(joint="hinge1", position=-0.2)
    path = make_model(
        chain([1.0], [1.0]), free_space(duration=5.0, gravity=(0, 0, -EARTH), initial_states=(start,), watches=(short, long, inside))
    )
    run(path)
    marked = {subject: time for kind, subject, time in events(path) if kind == "watch"}
    assert set(marked) == {"short", "inside"}
    period = 2 * np.pi / np.sqrt(1.5 * EARTH)
    assert marked["inside"] == pytest.approx(np.arccos(0.25) / (2 * np.pi) * period, abs=0.01)
    assert marked["short"] == pytest.approx(np.arccos(-0.5) / (2 * np.pi) * period + 0.3, abs=0.01)


def test_an_event_can_change_a_command_once(make_model):
    """Brakes when the wheel has turned by 1 rad, and not again."""
    watch = Watch(name="brake", quantity="joint.position", target="hub", above=1.0, action="command", drive="motor", value=0.0)
    commands = (Command(drive="motor", time=0.0, value=2.0), Command(drive="motor", time=1.5, value=1.0))
    path = make_model(flywheel(mode="speed"), free_space(duration=2.0, commands=commands, watches=(watch,)))
    run(path)
    trace = store.read_trace(path)
    angle = trace.joints[0].position
    still = (trace.time > 0.6) & (trace.time < 1.4)
    assert np.ptp(angle[still]) < 1e-9
    assert angle[still][0] == pytest.approx(1.0, abs=5e-3)
    assert angle[-1] == pytest.approx(1.5, abs=0.01)  # the later command counts again
    assert sum(kind == "watch" for kind, _, _ in events(path)) == 1


def test_an_event_of_the_physics_is_waited_for(make_model):
    """On a slope that is too steep the wheels dig: `wheel_spinning`, then `stuck`, on which the run stops."""
    watch = Watch(name="give_up", event="stuck", action="stop")
    path = make_model(cart(5.0, 0.15, 0.165), driven([watch], duration=60.0), plane(0.30))
    result = run(path)
    assert result.status == "stopped", events(path)
    kinds = [kind for kind, _, _ in events(path)]
    assert "stuck" in kinds
    assert result.time_reached < 60


def test_a_machine_that_falls_over_says_so(make_model):
    """A tall box on a narrow foot that is pushed."""
    tall = replace(cart(5.0, 0.15, 0.165))
    path = make_model(
        tall,
        replace(
            driven(duration=1.0, value=0.0),
            placement="as_given",
            start=Pose(position=(0, 0, 3)),
            settle_time=0.0,
            start_angular_velocity=(2.5, 0, 0),
        ),
        plane(),
    )
    run(path)
    _, subject, time = next(e for e in events(path) if e[0] == "tip_over")
    assert subject == "chassis"
    assert time == pytest.approx(np.pi / 3 / 2.5, rel=0.02)
