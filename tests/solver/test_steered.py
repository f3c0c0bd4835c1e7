"""A run that is steered is kept as a scenario, and a run of that scenario gives the same bytes."""

import subprocess
from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Run

from effect_rigs import EARTH, commanded, flywheel, free_space, hub_sensor
from machines import box, cart, chain, free_arm, plane
from remembering import TABLES, make_remembering, numbers
from rille import store
from rille.model import Command, Differential, InputRefused, Joint, JointLimit, LoopClosure, Rover, Scenario, StateChange
from rille.simulate import read_scenario_file
from rille.simulate.run import find_solver
from rille.store.steering import LONGEST


@pytest.fixture
def remembering(tmp_path):
    """A model with everything that has a memory, and the name of an endless scenario of it."""
    path = make_remembering(tmp_path / "model.db")
    base = store.read_scenario(path)
    return path, store.write_steered(path, replace(base, duration=LONGEST), "live")


def repeat(path, scenario):
    """Run the scenario with the program, and return the key of that run."""
    done = subprocess.run([find_solver(), "run", str(path), "--scenario", scenario], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return max(run.id for run in store.list_runs(path))


def steer(run, seed, strokes=40):
    """Commands and changes of state at random moments, some of them before the first step, some at the same moment."""
    chance = np.random.default_rng(seed)
    wheels = [f"wheel_{end}_{side}" for end in ("front", "rear") for side in ("left", "right")]
    for stroke in range(strokes):
        for wheel in wheels:
            if chance.random() < 0.4:
                run.command(wheel, float(chance.uniform(-1, 1.3)))
        if stroke % 9 == 4:
            run.change("part.linear_velocity", "chassis", [float(chance.uniform(-0.1, 0.1)), 0.01, 0.05])
        if stroke % 9 == 7:
            run.change("joint.velocity", "wheel_rear_left", [0.7])
            run.command("wheel_rear_left", 0.3)
        assert run.advance(int(chance.integers(1, 150)), bool(stroke % 2)) == "running"


@pytest.mark.parametrize("outcome", ["done", "interrupted"])
def test_a_run_of_what_was_steered_gives_the_same_bytes(remembering, outcome):
    path, scenario = remembering
    run = Run(str(path), scenario=scenario, endless=True)
    run.begin()
    steer(run, 1)
    taken, mine = run.simulation.time, run.id
    run.finish(outcome)
    assert "--resume" not in run.message  # what was endless is repeated, not resumed
    del run
    other = repeat(path, scenario)
    first, second = numbers(path, mine), numbers(path, other)
    assert first["body_state"]
    for table in TABLES:
        assert first[table] == second[table], table
    assert store.read_scenario(path, scenario).duration == pytest.approx(taken, abs=1e-9)


def test_a_state_that_was_kept_goes_on_as_if_it_had_not_been(remembering):
    """Two ways from one state: what was steered after it is not part of the second; each is repeated bit by bit from t = 0."""
    path, scenario = remembering
    run = Run(str(path), scenario=scenario, endless=True)
    run.begin()
    steer(run, 2, 15)
    run.save("crossroads")
    time = run.simulation.time
    run.change("part.linear_velocity", "chassis", [0.0, 0.0, 0.2])  # at the same moment, and yet after it
    run.command("wheel_front_left", -2.0)
    steer(run, 3, 10)
    run.finish()
    del run
    other = store.write_continued(path, "crossroads", "live")
    run = Run(str(path), scenario=other, endless=True, saved="crossroads")
    assert run.begin() == "running"
    assert run.simulation.time == time
    steer(run, 4, 10)
    ids = (1, run.id)
    run.finish()
    del run
    for mine, name in zip(ids, (scenario, other), strict=True):
        first, second = numbers(path, mine), numbers(path, repeat(path, name))
        for table in TABLES:
            assert first[table] == second[table], (name, table)


def test_what_is_killed_can_be_repeated_as_far_as_it_was_written(remembering):
    path, scenario = remembering
    run = Run(str(path), scenario=scenario, endless=True)
    run.begin()
    steer(run, 5, 10)
    run.save("here")  # commits
    time = run.simulation.time
    del run  # as a program that ends without a word
    killed = store.list_runs(path)[-1]
    assert killed.status == "running"
    first, second = numbers(path, killed.id), numbers(path, repeat(path, scenario))
    assert max(state[0] for state in first["body_state"]) == pytest.approx(time, abs=0.02)
    assert len(first["body_state"]) == len(second["body_state"])
    for table in TABLES:  # ruts, and the last samples of a sensor that is late, are written at the end
        assert set(first[table]) <= set(second[table]), table


def test_a_joint_takes_its_partners_along(make_model):
    """Both arms of a differential move oppositely; nothing else jumps."""
    rover = free_arm()
    names = [joint.name for joint in rover.joints]
    path = make_model(rover, Scenario(name="s", duration=1, gravity=(0, 0, 0)))
    run = Run(str(path), endless=True)
    run.begin()
    run.change("joint.position", names[0], [0.3])
    assert run.simulation.read("joint.position", names[0]) == [pytest.approx(0.3, abs=1e-15)]
    assert run.simulation.read("joint.position", names[1]) == [pytest.approx(0.0, abs=1e-15)]
    root = rover.bodies[0].name
    run.change("part.orientation", root, [np.cos(0.2), 0, 0, np.sin(0.2)])
    run.change("part.position", root, [1.0, 2.0, 3.0])
    assert run.simulation.read("part.position", root) == pytest.approx([1, 2, 3], abs=1e-14)
    assert run.simulation.read("part.orientation", root) == pytest.approx([np.cos(0.2), 0, 0, np.sin(0.2)], abs=1e-14)
    assert run.simulation.read("joint.position", names[0]) == [pytest.approx(0.3, abs=1e-15)]


def test_a_differential_follows(make_model):
    bodies = free_arm().bodies
    joints = tuple(
        Joint(name=name, kind="hinge", parent=bodies[0].name, child=body.name, point=(0, y, 0), axis=(0, 1, 0))
        for name, body, y in zip(("left", "right"), bodies[1:3], (0.3, -0.3), strict=True)
    )
    rover = replace(
        free_arm(),
        bodies=bodies[:3],
        joints=joints,
        drives=(),
        differentials=(Differential(name="d", carrier=bodies[0].name, joint_a="left", joint_b="right"),),
    )
    path = make_model(rover, Scenario(name="s", duration=1, gravity=(0, 0, 0)))
    run = Run(str(path), endless=True)
    run.begin()
    run.change("joint.position", "right", [0.2])
    assert run.simulation.read("joint.position", "left") == [pytest.approx(-0.2, abs=1e-15)]
    run.advance(10)
    assert run.simulation.differential_error < 1e-12


@pytest.mark.parametrize(
    ("quantity", "target", "values", "words"),
    [
        ("joint.position", "nowhere", [0.0], "does not have"),
        ("joint.effort", "hinge1", [0.0], "cannot be set; what can be set are"),
        ("joint.position", "hinge1", [0.0, 1.0], "takes 1 number, not 2"),
        ("joint.position", "hinge1", [float("nan")], "cannot be nan"),
        ("part.position", "link1", [0.0, 0.0, 0.0], "the world holds this model"),
    ],
)
def test_what_cannot_be_set_is_refused_and_nothing_changes(make_model, quantity, target, values, words):
    rover = chain([1.0, 0.5], [1.0, 1.0])
    path = make_model(rover, Scenario(name="s", duration=1))
    run = Run(str(path), endless=True)
    run.begin()
    joints, bodies = [j.name for j in rover.joints], [b.name for b in rover.bodies]
    target = {"hinge1": joints[0], "link1": bodies[0]}.get(target, target)
    before = run.simulation.save()
    with pytest.raises(InputRefused, match=words):
        run.change(quantity, target, values)
    assert run.simulation.save() == before
    with pytest.raises(InputRefused, match="no state was saved"):
        Run(str(path), saved="nothing")


def test_changes_of_a_scenario_are_made_at_their_times(make_model):
    """A pendulum that is lifted at 0.5 s swings from there as one that was released there."""
    rover = chain([1.0], [1.0])
    joint = rover.joints[0].name
    change = StateChange(time=0.5, quantity="joint.position", target=joint, values=(0.7,))
    path = make_model(rover, Scenario(name="s", duration=1.0, changes=(change,), output_interval=0.01))
    assert store.read_scenario(path).changes == (change,)
    run = repeat(path, "s")
    trace = store.read_trace(path, run)
    at = np.searchsorted(trace.time, 0.5 + 1e-9)
    assert np.all(trace.joints[0].position[: at - 1] == 0)
    assert trace.joints[0].position[at] == pytest.approx(0.7, abs=0.01)


def test_a_scenario_file_changes_states(make_model, tmp_path):
    """In any unit of its kind; a joint that does not exist is refused by name, by the sheet and by the solver."""
    sheet = tmp_path / "s.toml"
    text = """
name = "lifted"
duration = "1 s"
[[state_change]]
time = "0.5 s"
quantity = "joint.position"
target = "JOINT"
values = ["30 deg"]
"""
    rover = chain([1.0], [1.0])
    sheet.write_text(text.replace("JOINT", rover.joints[0].name))
    (change,) = read_scenario_file(sheet, rover).changes
    assert change == StateChange(
        time=0.5, quantity="joint.position", target=rover.joints[0].name, values=(pytest.approx(np.pi / 6, abs=1e-15),)
    )
    path = make_model(rover, read_scenario_file(sheet, rover))
    trace = store.read_trace(path, repeat(path, "lifted"))
    assert np.abs(trace.joints[0].position).max() == pytest.approx(
        np.pi / 6, rel=5e-3
    )  # states are stored every 20 ms: it has fallen by then
    with_elbow = replace(read_scenario_file(sheet, rover), changes=(replace(change, target="elbow"),))
    wrong = make_model(rover, with_elbow)
    done = subprocess.run([find_solver(), "run", str(wrong)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 3
    assert "'elbow', which the model does not have" in done.stderr
    sheet.write_text(text.replace("JOINT", "elbow"))
    with pytest.raises(InputRefused, match="'elbow', which the model does not have"):
        read_scenario_file(sheet, rover)
    sheet.write_text(text.replace("JOINT", rover.joints[0].name).replace('"30 deg"', '"30 kg"'))
    with pytest.raises(InputRefused, match="30 kg"):
        read_scenario_file(sheet, rover)


def four_bar():
    """A crank of 0.2 m that the world holds, a coupler, and a rocker of 0.45 m that can go neither far up nor down."""
    a, b, c, d = (0.0, 0.0, 0.0), (0.0, 0.0, 0.2), (0.75, 0.0, 0.45), (0.8, 0.0, 0.0)
    rods = (("crank", a, b), ("coupler", b, c), ("rocker", d, c))
    bodies = tuple(box(name, 1.0, tuple(np.add(one, other) / 2), (0.1, 0.1, 0.1)) for name, one, other in rods)
    places = (("a", None, "crank", a), ("b", "crank", "coupler", b), ("d", None, "rocker", d))
    joints = tuple(Joint(name=n, kind="hinge", parent=parent, child=child, point=at, axis=(0, 1, 0)) for n, parent, child, at in places)
    return Rover(bodies=bodies, joints=joints, loop_closures=(LoopClosure(name="c", body_a="coupler", body_b="rocker", point=c),))


def test_a_joint_that_would_tear_its_loop_stays_where_it_is(make_model):
    """The same bytes as without the request, at once and after a hundred more steps."""
    path = make_model(four_bar(), Scenario(name="s", duration=1, gravity=(0, 0, -EARTH)))
    states = []
    for asked in (False, True):
        run = Run(str(path), endless=True)
        run.begin()
        run.advance(50)
        if asked:
            with pytest.raises(InputRefused, match="its loop would stay open"):
                run.change("joint.position", "d", [3.0])
        states.append(run.simulation.save())
        assert run.advance(100) == "running"
        states.append(run.simulation.save())
        run.finish()
        del run
    assert states[:2] == states[2:]


def test_accounts_go_on_when_a_state_is_changed(make_model):
    """What was done and lost so far stays so, and what the change itself gives or takes is neither: the balance closes as before."""
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=0.8) for d in rover.drives)
    scenario = Scenario(
        name="s", duration=2, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2, commands=commands
    )
    run = Run(str(make_model(rover, scenario, plane())), endless=True)
    run.begin()
    run.advance(1000)
    before = run.simulation.energy_balance()
    assert before["soil_loss"] > 1.0
    run.change("part.linear_velocity", "chassis", [0.3, 0.0, 0.0])
    after = run.simulation.energy_balance()
    assert after["kinetic"] > before["kinetic"] + 0.1
    for account in ("drive_work", "soil_loss", "joint_loss", "external_work", "potential", "residual"):
        assert after[account] == pytest.approx(before[account], abs=1e-9), account
    run.advance(300)
    later = run.simulation.energy_balance()
    assert later["joint_loss"] == pytest.approx(0.0, abs=1e-9)
    assert abs(later["residual"]) < 1e-6 * later["drive_work"]  # what the integration leaves open, as without a change


def test_a_killed_run_lasts_as_long_as_what_it_wrote(make_model):
    """More than 200 outputs within a second, which the recorder commits by itself."""
    path = make_model(flywheel(2.0, "speed"), free_space(duration=2.0, output_interval=0.02))
    name = store.write_steered(path, store.read_scenario(path), "live")
    run = Run(str(path), scenario=name, endless=True)
    run.begin()
    run.advance(4800)
    mine = run.id
    del run  # as a program that is killed
    written = max(state[0] for state in numbers(path, mine)["body_state"])
    assert written >= 3.9
    assert store.read_scenario(path, name).duration == pytest.approx(written, abs=1e-9)


def test_a_saved_state_comes_with_what_happened_since_the_last_output(make_model):
    """Samples and events; saved between two outputs, which are half a second apart."""
    rover = flywheel(2.0, "speed", sensors=(hub_sensor(),))
    rover = replace(rover, joints=(replace(rover.joints[0], limit=JointLimit(lower=-0.2, upper=0.2)),))
    path = make_model(rover, commanded(0.5, duration=4.0, output_interval=0.5))
    name = store.write_steered(path, store.read_scenario(path), "live")
    run = Run(str(path), scenario=name, endless=True)
    run.begin()
    run.advance(700)
    run.save("between")
    run.finish()
    del run
    other = store.write_continued(path, "between", "live")
    run = Run(str(path), scenario=other, endless=True, saved="between")
    run.begin()
    run.advance(300)
    mine = run.id
    run.finish()
    del run
    first, second = numbers(path, mine), numbers(path, repeat(path, other))
    assert any("limit_reached" in line for line in first["event"])
    for table in ("sensor_sample", "event"):
        assert first[table] == second[table], table
