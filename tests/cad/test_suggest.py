"""Joints, bodies and wheels that geometry tells: small machines whose joints are known because they were drawn here."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rille.cad import build
from rille.cad.files.assembly import Assembly
from rille.cad.files.step_reader import read_step
from rille.cad.suggestion.suggest import suggest
from rille.cad.suggestion.values import THRESHOLD, SuggestedJoint, Suggestions

# Axes come from the analytic surfaces that OCCT writes with 15 digits: 1e-7 m and 1e-6 rad are its modelling tolerance.
NEAR = 1e-7
PARALLEL = 1e-6


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., tuple[Assembly, Suggestions]]:
    """Write a CadQuery assembly as STEP, read it and suggest."""

    def draw(machine) -> tuple[Assembly, Suggestions]:
        path = tmp_path_factory.mktemp("machine") / "machine.step"
        machine.export(str(path))
        assembly = read_step(path)
        return assembly, suggest(assembly)

    return draw


def sure(found: Suggestions) -> list[SuggestedJoint]:
    return [j for j in found.joints if j.confidence >= THRESHOLD]


def same_axis(joint: SuggestedJoint, point, axis) -> bool:
    """Whether a joint's axis is the line through a point [m]."""
    axis = np.array(axis, float) / np.linalg.norm(axis)
    off = np.linalg.norm(np.cross(joint.point - np.array(point, float), axis))
    return bool(off < NEAR and np.linalg.norm(np.cross(joint.axis, axis)) < PARALLEL)


def paths(assembly: Assembly, found: Suggestions) -> list[set[str]]:
    return [{assembly.instances[i].path.split("/")[-1] for i in body.instances} for body in found.bodies]


def hinge_machine():
    """A plate with a pin, an arm with a hole; the arm lies on the plate. Axis: x = 10, y = 5 mm, along z."""
    import cadquery as cq

    base = cq.Workplane().box(120, 60, 10).union(cq.Workplane(origin=(10, 5, 5)).circle(6).extrude(12))
    arm = cq.Workplane(origin=(40, 5, 5)).rect(100, 20).extrude(8).cut(cq.Workplane(origin=(10, 5, 0)).circle(6.02).extrude(30))
    return cq.Assembly(name="m").add(base, name="base").add(arm, name="arm")


def test_a_pin_in_a_hole_is_a_hinge(drawn):
    assembly, found = drawn(hinge_machine())
    (joint,) = sure(found)
    assert joint.kind == "hinge"
    assert same_axis(joint, (0.010, 0.005, 0), (0, 0, 1))
    assert (joint.parent, joint.child) == ("base", "arm")
    assert paths(assembly, found) == [{"base"}, {"arm"}]
    evidence = " ".join(joint.evidence)
    assert "hole 12.04 mm of 'arm' around shaft 12.00 mm of 'base'" in evidence
    assert "faces across the axis touch" in evidence


def test_axes_do_not_depend_on_attitude_or_place(drawn):
    """The same machine turned about a skew axis and moved by metres has its hinge turned and moved along."""
    import cadquery as cq

    turn = cq.Location((3000, -500, 40), (1, 2, 3), 77.0)
    _, found = drawn(cq.Assembly(name="world").add(hinge_machine(), loc=turn))
    (joint,) = sure(found)
    k = np.array([1.0, 2, 3]) / math.sqrt(14)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    angle = math.radians(77)
    rotation = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross  # Rodrigues
    point = rotation @ np.array([0.010, 0.005, 0]) + np.array([3.0, -0.5, 0.04])
    assert same_axis(joint, point, rotation @ np.array([0, 0, 1.0]))
    _, straight = drawn(hinge_machine())
    assert joint.confidence == sure(straight)[0].confidence


def test_a_file_in_metres_gives_the_same(write_step):
    machine = hinge_machine()
    roots = [(machine.objects[name].obj.val(), name) for name in ("base", "arm")]
    path = write_step("hinge_m.step", roots, unit="M")
    found = suggest(read_step(path))
    (joint,) = sure(found)
    assert same_axis(joint, (0.010, 0.005, 0), (0, 0, 1))


