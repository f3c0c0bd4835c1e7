"""Disturbances have the statistics that they are asked for; bounds are 4 standard errors of seeded draws."""

import numpy as np
import pytest

from rille.recording.noise import coloured_noise, lapses, random_walk


def jittered(n, step, seed):
    """Ascending, irregular times."""
    return np.sort((np.arange(n) + np.random.default_rng(seed).uniform(-0.4, 0.4, n)) * step) + step


def test_coloured_noise_is_the_exact_recursion_on_irregular_times():
    times = jittered(500, 0.01, 1)
    made = coloured_noise(np.random.default_rng(2), times, 0.3, 0.05)
    normal = np.random.default_rng(2).standard_normal(500)
    x = [0.3 * normal[0]]
    for k in range(1, 500):
        a = np.exp(-(times[k] - times[k - 1]) / 0.05)
        x.append(a * x[-1] + 0.3 * np.sqrt(1 - a * a) * normal[k])
    np.testing.assert_allclose(made, x, atol=1e-13)  # both sum the same terms in another order


@pytest.mark.parametrize("time_constant", [1e-4, 0.02, 0.5])
def test_coloured_noise_has_its_variance_and_its_correlation(time_constant):
    n, step, sigma = 200_000, 0.01, 2.0
    x = coloured_noise(np.random.default_rng(3), np.arange(n) * step, sigma, time_constant)
    a = np.exp(-step / time_constant)
    independent = n * (1 - a) / (1 + a)  # samples that the mean is worth
    assert abs(x.mean()) < 4 * sigma / np.sqrt(independent)
    error = 4 * np.sqrt(2 * (1 + a * a) / (1 - a * a) / n)  # of a variance of correlated samples
    assert abs(x.var() / sigma**2 - 1) < error
    assert abs(np.mean(x[1:] * x[:-1]) / sigma**2 - a) < error


def test_random_walk_spreads_as_the_root_of_time():
    times = np.cumsum(np.random.default_rng(4).uniform(0.001, 0.1, 400))
    ends = np.array([random_walk(np.random.default_rng([5, k]), times, 0.2) for k in range(2000)])
    expected = 0.2 * np.sqrt(times)
    assert np.all(np.abs(ends.std(axis=0) / expected - 1)[[0, 50, 399]] < 4 / np.sqrt(2 * 2000))


@pytest.mark.parametrize(("fraction", "mean_length"), [(0.02, 0.5), (0.3, 0.2), (0.9, 0.1), (0.1, 0.0), (0.0, 0.3)])
def test_lapses_take_their_share_of_the_time_in_stretches_of_their_length(fraction, mean_length):
    step, n = 0.01, 400_000
    lost = lapses(np.random.default_rng(6), np.arange(n) * step, fraction, mean_length)
    edges = np.flatnonzero(np.diff(lost.astype(int)) == 1)
    if fraction == 0:
        assert not lost.any()
        return
    if mean_length == 0:
        assert abs(lost.mean() - fraction) < 4 * np.sqrt(fraction * (1 - fraction) / n)
        return
    # Seen once a step, the process is a Markov chain: a lost sample is followed by another one with the probability below.
    stays = fraction + (1 - fraction) * np.exp(-step / mean_length / (1 - fraction))
    assert abs(lost.mean() / fraction - 1) < 4 * np.sqrt(2 / len(edges))
    assert abs(lost.sum() / len(edges) * (1 - stays) - 1) < 4 / np.sqrt(len(edges))


def test_nothing_is_drawn_of_no_samples():
    empty, rng = np.empty(0), np.random.default_rng(7)
    assert len(coloured_noise(rng, empty, 1.0, 1.0)) == len(random_walk(rng, empty, 1.0)) == len(lapses(rng, empty, 0.5, 0.1)) == 0
