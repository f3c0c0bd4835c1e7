"""STEP files -> prototypes and placed instances, through OCCT's document model (XCAF).

Prototypes are read once and keyed by their label, so a sub-assembly that is used twice shares its parts; every instance
has a path such as ``rover/rocker_left/wheel_front`` that is unique even where names repeat.
"""

# The compiled module OCP has no type stubs that pyright can follow.
# pyright: reportAttributeAccessIssue=false, reportMissingModuleSource=false, reportMissingImports=false

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.cad.files.assembly import Assembly, PlacedPart, Prototype
from rille.cad.files.doubles import doubles
from rille.cad.files.step_text import (
    check_numbers,
    check_placements,
    check_step_file,
    drawn_solids,
    external_files,
    is_utf8,
    states_length,
    what_is_wrong,
)
from rille.cad.geometry import MM
from rille.model import InputRefused, Material

Progress = Callable[[str, float], None]

# Names that exporters invent for occurrences; the product's own name says more.
_INVENTED = re.compile(r"^(NAUO\d*|=>.*|NEXT_ASSEMBLY_USAGE.*|\d+|COMPOUND|SOLID|SHELL)?$", re.IGNORECASE)
# Names of faces that say nothing.
_NO_NAME = re.compile(r"^(|NONE|NULL|''|#?\d+|\$|FACE|ADVANCED_FACE|NO[ _]?NAME)$", re.IGNORECASE)

# Complaints of OCCT about entities that place and shape.
_FAULT = re.compile(
    r"^Unresolved Reference|^Count of Parameters|\((transform\w*|rep_\d|represented_product_relation|representation_relation|"
    r"product_definition_rel[\w.]*|location|axis\d?|ref_direction|position|local_origin|coordinates|direction_ratios|items|"
    r"used_representation|mapp\w*)\)"
)
# CadQuery gives whatever has no name a random one.
_UUID = re.compile(r"^[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}$", re.IGNORECASE)
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\ud800-\udfff\s]+")

MOST_NODES = 100_000  # occurrences of parts; nested patterns can multiply without end
DEEPEST = 200  # levels of nesting
LARGEST = 1e5  # [m]; no part is larger


def read_step(
    path: Path, *, progress: Progress | None = None, make: Callable[..., Prototype] = Prototype.of_shape, face_names: bool = True
) -> Assembly:
    """Read an assembly (or a single part) from a STEP file of any unit and protocol, in this process.

    A broken file can crash or hang OCCT: :func:`rille.cad.load_assembly` reads in a child process, and keeps the result.

    Parameters
    ----------
    path : the file. External references are sought beside it.
    progress : called with what is being done and the fraction done.
    make : makes a prototype of a shape and a name, as :meth:`Prototype.of_shape` does.
    face_names : look for names of faces, too (where a face has faults, that can crash OCCT).

    Raises
    ------
    InputRefused : for a missing file, a file that is no STEP, a file without any shape, and a mirrored instance (a
        rigid body cannot be mirrored by moving it: mirror the shape in CAD). Who needs a mass asks
        :func:`rille.cad.files.assembly.require_solids`.
    """
    path = Path(path)
    check_step_file(path)
    say = progress or (lambda what, fraction: None)
    others = external_files(path)
    for file in (path, *(file for _, file in others if file is not None)):
        check_placements(file)
        check_numbers(file)
    notes = [
        f"'{path.name}' refers to the file '{name}', which is not there: what it draws is missing" for name, file in others if not file
    ]
    if not states_length(path):
        notes.append(f"'{path.name}' states no unit of length: millimetres were taken")
    try:
        assembly = read_document(_load(path, say, notes, face_names), path, progress=progress, make=make, notes=notes)
    except Exception as error:
        if not type(error).__module__.startswith("OCP"):
            raise
        kind, words = type(error).__name__.removeprefix("Standard_"), str(error).strip().splitlines()
        raise InputRefused(f"'{path}' cannot be read: OCCT reports {kind}{': ' + words[0] if words else ''}; export it again") from error
    drawn, read = drawn_solids(path), sum(p.n_solids + p.volume.n_open for p in assembly.prototypes)
    if drawn <= read:
        return assembly
    lost = f"'{path.name}' draws {drawn} solids, of which {read} could be built; the others have faults: check the file in CAD"
    return replace(assembly, notes=(*assembly.notes, lost))


