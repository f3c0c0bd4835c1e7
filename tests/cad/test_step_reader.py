"""Does the reader find every instance once, with its name, place and colour, and refuse what cannot be a rigid body?"""

import numpy as np
import pytest

from rille.cad import read_document, read_step, volume_properties
from rille.model import InputRefused


def test_twice_used_sub_assembly(nested_step):
    assembly = read_step(nested_step)
    paths = {i.path: i for i in assembly.instances}
    assert set(paths) == {
        "rig/arm_left/Träger",
        "rig/arm_left/peg_part",
        "rig/arm_right/Träger",
        "rig/arm_right/peg_part",
        "rig/base",
    }
    # The peg of the second arm: (100, 0, 5) mm turned by 90 degrees about z and lifted by 50 mm.
    np.testing.assert_allclose(paths["rig/arm_right/peg_part"].matrix[:3, 3], [0, 0.1, 0.055], atol=1e-12)
    np.testing.assert_allclose(paths["rig/arm_right/peg_part"].matrix[:3, 0], [0, 1, 0], atol=1e-12)


def test_colours(nested_step):
    peg = next(i for i in read_step(nested_step).instances if i.path.endswith("left/peg_part"))
    assert peg.color == "#ff0000"


def test_several_roots_with_one_name(write_step):
    import cadquery as cq

    boxes = [(cq.Solid.makeBox(k, 10, 10), "Document") for k in (10, 20)]
    assembly = read_step(write_step("roots.step", boxes))
    assert [i.path for i in assembly.instances] == ["Document", "Document#2"]
    assert sorted(volume_properties(p.shape).volume for p in assembly.prototypes) == pytest.approx([1e-6, 2e-6])


def test_single_part(write_step):
    import cadquery as cq

    assembly = read_step(write_step("single.step", [(cq.Solid.makeBox(10, 10, 10), "lone_part")]))
    assert [i.path for i in assembly.instances] == ["lone_part"]


def test_material_of_the_file(tmp_path):
    import cadquery as cq
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.TCollection import TCollection_ExtendedString, TCollection_HAsciiString
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("test"))
    label = XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).AddShape(cq.Solid.makeBox(10, 10, 10).wrapped, False)
    text = (TCollection_HAsciiString(t) for t in ("brass", "", "density measure", "POSITIVE_RATIO_MEASURE"))
    name, description, measure, kind = text
    XCAFDoc_DocumentTool.MaterialTool_s(document.Main()).SetMaterial(label, name, description, 8.5, measure, kind)
    writer = STEPCAFControl_Writer()
    writer.SetMaterialMode(True)
    writer.Transfer(document)
    writer.Write(str(tmp_path / "brass.step"))
    material = read_step(tmp_path / "brass.step").prototypes[0].material
    assert material is not None
    assert (material.name, material.provenance) == ("brass", "cad_material")
    assert material.density == pytest.approx(8500.0)


def test_mirrored_instance_is_refused(tmp_path):
    import cadquery as cq
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("test"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    part = tool.AddShape(cq.Solid.makeBox(10, 20, 30).wrapped, False)
    mirror = gp_Trsf()
    mirror.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 1, 0)))
    tool.AddComponent(tool.NewShape(), part, TopLoc_Location(mirror))
    tool.UpdateAssemblies()
    with pytest.raises(InputRefused, match=r"placed by a mirror .*mirror the shape in CAD"):
        read_document(document, tmp_path / "mirrored.step")


def test_surfaces_alone_are_seen_and_who_needs_a_mass_refuses(write_step, tmp_path):
    import cadquery as cq

    from rille.cad import build
    from rille.cad.suggestion.suggest import suggest

    path = write_step("face.step", [(cq.Face.makePlane(10, 10), "sheet")])
    assembly = read_step(path)
    assert [i.path for i in assembly.instances] == ["sheet"]
    assert any("'sheet' has no solid" in note and "no mass" in note for note in assembly.notes)
    with pytest.raises(InputRefused, match=r"face\.step' has no solid, so nothing in it has a mass"):
        suggest(assembly)
    sheet = tmp_path / "face.toml"
    sheet.write_text(f'step = "{path}"\ndefault_material = "steel"\n[[body]]\nname = "all"\nparts = ["*"]\n')
    with pytest.raises(InputRefused, match=r"face\.step' has no solid, so nothing in it has a mass"):
        build(sheet)


@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("Rad größer", "Rad größer"),
        ("ÄÖÜßÉ", "ÄÖÜßÉ"),
        ("Колесо", "Колесо"),
        ("wheel", "wheel"),
    ],
)
def test_names_that_cadquery_exported_are_read_as_they_were_given(tmp_path, name, read):
    """CadQuery hands the bytes of UTF-8 to OCCT as if they were letters, so its files hold every such letter twice encoded."""
    import cadquery as cq

    rig = cq.Assembly(name="Gerät").add(cq.Workplane().box(10, 20, 30), name=name)
    rig.export(str(tmp_path / "named.step"))
    assert [i.path for i in read_step(tmp_path / "named.step").instances] == [f"Gerät/{read}"]


@pytest.mark.parametrize("name", ["Träger", "Ärmel Ã", "größer ¶", "naïve"])
def test_names_that_are_not_twice_encoded_stay(write_step, name):
    import cadquery as cq

    path = write_step("plain.step", [(cq.Solid.makeBox(1, 2, 3), "xyz")])
    path.write_text(path.read_text().replace("xyz", name), encoding="utf-8")
    assert [i.path for i in read_step(path).instances] == [name]


def test_missing_file_is_refused(tmp_path):
    with pytest.raises(InputRefused, match="there is no STEP file"):
        read_step(tmp_path / "absent.step")


@pytest.mark.parametrize("content", [b"solid ascii_stl\n", b"", b"\x00\x01\x02"])
def test_other_file_is_refused(tmp_path, content):
    path = tmp_path / "other.step"
    path.write_bytes(content)
    with pytest.raises(InputRefused, match="is not a STEP file"):
        read_step(path)


def test_truncated_file_is_refused(nested_step, tmp_path):
    path = tmp_path / "half.step"
    path.write_bytes(nested_step.read_bytes()[:3000])
    with pytest.raises(InputRefused, match=r"ends before END-ISO-10303-21 \(cut off.*entity #\d+ refers to #\d+, which is not there"):
        read_step(path)


@pytest.mark.parametrize(
    ("file", "instances", "solids"),
    [  # counts of shared/data/SOURCES.md; None where it states none
        ("double_pendulum.step", 26, 26),
        ("low_cost_robot_arm.step", None, 117),
        ("push_device.step", 67, None),
        ("stepcode_caxif/dm1-id-214.stp", None, None),
    ],
)
def test_real_files(rille_data, file, instances, solids):
    path = rille_data / "data" / "cad" / file
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    assembly = read_step(path)
    paths = [i.path for i in assembly.instances]
    assert len(set(paths)) == len(paths)
    if instances is not None:
        assert len(paths) == instances
    if solids is not None:
        assert sum(assembly.prototypes[i.prototype].n_solids for i in assembly.instances) == solids
