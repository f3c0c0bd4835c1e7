"""Finite steps: their error is found by one finer run, and faults of time stamps are read from trajectories that are kept."""

from dataclasses import replace

import numpy as np
import pytest

from machines import chain
from recorded import record
from rille import simulate
from rille.diagnosis.comparison import compare
from rille.diagnosis.comparison.compare import compare_windows
from rille.diagnosis.evidence import evidence_part
from rille.diagnosis.evidence.evidence_part import gather_part
from rille.diagnosis.evidence.replay_evidence import ReplayEvidence
from rille.diagnosis.hypotheses.sensor_faults import true_instants
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.starts.noise_floor import shared_noise
from rille.diagnosis.starts.start_fit import Samples
from rille.diagnosis.starts.step_error import step_error
from rille.diagnosis.starts.windows import cut
from rille.model import Command, Drive, Scenario
from rille.model.hypothesis import FreeNumber, Hypothesis
from rille.model.recording import Channel, Recording
from swung import model, recorded

WINDOW = 0.5  # [s]


def servo(make_model):
    """A rod behind a speed drive of finite gain, whose set speed changes every 0.1 s: the semi-implicit steps lead by half a step."""
    rover = replace(chain([0.2], [0.6]), drives=(Drive(name="hinge1", joint="hinge1", mode="speed", max_torque=20.0, speed_gain=0.2),))
    commands = tuple(Command(drive="hinge1", time=0.1 * k, value=float(1.5 * np.sin(0.7 * k))) for k in range(40))
    scenario = Scenario(name="s", duration=4.0, step=4e-3, commands=commands)
    path = make_model(rover, scenario, None, ())
    angle = Channel(name="angle", quantity="joint.position", target="hinge1", unit="rad", noise=1e-4)
    run = record(path, [angle], duration=4.0, rate=200, seed=1)
    time, value = (np.array([getattr(c, word) for c in commands]) for word in ("time", "value"))
    log = Channel(name="set", quantity="joint.velocity", target="hinge1", unit="rad/s", role="command", time=time, value=value)
    return path, replace(run, channels=(*run.channels, log))


def test_what_a_step_does_is_taken_off(make_model):
    """Against a run with 1/16 of the step: corrected by a run with half of it the error is of second order, a tenth or less here."""
    path, run = servo(make_model)
    coarse = simulate.Replayer(path)
    part = gather_part(coarse, run, window=WINDOW, noise=shared_noise([run]))
    samples, states, stops = part.samples, part.states, part.last
    picks = [(s.window, s.time) for s in samples]
    channels = [s.channel for s in samples]
    rough, fine = (part.simulator.changed(step=h).predict(states[None], stops, channels, picks)[0][0] for h in (4e-3, 4e-3 / 16))
    (error,), _ = step_error(part.simulator, states, stops, samples)
    before, after = np.sqrt(np.mean((rough - fine) ** 2)), np.sqrt(np.mean((rough - error - fine) ** 2))
    assert before > 3e-4
    assert after < 0.12 * before
    assert np.array_equal(part.error[0], error)


def test_a_comparison_may_take_finer_steps_than_the_scenario(make_model):
    """At a little less than half, half, and a little more than half of the scenario's step, what is left is the same within 0.3 noise: what
    the recording's own step of 4 ms does, 2.7 noise.
    """
    path, run = servo(make_model)
    found = []
    for share in (1.0, 0.45, 0.5, 0.6):
        compared = compare_windows(simulate.Replayer(path).changed(step=share * 4e-3), run, window=WINDOW)
        angle = next(c for c in compared.channels if c.channel.name == "angle")
        found.append(np.sqrt(np.mean(angle.residual**2)) / angle.noise)
    assert found == pytest.approx([found[0]] * 4, abs=0.3)


