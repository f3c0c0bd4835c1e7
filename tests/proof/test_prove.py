"""``rille prove`` as a user runs it: made, sealed, answered, opened, scored, verified; stopped and gone on with; tampered with, refused."""

import json
import shutil
import sqlite3
import subprocess
import sys
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from rille import store
from rille.cli import prove_run
from rille.cli.prove import trial as trial_again
from rille.cli.prove_run import ROOMS, TRUTHS, VAULT, make_trial, make_trials, prove
from rille.cli.prove_score import score_ledger
from rille.model import InputRefused
from rille.model.process import SAME_ROUNDING
from rille.proof.seal import files_digest
from rille.proof.strength import Unreachable
from rille.proof.trials import Extent, Trial, plan
from rille.work import opened_pool
from rille.work.pools import LocalPool

RILLE = Path(sys.executable).parent / "rille"
TWO = Extent(counts={"one": 1, "nothing": 1}, machines=("pendulum",))
BEACON = "a test, again"  # conceals a supply that sags, at half the noise: answered fast


def rille(*words):
    """Exit code, stdout and stderr."""
    done = subprocess.run([RILLE, *map(str, words)], capture_output=True, text=True, timeout=300, check=False)
    return done.returncode, done.stdout, done.stderr


def go_on(folder, until=float("inf")):
    """The proof in a folder, as far as time allows."""
    return prove(folder, BEACON, TWO, workers=2, scheduler=None, baselines=True, until=until)


@pytest.fixture(scope="module")
def proof(tmp_path_factory):
    """A finished proof of two trials, which was stopped before the first one and went on."""
    folder = tmp_path_factory.mktemp("proof") / "p"
    assert not go_on(folder, until=0.0)
    assert go_on(folder)
    return folder


def test_every_trial_is_answered_opened_and_scored(proof):
    held = store.read_ledger(proof / "ledger.db")
    assert len(held.trials) == len(held.answers) == len(held.truths) == len(held.scores) == 2
    assert {a.status for a in held.answers} == {"done"}
    assert {json.loads(t.text)["sort"] for t in held.truths} == {"one", "nothing"}
    said = json.loads(held.answers[0].text)
    assert {"diagnosis", "sindy", "gaussian_process", "tuning"} <= set(said)


def test_the_room_holds_nothing_of_the_truth(proof):
    """Only base model, recordings and manifests; no file of it has the name of the law or of the sort of trial."""
    truths = {t.trial: json.loads(t.text) for t in store.read_ledger(proof / "ledger.db").truths}
    for number, truth in truths.items():
        names = {file.name for file in (proof / ROOMS / f"{number:03d}").iterdir()}
        assert names == {"model.db", *(f"{n}.{e}" for n in ("training_1", "training_2", "held_out") for e in ("parquet", "toml"))}
        words = [piece["kind"] for piece in truth["pieces"]]
        manifest = (proof / ROOMS / f"{number:03d}/training_1.toml").read_text()
        assert not [word for word in words if word in manifest]
    assert (proof / VAULT).stat().st_mode & 0o777 == 0o600
    assert not (proof / TRUTHS).exists()


def test_it_verifies_and_the_table_is_made_again(proof, tmp_path):
    code, out, _ = rille("prove", "verify", proof / "ledger.db")
    assert code == 0
    assert "every seal, answer and score holds" in out
    code, out, _ = rille("prove", "table", proof / "ledger.db", "-o", tmp_path)
    assert code == 0
    assert "| one effect |" in out
    numbers = json.loads((tmp_path / "table.json").read_text())
    assert numbers["trials"] == 2
    assert "<html" in (tmp_path / "report.html").read_text()[:200]


def test_scores_are_those_of_a_program_of_its_own(proof, tmp_path):
    """Taken away and scored anew they are the same; what is not opened is not scored."""
    held, path = store.read_ledger(proof / "ledger.db"), tmp_path / "ledger.db"
    store.create_ledger(path, held.plan, held.trials)
    for answer in held.answers:
        store.add_answer(path, answer)
    with pytest.raises(InputRefused, match="not opened"):
        score_ledger(path)
    store.open_truths(path, held.truths)
    score_ledger(path)
    score_ledger(path)
    assert store.read_ledger(path).scores == held.scores


def test_another_root_than_the_announced_one_is_no_proof(proof):
    code, out, _ = rille("prove", "verify", proof / "ledger.db", "--root", "00" * 32)
    assert code == 5
    assert "announced was 0000" in out


def test_an_edited_answer_is_found(proof, tmp_path):
    path = tmp_path / "ledger.db"
    shutil.copy(proof / "ledger.db", path)
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("DROP TRIGGER answer_stays")
        connection.execute("UPDATE answer SET answer = replace(answer, 'nothing_missing', 'named') WHERE answer LIKE '%nothing_missing%'")
        connection.commit()
    code, out, _ = rille("prove", "verify", path)
    assert code == 5
    assert "was edited" in out


def test_a_trial_can_be_made_again_to_look_at(proof, tmp_path):
    held = store.read_ledger(proof / "ledger.db")
    number = next(t.trial for t in held.truths if json.loads(t.text)["sort"] == "nothing")
    folder = tmp_path / "again"
    code, out, _ = rille("prove", "trial", proof / "ledger.db", number, "-o", folder)
    assert code == 0
    assert "nothing at 0 times the noise" in out
    first = (proof / ROOMS / f"{number:03d}/training_1.toml").read_bytes()
    assert (folder / "training_1.toml").read_bytes() == first
    assert json.loads((folder / "truth.json").read_text())["pieces"] == []


