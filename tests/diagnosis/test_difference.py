"""Statistics of residuals: each planted fault gets its word, its channel, its window; without one there is silence."""

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest

from made_comparison import ADVANCE, NOISE, made_comparison
from rille.diagnosis.comparison.difference import find_difference
from rille.diagnosis.comparison.difference_json import COLUMNS, difference_csv, difference_json, difference_lines
from rille.model import InputRefused

FAULTS = {
    "biased": lambda time, simulated, window, rng: np.full(len(time), 0.5 * NOISE),
    "delayed": lambda time, simulated, window, rng: np.sin(ADVANCE * (time - 0.02) + 1) - simulated,
    "scaled": lambda time, simulated, window, rng: 0.05 * simulated,
    "coloured": lambda time, simulated, window, rng: NOISE * np.sin(7 * time),
    "noisy": lambda time, simulated, window, rng: NOISE * rng.standard_normal(len(time)),
    "spiky": lambda time, simulated, window, rng: np.where(rng.random(len(time)) < 0.003, 30 * NOISE, 0.0),
}


@pytest.mark.parametrize("word", FAULTS)
def test_a_planted_fault_gets_its_word_and_only_its_channel_differs(word):
    found = find_difference([made_comparison(1, FAULTS[word])])
    assert found.differs
    assert [(channel.name, channel.verdict) for channel in found.channels if channel.differs] == [("position", word)]
    assert found.targets[0].name == "shoulder"
    assert found.targets[0].share > 0.9
    assert "position" in found.sentence


def test_delay_and_gain_are_found_within_their_errors():
    """Twenty recordings, delay 20 ms and gain 1.05: estimates within 3.5 standard errors, which they scatter by."""

    def late(time, simulated, window, rng):
        return 1.05 * np.sin(ADVANCE * (time - 0.02) + 1) - simulated

    fits = [find_difference([made_comparison(seed, late)]).channel("position").lag_fit for seed in range(20)]
    for value, error, truth in (("delay", "delay_error", 0.02), ("gain", "gain_error", 1.05)):
        values, errors = (np.array([getattr(fit, name) for fit in fits]) for name in (value, error))
        assert np.all(np.abs(values - truth) < 3.5 * errors)
        assert 0.5 < np.std(values - truth) / np.mean(errors) < 1.5  # twenty draws give their spread to 16 %


def test_the_error_of_a_delay_counts_the_gain():
    """A channel at 0.4 of its size shows its delay 2.5 times less well. Twenty draws give their spread to 16 %."""

    def late(time, simulated, window, rng):
        return 0.4 * np.sin(ADVANCE * (time - 0.02) + 1) - simulated

    fits = [find_difference([made_comparison(seed, late)]).channel("position").lag_fit for seed in range(20)]
    delays, errors = np.array([fit.delay for fit in fits]), np.array([fit.delay_error for fit in fits])
    assert np.all(np.abs(delays - 0.02) < 3.5 * errors)
    assert 0.5 < np.std(delays - 0.02) / np.mean(errors) < 1.5


@pytest.mark.parametrize("fitted", [False, True])
def test_silence_on_white_residuals(fitted):
    """60 recordings without a fault: at a false discovery rate of 5 % at most 3 differ on average by chance; 6 is the 95 % bound."""
    found = [find_difference([made_comparison(seed, fitted=fitted, windows=20, samples=60)]) for seed in range(60)]
    assert sum(difference.differs for difference in found) <= 6
    assert sum(any(window.differs for window in difference.windows) for difference in found) <= 6
    assert sum(any(regime.differs for regime in difference.regimes) for difference in found) <= 6
    ratios = np.array([channel.normalised for difference in found for channel in difference.channels])
    assert abs(np.mean(ratios) - 1) < 4 / np.sqrt(2 * 1200 * len(ratios))  # RMS of n samples scatters by 1 / sqrt(2 n)
    inside = [channel.normalised_low < 1 < channel.normalised_high for difference in found for channel in difference.channels]
    assert np.mean(inside) > 0.85  # 95 % nominal; 24 blocks make bootstrap intervals a little short


