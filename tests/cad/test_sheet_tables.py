"""Do the tables of a sheet do what they say: masses, frames, places, mirror images, motors, stops?"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rille import store
from rille.cad import build
from rille.cad.materials import library
from rille.model import Body, InputRefused

STEEL = 7850.0


@pytest.fixture(scope="session")
def side_step(write_step) -> Path:
    """The left side of a machine: a base across the plane y = 0, and an unsymmetric arm with a bore on the left."""
    import cadquery as cq

    base = cq.Workplane().box(100, 60, 20)
    arm = cq.Workplane().box(80, 10, 30).translate((0, 45, 0)).faces(">Y").workplane(origin=(20, 50, 5)).hole(12)
    arm = arm.union(cq.Workplane().box(20, 10, 10).translate((30, 45, 20)))
    return write_step("side.step", [(base.val(), "base"), (arm.val(), "arm_left")])


@pytest.fixture
def build_sheet(tmp_path: Path) -> Callable[..., object]:
    """Builder of a sheet from its text."""

    def make(text: str, **keys):
        sheet = tmp_path / "sheet.toml"
        sheet.write_text(text, encoding="utf-8")
        return build(sheet, **keys)

    return make


def body(rover, name: str) -> Body:
    return next(b for b in rover.bodies if b.name == name)


def joint(rover, name: str):
    return next(j for j in rover.joints if j.name == name)


BASE = """
step = "{step}"
default_material = "steel"
[[body]]
name = "base"
parts = ["base"]
[[body]]
name = "arm_left"
parts = ["arm_left"]
[[joint]]
name = "pivot_left"
kind = "hinge"
parent = "base"
child = "arm_left"
"""
AXIS = 'point = ["20 mm", "50 mm", "5 mm"]\naxis = [0, 1, 0]\nlower = "-10 deg"\nupper = "60 deg"\n'


def test_library_materials_have_sources_and_plausible_densities():
    for material in library():
        assert material.source, material.name
        assert 500 < float(str(material.density).split()[0]) < 25_000


def test_materials_of_the_sheet_win_over_the_file_beside_it_and_the_library(build_sheet, side_step, tmp_path):
    volume = body(build_sheet(BASE.format(step=side_step) + AXIS), "base").properties.mass / STEEL
    assert volume == pytest.approx(0.1 * 0.06 * 0.02, rel=1e-12)
    (tmp_path / "materials.toml").write_text('[[material]]\nname = "steel"\ndensity = 8000\n')
    assert body(build_sheet(BASE.format(step=side_step) + AXIS), "base").properties.mass == pytest.approx(8000 * volume, rel=1e-12)
    own = BASE.format(step=side_step) + AXIS + '[[material]]\nname = "steel"\ndensity = "7 g/cm^3"\n'
    assert body(build_sheet(own), "base").properties.mass == pytest.approx(7000 * volume, rel=1e-12)


def test_lumped_masses_obey_the_parallel_axis_theorem(build_sheet, side_step):
    plain = body(build_sheet(BASE.format(step=side_step) + AXIS), "base").properties
    more = '[[mass]]\nname = "battery"\nbody = "base"\nmass = "2 kg"\nat = [0.1, 0, 0.2]\nsize = ["60 mm", "40 mm", "20 mm"]\n'
    more += '[[mass]]\nname = "ballast"\nbody = "base"\nmass = 1\nat = [0, 0.3, 0]\n'
    loaded = body(build_sheet(BASE.format(step=side_step) + AXIS + more), "base").properties
    box = 2 / 12 * np.diag([0.04**2 + 0.02**2, 0.06**2 + 0.02**2, 0.06**2 + 0.04**2])
    pieces = [(plain.mass, plain.com, plain.inertia), (2.0, np.array([0.1, 0, 0.2]), box), (1.0, np.array([0, 0.3, 0]), np.zeros((3, 3)))]
    mass = sum(m for m, _, _ in pieces)
    com = sum(m * c for m, c, _ in pieces) / mass
    inertia = sum(i + m * ((c - com) @ (c - com) * np.eye(3) - np.outer(c - com, c - com)) for m, c, i in pieces)
    assert loaded.mass == pytest.approx(mass, rel=1e-14)
    np.testing.assert_allclose(loaded.com, com, atol=1e-15)
    np.testing.assert_allclose(loaded.inertia, inertia, atol=1e-14)


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ("size = [0.1, 0.1, 0.1]\ninertia = [1, 1, 1, 0, 0, 0]", "mass 'm' has a size and an inertia; give one of them"),
        ('size = ["-100 mm", 0.1, 0.1]', "size of mass 'm' is -100 x 100 x 100 mm; each length must be above 0"),
    ],
)
def test_a_lumped_mass_is_one_thing(build_sheet, side_step, keys, sentence):
    with pytest.raises(InputRefused, match=sentence):
        build_sheet(BASE.format(step=side_step) + AXIS + f'[[mass]]\nname = "m"\nbody = "base"\nmass = 1\nat = [0, 0, 0]\n{keys}\n')


def test_a_move_moves_once(build_sheet, side_step):
    """However many of its patterns name an instance."""
    move = '[[move]]\nparts = ["arm_left", "arm*"]\nby = [0.1, 0, 0]\n'
    there = body(build_sheet(BASE.format(step=side_step) + AXIS), "arm_left").properties
    moved = body(build_sheet(BASE.format(step=side_step) + AXIS + move), "arm_left").properties
    np.testing.assert_allclose(moved.com - there.com, [0.1, 0, 0], atol=1e-15)


def test_a_sensor_of_a_quantity_that_there_is_not_is_refused(build_sheet, side_step):
    sensor = '[[sensor]]\nname = "s"\nquantity = "joint.positon"\ntarget = "pivot_left"\nrate = "10 Hz"\n'
    with pytest.raises(InputRefused, match=r"sensor 's' has the quantity 'joint\.positon', which is none known here; did you mean"):
        build_sheet(BASE.format(step=side_step) + AXIS + sensor)


def test_stated_values_of_a_body_override_the_sum_of_its_parts(build_sheet, side_step):
    stated = 'mass = "4 kg"\ncom = [0, 0, "10 mm"]\ninertia = [0.02, 0.03, 0.04, 0, 0, 0.001]\n'
    text = BASE.format(step=side_step).replace('parts = ["base"]\n', f'parts = ["base"]\n{stated}') + AXIS
    p = body(build_sheet('up = "y"\n' + text), "base").properties
    assert (p.mass, p.mass_provenance, p.inertia_provenance) == (4.0, "stated", "stated")
    np.testing.assert_allclose(p.com, [0, -0.01, 0], atol=1e-17)  # y of the drawing is z of M, z is -y
    np.testing.assert_allclose(p.inertia, [[0.02, 0, 0], [0, 0.04, -0.001], [0, -0.001, 0.03]], atol=1e-17)
    with pytest.raises(InputRefused, match="body 'base' has a stated centre or inertia but no stated mass"):
        build_sheet(text.replace('mass = "4 kg"\n', ""))


def test_a_joint_at_a_cylinder_finds_its_axis_and_keeps_the_sign_that_is_asked_for(build_sheet, side_step):
    frame = '[[frame]]\nname = "bore"\npart = "arm_left"\ncylinder = { radius = "6 mm" }\n'
    for sign in (1, -1):
        rover = build_sheet(BASE.format(step=side_step) + f'at = "bore"\naxis = [0, {sign}, 0]\n' + frame)
        found = joint(rover, "pivot_left")
        np.testing.assert_allclose(found.axis, [0, sign, 0], atol=1e-12)
        np.testing.assert_allclose(found.point, [0.02, 0.045, 0.005], atol=1e-9)  # the middle of the bore
    with pytest.raises(InputRefused, match=r"axis of joint 'pivot_left' is 5\.71 deg off the axis"):
        build_sheet(BASE.format(step=side_step) + 'at = "bore"\naxis = [0.1, 1, 0]\n' + frame)
    with pytest.raises(InputRefused, match=r"cylinder of radius 7 mm on part 'arm_left', which has the radii 6 \(mm\)"):
        build_sheet(BASE.format(step=side_step) + 'at = "bore"\n' + frame.replace("6 mm", "7 mm"))
    with pytest.raises(InputRefused, match="the frame 'boer', which is not on the sheet; did you mean 'bore'"):
        build_sheet(BASE.format(step=side_step) + 'at = "boer"\n' + frame)


def test_one_side_declared_gives_both_sides(build_sheet, side_step):
    """The other side's shape is mirrored, not its placement: its inertia is the mirror image, its volume stays positive."""
    wheel = '[mirror]\n[[drive]]\njoint = "pivot_left"\nmode = "position"\nmax_torque = "2 N m"\n'
    rover = build_sheet(BASE.format(step=side_step) + AXIS + wheel)
    left, right = body(rover, "arm_left").properties, body(rover, "arm_right").properties
    s = np.diag([1.0, -1.0, 1.0])
    assert right.mass == left.mass > 0
    np.testing.assert_allclose(right.com, s @ left.com, atol=1e-15)
    np.testing.assert_allclose(right.inertia, s @ left.inertia @ s, atol=1e-18)
    assert abs(left.inertia[0, 2]) > 5e-6  # the arm is not symmetric, so the test can fail
    one, other = joint(rover, "pivot_left"), joint(rover, "pivot_right")
    assert other.axis == one.axis  # both pitch forward
    assert other.point == (one.point[0], -one.point[1], one.point[2])
    assert other.limit == one.limit
    assert [d.name for d in rover.drives] == ["pivot_left", "pivot_right"]
    mesh = {p.name: p.meshes[0] for p in rover.parts}["arm_left:mirror"]
    a, b, c = (mesh.vertices[mesh.triangles[:, i]].astype(float) for i in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert volume == pytest.approx(left.mass / STEEL, rel=0.02)  # outward triangles: positive; 0.5 mm facets on a 12 mm bore


@pytest.mark.parametrize(
    ("kind", "axis", "twin", "limits"),
    [
        ("hinge", [0, 1, 0], [0, 1, 0], (-0.1, 0.5)),  # pitch: the same turn is the mirror image
        ("hinge", [0, 0, 1], [0, 0, 1], (-0.5, 0.1)),  # yaw to the left is mirrored by yaw to the right
        ("hinge", [1, 0, 0], [1, 0, 0], (-0.5, 0.1)),
        ("prismatic", [0, 1, 0], [0, 1, 0], (-0.5, 0.1)),  # a slide to the left is mirrored by one to the right
        ("prismatic", [1, 0, 0], [1, 0, 0], (-0.1, 0.5)),
        ("hinge", [0, 0.6, 0.8], [0, -0.6, 0.8], (-0.5, 0.1)),
    ],
)
def test_twin_joints_move_as_mirror_images_about_axes_that_point_the_same_way(build_sheet, side_step, kind, axis, twin, limits):
    """The mirror image of a turn by q about n is a turn by -q about S n; the limits must describe the same motions."""
    text = BASE.format(step=side_step).replace('"hinge"', f'"{kind}"')
    rover = build_sheet(text + f"point = [0.02, 0.05, 0]\naxis = {axis}\nlower = -0.1\nupper = 0.5\n[mirror]\n")
    other = joint(rover, "pivot_right")
    np.testing.assert_allclose(other.axis, twin, atol=1e-15)
    assert other.limit is not None
    assert (other.limit.lower, other.limit.upper) == pytest.approx(limits)


@pytest.mark.parametrize(
    ("kind", "axis", "sign"),
    [
        ("hinge", [0, 1, 0], 1),  # pitch and pitch
        ("hinge", [0, 0, 1], -1),  # yaw counts the other way on the other side, pitch does not
        ("prismatic", [0, 1, 0], -1),
        ("prismatic", [1, 0, 0], 1),
    ],
)
@pytest.mark.parametrize("shared", [False, True])
def test_a_gear_of_the_other_side_moves_as_its_mirror_image(build_sheet, side_step, kind, axis, sign, shared):
    """q_b = ratio q_a, from a pitching joint of the side, or from one in the middle that both sides share."""
    lever, carried = ("lever", "base") if shared else ("lever_left", "arm_left")
    text = BASE.format(step=side_step).replace('"hinge"', f'"{kind}"') + f"point = [0.02, 0.05, 0]\naxis = {axis}\n"
    text += f"""
    [[body]]
    name = "{lever}"
    parts = []
    [[mass]]
    name = "{lever}"
    body = "{lever}"
    mass = 1
    at = [0.1, {0.0 if shared else 0.05}, 0]
    size = [0.1, 0.1, 0.1]
    [[joint]]
    name = "turn_{lever}"
    kind = "hinge"
    parent = "{carried}"
    child = "{lever}"
    point = [0.1, {0.0 if shared else 0.05}, 0]
    axis = [0, 1, 0]
    [[gear]]
    name = "gear_left"
    joint_a = "turn_{lever}"
    joint_b = "pivot_left"
    ratio = 0.5
    [mirror]
    """
    rover = build_sheet(text)
    assert {g.name: g.ratio for g in rover.gears} == {"gear_left": 0.5, "gear_right": sign * 0.5}


def test_parts_are_placed_from_files_and_databases(build_sheet, side_step, tmp_path, monkeypatch):
    monkeypatch.setenv("RILLE_PARTS", str(tmp_path / "library" / "parts.db"))
    rover = build_sheet(BASE.format(step=side_step) + AXIS)
    arm = next(p for p in rover.parts if p.name == "arm_left")
    assert store.add_part(store.part_library(), arm, None) == "added"
    assert store.add_part(store.part_library(), arm, None) == "renewed"
    place = '[[body]]\nname = "b"\n[[place]]\nname = "b/arm"\npart = "{part}"\nbody = "b"\nposition = [1, 0, 0]\nrpy = [0, 0, "90 deg"]\n'
    placed = build_sheet(place.format(part="arm_left"), find_part=store.find_part)
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    p, q = body(placed, "b").properties, arm.properties
    assert p.mass == q.mass
    np.testing.assert_allclose(p.com, turn @ q.com + [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(p.inertia, turn @ q.inertia @ turn.T, atol=1e-18)
    by_digest = build_sheet(place.format(part=arm.brep_hash[:10]), find_part=store.find_part)
    assert body(by_digest, "b").properties.mass == q.mass
    with pytest.raises(InputRefused, match="has no part 'arm_lft'; did you mean 'arm_left'"):
        build_sheet(place.format(part="arm_lft"), find_part=store.find_part)
    from_file = f'default_material = "steel"\n[[body]]\nname = "b"\n[[place]]\nname = "x"\nfile = "{side_step}"\nbody = "b"\n'
    whole = build_sheet(from_file)
    assert {i.path.split("/")[1] for i in whole.instances} == {"base", "arm_left"}
    assert all(i.path.startswith("x/") for i in whole.instances)
    assert whole.bodies[0].properties.mass == pytest.approx(sum(b.properties.mass for b in rover.bodies), rel=1e-14)


def test_a_motor_line_becomes_a_drive_and_an_effect(build_sheet, side_step):
    motor = 'motor = { stall_torque = "0.5 N m", no_load_speed = "6000 rpm", gear_ratio = 100, efficiency = 0.8, torque_constant = 0.05 }\n'
    text = BASE.format(step=side_step) + AXIS + 'friction = { coulomb = "0.2 N m", viscous = "0.01 N m s/rad" }\n'
    rover = build_sheet(text + f'[[drive]]\njoint = "pivot_left"\nmode = "speed"\n{motor}')
    assert rover.drives[0].max_torque == pytest.approx(40.0)
    assert rover.drives[0].torque_constant == pytest.approx(4.0)
    effects = {e.kind: (e.target, dict(e.parameters)) for e in rover.effects}
    assert effects["motor_saturation"][1]["inverse_no_load_speed"] == pytest.approx(100 / (6000 * 2 * math.pi / 60))
    assert effects["coulomb_friction"] == ("pivot_left", {"torque": 0.2})
    assert effects["viscous_friction"] == ("pivot_left", {"coefficient": 0.01})


def test_what_was_guessed_is_not_used_before_somebody_accepts_it(build_sheet, side_step):
    text = BASE.format(step=side_step) + AXIS
    with pytest.raises(InputRefused, match="suggestions that nobody has accepted"):
        build_sheet("accepted = false\n" + text)
    assert build_sheet("accepted = true\n" + text).bodies


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ('[[loop]]\nname = "l"\nbody_a = "base"\nbody_b = "base"\npoint = [0, 0, 0]\n', "loop 'l' joins body 'base' with itself"),
        ('[[loop]]\nname = "l"\nbody_a = "base"\nbody_b = "arm_left"\n', "needs one of `at` and `point`"),
        (
            '[[mass]]\nname = "m"\nbody = "bsae"\nmass = 1\nat = [0, 0, 0]\n',
            "the body 'bsae', which is not on the sheet; did you mean 'base'",
        ),
        ('[[mass]]\nname = "m"\nbody = "base"\nmass = 0\nat = [0, 0, 0]\n', "mass of mass 'm' is 0 kg"),
        ('[[place]]\nname = "p"\nbody = "base"\n', "needs one of `file` and `part`"),
        ('[[drive]]\njoint = "pivot_left"\nmode = "speed"\n', "needs one of `max_torque` and `motor`"),
        ('[[frame]]\nname = "f"\n[[loop]]\nname = "l"\nbody_a = "base"\nat = "f"\n', "needs exactly one of `face`, `cylinder` and `point`"),
        ('urdf = "x.urdf"\n', "the key 'loop.urdf'|unknown|has both"),
    ],
)
def test_refusals_of_the_new_tables(build_sheet, side_step, more, sentence):
    with pytest.raises(InputRefused, match=sentence):
        build_sheet(BASE.format(step=side_step) + AXIS + more)


def test_a_budget_that_is_missed_is_said(build_sheet, side_step):
    said: list[str] = []
    text = BASE.format(step=side_step) + AXIS
    mass = sum(b.properties.mass for b in build_sheet(text).bodies)
    build_sheet(f'{text}[budget]\nmass = {1.02 * mass}\ntolerance = "3 %"\n', note=said.append)
    assert said == []
    build_sheet(f'{text}[budget]\nmass = {1.02 * mass}\ntolerance = "1 %"\n', note=said.append)
    assert "-2 % off its budget" in said[0]
