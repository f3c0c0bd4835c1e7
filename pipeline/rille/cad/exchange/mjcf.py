"""MJCF, the model format of MuJoCo (checked with 4.0.0)."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.cad.exchange.meshes import FOLDER, rgba
from rille.cad.exchange.outgoing import Note, Outgoing, unit
from rille.cad.exchange.writing import Names, number, numbers, principal_moments, save
from rille.model import Body, CollisionShape, Drive, InputRefused, Joint, MassProperties, Rover

Array = NDArray[np.float64]

TYPES = {"hinge": "hinge", "prismatic": "slide", "spherical": "ball"}
SMALLEST_MOMENT = 1e-14
"""[kg m^2] MuJoCo refuses principal moments below 1e-15."""
SLACK = 1e-12
"""Relative slack of the triangle inequality: MuJoCo leaves none, and rounding of its principal axes breaks it for flat bodies."""
SERVO_STEPS = 10
"""Time constant, in steps, of a speed drive that has no gain: it holds its speed exactly in rille, which an explicit scheme cannot."""


def write_mjcf(
    rover: Rover,
    folder: Path,
    *,
    name: str = "rover",
    note: Note | None = None,
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.80665),
    step: float = 1e-3,
) -> Path:
    """Write ``name.xml`` and its meshes into a folder; returns the path of the XML.

    Body frames are those of rille (parallel to M at the zero pose, origin ``body.frame``). Masses, centres and inertias are written as they
    are (fullinertia), geoms weigh nothing, joints have no damping, friction or armature but that of the model's effects.

    Drives become actuators, limited to their largest effort: speed -> velocity servo (without speed_gain its gain is I/(10 step), I:
    inertia of what the joint carries), position -> position servo with kp = speed_gain position_gain, kv = speed_gain; torque -> motor.
    Differential: q_a + s q_b = 0, gear: q_b = ratio q_a, as equality constraints of joints; loop closures as ``connect``. MuJoCo's
    equalities are soft; they are written as stiff as the step allows. Bodies of the mechanism do not collide with each other, as in rille.

    Parameters
    ----------
    gravity : [m/s^2]. step : [s].
    note : called with a sentence for whatever is not expressed.

    Raises
    ------
    InputRefused : for a mechanism that is no tree, unknown names, values that MuJoCo does not take, a place that cannot be written.
    """
    tell = note or (lambda sentence: None)
    if not step > 0:
        raise InputRefused(f"the step of the MJCF is {step} s; it must be above 0")
    root = _Writer(Outgoing(rover, folder, tell), step).write(name, gravity)
    path = folder / f"{name}.xml"
    save(root, path)
    return path


class _Writer:
    def __init__(self, model: Outgoing, step: float) -> None:
        self.model = model
        self.step = step
        self.body_names, self.joint_names, self.mesh_names = Names(["world"]), Names(), Names()
        self.actuator_names, self.equality_names = Names(), Names()
        self.bodies = {body.name: self.body_names.take(body.name) for body, _ in model.tree}
        self.joints = {joint.name: self.joint_names.take(joint.name) for joint in model.rover.joints}
        self.meshes: dict[str, str] = {}
        self.nodes: dict[str | None, ET.Element] = {}

    def write(self, name: str, gravity: tuple[float, float, float]) -> ET.Element:
        root = ET.Element("mujoco", model=Names().take(name))
        ET.SubElement(
            root,
            "compiler",
            angle="radian",
            autolimits="true",
            balanceinertia="false",
            boundmass="0",
            boundinertia="0",
            inertiafromgeom="false",
            fusestatic="false",
            discardvisual="false",
            meshdir=FOLDER,
        )
        ET.SubElement(root, "option", integrator="RK4", timestep=number(self.step), gravity=numbers(gravity))
        default = ET.SubElement(root, "default")
        seen = ET.SubElement(default, "default", {"class": "visual"})
        ET.SubElement(seen, "geom", contype="0", conaffinity="0", group="2", mass="0")
        felt = ET.SubElement(default, "default", {"class": "collision"})
        ET.SubElement(felt, "geom", contype="1", conaffinity="0", group="3", mass="0")
        self.assets(ET.SubElement(root, "asset"))
        self.nodes[None] = ET.SubElement(root, "worldbody")
        if self.model.held:
            self.visuals(self.nodes[None], None, np.zeros(3))
        for body, joint in self.model.tree:
            self.body(body, joint)
        self.equalities(ET.SubElement(root, "equality"))
        actuators = ET.SubElement(root, "actuator")
        for drive in self.model.rover.drives:
            self.actuator(actuators, drive)
        self.say_what_servos_lack()
        self.model.say_renamed("bodies", self.bodies)
        self.model.say_renamed("joints", self.joints)
        for empty in [child for child in root if child.tag in ("asset", "equality", "actuator") and not len(child)]:
            root.remove(empty)
        return root

    def assets(self, parent: ET.Element) -> None:
        for part in self.model.rover.parts:
            if part.name not in self.model.visuals:
                continue
            corners = {tuple(vertex) for mesh in part.meshes if mesh.purpose == "visual" for vertex in mesh.vertices.tolist()}
            if len(corners) < 4:
                self.model.note(f"the mesh of part '{part.name}' has {len(corners)} corners; MuJoCo needs 4, so it is not shown there")
                continue
            self.meshes[part.name] = self.mesh_names.take(part.name)
            # inertia="shell": a mesh that is only seen may be open or flat.
            ET.SubElement(parent, "mesh", name=self.meshes[part.name], file=self.model.visuals[part.name], inertia="shell")
        for shape in self.model.rover.collision_shapes:
            if id(shape) in self.model.hulls:
                file = self.model.hulls[id(shape)]
                self.meshes[file] = self.mesh_names.take(Path(file).stem, "hull")
                ET.SubElement(parent, "mesh", name=self.meshes[file], file=file)

    def body(self, body: Body, joint: Joint | None) -> None:
        parent = None if joint is None else joint.parent
        origin = np.zeros(3) if parent is None else np.asarray(self.frame(parent))
        frame = np.asarray(body.frame, dtype=float)
        node = ET.SubElement(self.nodes[parent], "body", name=self.bodies[body.name], pos=numbers(frame - origin))
        self.nodes[body.name] = node
        if joint is None:
            ET.SubElement(node, "freejoint", name=self.joint_names.take(body.name, "free"))
        elif joint.kind != "fixed":
            self.joint(node, joint, frame)
        self.inertial(node, body, frame)
        self.visuals(node, body.name, frame)
        for shape in self.model.shapes(body.name):
            self.collision(node, shape, frame)

    def frame(self, body: str) -> tuple[float, float, float]:
        return next(b.frame for b in self.model.rover.bodies if b.name == body)

    def joint(self, node: ET.Element, joint: Joint, frame: Array) -> None:
        subject = f"joint '{joint.name}'"
        made = ET.SubElement(node, "joint", name=self.joints[joint.name], type=TYPES[joint.kind])
        if joint.kind != "prismatic":
            made.set("pos", numbers(np.asarray(joint.point) - frame, subject))
        if joint.kind != "spherical":
            made.set("axis", numbers(unit(joint.axis), subject))
        if joint.limit is not None:
            made.set("range", numbers((joint.limit.lower, joint.limit.upper), f"limit of {subject}"))
            if joint.limit.stiffness is not None:
                self.model.note(f"the elastic stop of {subject} is exported as a limit with MuJoCo's own softness")
        for attribute, kind in (("damping", "viscous_friction"), ("frictionloss", "coulomb_friction")):
            value = self.model.friction(kind, joint)
            if value > 0:
                made.set(attribute, number(value, f"friction of {subject}"))

    def inertial(self, node: ET.Element, body: Body, frame: Array) -> None:
        properties = body.properties
        subject = f"inertia of body '{body.name}'"
        moments = principal_moments(properties)
        if moments[0] < SMALLEST_MOMENT:
            raise InputRefused(
                f"{subject} has the principal moment {moments[0]:g} kg m^2, but MuJoCo takes none below {SMALLEST_MOMENT:g}; "
                "correct it, or make the body part of its carrier"
            )
        excess = moments[2] - moments[0] - moments[1]
        inertia = properties.inertia
        if excess > -SLACK * moments[2]:
            # One number on the diagonal leaves the axes as they are and moves A + B - C by itself.
            inertia = inertia + (excess + SLACK * moments[2]) * np.eye(3)
        if excess > 1e-9 * moments[2]:
            self.model.note(f"{subject} breaks the triangle inequality by {excess:.2g} kg m^2; as much was added to its moments for MuJoCo")
        ET.SubElement(
            node,
            "inertial",
            pos=numbers(properties.com - frame, f"centre of mass of body '{body.name}'"),
            mass=number(properties.mass, f"mass of body '{body.name}'"),
            fullinertia=numbers((inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))), subject),
        )

    def visuals(self, node: ET.Element, body: str | None, frame: Array) -> None:
        for instance in self.model.instances(body):
            if instance.part in self.meshes:
                geom = ET.SubElement(node, "geom", {"class": "visual", "type": "mesh", "mesh": self.meshes[instance.part]})
                geom.set("pos", numbers(np.asarray(instance.pose.position) - frame))
                geom.set("quat", numbers(instance.pose.rotation))
                geom.set("rgba", " ".join(f"{v:.6g}" for v in rgba(self.model.color(instance.part))))

    def collision(self, node: ET.Element, shape: CollisionShape, frame: Array) -> None:
        geom = ET.SubElement(node, "geom", {"class": "collision"})
        if shape.kind == "hull":
            geom.set("type", "mesh")
            geom.set("mesh", self.meshes[self.model.hulls[id(shape)]])
        else:
            geom.set("type", shape.kind)
            halves = {"box": [v / 2 for v in shape.size], "sphere": shape.size[:1], "cylinder": [shape.size[0], shape.size[-1] / 2]}
            geom.set("size", numbers(halves[shape.kind], f"size of a collision shape of body '{shape.body}'"))
        geom.set("pos", numbers(np.asarray(shape.pose.position) - frame))
        geom.set("quat", numbers(shape.pose.rotation))

    def equalities(self, parent: ET.Element) -> None:
        # The time constant of two steps is the stiffest that MuJoCo's documentation calls stable.
        stiff = {"solref": numbers((2 * self.step, 1.0)), "solimp": "0.9999 0.9999 0.001"}
        for name, leader, follower, factor in self.model.couplings():
            ET.SubElement(
                parent,
                "joint",
                name=self.equality_names.take(name),
                joint1=self.joints[follower],
                joint2=self.joints[leader],
                polycoef=numbers((0.0, factor, 0.0, 0.0, 0.0), f"ratio of '{name}'"),
                attrib=stiff,
            )
        for closure in self.model.rover.loop_closures:
            anchor = numbers(np.asarray(closure.point) - np.asarray(self.frame(closure.body_a)), f"point of loop closure '{closure.name}'")
            made = ET.SubElement(parent, "connect", name=self.equality_names.take(closure.name), body1=self.bodies[closure.body_a])
            if closure.body_b is not None:
                made.set("body2", self.bodies[closure.body_b])
            made.set("anchor", anchor)
            made.attrib.update(stiff)

    def actuator(self, parent: ET.Element, drive: Drive) -> None:
        subject = f"drive '{drive.name}'"
        kind = {"speed": "velocity", "torque": "motor", "position": "position"}[drive.mode]
        made = ET.SubElement(parent, kind, name=self.actuator_names.take(drive.name), joint=self.joints[drive.joint])
        most = numbers((-drive.max_torque, drive.max_torque), f"max_torque of {subject}")
        made.set("forcerange", most)
        joint = next(j for j in self.model.rover.joints if j.name == drive.joint)
        gain = drive.speed_gain
        if gain is None:
            gain = self.carried_inertia(joint) / (SERVO_STEPS * self.step)
        if drive.mode == "torque":
            made.set("ctrlrange", most)
            return
        made.set("kv", number(gain, f"speed_gain of {subject}"))
        if drive.mode == "position":
            made.set("kp", number(gain * drive.position_gain, f"position_gain of {subject}"))
            if joint.limit is not None:
                made.set("ctrlrange", numbers((joint.limit.lower, joint.limit.upper)))
        elif drive.max_speed is not None:
            made.set("ctrlrange", numbers((-drive.max_speed, drive.max_speed), f"max_speed of {subject}"))

    def say_what_servos_lack(self) -> None:
        drives = self.model.rover.drives
        bounded = [drive.name for drive in drives if drive.mode == "position" and drive.max_speed is not None]
        integrating = [drive.name for drive in drives if drive.integral_gain > 0]
        for lost, names in (("max_speed", bounded), ("integral_gain", integrating)):
            if names:
                self.model.note(f"{lost} of drives {', '.join(names)} is not exported: MuJoCo's servos know none")

    def carried_inertia(self, joint: Joint) -> float:
        """Inertia about the axis [kg m^2], or mass [kg] if prismatic, of all bodies that a joint carries at the zero pose."""
        carried = {joint.child}
        for body, carrier in self.model.tree:
            if carrier is not None and carrier.parent in carried:
                carried.add(body.name)
        properties = [body.properties for body in self.model.rover.bodies if body.name in carried]
        return sum(_felt(joint, p) for p in properties)


def _felt(joint: Joint, properties: MassProperties) -> float:
    """m for a prismatic joint, a.I a + m |a x (c - p)|^2 for a hinge."""
    if joint.kind == "prismatic":
        return properties.mass
    axis = unit(joint.axis)
    lever = np.cross(axis, properties.com - np.asarray(joint.point))
    return float(axis @ properties.inertia @ axis + properties.mass * lever @ lever)
