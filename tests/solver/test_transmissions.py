"""What a motor can give, and how fast it turns, is the same with a transmission between it and the joint."""

from dataclasses import replace

import numpy as np
import pytest

from effect_rigs import commanded, flywheel, free_space, sample
from rille.model import Command, Effect, InitialJointState

TRANSMISSIONS = {
    "elastic": Effect(kind="joint_elasticity", parameters={"compliance": 1e-5, "damping": 50.0}),
    "with play": Effect(kind="backlash", parameters={"gap": 1e-6, "stiffness": 1e5, "damping": 50.0}),
}
LINE = Effect(kind="motor_saturation", parameters={"inverse_no_load_speed": 0.25})


@pytest.mark.parametrize("transmission", TRANSMISSIONS.values(), ids=TRANSMISSIONS)
@pytest.mark.parametrize("rotor", [1e-9, 0.5])
@pytest.mark.parametrize("mode", ["speed", "torque"])
def test_run_up_against_the_torque_speed_line(make_model, mode: str, rotor: float, transmission: Effect):
    """w = w_0 (1 - exp(-tau_max t/(I w_0))), as without it. The rotor of a torque drive is carried along, a servo has none. First order in
    h and in the twist of 1e-4 rad.
    """
    heavy = replace(transmission, parameters={**transmission.parameters, "rotor_inertia": rotor})
    path = make_model(flywheel(2.0, mode, max_torque=10.0), commanded(100.0, duration=3.0), None, [heavy, LINE])
    w = sample(path, 3000, ("joint.velocity", "hub"), every=100)[:, 0]
    t = 0.1 * np.arange(1, 31)
    inertia = 2.0 + (rotor if mode == "torque" else 0.0)
    assert w == pytest.approx(4.0 * (1 - np.exp(-10.0 * t / (inertia * 4.0))), rel=5e-3)


@pytest.mark.parametrize("transmission", TRANSMISSIONS.values(), ids=TRANSMISSIONS)
@pytest.mark.parametrize("gain", [None, 1.5, 50.0])
def test_what_the_line_does_not_reach_is_as_it_was(make_model, gain: float | None, transmission: Effect):
    """The law only ends efforts: a servo far below its line moves the joint as without the law."""
    rover = flywheel(2.0, "speed", max_torque=10.0)
    soft = replace(rover, drives=tuple(replace(d, speed_gain=gain) for d in rover.drives))
    far = Effect(kind="motor_saturation", parameters={"inverse_no_load_speed": 0.02})
    slow = Effect(kind="motor_lag", parameters={"time_constant": 1.0})
    seen = [
        sample(make_model(soft, commanded(2.0), None, [transmission, slow, *more]), 1000, ("joint.velocity", "hub"), every=50)[:, 0]
        for more in ([], [far])
    ]
    assert seen[1] == pytest.approx(seen[0], rel=1e-9)


@pytest.mark.parametrize("transmission", TRANSMISSIONS.values(), ids=TRANSMISSIONS)
def test_back_emf_brakes_what_is_driven(make_model, transmission: Effect):
    """A flywheel at 6 rad/s and a torque drive that is told 0 N m: faster than w_0 = 4 rad/s the supply has not even these to give, tau =
    -10 (w/4 - 1), until 4 rad/s are reached.
    """
    scenario = commanded(0.0, duration=2.0)
    scenario = replace(scenario, initial_states=(InitialJointState(joint="hub", velocity=6.0),))
    w = sample(make_model(flywheel(2.0, "torque", max_torque=10.0), scenario, None, [transmission, LINE]), 2000, ("joint.velocity", "hub"))
    t = 1e-3 * np.arange(1, 2001)
    assert w[:, 0] == pytest.approx(4.0 + 2.0 * np.exp(-2.5 * t / 2.0), rel=3e-3)


@pytest.mark.parametrize("transmission", TRANSMISSIONS.values(), ids=TRANSMISSIONS)
def test_the_supply_of_a_torque_drive_sags(make_model, transmission: Effect):
    """Against 2 N m s/rad: w = tau/2, tau = 6/(1 + 0.2 6/10), after four time constants I/b of 1 s within exp(-8)."""
    effects = [
        transmission,
        Effect(kind="supply_sag", parameters={"sag": 0.2}),
        Effect(kind="viscous_friction", parameters={"coefficient": 2.0}),
    ]
    path = make_model(flywheel(2.0, "torque", max_torque=10.0), commanded(6.0, duration=8.0), None, effects)
    assert sample(path, 8000, ("joint.velocity", "hub"), every=8000)[0, 0] == pytest.approx(3.0 / 1.12, rel=1e-3)


@pytest.mark.parametrize("transmission", TRANSMISSIONS.values(), ids=TRANSMISSIONS)
def test_a_rotor_turns_with_its_joint_from_the_start(make_model, transmission: Effect):
    """Nothing is commanded, so that the momentum stays. A rotor that began at rest would take a fifth of it."""
    heavy = replace(transmission, parameters={**transmission.parameters, "rotor_inertia": 0.5})
    scenario = free_space(duration=1.0, initial_states=(InitialJointState(joint="hub", velocity=0.7),))
    w = sample(make_model(flywheel(2.0, "torque"), scenario, None, [heavy]), 1000, ("joint.velocity", "hub"), every=100)
    assert w[:, 0] == pytest.approx(0.7, rel=1e-3)


def test_an_integral_does_not_wind_up_at_the_line(make_model):
    """A PI servo that is softer than its line is told 5 rad/s, of which 2 are possible, and after 3 s 1 rad/s. Wound up by 9 rad it would
    go on at 2 rad/s for seconds. As it is, it comes down like the servo that it is, with rates of 0.5 and 1 /s (2 s^2 + 3 s + 1 = 0): after
    3 s within exp(-1.5) of what the integral had from the run-up, less than 1 rad.
    """
    rover = flywheel(2.0, "speed", max_torque=10.0)
    soft = replace(rover, drives=tuple(replace(d, speed_gain=3.0, integral_gain=1.0) for d in rover.drives))
    line = Effect(kind="motor_saturation", parameters={"inverse_no_load_speed": 0.5})
    scenario = commanded(5.0, duration=8.0)
    scenario = replace(scenario, commands=(*scenario.commands, Command(drive="motor", time=3.0, value=1.0)))
    w = sample(make_model(soft, scenario, None, [line]), 8000, ("joint.velocity", "hub"), every=1000)[:, 0]
    assert w[2] == pytest.approx(2.0, rel=0.02)
    assert w[5:] == pytest.approx(1.0, abs=0.2)
