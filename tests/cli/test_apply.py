"""``rille apply``: the new database is the model that the finding speaks of, and shows the fit that was promised."""

import json
import sqlite3
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Model

from cli.conftest import FRICTION, MASS
from command import assert_refused, rille
from machines import cart, plane
from made_diagnosis import COULOMB, free
from rille import store
from rille.diagnosis.answer.diagnosis_json import setting_json
from rille.model import Command, Effect, InputRefused, Scenario
from rille.model.finding import Finding
from rille.model.hypothesis import Hypothesis

MASS_ERROR = Hypothesis(
    cause="parameter",
    kind="mass",
    target="link2",
    target_kind="body",
    free=(free("mass", "kg", absent=0.5, start=0.5, lower=0.01),),
    moves=(("mass", "body.link2.mass", 1.0),),
)


def keep(path, setting, **changes):
    """A finding with this setting."""
    value = {"verdict": "named", "sentence": "friction brakes hinge1", "recordings": ("run",), "setting": setting_json(setting)}
    return store.write_finding(path, Finding(**(value | {"detail": {"scenario": "swing"}} | changes)))


def chi2(path):
    done = rille("compare", path, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["chi2_per_degree"]


def test_the_improved_model_shows_the_promised_fit(pendulum, tmp_path):
    friction = replace(COULOMB, target="hinge1")
    finding = keep(pendulum, (friction.at({"torque": FRICTION}), MASS_ERROR.at({"mass": MASS})))
    assert finding.name == "diagnosis-1"
    improved = tmp_path / "improved.db"
    done = rille("apply", pendulum, "diagnosis-1", "-o", improved, "--json")
    assert done.returncode == 0, done.stderr
    changes = {(c["table"], c["row"], c["column"]): (c["before"], c["after"], c["unit"]) for c in json.loads(done.stdout)["changes"]}
    assert changes == {
        ("effect", "coulomb_friction.hinge1", "torque"): (None, FRICTION, "N m"),
        ("body", "link2", "mass"): (0.5, MASS, "kg"),
    }
    assert chi2(pendulum) > 3
    # The truth was recorded by the same solver at the same step: what is left is white noise of the stated size.
    assert chi2(improved) == pytest.approx(1.0, abs=0.15)
    with closing(sqlite3.connect(improved)) as connection:
        subject, file, digest, tool = connection.execute("SELECT subject, file, sha256, tool FROM provenance").fetchone()
        assert (subject, file, len(digest)) == ("calibrated by diagnosis-1", str(pendulum), 64)
        assert tool.startswith("rille ")
        assert connection.execute("SELECT mass_provenance FROM body WHERE name = 'link2'").fetchone() == ("measured",)
    assert store.check(improved) == []
    assert store.find_finding(improved).name == "diagnosis-1"
    assert store.read_effects(pendulum) == ()
    assert_refused(rille("apply", pendulum, "diagnosis-1", "-o", improved), "exists already")


def driven_cart():
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in cart(5.0, 0.15, 0.165).drives)
    return Scenario(name="go", duration=2, terrain="plane", placement="on_terrain", commands=commands)


def test_every_parameter_of_the_solver_has_its_place_in_the_database(make_model, tmp_path):
    """All at once by 3 %, written as rows and read again by the solver: the values that were asked for."""
    wheel = Effect(kind="slip_sinkage", target="*", parameters={"slip_gain": 0.4})
    joint = Effect(kind="stribeck_friction", target="wheel_front_left", parameters={"coulomb_torque": 0.2})
    machine = cart(5.0, 0.15, 0.165)
    machine = replace(machine, drives=tuple(replace(d, speed_gain=4.0, integral_gain=1.0) for d in machine.drives))
    path = make_model(machine, driven_cart(), plane(), [wheel, joint])
    before = dict(Model(str(path), "go").parameters())
    names = [name for name in before if not name.startswith("effect.stribeck_friction.wheel_front_left.stiction")]
    known = store.parameter_values(path, names, "go")
    assert known == pytest.approx({name: before[name] for name in names}, rel=1e-12)
    wanted = {name: 1.03 * value for name, value in known.items() if value != 0 and not name.startswith("effect.slip_sinkage.*.")}
    wanted["effect.slip_sinkage.*.slip_gain"] = 0.5
    wanted.pop("track_width", None)  # it moves the wheels' centres of mass, see below
    assert len(wanted) > 40
    target = tmp_path / "other.db"
    store.improve(path, target, [], wanted, why="diagnosis-1", tool="test", scenario="go")
    after = dict(Model(str(target), "go").parameters())
    assert {name: after[name] for name in wanted} == pytest.approx(wanted, rel=1e-9)
    untouched = {name: value for name, value in before.items() if name not in wanted}
    assert {name: after[name] for name in untouched} == pytest.approx(untouched)
    assert store.read_soils(target)[0].source.endswith("calibrated by diagnosis-1")


