"""The tables of a sheet -> joints, drives, couplings, wheels and sensors."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rille.cad.entries import known, not_negative, optional_positive, positive, unique, vector
from rille.cad.frames import Frames
from rille.cad.materials import Materials
from rille.cad.sheet import JointSheet, MotorSheet, RoverSheet
from rille.model import (
    Differential,
    Drive,
    Effect,
    Gear,
    Grouser,
    InputRefused,
    Joint,
    JointLimit,
    LoopClosure,
    Sensor,
)
from rille.model.quantity import to_si
from rille.model.recording import find_quantity
from rille.model.rover import Wheel


@dataclass(frozen=True, slots=True, kw_only=True)
class Units:
    """Units of a joint with one freedom, by its kind."""

    position: str
    speed: str
    effort: str
    stiffness: str
    damping: str


UNITS = {
    "hinge": Units(position="rad", speed="rad/s", effort="N m", stiffness="N m/rad", damping="N m s/rad"),
    "prismatic": Units(position="m", speed="m/s", effort="N", stiffness="N/m", damping="N s/m"),
}


def make_joints(page: RoverSheet, bodies: list[str], frames: Frames) -> dict[str, Joint]:
    """Joints by name, which hold the bodies together as one tree.

    Raises
    ------
    InputRefused : for unknown bodies, bodies with two carriers, circles, loose bodies, and limits that make no sense.
    """
    unique([joint.name for joint in page.joint], "joint")
    joints: dict[str, Joint] = {}
    for joint in page.joint:
        subject = f"joint '{joint.name}'"
        point, axis = frames.line_of(joint)
        parent = None if joint.parent is None else known(joint.parent, bodies, "body", subject)
        child = known(joint.child, bodies, "body", subject)
        other = next((j for j in joints.values() if j.child == child), None)
        if other is not None:
            raise InputRefused(
                f"body '{child}' is the child of joint '{other.name}' and of {subject}; a body has one carrier, close loops with a [[loop]]"
            )
        joints[joint.name] = Joint(
            name=joint.name,
            kind=joint.kind,
            parent=parent,
            child=child,
            point=vector(point),
            axis=vector(axis),
            limit=_limit(joint, subject),
        )
    check_tree(joints, bodies)
    return joints


def check_tree(joints: Mapping[str, Joint], bodies: list[str]) -> None:
    """Refuse circles, and bodies that nothing carries but the first."""
    carrier = {j.child: j.parent for j in joints.values()}
    for body in bodies:
        seen, at = [body], carrier.get(body)
        while at is not None:
            if at in seen:
                raise InputRefused(
                    f"body '{body}' is carried by a circle of joints ({' <- '.join([*seen, at])}); cut one and close it with a [[loop]]"
                )
            seen.append(at)
            at = carrier.get(at)
    roots = [body for body in bodies if body not in carrier]
    held = [j.child for j in joints.values() if j.parent is None]
    if len(roots) > 1 or (roots and held):
        raise InputRefused(f"bodies {', '.join(repr(b) for b in [*roots, *held])} are not joined to each other; add a [[joint]]")


def make_frictions(page: RoverSheet) -> tuple[Effect, ...]:
    """Friction of joints as effects of the catalogue (coulomb_friction, viscous_friction)."""
    effects = []
    for joint in page.joint:
        if joint.friction is None:
            continue
        subject = f"friction of joint '{joint.name}'"
        if joint.kind not in UNITS:
            raise InputRefused(f"joint '{joint.name}' is {joint.kind} and has friction; only hinges and prismatic joints can")
        unit = UNITS[joint.kind]
        dry = not_negative(joint.friction.coulomb, unit.effort, f"coulomb {subject}")
        viscous = not_negative(joint.friction.viscous, unit.damping, f"viscous {subject}")
        if dry > 0:
            effects.append(Effect(kind="coulomb_friction", target=joint.name, parameters={"torque": dry}))
        if viscous > 0:
            effects.append(Effect(kind="viscous_friction", target=joint.name, parameters={"coefficient": viscous}))
    return tuple(effects)


def make_drives(page: RoverSheet, joints: Mapping[str, Joint]) -> tuple[tuple[Drive, ...], tuple[Effect, ...]]:
    """Drives, and the motor lines of those that have one (effect motor_saturation)."""
    drives, lines = [], []
    for drive in page.drive:
        name = drive.name or drive.joint
        subject = f"drive '{name}'"
        joint = joints[known(drive.joint, joints, "joint", subject)]
        if joint.kind not in UNITS:
            raise InputRefused(f"{subject} acts on joint '{joint.name}', which is {joint.kind}; use a hinge or prismatic joint")
        unit = UNITS[joint.kind]
        if (drive.max_torque is None) == (drive.motor is None):
            raise InputRefused(
                f"{subject} needs one of `max_torque` and `motor`; give the largest torque at the joint, or the motor's line and its gear"
            )
        if drive.motor is not None and (drive.torque_constant is not None or drive.resistance is not None):
            raise InputRefused(f"{subject} has a motor and constants of its own; write torque_constant and resistance into `motor`")
        if drive.motor is not None and joint.kind != "hinge":
            raise InputRefused(
                f"{subject} has a motor with a gear on the {joint.kind} joint '{joint.name}'; give its `max_torque` [N] instead"
            )
        motor = drive.motor
        if motor is None:
            torque = positive(drive.max_torque or 0.0, unit.effort, f"max_torque of {subject}")
            constant = optional_positive(drive.torque_constant, f"{unit.effort}/A", f"torque_constant of {subject}")
            resistance = optional_positive(drive.resistance, "ohm", f"resistance of {subject}")
        else:
            geared = _geared(motor, subject)
            torque, constant, resistance = geared.torque, geared.constant, geared.resistance
            lines.append(Effect(kind="motor_saturation", target=joint.name, parameters={"inverse_no_load_speed": 1 / geared.fastest}))
        drives.append(
            Drive(
                name=name,
                joint=joint.name,
                mode=drive.mode,
                max_torque=torque,
                max_speed=optional_positive(drive.max_speed, unit.speed, f"max_speed of {subject}"),
                position_gain=positive(drive.position_gain, "1/s", f"position_gain of {subject}"),
                speed_gain=optional_positive(drive.speed_gain, unit.damping, f"speed_gain of {subject}"),
                integral_gain=to_si(drive.integral_gain, unit.stiffness, f"integral_gain of {subject}"),
                torque_constant=constant,
                resistance=resistance,
            )
        )
    unique([drive.name for drive in drives], "drive")
    return tuple(drives), tuple(lines)


def make_differentials(page: RoverSheet, bodies: list[str], joints: Mapping[str, Joint]) -> tuple[Differential, ...]:
    """Differentials: two parallel hinges on one carrier."""
    unique([d.name for d in page.differential], "differential")
    for d in page.differential:
        subject = f"differential '{d.name}'"
        carrier = known(d.carrier, bodies, "body", subject)
        a, b = (joints[known(name, joints, "joint", subject)] for name in (d.joint_a, d.joint_b))
        if a is b:
            raise InputRefused(f"{subject} names the joint '{a.name}' twice; name the hinges of its two inputs")
        for joint in (a, b):
            if joint.kind != "hinge" or joint.parent != carrier:
                raise InputRefused(
                    f"{subject} needs hinges on its carrier '{carrier}'; joint '{joint.name}' is {joint.kind} on '{joint.parent}'"
                )
        if abs(abs(float(np.dot(a.axis, b.axis))) - 1) > 1e-6:
            raise InputRefused(f"{subject} needs parallel hinges; the axes of '{a.name}' and '{b.name}' are not")
    return tuple(Differential(name=d.name, carrier=d.carrier, joint_a=d.joint_a, joint_b=d.joint_b) for d in page.differential)


def make_gears(page: RoverSheet, joints: Mapping[str, Joint]) -> tuple[Gear, ...]:
    """Gear pairs."""
    unique([g.name for g in page.gear], "gear")
    gears = []
    for g in page.gear:
        subject = f"gear '{g.name}'"
        a, b = (known(name, joints, "joint", subject) for name in (g.joint_a, g.joint_b))
        ratio = to_si(g.ratio, "dimensionless", f"ratio of {subject}")
        if a == b or ratio == 0:
            raise InputRefused(f"{subject} has ratio {ratio:g} between '{a}' and '{b}'; give two joints and a ratio other than 0")
        gears.append(Gear(name=g.name, joint_a=a, joint_b=b, ratio=ratio))
    return tuple(gears)


def make_loops(page: RoverSheet, bodies: list[str], frames: Frames) -> tuple[LoopClosure, ...]:
    """Points that two bodies share."""
    unique([loop.name for loop in page.loop], "loop")
    loops = []
    for loop in page.loop:
        subject = f"loop '{loop.name}'"
        a = known(loop.body_a, bodies, "body", subject)
        b = None if loop.body_b is None else known(loop.body_b, bodies, "body", subject)
        if a == b:
            raise InputRefused(f"{subject} joins body '{a}' with itself; name two bodies")
        if (loop.at is None) == (loop.point is None):
            raise InputRefused(f"{subject} needs one of `at` and `point`; say where the two bodies meet")
        point = frames.find(loop.at, subject)[0] if loop.at is not None else frames.point(loop.point or [], f"point of {subject}")
        loops.append(LoopClosure(name=loop.name, body_a=a, body_b=b, point=vector(point)))
    return tuple(loops)


def make_wheels(page: RoverSheet, joints: Mapping[str, Joint], frames: Frames, materials: Materials) -> tuple[Wheel, ...]:
    """Wheels on hinges."""
    wheels = []
    for wheel in page.wheel:
        name = wheel.name or wheel.joint
        subject = f"wheel '{name}'"
        joint = joints[known(wheel.joint, joints, "joint", subject)]
        if joint.kind != "hinge":
            raise InputRefused(f"{subject} turns on joint '{joint.name}', which is {joint.kind}; a wheel needs a hinge")
        other = next((made.name for made in wheels if made.joint == joint.name), None)
        if other is not None:
            raise InputRefused(
                f"{subject} turns on joint '{joint.name}' like wheel '{other}'; a joint carries one wheel: "
                "give each its own body and hinge, or leave one out"
            )
        grouser = None
        if wheel.grousers is not None:
            grouser = Grouser(
                count=wheel.grousers.count,
                height=positive(wheel.grousers.height, "length", f"grouser height of {subject}"),
                thickness=positive(wheel.grousers.thickness, "length", f"grouser thickness of {subject}"),
            )
        wheels.append(
            Wheel(
                name=name,
                joint=joint.name,
                center=joint.point if wheel.center is None else vector(frames.point(wheel.center, f"center of {subject}")),
                radius=positive(wheel.radius, "length", f"radius of {subject}"),
                width=positive(wheel.width, "length", f"width of {subject}"),
                material=None if wheel.material is None else materials.find(wheel.material, subject).name,
                grouser=grouser,
            )
        )
    unique([wheel.name for wheel in wheels], "wheel")
    return tuple(wheels)


def make_sensors(page: RoverSheet) -> tuple[Sensor, ...]:
    """Sensors; their targets are checked where the model is stored."""
    unique([sensor.name for sensor in page.sensor], "sensor")
    return tuple(
        Sensor(
            name=s.name,
            quantity=find_quantity(s.quantity, f"sensor '{s.name}'").name,
            target=s.target,
            rate=positive(s.rate, "Hz", f"rate of sensor '{s.name}'"),
            frame=s.frame,
        )
        for s in page.sensor
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Geared:
    """A motor behind its gear, as the joint sees it: stall torque [N m], speed without load [rad/s], constant [N m/A], resistance [ohm]."""

    torque: float
    fastest: float
    constant: float | None
    resistance: float | None


def _geared(motor: MotorSheet, subject: str) -> _Geared:
    ratio = positive(motor.gear_ratio, "dimensionless", f"gear_ratio of {subject}")
    efficiency = positive(motor.efficiency, "dimensionless", f"efficiency of {subject}")
    if efficiency > 1:
        raise InputRefused(f"efficiency of {subject} is {efficiency:g}; it must lie above 0 and not above 1")
    constant = optional_positive(motor.torque_constant, "N m/A", f"torque_constant of {subject}")
    return _Geared(
        torque=positive(motor.stall_torque, "N m", f"stall_torque of {subject}") * ratio * efficiency,
        fastest=positive(motor.no_load_speed, "rad/s", f"no_load_speed of {subject}") / ratio,
        constant=None if constant is None else constant * ratio * efficiency,
        resistance=optional_positive(motor.resistance, "ohm", f"resistance of {subject}"),
    )


def _limit(joint: JointSheet, subject: str) -> JointLimit | None:
    if joint.lower is None and joint.upper is None:
        if joint.stop is not None:
            raise InputRefused(f"{subject} has a stop but no limits; give `lower` and `upper`")
        return None
    if joint.lower is None or joint.upper is None:
        raise InputRefused(f"{subject} has only one of `lower` and `upper`; give both")
    if joint.kind not in UNITS:
        raise InputRefused(f"{subject} is {joint.kind} and has limits; only hinges and prismatic joints can")
    unit = UNITS[joint.kind]
    low, high = (to_si(v, unit.position, f"limit of {subject}") for v in (joint.lower, joint.upper))
    if low >= high:
        raise InputRefused(f"{subject} has the lower limit {low:g} and the upper limit {high:g}; lower must be below upper")
    if joint.stop is None:
        return JointLimit(lower=low, upper=high)
    stiffness = positive(joint.stop.stiffness, unit.stiffness, f"stiffness of the stop of {subject}")
    damping = not_negative(joint.stop.damping, unit.damping, f"damping of the stop of {subject}")
    return JointLimit(lower=low, upper=high, stiffness=stiffness, damping=damping)
