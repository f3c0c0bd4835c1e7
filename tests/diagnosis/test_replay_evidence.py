"""Evidence of recordings made in simulation: nulls are noise, the planted cause explains the excess, and its size comes out."""

from dataclasses import replace

import numpy as np
import pytest

from rille import simulate, store
from rille.diagnosis.answer.prove import prove
from rille.diagnosis.evidence import evidence_part
from rille.diagnosis.evidence.evidence import Metric
from rille.diagnosis.evidence.held_out import Parts, cut_in_time
from rille.diagnosis.evidence.replay_evidence import gather
from rille.diagnosis.evidence.window_and_step import window_and_step, window_and_step_of_all
from rille.diagnosis.evidence.window_length import window_length
from rille.diagnosis.hypotheses.sensor_hypotheses import sensor_hypotheses
from rille.diagnosis.inference.search import search
from rille.diagnosis.starts.noise_floor import shared_noise
from rille.model import Effect
from rille.model.hypothesis import FreeNumber, Hypothesis
from swung import model, recorded


def hypothesis(cause, kind, target, target_kind, name, trial, moves=()):
    """One with a single amplitude."""
    free = FreeNumber(name=name, unit="", amplitude=True, lower=-1e9, upper=1e9, start=trial, spread=trial)
    return Hypothesis(cause=cause, kind=kind, target=target, target_kind=target_kind, free=(free,), moves=moves)


def effect(kind, target, name, trial, target_kind="joint"):
    return hypothesis("effect", kind, target, target_kind, name, trial)


def fault(kind, target, name, trial):
    return hypothesis("sensor", kind, target, "channel", name, trial)


RIVALS = [
    *(effect("coulomb_friction", f"hinge{k}", "torque", 0.003) for k in (1, 2)),
    *(effect("viscous_friction", f"hinge{k}", "coefficient", 0.001) for k in (1, 2)),
    *(effect("mass_change", f"link{k}", "mass", 0.01, "body") for k in (1, 2)),
    *(fault("bias", f"{word}{k}", "offset", size) for word, size in (("angle", 2e-3), ("rate", 0.02), ("torque", 0.01)) for k in (1, 2)),
    *(fault("scale", f"{word}{k}", "relative_error", 0.01) for word in ("angle", "rate", "torque") for k in (1, 2)),
    *(fault("delay", f"{word}{k}", "delay", 0.003) for word in ("angle", "rate", "torque") for k in (1, 2)),
]


def screened(evidence, hypotheses):
    """Linear amplitudes, gains of chi-squared, and chi-squared and degrees of the base model."""
    rows = evidence.residuals([(), *((h.at({h.free[0].name: h.free[0].start}),) for h in hypotheses)])
    metric = Metric(evidence.window, evidence.start_gain)
    left = metric.whitened(rows)
    signatures = -(left[1:] - left[0]) / np.array([h.free[0].start for h in hypotheses])[:, None]
    product, size = signatures @ left[0], (signatures**2).sum(axis=1)
    return product / size, product**2 / size, left[0] @ left[0], metric.degrees.sum()


def explained(evidence, setting):
    """Chi-squared per degree under a setting."""
    metric = Metric(evidence.window, evidence.start_gain)
    left = metric.whitened(evidence.residuals([setting]))[0]
    return left @ left / metric.degrees.sum()


@pytest.mark.parametrize("seed", [2])
def test_a_null_is_noise_and_nothing_explains_it(make_model, seed):
    """20 000 samples: chi-squared per degree scatters by 1 % and the smoother has seen the samples too; no gain of one number above 4.5
    sigma (24 hypotheses).
    """
    path, scenario = model(make_model, seed)
    evidence = gather({"swing": simulate.Replayer(path)}, [recorded(path, scenario, seed)])
    _, gains, chi2, degrees = screened(evidence, RIVALS)
    assert chi2 / degrees == pytest.approx(0.99, abs=0.03)
    assert gains.max() < 20


def test_the_effect_that_was_planted_explains_the_excess(make_model):
    """Dry friction of 5 mN m in hinge 2: its linear gain is nearly the excess, its size is right, and with it only noise is left."""
    path, scenario = model(make_model, 3, [Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.005})])
    base, _ = model(make_model, 3)
    evidence = gather({"swing": simulate.Replayer(base)}, [cut_in_time(recorded(path, scenario, 3), 0, 2.8)])
    sizes, gains, chi2, degrees = screened(evidence, RIVALS)
    best = int(np.argmax(gains))
    assert RIVALS[best].title == "coulomb_friction of hinge2"
    assert gains[best] == pytest.approx(chi2 - degrees, rel=0.1)
    assert sizes[best] == pytest.approx(0.005, rel=0.1)
    setting = (RIVALS[best].at({"torque": 0.005}),)
    again = evidence.relinearised(setting)
    assert explained(again, setting) == pytest.approx(0.99, abs=0.05)
    assert np.array_equal(again.time, evidence.time)
    assert np.array_equal(again.sigma, evidence.sigma)


