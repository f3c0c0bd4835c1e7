"""URDF, the model format of ROS."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.cad.exchange.meshes import FOLDER, rgba
from rille.cad.exchange.outgoing import Note, Outgoing, relative, unit
from rille.cad.exchange.writing import UNBOUNDED, Names, euler, number, numbers, save
from rille.model import Body, CollisionShape, InputRefused, Joint, Pose, Rover
from rille.model.kinematics import parents_first

Array = NDArray[np.float64]

INTERFACES = {
    "speed": "hardware_interface/VelocityJointInterface",
    "torque": "hardware_interface/EffortJointInterface",
    "position": "hardware_interface/PositionJointInterface",
}
"""What a drive's command sets, in the words of a URDF <transmission>."""


def write_urdf(
    rover: Rover,
    folder: Path,
    *,
    name: str = "rover",
    mimic: bool = False,
    drop_loops: bool = False,
    note: Note | None = None,
) -> Path:
    """Write ``name.urdf`` and its meshes into a folder; returns the path of the URDF.

    URDF puts a joint at the origin of its child's frame, so the link frame of a body on a hinge stands at the joint's point, all others at
    ``body.frame``; all link frames are parallel to M at the zero pose, so that joints and inertias need no angles at all.
    A mechanism that the world holds hangs on a link ``world`` without mass.

    Parameters
    ----------
    mimic : write differentials and gears as <mimic>, a relation of positions; most simulators transmit no force by it.
    drop_loops : leave loop closures out, which opens the loops.
    note : called with a sentence for whatever is not expressed.

    Raises
    ------
    InputRefused : for a differential or gear without ``mimic``, a loop closure without ``drop_loops``, a spherical joint, a mechanism that
        is no tree or has several roots, names that do not exist, a place that cannot be written.
    """
    tell = note or (lambda sentence: None)
    _check(rover, mimic, drop_loops, tell)
    root = _Writer(Outgoing(rover, folder, tell)).write(name)
    path = folder / f"{name}.urdf"
    save(root, path)
    return path


def _check(rover: Rover, mimic: bool, drop_loops: bool, tell: Note) -> None:
    """Refuse, or tell, what URDF cannot express."""
    couplings = [f"differential '{d.name}'" for d in rover.differentials] + [f"gear '{g.name}'" for g in rover.gears]
    if couplings and not mimic:
        raise InputRefused(
            f"URDF cannot express {couplings[0]}: export MJCF or SDF, or write it as <mimic> (--mimic), a relation of positions "
            "by which most simulators transmit no force"
        )
    if couplings:
        tell(f"{', '.join(couplings)}: written as <mimic>; most simulators transmit no force by it")
    loops = [f"loop closure '{closure.name}'" for closure in rover.loop_closures]
    if loops and not drop_loops:
        raise InputRefused(f"URDF cannot express {loops[0]}: export MJCF or SDF, or leave it out and the loop open (--drop-loops)")
    if loops:
        tell(f"{', '.join(loops)}: left out, these loops are open in the URDF")
    roots = [body.name for body, joint in parents_first(rover) if joint is None]
    if len(roots) + any(joint.parent is None for joint in rover.joints) > 1:
        raise InputRefused(f"bodies {', '.join(repr(b) for b in roots)} hang on nothing; a URDF has one root, join them by joints")
    for joint in rover.joints:
        if joint.kind == "spherical":
            raise InputRefused(f"URDF cannot express the spherical joint '{joint.name}': export MJCF or SDF, or make it three hinges")


