"""Designs: what they must hold by construction."""

import numpy as np
import pytest

from rille.model import InputRefused
from rille.model.study import Factor
from rille.study import design_cases
from study.function_studies import angles, plan

LOG = Factor(name="l", unit="Pa", spread="log", low=1.0, high=100.0)
NORMAL = Factor(name="n", unit="kg", spread="normal", mean=10.0, sigma=2.0)
LIST = Factor(name="v", unit="-", spread="values", values=(3.0, 1.0))


def values(design, samples, factors, levels=5):
    return np.array([case.values for case in design_cases(plan(design, samples, factors), levels, 10_000)])


def test_a_latin_hypercube_has_one_case_in_each_layer():
    found = values("latin_hypercube", 50, (*angles(1), LOG))
    unit = np.column_stack([(found[:, 0] + np.pi) / (2 * np.pi), np.log10(found[:, 1]) / 2])
    for column in unit.T:
        assert sorted((column * 50).astype(int)) == list(range(50))


def test_distributions():
    """4000 cases of a Latin hypercube: its means are exact to about 1 / n^1.5."""
    found = values("latin_hypercube", 4000, (LOG, NORMAL, LIST))
    assert np.median(found[:, 0]) == pytest.approx(10.0, rel=1e-3)
    assert found[:, 1].mean() == pytest.approx(10.0, abs=1e-3)
    assert found[:, 1].std() == pytest.approx(2.0, abs=1e-2)
    assert (found[:, 2] == 3.0).mean() == 0.5


def test_a_grid_has_all_combinations():
    found = values("grid", 0, (LIST, LOG), levels=3)
    np.testing.assert_allclose(found, [[3, 1], [3, 10], [3, 100], [1, 1], [1, 10], [1, 100]])


def test_sobol_is_saltellis_scheme():
    """Of each group the first row and the last differ everywhere, and each row between from the first in one factor only."""
    found = values("sobol", 8, angles()).reshape(8, 5, 3)
    for group in found:
        for k in range(3):
            assert np.flatnonzero(group[0] != group[1 + k]).tolist() == [k]
            assert group[1 + k, k] == group[4, k]


@pytest.mark.parametrize("design", ["latin_hypercube", "sobol"])
def test_the_same_seed_gives_the_same_cases(design):
    np.testing.assert_array_equal(values(design, 16, angles()), values(design, 16, angles()))


def test_what_a_design_cannot_be_is_refused():
    with pytest.raises(InputRefused, match="64 or 128"):
        values("sobol", 100, angles())
    with pytest.raises(InputRefused, match="two factors"):
        values("sobol", 64, (LOG,))
    with pytest.raises(InputRefused, match="more than"):
        values("grid", 0, angles(), levels=100)


def test_no_value_leaves_its_ends():
    """2000 random factors on grids of 2 to 9 levels: also ends whose sums and logarithms round."""
    chance = np.random.default_rng(1)
    for _ in range(2000):
        low, high = np.sort(10.0 ** chance.uniform(-12, 12, 2))
        factors = tuple(Factor(name=spread, unit="-", spread=spread, low=low, high=high) for spread in ("uniform", "log"))
        found = values("grid", 0, factors, levels=int(chance.integers(2, 10)))
        assert found.min() >= low
        assert found.max() <= high
        np.testing.assert_allclose([found.min(), found.max()], [low, high], rtol=1e-12)
