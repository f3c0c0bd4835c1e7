"""A machine that swings in one period for long: what is late, in another unit, noisier than stated or wrapped is called so."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rille.model.recording import Channel, GateFinding, Recording
from rille.recording.gate import gate

PERIOD, NOISE = 1.76, (0.002, 0.01)


def swing(late: float = 0.0, change: Callable[[Channel], Channel] = lambda channel: channel, noise: float = 1.0) -> list[GateFinding]:
    """Findings about 20 s at 100 Hz of an angle and its speed that is ``late`` [s]; noise : times what is stated."""
    rng = np.random.default_rng(5)
    time = np.arange(2000) * 0.01
    w = 2 * np.pi / PERIOD
    angle = np.sin(w * time) + noise * NOISE[0] * rng.normal(size=len(time))
    speed = w * np.cos(w * (time - late)) + noise * NOISE[1] * rng.normal(size=len(time))
    return findings_of(*(change(replace(channel, noise=n)) for channel, n in zip(hinge(time, angle, speed), NOISE, strict=True)))


def hinge(time: np.ndarray, angle: np.ndarray, speed: np.ndarray) -> tuple[Channel, Channel]:
    return (
        Channel(name="angle", quantity="joint.position", target="hinge", unit="rad", time=time, value=angle),
        Channel(name="speed", quantity="joint.velocity", target="hinge", unit="rad/s", time=time, value=speed),
    )


def findings_of(*channels: Channel) -> list[GateFinding]:
    return list(gate([Recording(name="swing", channels=channels)])[0])


@pytest.mark.parametrize("late", [0.005, 0.010, 0.015, 0.020, 0.030])
def test_a_late_sensor_is_late_and_not_turned_round(late):
    """Half a period later with the sign turned is as good a fit; within 0.5 ms, several standard errors."""
    (finding,) = swing(late)
    assert (finding.code, finding.channel) == ("delay", "speed")
    assert finding.detail["delay"] == pytest.approx(late, abs=5e-4)


def test_a_turned_sensor_is_turned():
    findings = swing(change=lambda c: replace(c, value=-c.value) if c.name == "speed" else c)
    assert [finding.code for finding in findings] == ["sign"]


@pytest.mark.parametrize(
    ("name", "factor", "meant"), [("angle", 180 / np.pi, "rad instead of deg"), ("speed", 180 / np.pi, "deg instead of rad")]
)
def test_degrees_for_radians_are_no_clock_in_minutes(name, factor, meant):
    """180 / pi is within 5 % of 60."""
    findings = swing(change=lambda c: replace(c, value=factor * c.value, noise=factor * c.noise) if c.name == name else c)
    assert [finding.code for finding in findings if finding.severity == "error" and finding.code != "range"] == ["unit"]
    assert any(meant in finding.message for finding in findings)


def test_a_clock_in_minutes_is_one():
    (finding,) = [f for f in swing(change=lambda c: replace(c, time=c.time / 60)) if f.severity == "error" and f.code == "time_unit"]
    assert "minutes and seconds" in finding.message


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("bias", [0.0, 0.15])
def test_a_bias_is_told_from_a_gain_that_was_not_found_exactly(bias, seed):
    """A wheel that turns at 3 rad/s and a little more or less: what its gain is off by, times 3, is no bias. 20 standard errors."""
    rng = np.random.default_rng(seed)
    time = np.arange(3000) * 0.01
    pace, size = rng.uniform(0.5, 3.0, (3, 1)), rng.uniform(0.05, 0.3, (3, 1))
    phase = pace * time + np.arange(3)[:, None]
    angle = 3.0 * time + (size / pace * np.sin(phase)).sum(axis=0) + 0.005 * rng.normal(size=len(time))
    speed = 3.0 + (size * np.cos(phase)).sum(axis=0) + bias + 0.05 * rng.normal(size=len(time))
    findings = findings_of(*hinge(time, angle, speed))
    assert [finding.code for finding in findings] == (["bias"] if bias else [])
    assert not bias or findings[0].detail["bias"] == pytest.approx(bias, abs=0.01)


@pytest.mark.parametrize(("noise", "codes"), [(1.0, []), (1.6, []), (3.0, ["noise", "noise"])])
def test_noise_that_is_stated_too_small_is_told(noise, codes):
    """Three times the noise: 6 mrad and 30 mrad/s, to 10 %. What is within twice as much may be chance, or the motion."""
    findings = swing(noise=noise)
    assert [finding.code for finding in findings] == codes
    for finding, stated in zip(findings, NOISE, strict=False):
        assert finding.detail["seen"] == pytest.approx(noise * stated, rel=0.1)


def test_a_wrapped_angle_is_told():
    def wrap(channel: Channel) -> Channel:
        turned = channel.value + 4.0 * channel.time if channel.name == "angle" else channel.value + 4.0
        return replace(channel, value=(turned + np.pi) % (2 * np.pi) - np.pi if channel.name == "angle" else turned)

    findings = swing(change=wrap)
    assert [finding.code for finding in findings] == ["wrapped"]
    assert findings[0].detail["count"] >= 12  # 80 rad


@pytest.mark.parametrize("period", [0.7, 2 * np.pi / 5, 16.0])
@pytest.mark.parametrize("pace", [4.0, -4.0])
def test_an_encoder_that_begins_anew_after_another_angle(period, pace):
    """Behind a gear, or with a short counter: its angle is off by a whole number of jumps that nobody sees in the values themselves."""

    def roll(channel: Channel) -> Channel:
        turned = channel.value + pace * channel.time if channel.name == "angle" else channel.value + pace
        return replace(channel, value=turned % period if channel.name == "angle" else turned)

    errors = [finding for finding in swing(change=roll) if finding.severity == "error"]
    assert [(finding.code, finding.channel) for finding in errors] == [("rollover", "angle")], [finding.message for finding in errors]
    assert abs(errors[0].detail["period"] - period) < 4 * errors[0].detail["error"] + 1e-3 * period


def test_a_joint_that_is_switched_to_and_fro_has_no_encoder_that_begins_anew():
    """It stands between its jumps."""

    def switch(channel: Channel) -> Channel:
        way = 0.4 * np.sign(np.sin(2.0 * channel.time)) + 0.002 * np.sin(31.0 * channel.time)
        return replace(channel, value=way if channel.name == "angle" else 0.062 * np.cos(31.0 * channel.time))

    assert [finding.message for finding in swing(change=switch) if finding.code == "rollover"] == []


def test_needles_on_what_moves_fast():
    """Half a radian where steps are up to 36 mrad: less than twenty usual steps, but far off the line of the neighbours."""

    def pierce(channel: Channel) -> Channel:
        value = channel.value.copy()
        if channel.name == "angle":
            value[[200, 777, 1400]] += 0.5
        return replace(channel, value=value)

    findings = [finding for finding in swing(change=pierce) if finding.code == "spike"]
    assert [(finding.channel, finding.detail["count"]) for finding in findings] == [("angle", 3)]


@pytest.mark.parametrize(("by", "advice"), [(3.0, "begins anew"), (0.03, "sort")])
def test_a_clock_that_begins_anew_is_not_to_be_sorted(by, advice):
    def back(channel: Channel) -> Channel:
        time = channel.time.copy()
        if by > 1:
            time[1000:] -= by
        else:
            time[1000] -= by
        return replace(channel, time=time)

    (finding, *_) = [finding for finding in swing(change=back) if finding.code == "clock_backwards"]
    assert advice in finding.message
