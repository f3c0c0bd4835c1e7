"""Pendulums: closed forms, measured order of convergence, energy."""

from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk

from machines import chain
from rille.model import InitialJointState, JointLimit, Scenario

GRAVITY = 9.80665  # [m/s^2]


def swing(make_model, rover, angles, step, integrator="auto", velocities=None):
    """Simulation of hanging rods released from the given angles [rad]."""
    velocities = velocities or [0.0] * len(angles)
    states = tuple(
        InitialJointState(joint=f"hinge{k + 1}", position=a, velocity=v) for k, (a, v) in enumerate(zip(angles, velocities, strict=True))
    )
    scenario = Scenario(name="swing", duration=60, step=step, integrator=integrator, initial_states=states)
    return Simulation(str(make_model(rover, scenario)))


@pytest.mark.parametrize("amplitude", [0.1, 1.0, 2.5])
def test_period_of_a_pendulum_is_the_elliptic_integral(make_model, amplitude):
    """T = 4 K(sin^2(a/2)) sqrt(I / (m g d)) (Landau & Lifshitz, Mechanics, sec. 11), I about the hinge, d to the centre of mass.

    The quarter period is the first zero of the angle, interpolated by a cubic through position and velocity at both ends
    of a step: error (h w)^4 / 384, far below the 1e-9 s that are asked for. The hinge's zero is where it hangs straight down.
    """
    rover = chain([0.7], [1.3])
    properties = rover.bodies[0].properties
    d = 0.35
    inertia = properties.inertia[1, 1] + properties.mass * d**2
    expected = ellipk(np.sin(amplitude / 2) ** 2) * np.sqrt(inertia / (properties.mass * GRAVITY * d))
    h = 1e-3
    simulation = swing(make_model, rover, [amplitude], h)
    previous = simulation.joints()[0]
    while True:
        simulation.step(1)
        state = simulation.joints()[0]
        if state[0] <= 0:
            break
        previous = state

    def hermite(u):
        return (
            (1 + 2 * u) * (1 - u) ** 2 * previous[0]
            + u * (1 - u) ** 2 * h * previous[1]
            + u**2 * (3 - 2 * u) * state[0]
            + u**2 * (u - 1) * h * state[1]
        )

    quarter = simulation.time - h + h * brentq(hermite, 0, 1, xtol=1e-14)
    assert quarter == pytest.approx(expected, abs=1e-9)


def double_pendulum_reference(rover, angles, duration):
    """Angles (absolute) of two rods by Lagrange's equations in DOP853 at 1e-13: no code in common with the solver."""
    (m1, m2), lengths = [b.properties.mass for b in rover.bodies], [0.5, 0.4]
    c1, c2 = lengths[0] / 2, lengths[1] / 2
    i1, i2 = (b.properties.inertia[1, 1] for b in rover.bodies)
    l1 = lengths[0]

    def derivative(_, state):
        a, b, da, db = state  # absolute angles from the downward vertical
        mass = np.array([[i1 + m1 * c1**2 + m2 * l1**2, m2 * l1 * c2 * np.cos(a - b)], [m2 * l1 * c2 * np.cos(a - b), i2 + m2 * c2**2]])
        force = np.array(
            [
                -m2 * l1 * c2 * np.sin(a - b) * db**2 - (m1 * c1 + m2 * l1) * GRAVITY * np.sin(a),
                m2 * l1 * c2 * np.sin(a - b) * da**2 - m2 * c2 * GRAVITY * np.sin(b),
            ]
        )
        return [da, db, *np.linalg.solve(mass, force)]

    start = [angles[0], angles[0] + angles[1], 0, 0]
    solution = solve_ivp(derivative, (0, duration), start, method="DOP853", rtol=1e-13, atol=1e-13)
    a, b = solution.y[:2, -1]
    return np.array([a, b - a])


@pytest.mark.parametrize(("integrator", "steps", "order"), [("rk4", (8e-3, 4e-3, 2e-3), 4), ("semi_implicit_euler", (4e-3, 2e-3, 1e-3), 1)])
def test_double_pendulum_converges_at_the_order_of_its_scheme(make_model, integrator, steps, order):
    """Halving the step must divide the error by 2^order: the slope over three steps is the order, within 0.3
    (the largest steps are not yet in the asymptotic range).

    2 s of a lively but not yet chaotic swing (energy below the separatrix), against Lagrange's equations at 1e-13.
    """
    rover = chain([0.5, 0.4], [1.0, 0.7])
    angles = [1.2, -0.5]
    duration = 1.92  # a multiple of every step
    reference = double_pendulum_reference(rover, angles, duration)
    errors = []
    for step in steps:
        simulation = swing(make_model, rover, angles, step, integrator)
        simulation.step(round(duration / step))
        errors.append(np.abs(simulation.joints()[:, 0] - reference).max())
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    print(f"{integrator}: errors {errors}, order {slope:.2f}")
    assert slope == pytest.approx(order, abs=0.3)


