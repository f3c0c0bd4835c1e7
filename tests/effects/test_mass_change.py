"""A heavier body accelerates less, and turns with more inertia."""

import pytest

from effect_rigs import free_space, particle, sample
from rille.model import Effect

PULSE = Effect(kind="external_pulse", parameters={"force_x": 8.0, "start": 0.1, "duration": 0.5})
TWIST = Effect(kind="external_pulse", parameters={"torque_z": 0.1, "start": 0.1, "duration": 0.5})


def test_dv_is_impulse_per_mass_and_inertia_scales(make_model):
    heavier = Effect(kind="mass_change", parameters={"mass": 1.0})
    answers = []
    for effects in ([PULSE, TWIST], [heavier, PULSE, TWIST]):
        channels = (("part.linear_velocity", "body", 0), ("part.angular_velocity", "body", 2))
        answers.append(sample(make_model(particle(4.0), free_space(), None, effects), 1000, *channels, every=1000)[0])
    assert answers[0] == pytest.approx([8.0 * 0.5 / 4.0, 0.1 * 0.5 / (4.0 * (0.3**2 + 0.2**2) / 12)], rel=1e-9)
    assert answers[1] == pytest.approx(answers[0] * 4 / 5, rel=1e-9)


def test_a_body_without_mass_is_refused(make_model):
    from rille.model import InputRefused

    path = make_model(particle(4.0), free_space(), None, [Effect(kind="mass_change", parameters={"mass": -4.0})])
    with pytest.raises(InputRefused, match="without mass"):
        sample(path, 1, ("part.position", "body", 0))
