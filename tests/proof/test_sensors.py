"""What sensors of the proof say of a true signal."""

from dataclasses import replace

import numpy as np
import pytest

from rille.proof.machines import MAKERS
from rille.proof.maneuvers import maneuver
from rille.proof.sensors import draw_sensors, readings, recording, sampling


@pytest.fixture
def setting():
    rng = np.random.default_rng(5)
    machine = MAKERS["pendulum"](rng)
    return machine, maneuver(machine, "one", rng), draw_sensors(machine, rng)


def said(setting, sensors, truth=None, seed=3):
    machine, scenario, _ = setting
    when = sampling(sensors, scenario.duration, seed)
    asked = readings(sensors, when)
    values = [np.sin(3 * r.times) if truth is None else truth(r.times) for r in asked]
    return recording(machine, scenario, sensors, when, values, seed), asked


def changed(sensors, channel, **fault):
    return replace(sensors, sensors=tuple(replace(s, **fault) if s.channel == channel else s for s in sensors.sensors))


def test_noise_has_the_size_that_is_stated(setting):
    """1000 s of noise about 0: its standard deviation is within 4 standard errors of what is stated; slow noise has fewer free samples
    (one for every two time constants), which is what the error is taken from."""
    machine, scenario, sensors = setting
    long = replace(scenario, duration=1000.0, commands=())
    found, _ = said((machine, long, sensors), sensors, lambda t: 0 * t)
    for sensor in sensors.sensors:
        if sensor.noise:
            samples = found.channel(sensor.channel).value
            slow = sensor.slow_share**2 * 2 * sensor.slow_time * sensors.clocks[sensor.clock].rate
            error = np.sqrt((1 + slow) / (2 * len(samples)))
            assert np.std(samples) == pytest.approx(sensor.noise, rel=4 * error)


def test_a_resolution_is_kept(setting):
    _, _, sensors = setting
    found, _ = said(setting, sensors)
    for sensor in sensors.sensors:
        if sensor.resolution:
            steps = found.channel(sensor.channel).value / sensor.resolution
            assert steps == pytest.approx(np.rint(steps), abs=1e-6)


def test_faults_do_what_they_are_called(setting):
    """Each fault against the same sensor without it and with the same noise: the difference is the fault's own, to rounding."""
    _, _, sensors = setting
    name = next(s.channel for s in sensors.sensors if not s.resolution)
    right, _ = said(setting, sensors)
    t, y = right.channel(name).time, right.channel(name).value
    truth = np.sin(3 * t)
    for fault, wanted in (
        ({"bias": 0.2}, y + 0.2),
        ({"scale": 1.1}, y + 0.1 * truth),
        ({"trend": 0.05}, y + 0.05 * t),
        ({"limit": 0.4}, np.clip(y, -0.4, 0.4)),
    ):
        wrong, _ = said(setting, changed(sensors, name, **fault))
        assert wrong.channel(name).value == pytest.approx(wanted, abs=1e-12)


def test_a_late_sensor_reads_what_was_and_does_not_say_so(setting):
    _, _, sensors = setting
    name = next(s.channel for s in sensors.sensors if not s.resolution)
    late, asked = said(setting, changed(sensors, name, late=0.05))
    number = [s.channel for s in sensors.sensors].index(name)
    assert late.channel(name).time == pytest.approx(asked[number].times + 0.05, abs=1e-12)
    assert late.channel(name).delay == 0.0


def test_a_skewed_clock_stamps_all_its_channels(setting):
    _, _, sensors = setting
    clock = sensors.sensors[0].clock
    skewed = replace(sensors, clocks={**sensors.clocks, clock: replace(sensors.clocks[clock], skew=0.01)})
    right, wrong = said(setting, sensors)[0], said(setting, skewed)[0]
    for sensor in sensors.sensors:
        factor = 1.01 if sensor.clock == clock else 1.0
        assert wrong.channel(sensor.channel).time == pytest.approx(factor * right.channel(sensor.channel).time, rel=1e-12)


def test_commands_hold_until_the_next(setting):
    machine, scenario, sensors = setting
    found, _ = said(setting, sensors)
    drive = machine.rover.drives[0]
    channel = found.channel(f"{drive.name}_command")
    own = [c for c in scenario.commands if c.drive == drive.name]
    assert channel.role == "command"
    assert dict(zip(channel.time.tolist(), channel.value.tolist(), strict=True))[own[7].time] == own[7].value
