"""A pulse gives its impulse, wherever it lies in the steps."""

import numpy as np
import pytest

from effect_rigs import free_space, particle, sample
from rille.model import Effect


@pytest.mark.parametrize(("start", "duration"), [(0.1, 0.2), (0.10033, 0.0123), (0.0501, 0.0004)])
def test_impulse_and_angular_impulse(make_model, start, duration):
    """Exact also for pulses that begin, end or lie inside a step. The torque is along a principal axis: no gyroscopic part."""
    values = {"force_x": 8.0, "force_z": -3.0, "torque_z": 0.2, "start": start, "duration": duration}
    path = make_model(particle(4.0), free_space(), None, [Effect(kind="external_pulse", target="body", parameters=values)])
    v = sample(path, 400, *(("part.linear_velocity", "body", k) for k in range(3)), ("part.angular_velocity", "body", 2), every=400)[0]
    inertia = 4.0 * (0.3**2 + 0.2**2) / 12
    assert v == pytest.approx(np.array([8.0 / 4.0, 0, -3.0 / 4.0, 0.2 / inertia]) * duration, rel=1e-9, abs=1e-12)
