"""A pulse at a joint gives its impulse, wherever it lies in the steps."""

import pytest

from effect_rigs import commanded, flywheel, free_space, sample
from rille.model import Effect


@pytest.mark.parametrize(("start", "duration"), [(0.1, 0.2), (0.10033, 0.0123), (0.0501, 0.0004)])
@pytest.mark.parametrize("target", ["hub", "*"])
def test_angular_impulse(make_model, start, duration, target):
    """w = torque duration / inertia, exact also for pulses that begin, end or lie inside a step."""
    values = {"torque": -3.0, "start": start, "duration": duration}
    path = make_model(flywheel(2.0), free_space(), None, [Effect(kind="joint_pulse", target=target, parameters=values)])
    speed = sample(path, 400, ("joint.velocity", "hub"))[:, 0]
    assert speed[-1] == pytest.approx(-3.0 * duration / 2.0, rel=1e-9)
    assert speed[int(start / 1e-3) - 2] == 0


def test_it_adds_to_what_the_drive_gives(make_model):
    """A torque drive goes on with its own effort: the sensor of the effort does not see the pulse, the motion does."""
    values = {"torque": 3.0, "start": 0.1, "duration": 0.1}
    path = make_model(flywheel(2.0, "torque"), commanded(0.5), None, [Effect(kind="joint_pulse", target="hub", parameters=values)])
    speed, effort = sample(path, 400, ("joint.velocity", "hub"), ("joint.effort", "hub"))[-1]
    assert effort == pytest.approx(0.5)
    assert speed == pytest.approx((0.5 * 0.4 + 3.0 * 0.1) / 2.0, rel=1e-9)
