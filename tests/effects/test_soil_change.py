"""Inside a circle the soil is another one."""

from dataclasses import replace

import numpy as np
import pytest

from effect_rigs import LUNAR_SOIL, rig_model, sample, scaled, wheel_point
from rille.model import Effect


def test_a_wheel_that_crosses_it_sinks_as_on_that_soil(make_model):
    """The rig drives at 5 cm/s from x = 0 through a circle around x = 0.5 m of radius 0.2 m.

    The soil changes at an edge; 1 s behind it the damped soil (40 ms) is at rest to e^-25, so that 1e-4 of the sinkage is asked for.
    """
    change = {"stiffness_change": -0.4, "cohesion_change": 0.5, "friction_change": -0.1, "center_x": 0.5, "center_y": 0.0, "radius": 0.2}
    effect = Effect(kind="soil_change", parameters=change)
    soil = replace(scaled(0.6), cohesion=1.5 * LUNAR_SOIL.cohesion, friction_angle=np.arctan(0.9 * np.tan(LUNAR_SOIL.friction_angle)))
    x, z = sample(rig_model(make_model, effect, duration=18.0), 18000, ("joint.position", "rail"), ("wheel.sinkage", "wheel"), every=10).T
    inside = z[(x > 0.36) & (x < 0.69)]
    outside = z[((x > 0.1) & (x < 0.29)) | (x > 0.78)]
    assert inside == pytest.approx(wheel_point(soil=soil)["sinkage"], rel=1e-4)
    assert outside == pytest.approx(wheel_point()["sinkage"], rel=1e-4)
