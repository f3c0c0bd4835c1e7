"""The three wheel-soil laws against the golden table, and against an independent adaptive quadrature over random soils and slips."""

import csv
from dataclasses import asdict, replace

import numpy as np
import pytest
from reference import forces
from rille._solver import wheel_under_load
from scipy.optimize import brentq
from test_wheel_on_soil import SOILS

from machines import LUNAR_SOIL
from rille.model import InputRefused

PSI = 6894.757293168361  # [Pa] pound-force per square inch, the unit of the paper
# Wong & Reece 1967, table 1, in Reece's form p = (k1 + k2 b)(z/b)^n: c kc' = k1, gamma kphi' = k2.
UNIT_WEIGHT = 15000.0  # [N/m^3] any value: only its product with kphi' counts here


def reece_soil(name, n, k1, k2, cohesion, friction, a0):
    """A soil with Reece moduli."""
    return replace(
        LUNAR_SOIL,
        name=name,
        sinkage_exponent=n,
        reece_cohesive_modulus=k1 / cohesion,
        reece_frictional_modulus=k2 / UNIT_WEIGHT,
        cohesion=cohesion,
        friction_angle=np.radians(friction),
        shear_modulus=0.0381,
        peak_angle_offset=a0,
        peak_angle_slip=0.32,
    )


REECE_SOILS = {
    "wr_compact_sand": reece_soil("wr_compact_sand", 0.47, 20 * PSI, 2.5 * PSI / 0.0254, 0.1 * PSI, 33.3, 0.43),
    "wr_loose_sand": reece_soil("wr_loose_sand", 1.15, 0.0, 2.0 * PSI / 0.0254, 0.12 * PSI, 31.1, 0.18),
}
LAWS = {"bekker": "bekker", "wong_reece": "bekker_wong", "reece": "reece"}  # the table's name: ours


