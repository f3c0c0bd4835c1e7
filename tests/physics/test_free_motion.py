"""Bodies without contact: closed forms and conservation."""

import numpy as np
import pytest
from rille._solver import Simulation

from machines import box, free_arm
from rille.model import Pose, Rover, Scenario

GRAVITY = 9.80665  # [m/s^2]


@pytest.mark.parametrize(("integrator", "discrete"), [("auto", 0.0), ("semi_implicit_euler", 1.0)])
def test_free_fall(make_model, integrator, discrete):
    """Free fall: z = z0 + v t - g t^2 / 2.

    Runge-Kutta of order 4 integrates a parabola exactly. Semi-implicit Euler must give its own discrete twin: the sum of
    n velocities, -g h^2 n (n + 1) / 2, which lies g t h / 2 below. Tolerance: rounding of 2000 additions of size 10.
    """
    h, n = 1e-3, 2000
    scenario = Scenario(name="fall", duration=2, step=h, integrator=integrator, start=Pose(position=(0, 0, 5)), start_velocity=(1, 0, 3))
    simulation = Simulation(str(make_model(Rover(bodies=(box("stone", 2, (0, 0, 0), (1, 1, 1)),)), scenario)))
    assert simulation.step(n) == "running"
    t = n * h
    expected = 5 + 3 * t - GRAVITY * (t**2 + discrete * t * h) / 2
    body = simulation.bodies()[0]
    assert body[2] == pytest.approx(expected, abs=1e-11)
    assert body[0] == pytest.approx(t, abs=1e-11)
    assert body[9] == pytest.approx(3 - GRAVITY * t, abs=1e-11)


def test_momentum_is_conserved_without_gravity(make_model):
    """A free tumbling arm keeps momentum and angular momentum.

    No external force, so both are constant; what remains is the Runge-Kutta error of the rotation, which must fall by
    about 2^4 when the step is halved. At 1 ms and 3 rad/s it is below 1e-10 of the size of the momenta.
    """
    errors = []
    for step in (2e-3, 1e-3):
        scenario = Scenario(
            name="float",
            duration=2,
            step=step,
            gravity=(0, 0, 0),
            start_velocity=(0.3, -0.2, 0.1),
            start_angular_velocity=(1.0, -2.0, 1.5),
        )
        simulation = Simulation(str(make_model(free_arm(), scenario)))
        before = simulation.momentum[0]
        simulation.step(round(2 / step))
        errors.append(np.abs(simulation.momentum[0] - before).max() / np.abs(before).max())
    assert errors[1] < 1e-10
    assert errors[0] / errors[1] > 10 or errors[0] < 1e-13


def test_symmetric_top_precesses_at_its_own_rate(make_model):
    """A torque-free symmetric body: in its own frame the angular velocity turns at (I3 - I1)/I1 w3 (Landau & Lifshitz, sec. 35).

    After the time 2 pi / rate the angular velocity in body axes is the same again; tolerance from the fourth-order error.
    """
    body = box("top", 3, (0, 0, 0), (0.4, 0.4, 0.1))
    i1, i3 = body.properties.inertia[0, 0], body.properties.inertia[2, 2]
    omega = np.array([0.5, 0.0, 4.0])
    period = 2 * np.pi / abs((i3 - i1) / i1 * omega[2])
    n = 2000
    scenario = Scenario(name="top", duration=period, step=period / n, gravity=(0, 0, 0), start_angular_velocity=tuple(omega))
    simulation = Simulation(str(make_model(Rover(bodies=(body,)), scenario)))
    simulation.step(n)
    state = simulation.bodies()[0]
    w, x, y, z = state[3:7]
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    assert rotation.T @ state[10:13] == pytest.approx(omega, abs=1e-8)
