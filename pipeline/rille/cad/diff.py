"""What differs between two models, in the words of the machine: not rows, but masses, centres, axes, limits."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rille.model import CollisionShape, Pose, Rover
from rille.model.rotation import matrix_of

Array = NDArray[np.float64]
Kind = Literal["added", "removed", "renamed", "changed"]

TABLES = (
    "model",
    "body",
    "joint",
    "differential",
    "gear",
    "loop",
    "drive",
    "wheel",
    "part",
    "instance",
    "collision",
    "material",
    "sensor",
    "effect",
    "source",
)
"""What is compared, the most important first."""

FLOOR = 1e-12
"""Numbers (SI) that differ by less than this are the same, whatever their size."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """One difference.

    table : one of :data:`TABLES`. name : what changed (after the change). field : which of its values ("" for added, removed, renamed).
    before, after : values in ``unit``. absolute : size of the change in ``unit`` (of vectors the distance, of axes the angle). relative :
    to the size before; None where it has no meaning.
    """

    table: str
    kind: Kind
    name: str
    field: str = ""
    before: Any = None
    after: Any = None
    absolute: float | None = None
    relative: float | None = None
    unit: str = ""
    sentence: str


# How a value is shown: unit, factor from SI.
_UNITS = {
    "mass": ("kg", 1.0),
    "length": ("mm", 1e3),
    "angle": ("deg", 180 / np.pi),
    "density": ("kg/m^3", 1.0),
    "volume": ("cm^3", 1e6),
    "torque": ("N m", 1.0),
    "force": ("N", 1.0),
    "angular_speed": ("rad/s", 1.0),
    "speed": ("m/s", 1.0),
    "rate": ("Hz", 1.0),
    "number": ("", 1.0),
}

_FIELDS: dict[str, list[tuple[str, str]]] = {
    "differential": [("carrier", "text"), ("joint_a", "text"), ("joint_b", "text")],
    "gear": [("ratio", "number"), ("joint_a", "text"), ("joint_b", "text")],
    "loop": [("body_a", "text"), ("body_b", "text"), ("point", "point")],
    "material": [("density", "density"), ("provenance", "text"), ("source", "text")],
    "sensor": [("quantity", "text"), ("target", "text"), ("rate", "rate"), ("frame", "text")],
    "wheel": [("radius", "length"), ("width", "length"), ("center", "point"), ("joint", "text"), ("material", "text")],
}


def diff(a: Rover, b: Rover, *, tolerance: float = 1e-9) -> list[Change]:
    """Differences from ``a`` to ``b``, the most important first; an empty list for equal models.

    Things are matched by name. What vanished under one name and appeared with the same content (parts: the same B-rep digest) under
    another is renamed, and references to it follow. Order: as :data:`TABLES`; in each, what was added, removed or renamed first, then the
    largest relative change.

    Parameters
    ----------
    tolerance : relative change of a number that is none (of vectors and tensors: to their size).
    """
    comparison = _Comparison(a, b, tolerance)
    changes = [change for table in TABLES for change in comparison.table(table)]
    largest: dict[tuple[str, str], float] = {}
    for change in changes:
        key = (change.table, change.name)
        size = np.inf if change.kind != "changed" or change.relative is None else change.relative
        largest[key] = max(largest.get(key, 0.0), size)
    return sorted(
        changes,
        key=lambda c: (TABLES.index(c.table), c.kind == "changed", -largest[c.table, c.name], c.name),
    )


class _Comparison:
    def __init__(self, a: Rover, b: Rover, tolerance: float) -> None:
        self.a, self.b, self.tolerance = a, b, tolerance
        self.new_name: dict[str, dict[str, str]] = {}
        for table, _, rows, signature in _ROWS:
            self.new_name[table] = _renames(rows(a), rows(b), signature)

    def table(self, table: str) -> Iterator[Change]:
        """All changes of one table."""
        if table == "model":
            yield from self._model()
        elif table == "collision":
            yield from self._collision()
        else:
            yield from self._named(table)

    # --- whole

    def _model(self) -> Iterator[Change]:
        masses = [sum(body.properties.mass for body in rover.bodies) for rover in (self.a, self.b)]
        yield from self.number("model", "rover", "total mass", masses[0], masses[1], "mass")
        if all(mass > 0 for mass in masses):
            centers = [
                sum((body.properties.mass * np.asarray(body.properties.com, float) for body in rover.bodies), np.zeros(3)) / mass
                for rover, mass in zip((self.a, self.b), masses, strict=True)
            ]
            yield from self.point("model", "rover", "centre of mass of all", centers[0], centers[1])

    # --- rows with names

    def _named(self, table: str) -> Iterator[Change]:
        _, what, rows, _ = next(row for row in _ROWS if row[0] == table)
        before, after = dict(rows(self.a)), dict(rows(self.b))
        renamed = self.new_name[table]
        for old in before:
            if old in renamed:
                new = renamed[old]
                yield Change(table=table, kind="renamed", name=new, before=old, after=new, sentence=f"{what} '{old}' is now called '{new}'")
            elif old not in after:
                yield Change(
                    table=table,
                    kind="removed",
                    name=old,
                    before=old,
                    sentence=f"{what} '{old}' was removed{self._weight(table, before[old])}",
                )
        for new in after:
            if new not in before and new not in renamed.values():
                yield Change(
                    table=table, kind="added", name=new, after=new, sentence=f"{what} '{new}' was added{self._weight(table, after[new])}"
                )
        compare: Callable[[str, Any, Any], Iterator[Change]] = getattr(self, f"_{table}", None) or self._plain(table)
        for old, row in before.items():
            new = renamed.get(old, old)
            if new in after:
                yield from compare(new, row, after[new])

    def _weight(self, table: str, row: Any) -> str:
        return f" ({row.properties.mass:.6g} kg)" if table in ("body", "part") else ""

    def _plain(self, table: str) -> Callable[[str, Any, Any], Iterator[Change]]:
        def compare(name: str, x: Any, y: Any) -> Iterator[Change]:
            for field, kind in _FIELDS[table]:
                yield from self.value(table, name, field, getattr(x, field), getattr(y, field), kind)

        return compare

    def _body(self, name: str, x: Any, y: Any) -> Iterator[Change]:
        yield from self._mass_properties("body", name, x.properties, y.properties)
        yield from self.point("body", name, "frame", np.array(x.frame), np.array(y.frame))

    def _mass_properties(self, table: str, name: str, x: Any, y: Any) -> Iterator[Change]:
        yield from self.number(table, name, "mass", x.mass, y.mass, "mass")
        yield from self.point(table, name, "centre of mass", np.asarray(x.com, float), np.asarray(y.com, float))
        yield from self._inertia(table, name, np.asarray(x.inertia, float), np.asarray(y.inertia, float))
        yield from self.text(table, name, "provenance of mass", x.mass_provenance, y.mass_provenance)
        yield from self.text(table, name, "provenance of inertia", x.inertia_provenance, y.inertia_provenance)

    def _inertia(self, table: str, name: str, x: Array, y: Array) -> Iterator[Change]:
        scale = max(float(np.abs(x).max()), float(np.abs(y).max()))
        change = float(np.abs(x - y).max())
        if self._same(change, scale):
            return
        relative = change / float(np.abs(x).max()) if np.abs(x).max() > 0 else None
        moments = [np.linalg.eigvalsh(v) if np.isfinite(v).all() else np.full(3, np.nan) for v in (x, y)]
        texts = [" ".join(f"{v:.5g}" for v in m) for m in moments]
        same = texts[0] == texts[1]
        yield Change(
            table=table,
            kind="changed",
            name=name,
            field="inertia",
            before=x.tolist(),
            after=y.tolist(),
            absolute=change,
            relative=relative,
            unit="kg m^2",
            sentence=f"inertia: principal moments {texts[0]}"
            + (" kg m^2 in other directions" if same else f" -> {texts[1]} kg m^2")
            + f", largest change of an element {change:.4g} kg m^2{_percent(relative)}",
        )

    def _joint(self, name: str, x: Any, y: Any) -> Iterator[Change]:
        yield from self.text("joint", name, "kind", x.kind, y.kind)
        yield from self.text("joint", name, "parent", self._followed("body", x.parent), y.parent)
        yield from self.text("joint", name, "child", self._followed("body", x.child), y.child)
        yield from self.point("joint", name, "point", np.array(x.point), np.array(y.point))
        yield from self._axis(name, np.array(x.axis), np.array(y.axis))
        slide = y.kind == "prismatic"
        kind = "length" if slide else "angle"
        for side in ("lower", "upper"):
            low = [None if joint.limit is None else getattr(joint.limit, side) for joint in (x, y)]
            yield from self.number("joint", name, f"{side} limit", low[0], low[1], kind)
        for field in ("stiffness", "damping", "provenance"):
            values = [None if joint.limit is None else getattr(joint.limit, field) for joint in (x, y)]
            if field == "provenance":
                if None not in values:
                    yield from self.text("joint", name, "provenance of limit", *values)
            else:
                yield from self.number("joint", name, f"{field} of stops", values[0], values[1], "number")

    def _axis(self, name: str, x: Array, y: Array) -> Iterator[Change]:
        angle = float(np.arctan2(np.linalg.norm(np.cross(x, y)), x @ y))
        if angle > max(self.tolerance, FLOOR):
            yield Change(
                table="joint",
                kind="changed",
                name=name,
                field="axis",
                before=x.tolist(),
                after=y.tolist(),
                absolute=float(np.rad2deg(angle)),
                relative=angle / np.pi,
                unit="deg",
                sentence=f"axis turned by {np.rad2deg(angle):.4g} deg: ({_vector(x)}) -> ({_vector(y)})",
            )

    def _drive(self, name: str, x: Any, y: Any) -> Iterator[Change]:
        joints = {joint.name: joint for joint in self.b.joints}
        slide = y.joint in joints and joints[y.joint].kind == "prismatic"
        yield from self.text("drive", name, "joint", self._followed("joint", x.joint), y.joint)
        yield from self.text("drive", name, "mode", x.mode, y.mode)
        yield from self.number("drive", name, "max_torque", x.max_torque, y.max_torque, "force" if slide else "torque")
        yield from self.number("drive", name, "max_speed", x.max_speed, y.max_speed, "speed" if slide else "angular_speed")
        for field in ("position_gain", "speed_gain", "integral_gain", "torque_constant", "resistance"):
            yield from self.number("drive", name, field, getattr(x, field), getattr(y, field), "number")
        yield from self.text("drive", name, "provenance", x.provenance, y.provenance)

    def _wheel(self, name: str, x: Any, y: Any) -> Iterator[Change]:
        for field, kind in _FIELDS["wheel"]:
            yield from self.value("wheel", name, field, getattr(x, field), getattr(y, field), kind)
        for field, kind in (("count", "number"), ("height", "length"), ("thickness", "length")):
            values = [None if wheel.grouser is None else getattr(wheel.grouser, field) for wheel in (x, y)]
            yield from self.number("wheel", name, f"{field} of grousers", values[0], values[1], kind)

    def _part(self, name: str, x: Any, y: Any) -> Iterator[Change]:
        if x.brep_hash != y.brep_hash:
            yield Change(
                table="part",
                kind="changed",
                name=name,
                field="geometry",
                before=x.brep_hash,
                after=y.brep_hash,
                sentence=f"geometry changed (digest {x.brep_hash[:8] or 'none'} -> {y.brep_hash[:8] or 'none'})",
            )
        yield from self.number("part", name, "volume", x.volume, y.volume, "volume")
        yield from self._mass_properties("part", name, x.properties, y.properties)
        yield from self.text("part", name, "material", self._followed("material", x.material), y.material)
        yield from self.text("part", name, "color", x.color, y.color)
        meshes = [tuple((m.purpose, len(m.triangles), float(m.tolerance)) for m in part.meshes) for part in (x, y)]
        if meshes[0] != meshes[1]:
            shown = [", ".join(f"{purpose} {n} triangles at {t * 1e3:.3g} mm" for purpose, n, t in m) or "none" for m in meshes]
            yield from self.text("part", name, "meshes", shown[0], shown[1])

    def _instance(self, name: str, x: Any, y: Any) -> Iterator[Change]:
        yield from self.text("instance", name, "part", self._followed("part", x.part), y.part)
        yield from self.text("instance", name, "body", self._followed("body", x.body), y.body)
        yield from self._pose("instance", name, "", x.pose, y.pose)

    def _pose(self, table: str, name: str, what: str, x: Pose, y: Pose) -> Iterator[Change]:
        yield from self.point(table, name, f"{what}position", np.array(x.position), np.array(y.position))
        turn = matrix_of(x.rotation).T @ matrix_of(y.rotation)
        sine = np.linalg.norm([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
        angle = float(np.arctan2(sine, (np.trace(turn) - 1) / 2))
        if angle > max(self.tolerance, FLOOR):
            yield Change(
                table=table,
                kind="changed",
                name=name,
                field=f"{what}rotation",
                before=list(x.rotation),
                after=list(y.rotation),
                absolute=float(np.rad2deg(angle)),
                relative=angle / np.pi,
                unit="deg",
                sentence=f"{what}rotation: turned by {np.rad2deg(angle):.4g} deg",
            )

    def _effect(self, name: str, x: Any, y: Any) -> Iterator[Change]:
        for key in dict.fromkeys([*x.parameters, *y.parameters]):
            values = x.parameters.get(key), y.parameters.get(key)
            if all(v is None or isinstance(v, int | float) for v in values):
                yield from self.number("effect", name, key, *values, "number")
            else:
                yield from self.text("effect", name, key, *(None if v is None else str(v) for v in values))

    def _source(self, name: str, x: Any, y: Any) -> Iterator[Change]:
        yield from self.text("source", name, "content (sha256)", x.sha256[:16], y.sha256[:16])
        yield from self.text("source", name, "tool", x.tool, y.tool)

    # --- collision shapes have no names: they are compared body by body

    def _collision(self) -> Iterator[Change]:
        groups = [_by_body(rover.collision_shapes) for rover in (self.a, self.b)]
        before = {self._followed("body", name) or "": shapes for name, shapes in groups[0].items()}
        for name in dict.fromkeys([*before, *groups[1]]):
            x, y = before.get(name, []), groups[1].get(name, [])
            kinds = [_kinds(shapes) for shapes in (x, y)]
            if kinds[0] != kinds[1]:
                yield Change(
                    table="collision",
                    kind="changed",
                    name=name,
                    field="shapes",
                    before=kinds[0],
                    after=kinds[1],
                    absolute=float(abs(len(y) - len(x))),
                    relative=abs(len(y) - len(x)) / len(x) if x else None,
                    sentence=f"shapes: {kinds[0]} -> {kinds[1]}",
                )
                continue
            for k, (p, q) in enumerate(zip(x, y, strict=True), start=1):
                yield from self._shape(name, f"{p.kind} {k}: " if len(x) > 1 else f"{p.kind}: ", p, q)

    def _shape(self, name: str, what: str, x: CollisionShape, y: CollisionShape) -> Iterator[Change]:
        if x.kind != y.kind:
            yield from self.text("collision", name, f"{what}kind", x.kind, y.kind)
            return
        yield from self._pose("collision", name, what, x.pose, y.pose)
        if len(x.size) == len(y.size) and x.size:
            yield from self.point("collision", name, f"{what}size", np.array(x.size), np.array(y.size))
        if x.vertices is not None and y.vertices is not None:
            if len(x.vertices) != len(y.vertices):
                yield from self.number("collision", name, f"{what}vertices", len(x.vertices), len(y.vertices), "number")
            else:
                apart = float(np.linalg.norm(x.vertices - y.vertices, axis=1).max())
                if not self._same(apart, float(np.abs(x.vertices).max())):
                    yield Change(
                        table="collision",
                        kind="changed",
                        name=name,
                        field=f"{what}vertices",
                        absolute=apart * 1e3,
                        relative=apart / max(float(np.ptp(x.vertices, axis=0).max()), FLOOR),
                        unit="mm",
                        sentence=f"{what}vertices moved by up to {apart * 1e3:.4g} mm",
                    )
        yield from self.text("collision", name, f"{what}material", self._followed("material", x.material), y.material)

    # --- values

    def value(self, table: str, name: str, field: str, x: Any, y: Any, kind: str) -> Iterator[Change]:
        """A value of a plain field."""
        if kind == "point":
            yield from self.point(table, name, field, np.array(x), np.array(y))
        elif kind == "text":
            about = {"joint": "joint", "joint_a": "joint", "joint_b": "joint", "carrier": "body", "body_a": "body", "body_b": "body"}
            about |= {"material": "material"}
            yield from self.text(table, name, field, self._followed(about.get(field, ""), x), y)
        else:
            yield from self.number(table, name, field, x, y, kind)

    def number(self, table: str, name: str, field: str, x: float | None, y: float | None, kind: str) -> Iterator[Change]:
        """A number, or its absence."""
        if x is None and y is None:
            return
        unit, factor = _UNITS[kind]
        if x is None or y is None:
            yield Change(
                table=table,
                kind="changed",
                name=name,
                field=field,
                before=None if x is None else x * factor,
                after=None if y is None else y * factor,
                unit=unit,
                sentence=f"{field}: {_show(x, unit, factor)} -> {_show(y, unit, factor)}",
            )
        elif not self._same(y - x, max(abs(x), abs(y))):
            relative = abs(y - x) / abs(x) if x != 0 else None
            yield Change(
                table=table,
                kind="changed",
                name=name,
                field=field,
                before=x * factor,
                after=y * factor,
                absolute=abs(y - x) * factor,
                relative=relative,
                unit=unit,
                sentence=f"{field}: {_show(x, unit, factor)} -> {_show(y, unit, factor)}, "
                f"{(y - x) * factor:+.4g}{' ' + unit if unit else ''}" + _percent(None if x == 0 else (y - x) / abs(x), signed=True),
            )

    def point(self, table: str, name: str, field: str, x: Array, y: Array) -> Iterator[Change]:
        """Lengths: how far a point has moved, how much sizes have changed."""
        apart = float(np.linalg.norm(y - x))
        scale = float(max(np.linalg.norm(x), np.linalg.norm(y)))
        if self._same(apart, scale):
            return
        moved = "changed by" if field.endswith("size") else "moved by"
        yield Change(
            table=table,
            kind="changed",
            name=name,
            field=field,
            before=(x * 1e3).tolist(),
            after=(y * 1e3).tolist(),
            absolute=apart * 1e3,
            relative=apart / float(np.linalg.norm(x)) if np.linalg.norm(x) > FLOOR else None,
            unit="mm",
            sentence=f"{field} {moved} {apart * 1e3:.4g} mm: ({_vector(x * 1e3)}) -> ({_vector(y * 1e3)}) mm",
        )

    def text(self, table: str, name: str, field: str, x: str | None, y: str | None) -> Iterator[Change]:
        """A word."""
        if x != y:
            yield Change(
                table=table, kind="changed", name=name, field=field, before=x, after=y, sentence=f"{field}: {x or 'none'} -> {y or 'none'}"
            )

    def _same(self, change: float, scale: float) -> bool:
        if np.isnan(change):
            return bool(np.isnan(scale))
        return bool(abs(change) <= max(self.tolerance * scale, FLOOR))

    def _followed(self, table: str, name: str | None) -> str | None:
        """The name that something has in b."""
        return name if name is None else self.new_name.get(table, {}).get(name, name)


Rows = Callable[[Rover], Iterable[tuple[str, Any]]]


def _by_name(attribute: str) -> Rows:
    return lambda rover: [(row.name, row) for row in getattr(rover, attribute)]


def _digits(values: Any) -> tuple[str, ...]:
    return tuple(f"{v:.9e}" for v in np.ravel(np.asarray(values, float)))


# table, what it is called, its rows by name, and what two rows share that differ only in their names
_ROWS: tuple[tuple[str, str, Rows, Callable[[Any], Any] | None], ...] = (
    ("body", "body", _by_name("bodies"), lambda r: _digits([r.properties.mass, *r.properties.com, *np.ravel(r.properties.inertia)])),
    ("joint", "joint", _by_name("joints"), lambda r: (r.kind, *_digits([*r.point, *r.axis]))),
    ("differential", "differential", _by_name("differentials"), None),
    ("gear", "gear", _by_name("gears"), None),
    ("loop", "loop", _by_name("loop_closures"), lambda r: _digits(r.point)),
    ("drive", "drive", _by_name("drives"), None),
    ("wheel", "wheel", _by_name("wheels"), lambda r: _digits([*r.center, r.radius, r.width])),
    ("part", "part", _by_name("parts"), lambda r: r.brep_hash or None),
    ("instance", "instance", lambda rover: [(i.path, i) for i in rover.instances], lambda r: _digits([*r.pose.position, *r.pose.rotation])),
    ("material", "material", _by_name("materials"), None),
    ("sensor", "sensor", _by_name("sensors"), None),
    ("effect", "effect", lambda rover: [(f"{e.kind} on {e.target}", e) for e in rover.effects], None),
    ("source", "source", lambda rover: [(s.file, s) for s in rover.sources], lambda r: r.sha256),
)


def _renames(before: Iterable[tuple[str, Any]], after: Iterable[tuple[str, Any]], signature: Callable[[Any], Any] | None) -> dict[str, str]:
    """Names that vanished, to those under which the same content appeared; only where one fits one."""
    if signature is None:
        return {}
    x, y = dict(before), dict(after)
    gone = {name: signature(row) for name, row in x.items() if name not in y}
    come = {name: signature(row) for name, row in y.items() if name not in x}
    counts = [Counter(signatures.values()) for signatures in (gone, come)]
    found = {}
    for old, mark in gone.items():
        if mark is not None and counts[0][mark] == 1 and counts[1][mark] == 1:
            found[old] = next(new for new, other in come.items() if other == mark)
    return found


def _by_body(shapes: Iterable[CollisionShape]) -> dict[str, list[CollisionShape]]:
    groups: dict[str, list[CollisionShape]] = {}
    for shape in shapes:
        groups.setdefault(shape.body, []).append(shape)
    return groups


def _kinds(shapes: Sequence[CollisionShape]) -> str:
    counts = Counter(shape.kind for shape in shapes)
    plural = {"box": "boxes", "sphere": "spheres", "cylinder": "cylinders", "hull": "hulls"}
    return ", ".join(f"{n} {kind if n == 1 else plural[kind]}" for kind, n in sorted(counts.items())) or "none"


def _vector(v: Array) -> str:
    return " ".join(f"{float(x) + 0.0:.5g}" for x in np.where(np.abs(v) < 1e-9, 0.0, v))


def _show(value: float | None, unit: str, factor: float) -> str:
    return "none" if value is None else f"{value * factor:.6g}{' ' + unit if unit else ''}"


def _percent(relative: float | None, signed: bool = False) -> str:
    if relative is None:
        return ""
    return f" ({100 * relative:+.3g} %)" if signed else f" ({100 * relative:.3g} %)"