def test_a_delay_that_is_read_is_a_delay_that_is_replayed(make_model):
    """Two descriptions of a late torque sensor, which shows no state: trajectories read at other instants, and runs asked for these."""
    path, scenario = model(make_model, 4)
    run = recorded(path, scenario, 4)
    part = gather_part(simulate.Replayer(path), run, window=WINDOW, noise=shared_noise([run]))
    number = FreeNumber(name="delay", unit="s", amplitude=True, lower=0.0, upper=1.0, start=0.01, spread=0.01)
    late = Hypothesis(cause="sensor", kind="delay", target="torque1", target_kind="channel", free=(number,))
    setting = (late.at({"delay": 0.013}),)
    plan = part._plan(setting)
    assert plan.reread
    picks = [(s.window, true_instants(setting, s.channel, s.time)) for s in part.samples]
    asked = part.simulator.predict(part.states[None], part.last, [s.channel for s in part.samples], picks)
    for read, run_again in zip(part._reread(part.simulator, plan, part._course(part.simulator)), asked, strict=True):
        assert read == pytest.approx(run_again[0], abs=1e-9)
    assert np.abs(part.residuals([setting])[0] - part.residuals([()])[0]).max() > 1.0


def test_what_a_far_off_clock_stamps_is_simulated_from_when_it_was_true(make_model):
    """Stamps of a torque sensor 12 % fast: at 4 s what it says is 0.43 s old, of almost a window before. Under the right skew as much is
    left of each sample as of the recording with right stamps, within 5 %: the same noise, of which some samples fall into a gap.
    """
    path, scenario = model(make_model, 4)
    right = recorded(path, scenario, 4)
    fast = tuple(replace(c, time=(c.time - c.delay) * 1.12 + c.delay, clock="other") if c.name == "torque1" else c for c in right.channels)
    number = FreeNumber(name="skew", unit="1", amplitude=True, lower=-0.5, upper=0.5, start=0.01, spread=0.01)
    skewed = Hypothesis(cause="sensor", kind="clock_skew", target="torque1", target_kind="channel", free=(number,))
    left = []
    for run, setting in ((right, ()), (replace(right, channels=fast), (skewed.at({"skew": 0.12}),))):
        part = gather_part(simulate.Replayer(path), run, window=WINDOW, noise=shared_noise([run]), assumed=setting)
        judge = Judge(ReplayEvidence([part], window=WINDOW), setting)
        place = [c.name for c in judge.evidence.channels].index("torque1")
        left.append(judge.per_channel(judge.base**2)[place] / np.sum(judge.evidence.channel == place))
    assert left[1] == pytest.approx(left[0], rel=0.05)


def test_windows_in_which_a_body_points_straight_up_are_left_out():
    """Pitch passes 1.2 rad between 2 and 3 s; where it always does, all windows stay."""
    time = np.arange(0, 6, 0.02)
    pitch = np.where((time > 2.1) & (time < 2.9), 1.4, 0.3)
    channels = [
        Channel(name=c, quantity="part.orientation", target="body", component=c, unit="rad", time=time, value=v)
        for c, v in (("roll", 0 * time), ("pitch", pitch), ("yaw", 0 * time))
    ]
    recording = Recording(name="r", channels=tuple(channels))
    parts = cut(recording, channels, 1.0, 1e-3)
    assert parts.starts == pytest.approx([0.0, 1.0, 3.0, 4.0, 5.0])
    steep = [replace(c, value=np.full(len(time), 1.4)) if c.component == "pitch" else c for c in channels]
    assert len(cut(recording, steep, 1.0, 1e-3).starts) == 6


def test_the_first_window_begins_where_all_channels_have_begun():
    """One joint is recorded later than the other, by less than a window; another that comes after two seconds is not waited for. Behind a
    gap, which simulation bridges, a quarter of a window is waited.
    """
    time = np.arange(0.5, 5, 0.01)

    def begins(*firsts, gap=(9.0, 9.0)):
        channels = []
        for k, first in enumerate(firsts):
            own = time[(time > first) & ((time < gap[0]) | (time > gap[1] + 0.5 * k))]
            channels.append(Channel(name=f"q{k}", quantity="joint.position", target=f"q{k}", unit="rad", time=own, value=own))
        return cut(Recording(name="r", channels=tuple(channels)), channels, 1.0, 4e-3).begins

    assert begins(0.0, 0.0)[0] == pytest.approx(0.5)
    assert begins(0.0, 0.544)[0] == pytest.approx(0.552)  # the next multiple of the step after 0.55 s
    assert begins(0.0, 1.404)[0] == pytest.approx(1.412)  # after 1.41 s
    assert begins(0.0, 2.5)[0] == pytest.approx(0.5)
    behind = begins(0.0, 0.0, gap=(2.5, 3.2))
    assert behind[behind > 2.5][0] == pytest.approx(3.2, abs=0.013)  # the second joint goes on at 3.7 s


