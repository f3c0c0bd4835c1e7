"""A commented sheet ``rover.toml`` that holds what geometry can tell: the beginning of a modeler's work, never its end.

Suggestions above the threshold are active and marked ``SUGGESTED (confidence ...)`` with their evidence; what is less sure is commented
out. ``accepted = false`` keeps the sheet from being built before a person has read it.
"""

import glob
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.cad.assign import matches
from rille.cad.files.assembly import Assembly
from rille.cad.materials import library
from rille.cad.suggestion.inspect import plausible_density
from rille.cad.suggestion.values import SuggestedBody, SuggestedJoint, SuggestedWheel, Suggestions
from rille.model.quantity import to_si
from rille.model.sheet import toml_string

DEFAULT_MATERIAL = "aluminium"  # of rille's library; only a beginning, so the sheet says that it is guessed
UNSURE = (
    "--- less sure: both sides are one body above. To use one, uncomment it and give its parent the parts said there. Each block is as it "
    "is when those above it are used, too; where you leave one out, its parts stay with its parent, which stands for it in the blocks below"
)
_UPS = {"z": (0, 0, 1), "y": (0, 1, 0), "x": (1, 0, 0), "-z": (0, 0, -1), "-y": (0, -1, 0), "-x": (-1, 0, 0)}
_COUNTER = re.compile(r"(:\d+|#\d+|_\d+)+$")


def draft_sheet(assembly: Assembly, suggestions: Suggestions, step_path: str) -> str:
    """The sheet as text.

    Parameters
    ----------
    assembly, suggestions : the file and what was found in it.
    step_path : how the sheet names the file: relative to the sheet.

    Returns
    -------
    TOML with comments. With ``accepted = true`` it builds; with nothing edited all masses come from CAD materials or a guessed default.
    """
    paths = [instance.path for instance in assembly.instances]
    lines = [
        *_comment(f"Drafted by `rille cad new` from {step_path}: what geometry can tell. Read it, edit it, then say so:"),
        "accepted = false  # set to true when you have read the suggestions below; `rille cad build` refuses until then",
        "",
        f"step = {toml_string(step_path)}",
        *_up_lines(assembly, suggestions.wheels),
        'tolerance = "0.5 mm"  # of the visual meshes',
        *_default_material(assembly),
    ]
    for sentence in (*assembly.notes, *suggestions.notes):
        lines += _comment("NOTE " + sentence)
    lines += [*_wrong_densities(assembly), "", *_part_lines(assembly, suggestions.bodies), ""]
    together = f"instances that move together ({len(suggestions.bodies)})"
    why = "most volume of what is no wheel, nor a leg with one" if suggestions.wheels else "most volume"
    lines += _comment(f"--- bodies: {together}; '{suggestions.root}' carries the others ({why})")
    for body in suggestions.bodies:
        lines += ["", *_body_lines(body, paths)]
    lines += ["", *_joints_section(suggestions)]
    for joint in suggestions.joints:
        if joint in suggestions.accepted:
            lines += ["", *_joint_lines(joint)]
    known = {body.name for body in suggestions.bodies}
    loops = [j for j in suggestions.joints if j.loop and {j.parent, j.child} <= known]
    weak = [j for j in suggestions.joints if j not in loops and j.confidence < suggestions.threshold]
    if loops:
        lines += ["", *_comment("--- these joints close a circle of joints, so they are loop closures; uncomment what is right")]
        for joint in loops:
            lines += ["", *_loop_lines(joint)]
    if weak:
        lines += ["", *_comment(UNSURE)]
        for joint in weak:
            lines += ["", *(_loop_lines(joint) if joint.loop else _weak_lines(joint, paths))]
    lines += ["", *_wheel_section(suggestions)]
    lines += ["", *_drive_examples(suggestions)]
    return "\n".join(lines).rstrip() + "\n"


