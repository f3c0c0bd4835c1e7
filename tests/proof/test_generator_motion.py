"""Bodies and joints of the generator: its mechanism against values by hand, its motion against closed forms and the solver."""

from collections.abc import Sequence

import numpy as np
import pytest

from rille import store
from rille.model import Command, Drive, Effect, InitialJointState, InputRefused, Joint, Pose, Rover, Scenario
from rille.proof.generator import simulate
from rille.proof.generator.mechanism import Mechanism
from rille.proof.generator.reading import Reading
from rille.proof.machines import MAKERS, box
from rille.proof.maneuvers import maneuver
from rille.proof.subject import Subject
from rille.simulate.recorder import Wanted, record

INERTIA = 0.02  # [kg m^2] of the flywheel about its axis
MASS = 2.0  # [kg] of the cube
TIMES = np.linspace(0.05, 2.0, 40)  # [s]
INTEGRATED = 1e-6  # relative: the integrator's 1e-9 per step, summed over a run


# --- mechanism


def moving(name: str, seed: int = 3):
    """A machine's mechanism at a random state that fulfils its constraints: machine, mechanism, q, z."""
    rng = np.random.default_rng(seed)
    machine = MAKERS[name](rng)
    mechanism = Mechanism(machine.rover, machine.gravity)
    q = mechanism.integrate(mechanism.start(), rng.normal(size=mechanism.size), 0.5)
    z = rng.normal(size=mechanism.size)
    mechanism.move(q, z)
    return machine, mechanism, q, z


@pytest.mark.parametrize("name", MAKERS)
def test_jacobians_are_the_velocities_of_points(name):
    """Against central differences of poses over 2e-6 s: rounding 1e-10, third derivatives 1e-10."""
    machine, mechanism, q, z = moving(name)
    nudge, place = 1e-6, np.array([0.1, -0.2, 0.3])
    for body in machine.rover.bodies:
        mechanism.move(q, z)
        origin, turned = mechanism.pose(body.name)
        linear, angular = mechanism.jacobian(body.name, origin + turned @ place)
        ends = []
        for step in (-nudge, nudge):
            mechanism.move(mechanism.integrate(q, z, step), z)
            there, turn = mechanism.pose(body.name)
            ends.append((there + turn @ place, turn))
        assert linear @ z == pytest.approx((ends[1][0] - ends[0][0]) / (2 * nudge), abs=1e-6)
        spin = (ends[1][1] - ends[0][1]) / (2 * nudge) @ turned.T
        assert angular @ z == pytest.approx([spin[2, 1], spin[0, 2], spin[1, 0]], abs=1e-6)


@pytest.mark.parametrize("name", MAKERS)
def test_the_mass_matrix_is_the_kinetic_energy_of_all_bodies(name):
    machine, mechanism, _, z = moving(name)
    energy = 0.0
    for body in machine.rover.bodies:
        p = body.properties
        origin, turned = mechanism.pose(body.name)
        linear, angular = mechanism.jacobian(body.name, origin + turned @ (p.com - np.array(body.frame)))
        v, w = linear @ z, turned.T @ angular @ z
        energy += 0.5 * p.mass * v @ v + 0.5 * w @ p.inertia @ w
    assert 0.5 * z @ mechanism.mass @ z == pytest.approx(energy, rel=1e-12)


def test_gears_and_differentials_hold_along_any_motion():
    machine, mechanism, q, z = moving("arm")
    for rates in (lambda joint: mechanism.row(joint) @ z, lambda joint: mechanism.joint_position(q, joint)):
        assert rates("motor") == pytest.approx(machine.rover.gears[0].ratio * rates("elbow"), rel=1e-12)
    _, mechanism, q, z = moving("rover")
    assert mechanism.row("rocker_left") @ z == pytest.approx(-mechanism.row("rocker_right") @ z, rel=1e-12)
    assert mechanism.joint_position(q, "rocker_left") == pytest.approx(-mechanism.joint_position(q, "rocker_right"), rel=1e-12)


# --- motion without drives


