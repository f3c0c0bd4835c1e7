"""URDFs become mechanisms: real ones, our own again, unusual ones, and malformed ones as one sentence."""

import re
from dataclasses import replace

import numpy as np
import pytest

from random_machines import FACES, TETRAHEDRON, composite, random_machine
from rille import cad, store
from rille.cad.exchange import read_urdf, write_urdf
from rille.model import Differential, Gear, InputRefused
from rille.model.kinematics import forward_kinematics, movable_joints

SAME = 1e-9  # as asked; written numbers keep all digits, so that rounding is left (1e-15 was measured)


@pytest.fixture(scope="module")
def yourdfpy():
    return pytest.importorskip("yourdfpy", reason="yourdfpy is absent: pip install yourdfpy==0.0.60")


# ---------------------------------------------------------------- round trip


def same_mechanism(found, rover):
    """The same masses, joints and kinematics; frames of bodies on hinges stand at their joints."""
    bodies = {body.name: body for body in found.bodies}
    assert set(bodies) == {body.name for body in rover.bodies}
    for body in rover.bodies:
        other = bodies[body.name].properties
        assert other.mass == pytest.approx(body.properties.mass, rel=SAME)
        assert other.com == pytest.approx(body.properties.com, abs=SAME)
        assert other.inertia == pytest.approx(body.properties.inertia, abs=SAME)
        assert (other.mass_provenance, other.inertia_provenance) == ("stated", "stated")
    for a, b in zip(composite(found), composite(rover), strict=True):
        assert a == pytest.approx(b, abs=SAME)
    joints = {joint.name: joint for joint in found.joints}
    for joint in rover.joints:
        other = joints[joint.name]
        assert (other.kind, other.parent, other.child) == (joint.kind, joint.parent, joint.child)
        assert (other.limit is None) == (joint.limit is None)
        if joint.limit is not None:
            assert (other.limit.lower, other.limit.upper) == (joint.limit.lower, joint.limit.upper)
    rng = np.random.default_rng(1)
    worst = 0.0
    for _ in range(100):
        positions = {joint.name: float(rng.uniform(-2, 2)) for joint in movable_joints(rover)}
        ours, theirs = forward_kinematics(rover, positions), forward_kinematics(found, positions)
        for body in rover.bodies:
            point = np.array([0.3, -0.2, 0.1, 1.0])  # of M at the zero pose, carried by the body
            a, b = (
                x[:, :3] @ (point[:3] - o) + x[:, 3]
                for x, o in ((ours[body.name], body.frame), (theirs[body.name], bodies[body.name].frame))
            )
            worst = max(worst, np.abs(a - b).max())
    print(f"largest difference of carried points {worst:.1e} m")
    assert worst < SAME


@pytest.mark.parametrize(("seed", "held"), [(0, False), (1, False), (2, True)])
def test_random_machines_come_back(tmp_path, seed, held):
    """The model frame of a URDF is its root link's, so the free ones are given a root frame at the origin of M."""
    rover = random_machine(seed, kinds=("hinge", "prismatic", "fixed"), held=held)
    if not held:
        rover = replace(rover, bodies=(replace(rover.bodies[0], frame=(0.0, 0.0, 0.0)), *rover.bodies[1:]))
    found = read_urdf(write_urdf(rover, tmp_path), note=pytest.fail)
    same_mechanism(found, rover)
    assert len(found.parts) == 1  # one prototype, as many instances as before
    assert found.parts[0].meshes[0].vertices == pytest.approx(TETRAHEDRON.astype(np.float32), abs=0)
    assert [i.path for i in found.instances] == [f"rig/{body.name}" for body in rover.bodies]
    for a, b in zip(found.instances, sorted(rover.instances, key=lambda i: i.path), strict=True):
        assert a.pose.position == pytest.approx(b.pose.position, abs=1e-12)
        assert abs(np.dot(a.pose.rotation, b.pose.rotation)) == pytest.approx(1, abs=1e-12)
    assert [s.kind for s in found.collision_shapes] == [s.kind for s in rover.collision_shapes]
    for a, b in zip(found.collision_shapes, rover.collision_shapes, strict=True):
        assert a.size == pytest.approx(b.size, abs=0)
        assert a.pose.position == pytest.approx(b.pose.position, abs=1e-12)
        if a.kind == "hull":
            assert sorted(map(tuple, a.vertices.tolist())) == sorted(map(tuple, TETRAHEDRON.tolist()))
    assert {(d.joint, d.mode, d.max_torque, d.max_speed) for d in found.drives} == {
        (d.joint, d.mode, d.max_torque, d.max_speed) for d in rover.drives
    }
    assert {(e.kind, e.target, *e.parameters.values()) for e in found.effects} == {
        (e.kind, e.target, *e.parameters.values()) for e in rover.effects
    }