class Slipping:
    """Something that lets go after half a second if steps are coarse, and never if they are fine."""

    own_step = 2e-3

    def __init__(self, step):
        self.step = step

    def changed(self, step):
        return Slipping(step)

    def predict(self, states, stops, channels, picks):
        return [(np.sin(time) + (time > 0.5) * (self.step > 1.5e-3))[None] for _, time in picks]


def test_where_steps_disagree_by_a_jump_nothing_is_corrected():
    """A jump of 1 against a noise of 0.01: no extrapolation in the step means anything there."""
    time = np.linspace(0, 1, 21)
    channel = Channel(name="angle", quantity="joint.position", target="wheel", unit="rad")
    samples = [Samples(channel=channel, window=np.zeros(21, dtype=int), time=time, value=np.sin(time), noise=0.01)]
    (error,), (out,) = step_error(Slipping(4e-3), np.zeros((1, 3)), np.ones(1), samples)
    assert np.array_equal(out, time > 0.5)
    assert not error.any()


class Parting(Slipping):
    """Of three channels the second leaps for a while and comes back, the third lets go for good if steps are coarse."""

    def changed(self, step):
        return Parting(step)

    def predict(self, states, stops, channels, picks):
        coarse = self.step > 1.5e-3
        leaps = (lambda t: 0 * t, lambda t: (t > 0.2) & (t < 0.3), lambda t: t > 0.7)
        return [(np.sin(time) + coarse * leap(time))[None] for leap, (_, time) in zip(leaps, picks, strict=True)]


def test_where_runs_part_no_channel_is_told_from_there_on():
    """A leap of 0.1 s is of its own channel alone; what stays apart up to the end of its window takes all others along, there only."""
    time, window = np.linspace(0, 0.99, 100), np.zeros(100, dtype=int)
    channel = Channel(name="angle", quantity="joint.position", target="wheel", unit="rad")
    both = np.r_[time, 1 + time / 10], np.r_[window, window + 1]
    samples = [Samples(channel=channel, window=both[1], time=both[0], value=np.sin(both[0]), noise=0.01) for _ in range(3)]
    samples[2] = samples[2].where(samples[2].window == 0)
    _, (first, second, third) = step_error(Parting(4e-3), np.zeros((2, 3)), np.array([1.0, 1.1]), samples)
    parted = (both[0] > 0.7) & (both[1] == 0)
    assert np.array_equal(first, parted)
    assert np.array_equal(second, parted | ((both[0] > 0.2) & (both[0] < 0.3)))
    assert np.array_equal(third, parted[:100])


def jumping_from(begin):
    """``step_error`` that calls everything later a jump."""

    def errors(model, states, stops, samples):
        return step_error(model, states, stops, samples)[0], tuple(s.time > begin for s in samples)

    return errors


def test_samples_after_a_jump_are_not_compared(make_model, monkeypatch):
    path, run = servo(make_model)
    monkeypatch.setattr(compare, "step_error", jumping_from(3.3))
    comparison = compare_windows(simulate.Replayer(path), run, window=WINDOW)
    (angle,) = comparison.channels
    assert 3.28 < angle.time.max() <= 3.3
    missing = np.count_nonzero(run.channel("angle").time > 3.3)
    assert any(note.startswith(f"{missing} samples are left out") for note in comparison.notes)


def test_samples_after_a_jump_are_no_evidence(make_model, monkeypatch):
    path, run = servo(make_model)
    whole = gather_part(simulate.Replayer(path), run, window=WINDOW, noise=shared_noise([run]))
    monkeypatch.setattr(evidence_part, "step_error", jumping_from(3.3))
    part = gather_part(simulate.Replayer(path), run, window=WINDOW, noise=shared_noise([run]))
    assert part.samples[0].time.max() <= 3.3 < whole.samples[0].time.max()
    (before,), (after,) = whole.residuals([()]), part.residuals([()])
    assert len(after) == len(part.samples[0].time) == np.count_nonzero(whole.samples[0].time <= 3.3)
    early = np.count_nonzero(whole.samples[0].time < 3.0)  # windows that keep all of theirs
    assert np.allclose(after[:early], before[:early], atol=1e-6)
    monkeypatch.setattr(evidence_part, "step_error", jumping_from(2.2))
    again = part.relinearised(())  # whatever jumps under another setting: the evidence stays the same
    assert np.array_equal(again.samples[0].time, part.samples[0].time)