def read(machine: Subject, scenario: Scenario, laws: Sequence[Effect], *wanted: tuple[str, str, str], times=TIMES) -> list[np.ndarray]:
    """Values of (quantity, target, component) in W at ``times``."""
    return simulate(machine, scenario, laws, [Reading(quantity=q, target=t, component=c, frame="world", times=times) for q, t, c in wanted])


def test_a_free_body_keeps_energy_and_momenta():
    """No gravity, no drive: the flywheel on its skew axis only passes momentum to and fro."""
    machine, mechanism, _, _ = moving("free_body")
    still = Subject(name="free_body", rover=machine.rover, gravity=(0, 0, 0), duration=2.0)
    scenario = Scenario(
        name="thrown",
        duration=2.0,
        gravity=(0, 0, 0),
        start_velocity=(1.0, -2.0, 3.0),
        start_angular_velocity=(1.0, -0.5, 0.8),
        initial_states=(InitialJointState(joint="spin", velocity=20.0),),
    )
    asked = [("part.position", "body", c) for c in "xyz"] + [("part.orientation", "body", c) for c in "wxyz"]
    asked += [("part.linear_velocity", "body", c) for c in "xyz"] + [("part.angular_velocity", "body", c) for c in "xyz"]
    asked += [("joint.position", "spin", ""), ("joint.velocity", "spin", "")]
    seen = np.array(read(still, scenario, [], *asked)).T
    kept = []
    for row in seen:
        q = mechanism.with_joint(np.concatenate([row[:7], [0.0]]), "spin", row[13])
        mechanism.move(q, np.zeros(mechanism.size))
        _, turned = mechanism.pose("body")
        z = mechanism.reduced(mechanism.velocities({"spin": row[14]}, row[7:10], turned.T @ row[10:13]))
        mechanism.move(q, z)
        momentum, turning = np.zeros(3), np.zeros(3)
        for body in machine.rover.bodies:
            p = body.properties
            origin, turn = mechanism.pose(body.name)
            centre = origin + turn @ (p.com - np.array(body.frame))
            linear, angular = mechanism.jacobian(body.name, centre)
            momentum += p.mass * linear @ z
            turning += p.mass * np.cross(centre, linear @ z) + turn @ p.inertia @ turn.T @ angular @ z
        kept.append([0.5 * z @ mechanism.mass @ z, *momentum, *turning])
    assert np.array(kept) == pytest.approx(np.broadcast_to(kept[0], np.shape(kept)), rel=INTEGRATED, abs=1e-6)


# --- motion with drives and laws

WITHIN = {  # of the largest value, or of 1
    "joint.position": 1e-5,
    "joint.velocity": 1e-4,
    "joint.effort": 5e-4,
    "part.position": 1e-6,
    "part.orientation": 1e-6,
    "part.linear_velocity": 1e-6,
    "part.angular_velocity": 1e-6,
    "part.linear_acceleration": 5e-4,
}


@pytest.mark.parametrize("name", ["pendulum", "arm", "free_body"])
def test_motion_is_the_solvers(name, tmp_path):
    """Over a random maneuver, read in the middle between commands, where the solver's steps end.

    Where it has rows (speed drives, friction) it is of first order in its step, so that 1 ms and 0.5 ms extrapolate to none: on the arm's
    motor 1e-2 and 5e-3 rad become 1.2e-5 of 7.8 rad; at the waist 4e-3 and 2e-3 rad/s become 7e-5. Pendulum and free body agree as they
    are, to 5e-6 and 1e-7 rad. Efforts and accelerations are means of its steps, so are first in the step too.
    """
    rng = np.random.default_rng(5)
    machine = MAKERS[name](rng)
    scenario = maneuver(machine, "wild", rng)
    path = tmp_path / "model.db"
    store.create(path)
    store.write_rover(path, machine.rover)
    store.write_effects(path, machine.effects)
    store.write_scenario(path, scenario)
    times = np.arange(0.01, machine.duration, 0.02)
    asked = [(word, joint.name, "") for word in ("joint.position", "joint.velocity") for joint in machine.rover.joints]
    asked += [("joint.effort", drive.joint, "") for drive in machine.rover.drives]
    if name == "free_body":
        words = ("position", "linear_velocity", "angular_velocity", "linear_acceleration")
        asked += [(f"part.{word}", "body", c) for word in words for c in "xyz"] + [("part.orientation", "body", c) for c in "wxyz"]
    mine = read(machine, scenario, [], *asked, times=times)
    wanted = [Wanted(quantity=q, target=t, components=(c,) if c else (), frame="world", times=times) for q, t, c in asked]
    whole, half = (record(path, scenario, store.read_rover(path), wanted, step=step).values for step in (1e-3, 5e-4))
    for (quantity, target, _), ours, one, other in zip(asked, mine, whole, half, strict=True):
        off = np.abs(ours - (2 * other - one)[:, 0]).max()
        assert off < WITHIN[quantity] * max(1.0, float(np.abs(ours).max())), (quantity, target)


