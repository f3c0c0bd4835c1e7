"""Every check has a case that must fire and is silent on sound machines: the cart of boxes, the example rover."""

from dataclasses import replace

import numpy as np
import pytest

from check_machines import assembled, box_mesh, box_part, cart, moved_rover, with_mass, with_place, with_row
from rille import cad
from rille.cad.checks import CODES, check, examine
from rille.cad.checks.twins import other_name
from rille.model import Body, Drive, Gear, Joint, JointLimit, LoopClosure, Rover, Wheel

QUICK = {"samples": 4}


def found(rover, **options):
    return {(f.code, f.subject): f for f in check(rover, **(QUICK | options))}


def codes(rover, **options):
    return [f.code for f in check(rover, **(QUICK | options))]


def only(rover, code, **options):
    """The one finding that there is; it must have this code and say its numbers."""
    findings = check(rover, **(QUICK | options))
    assert [f.code for f in findings] == [code], [f.sentence for f in findings]
    assert "\n" not in findings[0].sentence
    assert findings[0].subject
    return findings[0]


def test_a_sound_machine_is_met_with_silence():
    report = examine(cart(), samples=64)
    assert report.findings == ()
    assert report.interference.poses > 300
    # 4 hinges less 1 equation of the differential; the free chassis has 6 more
    assert (report.mobility.joints, report.mobility.rank, report.mobility.inner, report.mobility.degrees) == (4, 1, 3, 9)


def test_every_code_is_listed_once_and_explained():
    import re
    from pathlib import Path

    folder = Path(cad.__file__).parent / "checks"
    text = "".join(p.read_text() for p in folder.glob("*.py") if p.name != "finding.py")
    assert all(re.fullmatch(r"[a-z]+\.[a-z_]+", code) and meaning for code, meaning in CODES.items())
    used = {code for code in CODES if f'"{code}"' in text}
    used |= {f"{kind}.limits" for kind in ("gear", "differential") if 'f"{kind}.limits"' in text}
    assert used == set(CODES)
    assert set(re.findall(r'code="([a-z]+\.[a-z_]+)"', text)) <= set(CODES)


# --- mass


@pytest.mark.parametrize("mass", [0.0, -1.0, np.nan])
def test_mass_must_be_positive(mass):
    finding = found(with_mass(cart(), "wheel_left", mass=mass))["mass.not_positive", "wheel_left"]
    assert finding.severity == "error"
    assert finding.bound == 0


def test_inertia_with_a_negative_moment():
    # principal moments of [[a, c], [c, a]] are a +- c
    inertia = np.array([[0.1, 0.3, 0], [0.3, 0.1, 0], [0, 0, 0.2]])
    finding = found(with_mass(cart(), "chassis", inertia=inertia))["inertia.not_positive", "chassis"]
    assert finding.value == pytest.approx(-0.2)


def test_triangle_inequality():
    finding = found(with_mass(cart(), "chassis", inertia=np.diag([0.1, 0.2, 0.4])))["inertia.triangle", "chassis"]
    assert (finding.value, finding.bound) == (pytest.approx(0.4), pytest.approx(0.3))


def test_flat_plate_keeps_the_triangle_inequality_with_equality():
    """A lamina has Izz = Ixx + Iyy exactly: allowed."""
    assert codes(with_mass(cart(), "chassis", inertia=np.diag([0.2, 0.3, 0.5]))) == []


def test_inertia_that_is_no_tensor():
    inertia = np.diag([0.2, 0.3, 0.4])
    inertia[0, 1] = 0.05
    assert "inertia.not_finite" in codes(with_mass(cart(), "chassis", inertia=inertia))
    assert "inertia.not_finite" in codes(with_mass(cart(), "chassis", inertia=np.diag([0.2, np.nan, 0.4])))


def test_center_of_mass_outside_of_the_hull():
    # the hull of chassis and plate ends at x = 0.3 m
    finding = only(with_mass(cart(), "chassis", com=[0.35, 0, 0.3]), "com.outside_hull")
    assert finding.value == pytest.approx(0.05, abs=1e-5)
    assert codes(with_mass(cart(), "chassis", com=[0.25, 0, 0.3])) == []


