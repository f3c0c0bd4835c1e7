"""Static twist = compliance x torque; free vibration at 1/sqrt(compliance I)."""

import numpy as np
import pytest

from effect_rigs import commanded, flywheel, free_space, sample
from rille.model import Effect, InitialJointState


def test_static_twist(make_model):
    """A held arm of m g l = 9.81 N m twists by 1e-3 x 9.81 rad; cos of that angle changes it by 5e-5."""
    effect = Effect(kind="joint_elasticity", parameters={"compliance": 1e-3, "damping": 20.0})
    rover = flywheel(2.0, "speed", offset=0.1)
    path = make_model(rover, free_space(duration=3.0, gravity=(0, 0, -9.81)), None, [effect])
    q, effort = sample(path, 3000, ("joint.position", "hub"), ("joint.effort", "hub"), every=3000)[0]
    assert q == pytest.approx(9.81e-3, rel=2e-4)
    assert effort == pytest.approx(-9.81, rel=2e-4)


def test_free_vibration(make_model):
    """w = 1/sqrt(2e-3 x 2) = 15.8 rad/s. At h = 0.1 ms the implicit spring damps by w^2 h/2 = 1.2e-2 per s."""
    effect = Effect(kind="joint_elasticity", parameters={"compliance": 2e-3, "damping": 0.0})
    scenario = free_space(duration=2.0, step=1e-4, initial_states=(InitialJointState(joint="hub", velocity=0.1),))
    q = sample(make_model(flywheel(2.0, "speed"), scenario, None, [effect]), 10000, ("joint.position", "hub"))[:, 0]
    t = 1e-4 * np.arange(1, 10001)
    w = 1 / np.sqrt(4e-3)
    expected = 0.1 / w * np.sin(w * t) * np.exp(-0.5 * w * w * 1e-4 * t)
    assert np.abs(q - expected).max() < 0.01 * 0.1 / w


def test_a_torque_drive_accelerates_rotor_and_joint_together(make_model):
    """Stiff transmission: w = tau t / (I + J) with the rotor's inertia J at the joint."""
    effect = Effect(kind="joint_elasticity", parameters={"compliance": 1e-5, "damping": 50.0, "rotor_inertia": 0.5})
    w = sample(make_model(flywheel(2.0, "torque"), commanded(3.0), None, [effect]), 1000, ("joint.velocity", "hub"), every=1000)[0, 0]
    assert w == pytest.approx(3.0 / 2.5, rel=1e-3)
