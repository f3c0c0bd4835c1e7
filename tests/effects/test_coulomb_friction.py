"""Dry friction brakes uniformly, stops, and then holds."""

import numpy as np
import pytest

from effect_rigs import flywheel, sample, spinning
from rille.model import Effect


def test_uniform_braking_then_rest(make_model):
    """w = w_0 - tau t / I until I w_0 / tau = 2 s, then exactly 0. The bounded row gives each step the same impulse: rounding only."""
    path = make_model(flywheel(2.0), spinning(1.5, duration=3.0), None, [Effect(kind="coulomb_friction", parameters={"torque": 1.5})])
    w = sample(path, 3000, ("joint.velocity", "hub"), every=10)[:, 0]
    t = 0.01 * np.arange(1, 301)
    assert w == pytest.approx(np.maximum(0, 1.5 - 0.75 * t), abs=1e-7)
    assert abs(w[-1]) < 1e-12


def test_at_rest_it_holds_what_is_smaller_and_gives_way_to_what_is_larger(make_model):
    """A pendulum arm of m g l = 9.81 N m."""
    from effect_rigs import free_space

    rover = flywheel(2.0, offset=0.1)
    for torque, moves in ((10.0, False), (9.0, True)):
        scenario = free_space(duration=1.0, gravity=(0, 0, -9.81))
        path = make_model(rover, scenario, None, [Effect(kind="coulomb_friction", parameters={"torque": torque})])
        q = sample(path, 1000, ("joint.position", "hub"), every=1000)[0, 0]
        assert (abs(q) > 0.1) == moves
        if not moves:
            assert abs(q) < 1e-6  # the row is stiff, not rigid: tau h / (1e7 I) a step
