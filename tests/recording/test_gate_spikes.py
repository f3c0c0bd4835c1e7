"""Needles are found, and what only looks like one is not."""

import numpy as np
import pytest

from rille.model.recording import Channel, GateFinding
from rille.recording.gate.spikes import check_spikes

RNG = np.random.default_rng(7)
TIME = np.arange(500) * 0.01


def found(value: np.ndarray, resolution: float | None = None, quantity: str = "joint.position", unit: str = "rad") -> list[GateFinding]:
    channel = Channel(
        name="q", target="arm", time=np.linspace(0, 0.01 * (len(value) - 1), len(value)), value=value, quantity=quantity, unit=unit
    )
    return check_spikes(channel, resolution)


def smooth(n: int = 500) -> np.ndarray:
    time = np.arange(n) * 0.01
    return np.sin(3 * time) + 1e-3 * RNG.normal(size=n)


@pytest.mark.parametrize("n", [500, 20_000])
@pytest.mark.parametrize("wide", [1, 2])
def test_needles_are_counted(n: int, wide: int):
    value, at = smooth(n), np.array([40, 111, 250, 333, 480])
    for k in at:
        value[k : k + wide] += 2.0 * (-1) ** k
    (finding,) = found(value)
    assert (finding.code, finding.severity, finding.detail["count"]) == ("spike", "warning", 5)
    assert finding.detail["times"] == pytest.approx(at * 0.01)
    assert finding.detail["size"] == pytest.approx(2.0, abs=0.05)  # the motion goes on by 0.03 in a sample


def test_a_needle_between_missing_values():
    value = smooth()
    value[::7] = np.nan
    value[100] = 3.0
    (finding,) = found(value)
    assert finding.detail["times"] == [pytest.approx(1.0)]


def wrapped() -> np.ndarray:
    """An angle that dithers about a half turn."""
    return (np.pi + 0.05 * np.sin(3 * TIME) + 0.01 * RNG.normal(size=500) + np.pi) % (2 * np.pi) - np.pi


def pulses() -> np.ndarray:
    """Zero but for single samples of any height."""
    return np.where(np.arange(500) % 25 == 3, RNG.exponential(size=500), 0.0)


@pytest.mark.parametrize(
    ("value", "like"),
    [
        (smooth(), {}),
        (smooth() + 5.0 * (TIME > 2), {}),
        (smooth() + 5.0 * ((TIME > 2) & (TIME < 2.035)), {}),
        (RNG.normal(size=500), {"quantity": "joint.velocity", "unit": "rad/s"}),
        (np.round(np.sin(0.5 * TIME) / 0.01) * 0.01, {}),
        (np.repeat(RNG.normal(size=50), 10), {"quantity": "part.position", "unit": "m"}),
        (pulses(), {"quantity": "joint.velocity", "unit": "rad/s"}),
        (np.where(np.arange(500) == 77, 4.0, 0.0), {}),
        (wrapped(), {"quantity": "part.orientation", "unit": "rad"}),
        (np.where(np.arange(500) % 50 == 0, -1, 1) * np.cos(0.1 * TIME), {"quantity": "part.orientation", "unit": "1"}),
        (np.where(np.arange(500) == 77, 40.0, smooth()), {"quantity": "joint.effort", "unit": "N m"}),
    ],
    ids=["clean", "step", "pulse", "noise", "quantised", "held", "sparse", "one event", "wrapped", "quaternion", "effort"],
)
def test_silence(value: np.ndarray, like: dict[str, str]):
    assert found(value, None, **like) == []


def test_steps_of_a_coarse_sensor_are_no_needles():
    """A dithering last digit: fifteen steps are within what is usual for the resolution, fifty are not."""
    value = np.round(20 * np.sin(2 * TIME))
    value[200] += 15
    assert found(value, 1.0) == []
    value[200] += 35
    assert len(found(value, 1.0)) == 1