def test_four_screws_leave_no_joint(drawn):
    """Two plates, four clearance holes, four threaded holes, four screws: one body."""
    import cadquery as cq

    corners = [(x, y) for x in (-40, 40) for y in (-20, 20)]
    low = cq.Workplane().box(100, 60, 10).faces(">Z").workplane().pushPoints(corners).hole(4.2)
    high = cq.Workplane(origin=(0, 0, 10)).box(100, 60, 10).faces(">Z").workplane().pushPoints(corners).hole(5.5)
    screw = cq.Workplane().circle(4.25).extrude(5).faces("<Z").workplane().circle(2.5).extrude(18)
    machine = cq.Assembly(name="m").add(low, name="low").add(high, name="high")
    for k, (x, y) in enumerate(corners):
        machine.add(screw, name=f"fixing_{k}", loc=cq.Location((x, y, 15)))
    _, found = drawn(machine)
    assert len(found.bodies) == 1
    assert sure(found) == []


def bearing_machine(rings: str):
    """A base with a shaft, a bearing, an arm with the bearing's seat. Axis along y through (0, 0, 50) mm."""
    import cadquery as cq

    def tube(outer, inner, length, y=0.0):
        return cq.Workplane("XZ", origin=(0, y + length / 2, 50)).circle(outer).circle(inner).extrude(length)

    base = cq.Workplane().box(80, 60, 20).union(cq.Workplane(origin=(0, -25, 35)).box(30, 10, 50))
    base = base.union(cq.Workplane("XZ", origin=(0, -20, 50)).circle(5).extrude(-35))
    arm = cq.Workplane("XZ", origin=(0, 4, 90)).rect(30, 130).extrude(8)
    arm = arm.cut(cq.Workplane("XZ", origin=(0, 10, 50)).circle(11).extrude(20))
    machine = cq.Assembly(name="m").add(base, name="base").add(arm, name="arm")
    if rings == "one":
        return machine.add(tube(11, 5, 8), name="ring")
    machine = machine.add(tube(7, 5, 8), name="inner").add(tube(11, 9, 8), name="outer")
    for k in range(8):
        a = 2 * math.pi * k / 8
        ball = cq.Workplane("XY").sphere(1.0).translate((8 * math.cos(a), 0, 50 + 8 * math.sin(a)))
        machine.add(ball, name=f"ball_{k}")
    return machine


@pytest.mark.parametrize("rings", ["one", "balls"])
def test_a_hinge_through_a_bearing_is_one_hinge(drawn, rings):
    assembly, found = drawn(bearing_machine(rings))
    (joint,) = sure(found)
    assert joint.kind == "hinge"
    assert same_axis(joint, (0, 0, 0.05), (0, 1, 0))
    bodies = paths(assembly, found)
    assert len(bodies) == 2
    assert ("base" in bodies[0]) != ("arm" in bodies[0])


def test_a_carriage_on_two_rods_slides(drawn):
    import cadquery as cq

    block = cq.Workplane().box(10, 80, 40).faces(">X").workplane().pushPoints([(-25, 0), (25, 0)]).hole(10)
    rod = cq.Workplane("YZ").circle(5).extrude(300)
    carriage = cq.Workplane().box(60, 90, 30).faces(">X").workplane().pushPoints([(-25, 0), (25, 0)]).hole(10.04)
    plate = cq.Workplane(origin=(0, 0, -25)).box(320, 80, 10)
    machine = cq.Assembly(name="m").add(plate, name="plate")
    for k, x in enumerate((-150, 150)):
        machine.add(block, name=f"block_{k}", loc=cq.Location((x, 0, 0)))
    for k, y in enumerate((-25, 25)):
        machine.add(rod, name=f"rod_{k}", loc=cq.Location((-150, y, 0)))
    machine.add(carriage, name="carriage", loc=cq.Location((20, 0, 0)))
    assembly, found = drawn(machine)
    (joint,) = sure(found)
    assert joint.kind == "prismatic"
    assert abs(joint.axis[0]) == pytest.approx(1.0, abs=PARALLEL)
    assert {"carriage"} in paths(assembly, found)
    assert any("2 parallel guides" in text for text in joint.evidence)


