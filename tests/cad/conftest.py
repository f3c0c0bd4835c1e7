"""Small STEP files, written once per session with CadQuery and OCCT."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture(scope="session")
def write_step(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Writer of (shape, name) roots, or of a ``cq.Assembly``, into one STEP file; lengths are given in mm.

    unit : the file's. schema : AP203, AP214IS or AP242DIS. prefix : writes every part into a file of its own, so named.
    """
    from cadquery.occ_impl.assembly import toCAF
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    folder = tmp_path_factory.mktemp("step")

    def write(file: str, roots: Any, unit: str = "MM", schema: str = "AP214IS", prefix: str = "") -> Path:
        if isinstance(roots, list):
            document = TDocStd_Document(TCollection_ExtendedString("test"))
            tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
            for shape, name in roots:
                TDataStd_Name.Set_s(tool.AddShape(shape.wrapped, False), TCollection_ExtendedString(name))
        else:
            document = toCAF(roots, True)[1]
        STEPCAFControl_Writer()  # creating one defines the parameters that are set next
        Interface_Static.SetCVal_s("write.step.unit", unit)
        Interface_Static.SetCVal_s("write.step.schema", schema)
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        try:
            writer = STEPCAFControl_Writer()
            writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs, prefix or None)
            writer.Write(str(folder / file))
        finally:
            Interface_Static.SetCVal_s("write.step.unit", "MM")
            Interface_Static.SetCVal_s("write.step.schema", "AP214IS")
        return folder / file

    return write


@pytest.fixture(scope="session")
def nested_step(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An arm (bar ``Träger`` and ``peg_part``) that is used twice, turned the second time, and a free box."""
    import cadquery as cq

    arm = (
        cq.Assembly(name="arm")
        .add(cq.Workplane().box(100, 10, 10), name="Traeger", loc=cq.Location((50, 0, 0)))
        .add(cq.Workplane().circle(4).extrude(30), name="peg_part", loc=cq.Location((100, 0, 5)), color=cq.Color(1, 0, 0))
    )
    rig = (
        cq.Assembly(name="rig")
        .add(arm, name="arm_left")
        .add(arm, name="arm_right", loc=cq.Location((0, 0, 50), (0, 0, 1), 90))
        .add(cq.Workplane().box(20, 20, 20), name="base")
    )
    path = tmp_path_factory.mktemp("nested") / "rig.step"
    rig.export(str(path))
    # CadQuery writes non-ASCII names wrongly, so it gets its ISO 10303-21 encoding here, as CAD programs do.
    path.write_text(path.read_text().replace("Traeger", "Tr\\X2\\00E4\\X0\\ger"))
    return path


RIG_SHEET = """
step = "{step}"
[[material]]
name = "steel"
density = "7.85 g/cm^3"
[[part]]
match = "*"
material = "steel"
[[body]]
name = "base"
parts = ["rig/base"]
[[body]]
name = "left"
parts = ["rig/arm_left"]
[[body]]
name = "right"
parts = ["rig/arm_right"]
[[joint]]
name = "left_hinge"
kind = "hinge"
parent = "base"
child = "left"
point = ["10 mm", 0, 0]
axis = [0, 0, 2]
lower = "-35 deg"
upper = "35 deg"
[[joint]]
name = "right_hinge"
kind = "hinge"
parent = "base"
child = "right"
point = [0, "1 cm", 0.05]
axis = [0, 0, 1]
"""


@pytest.fixture
def rig_sheet(nested_step: Path, tmp_path: Path) -> Callable[..., Path]:
    """Writer of the sheet of the rig, with replacements (old, new) and appended text."""

    def write(*changes: tuple[str, str], more: str = "") -> Path:
        text = RIG_SHEET.format(step=nested_step)
        for old, new in changes:
            assert old in text, f"the test's replacement '{old}' does not apply"
            text = text.replace(old, new)
        sheet = tmp_path / "rig.toml"
        sheet.write_text(text + more, encoding="utf-8")
        return sheet

    return write
