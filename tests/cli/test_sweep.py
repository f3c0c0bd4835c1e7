"""``rille sweep``: what varies does what it says, failures are rows, and neither kill -9 nor a dying worker loses a case."""

import json
import os
import pickle
import signal
import sqlite3
import subprocess
import time
from contextlib import closing
from dataclasses import replace

import numpy as np
import pyarrow.parquet
import pytest

from command import RILLE, assert_refused, rille
from effect_rigs import EARTH
from machines import cart, plane
from rille import __version__, store
from rille.cli.sweep_prepare import prepare
from rille.model import Command, InputRefused, Scenario
from rille.study import read_study_sheet

CASES = 60  # of studies that are broken off: seconds of work


@pytest.fixture
def model(make_model):
    """A cart that is driven 2 s over a plane."""
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=2, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, commands=commands
    )
    return make_model(rover, scenario, plane(0.02))


def sheet(folder, model, samples, low="0 Pa", high="2 kPa", **more):
    """A study of cohesion and of the chassis' mass."""
    path = folder / "study.toml"
    head = {"name": "s", "model": str(model), "scenario": "s", "design": "latin_hypercube", "samples": samples, "seed": 3} | more
    (soil,) = store.read_soils(model) if len(store.read_soils(model)) == 1 else list(store.read_soils(model))[:1]
    name = soil if isinstance(soil, str) else soil.name
    path.write_text(
        "\n".join(f"{key} = {json.dumps(value)}" for key, value in head.items())
        + f'\n[[vary]]\nname = "soil.{name}.cohesion"\nlow = "{low}"\nhigh = "{high}"\n'
        + '[[vary]]\nname = "body.chassis.mass"\nlow = 0.8\nhigh = 1.2\nrelative = true\n'
    )
    return path


def outcomes(study):
    """Every number of a study, by case and name."""
    with closing(sqlite3.connect(study)) as connection:
        return dict((row[:2], row[2]) for row in connection.execute('SELECT "case", name, value FROM outcome'))


def finished(study):
    """How many cases do not wait any more; 0 while another program still makes the file."""
    if not study.exists():
        return 0
    with closing(sqlite3.connect(study)) as connection:
        return connection.execute("""SELECT count(*) FROM "case" WHERE status <> 'waiting'""").fetchone()[0]


def until(what, seconds=60):
    """Whether something becomes true in that time."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if what():
            return True
        time.sleep(0.01)
    return False


def test_a_case_is_a_run_of_the_model_that_was_changed_so(model, tmp_path):
    study = tmp_path / "study.db"
    done = rille("sweep", sheet(tmp_path, model, 4), "-o", study, "--parquet", tmp_path / "s.parquet", "--workers", "2")
    assert done.returncode == 0, done.stderr
    rows = pyarrow.parquet.read_table(tmp_path / "s.parquet").to_pylist()
    assert len(rows) == 4
    from rille._solver import Model, Simulation

    base = Model(str(model), "s")
    for row in rows:
        changed = base.copy()
        (cohesion,) = [key for key in row if key.endswith("cohesion")]
        changed.set(cohesion, row[cohesion])
        changed.set("body.chassis.mass", base.get("body.chassis.mass") * row["body.chassis.mass"])
        run = Simulation(changed)
        run.settle()
        run.step(2000)
        assert row["energy"] == pytest.approx(float(np.nansum(run.joints()[:, 3])), rel=1e-12)
    assert len({row["energy"] for row in rows}) == 4


def test_a_case_that_fails_is_a_row_with_its_reason(model, tmp_path):
    study = tmp_path / "study.db"
    path = sheet(tmp_path, model, 6)
    path.write_text(path.read_text() + '[[vary]]\nname = "start.x"\nlow = "0 m"\nhigh = "40 m"\n')  # the plane ends at 12 m
    done = rille("sweep", path, "-o", study, "--workers", "2")
    assert done.returncode == 0, done.stderr
    with closing(sqlite3.connect(study)) as connection:
        rows = connection.execute('SELECT status, reason FROM "case"').fetchall()
        places = connection.execute("SELECT value FROM setting WHERE name = 'start.x' ORDER BY \"case\"").fetchall()
    assert len(rows) == 6
    for (status, reason), (x,) in zip(rows, places, strict=True):
        assert (status == "done") == (x < 11), (status, reason, x)
        assert status == "done" or "outside terrain" in reason


def test_a_study_that_is_killed_goes_on_and_is_the_same(model, tmp_path):
    """Twice, each time once it has got on."""
    whole, killed = tmp_path / "whole.db", tmp_path / "killed.db"
    path = sheet(tmp_path, model, CASES)
    assert rille("sweep", path, "-o", whole, "--workers", "2").returncode == 0
    begun = 0
    for _ in range(2):
        process = subprocess.Popen(
            [RILLE, "sweep", str(path), "-o", str(killed), "--workers", "2"], stderr=subprocess.DEVNULL, start_new_session=True
        )
        assert until(lambda begun=begun: finished(killed) > begun)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        assert begun < finished(killed) < CASES
        begun = finished(killed)
    before = outcomes(killed)
    done = rille("sweep", path, "-o", killed, "--workers", "2")
    assert done.returncode == 0, done.stderr
    assert f"{begun} of {CASES} cases are done already" in done.stderr
    after = outcomes(killed)
    assert after == outcomes(whole)
    assert before.items() <= after.items()
    assert not [file for file in tmp_path.iterdir() if file.name.startswith(killed.name) and file != killed]  # one file again


def test_another_sheet_does_not_mix_with_what_is_there(model, tmp_path):
    study = tmp_path / "study.db"
    assert rille("sweep", sheet(tmp_path, model, 3), "-o", study, "--workers", "1").returncode == 0
    assert_refused(rille("sweep", sheet(tmp_path, model, 4), "-o", study), "--force")
    assert rille("sweep", sheet(tmp_path, model, 4), "-o", study, "--workers", "1", "--force").returncode == 0
    shown = json.loads(rille("sweep", "show", study, "--json").stdout)
    assert "energy" in json.dumps(shown)


def meddled(model, tmp_path, statement):
    """A finished study of three cases in which somebody has executed a statement: its file and its sheet."""
    study, path = tmp_path / "study.db", sheet(tmp_path, model, 3)
    assert rille("sweep", path, "-o", study, "--workers", "1").returncode == 0
    with closing(sqlite3.connect(study)) as connection:
        connection.execute(statement)
        connection.commit()
    return study, path


def test_a_study_of_another_rille_is_not_gone_on_with(model, tmp_path):
    """Two solvers' numbers do not mix, neither in a file nor on a cluster."""
    study, path = meddled(model, tmp_path, "UPDATE study SET version = '0.0.1'")
    assert_refused(rille("sweep", path, "-o", study, "--workers", "1"), "0.0.1", __version__, "--force")
    assert rille("sweep", path, "-o", study, "--workers", "1", "--force").returncode == 0
    work = prepare(read_study_sheet(path), tmp_path, lambda what, fraction: None).work
    with pytest.raises(InputRefused, match=r"0\.0\.1.*install"):
        replace(work, version="0.0.1")([])
    assert pickle.loads(pickle.dumps(work)).version == __version__


