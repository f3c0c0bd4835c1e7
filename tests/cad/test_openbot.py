"""Is the OpenBot MTV put together from its printed parts a machine that stands on six wheels and drives? (isl-org/OpenBot, MIT)"""

import csv
import importlib.util
import json
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from command import rille
from rille import store
from rille.cad import build, read_step
from rille.cad.suggestion.features import cylinders
from rille.model import Rover
from rille.model.rotation import pose_matrix
from rille.model.trace import BodyTrace

SHEET = "examples/openbot/openbot.toml"
WEIGHT = 6.038 * 9.80665


@pytest.fixture(scope="module")
def parts(rille_data: Path) -> Path:
    folder = rille_data / "data/cad/openbot_mtv"
    if not folder.is_dir():
        pytest.skip("the parts of the OpenBot MTV are absent (data/cad/openbot_mtv)")
    return folder


@pytest.fixture(scope="module")
def mtv(repository: Path, parts: Path) -> Rover:
    return build(repository / SHEET)


def test_total_mass_is_the_sum_of_what_is_stated(mtv, repository, parts):
    """2543 g of weighed prints (the page's own total), six wheels and what the sheet lumps; 0.3 g of rounding to 0.01 g a part."""
    with (parts / "quantities.csv").open(encoding="utf-8") as file:
        printed = sum(float(row["printed_mass_g_of_group"].split()[0]) for row in csv.DictReader(file) if row["printed_mass_g_of_group"])
    assert printed == 2543
    with (repository / SHEET).open("rb") as file:
        sheet = tomllib.load(file)
    lumped = sum(float(m["mass"].removesuffix(" g")) * (2 if m["name"].endswith("_right") else 1) for m in sheet["mass"])
    wheel = next(float(p["mass"].removesuffix(" g")) for p in sheet["part"] if p["match"] == "wheel")
    total = 1e3 * sum(body.properties.mass for body in mtv.bodies)
    assert total == pytest.approx(printed + lumped + 6 * wheel, abs=0.3)
    assert total * 9.80665e-3 == pytest.approx(WEIGHT, rel=1e-4)


