"""Recordings of wheel benches against the bench of a database: which wheel, soil and effects; and the real benches."""

import json
import math
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from command import rille
from rille import cad, simulate, store, terrain
from rille.cli.bench_rigs import bench_rig
from rille.cli.compare_points import compare_points
from rille.cli.import_recording import import_recording
from rille.model import BenchWheel, Effect, InputRefused
from rille.model.recording import Channel, Recording
from rille.recording.points import bench_setup

WHEEL = BenchWheel(radius=0.09, width=0.1)
SLIP, ANGLE = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.4, 0.8, 9), np.radians([0.0, 15.0])))
SHAPE = {"radius": "90 mm", "width": "100 mm"}


@pytest.fixture
def database(tmp_path):
    """A database without a model."""
    path = tmp_path / "bench.db"
    store.create(path)
    return path


def recorded(table, *, soil="fjs1_simulant", wheel=WHEEL, load=60.0, slip_given=None, effects=(), target="wheel", repeats=2):
    """The points of a bench with that soil and wheel, twice with a little noise."""
    rows = simulate.effect_rows(effects, store.effect_kinds())
    library = terrain.soils()
    truth = simulate.bench("bekker_wong", library[soil], wheel, load=load, slip_ratio=SLIP, slip_angle=ANGLE, effects=rows).points
    random = np.random.default_rng(4)
    given = {"slip_ratio": SLIP if slip_given is None else slip_given, "slip_angle": ANGLE, "normal_load": np.full(len(SLIP), load)}
    number = np.arange(repeats * len(SLIP), dtype=float)

    def channel(name, value, role):
        return Channel(name=name, quantity=f"wheel.{name}", target=target, unit="N", role=role, time=number, value=np.tile(value, repeats))

    commands = [channel(name, value, "command") for name, value in given.items()]
    observed = [channel(name, getattr(truth, name), "observed") for name in ("drawbar_pull", "side_force")]
    observed = [replace(c, value=c.value + 0.2 * random.standard_normal(len(c.value))) for c in observed]
    return Recording(name="bench", kind="points", setup=bench_setup(table, "'bench.toml'"), channels=(*commands, *observed))


def normalised(comparison):
    """RMS per noise by channel."""
    return {c.channel.name: float(np.sqrt(np.mean((c.residual / c.noise) ** 2))) for c in comparison.channels}


def floor(comparison):
    """All residuals are at the noise: 36 points, 18 degrees of freedom for the noise; 1 +- 4 (0.12 + 0.17)."""
    return all(0.3 < value < 2.2 for value in normalised(comparison).values())


def test_the_manifest_brings_wheel_and_soil(database):
    comparison = compare_points(database, recorded(SHAPE | {"soil": "fjs1_simulant"}))
    assert floor(comparison)
    assert (comparison.model, comparison.mode) == ("bench", "points")
    assert "bench: wheel of radius x width 90 x 100 mm, fjs1_simulant, bekker_wong" in comparison.notes
    assert not bench_rig(database, recorded(SHAPE | {"soil": "fjs1_simulant"}))[0].own_soil  # it is the library's
    assert min(normalised(compare_points(database, recorded(SHAPE | {"soil": "lete_sand"}))).values()) > 3


def test_effects_of_the_database_act_on_the_wheel(database):
    effect = Effect(kind="lateral_bulldozing", target="*", parameters={"efficiency": 1.0})
    recording = recorded(SHAPE | {"soil": "fjs1_simulant"}, effects=[effect])
    before = normalised(compare_points(database, recording))
    store.write_effects(database, [effect, Effect(kind="viscous_friction", target="*", parameters={"coefficient": 1.0})])
    after = compare_points(database, recording)
    assert before["side_force"] > 3
    assert before["drawbar_pull"] < 2.2
    assert floor(after)


def test_the_models_own_wheel_is_used_before_the_manifests(rover_database):
    path, wheel = rover_database
    shape = BenchWheel(radius=wheel.radius, width=wheel.width, grouser_count=wheel.grouser.count, grouser_height=wheel.grouser.height)
    comparison = compare_points(path, recorded(SHAPE | {"soil": "fjs1_simulant"}, wheel=shape, target=wheel.name))
    assert floor(comparison)
    assert any(f"the model's wheel '{wheel.name}' has radius" in note for note in comparison.notes)
    effect = Effect(kind="lateral_bulldozing", target=wheel.name, parameters={"efficiency": 1.0})
    store.write_effects(path, [effect])
    assert normalised(compare_points(path, recorded(SHAPE | {"soil": "fjs1_simulant"}, wheel=shape, target=wheel.name)))["side_force"] > 3