def test_every_row_of_the_golden_table(rille_data):
    """560 rows of adaptive quadrature at 1e-12.

    The rule of 8 + 8 points reaches 1e-8 in sinkage and 1e-7 of the load in drawbar pull where the stress is straight at the ends of the
    contact (n = 1), and 1e-6 where it has a root there. The table prints ten digits.
    """
    with (rille_data / "reference/wheel_reference.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 560
    worst = {"n = 1": 0.0, "other": 0.0}
    for row in rows:
        soil = (SOILS | REECE_SOILS)[row["soil"]]
        load = float(row["load_N"])
        values = asdict(soil) | {"unit_weight": UNIT_WEIGHT}
        got = wheel_under_load(LAWS[row["model"]], values, float(row["r_m"]), float(row["b_m"]), load, float(row["slip"]))
        straight = soil.sinkage_exponent == 1
        sinkage = abs(got["sinkage"] / (1e-3 * float(row["sinkage_mm"])) - 1)
        pull = abs(got["drawbar_pull"] - float(row["DP_N"])) / load
        torque = abs(got["drive_torque"] / float(row["T_Nm"]) - 1)
        key = "n = 1" if straight else "other"
        worst[key] = max(worst[key], sinkage)
        assert sinkage < (1e-8 if straight else 1e-6), row
        assert pull < (1e-7 if straight else 1e-6), row
        assert torque < (1e-7 if straight else 1e-6), row
    print(f"worst relative error of sinkage: {worst}")


def random_soil(random):
    """Any soil that table `soil` allows in practice."""
    return replace(
        LUNAR_SOIL,
        sinkage_exponent=random.uniform(0.4, 2.5),
        cohesive_modulus=random.uniform(0, 5e4),
        frictional_modulus=10 ** random.uniform(5, 6.7),
        cohesion=random.uniform(10, 2000),
        reece_cohesive_modulus=random.uniform(0, 200),
        reece_frictional_modulus=random.uniform(10, 100),
        friction_angle=np.radians(random.uniform(20, 42)),
        shear_modulus=10 ** random.uniform(-2.3, -1.3),
        peak_angle_offset=random.uniform(0.2, 0.5),
        peak_angle_slip=random.uniform(0.0, 0.3),
        exit_sinkage_ratio=random.choice([0.0, random.uniform(0.05, 1.0)]),
    )


@pytest.mark.parametrize("law", ["bekker", "bekker_wong", "reece"])
def test_random_soils_wheels_and_slips_against_adaptive_quadrature(law):
    """334 random cases a law, driven and braked, slips -0.95 to 1, exponents 0.4 to 2.5.

    The rule is split where the shear of a braked wheel changes its sign and where layers are thinner than its points; what remains is
    the root of the stress at the ends of the contact for exponents below 1. Errors count against the largest force: a wheel that is braked
    hard is pulled into weak soil by shear that nearly cancels its load.
    """
    random = np.random.default_rng(12)
    worst = {"driven": 0.0, "braked": 0.0}
    for _ in range(334):
        soil = random_soil(random)
        r = random.uniform(0.06, 0.4)
        b = random.uniform(0.3, 1.2) * r
        slip = float(np.round(random.uniform(-0.95, 1.0), 3))
        load = forces("bekker", soil, r, b, random.uniform(0.02, 0.25) * r, 0.0)[0]
        try:
            got = wheel_under_load(law, asdict(soil) | {"unit_weight": UNIT_WEIGHT}, r, b, load, slip)
        except InputRefused:
            with pytest.raises(ValueError, match="different signs"):
                brentq(lambda z, s=soil, r=r, b=b, slip=slip, w=load: forces(law, s, r, b, z, slip, UNIT_WEIGHT)[0] - w, 1e-9 * r, r)
            continue
        normal, pull, torque = forces(law, soil, r, b, got["sinkage"], slip, UNIT_WEIGHT)
        error = max(abs(normal - load), abs(pull - got["drawbar_pull"]), abs(torque - got["drive_torque"]) / r) / max(load, abs(pull))
        key = "driven" if slip >= 0 else "braked"
        worst[key] = max(worst[key], error)
    print(f"{law}: worst error over the load {worst}")
    assert worst["driven"] < 1e-5
    assert worst["braked"] < 1e-5


def test_reece_with_bekker_moduli_equals_bekker_wong_and_scales_otherwise():
    """Bekker moduli are read at the wheel's width, so the same wheel gets the same forces.

    Reece moduli that match at one width differ at another by (b1/b2)^(n-1) in pressure, and not at all at n = 1.
    """
    for n in (0.8, 1.0, 1.3):
        soil = asdict(replace(LUNAR_SOIL, sinkage_exponent=n))
        one, two = (wheel_under_load(law, soil, 0.15, 0.165, 50.0, 0.3)["sinkage"] for law in ("bekker_wong", "reece"))
        assert one == pytest.approx(two, rel=1e-12)
        moduli = {
            "unit_weight": UNIT_WEIGHT,
            "reece_cohesive_modulus": 1400.0 * 0.165 ** (n - 1) / 170.0,
            "reece_frictional_modulus": 820e3 * 0.165 ** (n - 1) / UNIT_WEIGHT,
        }
        same = wheel_under_load("reece", soil | moduli, 0.15, 0.165, 50.0, 0.3)["sinkage"]
        assert same == pytest.approx(one, rel=1e-12)
        wide = [wheel_under_load("bekker_wong", soil, 0.15, 0.3, 50.0, 0.3), wheel_under_load("reece", soil | moduli, 0.15, 0.3, 50.0, 0.3)]
        assert (abs(wide[0]["sinkage"] / wide[1]["sinkage"] - 1) < 1e-12) == (n == 1.0)


def test_what_cannot_be_carried_is_refused():
    with pytest.raises(InputRefused, match="sinks to its axle"):
        wheel_under_load("bekker_wong", asdict(LUNAR_SOIL), 0.05, 0.02, 1e6, 0.2)
    with pytest.raises(InputRefused, match="known: bekker, bekker_wong, reece"):
        wheel_under_load("janosi", asdict(LUNAR_SOIL), 0.15, 0.165, 50.0, 0.2)