def test_every_part_is_used_as_often_as_it_is_printed(mtv, parts):
    placed: dict[str, int] = {}
    for instance in mtv.instances:
        name = instance.part.removesuffix(":mirror").lower().replace(" ", "_")
        placed[name] = placed.get(name, 0) + 1
    with (parts / "quantities.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            assert placed[Path(row["file"]).stem.lower()] == int(row["quantity"]), row["file"]


def lines(mtv: Rover, folder: Path, path: str, file: str, radius: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Point [m] and axis of every bore of a radius [mm] of a placed part, in the model."""
    instance = next(i for i in mtv.instances if i.path == path)
    matrix = pose_matrix(instance.pose)
    found = [
        c for c in cylinders(read_step(folder / f"{file}.step").prototypes[0].shape) if c.concave and abs(c.radius - 1e-3 * radius) < 1e-6
    ]
    return [(matrix[:3, :3] @ c.point + matrix[:3, 3], matrix[:3, :3] @ c.axis) for c in found]


BOLTED = [  # two parts and the radii of the bores that one bolt goes through
    ("rocker_right/joint_100", "Joints/100deg_Joint", 2.25, "rocker_right/mid_leg", "Legs/Mid_Leg", 0.5),
    ("rocker_right/joint_100", "Joints/100deg_Joint", 2.25, "rocker_right/rear_leg", "Legs/Rear_Leg", 0.5),
    ("rocker_right/end_joint", "Joints/End_Joint", 2.25, "rocker_right/mid_leg", "Legs/Mid_Leg", 0.5),
    ("rocker_right/end_joint", "Joints/End_Joint", 3.25, "bogie_right/joint_90", "Joints/90deg_Joint", 3.25),
    ("rocker_right/end_joint", "Joints/End_Joint", 3.25, "rocker_right/bearing_cover", "BearingCover/BearingCover", 6.25),
    ("bogie_right/joint_90", "Joints/90deg_Joint", 2.25, "bogie_right/leg_front", "Legs/Front_Leg", 0.5),
    ("bogie_right/joint_90", "Joints/90deg_Joint", 2.25, "bogie_right/leg_middle", "Legs/Front_Leg", 0.5),
    ("bogie_right/motor_front/bracket", "MotorAssembly/Motor_Bracket", 2.25, "bogie_right/leg_front", "Legs/Front_Leg", 0.5),
    ("rocker_right/motor_rear/bracket", "MotorAssembly/Motor_Bracket", 2.25, "rocker_right/rear_leg", "Legs/Rear_Leg", 0.5),
    (
        "bogie_right/motor_front/bracket",
        "MotorAssembly/Motor_Bracket",
        2.25,
        "bogie_right/motor_front/enclosure_bottom",
        "MotorAssembly/MotorEnclosure_Bottom",
        2.25,
    ),
    ("rocker_right/joint_100", "Joints/100deg_Joint", 3.25, "chassis/rear", "Compartment/Compartment_Rear", 0.6),
    ("chassis/battery_mount_1", "Compartment/Compartment_Battery_Mount-P1", 3.5, "chassis/rear", "Compartment/Compartment_Rear", 0.6),
    ("chassis/phone_mount", "PhoneMount/Phone_Mount", 1.75, "chassis/roof_front", "Compartment/Roof_Front", 1.75),
]


@pytest.mark.parametrize("case", BOLTED, ids=lambda case: f"{case[0]}--{case[3]}")
def test_bolts_pass_through_both_parts(mtv, parts, case):
    """Bores of two bolted parts are in line: 5 micrometres (the sheet is written to 1) and 1e-5 rad."""
    one, one_file, r1, other, other_file, r2 = case
    apart = [
        (float(np.linalg.norm(np.cross(b - a, u))), float(np.linalg.norm(np.cross(u, v))))
        for a, u in lines(mtv, parts, one, one_file, r1)
        for b, v in lines(mtv, parts, other, other_file, r2)
    ]
    assert any(distance < 5e-6 and angle < 1e-5 for distance, angle in apart), min(apart)


def test_left_and_right_are_mirror_images(mtv):
    """Exact but for the joint of the rocker, whose two sides are separate files that differ by a bore (0.2 mm of its centre of mass)."""
    bodies = {body.name: body.properties for body in mtv.bodies}
    joints = {joint.name: joint for joint in mtv.joints}
    mirror = np.diag([1.0, -1.0, 1.0])
    for name, right in bodies.items():
        if not name.endswith("_right"):
            continue
        left = bodies[name.replace("_right", "_left")]
        exact = not name.startswith("rocker")
        assert left.mass == pytest.approx(right.mass, rel=1e-12)
        np.testing.assert_allclose(mirror @ left.com, right.com, atol=1e-9 if exact else 5e-5)
        np.testing.assert_allclose(mirror @ left.inertia @ mirror, right.inertia, atol=1e-12 if exact else 1e-3 * right.inertia.max())
    for name in ("rocker", "bogie", "wheel_front", "wheel_middle", "wheel_rear"):
        one, other = joints[f"{name}_right"], joints[f"{name}_left"]
        assert one.axis == pytest.approx(other.axis)
        np.testing.assert_allclose(np.delete(other.point, 1), np.delete(one.point, 1), atol=1e-9)


def test_axles_are_level_and_the_wheels_are_balanced(mtv):
    """Six axles at the height of a wheel's radius, and by the principle of moments each wheel carries a sixth within 10 %.

    Rod: rockers turn freely about it but for their springs, so for the whole machine Sum R_i x_i = W x_com; bogie: about its pivot.
    """
    joints = {joint.name: joint for joint in mtv.joints}
    bodies = {body.name: body.properties for body in mtv.bodies}
    x = {}
    for wheel in mtv.wheels:
        assert wheel.center[2] == pytest.approx(wheel.radius, abs=2e-6)
        x[wheel.name] = wheel.center[0]
    x_com = sum(b.mass * b.com[0] for b in bodies.values()) / sum(b.mass for b in bodies.values())
    front, middle, rear = (x[f"wheel_{place}_right"] for place in ("front", "middle", "rear"))
    pivot = joints["bogie_right"].point[0]
    carried = sum(bodies[n].mass * (bodies[n].com[0] - pivot) for n in ("bogie_right", "wheel_front_right", "wheel_middle_right"))
    equations = np.array([[1, 1, 1], [front, middle, rear], [front - pivot, middle - pivot, 0]])
    loads = np.linalg.solve(equations, [0.5, 0.5 * x_com, carried / sum(b.mass for b in bodies.values())])
    np.testing.assert_allclose(loads, 1 / 6, rtol=0.1)


@pytest.fixture(scope="module")
def model(mtv: Rover, repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Database with the machine and the ground of the example."""
    database = tmp_path_factory.mktemp("openbot") / "mtv.db"
    store.create(database)
    store.write_rover(database, mtv)
    built = rille("terrain", "build", repository / "examples/openbot/ground.toml", "-o", database)
    assert built.returncode == 0, built.stderr
    return database


def run(model: Path, scenario: Path) -> tuple[dict[str, Any], BodyTrace, np.ndarray]:
    """Summary, motion of the chassis, and times, of a scenario run by the command line."""
    done = rille("run", model, "--scenario", scenario, "--json", "--force")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["status"] == "done"
    trace = store.read_trace(model, report["run_id"])
    return report["summary"], next(body for body in trace.bodies if body.name == "chassis"), trace.time


def tilt(chassis: BodyTrace) -> np.ndarray:
    """Angle between the chassis' z and the vertical [deg]."""
    _, x, y, _ = chassis.rotation.T
    return np.degrees(np.arccos(np.clip(1 - 2 * (x**2 + y**2), -1, 1)))


def test_it_drives_over_the_bump_on_six_wheels(model, repository):
    """7 s at 0.5 m/s; the bump is half a wheel's radius high, under the left wheels. The springs keep the chassis level."""
    summary, chassis, time = run(model, repository / "examples/openbot/drive.toml")
    assert summary["distance"] > 2.5
    assert len(summary["wheels"]) == 6
    for wheel in summary["wheels"]:
        assert abs(wheel["mean_slip_ratio"]) < 0.3, wheel
        assert 0.05 < wheel["mean_normal_load"] / WEIGHT < 0.3, wheel
    assert sum(w["mean_normal_load"] for w in summary["wheels"]) == pytest.approx(WEIGHT, rel=0.02)  # the bump throws it up a little
    assert tilt(chassis).max() < 10
    assert tilt(chassis)[time < 1.0].max() < 2
    assert np.abs(chassis.rotation[:, 3]).max() < 0.1  # it keeps its heading


def test_it_turns_on_the_spot_like_a_tank(model, repository):
    _, chassis, _ = run(model, repository / "examples/openbot/turn.toml")
    yaw = np.unwrap(2 * np.arctan2(chassis.rotation[:, 3], chassis.rotation[:, 0]))
    assert yaw[-1] > 3  # to the left
    assert np.linalg.norm(chassis.position[-1] - chassis.position[0]) < 0.2
    assert tilt(chassis).max() < 10


def script(path: Path):
    """A script as a module."""
    spec = importlib.util.spec_from_file_location(f"{path.parent.name}_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # its dataclasses look themselves up there
    spec.loader.exec_module(module)
    return module


def test_the_sheet_is_what_its_script_writes(mtv, repository):
    folder = repository / "examples/openbot"
    assert script(folder / "make_sheet.py").sheet() == (folder / "openbot.toml").read_text(encoding="utf-8")