def test_a_shaft_that_can_slide_is_less_sure_than_a_hinge(drawn):
    import cadquery as cq

    block = cq.Workplane().box(80, 60, 40).faces(">X").workplane().hole(12.04)
    shaft = cq.Workplane("YZ", origin=(-60, 0, 0)).circle(6).extrude(120).union(cq.Workplane(origin=(75, 0, 0)).box(30, 30, 10))
    _, found = drawn(cq.Assembly(name="m").add(block, name="block").add(shaft, name="crank"))
    (joint,) = found.joints
    _, sure_one = drawn(hinge_machine())
    assert joint.kind == "hinge"
    assert same_axis(joint, (0, 0, 0), (1, 0, 0))
    assert joint.confidence < sure_one.joints[0].confidence
    assert any("nothing stops a slide" in text for text in joint.doubts)


def test_an_arm_between_the_ears_of_a_fork_is_captive(drawn):
    """A bolt with its nut through a fork and an arm: 0.1 mm of play on either side stop the slide."""
    import cadquery as cq

    def drilled(shape, radius):
        return shape.cut(cq.Workplane("XZ", origin=(0, 60, 35)).circle(radius).extrude(120))

    fork = cq.Workplane().box(40, 40, 10)
    for y in (-14, 14):
        fork = fork.union(cq.Workplane(origin=(0, y, 25)).box(30, 8, 50))
    arm = cq.Workplane(origin=(0, 0, 80)).box(24, 19.8, 120)
    bolt = (
        cq.Workplane("XZ", origin=(0, 18, 35)).circle(4).extrude(46).union(cq.Workplane("XZ", origin=(0, 23, 35)).polygon(6, 15).extrude(5))
    )
    nut = (
        cq.Workplane("XZ", origin=(0, -18, 35)).polygon(6, 15).extrude(6).cut(cq.Workplane("XZ", origin=(0, 0, 35)).circle(3.4).extrude(60))
    )
    machine = cq.Assembly(name="m").add(drilled(fork, 4.1), name="fork").add(drilled(arm, 4.1), name="arm")
    assembly, found = drawn(machine.add(bolt, name="bolt").add(nut, name="nut"))
    (joint,) = sure(found)
    assert same_axis(joint, (0, 0, 0.035), (0, 1, 0))
    assert any("with 0.20 mm of play" in text for text in joint.evidence)
    assert {"arm"} in [body - {"bolt", "nut"} for body in paths(assembly, found)]


def test_a_carriage_in_a_slot_slides(drawn):
    """A T-shaped rail in a T-shaped slot: planar faces only."""
    import cadquery as cq

    rail = cq.Workplane().box(200, 10, 20).union(cq.Workplane(origin=(0, 0, 14)).box(200, 24, 8))
    rail = rail.union(cq.Workplane(origin=(0, 0, -15)).box(200, 60, 10))
    slot = cq.Workplane(origin=(10, 0, 6)).box(60, 10, 20).union(cq.Workplane(origin=(10, 0, 14)).box(60, 24, 8))
    carriage = cq.Workplane(origin=(10, 0, 16)).box(60, 50, 28).cut(slot)
    _, found = drawn(cq.Assembly(name="m").add(rail, name="rail").add(carriage, name="carriage"))
    (joint,) = sure(found)
    assert joint.kind == "prismatic"
    assert np.abs(joint.axis) == pytest.approx([1, 0, 0], abs=PARALLEL)