def read_document(
    document: Any,
    path: Path,
    *,
    progress: Progress | None = None,
    make: Callable[..., Prototype] = Prototype.of_shape,
    notes: list[str] | None = None,
) -> Assembly:
    """Walk an XCAF document (TDocStd_Document), for example of a CadQuery assembly; ``path`` names it in sentences.

    Raises
    ------
    InputRefused : as :func:`read_step`.
    """
    reader = _Reader(path, document, progress or (lambda what, fraction: None), make, notes=list(notes or []))
    reader.visit_roots()
    if not reader.prototypes:
        raise InputRefused(f"'{path}' holds no shape; export it again as AP214 or AP242")
    told = (*reader.notes, *doubles(reader.prototypes, reader.instances))
    return Assembly(file=path, prototypes=tuple(reader.prototypes), instances=tuple(reader.instances), notes=told)


def _load(path: Path, say: Progress, notes: list[str], face_names: bool) -> Any:
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Interface import Interface_Static
    from OCP.Message import Message
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document

    for printer in list(Message.DefaultMessenger_s().Printers()):
        Message.DefaultMessenger_s().RemovePrinter(printer)  # OCCT talks on stdout, which is for data
    document = TDocStd_Document(TCollection_ExtendedString("rille"))
    for products in (True, False):  # a file without products still has shapes
        reader = STEPCAFControl_Reader()  # creating one defines the parameters that are set next
        Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
        Interface_Static.SetCVal_s("read.step.codepage", "UTF8" if is_utf8(path) else "CP1252")
        Interface_Static.SetIVal_s("read.stepcaf.subshapes.name", int(face_names))
        Interface_Static.SetIVal_s("read.step.product.mode", int(products))
        for switch in (reader.SetNameMode, reader.SetColorMode, reader.SetMatMode, reader.SetSHUOMode):
            switch(True)
        for switch in (reader.SetLayerMode, reader.SetGDTMode, reader.SetViewMode, reader.SetPropsMode, reader.SetMetaMode):
            switch(False)
        say("reading entities", 0.05)
        # An absolute path: with a relative one OCCT loses external references in sub-folders silently.
        status = reader.ReadFile(str(path.resolve()))
        if status != IFSelect_ReturnStatus.IFSelect_RetDone:
            why = what_is_wrong(path) or f"OCCT reports {status.name.removeprefix('IFSelect_')}"
            raise InputRefused(f"'{path}' cannot be read as STEP: {why}; fetch it again, or export it again from CAD")
        say("building shapes", 0.2)
        if reader.Transfer(document):
            notes.extend(_faults(reader, path))
            return document
    raise InputRefused(f"'{path}' holds no shapes that can be transferred; export it again as AP214 or AP242")


def _faults(reader: Any, path: Path) -> list[str]:
    """A sentence on entities that lack what they need; faults of names and of drawing styles are none of ours."""
    checks = reader.Reader().WS().ModelCheckList()
    found = []
    checks.Start()
    while checks.More():
        check = checks.Value()
        fails = [check.CFail(i) for i in range(1, check.NbFails() + 1)]
        found += [fail for fail in fails if _FAULT.search(fail)]
        checks.Next()
    if not found:
        return []
    entities = "a faulty entity" if len(found) == 1 else f"{len(found)} faulty entities"
    return [f"'{path.name}' has {entities} ({found[0].strip()}); what that describes may be missing or misplaced: check it in CAD"]


