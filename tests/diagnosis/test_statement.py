"""The verdict in words says what it is, and how much of it."""

from dataclasses import replace

import pytest

from made_diagnosis import BIAS, COULOMB, made_diagnosis, named
from rille.diagnosis.answer.statement import statement

MADE = made_diagnosis()
FRICTION = named(COULOMB, {"torque": 0.8}, {"torque": 0.02})
FAULT = named(BIAS, {"offset": 0.1}, {"offset": 0.01})


def said(terms, leftover=0.0, proof=None):
    return statement("named", terms, MADE.ranked, MADE.location, leftover, proof, (), ())


def test_a_fault_of_a_sensor_is_not_missing_in_the_model():
    text = said((FRICTION, FAULT))
    assert text.startswith(f"This is missing in the model: {COULOMB.title}, torque 0.8")
    assert f"a sensor is at fault: {BIAS.title}" in text
    assert said((FRICTION,)).count("sensor") == 0


@pytest.mark.parametrize(("leftover", "words"), [(0.0, "all that is clearly beyond the noise"), (0.2, "80 % of what is beyond the noise")])
def test_how_much_it_explains(leftover, words):
    assert f"explains {words}" in said((FRICTION,), leftover)


@pytest.mark.parametrize(("after", "more"), [(1.2, False), (3.0, True)])
def test_what_is_left_plainly_beyond_the_noise_is_told(after, more):
    assert MADE.proof is not None
    text = said((FRICTION,), proof=replace(MADE.proof, after=after, floor=1.0))
    assert ("not all of it" in text) is more


def test_a_group_none_of_whose_numbers_is_told_is_said_by_its_title():
    """Numbers of a soil that together explain the curves, each of them within its interval of what it was."""
    row = replace(MADE.ranked[0], title="numbers of the soil", cause="parameter", group=0)
    text = statement("group", (), (row,), MADE.location, 0.0, None, (), ())
    assert text.startswith("Numbers of the model are wrong, or something that these recordings cannot tell from it: numbers of the soil;")