def test_the_example_rover_comes_back(repository, tmp_path):
    """STEP -> model -> URDF -> model: masses, centres, inertias and kinematics to 1e-9; the differential as a gear of -1."""
    rover = cad.build(repository / "examples/rover/rover.toml")
    found = read_urdf(write_urdf(rover, tmp_path, mimic=True), note=pytest.fail)
    same_mechanism(found, rover)
    assert found.gears == (Gear(name="rocker_right_mimic", joint_a="rocker_left", joint_b="rocker_right", ratio=-1.0),)
    assert [i.path for i in found.instances] == [i.path for body in rover.bodies for i in rover.instances if i.body == body.name]
    store.create(tmp_path / "again.db")
    store.write_rover(tmp_path / "again.db", found)
    assert composite(store.read_rover(tmp_path / "again.db"))[0] == pytest.approx(composite(rover)[0], rel=1e-12)


def test_opposed_axes_of_a_differential_come_back_with_their_sign(tmp_path):
    rover = random_machine(0, n_bodies=3, kinds=("hinge",))
    a, b = rover.joints
    root = rover.bodies[0].name
    a = replace(a, parent=root, axis=(0.0, 0.6, 0.8))
    b = replace(b, parent=root, axis=(0.0, -0.6, -0.8))
    rover = replace(rover, joints=(a, b), differentials=(Differential(name="d", carrier=root, joint_a=a.name, joint_b=b.name),))
    assert read_urdf(write_urdf(rover, tmp_path, mimic=True)).gears[0].ratio == 1.0


# ---------------------------------------------------------------- a real arm


@pytest.mark.parametrize("file", ["so101_new_calib", "so101_old_calib"])
def test_so101_is_the_arm_that_yourdfpy_reads(rille_data, yourdfpy, file):
    """A real URDF of onshape-to-robot, without its meshes: mass, inertia and kinematics as yourdfpy sees them, which shares no code."""
    path = rille_data / f"data/cad/so101/Simulation/{file}.urdf"
    said = []
    rover = read_urdf(path, note=said.append)
    assert any("13 meshes cannot be used" in sentence for sentence in said)
    with pytest.raises(InputRefused, match=r"there is no mesh 'assets/"):
        read_urdf(path, require_meshes=True)
    robot = yourdfpy.URDF.load(str(path), load_meshes=False)
    robot.update_cfg({name: 0.0 for name in robot.actuated_joint_names})
    mass = sum(link.inertial.mass for link in robot.link_map.values() if link.inertial is not None)
    assert composite(rover)[0] == pytest.approx(mass, rel=1e-12)
    for body in rover.bodies:
        inertial = robot.link_map[body.name].inertial
        place = np.array(robot.get_transform(body.name)) @ inertial.origin
        # The gripper also carries a lumped frame of 1e-9 kg, 0.1 m away.
        assert body.properties.com == pytest.approx(place[:3, 3], abs=1e-8)
        assert body.properties.inertia == pytest.approx(place[:3, :3] @ inertial.inertia @ place[:3, :3].T, abs=1e-10)
    bodies = {body.name: body for body in rover.bodies}
    zero = {name: np.array(robot.get_transform(name)) for name in bodies}
    rng = np.random.default_rng(0)
    worst = 0.0
    for _ in range(100):
        positions = {joint.name: float(rng.uniform(-1, 1)) for joint in movable_joints(rover)}
        robot.update_cfg(positions)
        for name, pose in forward_kinematics(rover, positions).items():
            expected = np.array(robot.get_transform(name))
            worst = max(
                worst, np.abs(pose[:3, 3] - expected[:3, 3]).max(), np.abs(pose[:3, :3] @ zero[name][:3, :3] - expected[:3, :3]).max()
            )
    print(f"largest difference of forward kinematics {worst:.1e} m")
    assert worst < SAME
    assert {drive.mode for drive in rover.drives} == {"position"}
    assert {drive.max_torque for drive in rover.drives} == {10.0}


