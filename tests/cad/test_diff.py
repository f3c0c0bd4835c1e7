"""What differs is said, in numbers that follow from the change that was made; what does not, is not."""

import json
from dataclasses import replace

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from check_machines import bar_and_post, box_part, cart, with_mass, with_place, with_row
from rille import store
from rille.cad.diff import TABLES, diff
from rille.cli import cad_check
from rille.model import CollisionShape, Effect, Grouser, JointLimit, Material, Pose, Sensor, SourceFile


def fields(a, b, **options):
    return {(c.table, c.name, c.field or c.kind): c for c in diff(a, b, **options)}


def full():
    """The cart with a row in every table."""
    return replace(
        cart(),
        materials=(Material(name="aluminium", density=2700.0, source="nominal"),),
        collision_shapes=(
            CollisionShape(body="chassis", kind="box", pose=Pose(position=(0, 0, 0.3)), size=(0.6, 0.3, 0.2)),
            CollisionShape(body="wheel_left", kind="cylinder", pose=Pose(position=(0.15, 0.215, 0.3)), size=(0.1, 0.06)),
            CollisionShape(body="wheel_right", kind="hull", pose=Pose(), vertices=np.eye(4, 3)),
        ),
        sensors=(Sensor(name="imu", quantity="body.acceleration", target="chassis", rate=100.0),),
        effects=(Effect(kind="dry_friction", target="wheel_left", parameters={"torque": 0.1}),),
        sources=(SourceFile(subject="rover", file="cart.step", sha256="a" * 64, tool="rille 0.2.0"),),
    )


def test_equal_models_have_no_difference():
    assert diff(full(), full()) == []
    noisy = with_mass(full(), "chassis", mass=23.0 * (1 + 1e-12))
    assert diff(full(), noisy) == []


def test_mass_and_total():
    changes = diff(full(), with_mass(full(), "arm_left", mass=0.88))
    assert [c.table for c in changes] == ["model", "model", "body"]
    body = next(c for c in changes if c.table == "body")
    assert (body.before, body.after, body.unit) == (pytest.approx(0.8), pytest.approx(0.88), "kg")
    assert (body.absolute, body.relative) == (pytest.approx(0.08), pytest.approx(0.1))
    assert body.sentence == "mass: 0.8 kg -> 0.88 kg, +0.08 kg (+10 %)"
    total = next(c for c in changes if c.field == "total mass")
    assert total.absolute == pytest.approx(0.08)
    # the arm is 165 mm to the left: the centre of all moves by 0.08 kg * 165 mm / 28.68 kg, less what z does
    center = next(c for c in changes if c.field == "centre of mass of all")
    assert center.after[1] - center.before[1] == pytest.approx(0.08 * 165 / 28.68)


def test_centre_and_inertia():
    changed = fields(full(), with_mass(full(), "chassis", com=[0.03, 0.04, 0.3]))
    com = cart().bodies[0].properties.com
    assert changed["body", "chassis", "centre of mass"].absolute == pytest.approx(1e3 * np.linalg.norm([0.03, 0.04, 0.3 - com[2]]))
    inertia = cart().bodies[0].properties.inertia
    (change,) = diff(full(), with_mass(full(), "chassis", inertia=1.25 * inertia))
    assert (change.field, change.relative) == ("inertia", pytest.approx(0.25))
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    (change,) = diff(full(), with_mass(full(), "chassis", inertia=turn @ inertia @ turn.T))
    assert "in other directions" in change.sentence


def test_joints_limits_and_drives():
    angle = np.deg2rad(2)
    changed = fields(full(), with_row(full(), "joints", "arm_left", axis=(0.0, float(np.cos(angle)), float(np.sin(angle)))))
    assert changed["joint", "arm_left", "axis"].absolute == pytest.approx(2.0)
    changed = fields(full(), with_row(full(), "joints", "arm_left", point=(0.003, 0.169, 0.3)))
    assert changed["joint", "arm_left", "point"].absolute == pytest.approx(5.0)
    assert changed["joint", "arm_left", "point"].unit == "mm"
    limit = JointLimit(lower=np.deg2rad(-30), upper=np.deg2rad(35), stiffness=500.0)
    changed = fields(full(), with_row(full(), "joints", "arm_left", limit=limit))
    assert changed["joint", "arm_left", "lower limit"].after == pytest.approx(-30)
    assert changed["joint", "arm_left", "lower limit"].sentence == "lower limit: -35 deg -> -30 deg, +5 deg (+14.3 %)"
    assert changed["joint", "arm_left", "stiffness of stops"].before is None
    assert ("joint", "arm_left", "upper limit") not in changed
    changed = fields(full(), with_row(full(), "joints", "arm_left", limit=None))
    assert changed["joint", "arm_left", "upper limit"].sentence == "upper limit: 35 deg -> none"
    changed = fields(full(), with_row(full(), "drives", "wheel_left", max_torque=7.5, mode="torque"))
    assert changed["drive", "wheel_left", "max_torque"].relative == pytest.approx(0.5)
    assert changed["drive", "wheel_left", "mode"].after == "torque"


