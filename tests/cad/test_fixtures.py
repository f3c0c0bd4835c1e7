"""The files that break other importers (shared/PEERS.md), made by ourselves: is every tree, place and volume the one that was drawn?

Volumes to 1e-9, as in test_mass_properties.py; places to 1e-12 m: STEP writes 15 digits.
"""

import math
import re

import numpy as np
import pytest

from rille.cad import read_step
from rille.cad.geometry import tessellate
from rille.model import InputRefused

BALL = 4 / 3 * math.pi * 0.005**3
BOX = 0.01 * 0.02 * 0.03


def box():
    import cadquery as cq

    return cq.Workplane().box(10, 20, 30)


def ball():
    import cadquery as cq

    return cq.Workplane().sphere(5)


def pair(name="rig", first="box", second="ball"):
    """A box, and a ball 50 mm further on x, turned by a quarter about z."""
    import cadquery as cq

    return cq.Assembly(name=name).add(box(), name=first).add(ball(), name=second, loc=cq.Location((50, 0, 0), (0, 0, 1), 90))


def volumes(assembly):
    return {i.path: assembly.prototypes[i.prototype].volume.volume for i in assembly.instances}


@pytest.mark.parametrize("unit", ["MM", "CM", "M", "INCH", "KM", "UM"])
@pytest.mark.parametrize("schema", ["AP203", "AP214IS", "AP242DIS"])
def test_protocols_and_units(write_step, schema, unit):
    path = write_step(f"{schema}_{unit}.step", pair(), unit, schema)
    word = {"AP203": "CONFIG_CONTROL_DESIGN", "AP214IS": "AUTOMOTIVE_DESIGN", "AP242DIS": "AP242_MANAGED_MODEL"}[schema]
    assert word in path.read_text()
    assembly = read_step(path)
    assert volumes(assembly) == pytest.approx({"rig/box": BOX, "rig/ball": BALL}, rel=1e-9)
    place = next(i.matrix for i in assembly.instances if i.path == "rig/ball")
    np.testing.assert_allclose(place, [[0, -1, 0, 0.05], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], atol=1e-12)
    assert not assembly.notes


def test_twice_used_sub_assembly_in_a_twice_used_sub_assembly(write_step):
    import cadquery as cq

    inner = pair("inner")
    middle = cq.Assembly(name="middle").add(inner, name="a").add(inner, name="b", loc=cq.Location((0, 100, 0)))
    top = cq.Assembly(name="top").add(middle, name="left").add(middle, name="right", loc=cq.Location((0, 0, 100)))
    assembly = read_step(write_step("twice.step", top))
    assert sorted(i.path for i in assembly.instances) == sorted(
        f"top/{side}/{inner}/{part}" for side in ("left", "right") for inner in "ab" for part in ("box", "ball")
    )
    assert len({i.prototype for i in assembly.instances if i.path.endswith("box")}) == 1
    place = {i.path: i.matrix[:3, 3] for i in assembly.instances}
    np.testing.assert_allclose(place["top/right/b/ball"], [0.05, 0.1, 0.1], atol=1e-12)


@pytest.mark.parametrize("name", ["wheel_part", "_part", "part", "a_part_part"])
def test_names_that_end_in_part(write_step, name):
    assembly = read_step(write_step(f"{name}.step", pair("rig_part", first=name)))
    assert volumes(assembly) == pytest.approx({f"rig_part/{name}": BOX, "rig_part/ball": BALL}, rel=1e-9)