# ---------------------------------------------------------------- what URDFs say

INERTIAL = '<inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>'


def link(name, *more, inertial=INERTIAL):
    return f'<link name="{name}">{inertial}{"".join(more)}</link>'


def joint(name, parent, child, kind="continuous", more=""):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{more}</joint>'


@pytest.fixture
def robot(tmp_path):
    """Writer of a URDF from its elements."""

    def write(*elements):
        path = tmp_path / "robot.urdf"
        path.write_text(f'<robot name="r">{"".join(elements)}</robot>')
        return path

    return write


def test_inertials_are_turned_into_the_model(robot):
    """A quarter turn about z of the link and one about x of the inertial: principal moments a, b, c land on y, z, x."""
    inertial = (
        '<inertial><origin xyz="1 2 3" rpy="1.5707963267948966 0 0"/><mass value="2"/><inertia ixx="0.1" iyy="0.15" izz="0.2"/></inertial>'
    )
    more = '<origin xyz="10 0 0" rpy="0 0 1.5707963267948966"/><axis xyz="1 0 0"/>'
    rover = read_urdf(robot(link("a"), link("b", inertial=inertial), joint("j", "a", "b", more=more)))
    body = rover.bodies[1]
    assert body.frame == (10, 0, 0)
    assert body.properties.com == pytest.approx([8, 1, 3], abs=1e-14)
    assert body.properties.inertia == pytest.approx(np.diag([0.2, 0.1, 0.15]), abs=1e-15)
    assert rover.joints[0].axis == pytest.approx((0, 1, 0), abs=1e-15)


def test_links_without_mass_join_what_they_are_fixed_to(robot):
    """base_footprint (no mass) - fixed - base - fixed - camera (no mass) - continuous - mast."""
    box = '<visual><geometry><box size="1 1 1"/></geometry></visual><collision><geometry><sphere radius="0.5"/></geometry></collision>'
    said = []
    rover = read_urdf(
        robot(
            '<link name="base_footprint"/>',
            link("base"),
            link("camera", box, inertial=""),
            link("mast"),
            joint("f1", "base_footprint", "base", "fixed", '<origin xyz="0 0 1"/>'),
            joint("f2", "base", "camera", "fixed", '<origin xyz="0 0 2"/>'),
            joint("pan", "camera", "mast", more='<origin xyz="0 0 3"/>'),
        ),
        note=said.append,
    )
    assert [body.name for body in rover.bodies] == ["base", "mast"]
    assert rover.bodies[0].properties.com == pytest.approx([0, 0, 1])
    assert [(j.name, j.parent, j.child, j.point) for j in rover.joints] == [("pan", "base", "mast", (0, 0, 6))]
    assert rover.instances[0].body == rover.collision_shapes[0].body == "base"
    assert rover.collision_shapes[0].pose.position == (0, 0, 3)
    assert len(said) == 1
    assert "'base_footprint', 'camera'" in said[0]


def test_a_lumped_mass_is_carried_with_its_lever(robot):
    """A point of 1 kg fixed 3 m above 2 kg: mass 3, centre at 1 m, inertia + 2 1^2 + 1 2^2 = 6 about x and y (Huygens-Steiner)."""
    point = '<inertial><mass value="1"/><inertia ixx="0" iyy="0" izz="0"/></inertial>'
    rover = read_urdf(robot(link("a"), link("p", inertial=point), joint("f", "a", "p", "fixed", '<origin xyz="0 0 3"/>')))
    assert len(rover.bodies) == 1
    assert rover.bodies[0].properties.mass == 3
    assert rover.bodies[0].properties.com == pytest.approx([0, 0, 1], abs=1e-15)
    assert rover.bodies[0].properties.inertia == pytest.approx(np.diag([6.1, 6.1, 0.1]), abs=1e-14)