def shortest_patterns(wanted: Iterable[int], paths: Sequence[str]) -> list[str]:
    """Few patterns of a sheet that select just the instances with the indices ``wanted`` of all ``paths``.

    A sub-assembly stands for all that is in it; siblings that differ in their counters only share a ``*``.
    """
    chosen = set(wanted)
    inside: dict[str, list[int]] = defaultdict(list)
    for i, path in enumerate(paths):
        parts = path.split("/")
        for depth in range(1, len(parts) + 1):
            inside["/".join(parts[:depth])].append(i)
    whole = {node for node, members in inside.items() if chosen.issuperset(members)}
    tops = [node for node in sorted(whole) if node.rpartition("/")[0] not in whole]
    found = []
    families: dict[str, list[str]] = defaultdict(list)
    for node in tops:
        families[_COUNTER.sub("", node)].append(node)
    for stem, nodes in families.items():
        pattern = _escaped(stem) + "*"
        if len(nodes) > 1 and not stem.endswith("/") and _selects(pattern, paths) == {i for node in nodes for i in inside[node]}:
            found.append(pattern)
        else:
            found += [_escaped(node) for node in nodes]
    return found


def _selects(pattern: str, paths: Sequence[str]) -> set[int]:
    return {i for i, path in enumerate(paths) if matches(path, pattern)}


def _escaped(path: str) -> str:
    """A pattern that means these characters themselves."""
    return glob.escape(path) if re.search(r"[*?[\]]", path) else path


def _default_material(assembly: Assembly) -> list[str]:
    bare = sorted({p.name for p in _weighed(assembly) if p.material is None})
    if not bare:
        return []
    what = f"{len(bare)} parts have" if len(bare) > 1 else f"part '{_printable(bare[0])}' has"
    return [f'default_material = "{DEFAULT_MATERIAL}"  # GUESSED: {what} no material in the file; see `[[part]]` below']


def _wrong_densities(assembly: Assembly) -> list[str]:
    """Rules that replace densities of the file that no solid has: a wrong unit must not weigh a part in silence."""
    wrong = [p for p in _weighed(assembly) if p.material is not None and not plausible_density(p.material.density)]
    if not wrong:
        return []
    lines = ["", *_comment(f"GUESSED: the file gives {len(wrong)} parts a density that no solid has, so these are weighed as said here:")]
    for prototype in wrong:
        assert prototype.material is not None
        note = f"file: {_printable(prototype.material.name)}, {prototype.material.density:.4g} kg/m^3"
        lines += ["[[part]]", f"match = {toml_string(_escaped(prototype.name))}", f'material = "{DEFAULT_MATERIAL}"  # {note}']
    return lines


def _weighed(assembly: Assembly) -> list:
    used = {i.prototype for i in assembly.instances}
    return [p for k, p in enumerate(assembly.prototypes) if k in used and p.n_solids]


def _up_lines(assembly: Assembly, wheels: Sequence[SuggestedWheel]) -> list[str]:
    up = _up_of_wheels(assembly, wheels)
    if up is not None:
        return [f'up = "{up}"  # SUGGESTED: the wheels stand lowest along it. Which axis of the drawing points up?']
    return ['up = "z"  # GUESSED: which axis of the drawing points up?']


def _up_of_wheels(assembly: Assembly, wheels: Sequence[SuggestedWheel]) -> str | None:
    """The direction across all wheel axes along which the wheels reach lowest."""
    if not wheels:
        return None
    corners = np.concatenate([_corners(assembly, i) for i in range(len(assembly.instances))])
    for name, vector in _UPS.items():
        up = np.array(vector, float)
        if any(abs(float(w.axis @ up)) > 0.1 for w in wheels):
            continue
        lowest = [float(w.center @ up) - w.radius - w.grouser_height for w in wheels]
        if max(lowest) - min(lowest) < 0.2 * wheels[0].radius and float((corners @ up).min()) > min(lowest) - 0.01 * wheels[0].radius:
            return name
    return None