@dataclass
class _Reader:
    """Walks the labels of one document."""

    path: Path
    document: Any
    say: Progress
    make: Callable[..., Prototype]
    prototypes: list[Prototype] = field(default_factory=list)
    instances: list[PlacedPart] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _index: dict[str, int] = field(default_factory=dict)
    _names: "_Names" = field(default_factory=lambda: _Names())

    def __post_init__(self) -> None:
        from OCP.XCAFDoc import XCAFDoc_DocumentTool

        self._shapes = XCAFDoc_DocumentTool.ShapeTool_s(self.document.Main())
        self._colors = XCAFDoc_DocumentTool.ColorTool_s(self.document.Main())

    def visit_roots(self) -> None:
        from OCP.TDF import TDF_LabelSequence

        labels = TDF_LabelSequence()
        self._shapes.GetFreeShapes(labels)
        known: dict[str, int] = {}
        nodes = sum(self._occurrences(labels.Value(i), 0, known) for i in range(1, labels.Length() + 1))
        if nodes > MOST_NODES:
            raise InputRefused(
                f"'{self.path}' has {nodes} occurrences of parts; the bound is {MOST_NODES}: export the sub-assemblies you need"
            )
        taken = _Names()
        for i in range(1, labels.Length() + 1):
            label = labels.Value(i)
            name = taken.unique(_name_of(label) or self.path.stem)
            self._visit(label, name, np.eye(4), self._color(label), ())

    def _occurrences(self, label: Any, depth: int, known: dict[str, int]) -> int:
        """How often parts occur below a label; every assembly is counted once, however often it is used."""
        from OCP.TDF import TDF_Label, TDF_LabelSequence
        from OCP.XCAFDoc import XCAFDoc_ShapeTool

        if depth > DEEPEST:
            raise InputRefused(f"'{self.path}' has more than {DEEPEST} levels of nesting, the bound; export the sub-assemblies you need")
        key = _entry(label)
        if key not in known:
            components = TDF_LabelSequence()
            total = 0 if XCAFDoc_ShapeTool.IsAssembly_s(label) else 1
            if XCAFDoc_ShapeTool.GetComponents_s(label, components):
                for i in range(1, components.Length() + 1):
                    referred = TDF_Label()
                    if XCAFDoc_ShapeTool.GetReferredShape_s(components.Value(i), referred):
                        total += self._occurrences(referred, depth + 1, known)
            known[key] = total
        return known[key]

    def _visit(self, label: Any, path: str, matrix: NDArray[np.float64], color: str | None, chain: tuple[Any, ...]) -> None:
        from OCP.TDF import TDF_Label, TDF_LabelSequence
        from OCP.XCAFDoc import XCAFDoc_ShapeTool

        if XCAFDoc_ShapeTool.IsReference_s(label):  # a root that carries a location
            referred = TDF_Label()
            if XCAFDoc_ShapeTool.GetReferredShape_s(label, referred):
                placed = matrix @ _matrix(XCAFDoc_ShapeTool.GetLocation_s(label), path)
                self._visit(referred, path, placed, color or self._color(referred), chain)
            return
        if not XCAFDoc_ShapeTool.IsAssembly_s(label):
            self._add_instance(label, path, matrix, color)
            return
        components = TDF_LabelSequence()
        XCAFDoc_ShapeTool.GetComponents_s(label, components)
        taken = _Names()
        for i in range(1, components.Length() + 1):
            component = components.Value(i)
            referred = TDF_Label()
            if not XCAFDoc_ShapeTool.GetReferredShape_s(component, referred):
                continue
            own, product = _name_of(component), _name_of(referred)
            name = product if _INVENTED.match(own) and product else (own or product or "part")
            child = f"{path}/{taken.unique(name)}"
            placed = matrix @ _matrix(XCAFDoc_ShapeTool.GetLocation_s(component), child)
            links = (*chain, component)
            override = self._override(links) or self._color(component)
            self._visit(referred, child, placed, override or self._color(referred) or color, links)

    def _add_instance(self, label: Any, path: str, matrix: NDArray[np.float64], color: str | None) -> None:
        from OCP.XCAFDoc import XCAFDoc_ShapeTool

        key = _entry(label)
        shape = XCAFDoc_ShapeTool.GetShape_s(label)
        if shape is None or shape.IsNull():
            self.notes.append(f"'{path}' has no shape at all and was left out")
            return
        if key not in self._index:
            self._index[key] = len(self.prototypes)
            self.prototypes.append(self._prototype(label, shape))
        root = _matrix(shape.Location(), path)  # a part at the root may carry a location of its own
        self.instances.append(PlacedPart(path=path, prototype=self._index[key], matrix=matrix @ root, color=color))

    def _prototype(self, label: Any, shape: Any) -> Prototype:
        from OCP.TopLoc import TopLoc_Location

        own = shape.Located(TopLoc_Location())
        name = self._names.unique(_name_of(label) or self.path.stem)
        done = len(self.prototypes)
        self.say(f"weighing {name}", 0.4 + 0.55 * done / (done + 5))
        color, face_colors, named_faces = self._marks(label, own)
        made = self.make(
            own, name, color=self._color(label) or color, face_colors=face_colors, material=_material_of(label), named_faces=named_faces
        )
        size = np.abs(made.bounds).max()
        if not np.isfinite(size) or size > LARGEST:
            raise InputRefused(
                f"part '{name}' reaches {size:.3g} m from its origin; the bound is {LARGEST:.0e} m: "
                "correct the unit or the numbers of the file"
            )
        if made.volume.n_open:
            self.notes.append(
                f"part '{name}' has {made.volume.n_open} of {made.volume.n_open + made.n_solids} solids whose surface is not closed: "
                "they have no volume and are only seen; close them in CAD"
            )
        elif made.n_solids == 0:
            self.notes.append(f"part '{name}' has no solid (free shells or curves): it has no mass and is only seen")
        return made

    def _override(self, links: tuple[Any, ...]) -> str | None:
        """Colour of one occurrence deep in the tree: "specified higher usage" of the components on the way, outermost first."""
        from OCP.TDF import TDF_AttributeSequence
        from OCP.XCAFDoc import XCAFDoc_ShapeTool

        for first in range(len(links) - 1):
            usages = TDF_AttributeSequence()
            if not XCAFDoc_ShapeTool.GetAllComponentSHUO_s(links[first], usages):
                continue
            for i in range(1, usages.Length() + 1):
                usage = usages.Value(i).Label()
                if _leads_to(usage, links[first + 1 :]) and (color := self._color(usage)):
                    return color
        return None

    def _color(self, label: Any) -> str | None:
        from OCP.Quantity import Quantity_Color
        from OCP.XCAFDoc import XCAFDoc_ColorType

        color = Quantity_Color()
        for kind in (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen):
            if self._colors.GetColor_s(label, kind, color):
                return _hex(color)
        return None

    def _marks(self, label: Any, shape: Any) -> tuple[str | None, tuple[str | None, ...], dict[str, tuple[int, ...]]]:
        """Colour of the whole (many exporters colour pieces only), colours of faces, names of faces."""
        from OCP.TDF import TDF_LabelSequence
        from OCP.TopAbs import TopAbs_ShapeEnum
        from OCP.TopExp import TopExp
        from OCP.TopTools import TopTools_IndexedMapOfShape
        from OCP.XCAFDoc import XCAFDoc_ShapeTool

        pieces = TDF_LabelSequence()
        if not XCAFDoc_ShapeTool.GetSubShapes_s(label, pieces):
            return None, (), {}
        index = TopTools_IndexedMapOfShape()
        TopExp.MapShapes_s(shape, TopAbs_ShapeEnum.TopAbs_FACE, index)
        colors: dict[int, tuple[int, str]] = {}  # face -> (rank, colour): a face's own wins over its shell's and its solid's
        names: dict[str, list[int]] = {}
        for i in range(1, pieces.Length() + 1):
            piece = pieces.Value(i)
            color, name = self._color(piece), _text(piece)
            part = XCAFDoc_ShapeTool.GetShape_s(piece)
            if part is None or part.IsNull() or (color is None and _NO_NAME.match(name)):
                continue
            kind = part.ShapeType()
            inside = TopTools_IndexedMapOfShape()
            TopExp.MapShapes_s(part, TopAbs_ShapeEnum.TopAbs_FACE, inside)
            found = [k for j in range(1, inside.Extent() + 1) if (k := index.FindIndex(inside.FindKey(j)))]
            rank = {TopAbs_ShapeEnum.TopAbs_FACE: 2, TopAbs_ShapeEnum.TopAbs_SHELL: 1}.get(kind, 0)
            for k in found if color is not None else ():
                if rank >= colors.get(k, (0, ""))[0]:
                    colors[k] = (rank, str(color))
            if kind == TopAbs_ShapeEnum.TopAbs_FACE and not _NO_NAME.match(name):
                names.setdefault(name, []).extend(k - 1 for k in found)
        shown = tuple(colors[k][1] if k in colors else None for k in range(1, index.Extent() + 1))
        most = Counter(shown).most_common(1)
        single = len(set(shown)) <= 1
        # A name that every face bears is the name of the body.
        named = {name: tuple(found) for name, found in names.items() if 0 < len(found) < max(index.Extent(), 2)}
        return most[0][0] if most else None, () if single else shown, named


