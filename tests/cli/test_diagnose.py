"""``rille diagnose`` around the diagnosis itself: what is asked, kept, printed, refused, and taken up again after an interruption."""

import json
import sys
import types
from dataclasses import dataclass, replace

import numpy as np
import pytest
import typer.main

from cli.test_compare import rover, scenario
from command import rille
from made_diagnosis import COULOMB, made_diagnosis, named
from rille import store
from rille.cli.main import app
from rille.cli.stages import KEPT, Stages
from rille.diagnosis.comparison.difference import find_difference
from rille.model import Effect, InputRefused
from rille.model.recording import Channel, Recording
from view.difference_case import comparison


@dataclass(frozen=True, kw_only=True)
class Options:
    """As of ``rille.diagnosis.diagnose``."""

    window: float = 0.5
    most: int = 4
    only: tuple = ()
    without: tuple = ()


@pytest.fixture
def asked(monkeypatch, tmp_path):
    """A stand-in for the diagnosis that tells what it was asked, and gives a made-up answer."""
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache"))
    calls = []

    def diagnose(simulators, recordings, held_out=(), *, kinds, options, stage, on_progress):
        first = simulators(recordings[0].scenario or "") if recordings[0].kind == "time" else None
        calls.append({"recordings": recordings, "held_out": held_out, "options": options, "kinds": kinds, "simulator": first})
        on_progress("comparing", 0.1)
        comparisons = stage("comparisons", lambda: calls.append("compared") or [comparison("run", seconds=6.0)])
        stage("search", lambda: calls.append("searched") or search())
        term = named(replace(COULOMB, target="hinge1"), {"torque": 0.06}, {"torque": 0.002}, equation="tau = -torque sign(w)")
        best = replace(made_diagnosis().ranked[0], terms=(term,), title="coulomb_friction of hinge1")
        stage("difference", lambda: find_difference(comparisons))
        return made_diagnosis(recordings=("run",), held_out=(), scenario="swing", setting=(term.term,), ranked=(best,), groups=())

    def search():
        if "interrupt" in calls:
            raise KeyboardInterrupt
        return 7

    module = types.ModuleType("rille.diagnosis.diagnose")
    module.Options, module.diagnose = Options, diagnose
    monkeypatch.setitem(sys.modules, "rille.diagnosis.diagnose", module)
    return calls


def run(*arguments):
    command = typer.main.get_command(app)
    with command.make_context("rille", ["diagnose", *map(str, arguments)]) as context:
        return command.invoke(context)


def test_the_answer_is_kept_printed_and_drawn(pendulum, asked, tmp_path, capsys):
    run(pendulum, "-o", tmp_path / "report.html", "--json", "--window", "250 ms", "--only", "effect", "--without", "dropout", "--most", 2)
    said = json.loads(capsys.readouterr().out)
    call = asked[0]
    assert call["options"] == Options(window=0.25, most=2, only=("effect",), without=("dropout",))
    assert [r.name for r in call["recordings"]] == ["run"]
    assert call["recordings"][0].scenario == "swing"
    assert call["simulator"].joints == ("hinge1", "hinge2")
    assert {kind.name for kind in call["kinds"]} == {kind.name for kind in store.effect_kinds()}
    assert said["finding"] == "diagnosis-1"
    assert said["verdict"] == "group"
    finding = store.find_finding(pendulum)
    assert (finding.target, finding.recordings) == ("coulomb_friction of hinge1", ("run",))
    assert finding.detail["ranked"][0]["probability"] == 0.71
    page = (tmp_path / "report.html").read_text()
    assert "coulomb_friction.hinge1" in page
    assert f"rille apply {pendulum} diagnosis-1" in page
    assert rille("apply", pendulum, "-o", tmp_path / "improved.db").returncode == 0


def test_the_text_says_what_where_how_sure_and_what_next(pendulum, asked, capsys):
    run(pendulum)
    out, err = capsys.readouterr()
    for words in ("coulomb_friction of hinge1", "81 %", "71 %", "94 % of the gap closed", "0.06", "record next"):
        assert words in out
    assert "rille apply" in err


