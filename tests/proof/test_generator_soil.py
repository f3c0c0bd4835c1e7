"""Soil of the independent generator: the golden table, the solver's bench, every law on wheels."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from test_wheel_on_soil import SOILS
from test_wheel_soil_laws import LAWS, REECE_SOILS, UNIT_WEIGHT

from rille import simulate, store
from rille.cli.prove_agreement import agreement
from rille.model import BenchWheel, Effect, InputRefused, PhysicsFailed, SoilPatch
from rille.proof.generator.ground import Ground, Ruts
from rille.proof.generator.soil_laws import SOIL_LAWS, soil_laws
from rille.proof.generator.wheel_bench import bench_points
from rille.proof.machines import EARTH, MAKERS

KINDS = {kind.name: kind for kind in store.effect_kinds()}
ON_WHEELS = sorted(name for name, kind in KINDS.items() if kind.family in ("wheel_soil", "rolling"))
FORCES = ("drawbar_pull", "side_force", "drive_torque")


def typical(kind: str) -> Effect:
    """A law of the catalogue at its usual size."""
    return Effect(kind=kind, parameters={p.name: p.typical for p in KINDS[kind].parameters})


def rig(seed: int = 0):
    """Wheel, soil, and 60 conditions of a bench: two loads, ten slips from -0.6 to 1, three slip angles of both signs."""
    rng = np.random.default_rng(seed)
    machine = MAKERS["bench"](rng)
    made = machine.rover.wheels[0]
    assert made.grouser is not None
    wheel = BenchWheel(radius=made.radius, width=made.width, grouser_count=made.grouser.count, grouser_height=made.grouser.height)
    loads, slips = np.exp(rng.uniform(np.log(25), np.log(110), 2)), np.sort(rng.uniform(-0.6, 1.0, 10))
    grid = [a.ravel() for a in np.meshgrid(loads, slips, [0.0, 0.15, -0.35], indexing="ij")]
    assert machine.terrain is not None
    return wheel, machine.terrain.soils[0], dict(zip(("load", "slip_ratio", "slip_angle"), grid, strict=True))


def largest_difference(law: str, effects: list[Effect], seed: int = 0) -> float:
    """Largest difference to the solver's quasi-static bench: of the sinkage relative, of forces (and torque/radius) per load."""
    wheel, soil, where = rig(seed)
    ours = bench_points(wheel, soil, law, **where, laws=effects, gravity=EARTH)
    rows = simulate.effect_rows(effects, list(KINDS.values()))
    theirs = simulate.bench(law, soil, wheel, **where, effects=rows, gravity=EARTH, threads=1).points
    worst = [np.abs(ours["sinkage"] / theirs.sinkage - 1).max()]
    for name in FORCES:
        scale = where["load"] * (wheel.radius if name == "drive_torque" else 1)
        worst.append(float((np.abs(ours[name] - getattr(theirs, name)) / scale).max()))
    return max(worst)


def test_every_row_of_the_golden_table(rille_data):
    """560 rows of another adaptive quadrature at 1e-12; the table prints its sinkages and pulls with nine digits, its torques with
    seven.
    """
    with (rille_data / "reference/wheel_reference.csv").open() as file:
        rows = list(csv.DictReader(file))
    groups: dict[tuple[str, ...], list[dict[str, str]]] = {}
    for row in rows:
        groups.setdefault((row["soil"], row["model"], row["r_m"], row["b_m"]), []).append(row)
    for (name, model, radius, width), group in groups.items():
        soil = (SOILS | REECE_SOILS)[name]
        column = {word: np.array([float(row[word]) for row in group]) for word in ("load_N", "slip", "sinkage_mm", "DP_N", "T_Nm")}
        got = bench_points(
            BenchWheel(radius=float(radius), width=float(width)),
            soil,
            LAWS[model],
            load=column["load_N"],
            slip_ratio=column["slip"],
            gravity=UNIT_WEIGHT / soil.density,
        )
        assert 1e3 * got["sinkage"] == pytest.approx(column["sinkage_mm"], rel=2e-8)
        assert got["drawbar_pull"] / column["load_N"] == pytest.approx(column["DP_N"] / column["load_N"], abs=2e-9)
        assert got["drive_torque"] == pytest.approx(column["T_Nm"], rel=1e-7)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("law", ["bekker", "bekker_wong", "reece"])
def test_a_bare_bench_agrees_with_the_solver(law, seed):
    """The solver's rule of 8 + 8 points errs by 1e-8 at n = 1 and up to 3e-7 for the exponents drawn here (0.85 to 1.15)."""
    assert largest_difference(law, [], seed) < 1e-6


@pytest.mark.parametrize("kind", ON_WHEELS)
def test_every_law_agrees_with_the_solver(kind):
    """At its usual size. What is left is the solver's quadrature: 1e-6, and for lateral bulldozing its four points, 1e-6 of the load
    each.
    """
    assert largest_difference("bekker_wong", [typical(kind)]) < 3e-6