def test_who_holds_the_mechanism(robot):
    held = read_urdf(robot('<link name="world"/>', link("a"), joint("j", "world", "a", "fixed", '<origin xyz="0 0 1"/>')))
    assert [(j.kind, j.parent) for j in held.joints] == [("fixed", None)]
    said = []
    arm = read_urdf(robot('<link name="foot"/>', link("a"), joint("j", "foot", "a")), note=said.append)
    assert arm.joints[0].parent is None
    assert "taken as the world" in said[0]
    free = read_urdf(robot('<link name="world"/>', link("a"), joint("j", "world", "a", "floating", '<origin xyz="0 0 1"/>')))
    assert free.joints == ()
    assert free.bodies[0].frame == (0, 0, 1)
    assert read_urdf(robot(link("a"), link("b"), joint("j", "a", "b"))).joints[0].parent == "a"  # a root with mass floats


def test_limits_mimic_and_friction(robot):
    said = []
    rover = read_urdf(
        robot(
            *(link(name) for name in "abcdef"),
            joint(
                "j1", "a", "b", "revolute", '<limit lower="-1" upper="2" effort="5" velocity="3"/><dynamics damping="0.1" friction="0.2"/>'
            ),
            joint("j2", "a", "c", more='<mimic joint="j1" multiplier="-2"/><axis xyz="0 0 2"/>'),
            joint("j3", "a", "d", "prismatic", '<limit lower="-inf" upper="inf" effort="1" velocity="1"/>'),
            joint("j4", "a", "e", "revolute", '<limit effort="1" velocity="1"/>'),
            joint("j5", "a", "f", more='<limit effort="0" velocity="1"/>'),
            '<transmission name="t"><joint name="j1"><hardwareInterface>VelocityJointInterface</hardwareInterface></joint></transmission>',
            '<ros2_control name="x"><joint name="j3"><command_interface name="effort"/></joint>'
            '<joint name="j5"><command_interface name="velocity"/></joint></ros2_control>',
            "<gazebo/>",
        ),
        note=said.append,
    )
    joints = {j.name: j for j in rover.joints}
    assert (joints["j1"].limit.lower, joints["j1"].limit.upper) == (-1, 2)
    assert joints["j1"].axis == (1, 0, 0)  # the default of URDF
    assert joints["j2"].axis == (0, 0, 1)
    assert joints["j3"].limit is None
    assert joints["j4"].kind == "fixed"
    assert rover.gears == (Gear(name="j2_mimic", joint_a="j1", joint_b="j2", ratio=-2.0),)
    assert [(d.joint, d.mode, d.max_torque, d.max_speed) for d in rover.drives] == [("j1", "speed", 5, 3), ("j3", "torque", 1, 1)]
    assert [(e.kind, e.target, dict(e.parameters)) for e in rover.effects] == [
        ("viscous_friction", "j1", {"coefficient": 0.1}),
        ("coulomb_friction", "j1", {"torque": 0.2}),
    ]
    assert any("not read of 'robot.urdf': <gazebo>" in sentence for sentence in said)
    assert any("limits of joint 'j4' are 0, so it is fixed" in sentence for sentence in said)
    assert any("j5 are driven but state no effort" in sentence for sentence in said)


