"""Accelerometers under a known gravity: nothing is said of sound ones; those in g, without gravity or turned round are named."""

from dataclasses import replace

import numpy as np
import pytest

from rille.model.quaternion import exponential, into_body, product
from rille.model.recording import Channel, GateFinding, Recording
from rille.recording.gate import gate

EARTH, MOON = 9.80665, 1.62  # [m/s^2]


def jolting(seed: int, size: float, *, frame: str = "body", posed: bool = True) -> list[Channel]:
    """A body on rough ground, tilted by up to half a radian and jolted by half of gravity, which turns about the vertical; the mean of its
    acceleration over 30 s is zero but for 0.002 of gravity. Orientation on another clock.
    """
    rng = np.random.default_rng(seed)
    t, u = np.arange(0, 30, 0.01), np.arange(0.004, 29.9, 0.03)
    pace, phase = rng.uniform(0.5, 4.0, 3), rng.uniform(0, 6, 3)

    def attitude(time):
        tilt = np.stack([0.35 * np.sin(pace[k] * time + phase[k]) for k in range(2)] + [0 * time], axis=-1)
        return product(exponential(np.stack([0 * time, 0 * time, 0.3 * time], axis=-1)), exponential(tilt))

    jolts = np.diff(rng.normal(size=(len(t) + 1, 3)), axis=0) * 0.35 * size
    force = jolts + [0, 0, size]
    felt = into_body(attitude(t), force) if frame == "body" else force
    accelerometer = Channel(name="a", quantity="part.linear_acceleration", target="base", unit="m/s^2", frame=frame, time=t)
    channels = [replace(accelerometer, name=f"a{c}", component=c, value=felt[:, k]) for k, c in enumerate("xyz")]
    if posed:
        pose = Channel(name="q", quantity="part.orientation", target="base", unit="1", clock="pose", time=u)
        channels += [replace(pose, name=f"q{c}", component=c, value=attitude(u)[:, k]) for k, c in enumerate("wxyz")]
    return channels


def told(channels: list[Channel], gravity: float) -> list[GateFinding]:
    findings = gate([Recording(name="jolts", channels=tuple(channels))], gravity=(0.0, 0.0, -gravity))[0]
    return [finding for finding in findings if "gravity" in finding.detail]


def altered(channels: list[Channel], factor: float = 1.0, up: float = 0.0) -> list[Channel]:
    """Specific forces times ``factor``, less ``up`` of the level body's z."""
    return [
        replace(c, value=factor * (c.value - (up if c.component == "z" else 0.0))) if c.quantity == "part.linear_acceleration" else c
        for c in channels
    ]


@pytest.mark.parametrize("posed", [False, True])
@pytest.mark.parametrize("frame", ["body", "world"])
@pytest.mark.parametrize("gravity", [EARTH, MOON])
@pytest.mark.parametrize("seed", range(3))
def test_a_sound_accelerometer_is_not_doubted(seed, gravity, frame, posed):
    assert [finding.message for finding in told(jolting(seed, gravity, frame=frame, posed=posed), gravity)] == []


@pytest.mark.parametrize("posed", [False, True])
@pytest.mark.parametrize("gravity", [EARTH, MOON])
def test_one_that_tells_g_is_in_another_unit(gravity, posed):
    (finding,) = told(altered(jolting(1, gravity, posed=posed), 1 / EARTH), gravity)
    assert (finding.code, finding.severity, finding.channel) == ("unit", "error", "ax")
    assert "g_0" in finding.message


@pytest.mark.parametrize("gravity", [EARTH, MOON])
def test_one_without_gravity_is_told(gravity):
    """In axes of W, and of a body that is tilted: a part of 1 - cos of the tilt stays, 6 % here. A warning: so does a body that falls."""
    for frame in ("body", "world"):
        (finding,) = told(altered(jolting(2, gravity, frame=frame), up=gravity), gravity)
        assert (finding.code, finding.severity) == ("gravity", "warning")


def test_one_that_points_along_gravity_is_turned_round():
    (finding,) = told(altered(jolting(3, EARTH), -1.0), EARTH)
    assert (finding.code, finding.severity) == ("sign", "error")


def test_the_gravity_of_another_planet_is_asked_about():
    """A test on Earth beside a model that drives on the Moon; nothing is said where there is no gravity, or none is known."""
    channels = jolting(4, EARTH)
    assert [(finding.code, finding.severity) for finding in told(channels, MOON)] == [("gravity", "warning")]
    assert told(channels, 0.0) == []
    assert [f for f in gate([Recording(name="jolts", channels=tuple(channels))])[0] if "gravity" in f.detail] == []
