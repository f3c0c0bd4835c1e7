"""Interference over the joints' ranges, against angles and volumes in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from check_machines import FLAT, assembled, bar_and_post, box_mesh, box_part, cart, cylinder_mesh, properties, with_place, with_row
from rille.cad.checks import check
from rille.cad.checks.interference import find_interference
from rille.model import CollisionShape, Differential, Gear, Joint, JointLimit, LoopClosure, Part

STEP = np.deg2rad(3)
Z = (0.0, 0.0, 1.0)


def limit(low, high):
    return JointLimit(lower=np.deg2rad(low), upper=np.deg2rad(high))


def test_bar_meets_a_post_at_the_known_angle():
    """The bar's upper edge, y' = w/2 in its own axes, reaches the corner (d, h) when h cos t - d sin t = w/2:
    t = atan2(h, d) - asin(w / 2R), R = |(d, h)|; the corner farther out is met first."""
    d, h, w = 0.34, 0.10, 0.04
    angle = np.arctan2(h, d) - np.arcsin(w / 2 / np.hypot(d, h))
    report = find_interference(bar_and_post(), samples=0)
    (reach,) = report.reaches
    assert (reach.joint, reach.body_a, reach.body_b) == ("hinge", "base", "bar")
    assert reach.limit == pytest.approx(np.deg2rad(60))
    # bisected to 3 deg / 2^8; an overlap counts once it is thicker than both meshes' tolerances (2 x 10 um) over a lever of 0.35 m
    assert reach.reached == pytest.approx(angle, abs=STEP / 2**8 + 10 * FLAT / 0.35)
    (worst,) = report.found
    assert worst.positions["hinge"] > angle
    assert worst.rest_volume == 0
    assert find_interference(bar_and_post(high=float(np.rad2deg(angle)) - 0.2), samples=0).found == ()


def test_volume_of_the_overlap_is_exact():
    """A slab slides into a wall by 30 mm: 30 x 40 x 20 mm^3, its thickness 2 V / A."""
    wall, slab = box_part("wall", (0.1, 0.2, 0.2), 1.0), box_part("slab", (0.1, 0.04, 0.02), 1.0)
    slide = Joint(
        name="slide",
        kind="prismatic",
        parent="wall",
        child="slab",
        point=(0, 0, 0),
        axis=(1.0, 0, 0),
        limit=JointLimit(lower=-0.1, upper=0.05),
    )
    layout = {"wall": [("wall", wall, (0.12, 0, 0))], "slab": [("slab", slab, (0, 0, 0))]}
    report = find_interference(assembled(layout, joints=(slide,)), samples=0)
    (worst,) = report.found
    assert worst.volume == pytest.approx(0.03 * 0.04 * 0.02, rel=1e-4)
    area = 2 * (0.03 * 0.04 + 0.04 * 0.02 + 0.03 * 0.02)
    assert worst.depth == pytest.approx(2 * 0.03 * 0.04 * 0.02 / area, rel=1e-4)
    assert worst.positions == {"slide": pytest.approx(0.05)}
    assert worst.overlap.vertices.min(axis=0) == pytest.approx([0.07, -0.02, -0.01], abs=1e-6)
    assert worst.overlap.vertices.max(axis=0) == pytest.approx([0.10, 0.02, 0.01], abs=1e-6)
    (reach,) = report.reaches
    assert reach.reached == pytest.approx(0.02, abs=0.15 / 40 / 2**8 + 10 * FLAT)


def two_arms(distance=0.5, length=0.4, gears=(), differentials=(), axis_b=Z, low=-40.0, high=40.0):
    """Two bars along y on parallel hinges ``distance`` apart; they meet only where both lean inwards."""
    base, bar = box_part("base", (distance + 0.1, 0.05, 0.02), 1.0), box_part("bar", (0.02, length, 0.02), 0.5)
    layout = {
        "base": [("base", base, (distance / 2, 0, -0.03))],
        "arm_1": [("arm_1", bar, (0, length / 2, 0))],
        "arm_2": [("arm_2", bar, (distance, length / 2, 0))],
    }
    joints = (
        Joint(name="one", kind="hinge", parent="base", child="arm_1", point=(0, 0, 0), axis=Z, limit=limit(low, high)),
        Joint(name="two", kind="hinge", parent="base", child="arm_2", point=(distance, 0, 0), axis=axis_b, limit=limit(low, high)),
    )
    return assembled(layout, joints=joints, gears=gears, differentials=differentials)


def inner_angle(distance, length, width):
    """Symmetric contact of the tips: L sin t + w/2 cos t = D/2."""
    size = np.hypot(length, width / 2)
    return np.arcsin(distance / 2 / size) - np.arctan2(width / 2, length)


def test_arms_that_meet_only_together():
    report = find_interference(two_arms(), samples=64)
    assert report.reaches == ()  # alone, a tip comes to 0.4 sin 40 = 0.26 m of 0.5 m
    (worst,) = report.found
    assert {worst.body_a, worst.body_b} == {"arm_1", "arm_2"}
    angle = inner_angle(0.5, 0.4, 0.02)
    assert (-worst.positions["one"] + worst.positions["two"]) / 2 > angle
    assert find_interference(two_arms(), samples=0).found == ()
    narrow = float(np.rad2deg(angle)) - 0.2
    assert find_interference(two_arms(low=-narrow, high=narrow), samples=256).found == ()


@pytest.mark.parametrize("ratio", [1.0, -1.0])
def test_gear_is_respected(ratio):
    """q_two = ratio q_one: geared alike the bars stay parallel; geared against each other they meet at the symmetric angle."""
    report = find_interference(two_arms(gears=(Gear(name="gear", joint_a="one", joint_b="two", ratio=ratio),)), samples=64)
    if ratio > 0:
        assert (report.found, report.reaches) == ((), ())
    else:
        (reach,) = report.reaches
        assert abs(reach.reached) == pytest.approx(inner_angle(0.5, 0.4, 0.02), abs=STEP / 2**8 + 20 * FLAT / 0.4)


@pytest.mark.parametrize(("axis", "meet"), [(Z, True), ((0.0, 0.0, -1.0), False)])
def test_differential_is_respected(axis, meet):
    """theta_a + theta_b = 2 theta_carrier about one direction: the bars turn against each other. With limits that only the outward lean of
    both, or the same lean, could meet, the sign of the second axis must not matter."""
    differential = Differential(name="differential", carrier="base", joint_a="one", joint_b="two")
    report = find_interference(two_arms(differentials=(differential,), axis_b=axis), samples=64)
    (reach,) = report.reaches
    assert abs(reach.reached) == pytest.approx(inner_angle(0.5, 0.4, 0.02), abs=STEP / 2**8 + 20 * FLAT / 0.4)
    for pair in report.found:
        same = 1 if meet else -1
        assert pair.positions["two"] == pytest.approx(-same * pair.positions["one"])


def test_press_fit_at_rest_is_no_interference():
    """A pin 0.1 mm too thick for its hole (both drawn with 64 sides, which turn against each other), and the whole way round."""
    from manifold3d import Manifold

    def ring(outer, inner, width):
        solid = Manifold.cylinder(width, outer, outer, 64, True) - Manifold.cylinder(2 * width, inner, inner, 64, True)
        mesh = solid.to_mesh()
        return np.array(mesh.vert_properties)[:, :3].astype(np.float32), np.array(mesh.tri_verts).astype(np.int32)

    vertices, triangles = ring(0.03, 0.01, 0.02)
    mesh = replace(box_mesh((1, 1, 1)), vertices=vertices, triangles=triangles, tolerance=2e-5)
    hub = Part(name="hub", volume=5e-5, properties=properties(0.2, np.diag([5e-5, 5e-5, 9e-5])), meshes=(mesh,))
    pin = cylinder_mesh(0.0101, 0.06, n=64)
    pin = replace(pin, vertices=np.ascontiguousarray(pin.vertices[:, [0, 2, 1]] * [1, -1, 1]).astype(np.float32))  # its axis along z
    shaft = Part(name="pin", volume=2e-5, properties=properties(0.1, np.diag([3e-5, 3e-5, 5e-6])), meshes=(pin,))
    hinge = Joint(name="hinge", kind="hinge", parent="hub", child="pin", point=(0, 0, 0), axis=Z)
    rover = assembled({"hub": [("hub", hub, (0, 0, 0))], "pin": [("pin", shaft, (0, 0, 0))]}, joints=(hinge,))
    report = find_interference(rover, samples=0)
    assert report.rest[0].volume > 1e-8
    assert report.found == ()


def test_overlap_at_rest_does_not_hide_another():
    """The bar is sunk 10 mm into the base's block at its hinge (a solid pin in a solid block); the post is still met."""
    rover = with_place(bar_and_post(), "base", (0, 0, 0.02))
    assert find_interference(rover, samples=0).rest[0].volume > 1e-6
    sunk = find_interference(rover, samples=0)
    free = find_interference(bar_and_post(), samples=0)
    assert sunk.found
    assert sunk.found[0].rest_volume > 1e-6
    posts = [v for v in sunk.found[0].overlap.vertices if v[0] > 0.2]
    assert posts
    assert free.reaches[0].reached >= sunk.reaches[0].reached


