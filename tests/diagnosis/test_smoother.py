"""The smoother without a model: how near it comes, and whether its covariance says so."""

import numpy as np
import pytest

from rille.diagnosis.starts.kinematic_smoother import Series, smooth
from rille.diagnosis.starts.noise_floor import noise_of
from rille.model.recording import Channel
from rille.model.scatter import difference_noise


def motion(rng, duration=20.0):
    """A random smooth motion and its rate: eight waves of 0.1 to 3 Hz."""
    frequency, phase = rng.uniform(0.1, 3, 8), rng.uniform(0, 2 * np.pi, 8)
    size = rng.normal(0, 0.3, 8) / frequency
    w = 2 * np.pi * frequency

    def at(t):
        return (size * np.sin(np.multiply.outer(t, w) + phase)).sum(-1), (size * w * np.cos(np.multiply.outer(t, w) + phase)).sum(-1)

    return at


def samples(rng, at, rate=200.0, jitter=1e-3, duration=20.0):
    time = np.sort(np.arange(0, duration, 1 / rate) + rng.normal(0, jitter, int(duration * rate)))
    return time[np.r_[True, np.diff(time) > 0]]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("with_rate", [False, True])
def test_errors_are_as_large_as_the_covariance_says(seed, with_rate):
    """Mean of e' C^-1 e / 2 over 190 instants is 1 for an exact covariance; bias makes it scatter: 0.5 to 1.6 is asked for."""
    rng = np.random.default_rng(seed)
    at = motion(rng)
    time = samples(rng, at)
    series = [Series(order=0, time=time, value=at(time)[0] + rng.normal(0, 2e-3, len(time)), noise=2e-3)]
    if with_rate:
        other = samples(rng, at, rate=90)
        series.append(Series(order=1, time=other, value=at(other)[1] + rng.normal(0, 0.05, len(other)), noise=0.05))
    instants = np.linspace(0.5, 19.5, 190)
    found = smooth(instants, series, widest=0.5)
    error = found.value[:, :2] - np.stack(at(instants), axis=1)
    spread = np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.covariance[:, :2, :2]), error) / 2
    assert 0.5 < spread.mean() < 1.6
    assert np.sqrt(np.median(found.covariance[:, 0, 0])) < 1e-3  # better than a sample by more than 2


def test_a_kink_makes_it_unsure_instead_of_wrong():
    """A coordinate that stands and then moves at 1 rad/s: at the kink the error is within four of its standard deviations."""
    rng = np.random.default_rng(3)
    time = np.arange(0, 2, 0.02)
    value = np.maximum(0, time - 1.0) + rng.normal(0, 5e-5, len(time))
    found = smooth(np.array([0.5, 1.0, 1.5]), [Series(order=0, time=time, value=value, noise=5e-5)], widest=0.5)
    error = found.value[:, 0] - [0, 0, 0.5]
    assert (np.abs(error) < 4 * np.sqrt(found.covariance[:, 0, 0])).all()
    assert np.sqrt(found.covariance[0, 0, 0]) < 1e-4


def test_nothing_is_said_inside_a_gap():
    time = np.r_[np.arange(0, 1, 0.02), np.arange(2, 3, 0.02)]
    found = smooth(np.array([0.5, 1.5, 1.9, 2.0]), [Series(order=0, time=time, value=np.sin(time), noise=1e-3)], widest=0.5)
    assert found.seen.tolist() == [True, False, False, True]


def test_few_samples_are_reached_for():
    """A drive of slow curves, with a fix per second from 3 s on: it is seen from an interval and a half before the first fix to as long
    behind the last, not from three on, and to within what the covariance says (as above).
    """
    rng = np.random.default_rng(4)
    time = np.arange(3.0, 60.0, 1.0) + rng.uniform(-0.05, 0.05, 57)
    fixes = Series(order=0, time=time, value=2.0 * np.sin(0.2 * time) + rng.normal(0, 0.01, len(time)), noise=0.01)
    instants = np.arange(-0.75, 64, 0.5)
    found = smooth(instants, [fixes], widest=0.5)
    beyond = np.maximum(time[0] - instants, instants - time[-1])  # [s], which are intervals
    assert found.seen[beyond < 1.5].all()
    assert not found.seen[beyond > 3.0].any()
    inside = found.seen & (instants > 4) & (instants < 58)
    error = found.value[inside, :2] - np.stack([2.0 * np.sin(0.2 * instants), 0.4 * np.cos(0.2 * instants)], axis=1)[inside]
    spread = np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.covariance[inside, :2, :2]), error) / 2
    assert 0.4 < spread.mean() < 1.6


@pytest.mark.parametrize(("sigma", "rate"), [(1e-3, 200.0), (1e-2, 100.0)])
def test_differences_give_the_noise_of_moving_channels(sigma, rate):
    """4000 or 2000 samples at irregular times: the quantile scatters by 2 %; what is left of the motion adds less than 10 %."""
    rng = np.random.default_rng(5)
    at = motion(rng)
    time = samples(rng, at, rate=rate, jitter=0.2 / rate)
    assert difference_noise(time, at(time)[0] + rng.normal(0, sigma, len(time))) == pytest.approx(sigma, rel=0.12)


def test_a_stated_noise_is_taken_with_its_rounding():
    channel = Channel(name="a", quantity="joint.position", target="j", unit="rad", noise=3e-4, resolution=1e-3)
    assert noise_of(channel) == (pytest.approx(np.hypot(3e-4, 1e-3 / np.sqrt(12))), "stated")


def test_values_on_a_lattice_have_its_rounding_noise():
    time = np.arange(0, 20, 0.01)
    value = np.round(0.2 * np.sin(0.2 * time) / 0.01) * 0.01
    channel = Channel(name="a", quantity="joint.position", target="j", unit="rad", resolution=0.01, time=time, value=value)
    sigma, source = noise_of(channel)
    assert source in ("resolution", "differences")
    assert 0.9 * 0.01 / np.sqrt(12) < sigma < 0.01