@pytest.mark.parametrize(("factor", "severity"), [(1e9, "error"), (1e6, "error"), (1e3, "error"), (1e-3, "warning"), (1e-6, "error")])
def test_inertia_in_other_units_shows(factor, severity):
    """g mm^2 for kg m^2 is a factor of 1e9, kg mm^2 1e6, g m^2 1e3; and the other way round."""
    chassis = next(b for b in cart().bodies if b.name == "chassis")
    finding = only(with_mass(cart(), "chassis", inertia=factor * chassis.properties.inertia), "size.inertia_magnitude")
    assert finding.severity == severity


def test_largest_gyration_is_that_of_mass_at_the_corners():
    """All mass in the 8 corners of a box (a, b, c): k_x^2 = (b^2 + c^2)/4, the bound; a little more cannot be."""
    a, b, c = size = (0.4, 0.2, 0.1)
    part = box_part("block", size, 5.0)
    corners = 5.0 / 4 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    rover = assembled({"block": [("block", part, (1, 2, 3))]})
    assert codes(with_mass(rover, "block", inertia=corners)) == []
    assert only(with_mass(rover, "block", inertia=1.01 * corners), "size.inertia_magnitude").severity == "warning"


@pytest.mark.parametrize(("density", "severity"), [(4.9, "warning"), (0.1, "error"), (26_000, "warning"), (2.7e6, "error")])
def test_density_out_of_range(density, severity):
    rover = assembled({"block": [("block", box_part("block", (0.1, 0.1, 0.1), density * 1e-3), (0, 0, 0))]})
    finding = only(rover, "size.density")
    assert (finding.severity, finding.value) == (severity, pytest.approx(density))


@pytest.mark.parametrize("density", [5.1, 75, 2700, 22_590])
def test_density_of_foam_to_osmium_is_fine(density):
    assert codes(assembled({"block": [("block", box_part("block", (0.1, 0.1, 0.1), density * 1e-3), (0, 0, 0))]})) == []


def test_lumped_mass_has_no_density():
    """A bracket of 10 cm^3 that carries 5 kg which are not drawn is not denser than osmium."""
    bracket = box_part("bracket", (0.1, 0.01, 0.01), 0.027)
    battery = replace(box_part("battery", (0.05, 0.05, 0.05), 5.0), volume=0.0, meshes=())
    rover = assembled({"arm": [("bracket", bracket, (0, 0, 0)), ("mass/battery", battery, (0, 0, 0))]})
    assert "size.density" not in codes(rover)


def test_mass_budget():
    total = 18.0 + 5.0 + 2 * 0.8 + 2 * 2.0
    assert codes(cart(), mass_budget=total) == []
    assert codes(cart(), mass_budget=total * 1.0099) == []
    finding = only(cart(), "budget.mass", mass_budget=total * 1.02)
    assert (finding.value, finding.bound, finding.severity) == (pytest.approx(total), pytest.approx(total * 1.02), "error")
    assert codes(cart(), mass_budget=total * 1.02, mass_tolerance=0.03) == []


def test_body_without_any_shape_is_noted():
    rover = cart()
    bare = replace(rover, instances=tuple(i for i in rover.instances if i.body != "wheel_left"))
    assert ("geometry.missing", "wheel_left") in found(bare)


# --- twins


@pytest.mark.parametrize(
    ("name", "twin"),
    [
        ("wheel_left", "wheel_right"),
        ("left_arm", "right_arm"),
        ("arm_l", "arm_r"),
        ("L_arm", "R_arm"),
        ("wheel_fl", "wheel_fr"),
        ("RearLeftWheel", "RearRightWheel"),
        ("leg-left-2", "leg-right-2"),
        ("leftover", None),
        ("elbow_roll", None),
        ("bracket", None),
    ],
)
def test_names_of_twins(name, twin):
    assert other_name(name) == twin
    if twin is not None:
        assert other_name(twin) == name


