"""Ljung-Box over windows: its p is uniform on white residuals, also when start states were fitted to them."""

import numpy as np
import pytest

from made_comparison import NOISE, made_comparison
from rille.diagnosis.comparison.pooled import pool
from rille.diagnosis.comparison.whiteness import whiteness


@pytest.mark.parametrize("fitted", [False, True])
def test_p_is_uniform_on_white_residuals(fitted):
    """300 p values: shares below 5 % and 50 % within 4 binomial standard deviations. Windows of 40 samples, two numbers fitted each."""
    p = np.array(
        [whiteness(channel).p for seed in range(100) for channel in pool([made_comparison(seed, fitted=fitted, windows=30, samples=40)])]
    )
    for level in (0.05, 0.5):
        assert abs(np.mean(p < level) - level) < 4 * np.sqrt(level * (1 - level) / len(p))


def test_without_the_correction_fitted_starts_look_like_a_difference():
    """What the correction is for: two numbers fitted per 40 samples leave a lag-1 correlation of -2 / 40."""
    channel = pool([made_comparison(1, fitted=True, windows=400, samples=40)])[0]
    plain = np.mean(channel.z[1:][channel.neighbours(1)] * channel.z[:-1][channel.neighbours(1)]) / np.mean(channel.z**2)
    assert plain == pytest.approx(-2 / 40, abs=4 / np.sqrt(16000))
    white = whiteness(channel)
    assert abs(white.lag1) < 4 * white.lag1_error


def test_first_order_correlation_is_measured():
    """z_i = 0.4 z_(i-1) + e: lag-1 correlation 0.4, within 5 standard errors of 1 / sqrt(n) (coloured residuals scatter a bit more)."""

    def coloured(rng, n):
        e = rng.standard_normal(n) * np.sqrt(1 - 0.4**2)
        z = np.zeros(n)
        for k in range(1, n):
            z[k] = 0.4 * z[k - 1] + e[k]
        return NOISE * z

    white = whiteness(pool([made_comparison(2, rng_noise=coloured, windows=100)])[0])
    assert white.lag1 == pytest.approx(0.4, abs=5 / np.sqrt(10000))
    assert white.autocorrelation[1] == pytest.approx(0.16, abs=5 / np.sqrt(10000))
    assert white.p < 1e-12


def test_pairs_do_not_cross_windows():
    """An offset that changes sign from window to window correlates samples only within one."""

    def jumps(time, simulated, window, rng):
        return np.where(window % 2 == 0, NOISE, -NOISE)

    channel = pool([made_comparison(3, jumps, windows=400, samples=10)])[0]
    white = whiteness(channel)
    assert white.lags == 2
    assert white.lag1 == pytest.approx(0.5, abs=0.06)  # offset and noise are equally strong; 4 standard errors of 3600 pairs


def test_too_short_windows_tell_nothing():
    assert whiteness(pool([made_comparison(4, windows=30, samples=4)])[0]) is None