def test_a_ball_in_a_socket_is_spherical(drawn):
    import cadquery as cq

    socket = (
        cq.Workplane().box(40, 40, 40).cut(cq.Workplane(origin=(0, 0, 12)).sphere(12)).cut(cq.Workplane(origin=(0, 0, 30)).box(50, 50, 22))
    )
    stud = cq.Workplane(origin=(0, 0, 12)).sphere(12).union(cq.Workplane(origin=(0, 0, 15)).circle(5).extrude(60))
    _, found = drawn(cq.Assembly(name="m").add(socket, name="socket").add(stud, name="stud"))
    (joint,) = sure(found)
    assert joint.kind == "spherical"
    assert joint.point == pytest.approx([0, 0, 0.012], abs=NEAR)


def link(length: float):
    """A flat bar with a hole at either end."""
    import cadquery as cq

    ends = [(0, 0), (length, 0)]
    bar = cq.Workplane().slot2D(length + 20, 20).extrude(8).translate((length / 2, 0, 0))
    return bar.cut(cq.Workplane().pushPoints(ends).circle(5.02).extrude(8))


def test_a_four_bar_linkage_has_three_joints_and_a_closure(drawn):
    """Ground 200, crank 60, coupler 180, rocker 120 mm, pins in the holes: four hinges, one of which closes the loop."""
    import cadquery as cq

    a = math.radians(70)
    elbow = np.array([60 * math.cos(a), 60 * math.sin(a)])
    far = np.array([200.0, 0]) - elbow
    distance = float(np.linalg.norm(far))
    along = (180**2 - 120**2 + distance**2) / (2 * distance)  # circles of the coupler's and the rocker's ends (law of cosines)
    height = math.sqrt(180**2 - along**2)
    knee = elbow + (along * far + height * np.array([-far[1], far[0]])) / distance
    turn = (0, 0, 1)
    ground = cq.Workplane(origin=(0, 0, -10)).slot2D(230, 30).extrude(10).translate((100, 0, 0))
    ground = ground.cut(cq.Workplane(origin=(0, 0, -10)).pushPoints([(0, 0), (200, 0)]).circle(5).extrude(10))
    coupler_angle = math.degrees(math.atan2(*(knee - elbow)[::-1]))
    rocker_angle = math.degrees(math.atan2(knee[1], knee[0] - 200))
    machine = cq.Assembly(name="m").add(ground, name="ground")
    machine.add(link(60), name="crank", loc=cq.Location((0, 0, 0), turn, 70))
    machine.add(link(180), name="coupler", loc=cq.Location((*elbow, 8), turn, coupler_angle))
    machine.add(link(120), name="rocker", loc=cq.Location((200, 0, 0), turn, rocker_angle))
    for k, (x, y, low, high) in enumerate(((0, 0, -10, 8), (200, 0, -10, 8), (*elbow, 0, 16), (*knee, 0, 16))):
        machine.add(cq.Workplane().circle(5).extrude(high - low), name=f"pin_{k}", loc=cq.Location((x, y, low)))
    _, found = drawn(machine)
    hinges = sure(found)
    assert len(hinges) == 4
    assert [j.loop for j in hinges].count(True) == 1
    assert len(found.accepted) == 3
    for x, y in ((0, 0), (200, 0), elbow, knee):
        assert any(same_axis(j, (x * 1e-3, y * 1e-3, 0), turn) for j in hinges)


def test_a_single_part_and_loose_parts_have_no_joint(drawn):
    import cadquery as cq

    box = cq.Workplane().box(10, 20, 30)
    _, alone = drawn(cq.Assembly(box, name="alone"))
    assert alone.joints == ()
    assert len(alone.bodies) == 1
    _, apart = drawn(cq.Assembly(name="m").add(box, name="here").add(box, name="there", loc=cq.Location((50, 0, 0))))
    assert apart.joints == ()
    assert len(apart.bodies) == 1
    assert "nothing holds" in apart.notes[0]