def test_wheels_turn_the_whole_way_round():
    """A wheel without limits meets a finger only where its knob comes round: half a turn away from the zero pose."""
    wheel, knob, finger = (
        box_part("disc", (0.1, 0.1, 0.02), 1.0),
        box_part("knob", (0.04, 0.02, 0.02), 0.1),
        box_part("finger", (0.04, 0.02, 0.02), 0.1),
    )
    arm = box_part("arm", (0.2, 0.02, 0.01), 0.5)
    layout = {
        "base": [("arm", arm, (-0.1, 0, -0.025)), ("finger", finger, (-0.12, 0, -0.01))],
        "wheel": [("disc", wheel, (0, 0, 0)), ("knob", knob, (0.11, 0, 0))],
    }
    spin = Joint(name="spin", kind="hinge", parent="base", child="wheel", point=(0, 0, 0), axis=Z)
    report = find_interference(assembled(layout, joints=(spin,)), samples=0)
    (worst,) = report.found
    assert abs(worst.positions["spin"]) > np.deg2rad(160)
    assert report.reaches == ()  # without a limit there is none that is missed


def test_loop_is_closed_in_every_pose():
    """Parallelogram: with both cranks at q, the coupler stays level, so c = -q; a post beside the far crank is met although only the near
    one is driven."""
    base, crank, bar = (
        box_part("base", (0.5, 0.02, 0.03), 3.0),
        box_part("crank", (0.02, 0.02, 0.22), 0.5),
        box_part("bar", (0.42, 0.02, 0.02), 1.0),
    )
    post = box_part("post", (0.02, 0.06, 0.2), 1.0)
    layout = {
        "base": [("base", base, (0.2, 0, 0)), ("post", post, (0.5, 0.03, 0.1))],
        "near": [("near", crank, (0, 0.03, 0.1))],
        "far": [("far", crank, (0.4, 0.03, 0.1))],
        "coupler": [("coupler", bar, (0.2, 0.06, 0.2))],
    }
    y = (0.0, 1.0, 0.0)
    joints = (
        Joint(name="ground", kind="fixed", parent=None, child="base", point=(0, 0, 0)),
        Joint(name="near", kind="hinge", parent="base", child="near", point=(0, 0, 0), axis=y, limit=limit(-60, 60)),
        Joint(name="far", kind="hinge", parent="base", child="far", point=(0.4, 0, 0), axis=y),
        Joint(name="pin", kind="hinge", parent="near", child="coupler", point=(0, 0, 0.2), axis=y),
    )
    loop = LoopClosure(name="loop", body_a="coupler", body_b="far", point=(0.4, 0.045, 0.2))
    report = find_interference(assembled(layout, joints=joints, loop_closures=(loop,)), samples=16)
    hit = {(pair.body_a, pair.body_b): pair for pair in report.found}
    worst = hit["base", "far"]
    assert worst.positions["far"] == pytest.approx(worst.positions["near"], abs=1e-6)
    assert worst.positions["pin"] == pytest.approx(-worst.positions["near"], abs=1e-6)
    near = [r for r in report.reaches if r.joint == "near" and r.limit > 0]
    # the crank's upper outer corner (w/2, h) meets the post's face, 90 mm from the hinge: w/2 cos t + h sin t = 0.09
    angle = np.arcsin(0.09 / np.hypot(0.21, 0.01)) - np.arctan2(0.01, 0.21)
    assert near[0].reached == pytest.approx(angle, abs=STEP / 2**8 + 20 * FLAT / 0.2)


