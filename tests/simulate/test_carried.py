"""Windows of models that remember: run one after the other they go on as the uninterrupted run did, at rest they do not."""

from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation

from effect_rigs import EARTH, rig, rig_model
from machines import cart, chain, free_arm, plane
from rille import simulate
from rille.model import Command, Drive, Effect, InitialJointState, InputRefused, Scenario
from rille.model.recording import Channel, Recording
from rille.simulate import prediction

LENGTH, OVERLAP = 0.2, 0.05  # [s] of windows, and of the run-up that they share with the one before


def angle(joint="hinge2", quantity="joint.position"):
    """An encoder."""
    return Channel(name=joint, quantity=quantity, target=joint, unit="rad")


def arm(make_model, *effects, mode="torque", **drive):
    """Two rods whose first hinge is driven by a command that alternates every 0.13 s."""
    values = {"max_torque": 20.0} | drive
    rover = replace(chain([0.2, 0.3], [0.6, 0.5]), drives=(Drive(name="motor", joint="hinge1", mode=mode, **values),))
    commands = tuple(Command(drive="motor", time=0.13 * k, value=0.4 * (-1) ** k) for k in range(20))
    return make_model(rover, Scenario(name="s", duration=2, step=1e-3, commands=commands), None, effects)


def sloshing(make_model):
    """A free arm whose base holds a swinging mass, pushed once."""
    effects = [
        Effect(kind="payload_slosh", target="base", parameters={"mass": 1.0, "natural_frequency": 9.0}),
        Effect(kind="external_pulse", target="base", parameters={"force_x": 20.0, "torque_z": 1.0, "start": 0.1, "duration": 0.1}),
    ]
    return make_model(free_arm(), Scenario(name="s", duration=2, step=1e-3, gravity=(0, 0, 0)), None, effects)


def digging(make_model):
    """A wheel that stands in the soil and then slips, and digs itself in."""
    rover, commands = rig(slip=0.4)
    scenario = Scenario(
        name="s", duration=10, gravity=(0, 0, -EARTH), terrain="plane", commands=commands,
        initial_states=(InitialJointState(joint="slide", position=-0.003),),
    )  # fmt: skip
    return make_model(rover, scenario, plane(), [DIG])


