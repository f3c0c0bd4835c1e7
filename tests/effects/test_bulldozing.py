"""The front of the wheel pushes soil with Rankine's passive pressure."""

import numpy as np
import pytest

from effect_rigs import EARTH, LUNAR_SOIL, wheel_point
from rille.model import Effect


@pytest.mark.parametrize("slip", [0.0, 0.4])
def test_drawbar_pull_falls_by_the_passive_pressure(slip):
    """R = b (gamma z^2 Kp / 2 + 2 c z sqrt(Kp)), evaluated here by itself; load and sinkage do not change."""
    base = wheel_point(slip=slip, load=100.0)
    pushed = wheel_point(Effect(kind="bulldozing", parameters={"efficiency": 0.7}), slip=slip, load=100.0)
    z, gamma, kp = base["sinkage"], LUNAR_SOIL.density * EARTH, np.tan(np.pi / 4 + LUNAR_SOIL.friction_angle / 2) ** 2
    resistance = 0.165 * (gamma * z**2 * kp / 2 + 2 * LUNAR_SOIL.cohesion * z * np.sqrt(kp))
    assert base["drawbar_pull"] - pushed["drawbar_pull"] == pytest.approx(0.7 * resistance, rel=1e-9)
    assert pushed["sinkage"] == base["sinkage"]
    assert pushed["drive_torque"] == base["drive_torque"]


def test_the_rig_feels_it_too():
    effect = Effect(kind="bulldozing", parameters={"efficiency": 1.0})
    quasi, dynamic = wheel_point(effect), wheel_point(effect, method="dynamic")
    assert dynamic["drawbar_pull"] == pytest.approx(quasi["drawbar_pull"], abs=0.01 * 50)
