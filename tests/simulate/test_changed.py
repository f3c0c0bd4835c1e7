"""A model with something changed: the same as a database in which it was written, many at once as each alone."""

import numpy as np
import pytest

from effect_rigs import EARTH
from machines import cart, plane
from rille import simulate
from rille.model import Command, Effect, InputRefused, Scenario
from rille.model.recording import Channel, Recording

CHANNELS = [
    Channel(name=c, quantity="part.position", target="chassis", component=c, unit="m") for c in "xyz"
] + [Channel(name="yaw", quantity="part.orientation", target="chassis", component="yaw", unit="rad")]  # fmt: skip
CHANNELS.append(Channel(name="effort", quantity="joint.effort", target="wheel_front_left", unit="N m"))
FRICTION = Effect(kind="viscous_friction", target="*", parameters={"coefficient": 0.3})
HEAVY = Effect(kind="mass_change", target="chassis", parameters={"mass": 2.0})
ASIDE = Effect(kind="com_offset", target="chassis", parameters={"y": 0.1})


def model(make_model, *effects):
    """A cart that turns as it drives."""
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.1, value=2.0 if "left" in d.name else 1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=2, step=2e-3, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=1, commands=commands
    )
    return make_model(rover, scenario, plane(0.05), effects)


def windows(replayer, n=4, length=0.3):
    """States along the replayer's own run, stops, picks."""
    states = [replayer.rest()]
    for _ in range(n - 1):
        states.append(replayer.advance(states[-1], states[-1][0] + length)[0])
    states = np.array(states)
    time = np.arange(1, round(n * length / 0.02)) * 0.02
    return states, states[:, 0] + length, [(np.minimum((time / length).astype(np.int64), n - 1), time)] * len(CHANNELS)


@pytest.mark.parametrize("effect", [FRICTION, HEAVY, ASIDE], ids=lambda e: e.kind)
def test_it_is_the_model_that_would_have_been_written(make_model, effect):
    """To the last bit, also where a changed mass moves the frame that the solver puts the root in."""
    base = simulate.Replayer(model(make_model))
    states, stops, picks = windows(base)
    written = simulate.Replayer(model(make_model, effect)).predict(states[None], stops, CHANNELS, picks)
    changed = base.changed([effect])
    for a, b in zip(written, changed.predict(states[None], stops, CHANNELS, picks), strict=True):
        assert (a == b).all()
    together = base.predict_many([base, changed, base], states, stops, CHANNELS, picks)
    for a, b, c in zip(base.predict(states[None], stops, CHANNELS, picks), written, together, strict=True):
        assert (c[0] == a[0]).all()
        assert (c[1] == b[0]).all()
        assert (c[2] == a[0]).all()
    assert max(np.abs(a - b).max() for a, b in zip(base.predict(states[None], stops, CHANNELS, picks), written, strict=True)) > 1e-6


def test_effects_come_on_top_and_numbers_are_absolute(make_model):
    """Twice the friction as two effects or as one; a number that is set stands among the facts; what is left out is the catalogue's."""
    base = simulate.Replayer(model(make_model, FRICTION))
    states, stops, picks = windows(base)
    twice = base.changed([FRICTION])
    doubled = base.changed(parameters={"effect.viscous_friction.*.coefficient": 0.6})
    assert doubled.machine().parameters["effect.viscous_friction.*.coefficient"] == (0.6, 0.0, 1000.0)
    found = base.predict_many([twice, doubled], states, stops, CHANNELS, picks)
    assert all(np.abs(values[0] - values[1]).max() < 1e-9 for values in found)
    assert [e.kind for e in twice.machine().effects] == ["viscous_friction"] * 2
    digging = base.changed([Effect(kind="sinkage_transient", parameters={"depth": 0.01})])
    assert digging.has_memory
    assert digging.machine().effects[-1].parameters == {"depth": 0.01, "time_constant": 3.0}
    assert base.changed([Effect(kind="sinkage_transient")]).machine().effects == base.machine().effects


