"""What may be wrong with a machine: complete, meaningful at its target, and of the machine's own size."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rille._solver import Model, Simulation

from machines import LUNAR_SOIL, cart, chain, plane
from made_machines import machine_of
from rille import simulate, store
from rille.diagnosis.hypotheses.candidates import candidates, of_kind, require_known
from rille.diagnosis.hypotheses.natural import factor_of, natural, size_of
from rille.diagnosis.hypotheses.sensor_hypotheses import channels_of, sensor_hypotheses
from rille.diagnosis.hypotheses.shape_tries import EVERY_ORDER
from rille.diagnosis.hypotheses.tries import place_tries
from rille.model import Command, Drive, Effect, Grouser, InputRefused, Scenario
from rille.model.diagnosis import Location, Span
from rille.model.recording import Channel
from rille.proof.machines import MAKERS

KINDS = store.effect_kinds()
NEEDING = {need: {k.name for k in KINDS if k.needs == need} for need in ("drive", "grousers", "soft_ground", "gravity")}


def of(hypotheses, cause="effect"):
    """(kind, target) of those with that cause."""
    return {(h.kind, h.target) for h in hypotheses if h.cause == cause}


def pendulum(mass=0.5, drives=()):
    return replace(chain([0.3, 0.2], [mass, mass]), drives=tuple(drives))


def wave(name, quantity, target, unit, value, noise=1e-3, **more):
    time = np.arange(0, 10, 0.01)
    return Channel(name=name, quantity=quantity, target=target, unit=unit, noise=noise, time=time, value=value(time), **more)


def test_only_what_means_something_at_its_target():
    held = of(candidates(machine_of(pendulum()), (), KINDS))
    assert not {kind for kind, _ in held} & (NEEDING["drive"] | NEEDING["grousers"] | NEEDING["soft_ground"])
    driven = of(candidates(machine_of(pendulum(drives=[Drive(name="m", joint="hinge1", mode="torque", max_torque=1.0)])), (), KINDS))
    assert {target for kind, target in driven if kind in NEEDING["drive"]} == {"hinge1"}
    assert driven > held
    rover = cart(5.0, 0.15, 0.165)
    assert not {k for k, _ in of(candidates(machine_of(rover), (), KINDS))} & (NEEDING["soft_ground"] | NEEDING["grousers"])
    smooth = {k for k, _ in of(candidates(machine_of(rover, soil=LUNAR_SOIL), (), KINDS))}
    assert smooth >= NEEDING["soft_ground"]
    assert not smooth & NEEDING["grousers"]
    lugs = replace(rover.wheels[0], grouser=Grouser(count=12, height=0.01, thickness=0.002))
    one = of(candidates(machine_of(replace(rover, wheels=(lugs, *rover.wheels[1:])), soil=LUNAR_SOIL), (), KINDS))
    assert {t for k, t in one if k in NEEDING["grousers"]} == {lugs.name}  # '*' would refuse the smooth ones
    assert not {k for k, _ in of(candidates(machine_of(pendulum(), gravity=0.0), (), KINDS))} & NEEDING["gravity"]


def test_every_law_of_the_catalogue_is_proposed_somewhere():
    rover = cart(5.0, 0.15, 0.165)
    lugs = tuple(replace(w, grouser=Grouser(count=12, height=0.01, thickness=0.002)) for w in rover.wheels)
    seen = wave("x", "part.position", "chassis", "m", np.sin, component="x")
    found = candidates(machine_of(replace(rover, wheels=lugs), soil=LUNAR_SOIL), [seen], KINDS)
    missing = {k.name for k in KINDS} - {h.kind for h in found}
    assert missing == {k.name for k in KINDS if k.target == "any" or "gaps" in k.channel}  # formulas; faults that leave no wrong value


def test_modules_know_no_law_by_name(repository: Path):
    """Only the words that are laws and words of the language at once are spared."""
    names = {k.name for k in KINDS} - {"bias", "scale", "delay", "drift", "expression", "saturation"}
    for module in ("candidates", "natural", "parameter_hypotheses", "sensor_hypotheses", "tries"):
        text = (repository / f"pipeline/rille/diagnosis/hypotheses/{module}.py").read_text()
        assert [name for name in names if name in text] == [], module


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_usual_numbers_grow_with_the_machine(size):
    """Masses x size: efforts, and all that has N in its unit, x size; times and angles as they were."""
    base, other = (candidates(machine_of(pendulum(0.5 * s)), (), KINDS) for s in (1.0, size))
    for a, b in zip(base, other, strict=True):
        for p, q in zip(a.free, b.free, strict=True):
            if a.cause == "effect" and p.amplitude:
                expected = size if ("N" in p.unit or "kg" in p.unit) else 1.0
                assert q.spread == pytest.approx(p.spread * (1 / size if p.unit.startswith("rad/(N") else expected), rel=1e-6), (
                    a.title,
                    p.name,
                )


def test_recorded_efforts_count_where_they_stand_out():
    machine = machine_of(pendulum(drives=[Drive(name="m", joint="hinge1", mode="torque", max_torque=50.0)]))
    seen = [wave("tau", "joint.effort", "hinge1", "N m", lambda t: 0.2 * np.sin(3 * t), role="command")]
    noise = [wave("tau", "joint.effort", "hinge1", "N m", lambda t: 1e-3 * np.sin(90 * t), noise=1e-3)]
    spread = {}
    for name, channels in (("seen", seen), ("noise", noise), ("none", [])):
        spread[name] = natural(machine, channels).at("joint", "hinge1")["N"]
    assert spread["seen"] == pytest.approx(0.2, rel=0.02)
    assert spread["noise"] == spread["none"] > 1.0  # what its weight asks for


def test_units_of_laws_are_read():
    assert size_of("N m s/rad", {"N": 2.0, "m": 1.0, "s": 3.0, "rad": 0.5}) == pytest.approx(12.0)
    assert size_of("rad/(N m)", {"N": 2.0, "m": 1.0, "rad": 0.5}) == pytest.approx(0.25)
    assert size_of("N s^2/m^2", {"N": 2.0, "m": 2.0, "s": 3.0}) == pytest.approx(4.5)
    assert size_of("furlong", {}) is None
    assert factor_of("furlong", "joint", {}) == 1.0


def test_effects_that_the_model_has_are_numbers_to_refit():
    name = next(k.name for k in KINDS if k.target == "joint" and not k.needs and len(k.parameters) == 1)
    number = next(k.parameters[0].name for k in KINDS if k.name == name)
    machine = machine_of(pendulum(), effects=[Effect(kind=name, target="hinge1", parameters={number: 0.04})])
    found = candidates(machine, (), KINDS)
    assert (name, "hinge1") not in of(found)
    assert (name, "hinge2") in of(found)
    (refit,) = [h for h in found if h.kind == f"{name}.{number}"]
    assert refit.cause == "parameter"
    assert refit.target == "hinge1"
    assert refit.free[0].absent == refit.free[0].start == 0.04
    assert refit.free[0].lower == 0
    assert refit.moves == ((number, f"effect.{name}.hinge1.{number}", 1.0),)


@pytest.mark.parametrize(("speed", "most"), [(2.0, 225), (20.0, EVERY_ORDER)])
def test_ripples_are_as_fine_as_samples_follow_at_slow_moments(speed, most):
    """Half a turn (3 rad) of the ripple from one of 50 samples a second to the next, at a third of the fastest speed (22 waves at
    20 rad/s); but where a joint starts from rest every order that is tried one by one can be followed.
    """
    t = np.arange(0.0, 5.0, 0.02)
    rate = Channel(name="rate", quantity="joint.velocity", target="hinge1", unit="rad/s", time=t, value=speed * np.sin(1.3 * t))
    rover = replace(chain([0.3], [0.5]), drives=(Drive(name="m", joint="hinge1", mode="torque", max_torque=5.0),))
    ripple = next(h for h in candidates(machine_of(rover), (rate,), KINDS) if h.title == "torque_ripple of hinge1")
    (cycles,) = (n for n in ripple.free if n.name == "cycles")
    assert cycles.upper == pytest.approx(most, rel=0.05)


def test_numbers_of_the_model():
    rover = cart(5.0, 0.15, 0.165)
    found = {(h.kind, h.target): h for h in candidates(machine_of(rover, soil=LUNAR_SOIL), (), KINDS) if h.cause == "parameter"}
    radius = found["radius", "*"]
    assert [move for _, _, move in radius.moves] == [0.15] * 4
    assert radius.free[0].absent == 1.0
    assert {("cohesion", "lunar_sourcebook"), ("stiffness", "lunar_sourcebook"), ("gravity", ""), ("max_torque", "*")} <= set(found)
    assert not any(kind == "position_gain" for kind, _ in found)  # the drives hold speeds
    for h in found.values():
        n = h.free[0]
        assert n.amplitude
        assert n.lower < n.absent < n.upper, h.title
        assert 0 < n.spread < np.inf, h.title


def test_faults_of_channels_instruments_and_clocks():
    pose = [wave(f"p{c}", "part.position", "link1", "m", np.sin, component=c, clock="pose") for c in "xyz"]
    turn = [wave(f"q{c}", "part.orientation", "link1", "1", np.cos, component=c, clock="pose") for c in "wxyz"]
    rate = wave("w", "joint.velocity", "hinge1", "rad/s", lambda t: 2 * np.sin(t), clock="encoder")
    found = [
        h
        for h in candidates(machine_of(pendulum()), [*pose, *turn, rate, replace(rate, name="tau", role="command")], KINDS)
        if h.cause == "sensor"
    ]
    assert not any(h.target == "tau" for h in found)
    assert not any(h.target_kind == "channel" and h.target.startswith("q") for h in found)
    assert {h.target for h in found if h.target_kind == "clock"} == {"pose"}
    (late,) = [h for h in found if h.target_kind == "clock" and h.free[0].unit == "s"]
    assert channels_of(late, [*pose, *turn, rate]) == ("px", "py", "pz", "qw", "qx", "qy", "qz")
    (offset,) = [h for h in found if h.target == "part.position of link1" and h.free[0].unit == "m"]
    assert channels_of(offset, [*pose, *turn, rate]) == ("px", "py", "pz")
    (limit,) = [h for h in found if h.target == "w" and h.free[0].unit == "1/(rad/s)"]
    assert 1 / limit.free[0].spread == pytest.approx(2.0, rel=0.01)  # what is seen of a limit is the largest value


def test_pulses_only_where_the_difference_is_short():
    machine = machine_of(cart(5.0, 0.15, 0.165), soil=LUNAR_SOIL)
    momentary = {k.name for k in KINDS if any(p.search == "time" for p in k.parameters)}
    short = Location(shape="transient", spans=(Span(recording="r", start=3.0, stop=3.5, size=4.0),))
    x = wave("x", "part.position", "chassis", "m", lambda t: t, component="x")
    where = {
        shape: of(candidates(machine, [x], KINDS, where)) for shape, where in (("short", short), ("long", Location(shape="everywhere")))
    }
    assert {t for k, t in where["long"] if k in momentary} == {"chassis"}
    assert {t for k, t in where["short"] if k in momentary} >= {"chassis", "wheel_front_left"}
    found = candidates(machine, [x], KINDS, short)
    for h in found:
        for n in h.free:
            assert n.search != "time" or n.start == 3.0
    sets = place_tries(found, machine, natural(machine, [x]), short)
    assert set(sets) == {h.title for h in found if any(n.search == "place" for n in h.free)}
    for h in found:
        for values in sets.get(h.title, ()):
            assert set(values) == {n.name for n in h.free if not n.amplitude}
            assert all(n.lower <= values[n.name] <= n.upper for n in h.free if not n.amplitude)
            assert all(2.9 <= v <= 3.6 for k, v in values.items() if k.endswith("_x"))  # x = t: where it was then


def test_a_push_is_short():
    """What lasts longer than a quarter of what was recorded belongs to no moment: a law that lasts would be called a push."""
    x = wave("x", "joint.position", "hinge1", "rad", np.sin)
    pulses = [h for h in candidates(machine_of(pendulum()), [x], KINDS) if h.kind in ("joint_pulse", "external_pulse")]
    assert {h.kind for h in pulses} == {"joint_pulse", "external_pulse"}
    for h in pulses:
        (duration,) = [n for n in h.free if n.name == "duration"]
        assert duration.upper == pytest.approx(0.25 * (x.time[-1] - x.time[0]))
        assert duration.lower <= duration.start <= duration.upper


def test_clocks_that_are_far_off_are_tried():
    """A rate that shifts more than a turn of what moves, by the end, is told by nothing near none: it has to be met."""
    time = np.arange(0, 12, 0.01)
    channel = Channel(name="a", quantity="joint.effort", target="hinge1", unit="N m", time=time, value=np.sin(3 * time), noise=1e-3)
    (skew,) = next(h for h in sensor_hypotheses([channel], KINDS) if h.kind == "clock_skew").free
    assert min(skew.tries) == -max(skew.tries) == -0.2
    rates = np.sort([0.0, *(t for t in skew.tries if t > 0)])
    assert np.diff(rates).max() * time[-1] < 0.5 * np.pi / 3 + 0.05  # [s] about a quarter of a turn


def test_pushes_at_the_joints_of_what_the_world_holds():
    """An arm of four joints is asked for them, whatever the difference looks like, as it is for pushes at its bodies."""
    arm = MAKERS["arm"](np.random.default_rng(0)).rover
    found = of(candidates(machine_of(arm, gravity=9.81), (), KINDS, Location(shape="everywhere")))
    assert {t for k, t in found if k == "joint_pulse"} == {"waist", "shoulder", "elbow", "motor"}


def test_gravity_may_be_of_another_planet_but_that_is_believed_last():
    gravity = next(h for h in candidates(machine_of(pendulum(), gravity=9.81), (), KINDS) if h.kind == "gravity")
    (factor,) = gravity.free
    assert factor.lower <= 1.62 / 9.81 < 9.81 / 1.62 <= factor.upper
    assert gravity.at({"factor": 0.5}).is_far_fetched
    assert not gravity.at({"factor": 1.02}).is_far_fetched


def test_a_fault_that_is_there_or_not_is_never_there_by_a_part():
    time = np.arange(0, 5, 0.01)
    channel = Channel(name="a", quantity="joint.position", target="hinge1", unit="rad", time=time, value=np.sin(time), noise=1e-3)
    found = {h.kind: h.free[0] for h in sensor_hypotheses([channel], KINDS) if h.target == "a"}
    assert (found["wrong_sign"].lower, found["wrong_sign"].upper) == (0.9, 1.0)
    assert found["scale"].lower < 0 < found["scale"].upper
    assert found["bias"].upper == pytest.approx(10 * (np.abs(channel.value).max() + 10 * channel.noise))


def test_filters():
    found = candidates(machine_of(pendulum()), (), KINDS)
    assert {h.cause for h in of_kind(found, only=["parameter"])} == {"parameter"}
    assert not [h for h in of_kind(found, without=["hinge1", "parameter"]) if h.target == "hinge1" or h.cause == "parameter"]


@pytest.mark.parametrize("machine", ["pendulum", "cart"])
def test_the_solver_runs_every_trial(make_model, machine):
    """Without amplitudes the same bits as the model; with the usual ones no refusal, and no run that ends."""
    if machine == "pendulum":
        drives = [Drive(name=f"m{k}", joint=f"hinge{k}", mode="torque", max_torque=2.0) for k in (1, 2)]
        rover, terrain = pendulum(drives=drives), None
        scenario = Scenario(name="s", duration=1, gravity=(0, 0, -9.81), step=1e-3, commands=(Command(drive="m1", time=0.0, value=0.3),))
        channels = [("joint.position", "hinge1", 0), ("joint.position", "hinge2", 0)]
    else:
        rover, terrain = cart(5.0, 0.15, 0.165), plane()
        commands = tuple(Command(drive=d.name, time=0.0, value=2.0) for d in rover.drives)
        scenario = Scenario(
            name="s", duration=1, gravity=(0, 0, -9.81), step=2e-3, terrain="plane", placement="on_terrain", commands=commands
        )
        channels = [("part.position", "chassis", 0), ("part.position", "chassis", 2)]
    model = Model(str(make_model(rover, scenario, terrain)))
    base = run(model, channels)
    for h in candidates(machine_of(rover, soil=LUNAR_SOIL if terrain else None, gravity=9.81), (), KINDS):
        if h.cause != "effect":
            continue
        for values in ({}, {n.name: max(-n.spread, n.lower) if n.lower < 0 else n.spread for n in h.free if n.amplitude}):
            effect = Effect(kind=h.kind, target=h.target or "*", parameters=h.at(values).numbers)
            store.check_effect(effect)
            copy = model.copy()
            copy.set_effects(simulate.effect_rows([effect], KINDS))
            got = run(copy, channels)
            assert np.isfinite(got).all(), h.title
            assert values or np.array_equal(got, base), h.title


def run(model, channels):
    """(n, channels) of 0.2 s."""
    return Simulation(model).sample(round(0.2 / model.step), 10, channels)


def test_names_that_mean_nothing_are_refused():
    found = candidates(machine_of(pendulum()), (), KINDS)
    for only, without, said in (
        (["coulumb_friction"], [], "did you mean coulomb_friction"),
        ([], ["nosuch"], "--without 'nosuch' is no kind"),
        (["hinge1"], ["hinge1"], "leaves nothing to try"),
    ):
        with pytest.raises(InputRefused, match=said):
            require_known(found, KINDS, only, without)
    require_known(found, KINDS, ["effect"], ["backlash"])
