"""What recordings cannot tell is said, and nothing else is."""

from dataclasses import replace

import numpy as np

from machines import LUNAR_SOIL, cart, chain
from made_machines import machine_of
from rille.diagnosis.answer.limits import limits
from rille.model import Drive
from rille.model.difference import Difference, WindowDifference
from rille.model.recording import Channel, Recording

TIME = np.arange(0, 20, 0.01)
NOISE = 2e-3


def speed(joint, value, time=TIME, noise: float | None = NOISE, **more):
    rng = np.random.default_rng(1)
    return Channel(
        name=f"w {joint}",
        quantity="joint.velocity",
        target=joint,
        unit="rad/s",
        noise=noise,
        time=time,
        value=value + rng.normal(0, NOISE, len(time)),
        **more,
    )


def torque(joint, value, time=TIME):
    return Channel(name=f"tau {joint}", quantity="joint.effort", target=joint, unit="N m", role="command", time=time, value=value)


def said(machine, *channels):
    return " | ".join(limits([Recording(name="r", channels=channels)], machine))


ARM = machine_of(replace(chain([0.3, 0.2], [0.5, 0.5]), drives=(Drive(name="m", joint="hinge1", mode="torque", max_torque=1.0),)))
SWING = np.sin(3 * TIME) * (1 + 0.5 * np.sin(0.4 * TIME))
LOAD = 0.3 * np.sin(2 * TIME) + 0.1 * np.sin(5 * TIME)


def test_a_rich_recording_has_no_limits():
    assert said(ARM, speed("hinge1", SWING), speed("hinge2", np.roll(SWING, 300)), torque("hinge1", LOAD)) == ""


def test_motions_that_lack():
    rich = (torque("hinge1", LOAD), speed("hinge1", SWING))
    assert "joint 'hinge2' never moves by more" in said(ARM, *rich, speed("hinge2", 0 * TIME))
    assert "joint 'hinge2' never reverses" in said(ARM, *rich, speed("hinge2", 1.5 + SWING * 0.5))
    steady = said(ARM, *rich, speed("hinge2", 1.0 * np.sign(np.sin(TIME))))
    assert "joint 'hinge2' moves at one speed" in steady
    assert "reverses" not in steady
    assert "no channel shows joint 'hinge2'" in said(ARM, *rich)
    position = Channel(name="q", quantity="joint.position", target="hinge2", unit="rad", noise=1e-3, time=TIME, value=np.sin(TIME))
    assert said(ARM, *rich, position) == ""  # speeds are read from positions too


def test_forces_and_loads_that_lack():
    motion = (speed("hinge1", SWING), speed("hinge2", SWING))
    assert "only ratios of forces to masses" in said(ARM, *motion)
    assert "single load" in said(ARM, *motion, torque("hinge1", 0.3 + 0 * TIME))
    servo = replace(ARM, drives=(replace(ARM.drives[0], mode="speed"), replace(ARM.drives[0], name="n", joint="hinge2")))
    assert "'m' holds a speed or position, and no effort" in said(servo, *motion, torque("hinge2", LOAD))


def test_short_and_noiseless():
    short = TIME < 2
    text = said(ARM, *(replace(c, time=c.time[short], value=c.value[short]) for c in (speed("hinge1", SWING), torque("hinge1", LOAD))))
    assert "last 1.99 s together" in text
    assert "noise of 'w hinge1' is not stated" in said(
        ARM, speed("hinge1", SWING, noise=None), speed("hinge2", SWING), torque("hinge1", LOAD)
    )


def test_a_model_that_diverges():
    window = WindowDifference(recording="r", number=0, rank=1, start=0.0, stop=0.5, n=0, normalised=9.0, chi2=9.0, degrees=1.0, p=0.0)
    windows = (replace(window, ended="joint 'hinge1' is too fast"), replace(window, number=1))
    difference = Difference(
        model="m", recordings=("r",), mode="windows", differs=True, sentence="", chi2_per_degree=9.0, channels=(), windows=windows,
        targets=(), regimes=(), runs=(),
    )  # fmt: skip
    (text,) = limits(
        [Recording(name="r", channels=(speed("hinge1", SWING), speed("hinge2", SWING), torque("hinge1", LOAD)))], ARM, difference
    )
    assert "ends early in 1 of 2 windows (joint 'hinge1' is too fast)" in text


def test_rovers():
    rover = cart(5.0, 0.15, 0.165)
    machine = machine_of(rover, soil=LUNAR_SOIL)
    rims = [torque(w.joint, LOAD) for w in rover.wheels]

    def pose(component, value):
        return Channel(
            name=component,
            quantity="part.orientation",
            component=component,
            target="chassis",
            unit="rad",
            noise=1e-3,
            time=TIME,
            value=value,
        )

    straight = said(machine, *rims, pose("yaw", 0 * TIME), pose("pitch", 0 * TIME))
    assert "never turns faster" in straight
    assert "level within" in straight
    curve = said(machine, *rims, pose("yaw", np.mod(0.2 * TIME, 2 * np.pi)), pose("pitch", 0.1 * np.sin(TIME)))
    assert "turns" not in curve
    assert "level" not in curve
    parked = said(machine, *rims, *(replace(speed(w.joint, 0 * TIME), value=0 * TIME) for w in rover.wheels))
    assert "no wheel turns" in parked


def test_points():
    def column(name, quantity, values):
        return Channel(
            name=name,
            quantity=quantity,
            target="wheel",
            unit="N",
            noise=1.0,
            time=np.arange(float(len(values))),
            value=np.array(values, dtype=float),
        )

    few = Recording(
        name="b", kind="points", channels=(column("W", "wheel.normal_load", [100.0] * 5), column("s", "wheel.slip_ratio", [0.3] * 5))
    )
    text = " | ".join(limits([few], machine_of(chain([0.3], [0.5]))))
    assert "one load, 100 N" in text
    assert "one slip, 0.3" in text
    assert "5 points" in text
