"""Energy and reactions: what goes in comes out, and every joint carries what hangs on it."""

from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation

from effect_rigs import EARTH, flywheel, free_space
from machines import box, cart, chain, plane
from rille.model import Command, Effect, Joint, LoopClosure, Rover, Scenario


@pytest.mark.parametrize("slope", [0.0, 0.15])
def test_the_energy_of_a_drive_balances_to_one_percent(make_model, slope):
    """Input = change of potential and kinetic energy + losses in soil and joints.

    Each row's work is exact for its impulse; open is the change of the mass matrix within a step, first order in h. Measured: 0.02 %.
    """
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.2 if "left" in d.name else 0.9) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=10, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=3, commands=commands
    )
    effects = (
        Effect(kind="coulomb_friction", parameters={"torque": 0.3}),
        Effect(kind="linear_drag", target="chassis", parameters={"coefficient": 20.0}),
    )
    simulation = Simulation(str(make_model(rover, scenario, plane(slope), effects)))
    simulation.settle()
    assert simulation.step(9000) == "running"
    energy = simulation.energy_balance()
    assert energy["drive_work"] > 5.0
    assert energy["soil_loss"] > 0
    assert energy["joint_loss"] == pytest.approx(0.3 * sum(np.abs(simulation.joints()[:, 0])), rel=0.01)  # torque x angle
    assert energy["external_work"] < 0
    assert (energy["potential"] > 1.0) == (slope > 0)
    assert abs(energy["residual"]) < 0.01 * energy["drive_work"]
    print(energy)


def test_a_falling_box_turns_potential_into_kinetic_energy(make_model):
    rover = Rover(bodies=(box("box", 5.0, (0, 0, 0), (0.2, 0.2, 0.2)),))
    scenario = free_space(duration=1.0, gravity=(0, 0, -9.81))
    simulation = Simulation(str(make_model(rover, scenario)))
    simulation.step(1000)
    energy = simulation.energy_balance()
    assert energy["kinetic"] == pytest.approx(-energy["potential"], rel=1e-9)
    assert energy["residual"] == pytest.approx(0, abs=1e-9)


def test_reactions_of_a_hanging_and_of_a_swinging_pendulum(make_model):
    """A rod on a hinge: at rest the hinge carries its weight; at angle q and speed w, along the rod m (g cos q + w^2 l/2)."""
    rover = chain([1.0], [2.0])
    from rille.model import InitialJointState

    scenario = free_space(duration=1.0, step=1e-4, gravity=(0, 0, -9.81), initial_states=(InitialJointState(joint="hinge1", position=0.6),))
    simulation = Simulation(str(make_model(rover, scenario)))
    simulation.step(5000)
    q, w = simulation.joints()[0][:2]
    force = simulation.reactions()[0][:3]
    along = np.array([np.sin(q), 0, np.cos(q)])  # from the centre of mass to the hinge
    assert force @ along == pytest.approx(2.0 * (9.81 * np.cos(q) + w * w * 0.5), rel=2e-3)
    # Across: m g sin q / 4 for a slender rod (moment of inertia m l^2/3).
    across = np.array([np.cos(q), 0, -np.sin(q)])
    assert abs(force @ across) == pytest.approx(2.0 * 9.81 * abs(np.sin(q)) / 4, rel=5e-3)
    assert np.abs(simulation.reactions()[0][3:]).max() < 2e-3  # a free hinge carries no torque: first order in h, of 9.81 N m


def test_the_reaction_along_an_axis_is_the_effort_of_its_drive(make_model):
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=5, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, commands=commands
    )
    simulation = Simulation(str(make_model(rover, scenario, plane())))
    simulation.settle()
    simulation.step(500)
    for reaction, joint in zip(simulation.reactions(), simulation.joints(), strict=True):
        assert reaction[4] == pytest.approx(joint[2], rel=1e-4, abs=1e-4)  # hinges along y; the cart pitches by 1e-3


def test_wheel_loads_are_carried_through_the_axles(make_model):
    """Vertical reaction at a wheel's hinge = minus (wheel load less the wheel's own weight), at rest."""
    scenario = Scenario(name="s", duration=5, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=5)
    simulation = Simulation(str(make_model(cart(5.0, 0.15, 0.165), scenario, plane())))
    simulation.settle()
    simulation.step(100)
    for reaction, wheel in zip(simulation.reactions(), simulation.wheels(), strict=True):
        assert -reaction[2] == pytest.approx(wheel[7] - 1.5 * EARTH, rel=1e-4)  # what is left of settling