def test_meshes_of_every_kind_and_place(robot, tmp_path):
    """STL, OBJ, COLLADA in centimetres; relative, package:// of the folder above and of a folder beside; scaled and mirrored."""
    import trimesh

    mesh = trimesh.Trimesh(TETRAHEDRON, FACES, process=False)
    for file in ("meshes/a.stl", "other_package/b.obj", "robots/c.dae"):
        (tmp_path / file).parent.mkdir(exist_ok=True)
        mesh.export(tmp_path / file)
    cm = (tmp_path / "robots/c.dae").read_text()
    cm, count = re.subn(r"<unit [^>]*/>", '<unit meter="0.01" name="centimeter"/>', cm)
    if not count:
        cm = cm.replace("<up_axis>", '<unit meter="0.01" name="centimeter"/><up_axis>')
    (tmp_path / "robots/c.dae").write_text(cm)
    visual = '<{tag}><geometry><mesh filename="{file}" {scale}/></geometry>{color}</{tag}>'
    path = robot(
        '<material name="red"><color rgba="1 0 0 1"/></material>',
        link(
            "a",
            visual.format(tag="visual", file="meshes/a.stl", scale='scale="1 -2 1"', color='<material name="red"/>'),
            visual.format(tag="visual", file=f"package://{tmp_path.name}/meshes/a.stl", scale="", color=""),
            visual.format(
                tag="visual", file="package://other_package/b.obj", scale="", color='<material name="x"><color rgba="0 1 0 1"/></material>'
            ),
            visual.format(tag="visual", file="robots/c.dae", scale="", color=""),
            visual.format(tag="collision", file="meshes/a.stl", scale='scale="2 2 2"', color=""),
        ),
    )
    rover = read_urdf(path, note=pytest.fail, require_meshes=True)
    extents = [part.meshes[0].vertices.max(axis=0) - part.meshes[0].vertices.min(axis=0) for part in rover.parts]
    assert extents[0] == pytest.approx([0.1, 0.4, 0.3], abs=1e-7)
    assert extents[1] == pytest.approx([0.1, 0.2, 0.3], abs=1e-7)
    assert extents[2] == pytest.approx([0.1, 0.2, 0.3], abs=1e-7)
    assert extents[3] == pytest.approx([0.001, 0.002, 0.003], abs=1e-9)
    assert [part.color for part in rover.parts[:3]] == ["#ff0000", "#9aa0a6", "#00ff00"]
    assert rover.parts[0].volume == pytest.approx(2 * 0.001, rel=1e-6)
    # The mirror image still has its triangles counter-clockwise from outside: a positive volume by the divergence theorem.
    corners = rover.parts[0].meshes[0].vertices[rover.parts[0].meshes[0].triangles].astype(float)
    assert np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6 == pytest.approx(0.002, rel=1e-6)
    assert rover.collision_shapes[0].kind == "hull"
    assert rover.collision_shapes[0].vertices.max(axis=0) == pytest.approx([0.2, 0.4, 0.6], abs=1e-7)


def test_damaged_meshes_are_named(robot, tmp_path):
    (tmp_path / "bad.stl").write_bytes(b"\x00" * 100)
    (tmp_path / "empty.obj").write_text("")
    (tmp_path / "x.step").write_text("")
    files = ("bad.stl", "empty.obj", "x.step", "http://host/y.stl", "package://nowhere/z.stl", "a\x7f" + "b" * 5000 + ".stl")
    for file in files:
        said = []
        path = robot(link("a", f'<visual><geometry><mesh filename="{file}"/></geometry></visual>'))
        assert read_urdf(path, note=said.append).instances == ()
        assert len(said) == 1
        with pytest.raises(InputRefused) as refusal:
            read_urdf(path, require_meshes=True)
        assert "\n" not in str(refusal.value)


# ---------------------------------------------------------------- what is refused

