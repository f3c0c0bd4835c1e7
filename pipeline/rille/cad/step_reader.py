"""STEP files -> prototypes and placed instances, through OCCT's document model (XCAF).

Prototypes are read once and keyed by their label, so a sub-assembly that is used twice shares its parts; every instance
has a path such as ``rover/rocker_left/wheel_front`` that is unique even where names repeat.
"""

# The compiled module OCP has no type stubs that pyright can follow.
# pyright: reportAttributeAccessIssue=false, reportMissingModuleSource=false, reportMissingImports=false

import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.cad.geometry import MM, solids
from rille.model import InputRefused, Material

# Names that exporters invent for occurrences; the product's own name says more.
_INVENTED = re.compile(r"^(NAUO\d*|=>.*|NEXT_ASSEMBLY_USAGE.*|\d+|COMPOUND|SOLID|SHELL)?$", re.IGNORECASE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Prototype:
    """A part as drawn once.

    shape : TopoDS_Shape in its own frame, millimetres. color : ``#rrggbb`` or None. material : as the file states it.
    """

    name: str
    shape: Any
    n_solids: int
    color: str | None = None
    material: Material | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedPart:
    """An occurrence of a prototype. matrix : shape (4, 4), part frame -> assembly frame, metres."""

    path: str
    prototype: int
    matrix: NDArray[np.float64]
    color: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Assembly:
    """A STEP file as read. notes : what was found and left out, a sentence each."""

    file: Path
    prototypes: tuple[Prototype, ...]
    instances: tuple[PlacedPart, ...]
    notes: tuple[str, ...] = ()


def read_step(path: Path) -> Assembly:
    """Read an assembly (or a single part) from a STEP file of any unit and protocol.

    Raises
    ------
    InputRefused : for a missing file, a file that is no STEP, a file without any solid, and a mirrored instance (a
        rigid body cannot be mirrored by moving it: mirror the shape in CAD).
    """
    path = Path(path)
    if not path.is_file():
        raise InputRefused(f"there is no STEP file '{path}'")
    with path.open("rb") as file:
        if b"ISO-10303-21" not in file.read(4096):
            raise InputRefused(f"'{path}' is not a STEP file: it does not begin with ISO-10303-21")
    return read_document(_load(path), path)


def read_document(document: Any, path: Path) -> Assembly:
    """Walk an XCAF document (TDocStd_Document), for example of a CadQuery assembly; ``path`` names it in sentences.

    Raises
    ------
    InputRefused : as :func:`read_step`.
    """
    reader = _Reader(path, document)
    reader.visit_roots()
    if not any(p.n_solids for p in reader.prototypes):
        raise InputRefused(f"'{path}' has no solid, so nothing in it has a mass; export solids, not surfaces")
    return Assembly(file=path, prototypes=tuple(reader.prototypes), instances=tuple(reader.instances), notes=tuple(reader.notes))


def _load(path: Path) -> Any:
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Message import Message
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document

    for printer in list(Message.DefaultMessenger_s().Printers()):
        Message.DefaultMessenger_s().RemovePrinter(printer)  # OCCT talks on stdout, which is for data
    document = TDocStd_Document(TCollection_ExtendedString("rille"))
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    reader.SetMatMode(True)
    # An absolute path: with a relative one OCCT loses external references in sub-folders silently.
    status = reader.ReadFile(str(path.resolve()))
    if status != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise InputRefused(f"'{path}' cannot be read as STEP ({status.name}); export it again")
    if not reader.Transfer(document):
        raise InputRefused(f"'{path}' holds no shapes that can be transferred; export it again as AP214 or AP242")
    return document


@dataclass
class _Reader:
    """Walks the labels of one document."""

    path: Path
    document: Any
    prototypes: list[Prototype] = field(default_factory=list)
    instances: list[PlacedPart] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _index: dict[str, int] = field(default_factory=dict)
    _names: Counter = field(default_factory=Counter)

    def __post_init__(self) -> None:
        from OCP.XCAFDoc import XCAFDoc_DocumentTool

        self._shapes = XCAFDoc_DocumentTool.ShapeTool_s(self.document.Main())
        self._colors = XCAFDoc_DocumentTool.ColorTool_s(self.document.Main())

    def visit_roots(self) -> None:
        from OCP.TDF import TDF_LabelSequence

        labels = TDF_LabelSequence()
        self._shapes.GetFreeShapes(labels)
        taken: Counter = Counter()
        for i in range(1, labels.Length() + 1):
            label = labels.Value(i)
            name = _unique(_name_of(label) or self.path.stem, taken)
            self._visit(label, name, np.eye(4), self._color(label))

    def _visit(self, label: Any, path: str, matrix: NDArray[np.float64], color: str | None) -> None:
        from OCP.TDF import TDF_Label, TDF_LabelSequence
        from OCP.XCAFDoc import XCAFDoc_ShapeTool

        if not XCAFDoc_ShapeTool.IsAssembly_s(label):
            self._add_instance(label, path, matrix, color)
            return
        components = TDF_LabelSequence()
        XCAFDoc_ShapeTool.GetComponents_s(label, components)
        taken: Counter = Counter()
        for i in range(1, components.Length() + 1):
            component = components.Value(i)
            referred = TDF_Label()
            if not XCAFDoc_ShapeTool.GetReferredShape_s(component, referred):
                continue
            own, product = _name_of(component), _name_of(referred)
            name = product if _INVENTED.match(own) and product else (own or product or "part")
            child = f"{path}/{_unique(name, taken)}"
            placed = matrix @ _matrix(XCAFDoc_ShapeTool.GetLocation_s(component), child)
            self._visit(referred, child, placed, self._color(component) or self._color(referred) or color)

    def _add_instance(self, label: Any, path: str, matrix: NDArray[np.float64], color: str | None) -> None:
        from OCP.TCollection import TCollection_AsciiString
        from OCP.TDF import TDF_Tool
        from OCP.TopLoc import TopLoc_Location
        from OCP.XCAFDoc import XCAFDoc_ShapeTool

        entry = TCollection_AsciiString()
        TDF_Tool.Entry_s(label, entry)
        key = entry.ToCString()
        shape = XCAFDoc_ShapeTool.GetShape_s(label)
        if key not in self._index:
            own = shape.Located(TopLoc_Location())
            n_solids = len(solids(own))
            name = _unique(_name_of(label) or self.path.stem, self._names)
            if n_solids == 0:
                self.notes.append(f"part '{name}' has no solid (free shells or curves): it has no mass and is only seen")
            self._index[key] = len(self.prototypes)
            self.prototypes.append(
                Prototype(
                    name=name,
                    shape=own,
                    n_solids=n_solids,
                    color=self._color(label) or self._face_color(own),
                    material=_material_of(label),
                )
            )
        root = _matrix(shape.Location(), path)  # a part at the root may carry a location of its own
        self.instances.append(PlacedPart(path=path, prototype=self._index[key], matrix=matrix @ root, color=color))

    def _color(self, label: Any) -> str | None:
        from OCP.Quantity import Quantity_Color
        from OCP.XCAFDoc import XCAFDoc_ColorType

        color = Quantity_Color()
        for kind in (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen):
            if self._colors.GetColor_s(label, kind, color):
                return _hex(color)
        return None

    def _face_color(self, shape: Any) -> str | None:
        """The colour of the first coloured solid or face: many exporters colour faces only."""
        from OCP.Quantity import Quantity_Color
        from OCP.TopAbs import TopAbs_ShapeEnum
        from OCP.TopExp import TopExp_Explorer
        from OCP.XCAFDoc import XCAFDoc_ColorType

        color = Quantity_Color()
        for kind in (TopAbs_ShapeEnum.TopAbs_SOLID, TopAbs_ShapeEnum.TopAbs_FACE):
            explorer = TopExp_Explorer(shape, kind)
            while explorer.More():
                for use in (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen):
                    if self._colors.GetColor(explorer.Current(), use, color):
                        return _hex(color)
                explorer.Next()
        return None


def _material_of(label: Any) -> Material | None:
    """Material of a shape label. OCCT normalises densities of files to g/mm^3, whatever their unit."""
    from OCP.TDataStd import TDataStd_TreeNode
    from OCP.XCAFDoc import XCAFDoc, XCAFDoc_Material, XCAFDoc_MaterialTool

    density = XCAFDoc_MaterialTool.GetDensityForShape_s(label) * 1e6
    node, material = TDataStd_TreeNode(), XCAFDoc_Material()
    if density <= 0 or not label.IsAttribute(XCAFDoc.MaterialRefGUID_s()):
        return None
    if not label.FindAttribute(XCAFDoc.MaterialRefGUID_s(), node) or not node.HasFather():
        return None
    if not node.Father().Label().FindAttribute(XCAFDoc_Material.GetID_s(), material):
        return None
    return Material(name=material.GetName().ToCString(), density=density, provenance="cad_material", source="STEP file")


def _hex(color: Any) -> str:
    from OCP.Quantity import Quantity_TypeOfColor

    values = color.Values(Quantity_TypeOfColor.Quantity_TOC_sRGB)
    return "#" + "".join(f"{round(255 * min(max(v, 0.0), 1.0)):02x}" for v in values)


def _name_of(label: Any) -> str:
    from OCP.TDataStd import TDataStd_Name

    name = TDataStd_Name()
    # FindAttribute of an absent attribute crashes in these bindings: ask first.
    if not label.IsAttribute(TDataStd_Name.GetID_s()) or not label.FindAttribute(TDataStd_Name.GetID_s(), name):
        return ""
    return name.Get().ToExtString().strip().replace("/", "_")


def _unique(name: str, taken: Counter) -> str:
    taken[name] += 1
    return name if taken[name] == 1 else f"{name}#{taken[name]}"


def _matrix(location: Any, path: str) -> NDArray[np.float64]:
    transform = location.Transformation()
    matrix = np.eye(4)
    for i in range(3):
        for j in range(4):
            matrix[i, j] = transform.Value(i + 1, j + 1)
    determinant = np.linalg.det(matrix[:3, :3])
    if determinant < 0:
        raise InputRefused(
            f"instance '{path}' is placed by a mirror (determinant {determinant:.3g}); a rigid body cannot be mirrored "
            "by moving it: mirror the shape in CAD and export it as a part of its own"
        )
    if abs(determinant - 1) > 1e-6:
        raise InputRefused(f"instance '{path}' is placed with a scale ({determinant:.6g} in volume); scale the shape in CAD")
    matrix[:3, 3] *= MM
    return matrix