def law(kind: str, target: str, **numbers: float) -> Effect:
    return Effect(kind=kind, target=target, parameters=numbers)


def flywheel(mode: str = "torque", value: float = 0.0, speed: float = 0.0, gravity=(0.0, 0.0, 0.0), **drive) -> tuple[Subject, Scenario]:
    """A square plate on an upright axle of the world, with a drive that gets one command."""
    edge = float(np.sqrt(6 * INERTIA / MASS))
    rover = Rover(
        bodies=(box("plate", MASS, (0, 0, 0), (edge, edge, 0.01)),),
        joints=(Joint(name="hub", kind="hinge", parent=None, child="plate", point=(0, 0, 0), axis=(0, 0, 1)),),
        drives=(Drive(name="hub", joint="hub", mode=mode, max_torque=1.0, **drive),),  # type: ignore[arg-type]
    )
    scenario = Scenario(
        name="run",
        duration=2.0,
        gravity=gravity,
        commands=(Command(drive="hub", time=0.0, value=value),),
        initial_states=(InitialJointState(joint="hub", velocity=speed),),
    )
    return Subject(name="flywheel", rover=rover, gravity=gravity, duration=2.0), scenario


def cube(velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0), gravity=(0.0, 0.0, 0.0), place=(0.0, 0.0, 0.0)) -> tuple[Subject, Scenario]:
    """A free cube."""
    rover = Rover(bodies=(box("cube", MASS, (0, 0, 0), (0.1, 0.1, 0.1)),))
    scenario = Scenario(
        name="flight",
        duration=2.0,
        gravity=gravity,
        start=Pose(position=place),
        start_velocity=velocity,
        start_angular_velocity=spin,
    )
    return Subject(name="cube", rover=rover, gravity=gravity, duration=2.0), scenario


def speeds(machine: Subject, scenario: Scenario, *laws: Effect) -> np.ndarray:
    return read(machine, scenario, laws, ("joint.velocity", "hub", ""))[0]