def test_twins_of_different_mass():
    finding = only(with_mass(cart(), "arm_right", mass=0.9), "twins.mass")
    assert finding.subject == "arm_left, arm_right"
    assert finding.value == pytest.approx(0.1)
    assert codes(with_mass(cart(), "arm_right", mass=0.803)) == []  # 0.4 %


def test_twin_with_unmirrored_centre_and_inertia():
    """A part that was mirrored by eye: products of inertia across the plane must change their sign."""
    product = np.array([[0, 1e-4, 0], [1e-4, 0, 0], [0, 0, 0]])
    arm = next(b for b in cart().bodies if b.name == "arm_left").properties
    rover = with_mass(with_mass(cart(), "arm_left", inertia=arm.inertia + product), "arm_right", inertia=arm.inertia - product)
    assert codes(rover) == []
    rover = with_mass(rover, "arm_right", inertia=arm.inertia + product)
    assert only(rover, "twins.inertia").value == pytest.approx(2e-4)
    rover = with_mass(cart(), "arm_right", com=[0.02, -0.165, 0.3])
    assert only(rover, "twins.com").value == pytest.approx(0.02, abs=1e-6)


def test_twins_are_found_by_shape_when_names_say_nothing():
    names = {"arm_left": "limb_1", "arm_right": "limb_2", "wheel_left": "disc_a", "wheel_right": "disc_b"}
    rover = cart()
    rover = replace(
        rover,
        bodies=tuple(replace(b, name=names.get(b.name, b.name)) for b in rover.bodies),
        instances=tuple(replace(i, body=names.get(i.body, i.body)) for i in rover.instances),
        joints=tuple(replace(j, child=names[j.child], parent=names.get(j.parent, j.parent)) for j in rover.joints),
    )
    assert codes(rover) == []
    assert only(with_mass(rover, "limb_2", mass=0.9), "twins.mass").subject == "limb_1, limb_2"


def test_twin_joints():
    low = JointLimit(lower=-np.deg2rad(35), upper=np.deg2rad(30))
    assert "twins.limit" in codes(with_row(cart(), "joints", "arm_left", limit=low))
    tilted = (0.0, np.cos(0.01), np.sin(0.01))
    findings = found(with_row(cart(), "joints", "arm_right", axis=tilted))
    assert findings["joint.axis_pair", "arm_left, arm_right"].value == pytest.approx(0.01)
    # a hinge's axis is a pseudovector: with the axis turned round, limits must be exchanged
    one_sided = JointLimit(lower=-np.deg2rad(10), upper=np.deg2rad(35))
    rover = replace(cart(), differentials=())
    rover = with_row(with_row(rover, "joints", "arm_left", limit=one_sided), "joints", "arm_right", limit=one_sided)
    assert codes(rover) == []
    assert only(with_row(rover, "joints", "arm_right", axis=(0.0, -1.0, 0.0)), "twins.limit").value == pytest.approx(np.deg2rad(25))
    other = JointLimit(lower=-np.deg2rad(35), upper=np.deg2rad(10))
    assert codes(with_row(rover, "joints", "arm_right", axis=(0.0, -1.0, 0.0), limit=other)) == []


def test_twin_drives_and_wheels():
    assert only(with_row(cart(), "drives", "wheel_left", max_torque=6.0), "twins.drive").value == pytest.approx(1.0)
    assert ("twins.wheel", "wheel_left, wheel_right") in found(with_row(cart(), "wheels", "wheel_right", width=0.05))


