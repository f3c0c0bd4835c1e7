"""Gyros against recorded orientations of a body that tumbles: nothing is said of sound ones, and a wrong unit, sign or stamp is named."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from rille.model.quaternion import angles, conjugate, exponential, from_angles, into_body, product
from rille.model.recording import ANGLES, Channel, GateFinding, Recording
from rille.recording.gate import gate

RATE, DURATION = 200.0, 20.0  # [Hz], [s]
NOISE = {"1": 1e-3, "rad": 2e-3, "rad/s": 5e-3}


def tumbling(seed: int, *, frame: str, angled: bool = False) -> list[Channel]:
    """A gyro, and quaternions or angles on another clock. The attitude is a product of two rotations in closed form, the angular velocity
    its derivative over 10 us.
    """
    rng = np.random.default_rng(seed)
    size, pace, phase = rng.uniform(0.3, 0.9, (3, 2)), rng.uniform(0.5, 4.0, (3, 2)), rng.uniform(0, 6, (3, 2))

    def attitude(t):
        first, second = (np.stack([size[k, j] * np.sin(pace[k, j] * t + phase[k, j]) for k in range(3)], axis=-1) for j in range(2))
        return product(exponential(first), exponential(second))

    t = np.arange(0, DURATION, 1 / RATE) + rng.uniform(-0.3, 0.3, int(DURATION * RATE)) / RATE
    u = np.arange(0.003, DURATION, 2.3 / RATE)
    h = 1e-5
    world = 2 * product((attitude(t + h) - attitude(t - h)) / (2 * h), conjugate(attitude(t)))[:, 1:]
    rates = into_body(attitude(t), world) if frame == "body" else world
    seen = angles(attitude(u)) if angled else attitude(u)
    names, unit = (ANGLES, "rad") if angled else (("w", "x", "y", "z"), "1")
    gyro = Channel(name="gyro", quantity="part.angular_velocity", target="base", unit="rad/s", frame=frame, time=t)
    channels = [replace(gyro, name=f"gyro_{c}", component=c, value=rates[:, k]) for k, c in enumerate("xyz")]
    channels += [
        Channel(name=f"q{c}", quantity="part.orientation", target="base", unit=unit, component=c, clock="pose", time=u, value=seen[:, k])
        for k, c in enumerate(names)
    ]
    return [replace(c, value=c.value + NOISE[c.unit] * rng.normal(size=len(c.value))) for c in channels]


def loud(channels: Sequence[Channel]) -> list[GateFinding]:
    return [finding for finding in gate([Recording(name="tumble", channels=tuple(channels))])[0] if finding.severity != "note"]


def of_gyro(change: Callable[[Channel], Channel], names: str) -> Callable[[list[Channel]], list[Channel]]:
    return lambda channels: [change(c) if c.quantity == "part.angular_velocity" and c.component in names else c for c in channels]


FAULTS = {
    "degrees": (of_gyro(lambda c: replace(c, value=np.degrees(c.value)), "xyz"), "unit"),
    "turned": (of_gyro(lambda c: replace(c, value=-c.value), "y"), "sign"),
    "scaled": (of_gyro(lambda c: replace(c, value=1.3 * c.value), "z"), "gain"),
    "late": (of_gyro(lambda c: replace(c, time=c.time + 0.05), "xyz"), "delay"),
    "biased": (of_gyro(lambda c: replace(c, value=c.value + c.value.std()), "x"), "bias"),
}


@pytest.mark.parametrize("frame", ["body", "world"])
@pytest.mark.parametrize("angled", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_a_sound_gyro_is_not_doubted(seed: int, angled: bool, frame: str):
    """Tilted by up to a radian and more, where the rate of roll is no component of the angular velocity."""
    assert [finding.message for finding in loud(tumbling(seed, frame=frame, angled=angled))] == []


@pytest.mark.parametrize("angled", [False, True])
@pytest.mark.parametrize("fault", FAULTS)
def test_a_faulty_gyro_is_named(fault: str, angled: bool):
    change, code = FAULTS[fault]
    channels = tumbling(7, frame="body", angled=angled)
    found = loud(change(channels))
    touched = {c.name for before, c in zip(channels, change(channels), strict=True) if c is not before}
    assert {finding.channel for finding in found if finding.code == code} == touched, [finding.message for finding in found]
    assert {finding.code for finding in found} == {code}


@pytest.mark.parametrize("angled", [False, True])
@pytest.mark.parametrize(("true", "stated"), [("body", "world"), ("world", "body")])
def test_axes_that_are_not_those_of_the_manifest_are_told(true: str, stated: str, angled: bool):
    """The usual slip with gyros: they measure about their own axes, and the manifest says nothing of it."""
    found = loud([replace(c, frame=stated) if c.name.startswith("gyro") else c for c in tumbling(3, frame=true, angled=angled)])
    assert {(finding.code, finding.channel, finding.detail["frame"]) for finding in found} == {("frame", f"gyro_{c}", true) for c in "xyz"}


def driving(tilt: float, bias: float) -> list[Channel]:
    """Angles to 10 mrad and a gyro of a body that turns about the vertical, on ground that tilts it to one side."""
    rng = np.random.default_rng(1)
    t = np.arange(0, DURATION, 1 / RATE)
    yaw, rate = 0.8 * np.sin(0.5 * t), 0.4 * np.cos(0.5 * t)
    rates = into_body(from_angles(np.stack([0 * t, tilt + 0 * t, yaw], axis=-1)), np.stack([0 * t, 0 * t, rate], axis=-1))
    rates += bias + 1e-4 * rng.normal(size=rates.shape)
    gyro = Channel(name="gyro", quantity="part.angular_velocity", target="base", unit="rad/s", frame="body", time=t)
    angle = Channel(name="angle", quantity="part.orientation", target="base", unit="rad", time=t)
    seen = {"roll": 0 * t, "pitch": tilt + 0 * t, "yaw": yaw}
    channels = [replace(gyro, name=f"gyro_{c}", component=c, value=rates[:, k]) for k, c in enumerate("xyz")]
    return channels + [
        replace(angle, name=c, component=c, value=np.round(value + 1e-3 * rng.normal(size=len(t)), 2)) for c, value in seen.items()
    ]


@pytest.mark.parametrize("tilt", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("bias", [0.0, 2e-3, 1e-2])
def test_a_coarse_roll_that_stays_is_no_stuck_one(tilt: float, bias: float):
    """A gyro that is off by half a degree per second makes no motion, nor does the part of a turn that it sees about its tilted x."""
    assert [finding.message for finding in loud(driving(tilt, bias)) if finding.code != "bias"] == []


def test_an_angle_that_freezes_while_its_body_tumbles_is_stuck():
    """No rate tells of it, as the body is not level; its own jump, when it goes on, does."""

    def frozen(c: Channel) -> Channel:
        inside = (c.time > 5.0) & (c.time < 9.0)
        return replace(c, value=np.where(inside, c.value[inside][0], c.value)) if c.name == "qyaw" else c

    found = loud([frozen(c) for c in tumbling(2, frame="body", angled=True)])
    assert [(finding.code, finding.channel) for finding in found] == [("stuck", "qyaw")]


def reordered(order: str) -> Callable[[list[Channel]], list[Channel]]:
    """The four numbers as they are in a file of that order, given the components of another."""
    given = {"x, y, z, w": "wxyz", "w, x, y, z": "xyzw"}[order]
    meant = dict(zip(given, order.split(", "), strict=True))

    def change(channels: list[Channel]) -> list[Channel]:
        values = {c.component: c.value for c in channels if c.quantity == "part.orientation"}
        return [replace(c, value=values[meant[c.component]]) if c.quantity == "part.orientation" else c for c in channels]

    return change


def inverse(channels: list[Channel]) -> list[Channel]:
    return [replace(c, value=-c.value) if c.quantity == "part.orientation" and c.component in "xyz" else c for c in channels]


@pytest.mark.parametrize("frame", ["body", "world"])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("reading", ["x, y, z, w", "w, x, y, z", "inverse"])
def test_a_quaternion_in_another_order_is_told(reading: str, seed: int, frame: str):
    """The sign of one rate, turned as a pair of channels by itself suggests, would make two errors of one."""
    change = inverse if reading == "inverse" else reordered(reading)
    found = loud(change(tumbling(seed, frame=frame)))
    assert [(f.code, f.channel, f.detail["readings"]) for f in found] == [("quaternion", "qw", [reading])], [f.message for f in found]


@pytest.mark.parametrize("reading", ["x, y, z, w", "w, x, y, z"])
def test_an_order_and_axes_that_are_both_wrong_are_told_together(reading: str):
    channels = [replace(c, frame="world") if c.name.startswith("gyro") else c for c in tumbling(4, frame="body")]
    found = loud(reordered(reading)(channels))
    assert [(f.code, f.detail["readings"]) for f in found] == [("quaternion", [reading])], [f.message for f in found]
    assert "measures in the body's axes" in found[0].message


TURNS = {
    "a quarter turn about z": ("y", "-x", "z"),
    "upside down": ("x", "-y", "-z"),
    "on its side": ("x", "-z", "y"),
    "x and y mixed up": ("y", "x", "z"),
}


@pytest.mark.parametrize("angled", [False, True])
@pytest.mark.parametrize("turn", TURNS)
def test_a_gyro_that_is_mounted_otherwise_is_told(turn: str, angled: bool):
    """Each rate whose axis is another one, with that axis and its sign; the others are not doubted."""
    channels = tumbling(5, frame="body", angled=angled)
    true = {c.component: c.value for c in channels if c.quantity == "part.angular_velocity"}
    of = {said: (axis.removeprefix("-"), -1.0 if axis.startswith("-") else 1.0) for said, axis in zip("xyz", TURNS[turn], strict=True)}
    mounted = [
        replace(c, value=of[c.component][1] * true[of[c.component][0]]) if c.quantity == "part.angular_velocity" else c for c in channels
    ]
    wanted = {(f"gyro_{said}", axis) for said, axis in zip("xyz", TURNS[turn], strict=True) if said != axis}
    found = loud(mounted)
    assert {(f.channel, f.detail["axis"]) for f in found} == wanted, [f.message for f in found]
    assert {f.code for f in found} == {"axes"}


def test_what_a_turn_about_one_axis_shows_is_left_to_its_pair():
    """A body that turns about the vertical alone does not tell of a gyro upside down, an inverse or a turned sign: the sign is said."""
    found = loud([replace(c, value=-c.value) if c.name == "gyro_z" else c for c in driving(0.0, 0.0)])
    assert [(f.code, f.channel) for f in found if f.severity == "error"] == [("sign", "gyro_z")], [f.message for f in found]