@pytest.mark.parametrize(
    ("encoded", "name"),
    [
        (rb"Tr\X2\00E4\X0\ger", "Träger"),
        (rb"Tr\X\E4ger", "Träger"),
        (rb"Tr\S\dger", "Träger"),
        ("Träger".encode(), "Träger"),
        ("Träger".encode("cp1252"), "Träger"),
        (rb"\X2\8F6E5B50\X0\ ", "轮子"),
        ("轮子".encode(), "轮子"),
        (rb"\X4\0001F680\X0\ ", "🚀"),
        (rb"\X2\D83DDE80\X0\ ", "🚀"),
        (b"left/wheel", "left_wheel"),
        (b"wheel#2", "wheel#2"),
        (b"O''Neill [3]", "O'Neill [3]"),
        (b"a\tb", "a b"),
    ],
)
def test_encodings_of_names(write_step, encoded, name):
    path = write_step("name.step", pair(first="QQQQ"))
    path.write_bytes(path.read_bytes().replace(b"QQQQ", encoded))
    assembly = read_step(path)
    assert {i.path for i in assembly.instances} == {f"rig/{name}", "rig/ball"}
    assert {p.name for p in assembly.prototypes} == {name, "ball"}


@pytest.mark.parametrize("broken", [rb"\X2\D800\X0\ ", rb"\X2\00", b"", b"   ", b"x" * 5000])
def test_names_without_sense_still_make_paths(write_step, broken):
    path = write_step("broken_name.step", pair(first="QQQQ"))
    path.write_bytes(path.read_bytes().replace(b"QQQQ", broken))
    assembly = read_step(path)
    assert len({i.path for i in assembly.instances}) == 2
    assert all(i.path.startswith("rig/") and len(i.path) > 4 for i in assembly.instances)


def test_repeated_names_stay_apart(write_step):
    path = write_step("repeated.step", pair(first="AAAA", second="BBBB"))
    text = path.read_bytes()
    path.write_bytes(text.replace(b"AAAA", b"wheel").replace(b"BBBB", b"wheel"))
    assert volumes(read_step(path)) == pytest.approx({"rig/wheel": BOX, "rig/wheel#2": BALL}, rel=1e-9)


def test_a_name_that_looks_like_a_repeated_one(write_step):
    import cadquery as cq

    roots = [(cq.Solid.makeBox(k, 10, 10), name) for k, name in ((10, "a"), (20, "a#2"), (30, "a"), (40, "a"))]
    assembly = read_step(write_step("hash.step", roots))
    assert volumes(assembly) == pytest.approx({"a": 1e-6, "a#2": 2e-6, "a#3": 3e-6, "a#4": 4e-6}, rel=1e-9)


def test_thirty_levels(write_step):
    import cadquery as cq

    # Each level shifts by 1 mm and turns by a twelfth of a turn: after 24 levels, two turns, the shifts have cancelled.
    assembly = cq.Assembly(box(), name="leaf")
    for level in range(30, 0, -1):
        parent = cq.Assembly(name=f"level{level}")
        parent.add(assembly, loc=cq.Location((1, 0, 0), (0, 0, 1), 30))
        assembly = parent
    read = read_step(write_step("deep.step", assembly))
    assert [i.path for i in read.instances] == ["/".join([*(f"level{k}" for k in range(1, 31)), "leaf"])]
    turn = math.radians(30) * np.arange(6)
    place = read.instances[0].matrix
    np.testing.assert_allclose(place[:2, 3], [1e-3 * np.cos(turn).sum(), 1e-3 * np.sin(turn).sum()], atol=1e-12)
    np.testing.assert_allclose(place[:2, :2], [[-1, 0], [0, -1]], atol=1e-10)  # thirty turns, each written with 12 digits


