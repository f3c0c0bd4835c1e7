"""Residuals against conditions: planted dependences are found under the right regime, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest

from made_comparison import ADVANCE, NOISE, made_comparison
from rille.diagnosis.comparison.difference import find_difference
from rille.model.comparison import Regimes


def test_friction_shows_against_the_joint_speed_as_a_step():
    def friction(time, simulated, window, rng):
        return 0.7 * NOISE * np.sign(np.cos(ADVANCE * time + 1))

    found = find_difference([made_comparison(1, friction)]).regimes
    first = found[0]
    assert (first.channel, first.regime, first.differs) == ("position", "joint_speed/shoulder", True)
    assert first.bias[0] == pytest.approx(-0.7, abs=4 * first.bias_error[0])
    assert first.bias[-1] == pytest.approx(0.7, abs=4 * first.bias_error[-1])
    assert first.trend > 5 * first.trend_error
    assert first.explained == pytest.approx(0.7**2 / (1 + 0.7**2), abs=0.05)
    assert not any(row.differs for row in found if row.channel != "position")


def test_noise_that_grows_with_speed_is_growth_without_trend():
    def rough(time, simulated, window, rng):
        return NOISE * 2 * np.abs(np.sin(0.3 * time)) * rng.standard_normal(len(time))

    rows = {(row.channel, row.regime): row for row in find_difference([made_comparison(2, rough)]).regimes}
    row = rows["position", "speed"]
    assert row.differs
    assert row.growth > 5 * row.growth_error
    assert abs(row.trend) < 4 * row.trend_error
    assert row.rms[-1] > 2 * row.rms[0] > 1.5
    assert not rows["other", "speed"].differs


def test_bins_hold_equal_numbers_and_all_samples():
    row = find_difference([made_comparison(3)]).regimes[0]
    assert row.n.sum() == 4000
    assert row.n.max() - row.n.min() < 40  # interpolated values tie where the regime is held at a window's ends
    assert np.all(np.diff(row.edges) > 0)
    assert np.all((row.edges[:-1] <= row.centre) & (row.centre <= row.edges[1:]))


def test_regimes_that_do_not_vary_or_are_missing_are_no_rows():
    comparison = made_comparison(4)
    n = len(comparison.regimes.time)
    values = {"still": np.zeros(n), "gone": np.full(n, np.nan), "steps": np.round(np.linspace(0, 1, n))}
    found = find_difference([replace(comparison, regimes=replace(comparison.regimes, values=values))])
    assert {row.regime for row in found.regimes} == {"steps"}
    none = Regimes(time=np.empty(0), window=np.empty(0, dtype=np.int64), values={})
    assert find_difference([replace(comparison, regimes=none)]).regimes == ()


def test_a_regime_of_one_recording_only():
    first, second = made_comparison(5, recording="a"), made_comparison(6, recording="b")
    second = replace(second, regimes=replace(second.regimes, values={"slope": second.regimes.time.copy()}))
    rows = {(row.channel, row.regime): row for row in find_difference([first, second]).regimes}
    assert rows["other", "slope"].n.sum() == 4000
    assert rows["other", "speed"].n.sum() == 4000