TWO = link("a") + link("b")
LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
MALFORMED = [
    ("", "has no <link>"),
    ("<link/>", "a link has no name"),
    (link("a") + link("a"), "two links 'a'"),
    (TWO, "'a', 'b' hang on nothing"),
    (TWO + joint("j", "a", "c"), "names the link 'c', which does not exist"),
    (TWO + joint("j", "a", "a"), "with itself"),
    (TWO + joint("j", "a", "b") + joint("j", "a", "b"), "two joints 'j'"),
    (TWO + joint("j", "a", "b") + joint("k", "a", "b"), "child of joints 'j' and 'k'"),
    (TWO + joint("j", "a", "b") + joint("k", "b", "a"), "root|circle"),
    (TWO + link("c") + joint("j", "b", "c") + joint("k", "c", "b"), "circle of joints"),
    (TWO + joint("j", "a", "b", "planar"), "planar, which rille does not have"),
    (TWO + joint("j", "a", "b", "revolut", LIMIT), "did you mean 'revolute'"),
    (TWO + joint("j", "a", "b", "revolute"), "no <limit>; give lower and upper, or make it continuous"),
    (TWO + joint("j", "a", "b", "prismatic"), "no <limit>; give lower and upper"),
    (TWO + joint("j", "a", "b", "revolute", '<limit lower="2" upper="1" effort="1" velocity="1"/>'), "lower must not be above upper"),
    (TWO + joint("j", "a", "b", "revolute", '<limit lower="-inf" upper="1" effort="1" velocity="1"/>'), "two finite ones"),
    (TWO + joint("j", "a", "b", "revolute", '<limit lower="1" upper="1" effort="1" velocity="1"/>'), "away from its zero"),
    (TWO + joint("j", "a", "b", more='<axis xyz="0 0 0"/>'), "length 0; give a direction"),
    (TWO + joint("j", "a", "b", more='<axis xyz="0 0"/>'), "give three numbers"),
    (TWO + joint("j", "a", "b", more='<axis xyz="0 nan 1"/>'), "is nan; give a finite number"),
    (TWO + joint("j", "a", "b", more='<origin xyz="0 0 1,5"/>'), "'1,5', which is no number"),
    (TWO + joint("j", "a", "b", "floating"), "floats on link 'a', which has a mass"),
    (TWO + joint("j", "a", "b", more='<dynamics damping="-1"/>'), "must not be below 0"),
    (TWO + joint("j", "a", "b", more='<mimic joint="k"/>'), "mimics the joint 'k', which does not exist"),
    (TWO + joint("j", "a", "b", more='<mimic joint="j"/>'), "mimics itself"),
    (
        TWO + link("c") + joint("j", "a", "b", more='<mimic joint="k"/>') + joint("k", "a", "c", more='<mimic joint="j"/>'),
        "mimics in a circle",
    ),
    (TWO + link("c") + joint("j", "a", "b", more='<mimic joint="k" offset="1"/>') + joint("k", "a", "c"), "offset 1, but gears"),
    (TWO + link("c") + joint("j", "a", "b", more='<mimic joint="k" multiplier="0"/>') + joint("k", "a", "c"), "holds it still"),
    (TWO + link("c") + joint("j", "a", "b", more='<mimic joint="k"/>') + joint("k", "a", "c", "fixed"), "'k' is fixed"),
    ('<joint name="j" type="fixed"><parent link="a"/></joint>' + TWO, "has no child"),
    (link("a") + '<link name="b"/>' + joint("j", "a", "b"), "moves on joint 'j' but has no mass"),
    (link("a", inertial='<inertial><mass value="1"/><inertia ixx="0" iyy="0" izz="0"/></inertial>'), "has no inertia"),
    ('<link name="a"/>', "no link with a mass"),
    (link("a", inertial='<inertial><mass value="-1"/></inertial>'), "must not be below 0"),
    (link("a", inertial='<inertial><mass value="1"/></inertial>'), "no <inertia>"),
    (link("a", inertial="<inertial/>"), "has no mass"),
    (link("a", inertial='<inertial><mass value="1"/><inertia ixx="1" iyy="1"/></inertial>'), "has no izz"),
    (link("a", inertial='<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="3"/></inertial>'), "triangle inequality"),
    (link("a", inertial='<inertial><mass value="1"/><inertia ixx="-1" iyy="1" izz="1"/></inertial>'), "principal moment -1"),
    (link("a", "<visual/>"), "has no geometry"),
    (link("a", "<visual><geometry><capsule/></geometry></visual>"), "<capsule>, which URDF does not know"),
    (link("a", '<visual><geometry><box size="1 1 0"/></geometry></visual>'), "all three must be above 0"),
    (link("a", '<collision><geometry><sphere radius="-1"/></geometry></collision>'), "must be above 0"),
    (link("a", '<visual><geometry><mesh filename=""/></geometry></visual>'), "has no filename"),
    (link("a", '<visual><geometry><mesh filename="a.stl" scale="0 1 1"/></geometry></visual>'), "none may be 0"),
    (link("a") + '<material name="m"><color rgba="red"/></material>', "four numbers"),
    (link("a") + '<xacro:macro name="x"/>', "expand it first: xacro"),
]