@pytest.mark.parametrize(
    ("channel", "change", "title", "size"),
    [
        ("angle2", lambda c: {"value": c.value + 0.01}, "bias of angle2", 0.01),
        ("rate1", lambda c: {"value": 1.03 * c.value}, "scale of rate1", 0.03),
        ("rate1", lambda c: {"time": c.time + 0.006, "clock": "own"}, "delay of rate1", 0.006),
        ("torque2", lambda c: {"value": c.value - 0.02}, "bias of torque2", -0.02),
    ],
)
def test_a_sensor_that_lies_is_told_from_physics(make_model, channel, change, title, size):
    """The right fault of the right channel gains most, its linear size is right within 10 %, and noise is left (6 000 samples: 2 %)."""
    path, scenario = model(make_model, 1)
    run = cut_in_time(recorded(path, scenario, 1), 0, 2.8)
    run = replace(run, channels=tuple(replace(c, **change(c)) if c.name == channel else c for c in run.channels))
    evidence = gather({"swing": simulate.Replayer(path)}, [run])
    sizes, gains, _, _ = screened(evidence, RIVALS)
    best = int(np.argmax(gains))
    assert RIVALS[best].title == title
    assert sizes[best] == pytest.approx(size, rel=0.1)
    setting = (RIVALS[best].at({RIVALS[best].free[0].name: size}),)
    assert explained(evidence.relinearised(setting), setting) == pytest.approx(0.99, abs=0.05)


def test_a_sensor_that_is_turned_round_is_named_though_nothing_fits(make_model):
    """With the sign of one angle wrong, all starts are wrong, and no derivative that was taken there means anything: only under starts of
    its own the fault is seen to explain all. Its rivals are other faults of the same two angles and friction.
    """
    path, scenario = model(make_model, 2)
    run = cut_in_time(recorded(path, scenario, 2), 0, 2.8)
    turned = replace(run, channels=tuple(replace(c, value=-c.value) if c.name == "angle2" else c for c in run.channels))
    kinds = store.effect_kinds()
    faults = [
        h
        for h in sensor_hypotheses(turned.channels, kinds)
        if h.target in ("angle1", "angle2") and h.kind in ("wrong_sign", "scale", "bias")
    ]
    found = search(gather({"swing": simulate.Replayer(path)}, [turned]), [*faults, *RIVALS[:4]])
    assert [t.term.hypothesis.title for t in found.terms] == ["wrong_sign of angle2"]
    assert found.verdict == "sensor_fault"
    assert found.leftover < 0.01


def test_windows_and_recordings_are_independent(make_model):
    """Residuals of a subset are those of the whole there; two recordings stand one behind the other."""
    path, scenario = model(make_model, 4)
    runs = [cut_in_time(replace(recorded(path, scenario, seed), name=name), 0, 2.8) for seed, name in ((4, "a"), (5, "b"))]
    evidence = gather({"swing": simulate.Replayer(path)}, runs)
    windows = np.array([1, 3, 4, 6, 8])
    part = evidence.subset(windows)
    setting = (RIVALS[1].at({"torque": 0.002}),)
    here = np.isin(evidence.window, windows)
    assert np.allclose(part.residuals([setting])[0], evidence.residuals([setting])[0][here], atol=1e-9)
    assert np.array_equal(part.start_gain, evidence.start_gain[here])
    assert np.array_equal(part.run, evidence.run[windows])
    assert evidence.recordings == ("a", "b")


def test_starts_may_begin_with_the_derivatives_of_another_setting(make_model, monkeypatch):
    """Fitted under friction, with derivatives that began as those of the base model and with fresh ones: chi-squared the same within what a
    fit leaves (0.1 a window), starts within a tenth of their uncertainty; and fewer replays.
    """
    path, scenario = model(make_model, 3, [Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.005})])
    base, _ = model(make_model, 3)
    evidence = gather({"swing": simulate.Replayer(base)}, [cut_in_time(recorded(path, scenario, 3), 0, 2.8)])
    setting = (RIVALS[1].at({"torque": 0.005}),)
    runs = []
    predict = simulate.Replayer.predict

    def counted(self, states, *rest):
        runs.append(states.shape[0] * states.shape[1])
        return predict(self, states, *rest)

    monkeypatch.setattr(simulate.Replayer, "predict", counted)
    begun = evidence.relinearised(setting)
    few = sum(runs)
    monkeypatch.setattr(evidence_part, "_known", lambda *_: None)
    fresh = evidence.relinearised(setting)
    chi2 = []
    for one in (begun, fresh):
        left = Metric(one.window, one.start_gain).whitened(one.residuals([setting]))[0]
        chi2.append(left @ left)
    assert chi2[0] == pytest.approx(chi2[1], abs=0.1 * len(begun.starts))
    assert np.abs(begun.parts[0].standard - fresh.parts[0].standard).max() < 0.1
    assert few < 0.9 * (sum(runs) - few)