T = TIMES
DRIVEN = 0.1  # [N m]
SPEEDS = {  # name -> flywheel, laws, speed in closed form
    "viscous_friction": (flywheel(speed=5.0), [law("viscous_friction", "hub", coefficient=0.03)], 5 * np.exp(-0.03 / INERTIA * T)),
    "coulomb_friction": (flywheel(speed=2.0), [law("coulomb_friction", "hub", torque=0.03)], np.maximum(2 - 0.03 / INERTIA * T, 0)),
    "stribeck_friction, slow": (
        flywheel(speed=5.0),
        [law("stribeck_friction", "hub", coulomb_torque=0.02, stiction_excess=0.01, stribeck_speed=1e4)],
        5 - 0.03 / INERTIA * T,
    ),
    "stribeck_friction, fast": (
        flywheel(speed=5.0),
        [law("stribeck_friction", "hub", coulomb_torque=0.02, stiction_excess=0.01, stribeck_speed=0.1)],
        5 - 0.02 / INERTIA * T,
    ),
    "load_friction": (flywheel(value=DRIVEN), [law("load_friction", "hub", coefficient=0.2)], 0.8 * DRIVEN / INERTIA * T),
    "joint_pulse": (
        flywheel(),
        [law("joint_pulse", "hub", torque=0.3, start=0.33, duration=0.2)],
        0.3 / INERTIA * np.clip(T - 0.33, 0, 0.2),
    ),
    "command_delay": (flywheel(value=DRIVEN), [law("command_delay", "hub", delay=0.42)], DRIVEN / INERTIA * np.maximum(T - 0.42, 0)),
    "command_gain": (flywheel(value=DRIVEN), [law("command_gain", "hub", relative_error=-0.3)], 0.7 * DRIVEN / INERTIA * T),
    "motor_lag": (
        flywheel(value=DRIVEN),
        [law("motor_lag", "hub", time_constant=0.4)],
        DRIVEN / INERTIA * (T - 0.4 * (1 - np.exp(-T / 0.4))),
    ),
    "motor_lag, speed": (
        flywheel("speed", 2.0),
        [law("motor_lag", "hub", time_constant=0.4)],
        2.0 * (1 - np.exp(-T / 0.4)),
    ),
    "motor_saturation": (
        flywheel(value=5.0),
        [law("motor_saturation", "hub", inverse_no_load_speed=0.05)],
        20 * (1 - np.exp(-0.05 / INERTIA * T)),
    ),
    "supply_sag": (flywheel(value=0.5), [law("supply_sag", "hub", sag=0.4)], 0.5 / 1.2 / INERTIA * T),
    "supply_sag, speed": (  # w = set (1 - sag b w/tau_max) in the end, b of the friction; time constant I/(b + gain/(1 + gain sag set))
        flywheel("speed", 2.0, speed_gain=0.05),
        [law("supply_sag", "hub", sag=0.4), law("viscous_friction", "hub", coefficient=0.03)],
        (0.1 / 1.04) / (0.03 + 0.05 / 1.04) * (1 - np.exp(-(0.03 + 0.05 / 1.04) / INERTIA * T)),
    ),
    "wearing_friction": (flywheel(speed=9.0), [law("wearing_friction", "hub", torque=0.05, time=1.0)], 9 - 0.025 / INERTIA * T**2),
    "cubic_friction": (
        flywheel(speed=5.0),
        [law("cubic_friction", "hub", coefficient=0.002)],
        1 / np.sqrt(1 / 25 + 2 * 0.002 / INERTIA * T),
    ),
    "cable_spring": (
        flywheel(),
        [law("cable_spring", "hub", stiffness=0.5, rest=0.4)],
        0.4 * 5 * np.sin(5 * T),
    ),
    "one_way_friction": (flywheel(speed=-5.0), [law("one_way_friction", "hub", torque=0.1)], np.full(len(T), -5.0)),
    "fading_motor": (
        flywheel(value=DRIVEN),
        [law("fading_motor", "hub", loss=0.3, time_constant=0.5)],
        DRIVEN / INERTIA * (0.7 * T + 0.15 * (1 - np.exp(-T / 0.5))),
    ),
}


@pytest.mark.parametrize("name", SPEEDS)
def test_a_flywheel_in_closed_form(name):
    """Dry friction is a tanh within 1e-4 rad/s, which a stopped wheel shows; a servo yields 5e-6 rad/s to 0.1 N m."""
    (machine, scenario), laws, expected = SPEEDS[name]
    assert speeds(machine, scenario, *laws) == pytest.approx(expected, rel=1e-6, abs=2e-5)