def test_a_trial_whose_process_is_killed_is_told_in_a_sentence(proof, tmp_path, monkeypatch):
    """Nothing is left of the folder."""
    killed = Future()
    killed.set_exception(BrokenProcessPool())
    monkeypatch.setattr(LocalPool, "submit", lambda *_: killed)
    with pytest.raises(InputRefused, match="trial 0 could not be made: the worker process died twice"):
        trial_again(proof / "ledger.db", 0, tmp_path / "t")
    assert not (tmp_path / "t").exists()


def test_what_was_made_before_is_made_again_without_a_search(proof, monkeypatch):
    """Draw and size are read from the truth; a truth that the draw does not conceal is refused."""
    held = store.read_ledger(proof / "ledger.db")
    truth = next(json.loads(t.text) for t in held.truths if json.loads(t.text)["sort"] == "one")
    trial = Trial(**{name: truth[name] for name in ("number", "sort", "machine", "strength", "beacon", "draw")})
    monkeypatch.setattr("rille.proof.making.find_size", lambda *_: pytest.fail("a size was looked for"))
    number, _, again = make_trial(replace(trial, draw=0), truth)
    assert (number, again) == (truth["number"], truth)
    with opened_pool(make_trials, 1, None, SAME_ROUNDING) as pool:
        ((_, files, _),) = pool.submit([(trial, truth)]).result().results
    room = proof / ROOMS / f"{number:03d}"
    assert files == {name: (room / name).read_bytes() for name in files}
    with pytest.raises(Unreachable, match="does not conceal"):
        make_trial(trial, {**truth, "pieces": []})


def test_rooms_that_are_gone_are_made_again(proof, tmp_path, monkeypatch):
    """With ledger, vault and plan alone it goes on; files that are not those that were sealed are refused, and nothing is answered."""
    held = store.read_ledger(proof / "ledger.db")
    for name in ("plan.json", VAULT):
        shutil.copy(proof / name, tmp_path)
    store.create_ledger(tmp_path / "ledger.db", held.plan, held.trials)
    store.add_answer(tmp_path / "ledger.db", held.answers[0])
    assert not go_on(tmp_path, until=0.0)
    monkeypatch.setattr(prove_run._Answering, "__call__", lambda _, given: pytest.fail(f"{given} was answered"))
    monkeypatch.setattr("rille.proof.seal.files_digest", lambda room: "other")
    with pytest.raises(InputRefused, match="not those that were sealed"):
        go_on(tmp_path)
    monkeypatch.undo()
    assert go_on(tmp_path)
    room = f"{held.answers[1].trial:03d}"
    assert [file.name for file in (tmp_path / ROOMS).iterdir()] == [room]
    assert files_digest(tmp_path / ROOMS / room) == next(t.recording for t in held.trials if t.number == held.answers[1].trial)
    assert len(store.read_ledger(tmp_path / "ledger.db").scores) == 2


def test_a_trial_of_another_catalogue_is_refused_in_a_sentence(proof, tmp_path):
    """The draw of today does not conceal what the truth says: no traceback."""
    path = tmp_path / "ledger.db"
    shutil.copy(proof / "ledger.db", path)
    number = next(t.trial for t in store.read_ledger(path).truths if json.loads(t.text)["sort"] == "one")
    with closing(sqlite3.connect(path)) as connection:
        for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall():
            connection.execute(f"DROP TRIGGER {name}")
        connection.execute("UPDATE truth SET truth = json_set(truth, '$.pieces[0].kind', 'law_of_old') WHERE trial = ?", (number,))
        connection.commit()
    code, _, err = rille("prove", "trial", path, number, "-o", tmp_path / "t")
    assert code == 3
    assert "another state of rille made it" in err


def test_making_goes_on_from_truths_alone(tmp_path):
    """Stopped while it made trials, and the rooms lost: the truths that are there are not searched for again."""
    nothing = Extent(counts={"nothing": 2}, machines=("pendulum",))
    trials = plan("kept", nothing)
    truths = tmp_path / TRUTHS
    truths.mkdir()
    kept = make_trial(replace(trials[0], draw=3))[2]  # another draw than would be made
    (truths / "000.json").write_text(json.dumps(kept))
    place = prove_run._Place(workers=1, scheduler=None, until=float("inf"))
    assert prove_run._make(place, tmp_path, trials)
    assert json.loads((truths / "000.json").read_text()) == kept
    assert [json.loads((truths / f"{n:03d}.json").read_text())["draw"] for n in (0, 1)] == [3, 0]
    assert {room.name for room in (tmp_path / ROOMS).iterdir()} == {"000", "001"}


def test_a_folder_of_another_beacon_is_refused(proof):
    code, _, err = rille("prove", "--beacon", "another", "--quick", "-o", proof)
    assert code == 3
    assert f"holds the trials of the beacon '{BEACON}'" in err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("prove", "--beacon", " "), "--beacon is empty"),
        (("prove", "--beacon", "b", "--machines", "pendulm", "-o", "x"), "pendulum"),
        (("prove", "verify", "no.db"), "there is no ledger"),
        (("prove", "table", "no.db", "-o", "nowhere"), "there is no ledger"),
    ],
)
def test_wrong_use_is_told(words, says):
    code, _, err = rille(*words)
    assert code == 3
    assert says in err


def test_trials_go_through_a_cluster_as_bytes(tmp_path):
    """A worker of a Dask cluster makes, answers in a room and compares; what comes back is the same kind of ledger."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        one = Extent(counts={"nothing": 1}, machines=("pendulum",))
        folder = tmp_path / "proof"
        address = cluster.scheduler_address
        assert prove(folder, "a cluster", one, workers=1, scheduler=address, baselines=False, until=float("inf"))
    held = store.read_ledger(folder / "ledger.db")
    assert [a.status for a in held.answers] == ["done"]
    assert json.loads(held.scores[0].text)["diagnosis"]["verdict"] == "nothing_missing"