def test_heavy_tails_and_changing_noise_are_no_difference():
    """Student's t with 5 degrees of freedom of the stated standard deviation, half as strong again in every other window."""

    def heavy(rng, n):
        strength = np.where(np.arange(n) // 100 % 2 == 0, 0.8, 1.2)
        return NOISE * rng.standard_t(5, n) / np.sqrt(5 / 3) * strength / np.sqrt(np.mean(strength**2))

    found = [find_difference([made_comparison(seed, rng_noise=heavy)]) for seed in range(20)]
    assert sum(difference.differs for difference in found) <= 3


def test_worst_window_and_what_dominates_it():
    def burst(time, simulated, window, rng):
        return np.where(window == 17, 3 * NOISE * np.sin(20 * time), 0.0)

    worst = find_difference([made_comparison(3, burst, fitted=True)]).windows[0]
    assert (worst.number, worst.rank, worst.channel, worst.target) == (17, 1, "position", "shoulder")
    assert worst.differs
    assert worst.share > 0.9
    assert worst.channels["position"] > 1.5 > 1.3 > worst.channels["other"]


def test_recordings_are_pooled_and_told_apart():
    parts = [made_comparison(4, recording="good"), made_comparison(5, FAULTS["scaled"], recording="bad")]
    found = find_difference(parts)
    assert found.recordings == ("good", "bad")
    assert found.channel("position").n == 2 * 4000
    assert {window.recording for window in found.windows[:10]} == {"bad"}
    sizes = {(run.recording, run.channel): run.normalised for run in found.runs}
    assert sizes["good", "position"] < 1.1 < 2 < sizes["bad", "position"]
    assert found.channel("position").peak_recording == "bad"


def test_missing_samples_left_out_channels_and_unknown_noise():
    comparison = made_comparison(6, FAULTS["scaled"])
    first, other, velocity = comparison.channels
    holes = other.measured.copy()
    holes[::7] = np.nan
    holes[500:900] = np.nan
    channels = (replace(first, left_out="flagged bad by the gate"), replace(other, measured=holes), replace(velocity, noise=float("nan")))
    found = find_difference([replace(comparison, channels=channels)])
    assert [channel.verdict for channel in found.channels] == ["left out", "white", "no data"]
    assert found.channel("other").n == np.count_nonzero(np.isfinite(holes))
    assert found.channel("velocity").rms == pytest.approx(NOISE, rel=0.05)
    assert not found.differs
    assert {window.channel for window in found.windows} <= {"", "other"}
    assert {regime.channel for regime in found.regimes} == {"other"}


def test_angles_are_compared_around_the_circle():
    comparison = made_comparison(7)
    first = comparison.channels[0]
    channel = replace(first.channel, quantity="part.orientation", component="yaw", target="chassis")
    turned = replace(first, channel=channel, measured=first.measured + 2 * np.pi)
    found = find_difference([replace(comparison, channels=(turned,))])
    assert found.channel("position").verdict == "white"


def test_a_recording_with_a_handful_of_samples():
    found = find_difference([made_comparison(8, windows=1, samples=5)])
    assert [channel.verdict for channel in found.channels] == ["no data"] * 3
    assert found.sentence.startswith("nothing could be judged")
    assert json.loads(json.dumps(difference_json(found), allow_nan=False))["differs"] is False


def test_one_long_window_is_judged_by_its_parts():
    found = find_difference([made_comparison(9, FAULTS["coloured"], windows=1, samples=4000)])
    assert found.channel("position").verdict == "coloured"
    assert found.channel("position").normalised_low < found.channel("position").normalised < found.channel("position").normalised_high


def test_comparisons_that_cannot_be_pooled():
    one = made_comparison(10)
    with pytest.raises(InputRefused, match="several models"):
        find_difference([one, replace(one, model="another")])
    with pytest.raises(InputRefused, match="several modes"):
        find_difference([one, replace(one, mode="whole")])
    with pytest.raises(InputRefused, match="no comparison"):
        find_difference([])


def test_json_csv_and_text_say_the_same():
    found = find_difference([made_comparison(seed, FAULTS["scaled"], recording=name) for seed, name in ((11, "a"), (12, "b"))])
    data = json.loads(json.dumps(difference_json(found), allow_nan=False))
    assert [channel["name"] for channel in data["channels"]] == ["position", "other", "velocity"]
    assert data["channels"][0]["verdict"] == "scaled"
    assert len(data["windows"]) == 80
    assert data["regimes"][0]["edges"][0] < data["regimes"][0]["edges"][-1]
    rows = list(csv.DictReader(io.StringIO(difference_csv(found))))
    assert tuple(rows[0]) == COLUMNS
    assert [row["recording"] for row in rows] == ["*"] * 3 + ["a"] * 3 + ["b"] * 3
    assert float(rows[0]["rms"]) == pytest.approx(data["channels"][0]["rms"])
    text = "\n".join(difference_lines(found))
    assert found.sentence in text
    assert "scaled" in text
    assert max(len(line) for line in text.splitlines()) < 200


def test_the_same_comparison_gives_the_same_bytes():
    first, second = (json.dumps(difference_json(find_difference([made_comparison(13, FAULTS["coloured"])]))) for _ in range(2))
    assert first == second


def test_what_happens_once_is_not_lost_among_many_windows():
    """One window of 400 at 2.2 times the noise: less than 1 % of the mean square of all."""

    def burst(time, simulated, window, rng):
        return np.where(window == 170, 2 * NOISE * rng.standard_normal(len(time)), 0.0)

    found = find_difference([made_comparison(14, burst, windows=400)])
    assert [channel.name for channel in found.channels if channel.differs] == ["position"]
    assert found.windows[0].number == 170
    assert found.channel("position").normalised < 1.02


def test_rounding_is_no_difference():
    """A channel read in steps of 3 times its noise: residuals of what moves slowly are far from white, but no larger than the rounding."""
    comparison = made_comparison(15)
    step = 3 * NOISE
    channels = []
    for channel in comparison.channels:
        rounded = np.round(channel.measured / step) * step
        noise = float(np.hypot(NOISE, step / np.sqrt(12)))
        channels.append(replace(channel, channel=replace(channel.channel, resolution=step), measured=rounded, noise=noise))
    found = find_difference([replace(comparison, channels=tuple(channels))])
    assert not found.differs, found.sentence


def test_a_delay_that_cannot_be_seen_is_not_stated():
    """What stands still, and a steady ramp, whose delay looks like an offset."""
    comparison = made_comparison(16)
    time = comparison.channels[0].time
    noise = comparison.channels[0].measured - comparison.channels[0].simulated
    for simulated in (np.full(len(time), 0.7), 0.2 * time):
        channel = replace(comparison.channels[0], simulated=simulated, measured=simulated + noise)
        fit = find_difference([replace(comparison, channels=(channel,))]).channel("position").lag_fit
        assert np.isnan(fit.delay)