def test_all_laws_at_once_agree_with_the_solver():
    """Laws meet in one soil: the order in which they act is the same where it counts.

    Contacts are deep then, and the four points of the solver's lateral bulldozing err by 3e-5 of the load; without it 4e-8 is left.
    """
    assert largest_difference("bekker_wong", [typical(kind) for kind in ON_WHEELS]) < 1e-4
    assert largest_difference("bekker_wong", [typical(kind) for kind in ON_WHEELS if kind != "lateral_bulldozing"]) < 1e-6


def test_a_drawn_bench_agrees_with_the_solver_at_every_wheel_and_speed():
    """Near n = 1 the solver's rule errs by 1e-8 of the load (above), and a sensor's noise is 2e-3 of it or more (0.25 N of 110 N)."""
    machine, most = agreement("any sentence", "bench", 0)
    assert machine == "bench"
    assert 0.0 < most < 1e-5


def test_every_law_on_wheels_is_here():
    """The catalogue's two families of wheels."""
    assert set(ON_WHEELS) == SOIL_LAWS


def test_a_law_without_amplitude_changes_no_bit():
    """Zero is nothing at all."""
    wheel, soil, where = rig()
    bare = bench_points(wheel, soil, "bekker_wong", **where, gravity=EARTH)
    for kind in ON_WHEELS:
        still = {p.name: 0.0 if p.amplitude else p.typical for p in KINDS[kind].parameters}
        with_law = bench_points(wheel, soil, "bekker_wong", **where, laws=[Effect(kind=kind, parameters=still)], gravity=EARTH)
        for name, values in bare.items():
            assert (values == with_law[name]).all(), kind


def test_a_soil_that_does_not_carry_says_so():
    """NaN, as of the solver's bench, where the wheel is buried to its axle."""
    wheel, soil, _ = rig()
    got = bench_points(wheel, soil, "bekker_wong", load=[50.0, 1e6], slip_ratio=0.2, gravity=EARTH)
    assert np.isfinite(got["sinkage"][0])
    assert np.isnan(got["drawbar_pull"][1])


def test_a_law_that_misses_a_number_is_refused():
    """What is no amplitude has no default here: the truth of a trial says all numbers."""
    with pytest.raises(InputRefused, match="time_constant = None"):
        soil_laws([Effect(kind="sinkage_transient", parameters={"depth": 0.01})], ["wheel"])


def test_planes_of_a_tilted_ground_are_its_own():
    """On a plane z = a x + b y every footprint has its height and normal, up to rounding."""
    terrain = MAKERS["bench"](np.random.default_rng(0)).terrain
    assert terrain is not None
    x, y = np.arange(terrain.heights.shape[1]) * 0.25 - 12, 10 - np.arange(terrain.heights.shape[0]) * 0.25
    tilted = Ground(replace(terrain, heights=0.1 * x + 0.2 * y[:, None]))
    place, turn = np.array([[0.33, -1.7], [3.1, 2.2]]), np.array([0.4, 2.0])
    height, normal = tilted.plane(place, np.column_stack([np.cos(turn), np.sin(turn)]), np.full(2, 0.07), np.full(2, 0.09))
    assert height == pytest.approx(place @ (0.1, 0.2))
    assert normal == pytest.approx(np.tile(np.array([-0.1, -0.2, 1]) / np.sqrt(1.05), (2, 1)))
    with pytest.raises(PhysicsFailed, match="left terrain"):
        tilted.height(np.array([13.0]), np.array([0.0]))


def test_the_last_patch_that_contains_a_place_gives_its_soil():
    """A square patch on the base soil."""
    terrain = MAKERS["bench"](np.random.default_rng(0)).terrain
    assert terrain is not None
    patch = SoilPatch(name="square", soil="other", polygon=((0, 0), (1, 0), (1, 1), (0, 1)))
    ground = Ground(replace(terrain, soils=(*terrain.soils, replace(terrain.soils[0], name="other")), patches=(patch,)))
    assert [ground.soil(x, y) for x, y in ((0.5, 0.5), (0.99, 0.01), (1.01, 0.5), (-0.1, -0.1))] == [1, 1, 0, 0]


def test_ruts_remember_the_deepest_pass():
    """Across the path the mean depth; untouched soil is level."""
    ruts = Ruts(0.03)
    left = np.array([0.0, 1.0])
    for x in np.arange(0, 0.5, 0.01):
        ruts.mark(np.array([x, 0.0]), left, 0.16, 0.01)
        ruts.mark(np.array([x, 0.0]), left, 0.16, 0.006)
    assert ruts.depth(np.array([0.25, 0.0]), left, 0.16) == pytest.approx(0.01)
    assert ruts.depth(np.array([0.25, 0.5]), left, 0.16) == 0.0
    assert 0.002 < ruts.depth(np.array([0.25, 0.08]), left, 0.16) < 0.008