def test_a_four_bar_linkage_closes_and_conserves_energy(make_model):
    """Two hanging rods and a bar between their ends, closed by a loop: a parallelogram, which swings like a pendulum.

    T = 1/2 (2 m l^2/3 + M l^2) w^2, V = -(2 m l/2 + M l) g cos q: period of small swings 2 pi sqrt((2m/3 + M) l / ((m + M) g)).
    """
    m, big, length = 1.0, 3.0, 0.5
    bodies = (
        box("left", m, (0, 0, -length / 2), (1e-3, 1e-3, length)),
        box("right", m, (1.0, 0, -length / 2), (1e-3, 1e-3, length)),
        box("bar", big, (0.5, 0, -length), (1.0, 1e-3, 1e-3)),
    )
    joints = (
        Joint(name="a", kind="hinge", parent=None, child="left", point=(0, 0, 0), axis=(0, 1, 0)),
        Joint(name="b", kind="hinge", parent=None, child="right", point=(1, 0, 0), axis=(0, 1, 0)),
        Joint(name="c", kind="hinge", parent="left", child="bar", point=(0, 0, -length), axis=(0, 1, 0)),
    )
    rover = Rover(bodies=bodies, joints=joints, loop_closures=(LoopClosure(name="d", body_a="bar", body_b="right", point=(1, 0, -length)),))
    from rille.model import InitialJointState

    start = tuple(InitialJointState(joint=j, position=s * 0.05) for j, s in (("a", 1), ("b", 1), ("c", -1)))
    simulation = Simulation(str(make_model(rover, free_space(duration=5.0, step=1e-4, gravity=(0, 0, -9.81), initial_states=start))))
    period = 2 * np.pi * np.sqrt((2 * m / 3 + big) * length / ((m + big) * 9.81))
    q = []
    for _ in range(round(period / 1e-4)):
        simulation.step(1)
        q.append(simulation.joints()[0][0])
    assert simulation.closure_error() < 1e-6
    assert q[-1] == pytest.approx(0.05, rel=2e-3)
    assert min(q) == pytest.approx(-0.05, rel=2e-3)
    energy = simulation.energy_balance()
    assert abs(energy["residual"]) < 1e-3 * 0.5 * (m + big) * 9.81 * length * 0.05**2 + 1e-4


@pytest.mark.parametrize("gains", [(5.0, 0.0), (5.0, 20.0)])
def test_a_pi_drive_follows_its_transfer_function(make_model, gains):
    """I w' = kp (w* - w) + ki Int(w* - w): P: w = w* (1 - exp(-kp t/I)); PI: second order. First order in h: 3e-3."""
    kp, ki = gains
    rover = flywheel(2.0, "speed", speed_gain=kp, integral_gain=ki)
    scenario = replace(free_space(duration=2.0), commands=(Command(drive="motor", time=0.0, value=1.5),))
    simulation = Simulation(str(make_model(rover, scenario)))
    w = simulation.sample(2000, 50, [("joint.velocity", "hub", 0)])[:, 0]
    t = 0.05 * np.arange(1, 41)
    if ki == 0:
        expected = 1.5 * (1 - np.exp(-kp * t / 2.0))
    else:
        root = np.sqrt(complex((kp / 4.0) ** 2 - ki / 2.0))
        a, b = -kp / 4.0 + root, -kp / 4.0 - root
        # w/w* = 1 + A e^(a t) + B e^(b t) with w(0) = 0, w'(0) = kp/I
        big_a = (kp / 2.0 + b) / (a - b)
        expected = 1.5 * np.real(1 + big_a * np.exp(a * t) + (-1 - big_a) * np.exp(b * t))
    assert w == pytest.approx(expected, abs=3e-3 * 1.5)


def test_an_integral_does_not_wind_up_at_the_largest_effort(make_model):
    rover = flywheel(2.0, "speed", speed_gain=50.0, integral_gain=200.0, max_torque=2.0)
    scenario = replace(free_space(duration=4.0), commands=(Command(drive="motor", time=0.0, value=1.5),))
    simulation = Simulation(str(make_model(rover, scenario)))
    w = simulation.sample(4000, 1, [("joint.velocity", "hub", 0)])[:, 0]
    assert w.max() < 1.5 * 1.15  # a frozen integral overshoots little; one that winds up would reach twice the speed
    assert w[-1] == pytest.approx(1.5, rel=1e-3)