def test_twin_that_is_missing_or_another_shape():
    rover = cart()
    alone = replace(
        rover,
        differentials=(),
        joints=tuple(j for j in rover.joints if not j.name.endswith("right")),
        wheels=rover.wheels[:1],
        drives=rover.drives[:1],
        bodies=tuple(b for b in rover.bodies if not b.name.endswith("right")),
        instances=tuple(i for i in rover.instances if not i.body.endswith("right")),
    )
    assert [f.code for f in check(alone, **QUICK)] == ["twins.missing"] * 2
    short = box_part("arm_b", (0.3, 0.02, 0.04), 0.8)
    rover = replace(rover, parts=(*rover.parts, short))
    rover = replace(rover, instances=tuple(replace(i, part="arm_b") if i.body == "arm_right" else i for i in rover.instances))
    assert "twins.geometry" in codes(rover)


# --- what hangs and what touches


def test_references_that_lead_nowhere():
    assert only(with_row(cart(), "joints", "arm_left", parent="chasis"), "reference.unknown").subject == "chasis"
    assert only(with_row(cart(), "wheels", "wheel_left", joint="axle"), "reference.unknown").subject == "axle"
    assert only(Rover(), "body.none").severity == "error"


def test_body_that_nothing_connects():
    rover = cart()
    findings = found(replace(rover, differentials=(), joints=rover.joints[:2] + rover.joints[3:]))
    # without its joint arm_right and its wheel are an island of their own
    assert findings["body.unconnected", "arm_right"].severity == "error"
    assert "'wheel_right'" in findings["body.unconnected", "arm_right"].sentence
    loop = LoopClosure(name="pin", body_a="arm_right", body_b="chassis", point=(0, -0.165, 0.3))
    assert "body.unconnected" not in codes(
        replace(rover, differentials=(), joints=rover.joints[:2] + rover.joints[3:], loop_closures=(loop,))
    )


def test_two_carriers_and_circles():
    rover = cart()
    second = Joint(name="second", kind="hinge", parent="arm_left", child="arm_right", point=(0, 0, 0.3), axis=(0.0, 1.0, 0.0))
    assert "body.two_carriers" in codes(replace(rover, joints=(*rover.joints, second)))
    back = Joint(name="back", kind="fixed", parent="wheel_left", child="chassis", point=(0, 0, 0))
    findings = found(replace(rover, joints=(*rover.joints, back)))
    assert any(code == "body.circle" for code, _ in findings)


def test_part_that_floats():
    # the plate's lower face is at the chassis' upper face
    assert only(with_place(cart(), "cart/plate", (0, 0, 0.005)), "part.floating").value == pytest.approx(5e-3, abs=1e-6)
    assert codes(with_place(cart(), "cart/plate", (0, 0, 0.0001))) == []  # within 0.1 mm and the tolerances of the meshes
    assert codes(with_place(cart(), "cart/plate", (0, 0, -0.005))) == []


def test_open_surface_is_measured():
    """A plate without its upper face is no solid; its gap is still seen."""
    rover = with_place(cart(), "cart/plate", (0, 0, 0.02))
    mesh = box_mesh((0.5, 0.2, 0.02))
    mesh = replace(mesh, triangles=mesh.triangles[:-2])
    rover = replace(rover, parts=tuple(replace(p, meshes=(mesh,)) if p.name == "plate" else p for p in rover.parts))
    findings = found(rover)
    gaps = [f.value for (code, _), f in findings.items() if code == "part.floating"]
    assert gaps == [pytest.approx(0.02, rel=0.02)]
    assert any(code == "interference.skipped" for code, _ in findings)


# --- joints


def test_axis_without_length():
    assert ("joint.axis_unit", "wheel_left") in found(with_row(cart(), "joints", "wheel_left", axis=(0.0, 1.01, 0.0)))
    assert ("joint.axis_unit", "wheel_left") in found(with_row(cart(), "joints", "wheel_left", axis=(0.0, 0.0, 0.0)))


def test_hinge_far_from_its_bodies():
    finding = found(with_row(cart(), "joints", "arm_left", point=(0, 0.165, 3.0)))["joint.far", "arm_left"]
    assert finding.value == pytest.approx(3.0 - 0.32, abs=1e-3)  # the arm ends at z = 0.32


