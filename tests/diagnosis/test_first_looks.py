"""What is looked at first is looked at cheaply: few windows, larger steps, a run-in where there is memory; no answer hangs on that."""

from dataclasses import replace

import numpy as np
import pytest

from effect_rigs import EARTH
from machines import cart, plane
from recorded import commanded as driven
from recorded import record
from rille import simulate
from rille.diagnosis.evidence import evidence_part
from rille.diagnosis.evidence.evidence import Metric
from rille.diagnosis.evidence.held_out import cut_in_time
from rille.diagnosis.evidence.replay_evidence import gather
from rille.diagnosis.inference.fit import fit_together
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.screen import screen
from rille.model import Command, Effect, Scenario
from rille.model.hypothesis import FreeNumber, Hypothesis
from rille.model.recording import Channel
from swung import model, recorded
from toy_evidence import catalogue, effect, named, number
from toy_evidence import recorded as toy


def remembered(kind, target, target_kind, name, spread):
    """A law with a memory and one number."""
    free = (FreeNumber(name=name, unit="1", amplitude=True, lower=0.0, upper=10.0, start=spread, spread=spread),)
    return Hypothesis(cause="effect", kind=kind, target=target, target_kind=target_kind, free=free, memory=True)


def test_what_fades_needs_a_run_in_only(make_model, monkeypatch):
    """A lag of 20 ms in two late windows: with the window before each as if all had been run (0.5 s fade by e^-25); four replays."""
    path, scenario = model(make_model, 4)
    evidence = gather({"swing": simulate.Replayer(path)}, [cut_in_time(recorded(path, scenario, 4), 0, 5)])
    monkeypatch.setattr(evidence_part, "RUN_IN", 0.4)
    setting = (remembered("motor_lag", "hinge1", "joint", "time_constant", 0.02).at({"time_constant": 0.02}),)
    windows, run = np.array([4, 8]), []
    predict = simulate.Replayer.predict_many

    def counted(self, others, states, *rest, **more):
        run.append(len(states))
        return predict(self, others, states, *rest, **more)

    whole = evidence.residuals([setting])[0][np.isin(evidence.window, windows)]
    part = evidence.subset(windows)
    monkeypatch.setattr(simulate.Replayer, "predict_many", counted)
    assert part.residuals([setting])[0] == pytest.approx(whole, abs=1e-6)
    assert sum(run) == 4
    base = part.residuals([()])[0]
    assert np.abs(whole - base).max() > 1.0


def soft_drive(make_model):
    """A cart on soil and its recording of four seconds."""
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=4.0) for d in rover.drives)
    ground = {"terrain": "plane", "placement": "on_terrain", "settle_time": 2}
    scenario = Scenario(name="s", duration=4.0, step=2e-3, gravity=(0, 0, -EARTH), commands=commands, **ground)
    path = make_model(rover, scenario, plane())
    wheels = [j.name for j in rover.joints]
    shown = [Channel(name=f"{j}_angle", quantity="joint.position", target=j, unit="rad", noise=1e-3) for j in wheels]
    shown += [
        Channel(name=f"chassis_{k}", quantity="part.position", target=rover.bodies[0].name, component=k, unit="m", noise=1e-3)
        for k in "xyz"
    ]
    return path, driven(record(path, shown, duration=4.0, rate=50.0, seed=1), scenario, "joint.velocity")


def test_what_stays_in_the_ground_is_run_from_the_beginning(make_model, monkeypatch):
    """The rut of the front wheels, in which the rear ones roll later: the same within rounding."""
    path, run = soft_drive(make_model)
    evidence = gather(lambda s: simulate.Replayer(path, s or None), [run], window=0.5)
    setting = (remembered("multipass", "*", "wheel", "memory", 0.5).at({"memory": 0.5}),)
    monkeypatch.setattr(evidence_part, "RUN_IN", 0.1)
    windows = np.array([3, 6])
    whole = evidence.residuals([setting])[0][np.isin(evidence.window, windows)]
    assert evidence.subset(windows).residuals([setting])[0] == pytest.approx(whole, abs=1e-9)
    assert np.abs(whole - evidence.subset(windows).residuals([()])[0]).max() > 1.0


def test_larger_steps_say_the_same_of_changes(make_model):
    """Derivatives of the starts with steps twice as large: the whitened residuals of the base and what friction changes come out within
    2 %, those of a first look too. What steps eight times as large do to the base is taken off to the last bit.
    """
    path, scenario = model(make_model, 3, [Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.005})])
    base, _ = model(make_model, 3)
    run = cut_in_time(recorded(path, scenario, 3), 0, 2.8)
    friction = named("coulomb", "left").hypothesis
    friction = replace(friction, kind="coulomb_friction", target="hinge2", target_kind="joint", free=(number("torque", spread=0.003),))
    found = []
    for rough in (None, 2e-3):
        evidence = gather({"swing": simulate.Replayer(base)}, [run], rough=rough)
        few = evidence.subset(np.array([1, 3]), roughly=True)
        assert (few.parts[0].simulator.step > evidence.parts[0].simulator.step) == (rough is not None)
        for one in (evidence, few):
            left = Metric(one.window, one.start_gain).whitened(one.residuals([(), (friction.at({"torque": 0.004}),)]))
            found.append((left[0] @ left[0], np.linalg.norm(left[1] - left[0])))
    (part,) = evidence.parts
    coarse = replace(part, rough=part.simulator.changed(step=8e-3)).roughly()
    own = part.residuals([()])[0]
    assert coarse.residuals([()])[0] == pytest.approx(own, abs=1e-9)
    assert np.abs(replace(coarse, error=part.error).residuals([()])[0] - own).max() > 1.0
    assert found[2] == pytest.approx(found[0], rel=0.02)
    assert found[3] == pytest.approx(found[1], rel=0.02)


def test_a_fault_that_is_there_or_not_is_not_there_a_little():
    """A scale of 2 % is explained by that, and not by 1 % of a turned sign."""
    evidence = toy((next(h for h in catalogue() if h.title == "scale of left speed").at({"relative_error": 0.02}),), seconds=10)
    turned = Hypothesis(
        cause="sensor",
        kind="scale",
        target="left speed",
        target_kind="channel",
        free=(number("relative_error", lower=0.9, upper=1.0, start=1.0, spread=1.0),),
    )
    (signature,) = screen(evidence, [turned]).signatures
    assert signature.drop == 0
    assert not signature.direction.any()


def test_fits_that_cannot_lead_end_early():
    """A rival of three numbers ends with what it can be seen to be behind by; the best is fitted as it would be alone."""
    evidence = toy((named("coulomb", "left", force=0.4),), seconds=10)
    judge = Judge(evidence)
    right = [(named("coulomb", "left", force=0.2),)]
    wrong = [(effect("stribeck", "right", *named("stribeck", "right").hypothesis.free).at({"coulomb": 0.1, "excess": 0.1}),)]
    (alone,) = fit_together(judge, [right])
    (slow,) = fit_together(judge, [wrong])
    best, early = fit_together(judge, [right, wrong])
    assert best.setting[0].values == alone.setting[0].values
    assert early.replays < slow.replays
    assert (early.chi2 - best.chi2) == pytest.approx(slow.chi2 - alone.chi2, rel=0.2)
