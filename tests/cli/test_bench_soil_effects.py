"""The verbs of bench, soils, effects and ruts as a user meets them."""

import csv
import json
import sqlite3
from contextlib import closing

import numpy as np
import pytest

from command import assert_refused, rille
from rille import store
from rille.cli.effects import effect_of
from rille.cli.rig import find_wheel
from rille.model import BenchPoints
from rille.view.bench_plots import _loads_of

WHEEL = ("--radius", "150 mm", "--width", "165 mm")


def test_a_sweep_goes_to_table_csv_json_sql_and_figure(model, tmp_path):
    table, figure = tmp_path / "points.csv", tmp_path / "bench.png"
    arguments = ("--law", "bekker", "--law", "reece", "--load", "30 N", "--load", "5 kg", "--slip", "0:0.4:0.2")
    done = rille("bench", model, *arguments, "--csv", table, "--figure", figure, "--save", "first")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("\n") >= 12
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 2 * 3
    assert figure.read_bytes().startswith(b"\x89PNG")
    with closing(sqlite3.connect(model)) as connection:
        kept = connection.execute("SELECT count(*), count(DISTINCT response), max(load) FROM bench_point WHERE bench = 'first'").fetchone()
    assert kept == (12, 2, pytest.approx(5 * 9.80665))
    points = json.loads(rille("bench", model, *arguments, "--json").stdout)
    text = json.dumps(points)
    assert text.count("drawbar_pull") >= 1
    assert rille("db", "check", model).returncode == 0


def test_measured_points_are_laid_over_and_gravity_makes_kilograms_a_load(tmp_path):
    measured, figure = tmp_path / "m.csv", tmp_path / "f.png"
    measured.write_text("load_N,slip,drawbar_pull_N\n8.1,0.2,1\n8.1,0.4,2\n")
    done = rille(
        "bench",
        *WHEEL,
        "--soil",
        "lunar_sourcebook",
        "--load",
        "5 kg",
        "--gravity",
        "moon",
        "--slip",
        "0.2,0.4",
        "--measured",
        measured,
        "--figure",
        figure,
        "--dynamic",
    )
    assert done.returncode == 0, done.stderr
    assert "8.1" in done.stdout
    assert figure.is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--load", "30 N"), "radius"),
        ((*WHEEL, "--soil", "lunar_sorcebook"), "did you mean 'lunar_sourcebook'"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--law", "beker"), "beker"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--load", "-3 N"), "above 0"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--slip", "0:2:0.5"), "-1 to 1"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--slip", "a:b"), "slip"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--effect", "slip_sinkige:slip_gain=1"), "slip_sinkage"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--effect", "coulomb_friction:torque=1"), "wheels"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--save", "x"), "database"),
        (("--radius", "150 kg", "--width", "1 m", "--soil", "lunar_sourcebook"), "radius"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--measured", "nowhere.csv"), "nowhere.csv"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--slip-angle", "8"), "8 deg"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--csv", "nowhere/points.csv"), "no folder 'nowhere'"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--figure", "points.xyz"), ".png"),
        ((*WHEEL, "--soil", "lunar_sourcebook", "--grousers", "24 x 10"), "radius of the rim"),
    ],
)
def test_a_bench_that_cannot_be_is_refused_in_one_sentence(arguments, words):
    assert_refused(rille("bench", *arguments), words)


@pytest.mark.parametrize(
    ("stated", "expected"),
    [
        ((None, None, None), (0.15, 0.165, 0, 0.0)),
        (("200 mm", None, None), (0.2, 0.165, 0, 0.0)),
        ((None, "0.3 m", None), (0.15, 0.3, 0, 0.0)),
        ((None, None, "12 x 5 mm"), (0.15, 0.165, 12, 0.005)),
        (("200 mm", "300 mm", "12 x 5 mm"), (0.2, 0.3, 12, 0.005)),
    ],
)
def test_options_change_the_wheel_of_the_model_one_by_one(model, stated, expected):
    wheel, _ = find_wheel(model, None, *stated)
    assert (wheel.radius, wheel.width, wheel.grouser_count, wheel.grouser_height) == expected