def test_limits():
    joint = lambda low, high: with_row(cart(), "joints", "wheel_left", limit=JointLimit(lower=low, upper=high))  # noqa: E731
    assert found(joint(0.5, -0.5))["limits.order", "wheel_left"].severity == "error"
    assert ("limits.zero_outside", "wheel_left") in found(joint(0.1, 0.5))
    assert ("limits.units", "wheel_left") in found(joint(-35, 35))  # degrees written as radians
    assert ("limits.units", "wheel_left") not in found(joint(-6.0, 6.0))


def test_differential():
    assert "differential.axes" in codes(with_row(cart(), "differentials", "differential", carrier="arm_left"))
    assert "differential.axes" in codes(with_row(cart(), "joints", "arm_right", axis=(0.0, 0.0, 1.0)))
    wide = JointLimit(lower=-np.deg2rad(35), upper=np.deg2rad(60))
    finding = found(with_row(cart(), "joints", "arm_left", limit=wide))["differential.limits", "differential"]
    assert finding.value == pytest.approx(np.deg2rad(25))


def test_gears():
    rover = replace(cart(), differentials=())
    gear = Gear(name="gear", joint_a="arm_left", joint_b="arm_right", ratio=1.0)
    assert codes(replace(rover, gears=(gear,))) == []
    assert only(replace(rover, gears=(replace(gear, ratio=2.0),)), "gear.limits").value == pytest.approx(np.deg2rad(35))
    assert "gear.ratio" in codes(replace(rover, gears=(replace(gear, ratio=0.0),)))
    assert "gear.ratio" in codes(replace(rover, gears=(replace(gear, joint_b="arm_left"),)))


def test_weak_drive_of_a_lever():
    """A lever of 2 kg whose middle is 0.25 m off its hinge asks 2 * 9.81 * 0.25 N m."""
    lever, post = box_part("lever", (0.5, 0.04, 0.02), 2.0), box_part("post", (0.06, 0.06, 0.06), 1.0)
    hinge = Joint(name="hinge", kind="hinge", parent="post", child="lever", point=(0, 0, 0), axis=(0.0, 1.0, 0.0))
    rover = assembled({"post": [("post", post, (0, 0.06, 0))], "lever": [("lever", lever, (0.25, 0, 0))]}, joints=(hinge,))
    weak = Drive(name="motor", joint="hinge", mode="torque", max_torque=4.9)
    assert only(replace(rover, drives=(weak,)), "drive.weak").bound == pytest.approx(2 * 9.81 * 0.25)
    assert codes(replace(rover, drives=(replace(weak, max_torque=4.91),))) == []


# --- wheels


def test_wheel_off_its_axis():
    assert found(with_row(cart(), "wheels", "wheel_left", center=(0.16, 0.215, 0.3)))["wheel.center", "wheel_left"].value == pytest.approx(
        0.01
    )
    shifted = with_row(cart(), "joints", "wheel_left", point=(0.155, 0.215, 0.3))
    shifted = with_row(shifted, "wheels", "wheel_left", center=(0.155, 0.215, 0.3))
    findings = found(shifted)
    assert findings["wheel.eccentric", "wheel_left"].value == pytest.approx(0.005, abs=1e-5)
    assert findings["wheel.unbalanced", "wheel_left"].value == pytest.approx(0.005, abs=1e-5)


def test_wheel_beside_itself():
    """A hinge point at the inside of a hub, and no centre stated."""
    machine = cart()
    wheel = next(w for w in machine.wheels if w.name == "wheel_left")
    x, y, z = wheel.center
    assert ("wheel.aside", "wheel_left") not in found(with_row(machine, "wheels", "wheel_left", center=(x, y + 0.9 * wheel.width, z)))
    findings = found(with_row(machine, "wheels", "wheel_left", center=(x, y + 1.2 * wheel.width, z)))
    assert findings["wheel.aside", "wheel_left"].value == pytest.approx(1.2 * wheel.width, rel=1e-6)


