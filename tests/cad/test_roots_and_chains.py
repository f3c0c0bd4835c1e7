"""What carries a machine, and in which order unsure joints hang on each other: a caster, and an arm whose last three shafts are thin."""

import itertools
import tomllib

import numpy as np
import pytest

from rille.cad import build, read_step
from rille.cad.suggestion.draft import draft_sheet
from rille.cad.suggestion.suggest import suggest


def across(radius, length, x, z, y=0.0):
    """A cylinder along y about (x, y, z) [mm]."""
    import cadquery as cq

    return cq.Workplane("XZ", origin=(x, y, z)).circle(radius).extrude(length / 2, both=True)


def along(radius, x, length):
    """A cylinder along x from (x, 0, 365) [mm] on."""
    import cadquery as cq

    return cq.Workplane("YZ", origin=(x, 0, 365)).circle(radius).extrude(length)


def caster():
    """A plate, a fork that swivels below it, a wheel on an axle: the wheel is the largest part, the fork heavier than the plate."""
    import cadquery as cq

    plate = cq.Workplane().rect(100, 80).extrude(6).faces(">Z").workplane(centerOption="CenterOfBoundBox").hole(12)
    fork = cq.Workplane().circle(5.98).extrude(12).translate((0, 0, 126)).union(cq.Workplane().box(50, 60, 6).translate((0, 0, 127)))
    for side in (-1, 1):
        legs = cq.Workplane("XZ", origin=(0, side * 27, 0)).polyline([(-20, 126), (20, 126), (-20, 40), (-40, 40)]).close()
        fork = fork.union(legs.extrude(3, both=True))
    fork = fork.cut(across(4, 200, -27, 50))
    wheel = across(50, 30, -27, 50).cut(across(4, 200, -27, 50))
    axle = across(3.99, 62, -27, 50).union(across(7, 5, -27, 50, 33)).union(across(7, 5, -27, 50, -33))
    machine = cq.Assembly(name="caster").add(plate, name="plate", loc=cq.Location((0, 0, 130))).add(fork, name="fork")
    return machine.add(wheel, name="wheel").add(axle, name="axle")


def arm():
    """Pedestal, yaw, upper arm with its elbow's fork, forearm, wrist roll, wrist pitch, and a square tool flange on a thin shaft."""
    import cadquery as cq

    base = cq.Workplane().circle(80).extrude(60).faces(">Z").workplane().hole(40, 40)
    yaw = cq.Workplane().circle(19.95).extrude(35).translate((0, 0, 25)).union(cq.Workplane().circle(60).extrude(20).translate((0, 0, 60)))
    for side in (-1, 1):
        yaw = yaw.union(cq.Workplane().box(60, 15, 100).translate((0, side * 35, 130)))
    yaw = yaw.cut(across(10, 200, 0, 150))
    upper = cq.Workplane().box(50, 54.9, 250).translate((0, 0, 255)).union(across(25, 54.9, 0, 150))
    upper = upper.union(cq.Workplane().box(300, 30, 30).translate((165, 0, 365))).union(across(9.98, 95, 0, 150)).cut(along(8, 265, 60))
    roll = along(7.98, 266, 60).union(along(18, 315.05, 15))
    for side in (-1, 1):
        roll = roll.union(cq.Workplane().box(40, 6, 30).translate((350, side * 15, 365)))
    roll = roll.cut(across(5, 60, 360, 365))
    pitch = cq.Workplane().box(50, 23.9, 20).translate((375, 0, 365)).union(across(4.98, 36, 360, 365)).cut(along(5, 385, 20))
    flange = along(4.98, 386, 20).union(cq.Workplane("YZ", origin=(400.02, 0, 365)).rect(40, 40).extrude(8))
    machine = cq.Assembly(name="arm")
    for name, part in (("base", base), ("yaw", yaw), ("upper", upper), ("roll", roll), ("pitch", pitch), ("flange", flange)):
        machine.add(part, name=name)
    return machine


@pytest.fixture(scope="module")
def looked_at(tmp_path_factory):
    """Writer, reader and judge of a machine."""

    def look(machine):
        path = tmp_path_factory.mktemp("machine") / f"{machine.name}.step"
        machine.export(str(path))
        assembly = read_step(path)
        return assembly, suggest(assembly)

    return look


def test_a_wheel_and_its_fork_hang_on_the_plate(looked_at):
    _, found = looked_at(caster())
    assert found.root == "plate"
    assert [(j.parent, j.child) for j in found.accepted] == [("plate", "fork"), ("fork", "wheel")]
    assert [w.body for w in found.wheels] == ["wheel"]