@pytest.mark.parametrize(
    ("effect", "work"),
    [
        (law("torque_ripple", "hub", torque=0.05, cycles=3, phase=0.5), lambda q: 0.05 / 3 * (np.cos(0.5) - np.cos(3 * q + 0.5))),
        (law("soft_stop", "hub", stiffness=0.3, **{"from": 1.0}), lambda q: -0.4 * 0.3 * np.maximum(q - 1, 0) ** 2.5),
        (law("com_offset", "plate", x=0.1, y=0.0, z=0.0), lambda q: -MASS * 1.62 * 0.1 * np.sin(q)),
    ],
    ids=lambda value: getattr(value, "kind", ""),
)
def test_work_becomes_kinetic_energy(effect, work):
    machine, scenario = flywheel(speed=5.0, gravity=(0, -1.62, 0))
    q, w = read(machine, scenario, [effect], ("joint.position", "hub", ""), ("joint.velocity", "hub", ""))
    inertia = INERTIA + (MASS * 0.1**2 if effect.kind == "com_offset" else 0.0)
    assert 0.5 * inertia * (w**2 - 25) == pytest.approx(work(q), abs=1e-7)


def test_an_elastic_transmission_swings_between_rotor_and_flywheel():
    """d'' = tau/J - d/compliance (1/J + 1/I), and the drive's effort at the joint is d/compliance."""
    rotor, compliance = 0.004, 0.5
    machine, scenario = flywheel(value=DRIVEN)
    effect = law("joint_elasticity", "hub", compliance=compliance, damping=0.0, rotor_inertia=rotor)
    pace = np.sqrt((1 / rotor + 1 / INERTIA) / compliance)
    (effort,) = read(machine, scenario, [effect], ("joint.effort", "hub", ""))
    assert effort == pytest.approx(DRIVEN / rotor / pace**2 / compliance * (1 - np.cos(pace * TIMES)), abs=1e-6)


def test_play_lets_the_rotor_turn_alone_at_first():
    """Half the gap at tau/J takes sqrt(gap J/tau) = 0.2 s; teeth and damping then bring both to one speed."""
    machine, scenario = flywheel(value=DRIVEN)
    effect = law("backlash", "hub", gap=0.4, stiffness=50.0, damping=0.5, rotor_inertia=0.01)
    w = speeds(machine, scenario, effect)
    assert (w[TIMES < 0.2] == 0).all()
    assert w[-1] == pytest.approx(DRIVEN * 2.0 / (INERTIA + 0.01), rel=1e-4)


def test_a_speed_drive_without_gain_holds_its_speed():
    machine, scenario = flywheel("speed", 2.0, speed=2.0)
    w, effort = read(
        machine, scenario, [law("viscous_friction", "hub", coefficient=0.2)], ("joint.velocity", "hub", ""), ("joint.effort", "hub", "")
    )
    assert w == pytest.approx(np.full(len(w), 2.0), abs=1e-4)
    assert effort == pytest.approx(np.full(len(w), 0.4), abs=1e-4)