def _corners(assembly: Assembly, index: int) -> NDArray[np.float64]:
    """Corners of an instance's bounding box in the drawing [m], shape (8, 3)."""
    instance = assembly.instances[index]
    low, high = assembly.prototypes[instance.prototype].bounds
    box = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    return box @ instance.matrix[:3, :3].T + instance.matrix[:3, 3]


def _part_lines(assembly: Assembly, bodies: Sequence[SuggestedBody]) -> list[str]:
    """A commented [[part]] for every prototype with its volume."""
    used = {i for body in bodies for i in body.instances}
    counts = Counter(assembly.instances[i].prototype for i in used)
    density = next(float(to_si(m.density, "density", "library")) for m in library() if m.name == DEFAULT_MATERIAL)
    lines = _comment("--- parts: state a mass (it wins) or a material where the default is wrong")
    for k, prototype in enumerate(assembly.prototypes):
        if not counts[k] or not prototype.n_solids:
            continue
        material = prototype.material
        material = material if material is not None and plausible_density(material.density) else None
        weight = (material.density if material is not None else density) * prototype.volume.volume
        source = f"{material.name} of the file" if material is not None else f"{DEFAULT_MATERIAL} (guessed)"
        lines += ["#", "# [[part]]", f"# match = {toml_string(_escaped(prototype.name))}"]
        lines += _comment(f"x{counts[k]}, {prototype.volume.volume * 1e6:.4g} cm^3; {_gram(weight)} as {source}", indent="  ")
        lines += [f'# mass = "{_gram(weight)}"', f'# material = "{DEFAULT_MATERIAL}"']
    return lines


def _gram(mass: float) -> str:
    return f"{mass:.4g} kg" if mass >= 1 else f"{mass * 1e3:.4g} g"


def _body_lines(body: SuggestedBody, paths: Sequence[str]) -> list[str]:
    lines = [line for note in body.notes for line in _comment("ASSUMED: " + note)]
    return [*lines, "[[body]]", f"name = {toml_string(body.name)}", f"parts = {_list(shortest_patterns(body.instances, paths))}"]


def _joints_section(suggestions: Suggestions) -> list[str]:
    lines = _comment(
        f"--- joints: confidence says how many of a hundred such findings are right; above {suggestions.threshold:g} they are active"
    )
    if not suggestions.accepted:
        lines += _comment("none was found above the threshold: see the less sure ones below, or write your own:")
        lines += ["# [[joint]]", '# name = "hinge"', '# kind = "hinge"', '# parent = "..."', '# child = "..."']
        lines += ['# point = ["0 mm", "0 mm", "0 mm"]', "# axis = [0, 0, 1]"]
    return lines


def _joint_lines(joint: SuggestedJoint) -> list[str]:
    lines = [*_findings(f"SUGGESTED (confidence {joint.confidence:.2f})", joint), *_joint_keys(joint)]
    if joint.kind == "hinge":
        lines += ['# lower = "-35 deg"  # limits: not in the geometry', '# upper = "35 deg"']
    elif joint.kind == "prismatic":
        lines += ['# lower = "-10 mm"  # limits: not in the geometry', '# upper = "10 mm"']
    return lines


def _joint_keys(joint: SuggestedJoint) -> list[str]:
    return [
        "[[joint]]",
        f"name = {toml_string(joint.name)}",
        f'kind = "{joint.kind}"',
        f"parent = {toml_string(joint.parent)}",
        f"child = {toml_string(joint.child)}",
        f"point = {_millimetres(joint.point)}",
        f"axis = {_numbers(joint.axis)}",
    ]


def _findings(title: str, joint: SuggestedJoint) -> list[str]:
    lines = _comment(title + ":")
    for text in joint.evidence:
        lines += _comment("+ " + text, indent="  ")
    for text in joint.doubts:
        lines += _comment("- but " + text, indent="  ")
    return lines