def _leads_to(usage: Any, links: tuple[Any, ...]) -> bool:
    """Is a "specified higher usage" that of exactly these components, one below the other?"""
    from OCP.TDF import TDF_LabelSequence
    from OCP.XCAFDoc import XCAFDoc_ShapeTool

    following = TDF_LabelSequence()
    if not XCAFDoc_ShapeTool.GetSHUONextUsage_s(usage, following):
        return not links
    nexts = [following.Value(i) for i in range(1, following.Length() + 1)]
    return bool(links) and any(label.Father().IsEqual(links[0]) and _leads_to(label, links[1:]) for label in nexts)


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


class _Names:
    """Names that were given; a second one of the same kind becomes ``name#2``."""

    def __init__(self) -> None:
        self.taken: set[str] = set()
        self.count: Counter = Counter()

    def unique(self, name: str) -> str:
        given = name
        while given in self.taken:
            self.count[name] += 1
            given = f"{name}#{self.count[name] + 1}"
        self.taken.add(given)
        return given


def _entry(label: Any) -> str:
    """What tells a label from all others of its document."""
    from OCP.TCollection import TCollection_AsciiString
    from OCP.TDF import TDF_Tool

    entry = TCollection_AsciiString()
    TDF_Tool.Entry_s(label, entry)
    return entry.ToCString()