def without_face(rover, part, face):
    """The rover whose box ``part`` lacks a face: 0 an end (0.0008 of 0.0496 m^2), 2 a long side (0.008)."""
    mesh = box_mesh((0.4, 0.04, 0.02))
    mesh = replace(mesh, triangles=np.delete(mesh.triangles, [2 * face, 2 * face + 1], axis=0))
    return replace(rover, parts=tuple(replace(p, meshes=(mesh,)) if p.name == part else p for p in rover.parts))


def test_open_mesh_is_taken_by_its_hull_and_said():
    rover = without_face(bar_and_post(), "bar", 2)
    report = find_interference(rover, samples=0)
    assert report.found[0].approximate
    assert "convex hull" in report.notes[0]
    assert {f.severity for f in check(rover, samples=0) if f.code == "interference.range"} == {"note"}


def test_small_hole_is_filled():
    one, two = find_interference(bar_and_post(), samples=0), find_interference(without_face(bar_and_post(), "bar", 0), samples=0)
    assert two.notes == ()
    assert two.found[0].volume == pytest.approx(one.found[0].volume, rel=1e-6)


def test_collision_shapes_stand_in_for_meshes():
    """A model without meshes (a URDF of primitives) is looked at by its collision shapes: the same boxes, the same angle."""
    rover = bar_and_post()
    size = {"base": (0.1, 0.1, 0.02), "beam": (0.4, 0.06, 0.01), "post": (0.04, 0.04, 0.1), "bar": (0.4, 0.04, 0.02)}
    shapes = tuple(CollisionShape(body=str(i.body), kind="box", pose=i.pose, size=size[i.part]) for i in rover.instances)
    bare = replace(rover, instances=(), parts=(), collision_shapes=shapes)
    one, two = find_interference(rover, samples=0), find_interference(bare, samples=0)
    assert two.found[0].volume == pytest.approx(one.found[0].volume, rel=1e-5)
    assert two.reaches[0].reached == pytest.approx(one.reaches[0].reached, abs=STEP / 2**8)