def test_the_other_tables():
    other = full()
    other = with_row(other, "wheels", "wheel_left", radius=0.11, grouser=Grouser(count=24, height=0.01, thickness=0.003))
    other = with_row(other, "materials", "aluminium", density=2810.0)
    other = with_row(other, "sensors", "imu", rate=200.0)
    other = with_row(other, "differentials", "differential", joint_a="arm_right", joint_b="arm_left")
    other = with_row(other, "parts", "plate", brep_hash="another", volume=0.0021)
    other = with_place(other, "cart/plate", (0.01, 0, 0))
    other = replace(
        other,
        effects=(Effect(kind="dry_friction", target="wheel_left", parameters={"torque": 0.3}),),
        sources=(replace(full().sources[0], sha256="b" * 64),),
    )
    changed = fields(full(), other)
    assert changed["wheel", "wheel_left", "radius"].absolute == pytest.approx(10)
    assert changed["wheel", "wheel_left", "count of grousers"].after == 24
    assert changed["material", "aluminium", "density"].absolute == pytest.approx(110)
    assert changed["sensor", "imu", "rate"].after == 200
    assert ("differential", "differential", "joint_a") in changed
    assert "geometry changed" in changed["part", "plate", "geometry"].sentence
    assert changed["part", "plate", "volume"].relative == pytest.approx(0.05)
    assert changed["instance", "cart/plate", "position"].absolute == pytest.approx(10)
    assert changed["effect", "dry_friction on wheel_left", "torque"].relative == pytest.approx(2)
    assert ("source", "cart.step", "content (sha256)") in changed
    order = [TABLES.index(c.table) for c in diff(full(), other)]
    assert order == sorted(order)


def test_collision():
    shapes = list(full().collision_shapes)
    bigger = replace(full(), collision_shapes=(replace(shapes[0], size=(0.6, 0.3, 0.25)), *shapes[1:]))
    (change,) = diff(full(), bigger)
    assert (change.name, change.absolute) == ("chassis", pytest.approx(50))
    two = replace(full(), collision_shapes=(shapes[0], shapes[0], *shapes[1:]))
    (change,) = diff(full(), two)
    assert change.sentence == "shapes: 1 box -> 2 boxes"
    moved = replace(full(), collision_shapes=(*shapes[:2], replace(shapes[2], vertices=np.eye(4, 3) + [0, 0, 0.002])))
    (change,) = diff(full(), moved)
    assert change.absolute == pytest.approx(2)


def test_turned_instance():
    half = np.deg2rad(15) / 2
    rover = full()
    turned = replace(
        rover.instances[1], pose=replace(rover.instances[1].pose, rotation=(float(np.cos(half)), 0.0, 0.0, float(np.sin(half))))
    )
    (change,) = diff(rover, replace(rover, instances=(rover.instances[0], turned, *rover.instances[2:])))
    assert change.absolute == pytest.approx(15)


def test_added_removed_renamed():
    rover = full()
    plate = box_part("lid", (0.5, 0.2, 0.02), 5.0)  # the same content as `plate`
    renamed = replace(
        rover,
        parts=tuple(plate if p.name == "plate" else p for p in rover.parts),
        instances=tuple(replace(i, part="lid") if i.part == "plate" else i for i in rover.instances),
    )
    (change,) = diff(rover, renamed)
    assert (change.kind, change.before, change.after) == ("renamed", "plate", "lid")
    assert change.sentence == "part 'plate' is now called 'lid'"
    fewer = replace(rover, sensors=(), materials=(*rover.materials, Material(name="steel", density=7850.0)))
    kinds = {(c.table, c.kind, c.name) for c in diff(rover, fewer)}
    assert kinds == {("sensor", "removed", "imu"), ("material", "added", "steel")}