@pytest.fixture(scope="module")
def rover_database(repository, tmp_path_factory):
    """The example rover in a database, and one of its wheels."""
    path = tmp_path_factory.mktemp("rover") / "rover.db"
    store.create(path)
    rover = cad.build(repository / "examples/rover/rover.toml")
    store.write_rover(path, rover)
    return path, rover.wheels[2]


def test_slip_ratios_of_the_travel_are_turned_into_those_of_the_heading(database):
    """What a rig records as slip of its travel, worked out from the rim speed: u = r w / V."""
    along = np.cos(ANGLE)
    rim = np.where(SLIP >= 0, along / (1 - SLIP), along * (1 + SLIP))
    travel = np.where(rim >= 1, 1 - 1 / rim, rim - 1)
    table = SHAPE | {"soil": "fjs1_simulant"}
    comparison = compare_points(database, recorded(table | {"slip_speed": "travel"}, slip_given=travel))
    assert floor(comparison)
    assert any("along the heading" in note for note in comparison.notes)
    assert comparison.regimes.values["slip_ratio/wheel"].max() == pytest.approx(travel.max())
    assert normalised(compare_points(database, recorded(table, slip_given=travel)))["side_force"] > 1.5


def test_soil_values_stand_alone_or_on_a_soil_of_the_library(database):
    changed = {"soil": "lete_sand", "soil_values": {"friction_angle": f"{math.degrees(terrain.soils()['lete_sand'].friction_angle)} deg"}}
    assert normalised(compare_points(database, recorded(SHAPE | changed, soil="lete_sand")))["drawbar_pull"] < 2.2
    whole = {name: getattr(terrain.soils()["lete_sand"], name) for name in ("sinkage_exponent", "cohesive_modulus", "frictional_modulus")}
    with pytest.raises(InputRefused, match=r"\[bench.soil_values\] of recording 'bench'.*'cohesion' is missing"):
        compare_points(database, recorded(SHAPE | {"soil_values": whole}))


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ({"soil": "fjs1_simulant"}, "has no wheel 'wheel'.*state radius and width"),
        (SHAPE, "does not say which soil.*the database has none"),
        (SHAPE | {"soil": "fjs_simulant"}, "no soil 'fjs_simulant'.*fjs1_simulant"),
        (SHAPE | {"soil": "lete_sand", "soil_values": {"cohesoin": 3}}, "'cohesoin' is unknown.*cohesion"),
        (SHAPE | {"soil": "lete_sand", "gravity": "venus"}, "gravity is 'venus'"),
    ],
)
def test_a_rig_that_is_not_known_is_refused_in_a_sentence(database, table, sentence):
    with pytest.raises(InputRefused, match=sentence) as refused:
        compare_points(database, recorded(table))
    assert "\n" not in str(refused.value)


def test_points_across_the_wheel_are_left_out_and_said(database):
    recording = recorded(SHAPE | {"soil": "fjs1_simulant"})
    turned = replace(recording.channels[1], value=np.where(recording.channels[1].value > 0.1, np.pi / 2, 0.0))
    comparison = compare_points(database, replace(recording, channels=(recording.channels[0], turned, *recording.channels[2:])))
    assert {len(c.residual) for c in comparison.channels} == {18}
    assert any("18 x slip angle above 86 deg" in note for note in comparison.notes)


def imported(repository, tmp_path, name):
    """One of the example manifests in a fresh database, through the same code as `rille import`."""
    path = tmp_path / "real.db"
    import_recording([repository / f"examples/wheel_bench/{name}.toml"], path)
    return path, compare_points(path, store.read_recording(path, name))