def test_wheel_of_another_size():
    both = with_row(with_row(cart(), "wheels", "wheel_left", radius=0.2), "wheels", "wheel_right", radius=0.2)
    assert codes(both) == ["wheel.radius"] * 2  # the diameter
    both = with_row(with_row(cart(), "wheels", "wheel_left", width=0.08), "wheels", "wheel_right", width=0.08)
    assert codes(both) == ["wheel.width"] * 2
    assert "wheel.joint" in codes(with_row(cart(), "joints", "wheel_left", kind="spherical"))


def test_steering_beside_the_wheel():
    leg, crown, base = (
        box_part("leg", (0.04, 0.02, 0.2), 1.0),
        box_part("crown", (0.04, 0.08, 0.02), 0.5),
        box_part("base", (0.1, 0.1, 0.1), 5.0),
    )
    wheel = next(p for p in cart().parts if p.name == "wheel")
    layout = {
        "base": [("base", base, (0, 0, 0.25))],
        "fork": [("leg", leg, (0, 0, 0.1)), ("crown", crown, (0, 0.04, 0.19))],
        "wheel": [("wheel", wheel, (0, 0.05, 0.05))],
    }
    steering = Joint(name="steering", kind="hinge", parent="base", child="fork", point=(0, 0.05, 0.2), axis=(0.0, 0.0, 1.0))
    axle = Joint(name="axle", kind="hinge", parent="fork", child="wheel", point=(0, 0.05, 0.05), axis=(0.0, 1.0, 0.0))
    spec = Wheel(name="wheel", joint="axle", center=(0, 0.05, 0.05), radius=0.1, width=0.06)
    rover = assembled(layout, joints=(steering, axle), wheels=(spec,))
    assert codes(rover) == []
    offset = with_row(rover, "joints", "steering", point=(0, 0.02, 0.2))
    assert only(offset, "wheel.steering_offset").value == pytest.approx(0.03)


@pytest.mark.parametrize(("degrees", "warned"), [(0, False), (29, False), (31, True), (90, True)])
def test_a_wheel_turns_about_a_level_axis(degrees, warned):
    """Camber tilts an axle by some degrees; one that stands upright was forgotten or is of another frame."""
    angle = np.deg2rad(degrees)
    tilted = with_row(cart(), "joints", "wheel_left", axis=(0.0, float(np.cos(angle)), float(np.sin(angle))))
    finding = found(tilted).get(("wheel.axis", "wheel_left"))
    assert (finding is not None) == warned
    if finding is not None:
        assert (finding.severity, finding.value) == ("warning", pytest.approx(angle))


# --- loops


def four_bar(closing=(0.4, 0.045, 0.2)):
    """Parallelogram: base, two cranks of 0.2, a coupler of 0.4, beside each other in y. One motion is left."""
    base, crank, coupler = (
        box_part("base", (0.5, 0.02, 0.03), 3.0),
        box_part("crank", (0.03, 0.02, 0.23), 0.5),
        box_part("bar", (0.43, 0.02, 0.03), 1.0),
    )
    layout = {
        "base": [("base", base, (0.2, 0, 0))],
        "crank_a": [("crank_a", crank, (0, 0.03, 0.1))],
        "crank_b": [("crank_b", crank, (0.4, 0.03, 0.1))],
        "coupler": [("coupler", coupler, (0.2, 0.06, 0.2))],
    }
    y = (0.0, 1.0, 0.0)
    limit = JointLimit(lower=-0.6, upper=0.6)
    joints = (
        Joint(name="ground", kind="fixed", parent=None, child="base", point=(0, 0, 0)),
        Joint(name="a", kind="hinge", parent="base", child="crank_a", point=(0, 0, 0), axis=y, limit=limit),
        Joint(name="b", kind="hinge", parent="base", child="crank_b", point=(0.4, 0, 0), axis=y, limit=limit),
        Joint(name="c", kind="hinge", parent="crank_a", child="coupler", point=(0, 0, 0.2), axis=y, limit=limit),
    )
    loop = LoopClosure(name="pin", body_a="coupler", body_b="crank_b", point=closing)
    return assembled(layout, joints=joints, loop_closures=(loop,))


