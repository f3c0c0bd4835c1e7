"""STEP files as text: is it one, which files does it refer to, what in it is plainly broken. Needs no OCCT."""

import re
from pathlib import Path

from rille.model import InputRefused

LONGEST = 32 * 1024**2  # [byte]; longer files are not searched for what is wrong

_DOCUMENT = re.compile(rb"DOCUMENT_FILE\s*\(\s*'((?:[^']|'')*)'", re.IGNORECASE)
_STEP_NAME = re.compile(r"\.(stp|step|p21|stpz)$", re.IGNORECASE)
_ENTITY = re.compile(rb"#(\d+)\s*=\s*((?:'[^']*'|[^;'])*+);")
_TEXT = re.compile(rb"'(?:[^']|'')*'")
_SOLID = re.compile(rb"=\s*(?:MANIFOLD_SOLID_BREP|BREP_WITH_VOIDS|FACETED_BREP)\s*\(")
_LARGE = re.compile(rb"[eE]\+?0*(?:1[2-9]|[2-9]\d|[1-9]\d\d+)(?!\d)")  # the exponent of a number of 1e12 or more
_GEOMETRY = re.compile(
    rb"\s*#(\d+)\s*=\s*(?:CARTESIAN_POINT|DIRECTION|VECTOR|CIRCLE|ELLIPSE|HYPERBOLA|PARABOLA|\(?\s*(?:BOUNDED|B_SPLINE|RATIONAL)\w*|\w+_SURFACE)\b"
)
_REFERENCE = re.compile(rb"#(\d+)")
_NUMBER = re.compile(rb"(?<![\w#.])[-+]?\d+\.?\d*[eE][-+]?\d+")


def check_step_file(path: Path) -> None:
    """Refuse what is no file, or does not begin as ISO 10303-21 demands."""
    if not path.is_file():
        raise InputRefused(f"there is no STEP file '{path}'")
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise InputRefused(f"the STEP file '{path}' cannot be opened ({error.strerror}); correct its permissions") from error
    if is_xml(head):
        raise InputRefused(
            f"'{path}' is XML, not a STEP file; of a URDF, `rille cad new {path}` drafts a sheet and `rille cad build` builds it"
        )
    if b"ISO-10303-21" not in head:
        raise InputRefused(f"'{path}' is not a STEP file: it does not begin with ISO-10303-21")


def is_xml(head: bytes) -> bool:
    """Whether a file that begins so is XML."""
    return head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<")


def external_files(path: Path) -> list[tuple[str, Path | None]]:
    """Other STEP files that a file refers to, and those that they refer to: name as written, path (None: not there)."""
    found: dict[str, Path | None] = {}
    seen = {path.resolve()}
    queue = [path]
    while queue:
        file = queue.pop(0)
        for match in _DOCUMENT.finditer(file.read_bytes()):
            name = match.group(1).replace(b"''", b"'").decode("utf-8", "replace")
            if not _STEP_NAME.search(name) or name in found:
                continue
            target = file.parent / name
            if not target.is_file():
                found[name] = None
            elif target.resolve() not in seen:
                found[name] = target
                seen.add(target.resolve())
                queue.append(target)
    return sorted(found.items())


def check_numbers(path: Path) -> None:
    """Refuse geometry with coordinates that no part has (1e12 and more, in any unit): OCCT searches along it without end."""
    text = path.read_bytes()
    for match in _LARGE.finditer(text):
        start = text.rfind(b";", 0, match.start()) + 1
        before = text[start : match.start()]
        entity = _GEOMETRY.match(before)
        if entity and before.count(b"'") % 2 == 0:
            number = re.search(rb"[-+.\d]*$", before)
            value = (number.group(0) if number else b"") + match.group(0)
            raise InputRefused(
                f"entity #{int(entity.group(1))} of '{path}' holds the number {value.decode()}; coordinates and lengths stay "
                "below 1e12: the file is broken, export it again"
            )


def drawn_solids(path: Path) -> int:
    """How many solids a file and its external references draw."""
    files = [path, *(file for _, file in external_files(path) if file is not None)]
    return sum(len(_SOLID.findall(file.read_bytes())) for file in files)


def states_length(path: Path) -> bool:
    """Does a file state a unit of length, or at least draw nothing itself?"""
    text = path.read_bytes()
    return b"LENGTH_UNIT" in text or b"CARTESIAN_POINT" not in text


def is_utf8(path: Path) -> bool:
    """Are the bytes of a file UTF-8 (as plain ASCII is)?"""
    try:
        path.read_bytes().decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def check_placements(path: Path) -> None:
    """Refuse a shape that is placed by a mirror or with a scale: OCCT applies neither and says nothing.

    STEP places by a mirror only with a CARTESIAN_TRANSFORMATION_OPERATOR_3D: axes 1 and 3 span a right-handed frame with
    axis 2 or with its opposite (ISO 10303-42, base_axis).
    """
    text = path.read_bytes()
    if b"CARTESIAN_TRANSFORMATION_OPERATOR_3D" not in text:
        return
    bodies = {int(match.group(1)): match.group(2) for match in _ENTITY.finditer(text)}
    for number in sorted(_placing(bodies)):
        operator = bodies.get(number, b"")
        fields = _operator_fields(operator)
        if fields is None:
            continue
        axis1, axis2, scale, axis3 = fields
        x, y, z = (_direction(bodies, axis, default) for axis, default in ((axis1, 0), (axis2, 1), (axis3, 2)))
        handed = sum(z[i] * (x[(i + 1) % 3] * y[(i + 2) % 3] - x[(i + 2) % 3] * y[(i + 1) % 3]) for i in range(3))
        if handed < 0 or scale < 0:
            raise InputRefused(
                f"entity #{number} of '{path}' places a shape by a mirror (determinant -1); a rigid body cannot be mirrored by moving it: "
                "mirror the shape in CAD and export it as a part of its own"
            )
        if abs(scale - 1) > 1e-6:
            raise InputRefused(f"entity #{number} of '{path}' places a shape with the scale {scale:g}; scale the shape in CAD")


