"""The double pendulum, recorded in simulation and replayed: with its own model the residual is the noise, with a wrong one the error."""

from dataclasses import replace

import numpy as np
import pytest

from machines import chain
from rille import diagnosis, simulate, store
from rille.diagnosis.evidence.held_out import cut_in_time
from rille.diagnosis.pushes.residual_effort import residual_effort
from rille.model import Drive, Effect, InputRefused
from rille.model.recording import Channel, Recording
from swung import DELAY, model, recorded, sensors


def chi2(channels):
    """Sum of squared standardised residuals, and how many they are."""
    left = np.concatenate([channel.residual / channel.noise for channel in channels])
    return float(left @ left), len(left)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_residuals_are_white_at_the_noise(make_model, seed):
    """20 000 samples: chi-squared scatters by 1 %, and four fitted numbers of each of 16 windows take 0.3 %; lag 1 scatters by 0.02."""
    path, scenario = model(make_model, seed)
    comparison = diagnosis.compare_windows(simulate.Replayer(path), recorded(path, scenario, seed))
    total, count = chi2(comparison.channels)
    assert total / count == pytest.approx(0.997, abs=0.04)
    for channel in comparison.channels:
        left = channel.residual / channel.noise
        assert abs(np.mean(left[1:] * left[:-1])) < 0.08
        assert abs(left.mean()) < 0.07
    assert count > 20_000
    assert not any(window.start < 3.2 and window.stop > 3.0 for window in comparison.windows)  # none spans the gap


def test_noise_that_is_not_stated_is_found(make_model):
    """Within 10 % of what was put in, for every channel."""
    path, scenario = model(make_model, 4)
    run = recorded(path, scenario, 4)
    true = {c.name: c.noise for c in run.channels}
    run = replace(run, channels=tuple(replace(c, noise=None) for c in run.channels))
    for channel in diagnosis.compare_windows(simulate.Replayer(path), run).channels:
        assert channel.noise == pytest.approx(true[channel.channel.name], rel=0.1)
        assert channel.noise_from in ("differences", "innovations")


def test_rounded_values_differ_by_their_rounding(make_model):
    """Without noise and with steps of 2 mrad: a residual is at most half a step, and what the start may be off by for the same reason
    (another standard deviation of rounding, 0.58 mrad); all of them together have the size of rounding errors (a joint that swings slowly
    may be rounded alike for a while).
    """
    path, scenario = model(make_model, 5)
    run = recorded(path, scenario, 5, [replace(c, noise=0.0, resolution=2e-3) for c in sensors() if c.quantity == "joint.position"])
    for channel in diagnosis.compare_windows(simulate.Replayer(path), run).channels:
        assert channel.noise == pytest.approx(2e-3 / np.sqrt(12))
        assert np.abs(channel.residual).max() < 1e-3 + 0.58e-3
        assert np.std(channel.residual) == pytest.approx(channel.noise, rel=0.2)
        assert not channel.left_out


def test_the_whole_run_from_one_start(make_model):
    """8 s from one fitted start: still the noise, where the motion is not chaotic."""
    path, scenario = model(make_model, 5)
    comparison = diagnosis.compare_whole(simulate.Replayer(path), recorded(path, scenario, 5))
    total, count = chi2(comparison.channels)
    assert len(comparison.windows) == 1
    assert comparison.mode == "whole"
    assert total / count == pytest.approx(1, abs=0.05)


def test_friction_that_the_model_lacks_shows_in_its_joint_and_not_in_the_start(make_model):
    """Dry friction of 0.05 N m in hinge 2: windows start where the recording shows it, and the error grows by what the torque gives."""
    path, scenario = model(make_model, 6, [Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.05})])
    run = recorded(path, scenario, 6)
    wrong, _ = model(make_model, 6)
    comparison = diagnosis.compare_windows(simulate.Replayer(wrong), run)
    by_name = {c.channel.name: c for c in comparison.channels}
    for channel in (by_name["angle1"], by_name["angle2"]):
        since = channel.time - DELAY - np.array([w.start for w in comparison.windows])[channel.window]
        early, late = channel.residual[since < 0.02], channel.residual[since > 0.3]
        assert np.sqrt(np.mean(early**2)) < 5 * channel.noise  # it starts where the recording was
        assert np.sqrt(np.mean(late**2)) > 20 * channel.noise
    assert np.median([w.shift for w in comparison.windows]) < 3
    inverse = diagnosis.compare_inverse(simulate.Replayer(wrong), run)
    lacking = {c.channel.name: c for c in inverse.channels}
    assert np.median(np.abs(lacking["torque2"].residual)) == pytest.approx(0.05, rel=0.25)  # whichever way it turns


@pytest.mark.parametrize("seed", [5, 6])
def test_inverse_dynamics_gives_back_the_torques(make_model, seed):
    """About 50 spans: their standardised residuals scatter by 10 %, the bias of the smoother adds to it."""
    path, scenario = model(make_model, seed)
    comparison = diagnosis.compare_inverse(simulate.Replayer(path), recorded(path, scenario, seed))
    total, count = chi2(comparison.channels)
    assert 0.4 < total / count < 2
    assert all(c.noise < 0.05 for c in comparison.channels)


