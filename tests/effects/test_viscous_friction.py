"""Speed decays as exp(-b t / I)."""

import numpy as np
import pytest

from effect_rigs import flywheel, sample, spinning
from rille.model import Effect


def test_exponential_decay(make_model):
    """The implicit row gives (1 + h b/I)^-n, which differs from exp(-b t/I) by (b/I)^2 h t / 2 = 5e-4 relative at h = 1 ms, t = 1 s."""
    path = make_model(flywheel(2.0), spinning(1.5), None, [Effect(kind="viscous_friction", parameters={"coefficient": 2.0})])
    w = sample(path, 1000, ("joint.velocity", "hub"), every=100)[:, 0]
    t = 0.1 * np.arange(1, 11)
    assert w == pytest.approx(1.5 * np.exp(-t), rel=6e-4)
    assert w == pytest.approx(1.5 * (1 + 1e-3) ** (-1000 * t), rel=1e-9)