def _placing(bodies: dict[int, bytes]) -> set[int]:
    """Numbers of the entities that place shapes in assemblies and parts."""
    found = set()
    for body in bodies.values():
        for match in re.finditer(rb"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION\s*\(\s*#(\d+)", body):
            found.add(int(match.group(1)))
        item = re.match(rb"MAPPED_ITEM\s*\(\s*'(?:[^']|'')*'\s*,\s*#(\d+)\s*,\s*#(\d+)", body)
        if item:
            mapped = _REFERENCE.findall(bodies.get(int(item.group(1)), b""))
            if mapped and b"SHAPE_REPRESENTATION" in bodies.get(int(mapped[-1]), b""):
                found.add(int(item.group(2)))
    return found


def _operator_fields(operator: bytes) -> tuple[int | None, int | None, float, int | None] | None:
    """Axis 1, axis 2, scale, axis 3 of a CARTESIAN_TRANSFORMATION_OPERATOR_3D, simple or complex; None for anything else."""
    plain = _TEXT.sub(b"", operator)
    simple = re.match(rb"CARTESIAN_TRANSFORMATION_OPERATOR_3D\s*\((.*)\)\s*$", plain, re.DOTALL)
    if simple:
        values = simple.group(1).split(b",")[-5:]
    else:
        first = re.search(rb"CARTESIAN_TRANSFORMATION_OPERATOR\s*\(([^)]*)\)", plain)
        last = re.search(rb"CARTESIAN_TRANSFORMATION_OPERATOR_3D\s*\(([^)]*)\)", plain)
        values = [*first.group(1).split(b","), last.group(1)] if first and last else []
    if len(values) != 5:
        return None
    axis1, axis2, _, scale, axis3 = (value.strip() for value in values)
    try:
        factor = 1.0 if scale in (b"$", b"*") else float(scale)
    except ValueError:
        return None
    numbers = [int(axis[1:]) if re.fullmatch(rb"#\d+", axis) else None for axis in (axis1, axis2, axis3)]
    return numbers[0], numbers[1], factor, numbers[2]


def _direction(bodies: dict[int, bytes], number: int | None, default: int) -> list[float]:
    """Components of a DIRECTION; an axis of the frame where none is stated."""
    standard = [float(i == default) for i in range(3)]
    body = bodies.get(number, b"") if number is not None else b""
    values = re.search(rb"\(([^()]*)\)", _TEXT.sub(b"", body)[body.find(b"(") + 1 :])
    if not body or values is None:
        return standard
    try:
        components = [float(value) for value in values.group(1).split(b",")]
    except ValueError:
        return standard
    return components if len(components) == 3 else standard


def what_is_wrong(path: Path) -> str:
    """The plain faults of a file's text, as part of a sentence: a missing end, then the first faulty entity; empty if there are none.

    Cycles, dangling references, impossible numbers and a missing end are what broken exporters, disks and downloads leave. A file
    that is too long to search is looked at only for its end.
    """
    cut = "" if _has_end(path) else "it ends before END-ISO-10303-21 (cut off: the download or copy is incomplete)"
    return ", and ".join(filter(None, (cut, _first_fault(path))))


def _has_end(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - 4096, 0))
        return b"END-ISO-10303-21" in file.read()


def _first_fault(path: Path) -> str:
    """The first entity that cannot be as it is written."""
    if path.stat().st_size > LONGEST:
        return ""
    text = path.read_bytes()
    entities: dict[int, list[int]] = {}
    for match in _ENTITY.finditer(text):
        number, body = int(match.group(1)), _TEXT.sub(b"", match.group(2))
        if number in entities:
            return f"entity #{number} is there twice"
        huge = next((n for n in _NUMBER.findall(body) if not abs(float(n)) < 1e12), None)
        if huge is not None:
            return f"entity #{number} holds the number {huge.decode()}"
        entities[number] = [int(n) for n in _REFERENCE.findall(body)]
    for number, references in entities.items():
        dangling = next((n for n in references if n not in entities), None)
        if dangling is not None:
            return f"entity #{number} refers to #{dangling}, which is not there"
    cycle = _cycle(entities)
    return "" if cycle is None else f"entity #{cycle} refers to itself in a circle"


def _cycle(entities: dict[int, list[int]]) -> int | None:
    """An entity on a circle of references; depth-first search without recursion."""
    state: dict[int, int] = {}  # 1: on the way, 2: done
    for start in entities:
        if start in state:
            continue
        state[start] = 1
        stack = [(start, iter(entities[start]))]
        while stack:
            node, rest = stack[-1]
            following = next(rest, None)
            if following is None:
                state[node] = 2
                stack.pop()
            elif state.get(following) == 1:
                return following
            elif following not in state:
                state[following] = 1
                stack.append((following, iter(entities[following])))
    return None
