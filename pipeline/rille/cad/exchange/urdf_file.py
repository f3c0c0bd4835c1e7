"""A URDF as it stands in its file: links, joints, shapes; checked, but not yet a mechanism."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rille.cad.exchange.writing import UNBOUNDED
from rille.cad.exchange.xml_in import Node, read_xml
from rille.cad.files.step_text import is_xml
from rille.model import InputRefused, nearest_names
from rille.model.rotation import from_rpy

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Mode = Literal["speed", "torque", "position"]

JOINTS = ("fixed", "revolute", "continuous", "prismatic", "floating")
MODES: dict[str, Mode] = {"velocity": "speed", "effort": "torque", "position": "position"}
KNOWN = {"link", "joint", "material", "transmission", "ros2_control", "mujoco"}  # the last: options of a compiler


def is_urdf(path: Path) -> bool:
    """Whether a file is a URDF: by its suffix, or XML that has a <robot> near its beginning."""
    if path.suffix.lower() == ".urdf":
        return True
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError:
        return False  # who reads it says why not
    return is_xml(head) and b"<robot" in head


@dataclass(frozen=True, slots=True, kw_only=True)
class Geometry:
    """size : box: full lengths; sphere: (radius,); cylinder: (radius, length) [m]. file, scale : mesh only."""

    kind: Literal["box", "sphere", "cylinder", "mesh"]
    size: tuple[float, ...] = ()
    file: str = ""
    scale: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """origin : pose (4, 4) in the link. color : "#rrggbb", None: not stated. name : of the visual, may be empty."""

    name: str
    origin: Array
    geometry: Geometry
    color: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Inertial:
    """mass [kg] above 0. com (3,) [m] and inertia (3, 3) [kg m^2] about it, in the link's frame and axes."""

    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """inertial : None where there is none, or no mass in it."""

    name: str
    inertial: Inertial | None
    visuals: tuple[Shape, ...]
    collisions: tuple[Shape, ...]

    @property
    def solid(self) -> bool:
        """Whether it can be a body by itself: it has a mass and, other than a lumped mass, an inertia."""
        return self.inertial is not None and bool(np.any(self.inertial.inertia))