def test_an_interrupted_diagnosis_goes_on_where_it_was(pendulum, asked, capsys):
    asked.append("interrupt")
    with pytest.raises(KeyboardInterrupt):
        run(pendulum)
    assert "goes on from there" in capsys.readouterr().err
    assert store.read_findings(pendulum) == ()
    asked.remove("interrupt")
    asked[:] = [call for call in asked if call != "compared"]
    run(pendulum)
    assert "compared" not in asked
    assert "comparisons" in capsys.readouterr().err
    run(pendulum, "--window", "0.4 s")  # another question
    assert asked.count("compared") == 1
    run(pendulum, "--fresh")
    assert asked.count("compared") == 2
    store.add_effect(pendulum, Effect(kind="viscous_friction", target="hinge1", parameters={"coefficient": 0.01}))
    run(pendulum)  # another model
    assert asked.count("compared") == 3


def test_stages_are_kept_by_key_and_survive_what_cannot_be_kept(tmp_path):
    stages = Stages("a", tmp_path)
    assert stages("one", lambda: np.arange(3)).tolist() == [0, 1, 2]
    stages("open", lambda: open(tmp_path / "x", "w"))  # noqa: SIM115, PTH123, what no pickle can hold
    again = Stages("a", tmp_path)
    assert again("one", lambda: pytest.fail("computed again")).tolist() == [0, 1, 2]
    assert again("open", lambda: 5) == 5
    assert (again.get("one").tolist(), again.get("nothing"), again.found) == ([0, 1, 2], None, ["one"])
    assert Stages("b", tmp_path)("one", lambda: 2) == 2
    for file in tmp_path.rglob("*.pickle"):
        file.write_bytes(b"\x80broken")
    assert Stages("a", tmp_path)("one", lambda: 3) == 3
    for k in range(2 * KEPT):
        stages = Stages(str(k), tmp_path)
        stages("one", lambda: 1)
        stages.done()
    assert sum(folder.is_dir() for folder in tmp_path.iterdir()) == KEPT
    stages.forget()
    assert Stages(str(2 * KEPT - 1), tmp_path)("one", lambda: 9) == 9


def test_recordings_are_chosen_and_held_out_by_name(make_model, asked):
    path = make_model(rover(), scenario())
    time = np.linspace(0, 1, 50)
    channel = Channel(name="angle1", quantity="joint.position", target="hinge1", unit="rad", time=time, value=0 * time)
    for name in ("swing/1", "swing/2", "fall"):
        store.write_recording(path, Recording(name=name, channels=(channel,)))
    run(path, "--held-out", "fall")
    assert [[r.name for r in asked[0][part]] for part in ("recordings", "held_out")] == [["swing/1", "swing/2"], ["fall"]]
    with pytest.raises(InputRefused, match="none is left"):
        run(path, "--held-out", "fall", "--held-out", "swing")
    with pytest.raises(InputRefused, match="no recording 'swim'"):
        run(path, "swim")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--window", "1 us"), "--window is 1e-06 s"),
        (("--most", 0), "--most is 0"),
        (("-o", "nowhere/r.html"), "there is no folder"),
        (("--scenario", "swim"), "no scenario 'swim'.*swing"),
        (("--held-out", "run"), "none is left"),
    ],
)
def test_wrong_questions_are_refused_before_anything_runs(pendulum, asked, arguments, words):
    with pytest.raises(InputRefused, match=words):
        run(pendulum, *arguments)
    assert asked == []


def test_calm_recordings_are_for_pushes_alone(pendulum, asked):
    """Options of the search are refused beside --calm, before anything is computed."""
    for option in ("--held-out", "--only", "--without"):
        done = rille("diagnose", pendulum, "run", "--calm", "run", option, "x")
        assert done.returncode == 3
        assert "--calm looks for pushes alone" in done.stderr
    assert asked == []


def test_a_recording_is_not_calm_and_searched_for_pushes(pendulum, asked):
    with pytest.raises(InputRefused, match="'run' cannot be calm"):
        run(pendulum, "run", "--calm", "run")
