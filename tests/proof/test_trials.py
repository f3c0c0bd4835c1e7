"""Trials of a beacon: the same for everybody, of every sort and strength, and different for another sentence."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from rille import store
from rille.proof.hidden import effect_targets
from rille.proof.machines import MAKERS
from rille.proof.making import generate
from rille.proof.trials import FULL, HELD_OUT, QUICK, SHARES, Drawn, plan


def drawn(trial):
    return Drawn(trial, store.effect_kinds(), [kind for kind in store.effect_kinds() if kind.name == "tether_pull"])


def test_a_beacon_gives_the_same_trials_and_another_one_others():
    assert plan("rille") == plan("rille")
    assert [t.machine for t in plan("rille")] != [t.machine for t in plan("rilles")]
    assert [t.number for t in plan("rille")] == list(range(330))


def test_every_sort_is_there_as_often_as_stated_and_at_every_strength():
    trials = plan("any")
    assert Counter(t.sort for t in trials) == Counter(FULL.counts)
    for sort in set(FULL.counts) - {"nothing"}:
        counts = Counter(t.strength for t in trials if t.sort == sort)
        assert set(counts) == {0.5, 1.0, 2.0, 5.0}
        assert max(counts.values()) - min(counts.values()) <= 1
    assert {t.strength for t in trials if t.sort == "nothing"} == {0.0}


def test_a_part_of_the_trials_is_a_fair_sample():
    """They are answered in random order: of the first hundred, each sort has its share within 4 sigma of a draw without putting back."""
    first = Counter(t.sort for t in plan("fair")[:100])
    for sort, count in FULL.counts.items():
        share = count / 330
        sigma = np.sqrt(100 * share * (1 - share) * (330 - 100) / (330 - 1))
        assert abs(first[sort] - 100 * share) < 4 * sigma


def test_details_are_the_same_for_everybody():
    trials = [t for t in plan("detail", replace(QUICK, machines=tuple(SHARES))) if t.machine != "bench"]
    for trial in trials:
        one, other = drawn(trial), drawn(trial)
        assert one.scenarios == other.scenarios
        assert one.hidden == other.hidden
        assert one.sensors == other.sensors
        assert len(one.hidden) == {"nothing": 0, "two": 2}.get(trial.sort, 1)
        again = drawn(trial.again())
        assert again.scenarios != one.scenarios


def test_either_of_width_and_speed_of_a_bench_changes_alone_and_the_fourth_pair_is_held_out():
    trial = next(t for t in plan("bench") if t.machine == "bench" and t.sort == "nothing")
    one = drawn(trial)
    assert [scenario.name for scenario in one.scenarios] == ["training_1", "training_2", "training_3", HELD_OUT]
    made = {scenario.name: generate(one, scenario, []) for scenario in one.scenarios}
    wheels = {wheel.name: wheel for wheel in one.machine.rover.wheels}
    width = {name: wheels[recording.with_role("observed")[0].target].width for name, recording in made.items()}
    speed = {name: recording.setup["speed"] for name, recording in made.items()}
    assert width["training_1"] == width["training_3"] < width["training_2"] / 1.5
    assert speed["training_1"] == speed["training_2"] < speed["training_3"] / 2
    assert (width[HELD_OUT], speed[HELD_OUT]) == (width["training_2"], speed["training_3"])


@pytest.mark.parametrize("name", MAKERS)
def test_machines_can_be_stored_and_differ(name, tmp_path):
    """A drawn machine is a valid model: the schema's checks (positive masses, triangle inequality of inertia) are the judge."""
    masses = set()
    for seed in range(4):
        machine = MAKERS[name](np.random.default_rng(seed))
        path = tmp_path / f"{seed}.db"
        store.create(path)
        store.write_rover(path, machine.rover)
        if machine.terrain is not None:
            store.write_terrain(path, machine.terrain)
        store.write_effects(path, machine.effects)
        masses.add(round(sum(b.properties.mass for b in machine.rover.bodies), 6) if name != "bench" else machine.rover.wheels[0].radius)
    assert len(masses) == 4


def test_what_needs_a_drive_is_concealed_only_where_one_is():
    machine = MAKERS["pendulum"](np.random.default_rng(0))
    lag = next(kind for kind in store.effect_kinds() if kind.name == "motor_lag")
    friction = next(kind for kind in store.effect_kinds() if kind.name == "coulomb_friction")
    assert effect_targets(machine, lag) == (machine.rover.drives[0].joint,)
    assert effect_targets(machine, friction) == ("shoulder", "elbow")


def test_a_transmission_is_concealed_where_its_rotor_weighs_nothing():
    """The rotor behind a spring or a play has 1e-6 kg m^2: beside the 3.2e-5 of the arm's own motor that would be what is seen of it."""
    machine = MAKERS["arm"](np.random.default_rng(1))
    kinds = {kind.name: kind for kind in store.effect_kinds()}
    assert "motor" in effect_targets(machine, kinds["motor_lag"])
    for name in ("backlash", "joint_elasticity"):
        assert effect_targets(machine, kinds[name]) == ("waist", "shoulder")