def test_track_width_moves_wheels_as_the_solver_does(make_model, tmp_path):
    """A run of the model whose track width is set in memory and one of the rewritten rows are the same run."""
    from rille._solver import Simulation

    path = make_model(cart(5.0, 0.15, 0.165), driven_cart(), plane())
    model = Model(str(path), "go")
    if "track_width" not in model.parameters():
        pytest.skip("this solver was built before it knew track widths")
    model.set("track_width", 1.0)
    target = tmp_path / "wide.db"
    store.improve(path, target, [], {"track_width": 1.0}, why="diagnosis-1", tool="test")
    states = []
    for made in (model, Model(str(target), "go")):
        simulation = Simulation(made)
        simulation.step(200)
        states.append(simulation.state()[0])
    np.testing.assert_allclose(states[0], states[1], rtol=0, atol=1e-9)
    assert max(w.center[1] for w in store.read_rover(target).wheels) == pytest.approx(0.5)


def test_what_cannot_be_applied_is_refused(pendulum, tmp_path):
    assert_refused(rille("apply", pendulum, "-o", tmp_path / "a.db"), "holds no finding", "rille diagnose")
    keep(pendulum, (), verdict="nothing_missing", sentence="the model reproduces the recording")
    assert_refused(rille("apply", pendulum, "-o", tmp_path / "a.db"), "proposes no change", "reproduces the recording")
    assert_refused(rille("apply", pendulum, "diagnosis-7", "-o", tmp_path / "a.db"), "no finding 'diagnosis-7'", "diagnosis-1")
    friction = replace(COULOMB, target="hinge1")
    keep(pendulum, (friction.at({"torque": 0.1}),))
    assert_refused(rille("apply", pendulum, "-o", tmp_path / "nowhere" / "a.db"), "does not exist")
    keep(pendulum, (replace(COULOMB, target="hinge9").at({"torque": 0.1}),))
    assert_refused(rille("apply", pendulum, "-o", tmp_path / "a.db"), "hinge9")
    keep(pendulum, (MASS_ERROR.at({"mass": -1.0}),))
    assert_refused(rille("apply", pendulum, "-o", tmp_path / "a.db"), "link2", "mass")
    with closing(sqlite3.connect(pendulum)) as connection, connection:
        connection.execute("UPDATE finding SET setting = '[{\"values\": [1]}]' WHERE name = 'diagnosis-4'")
    assert_refused(rille("apply", pendulum, "diagnosis-4", "-o", tmp_path / "a.db"), "another version")
    assert not list(tmp_path.glob("a.db*"))


def test_findings_are_numbered_and_read_back(pendulum):
    first = keep(pendulum, (), sentence="one", probability=0.4, held_out=("b",))
    second = keep(pendulum, ())
    assert [first.name, second.name] == ["diagnosis-1", "diagnosis-2"]
    assert store.find_finding(pendulum).name == "diagnosis-2"
    assert store.read_findings(pendulum)[0] == first
    with pytest.raises(InputRefused, match="verdict"):
        keep(pendulum, (), verdict="perhaps")


def test_the_digest_of_a_model_is_that_of_its_physics(pendulum):
    before = store.model_digest(pendulum)
    keep(pendulum, ())
    store.remove_recording(pendulum, "run")
    assert store.model_digest(pendulum) == before
    store.add_effect(pendulum, Effect(kind="coulomb_friction", target="hinge1", parameters={"torque": 0.1}))
    assert store.model_digest(pendulum) != before


def test_moments_of_inertia_change_together(pendulum, tmp_path):
    """A slender rod: each new moment breaks the triangle with the two old ones, all three together do not."""
    before = store.parameter_values(pendulum, [f"body.link2.{axis}" for axis in ("ixx", "iyy", "izz")])
    assert max(before.values()) > 100 * min(before.values())
    target = tmp_path / "heavier.db"
    store.improve(pendulum, target, [], {name: 1.5 * value for name, value in before.items()}, why="diagnosis-1", tool="test")
    assert store.parameter_values(target, before) == pytest.approx({name: 1.5 * value for name, value in before.items()})
    assert store.check(target) == []


def test_what_is_not_applied_is_told(pendulum, tmp_path):
    bias = Hypothesis(cause="sensor", kind="bias", target="angle1", target_kind="channel", free=(free("offset", "rad"),))
    keep(pendulum, (replace(COULOMB, target="hinge1").at({"torque": FRICTION}), bias.at({"offset": 0.1})))
    done = rille("apply", pendulum, "-o", tmp_path / "improved.db")
    assert done.returncode == 0
    assert "bias of angle1" in done.stderr
    assert "import" in done.stderr


def test_what_makes_held_out_data_worse_is_not_applied(pendulum, tmp_path):
    setting = (replace(COULOMB, target="hinge1").at({"torque": FRICTION}),)
    keep(pendulum, setting, verdict="unknown", detail={"scenario": "swing", "proof": {"gap_closed": -0.5}})
    assert_refused(rille("apply", pendulum, "-o", tmp_path / "improved.db"), "-50%")
    assert not (tmp_path / "improved.db").exists()