def test_the_recording_stays(make_model):
    """Commands that were taken from a recording drive the changed model too, and another step keeps them."""
    base = simulate.Replayer(model(make_model))
    still = [
        Channel(name=drive, quantity="joint.velocity", target=joint, unit="rad/s", role="command", time=np.zeros(1), value=np.zeros(1))
        for drive, joint, _ in base.drives
    ]
    base.drive_by(Recording(name="r", channels=(*CHANNELS, *still)))
    for other in (base.changed([FRICTION]), base.changed(step=5e-3)):
        end = other.advance(other.rest(), 1.0)[0]
        assert np.hypot(end[8], end[9]) < 1e-3
    assert base.changed(step=5e-3).step == 5e-3


def test_the_track_width_moves_wheels_and_what_they_carry(make_model):
    """Wheels stand 20 % further apart, on both sides of where the middle was, and the cart turns at another rate."""
    base = simulate.Replayer(model(make_model))
    width, lower, upper = base.machine().parameters["track_width"]
    y = [wheel_y(base, wheel.name) for wheel in base.machine().wheels]
    assert width == pytest.approx(max(y) - min(y))
    assert lower < width < upper
    wide = base.changed(parameters={"track_width": 1.2 * width})
    assert [wheel_y(wide, wheel.name) for wheel in base.machine().wheels] == pytest.approx([1.2 * v for v in y], abs=1e-12)
    ends = [replayer.advance(replayer.rest(), 2.0)[0] for replayer in (base, wide)]
    assert abs(ends[1][13] / ends[0][13] - 1) > 0.02
    same = base.changed(parameters={"track_width": width})
    assert (same.advance(same.rest(), 0.5)[0] == base.advance(base.rest(), 0.5)[0]).all()


def wheel_y(replayer, wheel):
    """Lateral place [m] of a wheel's body in the model's frame, read from the simulated mechanism as placed at rest."""
    from rille._solver import Simulation

    simulation = Simulation(replayer._model)
    return simulation.wheels()[simulation.wheel_names.index(wheel), 1]


def test_facts(make_model):
    machine = simulate.Replayer(model(make_model)).machine()
    assert (machine.root, machine.has_ground, machine.soft_ground, machine.soils) == ("chassis", True, True, ("lunar_sourcebook",))
    assert machine.gravity == pytest.approx(EARTH)
    assert {wheel.joint for wheel in machine.wheels} <= {joint.name for joint in machine.joints}
    assert all(joint.parent == "chassis" for joint in machine.joints)
    assert machine.parameters["body.chassis.mass"][0] == next(b.mass for b in machine.bodies if b.name == "chassis")
    assert all(lower <= value <= upper for value, lower, upper in machine.parameters.values())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"effects": [Effect(kind="motor_leg", parameters={})]}, "no effect 'motor_leg'"),
        ({"effects": [Effect(kind="motor_lag", target="hub", parameters={"time_constant": 0.1})]}, "hub"),
        ({"effects": [Effect(kind="motor_lag", parameters={"time_constant": -0.1})]}, "must lie in 0 to 10 *"),
        ({"effects": [Effect(kind="motor_lag", parameters={"time": 0.1})]}, "no parameter 'time'"),
        ({"effects": [Effect(kind="payload_slosh", target="chassis", parameters={"mass": 500.0})]}, "more mass slosh"),
        ({"parameters": {"body.chassis.weight": 1.0}}, "no parameter"),
        ({"parameters": {"body.chassis.mass": -1.0}}, "body.chassis.mass"),
        ({"step": -1.0}, "step"),
    ],
)
def test_what_cannot_be_is_refused(make_model, change, words):
    base = simulate.Replayer(model(make_model))
    with pytest.raises(InputRefused, match=words):
        base.changed(**change)