def _loop_lines(joint: SuggestedJoint) -> list[str]:
    lines = _findings(f"SUGGESTED (confidence {joint.confidence:.2f})", joint)
    keys = [
        "[[loop]]",
        f"name = {toml_string(joint.name)}",
        f"body_a = {toml_string(joint.parent)}",
        f"body_b = {toml_string(joint.child)}",
    ]
    return [*lines, *("# " + line for line in [*keys, f"point = {_millimetres(joint.point)}"])]


def _weak_lines(joint: SuggestedJoint, paths: Sequence[str]) -> list[str]:
    lines = _findings(f"UNSURE (confidence {joint.confidence:.2f})", joint)
    if joint.moving:
        lines += [f"# body {toml_string(joint.parent)} would keep: parts = {_list(shortest_patterns(joint.staying, paths))}"]
        lines += [f"# joint {toml_string(name)} would have: parent = {toml_string(joint.child)}" for name in joint.carries]
        lines += ["# [[body]]", f"# name = {toml_string(joint.child)}", f"# parts = {_list(shortest_patterns(joint.moving, paths))}"]
    return [*lines, *("# " + line for line in _joint_keys(joint))]


def _wheel_section(suggestions: Suggestions) -> list[str]:
    lines = _comment("--- wheels: radius of the rim without grousers")
    if not suggestions.wheels:
        return [*lines, "# [[wheel]]", '# joint = "..."', '# radius = "150 mm"', '# width = "100 mm"']
    for wheel in suggestions.wheels:
        lines += ["", *_comment(f"SUGGESTED (confidence {wheel.confidence:.2f}): " + "; ".join(wheel.evidence))]
        lines += [
            "[[wheel]]",
            f"joint = {toml_string(wheel.joint)}",
            f'radius = "{_measured(wheel.radius)}"',
            f'width = "{_measured(wheel.width)}"',
        ]
        lines += [f"center = {_millimetres(wheel.center)}"]
        if wheel.grouser_count:
            height, thickness = _measured(wheel.grouser_height), _measured(wheel.grouser_thickness)
            lines += [f'grousers = {{ count = {wheel.grouser_count}, height = "{height}", thickness = "{thickness}" }}']
    return lines


def _drive_examples(suggestions: Suggestions) -> list[str]:
    lines = _comment("--- drives: not in the geometry; one example for each kind")
    wheels = {w.joint for w in suggestions.wheels}
    for joints, mode, torque, speed in (
        ([j for j in suggestions.accepted if j.name in wheels], "speed", "15 N m", "3 rad/s"),
        ([j for j in suggestions.accepted if j.name not in wheels and j.kind == "hinge"], "position", "30 N m", "20 deg/s"),
    ):
        if joints:
            lines += ["#", "# [[drive]]", f"# joint = {toml_string(joints[0].name)}", f'# mode = "{mode}"']
            lines += [f'# max_torque = "{torque}"', f'# max_speed = "{speed}"']
    return lines


# --- TOML


def _comment(text: str, indent: str = "") -> list[str]:
    """Comment lines of at most 140 characters."""
    import textwrap

    return textwrap.wrap(
        _printable(text),
        138,
        initial_indent="# " + indent,
        subsequent_indent="#   " + indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)


def _list(values: Sequence[str]) -> str:
    return "[" + ", ".join(toml_string(v) for v in values) + "]"


def _millimetres(point: NDArray[np.float64]) -> str:
    return "[" + ", ".join(f'"{_mm(v)} mm"' for v in point) + "]"


def _mm(length: float) -> str:
    """Millimetres to a nanometre, without trailing zeros."""
    return f"{round(float(length) * 1e3, 6) + 0.0:.6f}".rstrip("0").rstrip(".")


def _measured(length: float) -> str:
    """A length that was read off triangles: five digits are more than they hold."""
    return f"{float(length) * 1e3:.5g} mm"


def _numbers(values: NDArray[np.float64]) -> str:
    return "[" + ", ".join(f"{round(float(v), 9) + 0.0:.9f}".rstrip("0").rstrip(".") for v in values) + "]"