class _Writer:
    def __init__(self, model: Outgoing) -> None:
        self.model = model
        self.names, self.joint_names = Names(), Names()
        self.links: dict[str | None, str] = {}
        self.joints: dict[str, str] = {}
        self.origins: dict[str | None, Array] = {None: np.zeros(3)}
        self.materials: dict[str, str] = {}
        self.leaders = model.leaders()

    def write(self, name: str) -> ET.Element:
        root = ET.Element("robot", name=Names().take(name))
        # MuJoCo reads URDF, too, but drops folders of meshes, visuals and fixed links unless told; other programs skip this element.
        ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", strippath="false", discardvisual="false", fusestatic="false")
        for part in self.model.rover.parts:
            if part.name in self.model.visuals and part.color not in self.materials:
                self.materials[part.color] = f"color_{part.color[1:]}"
                ET.SubElement(ET.SubElement(root, "material", name=self.materials[part.color]), "color", rgba=_color(part.color))
        for body in self.model.rover.bodies:
            self.links[body.name] = self.names.take(body.name)
        for joint in self.model.rover.joints:
            self.joints[joint.name] = self.joint_names.take(joint.name)
        self.model.say_renamed("links", {body.name: self.links[body.name] for body in self.model.rover.bodies})
        self.model.say_renamed("joints", self.joints)
        if self.model.held:
            self.links[None] = self.names.take("world")
            self.visuals(ET.SubElement(root, "link", name=self.links[None]), None)
        for body, joint in self.model.tree:
            hinged = joint is not None and joint.kind == "hinge"
            self.origins[body.name] = np.asarray(joint.point if joint is not None and hinged else body.frame, dtype=float)
        for body in self.model.rover.bodies:
            self.link(root, body)
        for body, joint in self.model.tree:
            if joint is not None:
                self.joint(root, body, joint)
        self.transmissions(root)
        return root

    def link(self, root: ET.Element, body: Body) -> None:
        node = ET.SubElement(root, "link", name=self.links[body.name])
        properties = body.properties
        inertial = ET.SubElement(node, "inertial")
        center = properties.com - self.origins[body.name]
        ET.SubElement(inertial, "origin", xyz=numbers(center, f"centre of mass of body '{body.name}'"), rpy="0 0 0")
        ET.SubElement(inertial, "mass", value=number(properties.mass, f"mass of body '{body.name}'"))
        inertia = ET.SubElement(inertial, "inertia")
        for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
            inertia.set(f"i{'xyz'[i]}{'xyz'[j]}", number(properties.inertia[i, j], f"inertia of body '{body.name}'"))
        self.visuals(node, body.name)
        for shape in self.model.shapes(body.name):
            collision = ET.SubElement(node, "collision")
            self.origin(collision, shape.pose, body.name)
            self.geometry(ET.SubElement(collision, "geometry"), shape)

    def visuals(self, node: ET.Element, body: str | None) -> None:
        names = Names()
        for instance in self.model.instances(body):
            visual = ET.SubElement(node, "visual", name=names.take(instance.path))
            self.origin(visual, instance.pose, body)
            ET.SubElement(ET.SubElement(visual, "geometry"), "mesh", filename=f"{FOLDER}/{self.model.visuals[instance.part]}")
            ET.SubElement(visual, "material", name=self.materials[self.model.color(instance.part)])

    def origin(self, node: ET.Element, pose: Pose, body: str | None) -> None:
        position, rotation = relative(pose, self.origins[body])
        ET.SubElement(node, "origin", xyz=numbers(position), rpy=numbers(euler(rotation)))

    def geometry(self, node: ET.Element, shape: CollisionShape) -> None:
        what = f"size of a collision shape of body '{shape.body}'"
        if shape.kind == "hull":
            ET.SubElement(node, "mesh", filename=f"{FOLDER}/{self.model.hulls[id(shape)]}")
        elif shape.kind == "box":
            ET.SubElement(node, "box", size=numbers(shape.size, what))
        elif shape.kind == "sphere":
            ET.SubElement(node, "sphere", radius=number(shape.size[0], what))
        else:
            ET.SubElement(node, "cylinder", radius=number(shape.size[0], what), length=number(shape.size[-1], what))

    def joint(self, root: ET.Element, body: Body, joint: Joint) -> None:
        kind = {"fixed": "fixed", "prismatic": "prismatic", "hinge": "continuous" if joint.limit is None else "revolute"}[joint.kind]
        subject = f"joint '{joint.name}'"
        node = ET.SubElement(root, "joint", name=self.joints[joint.name], type=kind)
        offset = self.origins[body.name] - self.origins[joint.parent]
        ET.SubElement(node, "origin", xyz=numbers(offset, subject), rpy="0 0 0")
        ET.SubElement(node, "parent", link=self.links[joint.parent])
        ET.SubElement(node, "child", link=self.links[body.name])
        if kind == "fixed":
            return
        ET.SubElement(node, "axis", xyz=numbers(unit(joint.axis), subject))
        friction = [self.model.friction(effect, joint) for effect in ("viscous_friction", "coulomb_friction")]
        if any(friction):
            ET.SubElement(node, "dynamics", damping=number(friction[0]), friction=number(friction[1]))
        self.limit(node, joint)
        if joint.name in self.leaders:
            leader, factor = self.leaders[joint.name]
            ET.SubElement(node, "mimic", joint=self.joints[leader], multiplier=number(factor), offset="0")

    def limit(self, node: ET.Element, joint: Joint) -> None:
        drive = self.model.drives.get(joint.name)
        if drive is None and joint.limit is None and joint.kind == "hinge":
            return
        limit = ET.SubElement(node, "limit")
        if joint.limit is not None:
            limit.set("lower", number(joint.limit.lower, f"limit of joint '{joint.name}'"))
            limit.set("upper", number(joint.limit.upper, f"limit of joint '{joint.name}'"))
            if joint.limit.stiffness is not None:
                self.model.note(f"the elastic stop of joint '{joint.name}' is exported as a limit without elasticity")
        elif joint.kind == "prismatic":
            limit.set("lower", number(-UNBOUNDED))
            limit.set("upper", number(UNBOUNDED))
        limit.set("effort", number(0.0 if drive is None else drive.max_torque, f"max_torque of joint '{joint.name}'"))
        limit.set("velocity", number(UNBOUNDED if drive is None or drive.max_speed is None else drive.max_speed))

    def transmissions(self, root: ET.Element) -> None:
        """Which joints are driven, and what a command sets."""
        names = Names()
        for drive in self.model.rover.drives:
            name = names.take(drive.name)
            node = ET.SubElement(root, "transmission", name=name)
            ET.SubElement(node, "type").text = "transmission_interface/SimpleTransmission"
            joint = ET.SubElement(node, "joint", name=self.joints[drive.joint])
            ET.SubElement(joint, "hardwareInterface").text = INTERFACES[drive.mode]
            actuator = ET.SubElement(node, "actuator", name=name)
            ET.SubElement(actuator, "hardwareInterface").text = INTERFACES[drive.mode]
            ET.SubElement(actuator, "mechanicalReduction").text = "1"


def _color(color: str) -> str:
    return " ".join(f"{v:.6g}" for v in rgba(color))
