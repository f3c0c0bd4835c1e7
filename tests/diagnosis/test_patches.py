"""Circles on the map are located from what the windows ask for: made evidence of a drive that crosses patches of another resistance."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from rille.diagnosis.inference.patches import patch_tries
from rille.model.hypothesis import FreeNumber, Hypothesis

EACH = 12  # samples of a window


def patch():
    """A law that changes two numbers inside a circle; names and bounds as the catalogue could give them."""

    def number(name, **more):
        values = {"unit": "1", "amplitude": True, "lower": -0.95, "upper": 20.0, "start": 0.0, "spread": 0.5} | more
        return FreeNumber(name=name, **values)

    place = {"unit": "m", "amplitude": False, "lower": -1e6, "upper": 1e6, "spread": 10.0, "search": "place"}
    size = {"unit": "m", "amplitude": False, "lower": 1e-3, "upper": 1e6, "start": 2.0, "spread": 2.0, "search": "scale"}
    free = (number("stiffness"), number("grip", upper=0.5), number("at_x", **place), number("at_y", **place), number("radius", **size))
    return Hypothesis(cause="effect", kind="patch", target="", target_kind="terrain", free=free)


@dataclass(slots=True)
class Drive:
    """Evidence of windows at ``places``; the load varies, stiffness shows in the first half of a window's samples, grip in the second."""

    places: np.ndarray
    truth: tuple = ()
    seed: int = 0
    noise: np.ndarray = field(init=False)
    load: np.ndarray = field(init=False)

    def __post_init__(self):
        rng = np.random.default_rng(self.seed)
        self.noise = rng.standard_normal(len(self.places) * EACH)
        self.load = rng.uniform(0.5, 1.5, len(self.places))

    channels = ()

    @property
    def window(self):
        return np.repeat(np.arange(len(self.places)), EACH)

    @property
    def start_gain(self):
        return np.zeros((len(self.noise), 0))

    def shown(self, stiffness, grip, at_x, at_y, radius):
        inside = np.hypot(self.places[:, 0] - at_x, self.places[:, 1] - at_y) <= radius
        first = np.repeat([1.0, 0.0], EACH // 2)
        return (inside * self.load)[:, None] * (6 * np.log1p(stiffness) * first + 4 * grip * (1 - first))

    def residuals(self, settings):
        measured = self.noise + sum(self.shown(**numbers).ravel() for numbers in self.truth)
        rows = [measured - sum(self.shown(**term.numbers).ravel() for term in setting) for setting in settings]
        return np.array(rows)


def track(n=80):
    """A loop of 20 m by 8 m."""
    angle = np.linspace(0, 2 * np.pi, n)
    return np.column_stack([10 * np.cos(angle), 4 * np.sin(angle)])


@pytest.mark.parametrize("seed", range(4))
def test_a_patch_is_located(seed):
    """Softer soil within 2.5 m of (6, 3): the centre to 1.5 m (the track passes on one side), the radius to a factor of two."""
    drive = Drive(track(), ({"stiffness": -0.4, "grip": 0.2, "at_x": 6.0, "at_y": 3.0, "radius": 2.5},), seed)
    best = patch_tries(drive, [patch()], drive.places)["patch"][0]
    assert np.hypot(best["at_x"] - 6, best["at_y"] - 3) < 1.5
    assert 1.25 < best["radius"] < 5
    assert set(best) == {"at_x", "at_y", "radius"}


def test_two_patches_are_two_starts():
    """One softer, one stiffer, on either end of the loop."""
    drive = Drive(
        track(),
        (
            {"stiffness": -0.5, "grip": 0.0, "at_x": 9.0, "at_y": 0.0, "radius": 2.0},
            {"stiffness": 1.0, "grip": 0.0, "at_x": -9.0, "at_y": 0.0, "radius": 2.0},
        ),
    )
    starts = patch_tries(drive, [patch()], drive.places, most=4)["patch"]
    assert min(abs(s["at_x"] - 9) for s in starts) < 1.5
    assert min(abs(s["at_x"] + 9) for s in starts) < 1.5


def test_nothing_is_located_where_nothing_is():
    drive = Drive(track(), seed=3)
    assert patch_tries(drive, [patch()], drive.places) == {}
    standing = np.zeros((80, 2))
    assert patch_tries(Drive(standing), [patch()], standing) == {}
    assert patch_tries(drive, [patch()], np.full((80, 2), np.nan)) == {}