def test_a_damaged_study_is_refused_and_begun_anew_by_force(model, tmp_path):
    study, path = meddled(model, tmp_path, "DELETE FROM study")
    for verb in (("run", path, "-o", study), ("show", study)):
        assert_refused(rille("sweep", *verb), "damaged", "--force")
    assert rille("sweep", path, "-o", study, "--workers", "1", "--force").returncode == 0
    assert finished(study) == 3
    model_before = model.read_bytes()
    assert_refused(rille("sweep", path, "-o", model, "--force"), "no study")
    assert model.read_bytes() == model_before


def test_cases_that_failed_are_run_again_when_that_is_wanted(model, tmp_path):
    """Their worker died of something that is over now."""
    study, path = tmp_path / "study.db", sheet(tmp_path, model, 6)
    assert rille("sweep", path, "-o", study, "--workers", "1").returncode == 0
    whole = outcomes(study)
    with closing(sqlite3.connect(study)) as connection:
        connection.execute("UPDATE \"case\" SET status = 'worker_died', reason = 'no memory' WHERE number IN (1, 4)")
        connection.execute('DELETE FROM outcome WHERE "case" IN (1, 4)')
        connection.commit()
    assert rille("sweep", path, "-o", study, "--workers", "1").returncode == 0
    assert outcomes(study) != whole  # what failed stays so
    again = rille("sweep", path, "-o", study, "--workers", "1", "--retry")
    assert again.returncode == 0, again.stderr
    assert "2 cases that failed wait again" in again.stderr
    assert "4 of 6 cases are done already" in again.stderr
    assert outcomes(study) == whole


@pytest.mark.parametrize("name", ["status", "Case", "reason", "BODY.chassis.mass", "Energy"])
def test_an_outcome_that_is_called_like_a_column_is_refused(model, tmp_path, name):
    path = sheet(tmp_path, model, 3)
    path.write_text(
        path.read_text()
        + f'[[outcome]]\nname = "{name}"\nquantity = "part.position"\ntarget = "chassis"\ncomponent = "x"\nreduce = "max"\n'
    )
    assert_refused(rille("sweep", path, "-o", tmp_path / "s.db"), f"the outcome '{name}'", "have one name")
    assert not (tmp_path / "s.db").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("body.chassis.mass", "body.chasis.mass"), ["chasis", "chassis"]),
        (('design = "latin_hypercube"', 'design = "magic"'), ["design"]),
        (('"2 kPa"', '"2 kg"'), ["2 kg"]),
        (('"2 kPa"', '"-1 Pa"'), ["high"]),
    ],
)
def test_a_sheet_that_makes_no_sense_is_refused(model, tmp_path, change, words):
    path = sheet(tmp_path, model, 3)
    path.write_text(path.read_text().replace(*change))
    assert_refused(rille("sweep", path, "-o", tmp_path / "s.db"), *words)
    assert not (tmp_path / "s.db").exists()


def test_a_cluster_gives_the_same_numbers_and_loses_no_case_with_a_worker(model, tmp_path):
    distributed = pytest.importorskip("distributed", reason="Dask is not installed: pip install 'rille[cluster]'")
    path = sheet(tmp_path, model, CASES)
    here, there = tmp_path / "here.db", tmp_path / "there.db"
    assert rille("sweep", path, "-o", here, "--workers", "2").returncode == 0
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster:
        command = [RILLE, "sweep", str(path), "-o", str(there), "--scheduler", cluster.scheduler_address]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert until(lambda: finished(there) > 0)
        worker = next(iter(cluster.workers.values()))
        os.kill(worker.process.pid, signal.SIGKILL)
        assert finished(there) < CASES  # work was left for it
        _, talk = process.communicate(timeout=120)
    assert process.returncode == 0, talk
    assert outcomes(there) == outcomes(here)
