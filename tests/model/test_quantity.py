"""Values at the door: the short way for usual units is pint's answer to the last bit."""

import subprocess
import sys

import numpy as np
import pytest

from rille.model import InputRefused
from rille.model.quantity import SI_UNITS, USUAL, to_si

SI = [(unit, unit) for unit in (*SI_UNITS.values(), "Pa s/m", "1/m^2")]


@pytest.mark.parametrize(("unit", "si"), [*sorted(USUAL), *SI])
def test_usual_units_are_pints(unit, si):
    """Random numbers, whole numbers and two decimals: equal in every bit, so that no database changes with the way it was read."""
    import pint

    registry = pint.UnitRegistry()
    random = np.random.default_rng(1)
    values = [*random.uniform(-1000, 1000, 200), *range(-20, 20), *np.round(random.uniform(0, 10, 100), 2), 1e-9, 3e8]
    for value in values:
        assert to_si(f"{value} {unit}", si, "it") == float(registry.Quantity(f"{value} {unit}").m_as(si))


def test_usual_units_need_no_pint():
    code = (
        "import sys; from rille.model.quantity import to_si; to_si('35 deg', 'angle', 'x'); to_si(' .5mm ', 'm', 'x'); "
        "print('pint' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "False"


@pytest.mark.parametrize("text", ["5 kg", "5 deg", "five m", "5 mm mm", "", "1e400 m", "nan m"])
def test_what_is_no_length_is_refused(text):
    with pytest.raises(InputRefused, match="it"):
        to_si(text, "length", "it")


def test_unusual_units_are_read_by_pint():
    assert to_si("1 ft", "length", "it") == pytest.approx(0.3048)
    assert to_si("2 turn", "angle", "it") == pytest.approx(4 * np.pi)
