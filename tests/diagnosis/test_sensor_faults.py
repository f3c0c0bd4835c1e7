"""What a faulty sensor says, and what is told by it: repaired, what was said is the truth again, or not known."""

import numpy as np
import pytest

from rille.diagnosis.hypotheses.sensor_faults import FAULTS, repaired
from rille.model.hypothesis import Hypothesis
from rille.model.recording import Channel

SIZES = {"bias": {"offset": 0.4}, "scale": {"relative_error": 0.04}, "drift": {"rate": 0.1}, "wrong_sign": {"flip": 1.0}}


def within_half_a_turn(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def fault(kind, numbers):
    return (Hypothesis(cause="sensor", kind=kind, target="roll", target_kind="channel", free=(), fixed=numbers).at(),)


@pytest.mark.parametrize(("kind", "numbers"), [*SIZES.items(), ("scale", {"relative_error": -0.04})])
@pytest.mark.parametrize("quantity", ["part.orientation", "part.angular_velocity"])
def test_what_is_repaired_is_the_truth(kind, numbers, quantity):
    """Of a body that rolls over, too: an angle that a fault takes beyond half a turn is said within it. A scale of 1.04 says the last 4 %
    of half a turn twice; there it is not known what was true, and nowhere else.
    """
    time = np.linspace(0.0, 3.0, 2001)
    angle = quantity == "part.orientation"
    truth = within_half_a_turn(5.0 * np.sin(2.0 * time)) if angle else 5.0 * np.sin(2.0 * time)
    said = FAULTS[kind].said(truth, time, numbers)
    said = within_half_a_turn(said) if angle else said
    component, unit = ("roll", "rad") if angle else ("x", "rad/s")
    channel = Channel(name="roll", quantity=quantity, component=component, target="base", unit=unit, time=time, value=said)
    again = repaired(fault(kind, numbers), channel).value
    known = np.isfinite(again)
    twice = np.abs(said) > np.pi * (2 - 1.04) if angle and numbers.get("relative_error", 0) > 0 else np.zeros(len(time), dtype=bool)
    assert np.array_equal(known, ~twice)
    error = again[known] - truth[known]
    assert (within_half_a_turn(error) if angle else error) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("kind", "numbers"), [("drift", {"rate": 0.5}), ("scale", {"relative_error": 0.04}), ("bias", {"offset": 9.0})])
def test_of_many_turns_nothing_is_lost(kind, numbers):
    """A drift by three turns, said within half a one, and a heading that counts its turns say one truth each, turns aside."""
    time = np.linspace(0.0, 40.0, 2001)
    truth = 0.4 * time if kind == "scale" else within_half_a_turn(0.4 * time)
    said = FAULTS[kind].said(truth, time, numbers)
    said = said if kind == "scale" else within_half_a_turn(said)
    channel = Channel(name="roll", quantity="part.orientation", component="yaw", target="base", unit="rad", time=time, value=said)
    again = repaired(fault(kind, numbers), channel).value
    assert within_half_a_turn(again - truth) == pytest.approx(0.0, abs=1e-9)