@pytest.mark.parametrize(("elements", "words"), MALFORMED, ids=[words for _, words in MALFORMED])
def test_malformed_urdfs_are_refused_in_one_sentence(robot, elements, words):
    with pytest.raises(InputRefused, match=words) as refusal:
        read_urdf(robot(elements))
    assert "\n" not in str(refusal.value)
    assert "robot.urdf" in str(refusal.value)


LAUGHS = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (f'<!DOCTYPE robot [<!ENTITY l0 "ha">{LAUGHS}]><robot name="&l9;"/>', "the entity 'l0' is declared"),
        ('<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="r">&x;</robot>', "the entity 'x' is declared"),
        ('<!DOCTYPE robot [<!ENTITY % p SYSTEM "http://host/x.dtd"> %p;]><robot/>', "the entity 'p' is declared"),
        ("", "not well-formed"),
        ("<robot>", "not well-formed"),
        ("<sdf/>", "its root is <sdf>"),
        ("\x00\x01", "not well-formed"),
        ("<robot>\udcff</robot>", "not well-formed"),
    ],
)
def test_hostile_and_broken_xml_is_refused(tmp_path, content, words):
    path = tmp_path / "x.urdf"
    path.write_bytes(content.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputRefused, match=words):
        read_urdf(path)


def test_absent_files_and_folders_are_refused(tmp_path):
    with pytest.raises(InputRefused, match="cannot be read"):
        read_urdf(tmp_path / "no.urdf")
    with pytest.raises(InputRefused, match="is a folder"):
        read_urdf(tmp_path)


def test_fuzzed_urdfs_give_a_mechanism_or_a_sentence(tmp_path):
    """Bytes of a good file are deleted, doubled, exchanged; numbers are made odd: nothing but InputRefused comes out, in one line."""
    rng = np.random.default_rng(11)
    good = write_urdf(random_machine(0, kinds=("hinge", "prismatic", "fixed")), tmp_path).read_bytes()
    words = [b"nan", b"inf", b"-1", b"1e400", b"", b"0", b"revolute", b"planar", b"world", b"&amp;", b"<link/>", b"\xff", b'"', b"body 3"]
    numbers = [(m.start(), m.end()) for m in re.finditer(rb'"[^"<>]*"', good)]
    made, sentences = 0, []
    for trial in range(400):
        content = bytearray(good)
        for _ in range(int(rng.integers(1, 4))):
            if trial % 2:
                start, end = numbers[int(rng.integers(len(numbers)))]
                content[start + 1 : end - 1] = words[int(rng.integers(len(words)))]
            else:
                start = int(rng.integers(len(content)))
                end = start + int(rng.integers(0, 60))
                content[start:end] = words[int(rng.integers(len(words)))] if rng.random() < 0.5 else content[start:end] * 2
        path = tmp_path / "fuzz.urdf"
        path.write_bytes(bytes(content))
        try:
            read_urdf(path)
            made += 1
        except InputRefused as refusal:
            sentences.append(str(refusal))
    print(f"{made} read, {len(sentences)} refused")
    assert not [sentence for sentence in sentences if "\n" in sentence]
    assert made > 10
    assert len(sentences) > 100


# ---------------------------------------------------------------- units of meshes


UNIT_LINK = """<robot name="r"><link name="wheel">
<inertial><mass value="1.2"/><inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="cube.stl" {scale}/></geometry></visual>{collision}</link></robot>"""
UNIT_BOX = '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>'