def test_four_bar_has_one_motion_and_one_constraint_too_many():
    """Three equations at the pin; that across the plane is empty: rank 2 of 3, 3 hinges - 2 = 1 motion."""
    report = examine(four_bar(), **QUICK)
    assert [f.code for f in report.findings] == ["mobility.redundant"]
    m = report.mobility
    assert (m.joints, m.constraints, m.rank, m.inner, m.degrees) == (3, 3, 2, 1, 1)
    assert report.interference.impossible < report.interference.poses


def test_loop_that_is_open_in_the_drawing():
    finding = found(four_bar(closing=(0.4, 0.045, 0.4)))["loop.open", "pin"]
    assert finding.severity == "error"
    assert finding.value == pytest.approx(0.4 - 0.215, abs=0.01)


def test_locked_mechanism():
    rover = four_bar()
    gear = Gear(name="gear", joint_a="a", joint_b="b", ratio=-1.0)  # the cranks of a parallelogram turn alike
    assert "mobility.locked" in codes(replace(rover, gears=(gear,)))
    assert "mobility.locked" not in codes(replace(rover, gears=(replace(gear, ratio=1.0),)))


# --- whole machines


@pytest.mark.parametrize("seed", range(3))
def test_findings_do_not_depend_on_the_frame(seed):
    """Property: the same machine, drawn elsewhere and turned, is judged alike, number by number."""
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(seed)
    rover = with_place(cart(), "cart/plate", (0, 0, 0.004))
    rover = with_mass(with_mass(rover, "arm_right", mass=0.9), "wheel_left", com=[0.4, 0.3, 0.2])
    rover = with_row(rover, "joints", "arm_right", axis=(0.0, float(np.cos(0.1)), float(np.sin(0.1))))
    rover = with_place(rover, "cart/wheel_right", (0, 0.02, 0))
    turn = Rotation.random(rng=rng)
    x, y, z, w = turn.as_quat()
    other = moved_rover(rover, turn.as_matrix(), rng.uniform(-3, 3, 3), (w, x, y, z))
    one, two = (check(r, samples=8) for r in (rover, other))
    assert len(one) > 5
    assert [(f.code, f.severity, f.subject) for f in one] == [(f.code, f.severity, f.subject) for f in two]
    for f, g in zip(one, two, strict=True):
        if f.value is not None:
            # vertices are single precision, 3 m away: 2e-7 m in lengths of centimetres; depths are volumes over areas of them
            assert g.value == pytest.approx(f.value, rel=2e-3, abs=2e-6), f.sentence


def test_example_rover_is_met_with_silence(repository):
    rover = cad.build(repository / "examples/rover/rover.toml")
    report = examine(rover, mass_budget=140.0, mass_tolerance=0.01, samples=16)
    assert [f.sentence for f in report.findings] == []
    assert report.interference.poses > 900
    assert report.interference.complete


def test_real_double_pendulum(repository, rille_data, monkeypatch):
    """The sheet swaps the levers of the drawing; the weight, which stays, then hangs in the wide hole of the other lever: 5.5 mm of air."""
    monkeypatch.setenv("RILLE_DATA", str(rille_data))
    findings = check(cad.build(repository / "examples/double_pendulum/pendulum.toml"), samples=0)
    assert [f.code for f in findings] == ["part.floating"]
    assert "weight" in findings[0].subject
    assert findings[0].value == pytest.approx(5.5e-3, abs=1e-5)


def test_no_body_at_all_in_a_loop_to_the_world():
    rover = replace(
        Rover(bodies=(Body(name="bob", properties=cart().bodies[0].properties),)),
        loop_closures=(LoopClosure(name="string", body_a="bob", body_b=None, point=(0, 0, 0)),),
    )
    report = examine(rover, **QUICK)
    assert report.mobility.degrees == 3  # a pendulum on a ball
    assert "mobility.locked" not in [f.code for f in report.findings]