def test_inside_out_mesh_is_turned():
    rover = bar_and_post()
    mesh = box_mesh((0.4, 0.04, 0.02))
    mesh = replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]))
    inside_out = replace(rover, parts=tuple(replace(p, meshes=(mesh,)) if p.name == "bar" else p for p in rover.parts))
    one, two = find_interference(rover, samples=0), find_interference(inside_out, samples=0)
    assert two.found[0].volume == pytest.approx(one.found[0].volume, rel=1e-9)
    assert two.notes == ()


def test_same_seed_same_answer_and_time_is_bounded():
    rover = with_row(with_place(cart(), "cart/plate", (0, 0.06, -0.11)), "joints", "wheel_left", limit=None)
    one, two = find_interference(rover, samples=32, seed=3), find_interference(rover, samples=32, seed=3)
    assert [(f.body_a, f.body_b, f.volume, f.positions) for f in one.found] == [
        (f.body_a, f.body_b, f.volume, f.positions) for f in two.found
    ]
    short = find_interference(rover, samples=4096, time_limit=0.0)
    assert not short.complete
    assert "stopped" in short.notes[-1]


def test_progress_ends_at_one():
    seen = []
    find_interference(bar_and_post(), samples=0, progress=lambda what, fraction: seen.append(fraction))
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
