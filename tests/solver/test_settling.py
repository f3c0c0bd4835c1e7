"""Coming to rest lies before t = 0: what has a time does not act in it, and what happens in it is not told as if it were later."""

from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation

from effect_rigs import commanded, flywheel, free_space, sample
from machines import cart, plane
from rille import simulate, store
from rille.model import Effect, JointLimit, Scenario

DAMPED = Effect(kind="viscous_friction", target="hub", parameters={"coefficient": 20.0})
RAMP = {"formula": "k*time", "output": "joint.effort", "target_kind": "joint", "constants": {"k": [40.0, "N m/s"]}, "gain": 1.0}


@pytest.mark.parametrize(
    ("mode", "law"),
    [
        (None, Effect(kind="joint_pulse", target="hub", parameters={"torque": 3.0, "start": 0.05, "duration": 0.2})),
        (None, Effect(kind="joint_pulse", target="hub", parameters={"torque": 3.0, "start": 0.0, "duration": 0.2})),
        (None, Effect(kind="external_pulse", target="disc", parameters={"torque_y": 3.0, "start": 0.0, "duration": 0.2})),
        (None, Effect(kind="expression", target="hub", parameters=RAMP)),
        ("speed", Effect(kind="motor_lag", parameters={"time_constant": 0.1})),
        ("torque", Effect(kind="motor_lag", parameters={"time_constant": 0.1})),
    ],
)
def test_what_has_a_time_waits_for_it(make_model, mode, law):
    """A wheel at rest settles at once: the run is, to the bit, that without settling. A motor hears its command at t = 0."""
    scenario = free_space() if mode is None else commanded(1.5)
    runs = []
    for most in (0.0, 2.0):
        path = make_model(flywheel(2.0, mode), replace(scenario, settle_time=most), None, [DAMPED, law])
        runs.append(sample(path, 400, ("joint.position", "hub"), ("joint.velocity", "hub")))
    assert np.abs(runs[0]).max() > 1e-3
    assert np.array_equal(*runs)


def test_what_happened_before_is_told_as_such(make_model):
    """A pendulum that hung at an angle falls onto its limit, and lies there when t = 0 comes."""
    hinge = flywheel(2.0, offset=0.3)
    rover = replace(hinge, joints=(replace(hinge.joints[0], limit=JointLimit(lower=-0.2, upper=0.2)),))
    path = make_model(rover, free_space(gravity=(0.0, 0.0, -9.8), settle_time=5.0), None, [DAMPED])
    simulation = Simulation(str(path))
    assert simulation.settle() == "running"
    times, kinds, subjects, messages = zip(*simulation.events(), strict=True)
    assert times == (0.0, 0.0)
    assert kinds == ("limit_reached", "settled")
    assert subjects == ("hub", "")
    assert messages[0].endswith("s into settling")


def test_the_drop_to_the_ground_leaves_no_rut(make_model):
    """Wheels that are placed on the ground fall into it and swing past where they come to rest: the soil remembers where they stand.

    They swing 2 % too deep; a rut is kept in single precision, and what is left of the swing when they count as settled is below 0.3 %.
    """
    scenario = Scenario(name="rest", duration=0.1, step=1e-3, terrain="plane", placement="on_terrain", settle_time=10.0)
    path = make_model(cart(5.0, 0.15, 0.165), scenario, plane())
    simulation = Simulation(str(path))
    swing = 0.0
    for _ in range(1000):
        simulation.step(1)
        swing = max(swing, float(simulation.wheels()[:, 6].max()))
    stands = float(simulation.wheels()[:, 6].max())
    assert swing > 1.015 * stands
    assert simulate.run(path).status == "done"
    left = store.read_ruts(path, 1)
    assert left is not None
    assert left.sinkage.max() == pytest.approx(stands, rel=3e-3)