def test_multiplying_patterns_are_refused(write_step):
    import cadquery as cq
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    from rille.cad import read_document

    document = TDocStd_Document(TCollection_ExtendedString("test"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    label = tool.AddShape(cq.Solid.makeBox(1, 1, 1).wrapped, False)
    for _ in range(8):  # 10^8 boxes
        outer = tool.NewShape()
        for _ in range(10):
            tool.AddComponent(outer, label, TopLoc_Location())
        label = outer
    with pytest.raises(InputRefused, match="has 100000000 occurrences"):
        read_document(document, write_step("one.step", pair()))


def test_single_part_and_several_roots(write_step):
    import cadquery as cq

    solid = cq.Solid.makeBox(10, 20, 30)
    assert volumes(read_step(write_step("alone.step", [(solid, "alone")]))) == pytest.approx({"alone": BOX}, rel=1e-9)
    roots = [(solid, "one"), (cq.Solid.makeSphere(5, angleDegrees1=-90), "two"), (solid.translate(cq.Vector(50, 0, 0)), "three")]
    assembly = read_step(write_step("three.step", roots))
    assert volumes(assembly) == pytest.approx({"one": BOX, "two": BALL, "three": BOX}, rel=1e-9)


def test_shapes_without_any_product(write_step):
    import cadquery as cq

    path = write_step("bare.step", [(cq.Solid.makeBox(10, 20, 30), "gone")])
    words = "SHAPE_DEFINITION_REPRESENTATION|PRODUCT\\w*|APPLICATION_\\w+"
    path.write_text(re.sub(rf"#\d+ = ({words})\([^;]*;", "", path.read_text()))
    assert list(volumes(read_step(path)).values()) == pytest.approx([BOX], rel=1e-9)


def test_open_shell_is_reported_seen_and_not_weighed(write_step):
    import cadquery as cq

    solid = cq.Solid.makeBox(10, 20, 30)
    shell = cq.Shell.makeShell(solid.Faces()[:5])
    wire = cq.Wire.makeCircle(5, cq.Vector(), cq.Vector(0, 0, 1))
    rig = cq.Assembly(name="rig").add(solid, name="solid").add(shell, name="shell").add(wire, name="wire")
    assembly = read_step(write_step("open.step", rig))
    solids = {i.path: assembly.prototypes[i.prototype].n_solids for i in assembly.instances}
    assert solids == {"rig/solid": 1, "rig/shell": 0, "rig/wire": 0}
    assert volumes(assembly)["rig/shell"] == 0
    assert [re.search("'(.*)' has no solid", note).group(1) for note in assembly.notes] == ["shell", "wire"]
    prototypes = {p.name: p for p in assembly.prototypes}
    mesh = tessellate(prototypes["shell"].shape, 1e-4)
    assert mesh is not None
    assert len(mesh.triangles) == 10  # five rectangles
    assert tessellate(prototypes["wire"].shape, 1e-4) is None


def test_a_solid_that_is_lost_is_reported(write_step):
    import cadquery as cq

    roots = [(cq.Solid.makeBox(10, 20, 30), "sound"), (cq.Solid.makeBox(10, 10, 10), "broken")]
    path = write_step("lost.step", roots)
    head, _, tail = path.read_text().rpartition("ADVANCED_FACE(")
    path.write_text(f"{head}ADVANCED_FACE_THAT_NOBODY_KNOWS({tail}")
    assembly = read_step(path)
    assert any(p.volume.volume == pytest.approx(BOX) for p in assembly.prototypes)
    assert any(re.search("draws 2 solids, of which 1 could be built|is not closed", note) for note in assembly.notes), assembly.notes


def test_a_file_without_a_unit_says_what_was_taken(write_step):
    path = write_step("unitless.step", pair())
    unit = "LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.)"
    text = path.read_text()
    assert unit in text
    path.write_text(text.replace(unit, "NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.)"))
    assembly = read_step(path)
    assert "'unitless.step' states no unit of length: millimetres were taken" in assembly.notes
    assert volumes(assembly) == pytest.approx({"rig/box": BOX, "rig/ball": BALL}, rel=1e-9)


@pytest.mark.parametrize("broken", [r"(ITEM_DEFINED_TRANSFORMATION\('','',#\d+,)#\d+", r"(WITH_TRANSFORMATION\()#\d+"])
@pytest.mark.parametrize("target", ["#1", "#99999999"])
def test_a_placement_that_is_lost_is_reported(write_step, broken, target):
    """OCCT leaves such an instance where its part was drawn, and says nothing."""
    import cadquery as cq

    path = write_step("misplaced.step", cq.Assembly(name="rig").add(box(), name="box", loc=cq.Location((7, 0, 0))).add(ball(), name="ball"))
    path.write_text(re.sub(broken, rf"\g<1>{target}", path.read_text(), count=1))
    assert any("may be missing or misplaced" in note for note in read_step(path).notes)


def operator(axis2, scale, origin="#90006"):
    """Entities of a CARTESIAN_TRANSFORMATION_OPERATOR_3D, shifted by 100 mm on x."""
    return f"""#90001=CARTESIAN_TRANSFORMATION_OPERATOR_3D('','','',#90002,#90003,{origin},{scale},#90004);
#90002=DIRECTION('',(1.,0.,0.));
#90003=DIRECTION('',(0.,{axis2},0.));
#90004=DIRECTION('',(0.,0.,1.));
#90006=CARTESIAN_POINT('',(100.,0.,0.));
"""


def placed_by_relationship(write_step, entities):
    """The box of a pair, placed by an operator instead of two frames."""
    path = write_step("relation.step", pair())
    text = path.read_text()
    number = re.search(r"#(\d+) = ITEM_DEFINED_TRANSFORMATION\([^;]*;\n", text)
    text = text.replace(number.group(0), entities).replace(f"WITH_TRANSFORMATION(#{number.group(1)})", "WITH_TRANSFORMATION(#90001)")
    path.write_text(text)
    return path


def placed_by_mapping(write_step, entities):
    """A box that is a mapped item."""
    import cadquery as cq

    path = write_step("mapped.step", [(cq.Solid.makeBox(10, 20, 30), "box")])
    text = path.read_text()
    found = re.search(r"#(\d+) = ADVANCED_BREP_SHAPE_REPRESENTATION\('',\((#\d+),(#\d+)\),(#\d+)\);\n", text)
    number, axes, solid, context = found.groups()
    mapped = f"""#{number} = ADVANCED_BREP_SHAPE_REPRESENTATION('',({axes},#90012),{context});
#90011=REPRESENTATION_MAP({axes},#90020);
#90012=MAPPED_ITEM('',#90011,#90001);
#90020=ADVANCED_BREP_SHAPE_REPRESENTATION('',({axes},{solid}),{context});
{entities}"""
    path.write_text(text.replace(found.group(0), mapped))
    return path


@pytest.mark.parametrize("place", [placed_by_relationship, placed_by_mapping])
def test_mirror_and_scale_in_the_file_are_refused(write_step, place):
    with pytest.raises(InputRefused, match=r"#90001 .* mirror \(determinant -1\).*mirror the shape in CAD"):
        read_step(place(write_step, operator(-1.0, 1.0)))
    with pytest.raises(InputRefused, match=r"with the scale 2; scale the shape"):
        read_step(place(write_step, operator(1.0, 2.0)))
    plain = read_step(place(write_step, operator(1.0, 1.0)))
    np.testing.assert_allclose(plain.instances[0].matrix[:3, 3], [0.1, 0, 0], atol=1e-12)
    assert plain.prototypes[0].volume.volume == pytest.approx(BOX, rel=1e-9)


def test_external_references_with_another_unit_and_without_a_file(write_step, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = write_step("ext/main.step", pair(), prefix="sub_")
    for sub in tmp_path.glob("sub_*"):
        sub.rename(path.parent / sub.name)  # OCCT writes them into the working directory
    assert volumes(read_step(path)) == pytest.approx({"rig/box": BOX, "rig/ball": BALL}, rel=1e-9)
    sub = path.parent / "sub_box.stp"
    metres = sub.read_text().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)")
    sub.write_text(metres)
    assert volumes(read_step(path)) == pytest.approx({"rig/box": 1e9 * BOX, "rig/ball": BALL}, rel=1e-9)
    sub.unlink()
    missing = read_step(path)
    assert "refers to the file 'sub_box.stp', which is not there" in missing.notes[0]
    assert volumes(missing)["rig/box"] == 0


def test_colours_and_names_of_faces(write_step, tmp_path):
    import cadquery as cq

    from rille.cad.files.named_faces import named_face

    solid = box().faces(">X").workplane().hole(8)
    rig = cq.Assembly(name="rig").add(solid, name="block", color=cq.Color(0, 0, 1))
    block = rig.objects["block"]
    block.addSubshape(solid.faces(">Z").val(), name="top", color=cq.Color(1, 0, 0))
    block.addSubshape(solid.faces("%CYLINDER").val(), name="bore")
    rig.export(str(tmp_path / "faces.step"))
    prototype = read_step(tmp_path / "faces.step").prototypes[0]
    assert prototype.color == "#0000ff"
    assert prototype.face_colors.count("#ff0000") == 1
    assert set(prototype.named_faces) == {"top", "bore"}
    top, bore = named_face(prototype, "top"), named_face(prototype, "bore")
    np.testing.assert_allclose(top.axis, [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(top.point, [0, 0, 0.015], atol=1e-9)
    assert (bore.kind, bore.radius) == ("cylinder", pytest.approx(0.004))
    np.testing.assert_allclose(np.abs(bore.axis), [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(bore.point, 0, atol=1e-12)
    with pytest.raises(InputRefused, match=r"no face named 'bor'; did you mean 'bore'"):
        named_face(prototype, "bor")


def test_colour_of_one_occurrence_deep_in_the_tree(tmp_path):
    import cadquery as cq
    from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDF import TDF_AttributeSequence, TDF_LabelSequence
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool, XCAFDoc_GraphNode, XCAFDoc_ShapeTool

    document = TDocStd_Document(TCollection_ExtendedString("test"))
    tool, colors = XCAFDoc_DocumentTool.ShapeTool_s(document.Main()), XCAFDoc_DocumentTool.ColorTool_s(document.Main())

    def color(label, *rgb):
        colors.SetColor(label, Quantity_Color(*rgb, Quantity_TypeOfColor.Quantity_TOC_RGB), XCAFDoc_ColorType.XCAFDoc_ColorSurf)

    part, inner, top = tool.AddShape(cq.Solid.makeBox(1, 2, 3).wrapped, False), tool.NewShape(), tool.NewShape()
    color(part, 0, 0, 1)
    twins = [tool.AddComponent(inner, part, cq.Location((5 * k, 0, 0)).wrapped) for k in range(2)]
    sides = [tool.AddComponent(top, inner, cq.Location((0, 9 * k, 0)).wrapped) for k in range(2)]
    for label, name in zip([part, inner, top, *twins, *sides], ["box", "inner", "top", "t0", "t1", "s0", "s1"], strict=True):
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
    tool.UpdateAssemblies()
    chain = TDF_LabelSequence()
    chain.Append(sides[1])
    chain.Append(twins[0])
    tool.SetSHUO(chain, XCAFDoc_GraphNode())
    usages = TDF_AttributeSequence()
    XCAFDoc_ShapeTool.GetAllComponentSHUO_s(sides[1], usages)
    color(usages.Value(1).Label(), 1, 0, 0)
    writer = STEPCAFControl_Writer()
    writer.SetSHUOMode(True)
    writer.Transfer(document)
    writer.Write(str(tmp_path / "override.step"))
    found = {i.path: i.color for i in read_step(tmp_path / "override.step").instances}
    assert found == {"top/s0/t0": "#0000ff", "top/s0/t1": "#0000ff", "top/s1/t0": "#ff0000", "top/s1/t1": "#0000ff"}


def test_a_part_of_a_hundred_kilometres_is_refused(write_step):
    import cadquery as cq

    path = write_step("huge.step", [(cq.Solid.makeBox(1e9, 10, 10), "box")])
    with pytest.raises(InputRefused, match=r"part 'box' reaches 1e\+06 m .* correct the unit"):
        read_step(path)
