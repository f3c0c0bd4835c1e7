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


@pytest.mark.parametrize("kind", ["joint_elasticity", "backlash"])
def test_a_stiff_transmission_is_none(make_model, kind):
    """A PI servo (K = 5 N m s/rad, K_i = 8 N m/rad) behind a stiff transmission without play moves a flywheel as it does without: I w' =
    K (w_c - w) + K_i Int (w_c - w), w = w_c (1 - e^(-a t) (cos b t - g sin b t)), a = K/2I = 1.25 /s, b^2 = K_i/I - a^2, g = (K/I - a)/b.
    The spring of 1e6 N m/rad gives by 1e-5 rad; both take the servo implicitly, an error of the order of a h = 1e-3.
    """
    rover = flywheel(2.0, "speed", speed_gain=5.0, integral_gain=8.0)
    numbers = {"joint_elasticity": {"compliance": 1e-6, "damping": 50.0}, "backlash": {"gap": 1e-9, "stiffness": 1e6, "damping": 50.0}}
    effects = ([], [Effect(kind=kind, parameters=numbers[kind])])
    base, stiff = (sample(make_model(rover, commanded(0.7), None, e), 1500, ("joint.velocity", "hub"))[:, 0] for e in effects)
    t = 1e-3 * np.arange(1, 1501)
    a, b = 1.25, np.sqrt(8 / 2 - 1.25**2)
    exact = 0.7 * (1 - np.exp(-a * t) * (np.cos(b * t) - (2.5 - a) / b * np.sin(b * t)))
    assert np.abs(base - exact).max() < 2e-3
    assert np.abs(stiff - base).max() < 2e-4


def test_a_servo_yields_and_twists_under_a_load(make_model):
    """A held arm of 9.81 N m: the servo gives way at tau/K = 9.81/981 = 0.01 rad/s, the spring by 1e-3 x 9.81 rad. Cosine: 4e-4 at most."""
    effect = Effect(kind="joint_elasticity", parameters={"compliance": 1e-3, "damping": 20.0})
    rover = flywheel(2.0, "speed", offset=0.1, speed_gain=981.0)
    path = make_model(rover, free_space(duration=3.0, gravity=(0, 0, -9.81)), None, [effect])
    q = sample(path, 2000, ("joint.position", "hub"))[:, 0]
    assert q[-1] == pytest.approx(0.02 + 9.81e-3, rel=2e-3)
    assert q[-1] - q[-501] == pytest.approx(0.5 * 0.01, rel=2e-3)
