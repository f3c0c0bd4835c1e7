"""Small rigs on which one effect at a time can be compared with a closed form."""

from dataclasses import replace

import numpy as np
from rille._solver import Simulation

from machines import LUNAR_SOIL, box, plane
from rille import simulate, store
from rille.model import BenchWheel, Command, Drive, Effect, Grouser, Joint, Pose, Rover, Scenario, Sensor, Wheel

WHEEL = BenchWheel(radius=0.15, width=0.165, grouser_count=24, grouser_height=0.01)
SMOOTH = BenchWheel(radius=0.15, width=0.165)
EARTH = 9.80665


def rows(*effects: Effect) -> list[tuple]:
    """Effects as the solver takes them."""
    return simulate.effect_rows(effects, store.effect_kinds())


def wheel_point(
    effect=None, *, soil=LUNAR_SOIL, wheel=WHEEL, load=50.0, slip=0.3, angle=0.0, method="quasi_static", law="bekker_wong", **more
):
    """One point of the bench as a dict of its responses."""
    result = simulate.bench(
        law, soil, wheel, load=load, slip_ratio=slip, slip_angle=angle, method=method, effects=rows(effect) if effect else (), **more
    )
    assert result.status == ("done",), result.status
    return {name: float(getattr(result.points, name)[0]) for name in ("sinkage", "drawbar_pull", "side_force", "drive_torque")}


def assert_same_point(a, b, rel=1e-9):
    """Two points of the bench agree in every response, relative to its size."""
    for name, value in a.items():
        assert abs(value - b[name]) <= rel * max(abs(value), abs(b[name]), 1e-6), (name, value, b[name])


def scaled(factor, soil=LUNAR_SOIL):
    """A soil with both pressure-sinkage moduli multiplied."""
    return replace(soil, cohesive_modulus=factor * soil.cohesive_modulus, frictional_modulus=factor * soil.frictional_modulus)


def flywheel(inertia=2.0, mode=None, mass=10.0, offset=0.0, sensors=(), **drive):
    """A body on a hinge along y that the world holds; its centre of mass lies ``offset`` [m] along x from the hinge."""
    side = np.sqrt(6 * inertia / mass)
    joints = (Joint(name="hub", kind="hinge", parent=None, child="disc", point=(0, 0, 0), axis=(0, 1, 0)),)
    values = {"max_torque": 1e4} | drive
    drives = () if mode is None else (Drive(name="motor", joint="hub", mode=mode, **values),)
    return Rover(bodies=(box("disc", mass, (offset, 0, 0), (side, 0.1, side)),), joints=joints, drives=drives, sensors=tuple(sensors))


def particle(mass=4.0, sensors=()):
    """A free body."""
    return Rover(bodies=(box("body", mass, (0, 0, 0), (0.3, 0.2, 0.1)),), sensors=tuple(sensors))


def free_space(duration=2.0, step=1e-3, gravity=(0.0, 0.0, 0.0), **more):
    """A scenario without ground."""
    return Scenario(name="free", duration=duration, step=step, gravity=gravity, **more)


def spinning(speed, **more):
    """A scenario in which the flywheel starts with a speed [rad/s]."""
    from rille.model import InitialJointState

    return free_space(initial_states=(InitialJointState(joint="hub", velocity=speed),), **more)


def commanded(value, time=0.0, **more):
    """A scenario with one command to the flywheel's motor."""
    return free_space(commands=(Command(drive="motor", time=time, value=value),), **more)


def sample(path, n_steps, *channels, every=1):
    """(n, channels) of quantities along a simulation; a channel is (quantity, target[, component])."""
    simulation = Simulation(str(path))
    assert simulation.settle() == "running"
    values = simulation.sample(n_steps, every, [(*c, 0) if len(c) == 2 else c for c in channels])
    assert not np.isnan(values).any(), simulation.message
    return values


def rig(load=50.0, slip=0.3, speed=0.05, wheel=WHEEL):
    """The single-wheel bench as a model: carriage on a rail along x, post that slides along z, driven wheel. Returns rover and commands."""
    mass = load / EARTH
    r = wheel.radius
    center = (0.0, 0.0, r)
    bodies = tuple(box(n, m, center, (r, r, r)) for n, m in (("carriage", mass), ("post", 0.7 * mass), ("wheel", 0.3 * mass)))
    joints = (
        Joint(name="rail", kind="prismatic", parent=None, child="carriage", point=center, axis=(1, 0, 0)),
        Joint(name="slide", kind="prismatic", parent="carriage", child="post", point=center, axis=(0, 0, 1)),
        Joint(name="axle", kind="hinge", parent="post", child="wheel", point=center, axis=(0, 1, 0)),
    )
    drives = (
        Drive(name="rail", joint="rail", mode="speed", max_torque=1e5),
        Drive(name="axle", joint="axle", mode="speed", max_torque=1e4),
    )
    grouser = Grouser(count=wheel.grouser_count, height=wheel.grouser_height, thickness=0.002) if wheel.grouser_count else None
    rover = Rover(
        bodies=bodies,
        joints=joints,
        drives=drives,
        wheels=(Wheel(name="wheel", joint="axle", center=center, radius=r, width=wheel.width, grouser=grouser),),
    )
    rim = speed / (1 - slip) if slip >= 0 else speed * (1 + slip)
    commands = (Command(drive="rail", time=0.0, value=speed), Command(drive="axle", time=0.0, value=rim / r))
    return rover, commands


def rig_model(make_model, *effects, duration=10.0, step=1e-3, soil=LUNAR_SOIL, start=(-8.0, 0.0, 0.0), **more):
    """The bench as a database."""
    rover, commands = rig(**more)
    scenario = Scenario(
        name="rig", duration=duration, step=step, gravity=(0, 0, -EARTH), terrain="plane", commands=commands, start=Pose(position=start)
    )
    return make_model(rover, scenario, plane(soil=soil), effects)


def hub_sensor(quantity="joint.position", rate=100.0):
    """A sensor on the flywheel's hinge."""
    return Sensor(name="encoder", quantity=quantity, target="hub", rate=rate)


def sensed(make_model, *effects, speed=2.0, duration=1.0, quantity="joint.position"):
    """Times and values that a sensor gives while the flywheel turns at constant speed [rad/s]: theta = speed t."""
    path = make_model(
        flywheel(mode="speed", sensors=(hub_sensor(quantity),)), commanded(speed, duration=duration, output_interval=0.1), None, effects
    )
    from rille.simulate import run

    result = run(path)
    times, values = store.read_samples(path, result.run_id)["encoder"]
    return times, values[:, 0]
