"""Values at the door: the short way for usual units is pint's answer to the last bit."""

import subprocess
import sys

import numpy as np
import pytest

from rille.model import InputRefused
from rille.model.quantity import SI_UNITS, USUAL, angle_with_unit, is_unit, to_si

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


@pytest.mark.parametrize(
    ("text", "si", "number"), [("9.81 m/s2", "acceleration", 9.81), ("3 kg/m3", "density", 3), ("2 cm2", "m^2", 2e-4), ("1e2 m", "m", 100)]
)
def test_powers_without_a_sign_are_read_as_headers_have_them(text, si, number):
    assert to_si(text, si, "it") == pytest.approx(number, rel=1e-15)
    assert is_unit(text.split()[1])


def test_usual_units_need_no_pint():
    code = (
        "import sys; from rille.model.quantity import to_si; to_si('35 deg', 'angle', 'x'); to_si(' .5mm ', 'm', 'x'); "
        "print('pint' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "False"


UNREADABLE = ["1,5 m", "1 000 m", "1.5.2 m", '5 "', "5 '", "m", "1 m?", "2 2 m", "3 m 2", "9**9**9 m", "1 m^99", "1/0 m", "5 % of m"]


@pytest.mark.parametrize("text", ["5 kg", "5 deg", "five m", "5 mm mm", "", "1e400 m", "nan m", *UNREADABLE])
def test_what_is_no_length_is_refused(text):
    with pytest.raises(InputRefused, match="it"):
        to_si(text, "length", "it")


def test_unusual_units_are_read_by_pint():
    assert to_si("1 ft", "length", "it") == pytest.approx(0.3048)
    assert to_si("2 turn", "angle", "it") == pytest.approx(4 * np.pi)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("1/2 ft", "m", 0.1524),
        ("-.5e1mm", "m", -0.005),
        ("5 µm", "m", 5e-6),
        ("90°", "rad", np.pi / 2),
        ("30 %", "1", 0.3),
        ("2 g/cm^3", "kg/m^3", 2000.0),
        ("2 g/cm³", "kg/m^3", 2000.0),
        ("3 kN·m", "N m", 3000.0),
        ("4 kN * m", "N m", 4000.0),
        ("4 kg/(m s^2)", "Pa", 4.0),
        ("5 1/mm", "1/m", 5000.0),
        ("60 rpm", "rad/s", 2 * np.pi),
        ("7", "m", 7.0),
    ],
)
def test_one_number_and_one_unit(text, unit, value):
    assert to_si(text, unit, "it") == pytest.approx(value)


@pytest.mark.parametrize(("text", "unit"), [("30 %", "rad"), ("3 mm/m", "rad"), ("1 Hz", "rad/s"), ("1 1/s", "rad/s")])
def test_neither_a_grade_is_an_angle_nor_a_rate_a_turning_speed(text, unit):
    """30 % are 16.7 degrees, not 17.2; 1 Hz is a turn, or a radian, a second: nobody can say."""
    with pytest.raises(InputRefused, match="write deg, rad or turn"):
        to_si(text, unit, "it")


def test_an_angle_that_a_person_typed_has_a_unit():
    """Only 0 is the same in all units; a bare 30 may mean degrees or radians."""
    assert angle_with_unit("30 deg", "heading") == pytest.approx(np.pi / 6)
    assert angle_with_unit("-0.5rad", "heading") == -0.5
    assert angle_with_unit("0", "heading") == angle_with_unit(" 0.0 ", "heading") == 0.0
    for bare in ("30", "-0.5", "30 1", "1/2", "1e-3"):
        with pytest.raises(InputRefused, match=r"heading is .* without a unit; write for example '.* deg'"):
            angle_with_unit(bare, "heading")
    with pytest.raises(InputRefused, match="heading"):
        angle_with_unit("3 m", "heading")