def test_legs_of_a_table_are_no_pivots(drawn):
    """Round ends against a flat, four times, that carry nothing."""
    import cadquery as cq

    machine = cq.Assembly(name="m").add(cq.Workplane(origin=(0, 0, 100)).box(200, 100, 10), name="top")
    for k, (x, y) in enumerate((x, y) for x in (-90, 90) for y in (-40, 40)):
        machine.add(cq.Workplane().circle(6).extrude(95), name=f"leg_{k}", loc=cq.Location((x, y, 0)))
    _, found = drawn(machine)
    assert sure(found) == []
    assert len(found.bodies) == 1


def gear(teeth: int, module: float, width: float, bore: float):
    """A spur gear with straight flanks, axle along z."""
    import cadquery as cq

    pitch = module * teeth / 2
    points = []
    for k in range(teeth):
        for r, a in ((pitch - 1.1 * module, -0.28), (pitch + module, -0.12), (pitch + module, 0.12), (pitch - 1.1 * module, 0.28)):
            angle = 2 * math.pi * (k + a) / teeth
            points.append((r * math.cos(angle), r * math.sin(angle)))
    return cq.Workplane().polyline(points).close().extrude(width).cut(cq.Workplane().circle(bore).extrude(width))


def test_a_pair_of_gears_is_two_hinges_and_no_wheel(drawn):
    import cadquery as cq

    n, m = 20, 3.0
    distance = n * m
    plate = cq.Workplane(origin=(distance / 2, 0, -5)).box(distance + 60, 60, 10)
    for x in (0, distance):
        plate = plate.union(cq.Workplane(origin=(x, 0, 0)).circle(6).extrude(14))
    wheel = gear(n, m, 10, 6.02)
    machine = cq.Assembly(name="m").add(plate, name="plate").add(wheel, name="first")
    machine.add(wheel, name="second", loc=cq.Location((distance, 0, 0), (0, 0, 1), 180 / n))
    _, found = drawn(machine)
    assert found.wheels == ()
    hinges = [j for j in found.joints if j.kind == "hinge"]
    assert {round(j.point[0], 6) for j in hinges} == {0.0, distance * 1e-3}
    assert len(found.joints) == 2


def cart(grousers: int):
    """A box on four wheels, axles along y, wheels turn on stub axles."""
    import cadquery as cq

    body = cq.Workplane(origin=(0, 0, 100)).box(400, 200, 60)
    for x in (-150, 150):
        body = body.union(cq.Workplane("XZ", origin=(x, 140, 90)).circle(8).extrude(280))
    wheel = cq.Workplane("XZ", origin=(0, 20, 0)).circle(80).circle(8.05).extrude(40)
    for k in range(grousers):
        blade = cq.Workplane(origin=(82, 0, 0)).box(8, 40, 4)
        wheel = wheel.union(blade.rotate((0, 0, 0), (0, 1, 0), 360.0 * k / grousers))
    machine = cq.Assembly(name="m").add(body, name="body")
    for x in (-150, 150):
        for y in (-120, 120):
            machine.add(wheel, name=f"w{x}_{y}".replace("-", "n"), loc=cq.Location((x, y, 90)))
    return machine


@pytest.mark.parametrize("grousers", [0, 18])
def test_wheels_are_found_with_their_grousers(drawn, grousers):
    _, found = drawn(cart(grousers))
    assert len(found.wheels) == 4
    assert {w.joint for w in found.wheels} == {j.name for j in sure(found)}
    for wheel in found.wheels:
        # Radius and width come from cuts through a tessellation of relative fineness 2e-4.
        assert wheel.radius == pytest.approx(0.080, rel=1e-3)
        assert wheel.width == pytest.approx(0.040, rel=1e-3)
        assert wheel.grouser_count == grousers
        assert np.abs(wheel.axis) == pytest.approx([0, 1, 0], abs=1e-6)
        assert wheel.center[2] == pytest.approx(0.090, abs=1e-4)
        if grousers:
            assert wheel.grouser_height == pytest.approx(0.006, abs=1e-4)
            assert wheel.grouser_thickness == pytest.approx(0.004, rel=0.05)


