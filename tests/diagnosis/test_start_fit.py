"""Starts of windows: fitted in all directions that count, and far from what was smoothed only where that alone explains a window."""

from dataclasses import replace

import numpy as np
import pytest

from rille import diagnosis, simulate
from rille.diagnosis.starts.start_fit import Samples, fit_starts, fit_starts_doubting
from rille.diagnosis.starts.start_states import KEPT_SHARE, UNSURE, Starts
from rille.diagnosis.starts.state_coordinates import N_ROOT, coordinates_of
from rille.model.recording import Channel
from swung import model, recorded

NOISE, COUNT, LENGTH = 1e-3, 200, 1.0
POSITION = Channel(name="q", quantity="joint.position", target="hinge", unit="rad", time=np.empty(0), value=np.empty(0))


class Hinge:
    """A joint that goes on as it began in its first window, and is held where it began in all others."""

    has_memory = False

    def predict(self, states, stops, channels, picks):
        """q0 + v0 s, or q0."""
        ((window, time),) = picks
        begin, value, rate = states[:, window, 0], states[:, window, N_ROOT], states[:, window, N_ROOT + 1]
        return [value + np.where(begin == 0, rate, 0.0) * (time - begin)]


def five_windows(off, spread):
    """Smoothed starts of five windows that are ``off`` (5, 2) [rad, rad/s] from where the joint is, their standard deviations being
    ``spread``, and the samples.
    """
    rng = np.random.default_rng(0)
    states = np.zeros((5, N_ROOT + 2))
    states[:, 0], states[:, 4] = np.arange(5) * LENGTH, 1.0
    states[:, N_ROOT:] += off
    starts = Starts(
        states=states,
        coordinates=coordinates_of("", ["hinge"], []),
        factor=np.tile(np.diag(spread), (5, 1, 1, 1)),
        seen=np.ones((5, 1), dtype=bool),
        axes=np.tile(np.eye(3), (5, 1, 1)),
        ended=("",) * 5,
        kept=np.zeros((5, 1), dtype=bool),
        widths=(np.full(5, 0.1),),
    )
    time = np.concatenate([k * LENGTH + LENGTH * (np.arange(COUNT) + 0.5) / COUNT for k in range(5)])
    samples = Samples(
        channel=POSITION, window=np.repeat(np.arange(5), COUNT), time=time, value=rng.normal(0, NOISE, len(time)), noise=NOISE
    )
    return starts, (np.arange(5) + 1) * LENGTH, [samples]


def left(fit, samples):
    """Chi-squared per sample of each window."""
    answer = Hinge().predict(fit.states[None], None, None, [(samples.window, samples.time)])[0][0]
    return np.bincount(samples.window, ((samples.value - answer) / NOISE) ** 2) / COUNT


def test_a_direction_that_one_window_alone_shows():
    """Its rate is 2 standard deviations off, 40 times the noise at the end of the window; the other windows know no rate."""
    off = np.zeros((5, 2))
    off[0, 1] = 0.04
    starts, stops, samples = five_windows(off, [NOISE, 0.02])
    fit = fit_starts(Hinge(), starts, stops, samples)
    assert fit.directions.columns == ((0, 0), (0, 1))
    assert len(fit.unfit) == 0
    assert left(fit, samples[0]) == pytest.approx(1, abs=6 * np.sqrt(2 / COUNT))


def test_a_smoothed_start_that_is_worse_than_it_says():
    """30 times its standard deviation of a tenth of the noise: what says that it is right weighs half as much as all 200 samples. Doubted,
    they outweigh it 18 times; the other windows are as they were.
    """
    off = np.zeros((5, 2))
    off[3, 0] = 3 * NOISE
    starts, stops, samples = five_windows(off, [NOISE / 10, 1e-6])
    trusted, doubted = (fit(Hinge(), starts, stops, samples) for fit in (fit_starts, fit_starts_doubting))
    assert trusted.unfit.tolist() == [3]
    assert len(doubted.unfit) == 0
    assert left(doubted, samples[0])[3] < 1.7 < left(trusted, samples[0])[3]
    others = [0, 1, 2, 4]
    assert doubted.states[others] == pytest.approx(trusted.states[others], abs=1e-12)


def test_a_model_that_is_wrong_everywhere_is_not_excused():
    """Three of five windows: then it is not the starts."""
    off = np.zeros((5, 2))
    off[1:4, 0] = 3 * NOISE
    starts, stops, samples = five_windows(off, [NOISE / 10, 1e-6])
    fit = fit_starts_doubting(Hinge(), starts, stops, samples)
    assert fit.unfit.tolist() == [1, 2, 3]


def test_what_is_doubted():
    """What is seen three times, what contact decided as uncertain as recorded; other windows not."""
    starts, _, _ = five_windows(np.zeros((5, 2)), [1.0, 1.0])
    kept = np.zeros((5, 1), dtype=bool)
    kept[2] = True
    doubted = replace(starts, kept=kept).doubted(np.array([1, 2]))
    assert doubted.factor[:, 0, 0, 0] == pytest.approx([1, UNSURE, 1 / KEPT_SHARE, 1, 1])


def test_starts_take_no_more_than_they_have(make_model):
    """The trace of what the fit takes is at most its four numbers a window, also where noise is not stated and less of it is left once the
    motion is known: 25 samples a second of a swing are far from smooth.
    """
    path, scenario = model(make_model, 4)
    run = recorded(path, scenario, 4)
    run = replace(run, channels=tuple(replace(c, noise=None, time=c.time[::40], value=c.value[::40]) for c in run.channels))
    comparison = diagnosis.compare_windows(simulate.Replayer(path), run)
    assert any(channel.noise_from == "innovations" for channel in comparison.channels)
    taken = sum(float(np.sum((channel.start_gain / channel.noise) ** 2)) for channel in comparison.channels)
    assert 0 < taken <= 4 * len(comparison.windows) * (1 + 1e-9)
