"""Recordings that cannot tell: the answer says what cannot be known and why; nothing crashes, and no name is invented."""

from dataclasses import replace

import numpy as np
import pytest

import swung
from effect_rigs import EARTH, flywheel
from machines import cart, chain, plane
from recorded import commanded, record
from rille import simulate, store
from rille.cli.bench_rigs import bench_rig
from rille.diagnosis.bench.bench_diagnosis import diagnose_bench
from rille.diagnosis.diagnose import Options, diagnose
from rille.model import Command, Effect, InputRefused, Pose, Scenario
from rille.model.recording import Channel, GateFinding, Recording

NAMING = ("named", "group", "parameter", "sensor_fault")


def scenario(**more):
    """Free space with earth's gravity."""
    return Scenario(**({"name": "s", "duration": 4.0, "step": 1e-3, "gravity": (0, 0, -EARTH)} | more))


def sensors(joint, noise=1e-3, words=("position", "velocity")):
    """Position and velocity of a joint without samples."""
    units = {"position": "rad", "velocity": "rad/s"}
    return [
        Channel(name=f"{joint}_{word}", quantity=f"joint.{word}", target=joint, unit=units[word], noise=noise and noise * (1 + 9 * k))
        for k, word in enumerate(words)
    ]


def wave(drive="motor", size=1.0, duration=4.0):
    """Torque that swings, with two paces."""
    times = np.arange(0, duration, 0.05)
    return tuple(Command(drive=drive, time=float(t), value=float(size * (np.sin(3 * t) + np.sin(7.3 * t)))) for t in times)


def answer(path, *recordings, **more):
    """Diagnosis by the model at ``path``."""
    return diagnose(lambda name: simulate.Replayer(path, name or None, threads=1), recordings, kinds=store.effect_kinds(), **more)


def judged(path, recording):
    """Verdict and all that is said; the sentence of a refusal is an answer, too."""
    try:
        found = answer(path, recording)
    except InputRefused as refusal:
        return "refused", str(refusal)
    return found.verdict, " ".join((found.sentence, *found.limits, *found.notes))


def wheel_run(make_model, *effects, duration=4.0, step=5e-4, seed=1, noise=1e-3, size=1.0):
    """A flywheel under a swinging torque: path of the model without the effects, recording of the machine with them."""
    plan = scenario(duration=duration, commands=wave(size=size, duration=duration))
    real = make_model(flywheel(inertia=0.2, mode="torque", mass=5.0), replace(plan, step=step), None, effects)
    recording = record(real, sensors("hub", noise), duration=duration, rate=100.0, seed=seed)
    return make_model(flywheel(inertia=0.2, mode="torque", mass=5.0), plan), commanded(recording, plan)


def without_statement(recording):
    """The same, with no noise stated."""
    return replace(recording, channels=tuple(replace(c, noise=None) for c in recording.channels))


def test_too_short_a_recording_names_nothing(make_model):
    """0.6 s hold one window and nothing to prove it on."""
    path, recording = wheel_run(make_model, Effect(kind="viscous_friction", target="hub", parameters={"coefficient": 0.5}), duration=0.6)
    verdict, said = judged(path, recording)
    assert verdict not in NAMING
    assert "record" in said


def test_a_joint_that_never_moves_is_said_to_be_unknown(make_model):
    """The machine has friction and play in its lower hinge; nothing moves it."""
    plan = scenario()
    faults = [Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.5})]
    real = make_model(chain([0.4, 0.3], [1.0, 0.5]), replace(plan, step=5e-4), None, faults)
    recording = record(real, [*sensors("hinge1"), *sensors("hinge2")], duration=4.0, rate=100.0, seed=2)
    found = answer(make_model(chain([0.4, 0.3], [1.0, 0.5]), plan), recording)
    assert found.verdict in ("nothing_missing", "cannot_know")
    assert any("hinge2" in sentence and "never move" in sentence for sentence in found.limits)


def test_noise_that_nobody_stated_is_taken_from_the_samples_and_said(make_model):
    path, recording = wheel_run(make_model)
    found = answer(path, without_statement(recording))
    assert found.verdict not in NAMING
    assert any("noise" in sentence and "not stated" in sentence for sentence in found.limits)


def test_a_channel_that_the_data_gate_took_out_is_told_with_the_verdict(make_model):
    """The model is right and one sensor is stuck: that nothing is missing holds for the others."""
    path, recording = wheel_run(make_model)
    stuck = GateFinding(code="stuck", severity="warning", channel="hub_velocity", message="channel 'hub_velocity' is stuck on a stretch")
    found = answer(path, replace(recording, findings=(stuck,)))
    assert found.verdict == "nothing_missing"
    assert "'hub_velocity': the data gate found it stuck" in found.sentence


def test_a_channel_without_any_noise_to_tell_is_not_judged(make_model):
    """A sensor that says zero all the time: no noise, nothing stated."""
    path, recording = wheel_run(make_model)
    dead = replace(recording.channels[1], noise=None, value=np.zeros_like(recording.channels[1].value))
    found = answer(path, replace(recording, channels=(recording.channels[0], dead, *recording.channels[2:])))
    assert found.verdict not in ("named", "group", "parameter")
    assert any("hub_velocity" in sentence for sentence in (*found.limits, *found.data_problems, found.sentence))