def test_renamed_body_keeps_its_joint():
    rover = full()
    name = {"arm_left": "rocker"}
    other = replace(
        rover,
        bodies=tuple(replace(b, name=name.get(b.name, b.name)) for b in rover.bodies),
        instances=tuple(replace(i, body=name.get(i.body, i.body)) for i in rover.instances),
        joints=tuple(replace(j, parent=name.get(j.parent, j.parent), child=name.get(j.child, j.child)) for j in rover.joints),
    )
    (change,) = diff(rover, other)
    assert (change.table, change.kind, change.after) == ("body", "renamed", "rocker")


def test_change_and_its_reverse_are_symmetric():
    """Property: a change back is as large, and added is removed."""
    one, two = full(), with_row(with_mass(full(), "arm_left", mass=0.9, com=[0.01, 0.165, 0.3]), "wheels", "wheel_left", width=0.07)
    two = replace(two, sensors=())
    there, back = fields(one, two), fields(two, one)
    opposite = {"removed": "added", "added": "removed"}
    assert {(t, n, opposite.get(f, f)) for t, n, f in there} == set(back)
    for (t, n, f), change in there.items():
        if change.absolute is not None:
            assert back[t, n, f].absolute == pytest.approx(change.absolute)


# --- the verbs

app = typer.Typer()
app.command("check")(cad_check.check)
app.command("diff")(cad_check.diff)


def run(*arguments):
    return CliRunner().invoke(app, [*map(str, arguments)])


@pytest.fixture
def models(tmp_path):
    """Databases of the cart before and after a change; the second has a wheel without balance and too much mass."""
    paths = []
    for name, rover in (("a.db", cart()), ("b.db", with_mass(cart(), "arm_left", mass=0.9))):
        store.create(tmp_path / name)
        store.write_rover(tmp_path / name, rover)
        paths.append(tmp_path / name)
    return paths


def test_verb_diff(models):
    done = run("diff", *models)
    assert done.exit_code == 0
    assert "body arm_left\n  mass: 0.8 kg -> 0.9 kg, +0.1 kg (+12.5 %)" in done.stdout
    assert "3 differences" in done.stderr
    answer = json.loads(run("diff", *models, "--json").stdout)
    assert answer["differences"] == len(answer["changes"]) == 3
    assert "no difference" in run("diff", models[0], models[0]).stderr


def test_verb_check(models, tmp_path):
    done = run("check", models[0], "--samples", "4", "--mass", "28.6 kg")
    assert (done.exit_code, done.stdout) == (0, "")
    assert "nothing to report" in done.stderr
    done = run("check", models[1], "--samples", "0")
    assert done.exit_code == 0  # a warning is no error
    assert done.stdout.startswith("warning  twins.mass               arm_left, arm_right\n")
    done = run("check", models[1], "--no-interference", "--mass", "28 kg", "--mass-tolerance", "500 g", "--json")
    assert done.exit_code == 3
    answer = json.loads(done.stdout)
    assert not answer["ok"]
    assert [f["code"] for f in answer["findings"]] == ["budget.mass", "twins.mass"]
    assert answer["mobility"]["inner"] == 3
    assert run("check", models[1], "--no-interference", "--mass", "28 kg", "--mass-tolerance", "3 %").exit_code == 0


@pytest.mark.parametrize("bad", [["--mass", "140 N"], ["--mass", "0 kg"], ["--mass-tolerance", "much"], ["--samples", "-1"]])
def test_verb_check_refuses(models, bad):
    from rille.model import InputRefused

    assert isinstance(run("check", models[0], *bad).exception, InputRefused)


def test_worst_pose_is_drawn(tmp_path):
    path, picture = tmp_path / "arm.db", tmp_path / "worst.png"
    store.create(path)
    store.write_rover(path, bar_and_post())
    answer = json.loads(run("check", path, "--samples", "0", "-o", picture, "--json").stdout)
    assert {f["code"] for f in answer["findings"]} >= {"interference.range", "limits.unreachable"}
    if answer["picture"] is None:
        pytest.skip("no picture: 3-D drawing needs EGL")
    from matplotlib import pyplot

    pixels = pyplot.imread(picture)[:, :, :3]
    red = (pixels[..., 0] > 0.6) & (pixels[..., 1] < 0.35) & (pixels[..., 2] < 0.35)
    blue = (pixels[..., 2] > 0.7) & (pixels[..., 0] < 0.6)
    assert red.sum() > 500
    assert blue.sum() > 2000