def stilted_cart(wheel, aside: float, *more):
    """A deck on four struts with a wheel (axle along y) beside each, ``aside`` [mm] from the strut's middle, without a bearing."""
    import cadquery as cq

    machine = cq.Assembly(name="m").add(cq.Workplane(origin=(0, 0, 260)).box(700, 400, 120), name="deck")
    for k, (x, side) in enumerate((x, side) for x in (-280, 280) for side in (-1, 1)):
        machine.add(cq.Workplane(origin=(x, 210 * side, 180)).box(30, 20, 200), name=f"strut_{k}")
        for n, part in enumerate((wheel, *more)):
            machine.add(part, name=f"round_{k}_{n}", loc=cq.Location((x, (210 + aside) * side, 120)))
    return machine


def disc(radius: float, width: float, bore: float = 0.0):
    """Axle along y, millimetres."""
    import cadquery as cq

    drawn = cq.Workplane("XZ").circle(radius)
    return (drawn.circle(bore) if bore else drawn).extrude(width / 2, both=True)


@pytest.mark.parametrize("aside", [pytest.param(65, id="drawn into"), pytest.param(70, id="touching"), pytest.param(95, id="beside")])
def test_wheels_without_a_bearing_are_found(drawn, aside):
    """Contacts show one body, a flat contact or none: the machine stands on four alike round parts all the same."""
    _, found = drawn(stilted_cart(disc(120, 120), aside))
    assert len(found.wheels) == len(sure(found)) == 4
    assert len(found.bodies) == 5
    for joint in sure(found):
        assert joint.parent == found.root
        assert same_axis(joint, [joint.point[0], 0, 0.120], [0, 1, 0])
        assert "a bearing on its axis is not drawn" in joint.evidence[0]


def test_tyre_and_hub_of_a_wheel_without_a_bearing_turn_together(drawn):
    """A disc pressed 1 mm into its tyre; with a running clearance the tyre would turn on the disc."""
    assembly, found = drawn(stilted_cart(disc(120, 120, bore=69), 70, disc(70, 120)))
    assert len(found.wheels) == 4
    assert {"round_0_0", "round_0_1"} in paths(assembly, found)


@pytest.mark.parametrize(("radius", "width"), [pytest.param(120, 400, id="rollers"), pytest.param(12, 10, id="beads")])
def test_what_is_no_wheel_in_size_needs_a_bearing(drawn, radius, width):
    """Rollers wider than three radii; beads smaller than a fiftieth of the machine."""
    _, found = drawn(stilted_cart(disc(radius, width), width / 2 + 10))
    assert found.wheels == ()


def test_round_parts_that_do_not_touch_the_ground_are_no_wheels(drawn):
    """Four alike discs at the sides of a box that is lower than they are."""
    import cadquery as cq

    low = stilted_cart(disc(120, 120), 70).add(cq.Workplane(origin=(0, 0, 90)).box(600, 300, 240), name="belly")
    _, found = drawn(low)
    assert found.wheels == ()


def test_left_and_right_are_found_alike(drawn):
    """Two arms of different shape, one the mirror image of the other, hinged on both sides of a base."""
    import cadquery as cq

    base = cq.Workplane().box(100, 100, 40).union(cq.Workplane("XZ", origin=(20, 70, 0)).circle(6).extrude(140))
    hole = cq.Workplane("XZ", origin=(20, 80, 0)).circle(6.02).extrude(60)
    arm = cq.Workplane("XZ", origin=(50, 62, 10)).rect(90, 25).extrude(12).cut(hole)
    arm = arm.union(cq.Workplane(origin=(85, 70, 15)).box(20, 30, 12))
    machine = cq.Assembly(name="m").add(base, name="base").add(arm, name="arm_left").add(arm.mirror("XZ"), name="arm_right")
    _, found = drawn(machine)
    left, right = sorted(sure(found), key=lambda j: -j.point[1])
    assert left.confidence == right.confidence
    assert left.point * [1, -1, 1] == pytest.approx(right.point, abs=NEAR)
    assert any("2 times" in text for text in left.evidence)


