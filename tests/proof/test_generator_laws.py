"""Every law of joints and bodies in the generator against the same law in the solver: two descriptions of one equation.

Compared is what the law changes in every channel of the machine, over 1.5 s of a random maneuver, in units of the sensors' noise. The
solver runs at a tenth of its step, behind a transmission at a fortieth. Where it integrates with rows (drives under speed control,
friction, tethers) its error is of first order in the step; friction sticks exactly there and creeps here (law.STICK_SPEED). Measured: at
most 0.26 % of the change, allowed: 0.5 %.
"""

import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rille import store
from rille.cli.prove_making import write_model
from rille.proof.generator import simulate
from rille.proof.generator.strange_laws import strange_kinds
from rille.proof.hidden import effect_targets, hidden_effect
from rille.proof.machines import MAKERS
from rille.proof.sensors import readings, sampling
from rille.proof.trials import Drawn, Trial
from rille.simulate.recorder import Wanted, record

SHARE = 0.005  # of the change
ROUGH = {"torque_ripple": 0.05}  # accelerations are means of a step there: a ripple of a fast wheel changes within it
STEP, STEPS = 0.1, {"backlash": 0.025, "joint_elasticity": 0.025}  # of the solver's own: behind stiff teeth a step is of first order
SECONDS = 1.5  # of the maneuver
SIZES = {"payload_slosh": 0.02, "motor_saturation": 5.0}  # of what is usual; 0.1 of the others: the catalogue's machines are larger
CASES = [
    (machine, kind)
    for machine in ("pendulum", "arm", "free_body")
    for kind in store.effect_kinds()
    if kind.target in ("joint", "body", "world")
    and kind.family != "expression"
    and effect_targets(MAKERS[machine](np.random.default_rng(0)), kind)
]


@cache
def setting(machine):
    """A machine, its maneuver, what is read of it, and the readings' noise."""
    drawn = Drawn(Trial(number=0, sort="nothing", machine=machine, strength=0.0, beacon="laws"), store.effect_kinds(), ())
    scenario = replace(drawn.scenarios[0], duration=SECONDS)
    asked = readings(drawn.sensors, sampling(drawn.sensors, SECONDS, seed=0))
    return drawn, scenario, asked, [s.noise or s.resolution / np.sqrt(12) for s in drawn.sensors.sensors]


def solved(machine, laws, share):
    """The readings by the solver, at a share of its step."""
    drawn, scenario, asked, _ = setting(machine)
    wanted = [
        Wanted(quantity=r.quantity, target=r.target, components=(r.component,) if r.component else (), frame=r.frame, times=r.times)
        for r in asked
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.db"
        write_model(drawn, path)
        store.write_scenario(path, scenario, replace=True)
        store.write_effects(path, (*drawn.machine.effects, *laws))
        return [v[:, 0] for v in record(path, scenario, store.read_rover(path), wanted, step=share * scenario.step).values]


@cache
def base(machine, share):
    """The readings of generator and solver without the law."""
    drawn, scenario, asked, _ = setting(machine)
    return simulate(drawn.machine, scenario, (), asked), solved(machine, (), share)


def root_mean_square(machine, values):
    """Of all channels together [noise]; turns are taken around the circle."""
    drawn, _, _, scale = setting(machine)
    parts = [
        ((v + np.pi) % (2 * np.pi) - np.pi if s.component in ("roll", "yaw") else v) / k
        for v, k, s in zip(values, scale, drawn.sensors.sensors, strict=True)
    ]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


def laws_of(machine, kind):
    """The law at the last of its targets in a machine."""
    drawn = setting(machine)[0]
    hidden = hidden_effect(drawn.machine, kind, effect_targets(drawn.machine, kind)[-1], np.random.default_rng(1))
    if "start" in hidden.fixed:
        hidden = replace(hidden, fixed={**hidden.fixed, "start": 0.5})
    return hidden.laws(SIZES.get(kind.name, 0.1))


def changes(machine, laws, share):
    """What laws change here, what they change in the solver at a share of its step, and how far these are apart [noise]."""
    drawn, scenario, asked, _ = setting(machine)
    before, its_before = base(machine, share)
    mine = [b - a for a, b in zip(before, simulate(drawn.machine, scenario, laws, asked), strict=True)]
    its = [b - a for a, b in zip(its_before, solved(machine, laws, share), strict=True)]
    return *(root_mean_square(machine, one) for one in (mine, its)), root_mean_square(
        machine, [a - b for a, b in zip(mine, its, strict=True)]
    )


@pytest.mark.parametrize(("machine", "kind"), CASES, ids=lambda one: getattr(one, "name", one))
def test_a_law_does_here_what_it_does_in_the_solver(machine, kind):
    laws = laws_of(machine, kind)
    mine, its, apart = changes(machine, laws, STEPS.get(kind.name, STEP))
    if its == 0.0:
        assert mine == 0.0
        pytest.skip(f"{kind.name} does nothing in this maneuver of the {machine}: the drive is not at its limit")
    assert apart <= ROUGH.get(kind.name, SHARE) * its


@pytest.mark.parametrize("limit", ["motor_saturation", "supply_sag"])
@pytest.mark.parametrize("transmission", ["backlash", "joint_elasticity"])
@pytest.mark.parametrize("machine", ["pendulum", "arm"])
def test_what_limits_a_motor_does_so_behind_a_transmission(machine, transmission, limit):
    kinds = {kind.name: kind for kind in store.effect_kinds()}
    laws = (*laws_of(machine, kinds[transmission]), *laws_of(machine, kinds[limit]))
    both, _, apart = changes(machine, laws, STEPS[transmission])
    alone, _, _ = changes(machine, laws[:1], STEPS[transmission])
    assert both != alone
    assert apart <= SHARE * both


@pytest.mark.parametrize("kind", strange_kinds(), ids=lambda kind: kind.name)
def test_a_strange_law_is_none_of_the_catalogue_and_acts(kind):
    """It moves the machine at its usual size, not at zero, and the catalogue does not know it."""
    assert kind.name not in {known.name for known in store.effect_kinds()}
    machine = "free_body" if kind.target == "body" else "arm"
    trial = Trial(number=1, sort="nothing", machine=machine, strength=0.0, beacon="strange")
    drawn = Drawn(trial, store.effect_kinds(), strange_kinds())
    hidden = hidden_effect(drawn.machine, kind, effect_targets(drawn.machine, kind)[-1], trial.random("hidden"), cause="outside")
    sensors, scenario = drawn.sensors, replace(drawn.scenarios[0], duration=SECONDS)
    asked = readings(sensors, sampling(sensors, scenario.duration, seed=0))
    base, zero, usual = (simulate(drawn.machine, scenario, laws, asked) for laws in ((), hidden.laws(0.0), hidden.laws(1.0)))
    assert max(np.abs(a - b).max() for a, b in zip(base, zero, strict=True)) < 1e-6
    assert max(np.abs(a - b).max() for a, b in zip(base, usual, strict=True)) > 1e-4
