"""Trials of real recordings: what was logged apart is kept apart, and pushes are scored by what was logged."""

import json
from pathlib import Path

import pytest

from rille import store
from rille.cli.prove_run import AGREEMENT, ROOMS, make_trial, prove
from rille.model import InputRefused
from rille.proof.pulses import matched, score_pulses
from rille.proof.real import read_real, real_truth
from rille.proof.scoring import score_answer
from rille.proof.trials import Extent, Trial
from rille.proof.verify import verify

SHEET = """
title = "dry friction"
source = "this test"
model = "model.db"
recordings = ["training_1.toml", "training_2.toml", "held_out.toml"]
ask = ["--held-out", "held_out"]

[[piece]]
kind = "{kind}"
target = "{target}"
"""
PULSES = """
title = "pushes"
source = "this test"
model = "model.db"
recordings = ["a.toml"]

[pulses]
file = "truth.csv"
recording = "run/{n}"
target = "joint"
names = { 1 = "elbow" }
time = "t"
amplitude = "size"
near = "100 ms"
"""


def pulse(time, amplitude, target="elbow", recording="run/1"):
    return {"recording": recording, "target": target, "time": time, "amplitude": amplitude}


def call(time, amplitude, target="elbow", recording="run/1"):
    return {"recording": recording, "target": target, "peak_time": time, "amplitude": amplitude}


def test_a_pulse_is_found_once_at_its_joint_with_its_sign():
    pulses = [pulse(1.0, 0.5), pulse(1.1, 0.5), pulse(3.0, -0.4)]
    calls = [call(1.08, 0.4), call(3.0, 0.4), call(3.02, -0.2), call(3.0, -0.4, target="shoulder"), call(1.0, 0.5, recording="run/2")]
    assert matched(pulses, calls, 0.15) == [(1, 0), (2, 2)]
    score = score_pulses({"pulses": pulses, "near": 0.15}, calls)
    assert (score["right"], score["of"], score["said"]) == (2, 3, 5)
    assert score["time_error"] == pytest.approx(0.02)
    assert score["amplitude_ratio"] == pytest.approx((0.8 + 0.5) / 2)
    assert matched(pulses, calls, 0.01) == []


def test_a_table_of_pulses_is_read_as_the_sheet_says(tmp_path):
    (tmp_path / "pushes.toml").write_text(PULSES)
    (tmp_path / "truth.csv").write_text("n,joint,t,size\n3,1,0.5,-2\n4,2,1.5,1\n")
    truth = real_truth(tmp_path / "pushes.toml", 7)
    assert truth["pulses"] == [pulse(0.5, -2, recording="run/3"), pulse(1.5, 1, target="2", recording="run/4")]
    assert (truth["number"], truth["near"], truth["sort"]) == (7, 0.1, "real")


@pytest.mark.parametrize(
    ("sheet", "table", "says"),
    [
        (PULSES, None, "is not there; set RILLE_DATA"),
        (PULSES, "n,joint,when,size\n1,1,1,1\n", "does not fit"),
        (PULSES, "n,joint,t,size\n1,1,soon,1\n", "does not fit"),
        (PULSES.split("[pulses]")[0], "", "must say what is concealed"),
        (PULSES + '[[piece]]\nkind = "a"\ntarget = "b"\n', "", "must say what is concealed"),
        (PULSES.replace("source", "sorce"), "", "source"),
    ],
)
def test_a_sheet_that_says_no_truth_is_refused(tmp_path, sheet, table, says):
    path = tmp_path / "pushes.toml"
    path.write_text(sheet)
    if table:
        (tmp_path / "truth.csv").write_text(table)
    with pytest.raises(InputRefused, match=says):
        real_truth(path, 0)


@pytest.fixture(scope="module")
def real(tmp_path_factory):
    """Recordings of a machine with one law concealed, as if they were real, with their sheet; and what the law is."""
    folder = tmp_path_factory.mktemp("real")
    _, files, truth = make_trial(Trial(number=0, sort="one", machine="pendulum", strength=5.0, beacon="as if real, once more"))
    for name, content in files.items():
        (folder / name).write_bytes(content)
    (piece,) = truth["pieces"]
    (folder / "friction.toml").write_text(SHEET.format(**piece))
    return folder, piece


def test_the_truth_of_a_real_trial_is_sealed_and_scored(real, tmp_path):
    """Only the database and what is asked lie in the room; the ledger holds and the score counts what was named."""
    folder, piece = real
    output = tmp_path / "proof"
    assert prove(
        output, "real", Extent(counts={}), real=[folder / "friction.toml"], workers=1, scheduler=None, baselines=True, until=float("inf")
    )
    held = store.read_ledger(output / "ledger.db")
    assert {file.name for file in (output / ROOMS / "000").iterdir()} == {"model.db", "ask.json"}
    assert held.plan.counts == {"real": 1}
    assert held.trials[0].machine == "friction"
    assert json.loads(held.truths[0].text)["pieces"] == [{"cause": "effect", "kind": piece["kind"], "target": piece["target"]}]
    assert not list(verify(held, score_answer))
    score = json.loads(held.scores[0].text)["real"]
    assert (score["right"], score["of"], score["status"]) == (1, 1, "done")
    assert set(json.loads(held.answers[0].text)) == {"diagnosis"}  # what baselines need was not asked for
    assert json.loads((output / AGREEMENT).read_text()) == {}  # no machine of the generator takes part


def test_a_model_that_cannot_be_built_is_told(tmp_path):
    from rille.cli.prove_real import make_real_trial

    path = tmp_path / "pushes.toml"
    path.write_text(PULSES)
    (tmp_path / "truth.csv").write_text("n,joint,t,size\n3,1,0.5,-2\n")
    assert read_real(path).pulses is not None
    with pytest.raises(InputRefused, match="cad build"):
        make_real_trial(0, path)


def test_the_sheets_of_the_examples_are_sound():
    """Their truth is read where the real data are."""
    folder = Path(__file__).resolve().parents[2] / "examples/double_pendulum"
    for name in ("pushes_trial.toml", "friction_trial.toml"):
        sheet = read_real(folder / name)
        assert (folder / sheet.model).is_file()
        assert all((folder / one).is_file() for one in sheet.recordings)