@dataclass(frozen=True, slots=True, kw_only=True)
class UrdfJoint:
    """origin : pose (4, 4) of the child's frame in the parent's. axis (3,) unit, in the child's frame.

    limit : (lower, upper) [rad or m], None: none. effort, velocity : None: not stated. mimic : (leader, multiplier).
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Array
    axis: Array
    limit: tuple[float, float] | None = None
    effort: float | None = None
    velocity: float | None = None
    damping: float = 0.0
    friction: float = 0.0
    mimic: tuple[str, float] | None = None
    line: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class UrdfFile:
    """links, joints : in the file's order. order : names of the links, parents first. root : the first of them.

    carrier : the joint that carries each link but the root. modes : what the command of a driven joint sets.
    """

    name: str
    root: str
    links: dict[str, Link]
    order: tuple[str, ...]
    joints: tuple[UrdfJoint, ...]
    carrier: dict[str, UrdfJoint]
    modes: dict[str, Mode]


def read_urdf_file(path: Path, note: Callable[[str], None]) -> UrdfFile:
    """Read and check a URDF.

    Raises
    ------
    InputRefused : for whatever is malformed, unknown to URDF or physically impossible, and for links that are no tree.
    """
    root = read_xml(path)
    if root.tag != "robot":
        raise InputRefused(f"'{path}' is no URDF: its root is <{root.tag}>, not <robot>")
    macro = next((node for node in root.iter() if str(node.tag).startswith("xacro:")), None)
    if macro is not None:
        raise InputRefused(f"'{path}' holds the macro <{macro.tag}>; expand it first: xacro {path.name} > robot.urdf")
    strange = sorted({str(node.tag) for node in root} - KNOWN)
    if strange:
        note(f"not read of '{path.name}': {', '.join(f'<{tag}>' for tag in strange)}")
    colors: dict[str, str | None] = {}
    for node in root.children("material"):
        colors[node.get("name", "")] = _rgba(node)
    links: dict[str, Link] = {}
    for node in root.children("link"):
        link = _link(node, colors)
        if link.name in links:
            node.refuse(f"there are two links '{link.name}'; names are unique")
        links[link.name] = link
    if not links:
        raise InputRefused(f"'{path}' has no <link>; a robot has at least one")
    joints: dict[str, UrdfJoint] = {}
    carrier: dict[str, UrdfJoint] = {}
    for node in root.children("joint"):
        joint = _joint(node, links)
        if joint.name in joints:
            node.refuse(f"there are two joints '{joint.name}'; names are unique")
        if joint.child in carrier:
            node.refuse(
                f"link '{joint.child}' is the child of joints '{carrier[joint.child].name}' and '{joint.name}'; a URDF is a tree, "
                "cut the loop and close it in a sheet with a [[loop]]"
            )
        joints[joint.name] = carrier[joint.child] = joint
    for node in root.children("joint"):
        joint = joints[node.get("name", "").strip()]
        if joint.mimic is not None:
            _check_mimic(node, joint, joints)
    first, ordered = _tree(path, links, carrier)
    return UrdfFile(
        name=root.get("name", "").strip() or path.stem,
        root=first,
        links=links,
        order=tuple(ordered),
        joints=tuple(joints.values()),
        carrier=carrier,
        modes=_modes(root, joints),
    )


def _tree(path: Path, links: dict[str, Link], carrier: dict[str, UrdfJoint]) -> tuple[str, list[str]]:
    """The root, and all links, parents first."""
    roots = [name for name in links if name not in carrier]
    if len(roots) > 1:
        shown = ", ".join(f"'{name}'" for name in roots[:4])
        raise InputRefused(f"'{path}': links {shown} hang on nothing; a URDF has one root, join the others by joints")
    children: dict[str, list[str]] = {}
    for child in links:
        if child in carrier:
            children.setdefault(carrier[child].parent, []).append(child)
    ordered = list(roots)
    for name in ordered:
        ordered += children.get(name, [])
    if len(ordered) < len(links):
        lost = next(name for name in links if name not in set(ordered))
        raise InputRefused(f"'{path}': link '{lost}' is carried by a circle of joints; a URDF is a tree, cut one of them")
    return roots[0], ordered


def _origin(node: Node, what: str) -> Array:
    """Pose (4, 4) of the <origin> of an element; the identity if it has none."""
    matrix = np.eye(4)
    origin = node.child("origin")
    if origin is not None:
        matrix[:3, :3] = from_rpy(*origin.triple("rpy", f"origin of {what}", (0.0, 0.0, 0.0)))
        matrix[:3, 3] = origin.triple("xyz", f"origin of {what}", (0.0, 0.0, 0.0))
    return matrix


def _link(node: Node, colors: dict[str, str | None]) -> Link:
    name = node.text_of("name", "a link")
    what = f"link '{name}'"
    return Link(
        name=name,
        inertial=_inertial(node, what),
        visuals=tuple(_shape(child, f"visual of {what}", colors) for child in node.children("visual")),
        collisions=tuple(_shape(child, f"collision of {what}", colors) for child in node.children("collision")),
    )


def _inertial(link: Node, what: str) -> Inertial | None:
    node = link.child("inertial")
    if node is None:
        return None
    weight = node.child("mass")
    if weight is None:
        node.refuse(f'inertial of {what} has no mass; give <mass value="..."/>')
    mass = weight.real("value", f"mass of {what}")
    if mass < 0:
        weight.refuse(f"mass of {what} is {mass:g} kg; it must not be below 0")
    tensor = node.child("inertia")
    if mass == 0:
        return None
    if tensor is None:
        node.refuse(f"inertial of {what} has a mass but no <inertia>; give all six elements")
    moments = {key: tensor.real(key, f"inertia of {what}", None if key in ("ixx", "iyy", "izz") else 0.0) for key in _ELEMENTS}
    inertia = np.array(
        [
            [moments["ixx"], moments["ixy"], moments["ixz"]],
            [moments["ixy"], moments["iyy"], moments["iyz"]],
            [moments["ixz"], moments["iyz"], moments["izz"]],
        ]
    )
    origin = _origin(node, f"inertial of {what}")
    if not np.array_equal(origin[:3, :3], np.eye(3)):
        inertia = origin[:3, :3] @ inertia @ origin[:3, :3].T
        inertia = (inertia + inertia.T) / 2
    return Inertial(mass=mass, com=origin[:3, 3], inertia=inertia)


_ELEMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def _shape(node: Node, what: str, colors: dict[str, str | None]) -> Shape:
    holder = node.child("geometry")
    if holder is None or len(holder) == 0:
        node.refuse(f"{what} has no geometry; give a box, sphere, cylinder or mesh")
    geometry = holder[0]
    assert isinstance(geometry, Node)
    color = None
    material = node.child("material")
    if material is not None:
        color = _rgba(material) or colors.get(material.get("name", ""))
    return Shape(name=node.get("name", "").strip(), origin=_origin(node, what), geometry=_geometry(geometry, what), color=color)


def _geometry(node: Node, what: str) -> Geometry:
    def above_zero(attribute: str) -> float:
        value = node.real(attribute, f"{node.tag} in the {what}")
        if value <= 0:
            node.refuse(f"{attribute} of the {node.tag} in the {what} is {value:g} m; it must be above 0")
        return value

    if node.tag == "box":
        size = node.triple("size", f"box in the {what}")
        if min(size) <= 0:
            node.refuse(f"size of the box in the {what} is {size}; all three must be above 0")
        return Geometry(kind="box", size=size)
    if node.tag == "sphere":
        return Geometry(kind="sphere", size=(above_zero("radius"),))
    if node.tag == "cylinder":
        return Geometry(kind="cylinder", size=(above_zero("radius"), above_zero("length")))
    if node.tag != "mesh":
        node.refuse(f"the {what} is a <{node.tag}>, which URDF does not know; use a box, sphere, cylinder or mesh")
    scale = node.triple("scale", f"mesh in the {what}", (1.0, 1.0, 1.0))
    if 0 in scale:
        node.refuse(f"scale of the mesh in the {what} is {scale}; none may be 0")
    return Geometry(kind="mesh", file=node.text_of("filename", f"mesh in the {what}"), scale=scale)


def _rgba(material: Node) -> str | None:
    """Colour "#rrggbb" that a <material> states itself."""
    node = material.child("color")
    if node is None:
        return None
    words = node.text_of("rgba", "a colour").split()
    if len(words) not in (3, 4) or not all(re.fullmatch(r"[-+0-9.eE]+", word) for word in words):
        node.refuse("rgba of a colour must be four numbers from 0 to 1")
    try:
        levels = [min(max(float(word), 0.0), 1.0) for word in words[:3]]
    except ValueError:
        node.refuse("rgba of a colour must be four numbers from 0 to 1")
    return "#" + "".join(f"{round(255 * level):02x}" for level in levels)


def _joint(node: Node, links: dict[str, Link]) -> UrdfJoint:
    name = node.text_of("name", "a joint")
    what = f"joint '{name}'"
    kind = node.text_of("type", what)
    if kind == "planar":
        node.refuse(f"{what} is planar, which rille does not have; make it two prismatic joints and a continuous one")
    if kind not in JOINTS:
        node.refuse(f"{what} has the unknown type '{kind}'; {nearest_names(kind, JOINTS)}")
    ends = {}
    for end in ("parent", "child"):
        holder = node.child(end)
        if holder is None:
            node.refuse(f'{what} has no {end}; give <{end} link="..."/>')
        ends[end] = holder.text_of("link", f"{end} of {what}")
        if ends[end] not in links:
            holder.refuse(f"{what} names the link '{ends[end]}', which does not exist; {nearest_names(ends[end], links)}")
    if ends["parent"] == ends["child"]:
        node.refuse(f"{what} joins link '{ends['child']}' with itself; name two links")
    direction = node.child("axis")
    axis = np.array((1.0, 0.0, 0.0) if direction is None else direction.triple("xyz", f"axis of {what}", (1.0, 0.0, 0.0)))
    length = float(np.linalg.norm(axis))
    if direction is not None and kind not in ("fixed", "floating") and length < 1e-9:
        direction.refuse(f"the axis of {what} has length {length:g}; give a direction")
    dynamics = node.child("dynamics")
    limit, effort, velocity = _limit(node, kind, what)
    return UrdfJoint(
        name=name,
        kind=kind,
        parent=ends["parent"],
        child=ends["child"],
        origin=_origin(node, what),
        axis=axis if length == 0 or abs(length - 1) < 1e-15 else axis / length,
        limit=limit,
        effort=effort,
        velocity=velocity,
        damping=0.0 if dynamics is None else dynamics.real("damping", f"dynamics of {what}", 0.0),
        friction=0.0 if dynamics is None else dynamics.real("friction", f"dynamics of {what}", 0.0),
        mimic=_mimic(node, what),
        line=node.line,
    )


def _limit(joint: Node, kind: str, what: str) -> tuple[tuple[float, float] | None, float | None, float | None]:
    """Range, effort and velocity of a joint."""
    node = joint.child("limit")
    ranged = kind in ("revolute", "prismatic")
    if node is None:
        if ranged:
            joint.refuse(f"{what} is {kind} but has no <limit>; give lower and upper" + (", or make it continuous" * (kind == "revolute")))
        return None, None, None
    effort, velocity = (node.real(key, f"limit of {what}", infinite=True) if key in node.attrib else None for key in ("effort", "velocity"))
    if not ranged:
        return None, effort, velocity
    lower, upper = (node.real(key, f"limit of {what}", 0.0, infinite=True) for key in ("lower", "upper"))
    if lower > upper:
        node.refuse(f"the limits of {what} are {lower:g} to {upper:g}; lower must not be above upper")
    if lower <= -UNBOUNDED and upper >= UNBOUNDED:
        return None, effort, velocity
    if not np.isfinite([lower, upper]).all():
        node.refuse(f"the limits of {what} are {lower:g} to {upper:g}; give two finite ones, or none")
    return (lower, upper), effort, velocity


def _mimic(joint: Node, what: str) -> tuple[str, float] | None:
    node = joint.child("mimic")
    if node is None:
        return None
    leader = node.text_of("joint", f"mimic of {what}")
    multiplier = node.real("multiplier", f"mimic of {what}", 1.0)
    offset = node.real("offset", f"mimic of {what}", 0.0)
    if offset != 0:
        node.refuse(f"mimic of {what} has the offset {offset:g}, but gears of rille are 0 at 0; move the zero of one of the joints")
    if multiplier == 0:
        node.refuse(f"mimic of {what} has the multiplier 0, which holds it still; make the joint fixed")
    return leader, multiplier


def _check_mimic(node: Node, joint: UrdfJoint, joints: dict[str, UrdfJoint]) -> None:
    assert joint.mimic is not None
    leader = joint.mimic[0]
    if leader not in joints:
        node.refuse(f"joint '{joint.name}' mimics the joint '{leader}', which does not exist; {nearest_names(leader, joints)}")
    if leader == joint.name:
        node.refuse(f"joint '{joint.name}' mimics itself; name another joint")
    for one in (joint, joints[leader]):
        if one.kind not in ("revolute", "continuous", "prismatic"):
            node.refuse(f"joint '{joint.name}' mimics '{leader}', but '{one.name}' is {one.kind}; only hinges and prismatic joints can")
    seen, at = {joint.name}, joints[leader]
    while at.mimic is not None and at.mimic[0] in joints:
        if at.name in seen:
            node.refuse(f"joint '{joint.name}' mimics in a circle by way of '{at.name}'; one joint must lead")
        seen.add(at.name)
        at = joints[at.mimic[0]]


def _modes(root: Node, joints: dict[str, UrdfJoint]) -> dict[str, Mode]:
    """Driven joints, by <transmission> (ROS 1) and <ros2_control>, and what their command sets."""
    found: dict[str, Mode] = {}
    for holder in (*root.children("transmission"), *root.children("ros2_control")):
        shared = [interface.text or "" for interface in holder.iter("hardwareInterface")]
        for node in holder.children("joint"):
            name = node.get("name", "").strip()
            words = [interface.get("name", "") for interface in node.children("command_interface")]
            words += [interface.text or "" for interface in node.iter("hardwareInterface")] + shared
            mode: Mode | None = next((mode for word in words for key, mode in MODES.items() if key in word.lower()), None)
            if name in joints and mode is not None:
                found[name] = mode
    return found