def test_an_encoder_that_begins_anew_after_a_turn_is_read_as_one_that_counts_on(make_model):
    """Three times the torque: rods turn over. Efforts that the motion needs, and those that no command gave, are the same. To
    rounding, but where rounding decides how wide the smoother is (6 of 720 values differ, by 0.0006 N m of several).
    """
    path, scenario = model(make_model, 1)
    wild = replace(scenario, commands=tuple(replace(c, value=3 * c.value) for c in scenario.commands))
    path = make_model(store.read_rover(path), wild)
    run = recorded(path, wild, 1)
    wrapped = {c.name: np.mod(c.value + np.pi, 2 * np.pi) - np.pi for c in run.channels if c.quantity == "joint.position"}
    assert any(np.abs(np.diff(value)).max() > 6 for value in wrapped.values())
    anew = replace(run, channels=tuple(replace(c, value=wrapped.get(c.name, c.value)) for c in run.channels))
    first, second = (diagnosis.compare_inverse(simulate.Replayer(path), one) for one in (run, anew))
    for one, other in zip(first.channels, second.channels, strict=True):
        assert other.simulated == pytest.approx(one.simulated, rel=1e-6, abs=1e-6)
    first, second = (residual_effort(simulate.Replayer(path), one) for one in (run, anew))
    assert second.value == pytest.approx(first.value, rel=1e-6, abs=2e-3, nan_ok=True)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"target": "hinge3"}, "no driven joint"),
        ({"quantity": "joint.velocity"}, "mode is torque"),
        ({"quantity": "motor.current"}, "drives are commanded by"),
        ({"value": np.full(800, np.nan)}, "holds no value"),
    ],
)
def test_commands_that_do_not_fit_are_refused(make_model, change, sentence):
    path, scenario = model(make_model, 7)
    run = recorded(path, scenario, 7)
    channels = tuple(replace(c, **change) if c.name == "cmd_hinge1" else c for c in run.channels)
    with pytest.raises(InputRefused, match=sentence):
        diagnosis.compare_windows(simulate.Replayer(path), replace(run, channels=channels))


def test_recordings_that_show_no_state_are_refused(make_model):
    path, scenario = model(make_model, 7)
    run = recorded(path, scenario, 7, [c for c in sensors() if c.quantity == "joint.effort"])
    with pytest.raises(InputRefused, match="show a state"):
        diagnosis.compare_windows(simulate.Replayer(path), run)
    with pytest.raises(InputRefused, match="position of every joint"):
        diagnosis.compare_inverse(simulate.Replayer(path), run)
    with pytest.raises(InputRefused, match="at least four steps"):
        diagnosis.compare_windows(simulate.Replayer(path), recorded(path, scenario, 7), window=1e-3)


def test_a_violent_window_is_found_by_continuation(make_model):
    """Three times the torque: the lower rod spins, and the smoothed starts are worse than they say; still only noise is left."""
    path, scenario = model(make_model, 1)
    wild = replace(scenario, commands=tuple(replace(c, value=3 * c.value) for c in scenario.commands))
    rover = replace(
        chain([0.2, 0.3], [0.6, 0.5]),
        drives=tuple(Drive(name=f"hinge{k}", joint=f"hinge{k}", mode="torque", max_torque=10.0) for k in (1, 2)),
    )
    path = make_model(rover, wild)
    comparison = diagnosis.compare_windows(simulate.Replayer(path), recorded(path, wild, 1), window=0.3)
    total, count = chi2(comparison.channels)
    fastest = max(np.abs(c.measured).max() for c in comparison.channels if c.channel.name == "rate2")
    assert fastest > 50
    assert total / count == pytest.approx(0.995, abs=0.06)


def test_a_recording_may_begin_in_the_middle_of_a_swing_with_one_joint_late(make_model):
    """Cut off at 3.5 s, the upper joint 60 ms later: begun where the model rests, chi-squared would be 11 000 per sample."""
    path, scenario = model(make_model, 1)
    run = recorded(path, scenario, 1)
    early, late = (cut_in_time(run, start, np.inf) for start in (3.5, 3.56))
    channels = tuple((late if c.target == "hinge1" else early).channel(c.name) for c in run.channels)
    comparison = diagnosis.compare_windows(simulate.Replayer(path), replace(run, channels=channels))
    total, count = chi2(comparison.channels)
    assert total / count == pytest.approx(0.997, abs=0.06)
    assert not any("not recorded" in note for note in comparison.notes)


def test_one_sensor_has_one_noise_over_recordings():
    """The median over recordings: one in which the sensor stands still says nothing of its noise."""
    rng = np.random.default_rng(1)
    time = np.arange(0, 10, 0.01)
    values = [np.sin(time) + rng.normal(0, 1e-3, len(time)) for _ in range(4)] + [np.full(len(time), 0.3)]
    runs = [
        Recording(
            name=str(k), channels=(Channel(name="a", quantity="joint.position", target="hinge1", unit="rad", time=time, value=value),)
        )
        for k, value in enumerate(values)
    ]
    assert diagnosis.shared_noise(runs)["a"][0] == pytest.approx(1e-3, rel=0.1)


def test_what_is_hidden_goes_on_between_windows_while_starts_are_fitted(make_model):
    """A sloshing payload that the model knows: a window that is fitted once more begins with what sloshed in the one before.

    Begun with a payload at rest, those windows keep a misfit of 3 to 6 times the noise, and chi-squared is 1.7 per sample. Its scatter as
    of ``test_residuals_are_white_at_the_noise``.
    """
    slosh = Effect(kind="payload_slosh", target="link2", parameters={"mass": 0.02, "natural_frequency": 9.0, "damping_ratio": 0.3})
    path, scenario = model(make_model, 1, effects=[slosh])
    comparison = diagnosis.compare_windows(simulate.Replayer(path), recorded(path, scenario, 1))
    total, count = chi2(comparison.channels)
    assert total / count == pytest.approx(0.997, abs=0.04)