def test_measured_points_of_another_load_have_a_colour_of_their_own():
    """30.9 N are those of 30 N, which was calculated; 40 and 41 N are one load that was not."""
    points = BenchPoints.at(np.array([30.9, 41.0, 40.0]), 0.2)
    assert _loads_of(points, [30.0, 99.0]).tolist() == [30.0, 40.0, 40.0]
    assert _loads_of(points, []).tolist() == [30.9, 40.0, 40.0]


def test_slips_end_at_the_last_or_before_it():
    def slips(text):
        found = json.loads(rille("bench", *WHEEL, "--slip", text, "--json").stdout)
        return found["series"][0]["slip_ratio"]

    assert slips("0:0.8:0.3") == [0, 0.3, 0.6]
    assert slips("0:0.3:0.1") == [0, 0.1, 0.2, 0.3]


def test_options_that_do_nothing_are_told():
    told = rille("bench", *WHEEL, "--slip", "0.2", "--grousers", "24 x 10 mm", "--law", "reece", "--soil", "lete_sand").stderr
    assert "grouser_thrust" in told
    assert "reece is bekker_wong" in told
    thrust = rille("bench", *WHEEL, "--slip", "0.2", "--grousers", "24 x 10 mm", "--effect", "grouser_thrust:efficiency=1")
    assert "do nothing" not in thrust.stderr
    assert thrust.stdout.startswith("bekker_wong on lunar_sourcebook, quasi-static, grouser_thrust:efficiency=1\n")


def test_soils_are_listed_and_shown(model):
    listed = rille("soil", "list").stdout
    assert "lunar_sourcebook" in listed
    assert "Carrier" in listed
    assert [s["name"] for s in json.loads(rille("soil", "list", model, "--json").stdout)] == ["lunar_sourcebook"]
    shown = rille("soil", "show", "fjs1_simulant").stdout
    assert "shear_modulus" in shown
    assert_refused(rille("soil", "show", "fjs2"), "fjs1_simulant")


def bench_csv(path, rows=9):
    """Points of a soil that is not in the library."""
    done = rille("bench", *WHEEL, "--soil", "lete_sand", "--load", "40 N", "--load", "80 N", "--slip", "0.1:0.8:0.1", "--csv", path)
    assert done.returncode == 0, done.stderr


def test_a_soil_is_fitted_and_written_for_a_scene(tmp_path):
    points, soil = tmp_path / "points.csv", tmp_path / "soil.toml"
    bench_csv(points)
    fit = ("soil", "fit", points, "--soil", "lete_sand", *WHEEL, "--fit", "friction_angle", "--noise", "drawbar_pull=0.3")
    done = rille(*fit, "--response", "drawbar_pull", "-o", soil, "--figure", tmp_path / "fit.png")
    assert done.returncode == 0, done.stderr
    assert "held out" in done.stdout
    assert 'name = "lete_sand_fitted"' in soil.read_text()
    answer = json.loads(rille(*fit, "--response", "drawbar_pull", "--json").stdout)
    assert answer["fitted"][0]["name"] == "friction_angle"
    assert_refused(rille("soil", "fit", points, "--soil", "lete_sand", *WHEEL, "--fit", "colour"), "colour")
    assert_refused(
        rille("soil", "fit", points, "--soil", "lete_sand", *WHEEL, "--fit", "friction_angle", "--hold-out", "load>0"), "hold-out"
    )
    assert_refused(rille("soil", "fit", points, "--soil", "lete_sand", *WHEEL, "--fit", "cohesion", "--only", "load>5..0"), "condition")
    assert_refused(rille(*fit, "-o", tmp_path / "no" / "soil.toml"), "no folder")
    assert "drawbar_pull = drawbar_pull_N [N]" in done.stderr
    scene = tmp_path / "scene.toml"
    flat = 'name = "f"\nsoil = "lete_sand_fitted"\n[base]\nkind = "flat"\nsize = [10, 10]\nposting = 1\n'
    scene.write_text(flat + soil.read_text())
    built = rille("terrain", "build", scene, "-o", tmp_path / "scene.db")
    assert built.returncode == 0, built.stderr


