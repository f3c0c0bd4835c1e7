"""What is in an assembly: its tree, its parts, and what to look at before trusting it."""

# The compiled module OCP has no type stubs that pyright can follow.
# pyright: reportAttributeAccessIssue=false, reportMissingModuleSource=false, reportMissingImports=false

import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rille.cad.files.assembly import Assembly, Prototype
from rille.model.rover import Vector

_COUNTER = re.compile(r"(:\d+|#\d+|_\d+)$")


@dataclass(frozen=True, slots=True, kw_only=True)
class PartReport:
    """A prototype. count of its instances, number of solids and of free shells, volume [m^3], size of its bounding box [m].

    material, density [kg/m^3] : as the file states them. warnings : sentences.
    """

    name: str
    count: int
    solids: int
    free_shells: int
    volume: float
    size: Vector
    color: str | None
    material: str | None
    density: float | None
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A line of the tree: name, number of alike siblings that it stands for, instances below one of them, part (leaf) or children."""

    name: str
    count: int
    instances: int
    part: str | None = None
    children: tuple["Node", ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Inspection:
    """Everything that ``rille cad inspect`` says. size : of the whole [m]. volume [m^3], cad_mass [kg] or None."""

    file: str
    instances: int
    solids: int
    size: Vector
    volume: float
    cad_mass: float | None
    tree: tuple[Node, ...]
    parts: tuple[PartReport, ...]
    notes: tuple[str, ...] = field(default=())

    @property
    def warnings(self) -> tuple[str, ...]:
        """Of the file, then of the parts; what is said of many parts is said once."""
        subjects: dict[str, list[str]] = {}
        for part in self.parts:
            for text in part.warnings:
                subjects.setdefault(text, []).append(f"'{part.name}'")
        return (*self.notes, *(f"{_parts(names)}: {text}" for text, names in subjects.items()))


def inspect(assembly: Assembly) -> Inspection:
    """Look at an assembly; the same file gives the same value."""
    counts = Counter(i.prototype for i in assembly.instances)
    parts = tuple(_part(p, counts[k]) for k, p in enumerate(assembly.prototypes))
    corners = np.concatenate([_corners(assembly, i) for i in range(len(assembly.instances))])
    low, high = corners.min(axis=0), corners.max(axis=0)
    weighed = [(p.material.density * p.volume.volume, counts[k]) for k, p in enumerate(assembly.prototypes) if p.material is not None]
    return Inspection(
        file=str(assembly.file),
        instances=len(assembly.instances),
        solids=sum(p.solids * p.count for p in parts),
        size=_vector(high - low),
        volume=sum(p.volume * p.count for p in parts),
        cad_mass=sum(mass * count for mass, count in weighed) if weighed else None,
        tree=_tree(assembly),
        parts=parts,
        notes=assembly.notes,
    )


def as_text(report: Inspection) -> str:
    """Tree, table of parts and warnings, for people."""
    mass = f", {report.cad_mass:.4g} kg where the file has a density" if report.cad_mass is not None else ""
    lines = [
        f"{report.file}: {report.instances} instances of {len(report.parts)} parts, {report.solids} solids, "
        f"{_size(report.size)}, {report.volume * 1e6:.4g} cm^3{mass}",
        "",
    ]
    for root in report.tree:
        lines += _tree_lines(root)
    width = min(44, max((len(_printable(p.name)) for p in report.parts), default=4))
    lines += ["", f"{'part':<{width}} {'count':>5} {'solids':>6} {'volume [cm^3]':>13}  {'box [mm]':<24} {'colour':<8} material"]
    for p in report.parts:
        name = _printable(p.name)
        name = name if len(name) <= width else name[: width - 3] + "..."
        material = "-" if p.material is None else f"{p.material}, {p.density:.4g} kg/m^3"
        box = " x ".join(f"{v * 1e3:.4g}" for v in p.size)
        lines.append(f"{name:<{width}} {p.count:>5} {p.solids:>6} {p.volume * 1e6:>13.5g}  {box:<24} {p.color or '-':<8} {material}")
    if report.warnings:
        lines += ["", "look at:", *(f"  - {_printable(w)}" for w in report.warnings)]
    return "\n".join(lines)


def as_dict(report: Inspection) -> dict[str, Any]:
    """For programs: SI units, named in the keys."""

    def node(n: Node) -> dict[str, Any]:
        value: dict[str, Any] = {"name": n.name, "count": n.count, "instances": n.instances}
        return value | ({"part": n.part} if n.part is not None else {"children": [node(c) for c in n.children]})

    return {
        "file": report.file,
        "instances": report.instances,
        "solids": report.solids,
        "size_m": list(report.size),
        "volume_m3": report.volume,
        "cad_mass_kg": report.cad_mass,
        "tree": [node(n) for n in report.tree],
        "parts": [
            {
                "name": p.name,
                "count": p.count,
                "solids": p.solids,
                "free_shells": p.free_shells,
                "volume_m3": p.volume,
                "size_m": list(p.size),
                "color": p.color,
                "material": p.material,
                "density_kg_m3": p.density,
                "warnings": list(p.warnings),
            }
            for p in report.parts
        ],
        "warnings": list(report.warnings),
    }


def _part(prototype: Prototype, count: int) -> PartReport:
    size = prototype.bounds[1] - prototype.bounds[0]
    shells = _free_shells(prototype.shape)
    warnings = []
    if prototype.n_solids and shells:
        warnings.append(f"{shells} free shells beside its solids have no mass")
    if prototype.n_solids > 1:
        warnings.append(f"{prototype.n_solids} solids in one part cannot move against each other")
    if prototype.n_solids and prototype.volume.volume < 1e-3 * float(np.prod(np.maximum(size, 1e-6))):
        warnings.append("its volume fills less than 0.1 % of its box")
    if float(size.max()) > 100 or 0 < float(size.max()) < 1e-4:
        warnings.append(f"{float(size.max()):.3g} m long; is the unit of the file right?")
    material = prototype.material
    if material is not None and not plausible_density(material.density):
        warnings.append(
            f"a density of {material.density:.4g} kg/m^3 in the file is that of no solid material: state the mass or the material"
        )
    return PartReport(
        name=prototype.name,
        count=count,
        solids=prototype.n_solids,
        free_shells=shells,
        volume=prototype.volume.volume,
        size=_vector(size),
        color=prototype.color,
        material=None if material is None else material.name,
        density=None if material is None else material.density,
        warnings=tuple(warnings),
    )


def plausible_density(density: float) -> bool:
    """Whether a solid can have this density [kg/m^3]: above aerogel and foams, below osmium. Wrong units miss by a factor of 1000."""
    return 10 <= density <= 23000


def _parts(names: list[str]) -> str:
    if len(names) == 1:
        return f"part {names[0]}"
    return f"{len(names)} parts ({', '.join(names[:3])}{', ...' if len(names) > 3 else ''})"


def _free_shells(shape: Any) -> int:
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_SHELL, TopAbs_ShapeEnum.TopAbs_SOLID)
    count = 0
    while explorer.More():
        count += 1
        explorer.Next()
    return count


def _corners(assembly: Assembly, index: int) -> Any:
    instance = assembly.instances[index]
    low, high = assembly.prototypes[instance.prototype].bounds
    box = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    return box @ instance.matrix[:3, :3].T + instance.matrix[:3, 3]


def _tree(assembly: Assembly) -> tuple[Node, ...]:
    root: dict[str, Any] = {}
    for instance in assembly.instances:
        at = root
        *above, leaf = instance.path.split("/")
        for name in above:
            at = at.setdefault(name, {})
        at[leaf] = assembly.prototypes[instance.prototype].name
    return _nodes(root)


def _nodes(branch: dict[str, Any]) -> tuple[Node, ...]:
    """Nodes of a branch; siblings of one part, or of the same content, that differ in their counters only are one node."""
    nodes: dict[tuple, Node] = {}
    for name, content in branch.items():
        children = () if isinstance(content, str) else _nodes(content)
        part = content if isinstance(content, str) else None
        key = (_COUNTER.sub("", name), part, children)
        if key in nodes:
            old = nodes[key]
            nodes[key] = Node(name=old.name, count=old.count + 1, instances=old.instances, part=part, children=children)
        else:
            below = 1 if part is not None else sum(c.count * c.instances for c in children)
            nodes[key] = Node(name=name, count=1, instances=below, part=part, children=children)
    return tuple(nodes.values())


def _tree_lines(node: Node, before: str = "", last: bool = True, top: bool = True) -> list[str]:
    name = _printable(node.name)
    times = f"  x{node.count}" if node.count > 1 else ""
    if node.part is None:
        text = f"{name}/{times}  ({node.instances} instances)"
    else:
        same = node.part == node.name or _COUNTER.sub("", node.part) == _COUNTER.sub("", node.name)
        text = f"{name}{times}" + ("" if same else f"  [{_printable(node.part)}]")
    lines = [text if top else f"{before}{'`-- ' if last else '|-- '}{text}"]
    inner = before if top else before + ("    " if last else "|   ")
    for k, child in enumerate(node.children):
        lines += _tree_lines(child, inner, k == len(node.children) - 1, False)
    return lines


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)


def _size(size: Vector) -> str:
    return " x ".join(f"{v * 1e3:.4g}" for v in size) + " mm"


def _vector(values: Any) -> Vector:
    x, y, z = map(float, values)
    return x, y, z