def test_every_hinge_and_wheel_of_the_example_rover(repository):
    """Truth: the sheet of the example. No joint above the threshold that is not on it."""
    sheet = repository / "examples" / "rover" / "rover.toml"
    rover = build(sheet)
    found = suggest(read_step(sheet.parent / "rover.step"))
    joints = {j.child: j for j in sure(found)}
    truth = {j.child: j for j in rover.joints}
    assert joints.keys() == truth.keys()
    for child, joint in truth.items():
        off = np.cross(joints[child].point - np.array(joint.point), joint.axis)
        assert np.linalg.norm(off) < 1e-4, child
        assert np.linalg.norm(np.cross(joints[child].axis, joint.axis)) < math.radians(0.01), child
        assert joints[child].parent == joint.parent
    children = {j.name: j.child for j in rover.joints}
    wheels = {w.body: w for w in found.wheels}
    assert wheels.keys() == {children[w.joint] for w in rover.wheels}
    for wheel in rover.wheels:
        one = wheels[children[wheel.joint]]
        # Radius and width come from cuts through a tessellation of relative fineness 2e-4.
        assert one.radius == pytest.approx(wheel.radius, rel=1e-3)
        assert one.width == pytest.approx(wheel.width, rel=1e-3)
        assert wheel.grouser is not None
        assert one.grouser_count == wheel.grouser.count
        assert one.grouser_height == pytest.approx(wheel.grouser.height, rel=0.01)


def revolute_axes(path: Path) -> list[tuple[np.ndarray, np.ndarray]]:
    return [(j.point, j.axis) for j in sure(suggest(read_step(path))) if j.kind == "hinge"]


def on_axis(found, point, axis) -> bool:
    axis = np.array(axis, float)
    return any(
        np.linalg.norm(np.cross(p - np.array(point) * 1e-3, axis)) < 1e-4 and np.linalg.norm(np.cross(a, axis)) < math.radians(0.01)
        for p, a in found
    )


def test_the_double_pendulum_has_a_shoulder_and_an_elbow(rille_data):
    path = rille_data / "data" / "cad" / "double_pendulum.step"
    if not path.is_file():
        pytest.skip("the double pendulum's STEP file is absent")
    found = revolute_axes(path)
    assert len(found) == 2
    assert on_axis(found, (0, 63, 0), (0, 0, 1))
    assert on_axis(found, (0, -237, 0), (0, 0, 1))


def test_the_robot_arm_has_six_hinges(rille_data):
    """Pan, shoulder, elbow, wrist pitch, wrist roll, gripper, read off the drawing's servo axes; elbow from shoulder (14.8, 108.3) mm."""
    path = rille_data / "data" / "cad" / "low_cost_robot_arm.step"
    if not path.is_file():
        pytest.skip("the robot arm's STEP file is absent")
    found = revolute_axes(path)
    assert len(found) == 6
    x, y, z = np.eye(3)
    assert on_axis(found, (5.45, 116.6043, 0), z)
    assert on_axis(found, (0, 116.6043, -46.6367), x)
    assert on_axis(found, (0, 116.6043 + 14.8, -46.6367 + 108.3), x)
    assert on_axis(found, (0, 222.2283, 63.8306), x)
    assert on_axis(found, (4.1467, 221.065, 0), z)
    assert on_axis(found, (-4.6283, 0, 5.7426), y)


def test_bolted_assemblies_have_no_joint(rille_data):
    """as1 (nuts, bolts, a rod) and dm1 (bolts in a bracket) are standard test files without a mechanism."""
    folder = rille_data / "data" / "cad" / "stepcode_caxif"
    if not folder.is_dir():
        pytest.skip("the STEP test files are absent")
    for name in ("as1-oc-214.stp", "dm1-id-214.stp"):
        assert sure(suggest(read_step(folder / name))) == [], name