@pytest.fixture(scope="module")
def judged_arm(looked_at):
    return looked_at(arm())


def test_a_round_pedestal_that_carries_the_arm_does_not_spin_idly(judged_arm):
    _, found = judged_arm
    assert found.root == "base"
    yaw = next(j for j in found.accepted if j.parent == "base")
    np.testing.assert_allclose(np.abs(yaw.axis), [0, 0, 1], atol=1e-9)
    assert yaw.doubts == ()


def test_a_square_flange_is_not_round(judged_arm):
    """Its only cylinder is the shaft, but its corners go round: its turning shows."""
    _, found = judged_arm
    assert not any("carries nothing" in doubt for j in found.joints for doubt in j.doubts)


def test_unsure_joints_hang_on_each_other(judged_arm):
    """Outwards from the forearm: roll, pitch, flange; each takes along all that hangs on it."""
    assembly, found = judged_arm
    names = [i.path.split("/")[-1] for i in assembly.instances]
    unsure = [j for j in found.joints if j.confidence < found.threshold]
    assert [(j.parent, j.child) for j in unsure] == [("upper", "roll"), ("roll", "pitch"), ("pitch", "flange")]
    assert [{names[i] for i in j.moving} for j in unsure] == [{"roll", "pitch", "flange"}, {"pitch", "flange"}, {"flange"}]
    assert [{names[i] for i in j.staying} for j in unsure] == [{"upper"}, {"roll"}, {"pitch"}]


@pytest.mark.parametrize("used", [1, 2, 3])
def test_unsure_joints_of_a_draft_build_together(judged_arm, tmp_path, used):
    """The first blocks uncommented, and the parents' parts as their comments say."""
    assembly, found = judged_arm
    text = draft_sheet(assembly, found, str(assembly.file))
    head, *blocks = text[: text.index("# --- wheels")].split("# UNSURE")
    page = tomllib.loads(head)
    bodies = {body["name"]: body["parts"] for body in page["body"]}
    joints = page["joint"]
    for block in blocks[:used]:
        lines = [line.removeprefix("# ") for line in block.splitlines()]
        keep = next(line for line in lines if " would keep: " in line)
        bodies[keep.split('"')[1]] = tomllib.loads(keep.split(" would keep: ")[1])["parts"]
        made = tomllib.loads("\n".join(lines[lines.index("[[body]]") :]))
        bodies[made["body"][0]["name"]] = made["body"][0]["parts"]
        joints += made["joint"]
    sheet = tmp_path / "arm.toml"
    rows = [f"[[body]]\nname = {name!r}\nparts = {parts}" for name, parts in bodies.items()]
    rows += ["[[joint]]\n" + "\n".join(f"{key} = {value!r}" for key, value in joint.items()) for joint in joints]
    sheet.write_text(f'step = "{assembly.file}"\ndefault_material = "steel"\n' + "\n".join(rows) + "\n")
    rover = build(sheet)
    assert len(rover.bodies) == 3 + used
    carriers = {j.child: j.parent for j in rover.joints}
    chain = ["upper", "roll", "pitch", "flange"][: used + 1]
    assert all(carriers[child] == parent for parent, child in itertools.pairwise(chain))


def test_a_body_is_called_after_its_part_of_most_volume(looked_at):
    """A plate, and a long thin rod that is pressed into it: the plate gives the name."""
    import cadquery as cq

    plate = cq.Workplane().box(200, 100, 20).cut(cq.Workplane(origin=(0, 0, -20)).circle(4).extrude(60))
    rod = cq.Workplane(origin=(0, 0, -10)).circle(4.01).extrude(600)
    _, found = looked_at(cq.Assembly(name="stand").add(plate, name="plate").add(rod, name="rod"))
    assert [body.name for body in found.bodies] == ["plate"]


def test_solids_of_one_part_that_do_not_touch_are_said_to_be_one_part(looked_at):
    import cadquery as cq

    two = cq.Compound.makeCompound([cq.Solid.makeBox(10, 10, 10), cq.Solid.makeBox(10, 10, 10, cq.Vector(30, 0, 0))])
    _, found = looked_at(
        cq.Assembly(name="pair").add(two, name="feet").add(cq.Workplane().box(10, 10, 10).translate((5, 15, 5)), name="top")
    )
    (note,) = (note for note in found.notes if "two solids of 'feet'" in note)
    assert "20.00 mm between their boxes" in note
    assert not any("'feet'; it was put with 'feet'" in note for note in found.notes)