@pytest.mark.parametrize(
    ("edge", "scale", "collision", "words"),
    [
        (200.0, "", UNIT_BOX, r'346 m large, 1000 times its collision shape .*likely in millimetres; .*scale="0.001 0.001 0.001"'),
        (20.0, "", UNIT_BOX, r'100 times its collision shape .*centimetres; .*scale="0.01 0.01 0.01"'),
        (0.2 / 0.0254, "", UNIT_BOX, r'39 times its collision shape .*inches; .*scale="0.0254 0.0254 0.0254"'),
        (0.2, 'scale="0.001 0.001 0.001"', UNIT_BOX, r"0.001 times its collision shape .*correct its scale"),
        (200.0, "", "", r"1000 times a box with its mass and inertia .*millimetres"),
        (200.0, 'scale="0.001 0.001 0.001"', UNIT_BOX, None),
        (0.6, "", UNIT_BOX, None),  # a collision shape may be much smaller than what is seen
        (2.0, "", "", None),  # and an inertia guessed
    ],
)
def test_a_mesh_in_another_unit_is_told(tmp_path, edge, scale, collision, words):
    """A cube of 0.2 m, 1.2 kg: m a^2 / 6 = 0.008 kg m^2."""
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((edge, edge, edge)).export(tmp_path / "cube.stl")
    urdf = tmp_path / "r.urdf"
    urdf.write_text(UNIT_LINK.format(i=1.2 * 0.2**2 / 6, scale=scale, collision=collision))
    said: list[str] = []
    read_urdf(urdf, note=said.append)
    about = [note for note in said if "cube.stl" in note]
    assert len(about) == (words is not None)
    if words is not None:
        assert re.search(words, about[0]), about[0]


def test_what_mimics_a_joint_that_cannot_move_cannot_move(robot):
    """Position of the follower: multiplier times 0; so along a chain, whatever the order in the file."""
    told = []
    body = "".join(link(name) for name in "abcd")
    body += joint("last", "a", "d", "revolute", more='<mimic joint="next" multiplier="3"/><limit lower="-1" upper="1"/>')
    body += joint("next", "a", "c", "revolute", more='<mimic joint="lock"/><limit lower="-1" upper="1"/>')
    body += joint("lock", "a", "b", "revolute", '<limit lower="0" upper="0"/>')
    rover = read_urdf(robot(body), note=told.append)
    assert {j.name: j.kind for j in rover.joints} == {"last": "fixed", "next": "fixed", "lock": "fixed"}
    assert rover.gears == ()
    assert any("'next' mimics 'lock', which is fixed" in sentence for sentence in told)


def test_a_small_mesh_beside_a_large_one_is_a_screw(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((0.2, 0.2, 0.2)).export(tmp_path / "cube.stl")
    trimesh.creation.box((0.005, 0.005, 0.005)).export(tmp_path / "screw.stl")
    urdf = tmp_path / "r.urdf"
    screw = '<visual><geometry><mesh filename="screw.stl"/></geometry></visual>'
    urdf.write_text(UNIT_LINK.format(i=0.008, scale="", collision=UNIT_BOX + screw))
    read_urdf(urdf, note=pytest.fail)


SHEET_OF_A_URDF = 'urdf = "r.urdf"\n{}'


@pytest.mark.parametrize("key", ['up = "y"', 'tolerance = "1 mm"', 'collision = "box"', 'default_material = "steel"'])
def test_a_sheet_about_a_urdf_refuses_what_would_do_nothing(tmp_path, key):
    (tmp_path / "r.urdf").write_text(UNIT_LINK.format(i=0.008, scale="", collision=UNIT_BOX))
    (tmp_path / "r.toml").write_text(SHEET_OF_A_URDF.format(key))
    with pytest.raises(InputRefused, match=f"has both `urdf` and `{key.split()[0]}`; leave `{key.split()[0]}` out"):
        cad.build(tmp_path / "r.toml")


def test_the_budget_of_a_urdf_is_held(tmp_path):
    """A link of 1.2 kg."""
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((0.2, 0.2, 0.2)).export(tmp_path / "cube.stl")
    (tmp_path / "r.urdf").write_text(UNIT_LINK.format(i=0.008, scale="", collision=UNIT_BOX))
    said: list[str] = []
    for mass in (1.2, 1.5):
        (tmp_path / "r.toml").write_text(SHEET_OF_A_URDF.format(f"[budget]\nmass = {mass}\n"))
        cad.build(tmp_path / "r.toml", note=said.append)
    assert len(said) == 1
    assert "-20 % off its budget of 1.5 kg" in said[0]
