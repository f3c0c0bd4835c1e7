"""Hooks are called at the same steps whenever the same run is made; one that fails is told with its line and loses nothing."""

import json
import sqlite3
from contextlib import closing
from dataclasses import replace

import pytest

from command import assert_refused, rille
from effect_rigs import EARTH
from machines import cart, plane
from remembering import TABLES, numbers
from rille import live, simulate, store
from rille.live import hooks
from rille.model import Command, InputRefused, JointLimit, Scenario, Watch

HOOKS = """
from rille.live import at, every, on_event, when

seen = []

@at(0.5)
def faster(run):
    run.steer(0.2)

@every(0.25)
def count(run):
    seen.append(run.time)

@when(lambda run: run.read("part.position", "chassis")[0] > 0.15, hold=0.1)
def far(run):
    run.say(f"far at {run.time:.3f}, counted {len(seen)}")
    run.drive("wheel_front_left", 0.0)
    run.set("part.linear_velocity", "chassis", [0.0, 0.0, 0.1])

@on_event("settled")
def never(run, event):
    run.say("events before t = 0 are told as well")

@at(1.0)
def broken(run):
    return 1 / 0
"""


@pytest.fixture
def path(make_model):
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=2, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, commands=commands
    )
    return make_model(rover, scenario, plane(0.05))


def test_a_run_with_hooks_is_told_repeated_and_never_lost(path, tmp_path):
    file = tmp_path / "hooks.py"
    file.write_text(HOOKS)
    done = rille("run", path, "--hooks", file, "--json")
    assert done.returncode == 0, done.stderr
    line = HOOKS.splitlines().index("    return 1 / 0") + 1
    assert f"hook 'broken' failed in line {line} of '{file}': ZeroDivisionError" in done.stderr
    assert "far at" in done.stderr
    facts = json.loads(done.stdout)
    assert (facts["status"], facts["scenario"], facts["time_reached"]) == ("done", "s-hooks-1", 2.0)
    again = rille("run", path, "--hooks", file, "--json")
    other = json.loads(again.stdout)
    plain = json.loads(rille("run", path, "--scenario", "s-hooks-1", "--json").stdout)
    first, second, third = (numbers(path, run["run_id"]) for run in (facts, other, plain))
    for table in TABLES:
        assert first[table] == second[table] == third[table], table
    assert store.read_scenario(path, "s-hooks-1").changes
    assert not store.read_scenario(path).changes  # the original is as it was, and is meant where no name is given
    assert store.read_scenario(path).name == "s"


def test_a_hook_ends_the_run(path, tmp_path):
    file = tmp_path / "hooks.py"
    file.write_text("from rille.live import at\n\n@at(0.7)\ndef enough(run):\n    run.stop('seen enough')\n")
    done = rille("run", path, "--hooks", file, "--json")
    facts = json.loads(done.stdout)
    assert done.returncode == 0
    assert (facts["status"], facts["message"]) == ("stopped", "seen enough")
    assert facts["time_reached"] == pytest.approx(0.7, abs=1e-9)
    assert json.loads(rille("run", path, "--scenario", "s-hooks-1", "--json").stdout)["time_reached"] == pytest.approx(0.7, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1\n", ["has no hooks"]),
        ("def f(:\n", ["is no Python in line 1"]),
        ("\nraise ValueError('no')\n", ["failed in line 2", "ValueError: no"]),
        ("from rille.live import at\n@at(-1)\ndef f(run): ...\n", ["at is -1 s"]),
    ],
)
def test_a_file_that_is_no_good_is_refused_before_anything_runs(path, tmp_path, text, words):
    file = tmp_path / "hooks.py"
    file.write_text(text)
    assert_refused(rille("run", path, "--hooks", file), *words)
    assert store.list_runs(path) == []


def test_hooks_do_not_resume(path, tmp_path):
    assert_refused(rille("run", path, "--hooks", tmp_path / "none.py", "--resume"), "--resume")
    assert_refused(rille("run", path, "--hooks", tmp_path / "none.py"), "no file")


def test_events_come_at_the_step_at_which_they_happen(make_model, tmp_path):
    """A joint that runs into its limit: the hook sees the time of the event itself, not of some later look."""
    from machines import chain

    rover = chain([1.0], [1.0])
    joint = replace(rover.joints[0], limit=JointLimit(lower=-0.5, upper=0.5))
    scenario = Scenario(name="s", duration=2, gravity=(0, 0, -EARTH))
    path = make_model(replace(rover, joints=(joint,)), scenario)
    run = simulate.steered_run(path, "s")
    seen = []
    file = tmp_path / "h.py"
    file.write_text(
        "from rille.live import on_event\n\n@on_event('limit_reached')\ndef hit(run, event):\n    run.say((event.time, run.time))\n"
    )
    hooks = live.read_hooks(file, 1e-3, pytest.fail)
    run.begin()
    run.change("joint.velocity", joint.name, [2.0])
    assert hooks.advance(run, 1000, live.Steering(run=run, wheels=(), say=seen.append)) == "running"
    assert seen
    event, called = seen[0]
    assert called == pytest.approx(event, abs=1.001e-3)


def test_a_condition_that_raises_is_a_hook_that_failed(path, tmp_path):
    file = tmp_path / "h.py"
    file.write_text("from rille.live import when\n\n@when(lambda run: run.read('no.quantity', 'x'))\ndef f(run): ...\n")
    said = []
    run = simulate.steered_run(path, "s")
    run.begin()
    hooks = live.read_hooks(file, 1e-3, said.append)
    hooks.advance(run, 100, live.Steering(run=run, wheels=(), say=said.append))
    assert len(said) == 1
    assert "line 3" in said[0]
    assert "no quantity known here" in said[0]
    assert issubclass(InputRefused, ValueError)