def test_double_pendulum_at_one_millisecond(make_model):
    """The default scheme at the default step: 3e-10 rad was measured in the design study; an order of margin is given."""
    rover = chain([0.5, 0.4], [1.0, 0.7])
    angles = [1.2, -0.5]
    simulation = swing(make_model, rover, angles, 1e-3)
    simulation.step(2000)
    error = np.abs(simulation.joints()[:, 0] - double_pendulum_reference(rover, angles, 2.0)).max()
    print(f"error after 2 s at 1 ms: {error:.2e} rad")
    assert error < 3e-9


def test_energy_of_a_passive_mechanism(make_model):
    """Nothing drives and nothing brakes, so the energy stays.

    A chaotic double pendulum for 10 s: Runge-Kutta's drift was measured as 1e-7 of the energy in play at 1 ms. (The first-order
    scheme that rows need drifts by 15 % on the same swing, which is why passive mechanisms do not use it.)
    """
    simulation = swing(make_model, chain([0.5, 0.4], [1.0, 0.7]), [2.5, 1.0], 1e-3)
    energies = []
    for _ in range(500):
        energies.append(simulation.kinetic_energy + simulation.potential_energy)
        simulation.step(20)
    in_play = energies[0] - (-1.0 * GRAVITY * 0.25 - 0.7 * GRAVITY * 0.7)  # above the hanging rest
    spread = (max(energies) - min(energies)) / in_play
    print(f"spread {spread:.1e} of the energy in play")
    assert spread < 5e-7


def test_a_limit_stops_a_pendulum_and_takes_its_energy(make_model):
    """An inelastic stop: the rod arrives, stays within 1e-6 rad of the limit and does not bounce back with energy."""
    rover = chain([0.5], [1.0])
    rover = replace(rover, joints=(replace(rover.joints[0], limit=JointLimit(lower=0.3, upper=2.0)),))
    simulation = swing(make_model, rover, [1.0], 1e-3)
    simulation.step(3000)
    position, velocity = simulation.joints()[0, :2]
    assert position == pytest.approx(0.3, abs=1e-6)
    assert velocity == pytest.approx(0, abs=1e-6)


def test_an_elastic_stop_gives_way_by_its_stiffness(make_model):
    """Statics: k d = m g l/2 sin(q) where the rod leans on the stop; the damping brings it to rest (1e-9: ten time constants)."""
    rover = chain([0.5], [1.0])
    limit = JointLimit(lower=0.3, upper=2.0, stiffness=200.0, damping=4.0)
    simulation = swing(make_model, replace(rover, joints=(replace(rover.joints[0], limit=limit),)), [1.0], 1e-3)
    simulation.step(5000)
    position, velocity = simulation.joints()[0, :2]
    assert velocity == pytest.approx(0, abs=1e-9)
    assert 200.0 * (0.3 - position) == pytest.approx(1.0 * GRAVITY * 0.25 * np.sin(position), rel=1e-7)


def test_an_undamped_stop_throws_the_pendulum_back(make_model):
    """Energy: the rod returns to where it was let go, less what the implicit step loses, which halves with the step (order 1)."""
    rover = chain([0.5], [1.0])
    limit = JointLimit(lower=0.3, upper=2.0, stiffness=200.0)
    rover = replace(rover, joints=(replace(rover.joints[0], limit=limit),))
    lost = []
    for step in (2e-4, 1e-4):
        simulation = swing(make_model, rover, [1.0], step)
        angles = []
        while simulation.time < 1.2:
            simulation.step(10)
            angles.append(simulation.joints()[0, 0])
        deepest = int(np.argmin(angles[: len(angles) // 2]))
        assert angles[deepest] < 0.29  # it went into the stop
        lost.append(1.0 - max(angles[deepest:]))
    assert 0 < lost[1] < 0.02
    assert lost[0] / lost[1] == pytest.approx(2.0, abs=0.2)