def test_a_model_that_ends_in_every_window_names_nothing(make_model):
    """Recorded positions lie beside the terrain of the model: no window can be run."""
    drives = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in cart(20.0, 0.15, 0.165).drives)
    here = scenario(
        terrain="plane", placement="on_terrain", settle_time=2.0, duration=3.0, commands=drives, start=Pose(position=(-3.0, 0, 0))
    )
    path = make_model(cart(20.0, 0.15, 0.165), here, plane())
    places = [Channel(name=c, quantity="part.position", target="chassis", component=c, unit="m", noise=2e-3, clock="track") for c in "xyz"]
    turns = [
        Channel(name=c, quantity="part.orientation", target="chassis", component=c, unit="rad", noise=2e-3, clock="track")
        for c in ("roll", "pitch", "yaw")
    ]
    recording = commanded(record(path, [*places, *turns], duration=3.0, rate=50.0, seed=3), here, "joint.velocity")
    away = replace(recording, channels=tuple(replace(c, value=c.value + 100.0) if c.name == "x" else c for c in recording.channels))
    verdict, said = judged(path, away)
    assert verdict in ("cannot_know", "refused")
    assert "terrain" in said


def test_a_model_that_diverges_is_said_not_to_run(make_model):
    """A formula in the model that feeds the speed back, exp(2500 t): every window of the replay ends, whatever the recording says."""
    path, recording = wheel_run(make_model)
    constants = {"k": [500.0, "N m s/rad"]}
    wild = {"gain": 1.0, "formula": "k*velocity", "output": "joint.effort", "target_kind": "joint", "constants": constants}
    store.write_effects(path, [Effect(kind="expression", target="hub", parameters=wild)])
    found, said = judged(path, recording)
    assert found in ("cannot_know", "refused")
    assert "end" in said or "diverge" in said


def bench_points(machine_effects, loads, slips, noise=0.2, seed=5):
    """Steady points of a smooth wheel, drawbar pull and sinkage with noise."""
    from effect_rigs import LUNAR_SOIL, SMOOTH, rows

    grid = [array.ravel() for array in np.meshgrid(loads, slips, indexing="ij")]
    result = simulate.bench("bekker_wong", LUNAR_SOIL, SMOOTH, load=grid[0], slip_ratio=grid[1], effects=rows(*machine_effects))
    rng = np.random.default_rng(seed)
    channels = []
    for name, unit, role, value, sigma in (
        ("normal_load", "N", "command", grid[0], None),
        ("slip_ratio", "1", "command", grid[1], None),
        ("drawbar_pull", "N", "observed", result.points.drawbar_pull, noise),
        ("sinkage", "m", "observed", result.points.sinkage, 2e-4),
    ):
        channels.append(
            Channel(
                name=name,
                quantity=f"wheel.{name}",
                target="wheel",
                unit=unit,
                role=role,
                noise=sigma,
                time=np.arange(len(grid[0]), dtype=float),
                value=value + (sigma or 0.0) * rng.standard_normal(len(grid[0])),
            )
        )
    setup = {
        "wheel": {"radius": SMOOTH.radius, "width": SMOOTH.width},
        "law": "bekker_wong",
        "gravity": "earth",
        "speed": 0.05,
        "slip_speed": "heading",
        "soil": LUNAR_SOIL.name,
    }
    return Recording(name="points", kind="points", setup=setup, channels=tuple(channels))


def bench_answer(make_model, recording):
    """Diagnosis of points by a database that has their soil."""
    path = make_model(cart(5.0, 0.15, 0.165), scenario(terrain="plane"), plane())
    return diagnose_bench([bench_rig(path, recording)[0]], kinds=store.effect_kinds(), model="bench")


@pytest.mark.parametrize(
    ("loads", "slips", "word"),
    [([50.0], np.linspace(0, 0.6, 9), "load"), ([30.0, 60.0], [0.2], "slip")],
    ids=["one load", "one slip"],
)
def test_points_of_one_condition_say_what_they_cannot_tell(make_model, loads, slips, word):
    fault = Effect(kind="slip_sinkage", parameters={"slip_gain": 0.5})
    found = bench_answer(make_model, bench_points([fault], loads, slips))
    assert any(word in sentence for sentence in found.limits)
    named = [term.hypothesis.kind for term in found.setting] if found.verdict == "named" else []
    assert named in ([], ["slip_sinkage"] if word == "load" else [])  # which grows with slip, at any load


def test_three_points_name_nothing(make_model):
    found = bench_answer(make_model, bench_points([Effect(kind="slip_sinkage", parameters={"slip_gain": 0.5})], [50.0], [0.1, 0.3, 0.5]))
    assert found.verdict not in ("named", "parameter", "sensor_fault")
    assert found.limits


def test_a_pose_that_nobody_recorded_is_not_blamed_on_physics(make_model):
    """Rates alone, of a pendulum that began at half a radian; the model begins at rest. Nothing is missing but the pose."""
    path, plan = swung.model(make_model, 2, (), 5.0)
    rates = [channel for channel in swung.sensors() if channel.quantity == "joint.velocity"]
    run = commanded(record(path, rates, duration=5.0, rate=200, seed=2), plan)
    hanging = make_model(store.read_rover(path), replace(plan, initial_states=()), None)
    found = answer(hanging, run, options=Options(only=("coulomb_friction", "viscous_friction")))
    assert found.verdict == "cannot_know"
    assert any("no channel shows the position of hinge1, hinge2" in note for note in found.notes)
