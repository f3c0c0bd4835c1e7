"""Short pushes at the joints of a pendulum whose model lacks friction: found, told from the model's errors, none where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from recorded import commanded, record
from rille import simulate, store
from rille.diagnosis.pushes.effort_uncertainty import NUMBERS, covariance, points_of, usual_of
from rille.diagnosis.pushes.pushes import calibrate_pushes, find_pushes
from rille.diagnosis.pushes.residual_effort import residual_effort
from rille.model import Effect, InputRefused
from swung import model, sensors

PLANTED = {  # recording -> joint, peak time [s], length [s], torque [N m]
    "pushed/1": [("hinge1", 1.6, 0.2, 0.5), ("hinge2", 4.2, 0.2, -0.25)],
    "pushed/2": [("hinge2", 2.2, 0.15, 0.25), ("hinge1", 3.9, 0.3, -0.5)],
}
DURATION = 5.0  # [s]
MISSING = (
    Effect(kind="coulomb_friction", target="hinge1", parameters={"torque": 0.03}),
    Effect(kind="viscous_friction", target="hinge2", parameters={"coefficient": 0.004}),
)
WITHOUT_TORQUES = [c for c in sensors() if c.quantity != "joint.effort"]


def run_of(make_model, name, seed, effects):
    """A recording of the true machine; base model and recording share commands."""
    path, scenario = model(make_model, seed, effects, DURATION)
    run = record(path, WITHOUT_TORQUES, duration=DURATION, rate=450, seed=seed, jitter=3e-4, gaps=[(2.9, 3.3)])
    return replace(commanded(run, scenario), name=name)


def pulses(rows):
    return tuple(
        Effect(kind="joint_pulse", target=joint, parameters={"torque": torque, "start": peak - length / 2, "duration": length})
        for joint, peak, length, torque in rows
    )


@pytest.fixture
def kinds():
    """Of the catalogue what could be missing here; the whole would only take longer."""
    return [k for k in store.effect_kinds() if k.name in ("coulomb_friction", "viscous_friction", "load_friction", "com_offset")]


def test_planted_pushes_are_found_and_no_others(make_model, kinds):
    """Learned from four clean runs of two days; 0.5 and 0.25 N m stand beside commands of up to 2 and 0.6 N m and friction that the model
    lacks. Peak within 0.1 s, amplitude within a third (a rectangle is no bell).
    """
    simulator = simulate.Replayer(model(make_model, 0)[0])
    clean = [run_of(make_model, f"day{d}/{k}", 10 * d + k, MISSING) for d in (1, 2) for k in (1, 2)]
    calibration = calibrate_pushes(simulator, clean, kinds)
    assert {t.hypothesis.kind for t in calibration.setting} >= {"coulomb_friction", "viscous_friction"}
    pushed = [run_of(make_model, name, seed, MISSING + pulses(rows)) for seed, (name, rows) in enumerate(PLANTED.items(), start=31)]
    found = find_pushes(simulator, pushed, calibration)
    expected = sorted((name, *row) for name, rows in PLANTED.items() for row in rows)
    assert [(f.recording, f.target) for f in sorted(found, key=lambda f: (f.recording, f.target))] == [(n, j) for n, j, *_ in expected]
    for f, (_, _, peak, length, torque) in zip(sorted(found, key=lambda f: (f.recording, f.target)), expected, strict=True):
        assert f.peak_time == pytest.approx(peak, abs=0.1)
        assert f.amplitude == pytest.approx(torque, rel=0.34)
        assert f.duration == pytest.approx(length, rel=0.6)
        assert f.start < peak < f.start + f.duration
        assert f.probability > 0.9
    assert find_pushes(simulator, [run_of(make_model, "calm/1", 55, MISSING)], calibration) == ()


def test_residual_effort_is_what_no_command_gave(make_model):
    """A push of 0.5 N m for 0.3 s on a model that is otherwise right: its height within 10 %, and only noise before it."""
    simulator = simulate.Replayer(model(make_model, 3)[0])
    effort = residual_effort(simulator, run_of(make_model, "one", 3, pulses([("hinge1", 2.0, 0.3, 0.5)])))
    at = np.abs(effort.time - 2.0) < 0.06
    before = effort.time < 1.0
    assert effort.coordinates == ("hinge1", "hinge2")
    assert effort.value[at, 0].mean() == pytest.approx(0.5, rel=0.1)
    assert np.abs(effort.value[at, 1].mean()) < 0.05
    assert np.sqrt(np.mean(effort.value[before] ** 2, axis=0)) == pytest.approx([0, 0], abs=0.03)
    assert not np.any((effort.time > 2.9) & (effort.time < 3.3))  # the gap


def test_covariance_is_positive_and_its_derivatives_are_right(make_model):
    simulator = simulate.Replayer(model(make_model, 3)[0])
    effort = residual_effort(simulator, run_of(make_model, "one", 3, MISSING))
    points = points_of([effort], 0, usual_of([effort])).some(np.arange(0, len(effort.time), 6))
    numbers = np.log([guess for _, _, guess in NUMBERS.values()])
    total, slopes = covariance(points, numbers, derivatives=True)
    assert np.linalg.eigvalsh(total).min() > 0
    for k, slope in enumerate(slopes):
        step = np.eye(len(numbers))[k] * 1e-4
        difference = (covariance(points, numbers + step)[0] - covariance(points, numbers - step)[0]) / 2e-4
        assert difference == pytest.approx(slope, abs=2e-5 * np.abs(total).max())


def test_refusals(make_model, kinds):
    simulator = simulate.Replayer(model(make_model, 3)[0])
    with pytest.raises(InputRefused, match="name at least one"):
        calibrate_pushes(simulator, [], kinds)
    run = run_of(make_model, "one", 3, ())
    blind = replace(run, channels=tuple(c for c in run.channels if c.name != "angle2"))
    with pytest.raises(InputRefused, match="lacks that of hinge2"):
        residual_effort(simulator, blind)
    short = replace(run, channels=tuple(replace(c, time=c.time[:20], value=c.value[:20]) for c in run.channels))
    with pytest.raises(InputRefused, match="too short"):
        residual_effort(simulator, short)