def hooks_of(tmp_path, text, said):
    file = tmp_path / "h.py"
    file.write_text("from rille.live import at, every, on_event, when\n" + text)
    return live.read_hooks(file, 1e-3, said.append)


def test_a_hook_that_would_end_the_program_does_not(path, tmp_path):
    said = []
    run = simulate.steered_run(path, "s")
    run.begin()
    hooks = hooks_of(tmp_path, "import sys\n@at(0.01)\ndef f(run): sys.exit(3)\n", said)
    assert hooks.advance(run, 100, live.Steering(run=run, wheels=(), say=said.append)) == "running"
    assert "SystemExit: 3" in said[0]
    (tmp_path / "e.py").write_text("import sys\nsys.exit()\n")
    with pytest.raises(InputRefused, match="failed in line 2"):
        live.read_hooks(tmp_path / "e.py", 1e-3, said.append)


def test_what_a_saved_run_did_is_not_done_again(path, tmp_path):
    """A run that goes on from 0.3 s: what was at 0.2 s is over, what is at 0.4 s is to come."""
    said = []
    run = simulate.steered_run(path, "s")
    run.begin()
    hooks = hooks_of(tmp_path, "@at(0.2)\ndef early(run): run.say('early')\n@at(0.4)\ndef late(run): run.say('late')\n", said)
    hooks.begin(0.3)
    run.advance(300)
    hooks.advance(run, 200, live.Steering(run=run, wheels=(), say=said.append))
    assert said == ["late"]


@pytest.mark.parametrize("step", [1e-3, 4e-3, 2e-2])
def test_a_condition_holds_for_its_time_whatever_the_step(make_model, tmp_path, step):
    """It holds from the start; 0.1 s after the first look the hook is called, give or take a look."""
    rover = cart(5.0, 0.15, 0.165)
    scenario = Scenario(name="s", duration=2, step=step, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=0)
    path = make_model(rover, scenario, plane(0.05))
    said = []
    run = simulate.steered_run(path, "s", step=step)
    run.begin()
    file = tmp_path / "h.py"
    file.write_text("from rille.live import when\n@when(lambda run: True, hold=0.1)\ndef f(run): run.say(run.time)\n")
    hooks = live.read_hooks(file, step, said.append)
    hooks.advance(run, round(0.5 / step), live.Steering(run=run, wheels=(), say=said.append))
    look = max(1, round(0.01 / step)) * step
    assert said == [pytest.approx(0.1 + look, abs=look + 1e-9)]


def test_a_state_set_before_another_that_is_planned_keeps_both(make_model, tmp_path):
    """The planned one has four numbers, the other one: the scenario holds each whole, and repeats the run."""
    from rille.model import StateChange

    rover = cart(5.0, 0.15, 0.165)
    turn = StateChange(time=0.5, quantity="part.orientation", target=rover.bodies[0].name, values=(1.0, 0.0, 0.0, 0.0))
    scenario = Scenario(
        name="s", duration=1, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, changes=(turn,)
    )
    path = make_model(rover, scenario, plane(0.05))
    file = tmp_path / "h.py"
    joint = rover.joints[0].name
    file.write_text(f"from rille.live import at\n@at(0.1)\ndef f(run): run.set('joint.velocity', '{joint}', [0.5])\n")
    first = rille("run", path, "--hooks", file, "--json")
    assert first.returncode == 0, first.stderr
    changes = store.read_scenario(path, "s-hooks-1").changes
    assert [(c.quantity, len(c.values)) for c in changes] == [("joint.velocity", 1), ("part.orientation", 4)]
    again = rille("run", path, "--scenario", "s-hooks-1", "--json")
    assert again.returncode == 0, again.stderr
    a, b = (numbers(path, json.loads(done.stdout)["run_id"]) for done in (first, again))
    assert a["body_state"] == b["body_state"]


def test_an_event_that_never_happens_is_refused(path, tmp_path):
    file = tmp_path / "h.py"
    file.write_text("from rille.live import on_event\n\n@on_event('wheel_spining')\ndef hit(run, event):\n    pass\n")
    with pytest.raises(InputRefused, match="there is no event 'wheel_spining'; did you mean 'wheel_spinning'"):
        live.read_hooks(file, 0.001, print)


def test_what_no_drive_can_follow_is_told(path, tmp_path):
    """Commands of hooks, too, after the run that they steered."""
    rover = store.read_rover(path)
    file = tmp_path / "h.py"
    file.write_text(f"from rille.live import at\n\n@at(0.1)\ndef go(run):\n    run.drive('{rover.drives[0].name}', 1000.0)\n")
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE drive SET max_speed = 3")
    done = rille("run", path, "--hooks", file, "--duration", "0.2")
    assert done.returncode == 0, done.stderr
    assert "is commanded 1000 rad/s at 0.1 s, beyond its max_speed, 3 rad/s" in done.stderr


def test_hooks_know_the_events_that_watches_know(path):
    """The solver names them where a watch waits for none of them."""
    store.write_scenario(
        path, Scenario(name="w", duration=0.1, gravity=(0, 0, -EARTH), watches=(Watch(name="w", event="never", action="stop"),))
    )
    with pytest.raises(InputRefused, match="which never happens; known: ") as refused:
        simulate.run(path, scenario="w")
    known = str(refused.value).partition("known: ")[2].split(", ")
    assert len(known) > 5
    assert set(known) <= set(hooks.EVENTS)