def in_ruts(make_model):
    """A cart whose rear wheels follow in the ruts of the front ones, which packed the soil."""
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=drive.name, time=0.0, value=8.0) for drive in rover.drives)
    scenario = Scenario(name="s", duration=10, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", commands=commands)
    return make_model(rover, scenario, plane(), [Effect(kind="multipass", parameters={"memory": 1.0})])


LAG = Effect(kind="motor_lag", target="hinge1", parameters={"time_constant": 0.15})
PLAY = Effect(kind="backlash", target="hinge1", parameters={"gap": 0.05, "stiffness": 500.0, "damping": 0.5})
SPRING = Effect(kind="joint_elasticity", target="hinge1", parameters={"compliance": 0.2, "damping": 0.02})
DIG = Effect(kind="sinkage_transient", parameters={"depth": 0.03, "time_constant": 0.7})
MACHINES = {
    "lag": (lambda make: arm(make, LAG), angle()),
    "play": (lambda make: arm(make, PLAY, mode="speed"), angle("hinge1")),
    "elastic": (lambda make: arm(make, SPRING, mode="speed"), angle("hinge1")),
    "integral": (lambda make: arm(make, mode="speed", speed_gain=0.3, integral_gain=4.0), angle("hinge1", "joint.velocity")),
    "slosh": (sloshing, angle("elbow")),
    "ruts": (in_ruts, Channel(name="z", quantity="wheel.sinkage", target="wheel_rear_left", unit="m")),
    "digging": (digging, angle("slide")),
}


def run(path, n_windows=8, gap=0.0, observed=None):
    """States where windows begin, stops, times of samples in each window, and what the uninterrupted run shows there."""
    replayer = simulate.Replayer(path)
    simulation = Simulation(str(path))
    simulation.settle()
    states, stops, windows, times, truth = [], [], [], [], []
    for w in range(n_windows):
        states.append(simulation.state()[0])
        start = states[-1][0]
        stops.append(start + LENGTH)
        kept = simulation.save()
        values = simulation.sample(round(LENGTH / 1e-3), 20, [(observed.quantity, observed.target, 0)])[:, 0]
        truth.append(values)
        windows.append(np.full(len(values), w))
        times.append(start + 0.02 * np.arange(1, len(values) + 1))
        simulation.restore(kept)
        simulation.step(round((LENGTH - OVERLAP + gap) / 1e-3))
    return replayer, np.array(states), np.array(stops), [(np.concatenate(windows), np.concatenate(times))], np.concatenate(truth)


@pytest.mark.parametrize("gap", [0.0, 0.23])
@pytest.mark.parametrize("name", MACHINES)
def test_carried_windows_go_on_as_the_run_did(make_model, name, gap):
    """From the states of the run: its numbers to 1e-7 of their size (solutions of the rows agree to their tolerance); windows that begin at
    rest are off by more than a hundred times that, but for the first one.
    """
    make, observed = MACHINES[name]
    replayer, states, stops, picks, truth = run(make(make_model), gap=gap, observed=observed)
    assert replayer.has_memory
    size = np.ptp(truth)
    found = replayer.predict(states[None], stops, [observed], picks)[0][0]
    assert found == pytest.approx(truth, abs=1e-7 * size)
    resting = prediction.predicted(
        [replayer._driven], [replayer._motions(states)[None]], [False], stops=stops, channels=[observed], picks=picks, step=1e-3, threads=1
    )[0][0, 0]
    assert np.abs(resting - truth).max() > 1e-5 * size


def test_the_same_numbers_in_any_batches_and_threads_and_for_every_variant(make_model, monkeypatch):
    """Variants share what is hidden: one with the motion of the first shows the same. A batch of one window hands its state on."""
    make, observed = MACHINES["play"]
    replayer, states, stops, picks, _ = run(make(make_model), observed=observed)
    moved = states.copy()
    moved[:, 14] += 1e-3
    variants = np.stack([states, moved, states])
    first = replayer.predict(variants, stops, [observed], picks)[0]
    assert (first[0] == first[2]).all()
    assert np.abs(first[1] - first[0]).max() > 1e-4
    monkeypatch.setattr(prediction, "MOST_NUMBERS", 100)
    assert (replayer.predict(variants, stops, [observed], picks)[0] == first).all()
    for threads in (1, 3):
        replayer._threads = threads
        assert (replayer.predict(variants, stops, [observed], picks)[0] == first).all()


def test_a_model_without_memory_shows_the_same_either_way(make_model):
    """Only the first guess of the rows' sides differs: 1e-9 of the size."""
    path = arm(make_model, Effect(kind="coulomb_friction", target="hinge2", parameters={"torque": 0.02}))
    replayer, states, stops, picks, truth = run(path, observed=angle())
    assert not replayer.has_memory
    alone = replayer.predict(states[None], stops, [angle()], picks)[0][0]
    carried = replayer.predict_many([replayer], states, stops, [angle()], picks, carried=True)[0][0]
    assert carried == pytest.approx(alone, abs=1e-9 * np.ptp(truth))


def test_a_sample_at_the_end_of_a_short_last_window_is_shown(make_model):
    """A recording ends where it ends: its last window is shorter than the others, and its last sample stands at the stop."""
    replayer, states, stops, picks, truth = run(arm(make_model, LAG), observed=angle())
    window, time = picks[0]
    kept = (window < 7) | (time <= stops[7] - 0.06 + 1e-9)
    shorter = np.append(stops[:7], stops[7] - 0.06)
    found = replayer.predict(states[None], shorter, [angle()], [(window[kept], time[kept])])[0][0]
    assert found == pytest.approx(truth[kept], abs=1e-7 * np.ptp(truth))


def test_a_window_after_a_run_that_ended_begins_at_rest(make_model):
    """The second window leaves the terrain, the third is sound; the ended one is filled with NaN from there on."""
    path = rig_model(make_model, DIG, slip=0.2)
    replayer, states, stops, picks, _ = run(path, n_windows=4, observed=angle("slide"))
    away = states.copy()
    away[1, 14] = 1e4
    found = replayer.predict(away[None], stops, [angle("slide")], picks)[0][0]
    assert np.isnan(found[picks[0][0] == 1]).all()
    assert np.isfinite(found[picks[0][0] != 1]).all()
    fresh = replayer.predict(states[None, 2:3], stops[2:3], [angle("slide")], [(np.zeros(10, dtype=np.int64), picks[0][1][20:30])])[0][0]
    assert (found[20:30] == fresh).all()


def test_windows_that_do_not_ascend_are_refused(make_model):
    replayer, states, stops, picks, _ = run(arm(make_model, LAG), n_windows=2, observed=angle())
    with pytest.raises(InputRefused, match="must ascend"):
        replayer.predict(states[None, ::-1], stops, [angle()], picks)


def test_a_late_command_reaches_the_window_that_it_acts_in(make_model):
    """Commands are 0.3 s late, longer than the window: those from before it began are what drives it. The run's numbers, to 1e-9."""
    path = arm(make_model, Effect(kind="command_delay", target="hinge1", parameters={"delay": 0.3}))
    replayer, states, stops, picks, truth = run(path, observed=angle())
    assert not replayer.has_memory
    assert replayer.predict(states[None], stops, [angle()], picks)[0][0] == pytest.approx(truth, abs=1e-9)
    number = np.arange(20.0)
    log = Channel(
        name="u", quantity="joint.effort", target="motor", unit="N m", role="command", time=0.13 * number, value=0.4 * (-1.0) ** number
    )
    replayer.drive_by(Recording(name="r", channels=(angle(), log)))
    # The first value of a log holds before it, too: only from 0.3 s on are the commands those of the run.
    late = states[:, 0] > 0.31
    ends = [replayer.advance(state, state[0] + LENGTH)[0][15] for state in states[late]]
    assert ends == pytest.approx(truth.reshape(len(states), -1)[late, -1], abs=1e-9)


def test_grousers_ripple_in_windows(make_model):
    """A law without memory acts in a window as in the run: the ripple is 10 % of the load, the difference to the run below 0.2 %."""
    ripple = Effect(kind="grouser_ripple", parameters={"relative_amplitude": 0.1})
    load = Channel(name="load", quantity="wheel.normal_load", target="wheel", unit="N")
    replayer, states, stops, picks, truth = run(rig_model(make_model, ripple, slip=0.2), observed=load)
    found = replayer.predict(states[None], stops, [load], picks)[0][0]
    assert np.std(truth) > 0.5
    assert found == pytest.approx(truth, rel=2e-3)
