"""A displaced centre of mass is felt by the drive that holds it."""

import pytest

from effect_rigs import flywheel, free_space, sample
from rille.model import Effect


def test_holding_effort_is_weight_times_lever(make_model):
    """10 kg, 3 cm ahead of the hinge: gravity turns it by +m g x about y, the drive gives -m g x. Stiff servo: 1e-6."""
    effect = Effect(kind="com_offset", parameters={"x": 0.03})
    path = make_model(flywheel(2.0, "speed"), free_space(duration=0.5, gravity=(0, 0, -9.81)), None, [effect])
    assert sample(path, 500, ("joint.effort", "hub"), every=500)[0, 0] == pytest.approx(-10 * 9.81 * 0.03, rel=1e-5)