def test_effects_are_listed_shown_added_and_removed(model):
    assert len(json.loads(rille("effects", "list", "--json").stdout)) >= 41
    assert "Ding" in rille("effects", "show", "slip_sinkage").stdout
    assert_refused(rille("effects", "show", "slip_sinkige"), "slip_sinkage")
    plain = json.loads(rille("run", model, "--duration", "1", "--json").stdout)
    assert rille("effects", "add", model, "slip_sinkage", "--set", "slip_gain=0.5").returncode == 0
    assert "slip_gain" in rille("effects", "list", model).stdout
    assert "slip_sinkage on *" in rille("db", "info", model).stdout
    deeper = json.loads(rille("run", model, "--duration", "1", "--json").stdout)
    assert (plain["effects"], [e["kind"] for e in deeper["effects"]]) == ([], ["slip_sinkage"])
    assert "beyond the base model: slip_sinkage on *" in rille("run", model, "--duration", "0.1").stderr
    assert deeper["summary"]["wheels"][0]["max_sinkage"] > 1.05 * plain["summary"]["wheels"][0]["max_sinkage"]
    assert_refused(rille("effects", "add", model, "slip_sinkage", "--set", "slip_gain=99"), "1.5")
    assert_refused(rille("effects", "add", model, "slip_sinkage", "--set", "slip_gian=0.5"), "slip_gain")
    assert_refused(rille("effects", "add", model, "slip_sinkage", "--target", "wheel_x", "--set", "slip_gain=0.5"), "wheel_front_left")
    assert_refused(rille("effects", "remove", model, "multipass"), "it has slip_sinkage on *")
    assert rille("effects", "remove", model).returncode == 0
    again = json.loads(rille("run", model, "--duration", "1", "--json").stdout)
    assert again["summary"]["wheels"] == plain["summary"]["wheels"]


def test_an_effect_on_what_the_model_lacks_is_told(tmp_path):
    database = tmp_path / "empty.db"
    store.create(database)
    done = rille("effects", "add", database, "slip_sinkage", "--set", "slip_gain=0.5")
    assert done.returncode == 0, done.stderr
    assert "no wheel yet" in done.stderr


def test_an_effect_that_does_nothing_is_told(model):
    done = rille("effects", "add", model, "slip_sinkage")
    assert done.returncode == 0, done.stderr
    assert "slip_sinkage does nothing while slip_gain is 0; usual is --set slip_gain=" in done.stderr
    assert effect_of("expression", "*", ["formula=velocity"]).parameters == {"gain": 1.0, "formula": "velocity"}
    assert effect_of("expression", "*", ["formula=velocity", "gain=2"]).parameters["gain"] == 2.0


def test_the_ground_and_gravity_are_no_targets_among_others(model):
    assert_refused(
        rille("effects", "add", model, "gravity_tilt", "--target", "banana", "--set", "roll=0.1"), "acts on the world as a whole"
    )


def test_an_expression_is_added_and_a_wrong_dimension_refused(model):
    values = ("--set", "gain=1", "--set", "output=joint.effort", "--set", "target_kind=joint")
    good = rille(
        "effects", "add", model, "expression", *values, "--set", "formula=-k*velocity", "--set", 'constants={"k": [0.2, "N m s/rad"]}'
    )
    assert good.returncode == 0, good.stderr
    assert rille("run", model, "--duration", "0.2").returncode == 0
    rille(
        "effects", "add", model, "expression", *values, "--set", "formula=-k*position*time", "--set", 'constants={"k": [0.2, "N m s/rad"]}'
    )
    assert_refused(rille("run", model, "--duration", "0.2"), "unit")


def test_ruts_become_a_dem_layer_and_a_moment_can_be_viewed(model, tmp_path):
    import rasterio

    assert rille("run", model).returncode == 0
    tif = tmp_path / "ruts.tif"
    done = rille("terrain", "ruts", model, "-o", tif)
    assert done.returncode == 0, done.stderr
    with rasterio.open(tif) as layer:
        depth = layer.read(1)
    assert 5e-3 < depth[depth == depth].max() < 0.05
    assert rille("view", model, "-o", tmp_path / "pictures", "--time", "1").returncode == 0
    assert_refused(rille("view", model, "-o", tmp_path / "pictures", "--time", "99"), "99")