def test_a_setting_that_the_model_refuses_has_no_residuals(make_model):
    """A body with less than no mass."""
    path, scenario = model(make_model, 4)
    evidence = gather({"swing": simulate.Replayer(path)}, [cut_in_time(recorded(path, scenario, 4), 0, 2.8)])
    impossible = hypothesis("parameter", "mass", "link1", "body", "mass", 0.1, moves=(("mass", "body.link1.mass", 1.0),))
    rows = evidence.residuals([(impossible.at({"mass": -5.0}),), ()])
    assert np.isnan(rows[0]).all()
    assert np.isfinite(rows[1]).all()


def test_the_proof_closes_the_gap_with_the_truth_and_not_with_something_else(make_model):
    """Friction of 10 mN m; the last third is held out."""
    path, scenario = model(make_model, 3, [Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.01})])
    base, _ = model(make_model, 3)
    run = recorded(path, scenario, 3)
    parts = Parts(training=(cut_in_time(run, 0, 5.2),), held_out=(cut_in_time(run, 5.2, 9),), how="the end")
    given = {"noise": shared_noise([run]), "window": 0.5}
    simulators = {"swing": simulate.Replayer(base)}
    proof, improved = prove(simulators, parts, (RIVALS[1].at({"torque": 0.01}),), **given)
    assert proof.gap_closed > 0.95
    assert proof.low > 0.8
    assert all(row.held_out and row.rms_after < row.rms_before for row in proof.channels if row.channel.startswith("angle"))
    assert len(improved) == 1
    wrong, _ = prove(simulators, parts, (RIVALS[5].at({"mass": 0.01}), RIVALS[1].at({"torque": 0.01})), **given)
    assert wrong.gap_closed < proof.gap_closed
    assert dict(wrong.ablation)["mass_change of link2"] > wrong.gap_closed


def test_the_step_is_as_large_as_the_noise_allows(make_model):
    """Coarse sensors bear a larger step than fine ones; never one that changes what they would have shown, nor one that is longer than half
    of what lies between two samples.
    """
    path, scenario = model(make_model, 1)
    run = cut_in_time(recorded(path, scenario, 1), 0, 2.8)
    noisy = replace(run, channels=tuple(replace(c, noise=100 * c.noise) if c.noise else c for c in run.channels))
    thin = replace(noisy, channels=tuple(replace(c, time=c.time[::8], value=c.value[::8]) if c.noise else c for c in noisy.channels))
    known = {"window": 0.5, "duration": 2.8}
    steps = [window_and_step(simulate.Replayer(path), r, noise=shared_noise([r]), **known)[1] for r in (run, noisy, thin)]
    assert steps[0] == steps[1] == 1e-3  # 450 Hz
    assert 1e-3 < steps[2] <= 0.5 * 8 / 450
    of_all = window_and_step_of_all({"swing": simulate.Replayer(path)}, [thin, run], noise=shared_noise([thin, run]), window=0.5)
    assert of_all[:2] == (0.5, steps[0])


def test_windows_shorter_than_the_grid_of_steps_are_tried_too(make_model):
    """A model with steps of 10 ms and samples at 20 Hz: 24 steps are 0.24 s, and most windows that are tried are shorter than four times
    that.
    """
    path, scenario = model(make_model, 1)
    run = cut_in_time(recorded(path, scenario, 1), 0, 6)
    thin = tuple(replace(c, time=c.time[::22], value=c.value[::22]) if c.role == "observed" else c for c in run.channels)
    run = replace(run, channels=thin)
    simulator = simulate.Replayer(path).changed(step=1e-2)
    window, step, rough = window_and_step(simulator, run, noise=shared_noise([run]), duration=6.0)
    assert (window >= 0.96) or (step, rough) == (1e-2, None)


def test_windows_are_as_short_as_the_most_violent_recording_asks_for(make_model):
    """Twice the torques: with its own model windows of 1 s are fitted, whatever starts they need. Where gravity leans by 0.8 degrees and
    the model does not know it, no start fits, and derivatives at the one that was found say nothing of the smoothed one: windows are
    shorter, in whichever order the recordings come.
    """
    base, scenario = model(make_model, 2)
    wild = replace(scenario, commands=tuple(replace(c, value=2 * c.value) for c in scenario.commands))
    rover = store.read_rover(base)
    leans = (Effect(kind="gravity_tilt", parameters={"roll": 0.01, "pitch": 0.01}),)
    path = make_model(rover, wild)
    simulator = simulate.Replayer(path)
    own, leaning = (recorded(make_model(rover, wild, None, effects), wild, 2) for effects in ((), leans))
    noise = shared_noise([own, leaning])
    assert window_length(simulator, own, duration=8.0, noise=noise)[0] == 1.0
    assert window_length(simulator, leaning, duration=8.0, noise=noise)[0] <= 0.7
    lengths = [window_and_step_of_all(lambda scenario: simulator, runs, noise=noise)[0] for runs in ((own, leaning), (leaning, own))]
    assert lengths[0] == lengths[1] <= 0.7