def test_the_smooth_wheel_of_cmu(repository, rille_data, tmp_path, monkeypatch):
    """189 points. The makers publish a repeatability of 0.56 N and 0.66 mm; ours is pooled over all slips and slip angles."""
    monkeypatch.setenv("RILLE_DATA", str(rille_data))
    path, comparison = imported(repository, tmp_path, "cmu")
    channels = {c.channel.quantity: c for c in comparison.channels}
    assert {c.noise_from for c in comparison.channels} == {"repeats"}
    assert channels["wheel.sinkage"].noise == pytest.approx(6.6e-4, rel=0.1)
    assert channels["wheel.drawbar_pull"].noise == pytest.approx(0.56, rel=0.5)
    assert {len(c.residual) for c in comparison.channels} == {162}  # not those at 90 deg
    assert len(comparison.windows) == 7

    def side(made, window):
        found = next(c for c in made.channels if c.channel.quantity == "wheel.side_force")
        return float(np.sqrt(np.mean(found.residual[found.window == window] ** 2)))

    assert side(comparison, 0) < 1.0  # straight ahead there is none
    assert side(comparison, 5) > 10  # at 75 deg the side of the wheel pushes soil, which the base model does not know ...
    store.write_effects(path, [Effect(kind="lateral_bulldozing", target="*", parameters={"efficiency": 1.0})])
    better = compare_points(path, store.read_recording(path, "cmu"))
    assert side(better, 5) < 0.9 * side(comparison, 5)  # ... and the catalogue does


def test_the_wheel_of_tohoku_2003(repository, rille_data, tmp_path, monkeypatch):
    monkeypatch.setenv("RILLE_DATA", str(rille_data))
    _, comparison = imported(repository, tmp_path, "tohoku_2003")
    assert [c.noise_from for c in comparison.channels] == ["differences"]
    assert len(comparison.windows) == 3  # loads
    assert len(comparison.channels[0].residual) == 24


def test_pictures_and_section_of_the_page(database, tmp_path):
    from rille.view.bench_difference_plots import plot_points, points_section

    comparison = compare_points(database, recorded(SHAPE | {"soil": "fjs1_simulant"}))
    plot_points(comparison, tmp_path / "points.png", title="bench")
    assert (tmp_path / "points.png").stat().st_size > 20_000
    section = points_section(comparison, key="bench")
    assert section.body.count("<figure") == 2
    assert "slip angle 15 deg, load 60 N" in section.body


def test_the_wheels_of_tohoku_2005(repository, rille_data, tmp_path, monkeypatch):
    """Long table to wide ones; pull and side force at slips of their own; the sinkage, whose zero is not known, agrees in the mean."""
    monkeypatch.setenv("RILLE_DATA", str(rille_data))
    script = repository / "examples/wheel_bench/widen.py"
    subprocess.run([sys.executable, str(script), str(tmp_path)], check=True, capture_output=True, timeout=60)
    sheet = (repository / "examples/wheel_bench/tohoku_2005_A_smooth.toml").read_text()
    manifest = tmp_path / "smooth.toml"
    manifest.write_text(sheet.replace("../../out/wheel_bench/", ""))
    path = tmp_path / "real.db"
    import_recording([manifest], path)
    comparison = compare_points(path, store.read_recording(path, "tohoku_2005_A_smooth"))
    assert {c.channel.quantity: len(c.residual) for c in comparison.channels} == {
        "wheel.drawbar_pull": 93,
        "wheel.side_force": 93,
        "wheel.sinkage": 24,
    }
    assert len(comparison.windows) == 5  # 0 (sinkage only), 4, 8, 12, 16 deg
    (sinkage,) = (c for c in comparison.channels if c.channel.quantity == "wheel.sinkage")
    assert abs(sinkage.residual.mean()) < 1e-9
    assert set(comparison.regimes.values["normal_load/wheel_A"]) == {64.7}


@pytest.mark.parametrize(("name", "size"), [("cmu", (0.058, 0.05, None)), ("tohoku", (0.09, 0.1, 16))])
def test_the_drawn_rigs(repository, name, size):
    wheel = cad.build(repository / f"examples/wheel_bench/{name}_rig.py").wheels[0]
    count = wheel.grouser.count if wheel.grouser is not None else None
    assert (wheel.name, wheel.radius, wheel.width, count) == ("wheel", pytest.approx(size[0]), pytest.approx(size[1]), size[2])


def test_the_command_line_from_the_table_to_the_picture(repository, rille_data, tmp_path):
    """`rille import`, `rille compare` with report, picture and JSON."""
    environment = {**os.environ, "RILLE_DATA": str(rille_data)}
    path = tmp_path / "cmu.db"
    assert rille("import", repository / "examples/wheel_bench/cmu.toml", "-o", path, env=environment).returncode == 0
    done = rille("compare", path, "-o", tmp_path / "cmu.html", "--figure", tmp_path / "cmu.png", "--json", env=environment)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["mode"] == "points"
    assert found["differs"] is True
    assert (tmp_path / "cmu.png").stat().st_size > 50_000
    assert "95 % repeatability" in (tmp_path / "cmu.html").read_text()
