"""Orientation recorded whole: a body that tumbles over the poles of roll, pitch and yaw is smoothed as well as any other."""

from dataclasses import replace

import numpy as np
import pytest

from rille.diagnosis.starts.recorded_turns import _rates_of_vector, recorded_turns
from rille.model.quaternion import angles, conjugate, exponential, into_body, logarithm, product
from rille.model.recording import ANGLES, Channel

TURN_NOISE, RATE_NOISE = 3e-3, 3e-3  # [rad], [rad/s]


def attitude(time):
    """Orientation (n, 4) and angular velocity in W (n, 3) [rad/s] of a body that nods by 1.3 rad, a little off the pole, while it spins."""

    def at(t):
        about = [exponential(np.eye(3)[k] * angle[:, None]) for k, angle in ((2, 0.9 * t), (1, 1.3 * np.sin(1.1 * t)), (0, 1.7 * t))]
        return product(about[0], product(about[1], about[2]))

    small = 1e-5
    return at(time), logarithm(product(at(time + small), conjugate(at(time - small)))) / (2 * small)


def shown(rng, rate=25.0, gyro=100.0, duration=8.0):
    """Roll, pitch and yaw at ``rate`` [1/s], and angular velocities along the body at ``gyro`` [1/s], with their noise, by component."""
    slow, fast = np.arange(0, duration, 1 / rate), np.arange(0, duration, 1 / gyro) + 1e-3
    turn = angles(attitude(slow)[0]) + rng.normal(0, TURN_NOISE, (len(slow), 3))
    quick, velocity = attitude(fast)
    velocity = into_body(quick, velocity) + rng.normal(0, RATE_NOISE, (len(fast), 3))

    def channel(quantity, component, time, value, noise):
        value = (value + np.pi) % (2 * np.pi) - np.pi if component in ANGLES else value
        return Channel(name=component, quantity=quantity, component=component, target="b", unit="rad", time=time, value=value), noise

    orientation = {n: channel("part.orientation", n, slow, turn[:, k], TURN_NOISE) for k, n in enumerate(ANGLES)}
    return orientation, {n: channel("part.angular_velocity", n, fast, velocity[:, k], RATE_NOISE) for k, n in enumerate("xyz")}


def errors(recorded, instants, widest=0.6):
    """e' C^-1 e / 2 (3, k) of angle and rate by axis, and the errors of the rates (3, k) [rad/s]."""
    motions = recorded.smooth(instants, recorded.reference(instants), widest)
    turn, rate = attitude(instants)
    away = logarithm(product(turn, conjugate(recorded.reference(instants))))
    sizes, off = [], []
    for axis, motion in enumerate(motions):
        e = motion.value[:, :2] - np.stack([away[:, axis], rate[:, axis]], axis=1)
        sizes.append(np.einsum("ki,kij,kj->k", e, np.linalg.inv(motion.covariance[:, :2, :2]), e) / 2)
        off.append(e[:, 1])
    return np.array(sizes), np.array(off)


@pytest.mark.parametrize("seed", range(2))
def test_a_tumbling_body_is_known_from_its_angles_and_its_gyro(seed):
    """The rate is known to a few times the gyro's noise at all instants, pole or not; errors are as large as said (mean of e' C^-1 e / 2 is
    1 for an exact covariance, 0.4 to 2 is asked for). From angles alone the rate is ten times worse known: what the gyro is worth.
    """
    orientation, rates = shown(np.random.default_rng(seed))
    instants = np.linspace(1, 7, 60)
    sizes, off = errors(recorded_turns(orientation, [(rates, True)]), instants)
    assert 0.4 < np.mean(sizes) < 2.0
    assert np.abs(off).max() < 6 * RATE_NOISE
    _, alone = errors(recorded_turns(orientation, []), instants)
    assert np.sqrt(np.mean(alone**2)) > 5 * np.sqrt(np.mean(off**2))


def test_a_component_that_is_late_leaves_the_instrument_whole():
    """A gyro whose y component is stamped 1 ms later: the others are worth as much as before."""
    orientation, rates = shown(np.random.default_rng(3))
    late = {**rates, "y": (replace(rates["y"][0], time=rates["y"][0].time + 1e-3), RATE_NOISE)}
    instants = np.linspace(1, 7, 30)
    _, before = errors(recorded_turns(orientation, [(rates, True)]), instants)
    _, after = errors(recorded_turns(orientation, [(late, True)]), instants)
    assert np.abs(after - before).max() < 2 * RATE_NOISE


@pytest.mark.parametrize("component", ["x", "pitch"])
def test_samples_that_are_lost_leave_the_rest_of_the_instrument(component):
    """A component stands at the end of its range now and then, and what it says there is left out: elsewhere all is known as before, there
    from the others and from orientations, to what the covariance says. (Without the whole gyro rates were off by 0.1 rad/s, and without
    whole angles no turn was known.)
    """
    orientation, rates = shown(np.random.default_rng(4))
    lost = [(2.0, 2.05), (3.0, 3.15), (5.0, 5.02)]
    instants = np.linspace(1, 7, 60)
    elsewhere = np.all([(instants < first - 0.2) | (instants > last + 0.2) for first, last in lost], axis=0)

    def without(some):
        if component not in some:
            return some
        channel, noise = some[component]
        kept = ~np.any([(channel.time >= first) & (channel.time <= last) for first, last in lost], axis=0)
        return {**some, component: (replace(channel, time=channel.time[kept], value=channel.value[kept]), noise)}

    _, before = errors(recorded_turns(orientation, [(rates, True)]), instants)
    sizes, after = errors(recorded_turns(without(orientation), [(without(rates), True)]), instants)
    assert np.abs(after - before)[:, elsewhere].max() < 2 * RATE_NOISE
    assert np.mean(sizes) < 2.0