def _name_of(label: Any) -> str:
    """Name of a label as a step of a path: no slash."""
    return _text(label).replace("/", "_")


def _text(label: Any) -> str:
    from OCP.TDataStd import TDataStd_Name

    name = TDataStd_Name()
    # FindAttribute of an absent attribute crashes in these bindings: ask first.
    if not label.IsAttribute(TDataStd_Name.GetID_s()) or not label.FindAttribute(TDataStd_Name.GetID_s(), name):
        return ""
    try:
        text = name.Get().ToExtString()
    except UnicodeDecodeError:
        return ""
    text = _CONTROL.sub(" ", _mended(text)).strip()
    return "" if _UUID.match(text) else text


def _mended(name: str) -> str:
    """A name whose letters are the bytes of UTF-8, as CadQuery hands and exports them, in its own letters; any other as it is.

    Two such letters that follow UTF-8's rules for a lead and a continuation byte (Ã and ¶ for ö) stand in no word of any language.
    """
    try:
        return name.encode("latin-1").decode("utf-8")
    except (UnicodeEncodeError, UnicodeDecodeError):
        return name


def _matrix(location: Any, path: str) -> NDArray[np.float64]:
    transform = location.Transformation()
    matrix = np.eye(4)
    for i in range(3):
        for j in range(4):
            matrix[i, j] = transform.Value(i + 1, j + 1)
    if not np.all(np.isfinite(matrix)) or np.abs(matrix[:3, 3]).max() > LARGEST / MM:
        raise InputRefused(f"instance '{path}' is placed at {matrix[:3, 3] * MM} m; the bound is {LARGEST:.0e} m: correct the file")
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
