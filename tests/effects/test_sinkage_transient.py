"""The depth that is dug approaches depth |s| exponentially while the wheel turns."""

import numpy as np
import pytest

from effect_rigs import rig_model, sample, wheel_point
from rille.model import Effect

EFFECT = Effect(kind="sinkage_transient", parameters={"depth": 0.02, "time_constant": 1.5})


def test_steady_sinkage_is_deeper_by_depth_times_slip():
    """The law is asked for the sinkage less what was dug: the forces stay, the wheel sits lower."""
    base, dug = wheel_point(slip=0.4), wheel_point(EFFECT, slip=0.4)
    assert dug["sinkage"] == pytest.approx(base["sinkage"] + 0.02 * 0.4, rel=1e-9)
    assert dug["drawbar_pull"] == pytest.approx(base["drawbar_pull"], rel=1e-9)


def test_history_is_exponential(make_model):
    """z(t) = z_s + 0.008 (1 - exp(-t/T)) on the rig.

    The dug depth is integrated exactly in each step, but slip settles over the first 0.2 s and the wheel follows its soil with a delay
    of c b l / (k b l) = 3e4/8e5 = 40 ms, which shifts the curve by up to 0.04/1.5 of its height: 3 % is asked for after 1 s.
    """
    z = sample(rig_model(make_model, EFFECT, slip=0.4, duration=9.0), 9000, ("wheel.sinkage", "wheel"), every=500)[:, 0]
    t = 0.5 * np.arange(1, len(z) + 1)
    expected = wheel_point(slip=0.4)["sinkage"] + 0.008 * (1 - np.exp(-t / 1.5))
    assert np.abs(z - expected)[2:].max() < 0.03 * 0.008
    assert z[-1] == pytest.approx(expected[-1], abs=2e-5)
