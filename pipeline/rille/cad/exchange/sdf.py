"""SDF 1.11 (SDFormat), the model format of Gazebo."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.cad.exchange.meshes import FOLDER, rgba
from rille.cad.exchange.outgoing import Note, Outgoing, relative, unit
from rille.cad.exchange.writing import Names, euler, number, numbers, save
from rille.model import Body, CollisionShape, Joint, LoopClosure, Pose, Rover

Array = NDArray[np.float64]

VERSION = "1.11"  # the first with <mimic>
TYPES = {"prismatic": "prismatic", "fixed": "fixed", "spherical": "ball"}


def write_sdf(rover: Rover, folder: Path, *, name: str = "rover", note: Note | None = None) -> Path:
    """Write ``name.sdf``, its meshes and ``model.config`` (so that the folder is a Gazebo model); returns the path of the SDF.

    The model frame is M; link frames are those of rille (parallel to M, origin ``body.frame``). Joints stand at their point. Differentials
    and gears become <mimic> (q_follower = multiplier q_leader), loop closures ball joints between bodies that joints connect already.

    Parameters
    ----------
    note : called with a sentence for whatever is not expressed.

    Raises
    ------
    InputRefused : for a mechanism that is no tree, names that do not exist, a place that cannot be written.
    """
    tell = note or (lambda sentence: None)
    model = Outgoing(rover, folder, tell)
    if rover.differentials or rover.gears:
        tell("differentials and gears are written as <mimic>; of Gazebo's physics engines some enforce it, some ignore it")
    if rover.loop_closures:
        tell("loop closures are written as ball joints; of Gazebo's physics engines not all can close loops")
    path = folder / f"{name}.sdf"
    save(_Writer(model).write(name), path)
    save(_config(name, path.name), folder / "model.config")
    return path


def _config(name: str, file: str) -> ET.Element:
    root = ET.Element("model")
    ET.SubElement(root, "name").text = Names().take(name)
    ET.SubElement(root, "version").text = "1.0"
    ET.SubElement(root, "sdf", version=VERSION).text = file
    ET.SubElement(root, "description").text = "Written by rille"
    return root


class _Writer:
    def __init__(self, model: Outgoing) -> None:
        self.model = model
        self.names = Names(["world", "__root__", "__model__"])  # links, joints and frames share one namespace
        self.links: dict[str | None, str] = {None: "world"}
        self.joints: dict[str, str] = {}
        self.frames: dict[str | None, Array] = {None: np.zeros(3)}
        self.leaders = model.leaders()

    def write(self, name: str) -> ET.Element:
        root = ET.Element("sdf", version=VERSION)
        top = ET.SubElement(root, "model", name=_legal(Names().take(name)))
        for body, _ in self.model.tree:
            self.links[body.name] = self.names.take(_legal(body.name), "link")
            self.frames[body.name] = np.asarray(body.frame, dtype=float)
        for joint in self.model.rover.joints:
            self.joints[joint.name] = self.names.take(_legal(joint.name), "joint")
        self.model.say_renamed("links", {body.name: self.links[body.name] for body, _ in self.model.tree})
        self.model.say_renamed("joints", self.joints)
        for body, _ in self.model.tree:
            self.link(top, body)
        for _, joint in self.model.tree:
            if joint is not None:
                self.joint(top, joint)
        for closure in self.model.rover.loop_closures:
            self.closure(top, closure)
        return root

    def link(self, top: ET.Element, body: Body) -> None:
        node = ET.SubElement(top, "link", name=self.links[body.name])
        frame, properties = self.frames[body.name], body.properties
        _pose(node, frame)
        inertial = ET.SubElement(node, "inertial")
        ET.SubElement(inertial, "mass").text = number(properties.mass, f"mass of body '{body.name}'")
        _pose(inertial, properties.com - frame)
        inertia = ET.SubElement(inertial, "inertia")
        for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
            ET.SubElement(inertia, f"i{'xyz'[i]}{'xyz'[j]}").text = number(properties.inertia[i, j], f"inertia of body '{body.name}'")
        self.visuals(node, body.name)
        names = Names()
        for shape in self.model.shapes(body.name):
            collision = ET.SubElement(node, "collision", name=names.take("collision"))
            self.pose(collision, shape.pose, body.name)
            self.geometry(ET.SubElement(collision, "geometry"), shape)

    def visuals(self, node: ET.Element, body: str) -> None:
        names = Names()
        for instance in self.model.instances(body):
            visual = ET.SubElement(node, "visual", name=names.take(_legal(instance.path)))
            self.pose(visual, instance.pose, body)
            _mesh(ET.SubElement(visual, "geometry"), self.model.visuals[instance.part])
            material = ET.SubElement(visual, "material")
            for light in ("ambient", "diffuse"):
                ET.SubElement(material, light).text = " ".join(f"{v:.6g}" for v in rgba(self.model.color(instance.part)))

    def pose(self, node: ET.Element, pose: Pose, body: str) -> None:
        position, rotation = relative(pose, self.frames[body])
        _pose(node, position, rotation)

    def geometry(self, node: ET.Element, shape: CollisionShape) -> None:
        what = f"size of a collision shape of body '{shape.body}'"
        if shape.kind == "hull":
            _mesh(node, self.model.hulls[id(shape)])
            return
        made = ET.SubElement(node, shape.kind)
        if shape.kind == "box":
            ET.SubElement(made, "size").text = numbers(shape.size, what)
            return
        ET.SubElement(made, "radius").text = number(shape.size[0], what)
        if shape.kind == "cylinder":
            ET.SubElement(made, "length").text = number(shape.size[-1], what)

    def joint(self, top: ET.Element, joint: Joint) -> None:
        subject = f"joint '{joint.name}'"
        kind = TYPES.get(joint.kind) or ("continuous" if joint.limit is None else "revolute")
        node = ET.SubElement(top, "joint", name=self.joints[joint.name], type=kind)
        _pose(node, np.asarray(joint.point) - self.frames[joint.child])
        ET.SubElement(node, "parent").text = self.links[joint.parent]
        ET.SubElement(node, "child").text = self.links[joint.child]
        if joint.kind not in ("hinge", "prismatic"):
            return
        axis = ET.SubElement(node, "axis")
        ET.SubElement(axis, "xyz").text = numbers(unit(joint.axis), subject)
        friction = [self.model.friction(effect, joint) for effect in ("viscous_friction", "coulomb_friction")]
        if any(friction):
            dynamics = ET.SubElement(axis, "dynamics")
            ET.SubElement(dynamics, "damping").text = number(friction[0])
            ET.SubElement(dynamics, "friction").text = number(friction[1])
        self.limit(axis, joint)
        if joint.name in self.leaders:
            leader, factor = self.leaders[joint.name]
            mimic = ET.SubElement(axis, "mimic", joint=self.joints[leader])
            ET.SubElement(mimic, "multiplier").text = number(factor)
            ET.SubElement(mimic, "offset").text = "0"
            ET.SubElement(mimic, "reference").text = "0"

    def limit(self, axis: ET.Element, joint: Joint) -> None:
        drive = self.model.drives.get(joint.name)
        limit = ET.SubElement(axis, "limit")
        if joint.limit is not None:  # without these two there is none
            ET.SubElement(limit, "lower").text = number(joint.limit.lower, f"limit of joint '{joint.name}'")
            ET.SubElement(limit, "upper").text = number(joint.limit.upper, f"limit of joint '{joint.name}'")
        if drive is not None:
            ET.SubElement(limit, "effort").text = number(drive.max_torque, f"max_torque of drive '{drive.name}'")
            if drive.max_speed is not None:
                ET.SubElement(limit, "velocity").text = number(drive.max_speed, f"max_speed of drive '{drive.name}'")
        if joint.limit is not None and joint.limit.stiffness is not None:
            ET.SubElement(limit, "stiffness").text = number(joint.limit.stiffness, f"stop of joint '{joint.name}'")
            ET.SubElement(limit, "dissipation").text = number(joint.limit.damping or 0.0, f"stop of joint '{joint.name}'")

    def closure(self, top: ET.Element, closure: LoopClosure) -> None:
        node = ET.SubElement(top, "joint", name=self.names.take(_legal(closure.name), "joint"), type="ball")
        _pose(node, np.asarray(closure.point) - self.frames[closure.body_a])
        ET.SubElement(node, "parent").text = self.links[closure.body_b]
        ET.SubElement(node, "child").text = self.links[closure.body_a]


def _legal(name: str) -> str:
    """Names that SDF reserves (``a::b`` is b in a; ``__a__``) made ordinary."""
    name = name.replace("::", "_")
    return name.strip("_") or "_" if name.startswith("__") and name.endswith("__") else name


def _pose(node: ET.Element, position: Array, rotation: Array | None = None) -> None:
    angles = (0.0, 0.0, 0.0) if rotation is None else euler(rotation)
    ET.SubElement(node, "pose").text = numbers((*position, *angles))


def _mesh(node: ET.Element, file: str) -> None:
    ET.SubElement(ET.SubElement(node, "mesh"), "uri").text = f"{FOLDER}/{file}"
