"""A session is steered from afar, and what was commanded is repeated bit by bit."""

import json
import sqlite3
import subprocess
import time
from contextlib import closing

import numpy as np
import pytest

from live_server import FASTEST, HOSTILE
from remembering import TABLES, numbers
from rille import store
from rille.model import InputRefused
from rille.simulate.run import find_solver


def wait(condition, patience=10.0):
    """Until it holds; the session runs in real time."""
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.005)


def repeat(path, scenario):
    done = subprocess.run([find_solver(), "run", str(path), "--scenario", scenario], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return max(run.id for run in store.list_runs(path))


def test_a_remote_session_replayed_from_its_log_gives_the_same_bytes(live):
    rover = live.client()
    rover.take()
    rover.speed(4.0)
    rover.start()
    for turn in (0.0, 0.2, -0.3, 0.1):
        rover.steer(0.1, turn)
        time.sleep(0.15)
    rover.set("part.linear_velocity", HOSTILE, [0.0, 0.1, 0.0])
    rover.drive("wheel_front_left", 0.4, time=rover.time + 0.5)
    wait(lambda: rover.time > rover.status["time"])
    rover.pause()
    rover.step(137)
    rover.save("half way")
    rover.start()
    time.sleep(0.2)
    rover.stop()
    first, scenario = rover.status["run_id"], rover.status["scenario"]
    rover.load("half way")
    assert rover.status["state"] == "paused"
    rover.start()
    rover.steer(-0.1, 0.5)
    time.sleep(0.2)
    rover.pause()
    second, other = rover.status["run_id"], rover.status["scenario"]
    live.close()
    for mine, name in ((first, scenario), (second, other)):
        a, b = numbers(live.path, mine), numbers(live.path, repeat(live.path, name))
        assert a["body_state"]
        for table in TABLES:
            assert a[table] == b[table], (name, table)


def test_who_steers_and_falls_silent_is_stopped(live):
    """Steering that says how long it lasts ends then, but not where it is said again; what stopped the rover is kept as any command."""
    rover = live.client()
    rover.take()
    rover.start()
    for _ in range(5):
        rover.steer(0.1, lasts=0.6)
        time.sleep(0.2)
        assert any(rover.status["set_values"])
    wait(lambda: not any(rover.status["set_values"]), 3.0)
    rover.steer(0.1)
    time.sleep(0.8)
    assert any(rover.status["set_values"])
    rover.steer(0.2, lasts=0.1)
    rover.drive("wheel_front_left", 0.5)
    wait(lambda: not any(rover.status["set_values"]), 3.0)
    with pytest.raises(InputRefused, match="malformed at 'lasts'"):
        rover.steer(0.1, lasts=-1.0)
    rover.pause()
    run, scenario = rover.status["run_id"], rover.status["scenario"]
    live.close()
    a, b = numbers(live.path, run), numbers(live.path, repeat(live.path, scenario))
    assert a["body_state"] == b["body_state"]


def test_what_was_asked_is_in_the_log(live):
    rover, guest = live.client(), live.client("guest")
    rover.take()
    rover.start()
    rover.drive("wheel_rear_left", 0.3)
    with pytest.raises(InputRefused, match="'console' commands, not 'guest'"):
        guest.drive("wheel_rear_left", 9.0)
    run = rover.status["run_id"]
    time.sleep(0.1)  # who leaves lets the rover stand: not in the same step
    live.close()
    log = store.read_command_log(live.path, run)
    assert [json.loads(line.request)["kind"] for line in log] == ["take", "start", "drive", "drive"]
    assert [line.sender for line in log] == ["console"] * 3 + ["guest"]
    mine = [line.sequence for line in log[:3]]
    assert np.diff(mine).tolist() == [1, 1]
    assert [bool(line.refused) for line in log] == [False, False, False, True]
    assert [command.value for command in store.read_scenario(live.path, "live-1").commands if command.value] == [0.3]


def test_late_repeated_and_malformed_requests_are_refused_with_a_sentence(live):
    rover = live.client()
    rover.take()
    rover.step(500)
    with pytest.raises(InputRefused, match=r"is for t = 0\.100 s, and it is 0\.500 s already: too late"):
        rover.steer(0.1, time=0.1)
    with pytest.raises(InputRefused, match="malformed at 'forward'"):
        rover.ask("steer", forward="fast")
    with pytest.raises(InputRefused, match="malformed"):
        rover.ask("explode")
    with pytest.raises(InputRefused, match="malformed at 'surprise'"):
        rover.ask("start", surprise=1)
    with pytest.raises(InputRefused, match="does not have; it has wheel_front_left"):
        rover.drive("wheel_of_fortune", 1.0)
    last = next(rover._numbers)
    rover._numbers = iter([last - 5, last + 100])
    with pytest.raises(InputRefused, match=r"is late: number [0-9]+ was given already"):
        rover.pause()
    rover.pause()


def test_a_request_for_later_acts_at_its_time(live):
    rover = live.client()
    rover.take()
    rover.drive("wheel_front_left", 0.5, time=0.25)
    rover.step(400)
    live.close()
    (command,) = [c for c in store.read_scenario(live.path, "live-1").commands if c.value]  # who leaves lets the rover stand
    assert (command.time, command.value) == (pytest.approx(0.25, abs=1e-12), 0.5)


def test_the_rover_is_placed_before_the_first_step_and_unused_runs_leave_nothing(live):
    rover = live.client()
    rover.take()
    rover.place(0.7, -0.4, 0.6)
    x, y, _ = rover.read("part.position", HOSTILE)
    assert (x, y) == pytest.approx((0.7, -0.4), abs=0.02)  # it settles after it was placed
    w, _, _, z = rover.read("part.orientation", HOSTILE)
    assert 2 * np.arctan2(z, w) == pytest.approx(0.6, abs=0.02)
    with pytest.raises(InputRefused, match="terrain"):
        rover.place(1e5, 0.0)
    assert rover.read("part.position", HOSTILE)[0] == pytest.approx(0.7, abs=0.02)
    rover.step(10)
    with pytest.raises(InputRefused, match="before the first step only"):
        rover.place(0.0, 0.0)
    rover.reset()
    assert rover.status["time"] == 0.0
    live.close()
    assert len(store.list_runs(live.path)) == 1  # the one that took steps


def test_the_command_is_handed_over_and_free_when_its_holder_leaves(live):
    one, two = live.client("one"), live.client("two")
    one.take()
    with pytest.raises(InputRefused, match="'one' commands"):
        two.take()
    wait(lambda: one.status["asked_by"] == "two")
    one.hand_over("two")
    two.start()
    two.steer(0.2)
    wait(lambda: two.time > 0.2)
    two.close()
    wait(lambda: one.status["commander"] is None)
    one.take()
    one.pause()
    live.close()
    last = {c.drive: c.value for c in store.read_scenario(live.path, "live-1").commands}
    assert set(last.values()) == {0.0}  # who leaves lets the rover stand


def test_physics_ends_a_run_with_its_sentence_and_the_session_goes_on(live):
    rover = live.client()
    rover.take()
    rover.set("part.position", HOSTILE, [0.0, 0.0, -0.5])  # under the ground
    rover.start()
    wait(lambda: rover.status["state"] == "ended")
    assert rover.status["outcome"] in ("wheel_buried", "diverged")
    assert rover.status["message"]
    with pytest.raises(InputRefused, match="the run has ended"):
        rover.start()
    rover.release()  # who commands is no matter of the run
    assert rover.status["commander"] is None
    rover.take()
    run, scenario = rover.status["run_id"], rover.status["scenario"]
    rover.reset()
    rover.step(10)
    live.close()
    again = subprocess.run([find_solver(), "run", str(live.path), "--scenario", scenario], capture_output=True, text=True, timeout=60)
    assert again.returncode == 4  # ends as the session did
    a, b = numbers(live.path, run), numbers(live.path, max(r.id for r in store.list_runs(live.path)))
    for table in TABLES:
        assert a[table] == b[table], table


def test_a_state_is_loaded_only_into_the_world_that_it_was_saved_in(live):
    """A soil that no ground has changes nothing; another mass does."""
    rover = live.client()
    rover.take()
    rover.step(5)
    rover.save("a")
    with closing(sqlite3.connect(live.path)) as connection, connection:
        connection.executescript(
            "CREATE TEMP TABLE another AS SELECT * FROM soil LIMIT 1; UPDATE another SET id = 999, name = 'another';"
            "INSERT INTO soil SELECT * FROM another;"
        )
    rover.load("a")
    rover.step(5)
    with closing(sqlite3.connect(live.path)) as connection, connection:
        connection.execute("UPDATE body SET mass = 1.01 * mass WHERE id = (SELECT min(id) FROM body)")
    before = rover.status["run_id"]
    with pytest.raises(InputRefused, match="changed since state 'a' was saved"):
        rover.load("a")
    rover.step(5)
    assert rover.status["run_id"] == before


def test_a_state_that_cannot_be_loaded_costs_nothing(live):
    """The refusal is told, the run goes on, and so does the session."""
    rover = live.client()
    rover.take()
    rover.step(5)
    rover.save("a")
    with closing(sqlite3.connect(live.path)) as connection:
        connection.execute("UPDATE saved_state SET data = substr(data, 1, 40)")
        connection.commit()
    before = rover.status["run_id"]
    with pytest.raises(InputRefused, match=r"damaged"):
        rover.load("a")
    rover.step(5)
    assert rover.status["run_id"] == before
    assert rover.status["time"] == pytest.approx(0.01)


def test_others_can_write_while_nothing_goes_on(live):
    rover = live.client()
    rover.take()
    rover.step(5)
    rover.drive("wheel_front_left", 0.5)
    time.sleep(0.1)
    with closing(sqlite3.connect(live.path, timeout=0)) as other:
        other.execute("BEGIN IMMEDIATE")  # as another `rille run` does; and what was asked is there already
        assert other.execute("SELECT count(*) FROM command_log WHERE request LIKE '%wheel_front_left%'").fetchone() == (1,)
        other.execute("ROLLBACK")


def test_a_database_that_is_held_refuses_and_ends_nothing(live):
    rover = live.client()
    rover.take()
    rover.step(5)
    time.sleep(0.1)
    with closing(sqlite3.connect(live.path, timeout=0)) as other:
        other.execute("BEGIN IMMEDIATE")
        began = time.monotonic()
        with pytest.raises(InputRefused, match=r"could not be read or written|no answer"):
            rover.drive("wheel_front_left", 0.5)
        assert rover.layout()  # the server answers others meanwhile and afterwards
        assert time.monotonic() - began < 15
        other.execute("ROLLBACK")
    wait(lambda: _goes(rover))
    assert rover.status["state"] == "paused"


def _goes(rover):
    try:
        rover.drive("wheel_front_left", 0.25)
    except InputRefused:
        return False
    return True


def test_a_session_that_fails_answers_everybody(live, monkeypatch):
    rover = live.client()
    rover.take()

    def broken(*_):
        raise RuntimeError("a wire is loose")

    monkeypatch.setattr(live.session._acting, "advance", broken)
    rover.start()
    wait(lambda: rover.status["outcome"] == "failed")
    assert "a wire is loose" in rover.status["message"]
    with pytest.raises(InputRefused, match="a wire is loose"):
        rover.pause()
    with pytest.raises(InputRefused):
        rover.read("part.position", HOSTILE)
    with pytest.raises(RuntimeError, match="a wire is loose"):
        live.session.close()
    live.session._failed = None


def test_what_was_asked_for_later_ends_with_the_command_and_with_the_run(live):
    one, two = live.client("one"), live.client("two")
    one.take()
    one.drive("wheel_front_left", 0.5, time=0.2)
    one.hand_over("two")
    two.drive("wheel_rear_left", 0.5, time=0.9)
    two.step(300)
    two.stop()
    run = two.status["run_id"]
    live.close()
    log = store.read_command_log(live.path, run)
    assert not [c for c in store.read_scenario(live.path, "live-1").commands if c.value]
    refused = {json.loads(line.request).get("drive"): line.refused for line in log if line.refused}
    assert "'two' commands, not 'one'" in refused["wheel_front_left"]
    assert "the run ended before t = 0.900 s" in refused["wheel_rear_left"]
    assert "stop" in [json.loads(line.request)["kind"] for line in log]


def test_nobody_speaks_in_the_name_of_another(live):
    rover, thief = live.client(), live.client("thief")
    rover.take()
    thief.sender = "console"
    with pytest.raises(InputRefused, match="this connection is 'thief', not 'console'"):
        thief.steer(1.0)
    rover.step(1)  # and has not used up its numbers
    with pytest.raises(InputRefused, match="'ghost' is not here"):
        rover.hand_over("ghost")


def test_a_client_comes_again_under_its_name(live):
    first = live.client()
    first.take()
    first.step(2)
    first.close()
    second = live.client()
    wait(lambda: second.status["commander"] is None)
    second.take()
    second.step(2)


def test_a_client_may_ask_while_it_is_told_of_an_event(live):
    told = []
    rover = live.client(on_event=lambda event: told.append((event["event"], rover.read("part.position", HOSTILE))))
    guest = live.client("guest")
    guest.take()
    guest.close()  # an event: the commander left
    wait(lambda: told)
    rover.take()
    assert told[0][0] == "commander_left"


def test_a_command_beyond_what_its_drive_can_do_is_told_once(live):
    rover = live.client()
    rover.take()
    name = "wheel_front_left"
    for value in (FASTEST, 1.2 * FASTEST, 1.3 * FASTEST, 0.5, -1.2 * FASTEST):
        rover.drive(name, value)
    rover.drive("wheel_rear_left", 1.2 * FASTEST)  # it has no bound

    def told():
        return [event["message"] for event in rover.events if event["event"] == "beyond_reach"]

    wait(lambda: len(told()) == 2)
    assert told()[0] == f"drive '{name}' is commanded 24 rad/s at 0 s, beyond its max_speed, 20 rad/s; it does no more than that"
    assert "-24 rad/s" in told()[1]


def test_time_passes_as_fast_whoever_asks(live):
    """A thousand questions a second do not drive the simulation faster than its pace."""
    rover = live.client()
    rover.take()
    rover.speed(0.1)
    rover.start()
    began, wall = rover.time, time.monotonic()
    while time.monotonic() - wall < 1.0:
        for answer in [live.session.call(lambda simulation: simulation.time) for _ in range(200)]:
            answer.result(10)
    rover.pause()
    assert rover.status["time"] - began < 0.1 * (time.monotonic() - wall) + 0.05


def test_a_place_where_the_rover_cannot_stand_is_refused_and_the_old_one_kept(live, monkeypatch):
    rover = live.client()
    rover.take()
    rover.place(0.5, 0.0)
    acting = live.session._acting
    begin, asked = type(acting).open, []

    def sinks(self, opened):
        begin(self, opened)
        asked.append(opened)
        if len(asked) == 1:
            self._end("wheel_buried")

    monkeypatch.setattr(type(acting), "open", sinks)
    with pytest.raises(InputRefused, match=r"cannot stand at x = 1\.000 m"):
        rover.place(1.0, 0.0)
    assert rover.status["state"] in ("ready", "paused")
    assert rover.read("part.position", HOSTILE)[0] == pytest.approx(0.5, abs=0.02)
    rover.step(3)
