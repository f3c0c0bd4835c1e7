"""A formula over state variables: checked for its dimension, equal to the law that it writes out."""

import numpy as np
import pytest

from effect_rigs import commanded, flywheel, free_space, particle, sample, spinning, wheel_point
from rille import store
from rille.model import Effect, InputRefused


def joint(formula, constants, output="joint.effort"):
    return Effect(
        kind="expression", parameters={"formula": formula, "output": output, "target_kind": "joint", "constants": constants, "gain": 1.0}
    )


def test_viscous_friction_written_out_equals_the_law(make_model):
    """The slope against velocity is taken implicitly, by differences of 1e-6: 1e-9 for a linear law."""
    formula = joint("-k*velocity", {"k": [2.0, "N m s/rad"]})
    law = Effect(kind="viscous_friction", parameters={"coefficient": 2.0})
    w = [
        sample(make_model(flywheel(2.0), spinning(1.5), None, [e]), 1000, ("joint.velocity", "hub"), every=100)[:, 0]
        for e in (formula, law)
    ]
    assert w[0] == pytest.approx(w[1], rel=1e-6)


def test_a_spring_written_out_swings_with_its_period(make_model):
    """w = sqrt(k/I) = 2 rad/s, RK4 with the effort of the step's beginning: first order, 2e-3."""
    path = make_model(flywheel(2.0), spinning(0.4), None, [joint("-k*position", {"k": [8.0, "N m/rad"]})])
    q = sample(path, 1500, ("joint.position", "hub"))[:, 0]
    t = 1e-3 * np.arange(1, 1501)
    assert q == pytest.approx(0.2 * np.sin(2 * t), abs=2e-3 * 0.2)


def test_on_wheels_and_bodies(make_model):
    resist = {
        "formula": "-mu*normal_load*tanh(10*slip_ratio)",
        "output": "wheel.drawbar_pull",
        "target_kind": "wheel",
        "constants": {"mu": [0.1, "1"]},
    }
    base, pulled = wheel_point(), wheel_point(Effect(kind="expression", parameters=resist | {"gain": 1.0}))
    assert pulled["drawbar_pull"] - base["drawbar_pull"] == pytest.approx(-0.1 * 50 * np.tanh(3.0), rel=1e-9)
    drag = {
        "formula": "-c*vx*abs(vx)",
        "output": "part.force_x",
        "target_kind": "body",
        "constants": {"c": [2.0, "N s^2/m^2"]},
        "gain": 1.0,
    }
    path = make_model(particle(4.0), free_space(start_velocity=(2.0, 0, 0)), None, [Effect(kind="expression", parameters=drag)])
    v = sample(path, 1000, ("part.linear_velocity", "body", 0), every=1000)[0, 0]
    assert v == pytest.approx(2.0 / (1 + 2.0 * 2.0 / 4.0), rel=1e-3)


@pytest.mark.parametrize(
    ("formula", "constants", "word"),
    [
        ("-k*velocity", {"k": [2.0, "N m/rad"]}, "unit"),  # a stiffness is no friction
        ("sin(drive_effort)", {}, "unit"),  # the argument is no pure number
        ("-k*velocity + 1", {"k": [2.0, "N m s/rad"]}, "unit"),  # a bare number is no torque
        ("-k*speed", {"k": [2.0, "N m s/rad"]}, "speed"),  # no such variable
        ("-k*velocity)", {"k": [2.0, "N m s/rad"]}, "cannot be read"),
        ("-k*velocity", {"k": [2.0, "N furlong"]}, "furlong"),
        ("0*k*velocity", {"k": [2.0, "N m s/rad"]}, "zero"),
        ("", {}, "cannot be read"),
    ],
)
def test_what_cannot_be_is_a_sentence(make_model, formula, constants, word):
    path = make_model(flywheel(2.0, "torque"), commanded(1.0))
    store.write_effects(path, [joint(formula, constants)])
    with pytest.raises(InputRefused, match=word):
        sample(path, 1, ("joint.velocity", "hub"))
