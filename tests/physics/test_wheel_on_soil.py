"""A wheel on soft soil against the golden table of adaptive quadratures (shared/reference/wheel_reference.csv)."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation

from machines import LUNAR_SOIL, cart, plane
from rille.model import Scenario

# The soils behind the golden table, model wong_reece (= bekker_wong): a0 = 0.4, a1 = 0.15 throughout. Shear moduli and exit
# ratios are those that reproduce the table's torques and exit angles.
SOILS = {
    "lunar_sourcebook": LUNAR_SOIL,
    "hit_ding2011": replace(
        LUNAR_SOIL,
        name="hit_ding2011",
        sinkage_exponent=1.10,
        cohesive_modulus=15600.0,
        frictional_modulus=2407400.0,
        cohesion=250.0,
        friction_angle=np.radians(31.9),
        shear_modulus=0.011,
    ),
    "ishigami_fjs1": replace(
        LUNAR_SOIL,
        name="ishigami_fjs1",
        cohesive_modulus=1370.0,
        frictional_modulus=814000.0,
        cohesion=800.0,
        friction_angle=np.radians(37.2),
        shear_modulus=0.036,
        exit_sinkage_ratio=0.9,
    ),
    "ishigami2005_wheelA": replace(
        LUNAR_SOIL,
        name="ishigami2005_wheelA",
        cohesive_modulus=1370.0,
        frictional_modulus=814000.0,
        cohesion=800.0,
        friction_angle=np.radians(37.2),
        shear_modulus=0.0185,
        exit_sinkage_ratio=0.2,
    ),
}


@pytest.mark.parametrize("law", ["bekker", "bekker_wong", "reece"])
@pytest.mark.parametrize("soil", SOILS)
@pytest.mark.parametrize("load_kg", ["3", "20"])
def test_a_wheel_at_rest_sinks_to_the_static_sinkage(make_model, rille_data, law, soil, load_kg):
    """Every wheel of a standing cart sinks as deep as the table says at zero slip.

    The cart settles until nothing moves faster than 0.1 mm/s and then stands for 2 s, some 40 time constants of the damped soil;
    what remains is the quadrature: 1e-8 relative at n = 1 and 1e-7 otherwise, so 1e-6 is asked for.
    """
    wanted = (soil, "wong_reece" if law == "bekker_wong" else law, load_kg, 0.0)
    with (rille_data / "reference/wheel_reference.csv").open() as file:
        row = next(r for r in csv.DictReader(file) if (r["soil"], r["model"], r["load_kg"], float(r["slip"])) == wanted)
    scenario = Scenario(name="rest", duration=2, step=1e-3, terrain="plane", placement="on_terrain", settle_time=10.0)
    rover = cart(float(load_kg), float(row["r_m"]), float(row["b_m"]))
    simulation = Simulation(str(make_model(rover, scenario, plane(soil=SOILS[soil], law=law))))
    assert simulation.settle() == "running"
    assert simulation.step(2000) == "running"
    wheels = simulation.wheels()
    assert wheels[:, 7] == pytest.approx(np.full(4, float(row["load_N"])), rel=1e-6)
    assert 1e3 * wheels[:, 6] == pytest.approx(np.full(4, float(row["sinkage_mm"])), rel=1e-6)


def test_a_driven_wheel_obeys_the_golden_table_at_its_own_slip(make_model, rille_data):
    """A cart driving steadily on the flat: torque and drawbar pull of its wheels, interpolated in the table at their slip.

    Drawbar pull is zero in sum (nothing else pulls), so the slip at which the table's pull vanishes must be the cart's. The table
    has ten slips; a quadratic through three neighbours errs by about 1 % of the torque there.
    """
    from rille.model import Command

    with (rille_data / "reference/wheel_reference.csv").open() as file:
        rows = [r for r in csv.DictReader(file) if (r["soil"], r["model"], r["load_kg"]) == ("lunar_sourcebook", "wong_reece", "5")]
    rover = cart(5.0, 0.15, 0.165)
    commands = tuple(Command(drive=d.name, time=0.0, value=0.5) for d in rover.drives)
    scenario = Scenario(name="drive", duration=10, step=1e-3, terrain="plane", placement="on_terrain", settle_time=10.0, commands=commands)
    simulation = Simulation(str(make_model(rover, scenario, plane())))
    simulation.settle()
    assert simulation.step(10000) == "running"
    wheels = simulation.wheels().mean(axis=0)
    slip, pull, torque = (np.array([float(r[k]) for r in rows]) for k in ("slip", "DP_N", "T_Nm"))
    near = slice(1, 5)  # slips 0.05 to 0.3 around the zero of the pull
    expected_slip = np.polynomial.Polynomial.fit(pull[near], slip[near], 3)(0.0)
    expected_torque = np.polynomial.Polynomial.fit(slip[near], torque[near], 3)(expected_slip)
    assert abs(wheels[8]) < 1e-3 * wheels[7]
    assert wheels[4] == pytest.approx(expected_slip, rel=0.01)
    assert wheels[10] == pytest.approx(expected_torque, rel=0.01)