def test_a_bias_is_seen_from_a_reference_that_does_not_share_it():
    """All yaws 0.02 rad too large: the smoothed turns differ by as much about the vertical, and by nothing else, to the second order."""
    orientation, rates = shown(np.random.default_rng(5))
    off = {**orientation, "yaw": (replace(orientation["yaw"][0], value=orientation["yaw"][0].value + 0.02), TURN_NOISE)}
    instants = np.linspace(1, 7, 20)
    before = recorded_turns(orientation, [(rates, True)])
    references = before.reference(instants)
    widths = [m.width for m in before.smooth(instants, references, 0.6)]
    first, second = ([m.value[:, 0] for m in r.smooth(instants, references, 0.6, widths)] for r in (before, recorded_turns(off, [])))
    assert np.median(second[2] - first[2]) == pytest.approx(0.02, abs=2e-3)
    assert np.median(second[0] - first[0]) == pytest.approx(0.0, abs=2e-3)


def test_a_rate_about_one_axis_of_the_world_is_heard():
    """A turntable with the rate about the vertical alone: as well known as with all three."""
    time = np.arange(0, 6, 0.02)
    yaw, rate = 1.2 * np.sin(1.5 * time), 1.8 * np.cos(1.5 * time)
    random = np.random.default_rng(6)
    turns = {n: (Channel(name=n, quantity="part.orientation", target="b", component=n, unit="rad", time=time,
                         value=(yaw if n == "yaw" else 0 * yaw) + random.normal(0, 0.02, len(time))), 0.02) for n in ANGLES}  # fmt: skip
    gyro = Channel(name="z", quantity="part.angular_velocity", target="b", component="z", unit="rad/s", time=time, value=rate)
    instants = np.linspace(1, 5, 30)
    off = []
    for rates in ([({"z": (gyro, RATE_NOISE)}, False)], []):
        recorded = recorded_turns(turns, rates)
        found = recorded.smooth(instants, recorded.reference(instants), 0.6)[2].value[:, 1]
        off.append(np.sqrt(np.mean((found - 1.8 * np.cos(1.5 * instants)) ** 2)))
    assert off[0] < 2 * RATE_NOISE < 0.2 * off[1]


def test_what_is_not_recorded_whole_is_not_made_up():
    orientation, rates = shown(np.random.default_rng(4))
    assert recorded_turns({k: v for k, v in orientation.items() if k != "roll"}, [(rates, True)]) is None
    assert recorded_turns(orientation, [({k: v for k, v in rates.items() if k != "x"}, True)]).rates == ()


def test_the_rate_of_a_rotation_vector():
    """Against differences of the logarithm over 2e-5 s, up to 1.9 rad from the reference: 1e-7 rad/s is their rounding."""
    time = np.linspace(0, 1.0, 40)
    reference = attitude(np.zeros(1))[0]
    small = 1e-5
    after, before = (logarithm(product(attitude(time + side * small)[0], conjugate(reference))) for side in (1, -1))
    turn, rate = attitude(time)
    vector = logarithm(product(turn, conjugate(reference)))
    assert np.linalg.norm(vector, axis=1).max() > 1.5
    near = np.linalg.norm(vector, axis=1) < 2.5
    assert _rates_of_vector(vector, rate)[near] == pytest.approx(((after - before) / (2 * small))[near], abs=1e-6)


@pytest.mark.parametrize("in_body", [True, False])
def test_a_gyro_carries_an_orientation_over_a_long_loss(in_body):
    """The yaw is lost for 0.9 s of a tumbling body, whose gyro is off by 0.02 rad/s: orientation and rate are known within the loss, the
    angle to a few times the noise of one sample; without the gyro nothing is known there.
    """
    orientation, rates = shown(np.random.default_rng(8))
    if not in_body:
        _, velocity = attitude(rates["x"][0].time)
        rates = {n: (replace(c, value=velocity[:, "xyz".index(n)]), noise) for n, (c, noise) in rates.items()}
    rates = {n: (replace(c, value=c.value + 0.02), noise) for n, (c, noise) in rates.items()}
    channel, noise = orientation["yaw"]
    lost = (channel.time > 3.0) & (channel.time < 3.9)
    orientation["yaw"] = (replace(channel, value=np.where(lost, np.nan, channel.value)), noise)
    instants = np.linspace(3.05, 3.85, 17)
    recorded = recorded_turns(orientation, [(rates, in_body)])
    motions = recorded.smooth(instants, recorded.reference(instants), 0.6)
    assert all(m.seen.all() for m in motions)
    _, off = errors(recorded, instants)
    away = logarithm(product(attitude(instants)[0], conjugate(recorded.reference(instants))))
    assert np.abs(np.stack([m.value[:, 0] for m in motions], axis=1) - away).max() < 5 * TURN_NOISE
    assert np.abs(off).max() < 0.05
    alone = recorded_turns(orientation, [])
    assert not any(m.seen[5:12].any() for m in alone.smooth(instants, alone.reference(instants), 0.3))
