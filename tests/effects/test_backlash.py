"""The motor runs through the play before it takes the joint along."""

import numpy as np
import pytest

from effect_rigs import commanded, flywheel, sample
from rille.model import Command, Effect


def test_reversal_costs_the_full_play(make_model):
    """Motor at +-0.5 rad/s, play 0.05 rad, joint held by dry friction in the play.

    From the middle of the play the joint starts after 0.025/0.5 = 0.05 s and lags by half the play; after the reversal at 1 s it stands for
    0.05/0.5 = 0.1 s. The teeth give by torque/stiffness = 1/1e5 = 1e-5 rad.
    """
    from dataclasses import replace

    effects = [
        Effect(kind="backlash", parameters={"gap": 0.05, "stiffness": 1e5, "damping": 50.0}),
        Effect(kind="coulomb_friction", parameters={"torque": 1.0}),
    ]
    scenario = commanded(0.5, duration=2.0)
    scenario = replace(scenario, commands=(*scenario.commands, Command(drive="motor", time=1.0, value=-0.5)))
    q, w = sample(
        make_model(flywheel(0.02, "speed"), scenario, None, effects), 2000, ("joint.position", "hub"), ("joint.velocity", "hub")
    ).T
    t = 1e-3 * np.arange(1, 2001)
    assert np.abs(q[t < 0.048]).max() < 1e-6
    motor = np.where(t < 1, 0.5 * t, 1.0 - 0.5 * t)
    ahead, back = (t > 0.2) & (t < 0.99), (t > 1.3)
    assert (motor - q)[ahead] == pytest.approx(0.025, abs=2e-4)
    assert (motor - q)[back] == pytest.approx(-0.025, abs=2e-4)
    assert np.abs(w[(t > 1.02) & (t < 1.095)]).max() < 1e-3