STIFFNESS, COEFFICIENT = 1.5, 1.5  # [N/m], [N s/m] and the like
SPRUNG = np.sqrt(STIFFNESS / MASS)
SWINGING, PACE = 0.5, 6.0  # [kg], [rad/s] of a slosh
FLIGHTS = {  # cube, law, quantity along x
    "linear_drag": (
        cube((4, 0, 0)),
        law("linear_drag", "cube", coefficient=COEFFICIENT),
        "linear_velocity",
        4 * np.exp(-COEFFICIENT / MASS * T),
    ),
    "quadratic_drag": (
        cube((4, 0, 0)),
        law("quadratic_drag", "cube", coefficient=COEFFICIENT),
        "linear_velocity",
        4 / (1 + 4 * COEFFICIENT / MASS * T),
    ),
    "root_drag": (cube((4, 0, 0)), law("root_drag", "cube", coefficient=1.0), "linear_velocity", (2 - T / MASS / 2) ** 2),
    "tether_pull": (
        cube(place=(1, 0, 0)),
        law("tether_pull", "cube", stiffness=STIFFNESS, length=0.5, anchor_x=-1.0, anchor_y=0.0, anchor_z=0.0),
        "position",
        np.where(np.pi / 2 > SPRUNG * T, -0.5 + 1.5 * np.cos(SPRUNG * T), -0.5 - 1.5 * SPRUNG * (T - np.pi / 2 / SPRUNG)),
    ),
    "external_pulse": (
        cube(),
        law(
            "external_pulse",
            "cube",
            force_x=5.0,
            force_y=0.0,
            force_z=0.0,
            torque_x=0.0,
            torque_y=0.0,
            torque_z=0.0,
            start=0.4,
            duration=0.3,
        ),
        "linear_velocity",
        5 / MASS * np.clip(T - 0.4, 0, 0.3),
    ),
    "payload_slosh": (  # it hung at rest and is let fall: the payload swings against the rest of the cube
        cube(gravity=(-1.62, 0, 0)),
        law("payload_slosh", "cube", mass=SWINGING, natural_frequency=PACE, damping_ratio=0.0),
        "position",
        -1.62 * (T**2 / 2 + SWINGING / MASS / PACE**2 * (1 - np.cos(PACE * np.sqrt(MASS / (MASS - SWINGING)) * T))),
    ),
    "gravity_tilt": (
        cube(gravity=(0, 0, -1.62)),
        law("gravity_tilt", "*", roll=0.2, pitch=0.3),
        "linear_velocity",
        -1.62 * np.cos(0.2) * np.sin(0.3) * T,
    ),
    "magnus_force": (
        cube((4, 0, 0), spin=(0, 0, 5)),
        law("magnus_force", "cube", coefficient=0.8),
        "linear_velocity",
        4 * np.cos(0.8 * 5 / MASS * T),
    ),
}


@pytest.mark.parametrize("name", FLIGHTS)
def test_a_free_cube_in_closed_form(name):
    (machine, scenario), effect, word, expected = FLIGHTS[name]
    (seen,) = read(machine, scenario, [effect], (f"part.{word}", "cube", "x"))
    assert seen == pytest.approx(expected, rel=1e-6, abs=2e-6)


def test_mass_changes_and_pushes():
    """A heavier cube is pushed less; its inertia grows alike. The accelerometer feels the push and no gravity."""
    machine, scenario = cube(gravity=(0, 0, -1.62))
    push = law("external_pulse", "cube", force_x=5.0, torque_z=0.1, start=0.0, duration=9.0)
    heavier = law("mass_change", "cube", mass=3.0)
    asked = [("part.linear_acceleration", "cube", c) for c in "xyz"] + [("part.angular_velocity", "cube", "z")]
    *felt, turning = read(machine, scenario, [push, heavier], *asked)
    assert pytest.approx(np.broadcast_to([1.0, 0.0, 0.0], (len(TIMES), 3)), abs=1e-6) == np.array(felt).T
    assert turning == pytest.approx(0.1 / (5.0 * 0.1**2 / 6) * TIMES, rel=1e-6)
    with pytest.raises(InputRefused, match="without mass"):
        read(machine, scenario, [law("mass_change", "cube", mass=-3.0)], *asked)


def test_a_motor_current_is_its_effort():
    machine, scenario = flywheel("speed", 2.0, speed_gain=0.05, torque_constant=0.02)
    current, effort = read(machine, scenario, [], ("motor.current", "hub", ""), ("joint.effort", "hub", ""))
    assert current == pytest.approx(effort / 0.02, rel=1e-12)
    machine, scenario = flywheel()
    with pytest.raises(InputRefused, match="torque_constant"):
        read(machine, scenario, [], ("motor.current", "hub", ""))


@pytest.mark.parametrize(
    "kind", [k for k in store.effect_kinds() if k.target in ("joint", "body", "world") and k.family != "expression"], ids=lambda k: k.name
)
def test_laws_without_amplitude_change_nothing(kind):
    machine, scenario = flywheel(value=DRIVEN, gravity=(0, -1.62, 0))
    target = {"joint": "hub", "body": "plate"}.get(kind.target, "*")
    nothing = Effect(kind=kind.name, target=target, parameters={p.name: 0.0 if p.amplitude else p.typical for p in kind.parameters})
    assert speeds(machine, scenario, nothing) == pytest.approx(speeds(machine, scenario), rel=1e-7)
