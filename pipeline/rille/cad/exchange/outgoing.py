"""What the writers of URDF, MJCF and SDF need to know of a mechanism, found once."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.cad.exchange.meshes import FOLDER, write_hulls, write_part_meshes
from rille.model import Body, CollisionShape, Drive, InputRefused, Joint, PartInstance, Pose, Rover, nearest_names
from rille.model.kinematics import find_joint, movable_joints, parents_first, position_sign
from rille.model.rotation import matrix_of

Array = NDArray[np.float64]
Note = Callable[[str], None]

FRICTION = {"viscous_friction": "coefficient", "coulomb_friction": "torque"}
"""Effects that every format can express, with their parameter."""


class Outgoing:
    """A mechanism on its way out. Its meshes lie in ``folder / FOLDER`` once this is made.

    tree : bodies with the joint that carries each, carriers first. held : whether the world carries the mechanism.
    visuals : mesh file of each part. hulls : mesh file of each hull, by ``id`` of the shape. drives : by joint.

    Raises
    ------
    InputRefused : for a mechanism without bodies, one that is no tree, names that do not exist.
    """

    def __init__(self, rover: Rover, folder: Path, note: Note) -> None:
        if not rover.bodies:
            raise InputRefused("the model has no bodies to export; build it with `rille cad build` first")
        self.rover = rover
        self.note = note
        self.tree: tuple[tuple[Body, Joint | None], ...] = parents_first(rover)
        self.held = any(joint.parent is None for joint in rover.joints)
        self.drives: dict[str, Drive] = {drive.joint: drive for drive in rover.drives}
        self._check_names()
        self.visuals = write_part_meshes(rover, folder / FOLDER)
        self.hulls = write_hulls(rover.collision_shapes, folder / FOLDER, note)
        self._say_what_stays()

    def instances(self, body: str | None) -> list[PartInstance]:
        """The visible part instances of a body; None: of no body."""
        return [instance for instance in self.rover.instances if instance.body == body and instance.part in self.visuals]

    def shapes(self, body: str) -> list[CollisionShape]:
        """The collision shapes of a body, without hulls that have no volume."""
        return [shape for shape in self.rover.collision_shapes if shape.body == body and (shape.kind != "hull" or id(shape) in self.hulls)]

    def friction(self, kind: str, joint: Joint) -> float:
        """Sum of the coefficients of an effect in ``FRICTION`` that act on a joint [N m s/rad, N m; N s/m, N if prismatic]."""
        if joint.kind not in ("hinge", "prismatic"):
            return 0.0
        found = [e.parameters.get(FRICTION[kind], 0.0) for e in self.rover.effects if e.kind == kind and e.target in ("*", joint.name)]
        return sum(value for value in found if isinstance(value, int | float))

    def color(self, part: str) -> str:
        """Colour ``#rrggbb`` of a part."""
        return next(p.color for p in self.rover.parts if p.name == part)

    def couplings(self) -> list[tuple[str, str, str, float]]:
        """Differentials and gears as (name, leader, follower, factor): q_follower = factor q_leader."""
        found = []
        for differential in self.rover.differentials:
            sign = position_sign(self.rover, differential)
            found.append((differential.name, differential.joint_a, differential.joint_b, -float(sign)))
        found += [(gear.name, gear.joint_a, gear.joint_b, gear.ratio) for gear in self.rover.gears]
        return found

    def leaders(self) -> dict[str, tuple[str, float]]:
        """The couplings with one leader a follower, as <mimic> needs them: follower -> (leader, factor).

        All joints that are coupled with each other follow the one of them that is named first, since many readers of <mimic> know no
        follower of a follower.

        Raises
        ------
        InputRefused : if couplings form a circle, which repeats or contradicts what the others say.
        """
        couplings = self.couplings()
        neighbours: dict[str, list[tuple[int, str, float]]] = {}
        for k, (_, leader, follower, factor) in enumerate(couplings):
            neighbours.setdefault(leader, []).append((k, follower, factor))
            neighbours.setdefault(follower, []).append((k, leader, 1 / factor))
        found: dict[str, tuple[str, float]] = {}  # of leaders, too: they follow themselves
        used: set[int] = set()
        for _, first, _, _ in couplings:
            waiting = [] if first in found else [first]
            found.setdefault(first, (first, 1.0))
            while waiting:
                at = waiting.pop(0)
                for k, other, factor in neighbours[at]:
                    if k in used:
                        continue
                    used.add(k)
                    if other in found:
                        raise InputRefused(
                            f"'{couplings[k][0]}' closes a circle of coupled joints at '{other}'; <mimic> takes one leader a joint, "
                            "leave one of the couplings out or export MJCF"
                        )
                    found[other] = found[at][0], found[at][1] * factor
                    waiting.append(other)
        return {follower: (leader, factor) for follower, (leader, factor) in found.items() if follower != leader}

    def say_renamed(self, what: str, names: Mapping[str, str]) -> None:
        """Say which names had to change, because the format has one namespace for more things or cannot hold a character."""
        changed = [f"'{old}' -> '{new}'" for old, new in names.items() if old != new]
        if changed:
            self.note(f"{what} with a name that is taken or not allowed are renamed: {', '.join(changed)}")

    def _check_names(self) -> None:
        rover = self.rover
        bodies = {body.name for body in rover.bodies}
        parts = {part.name for part in rover.parts}
        movable = {joint.name for joint in movable_joints(rover)}
        driven: set[str] = set()
        for drive in rover.drives:
            _one_freedom(rover, drive.joint, movable, f"drive '{drive.name}'")
            if drive.joint in driven:
                raise InputRefused(f"joint '{drive.joint}' has two drives, the second is '{drive.name}'; keep one of them")
            driven.add(drive.joint)
        for gear in rover.gears:
            for joint in (gear.joint_a, gear.joint_b):
                _one_freedom(rover, joint, movable, f"gear '{gear.name}'")
            if not math.isfinite(gear.ratio) or gear.ratio == 0:
                raise InputRefused(f"gear '{gear.name}' has the ratio {gear.ratio:g}; give a finite one other than 0")
        self.couplings()
        for what, name, known in (
            *((f"part instance '{i.path}'", i.body, bodies) for i in rover.instances),
            *((f"part instance '{i.path}'", i.part, parts) for i in rover.instances),
            *((f"a collision shape ({s.kind})", s.body, bodies) for s in rover.collision_shapes),
            *((f"loop closure '{c.name}'", c.body_a, bodies) for c in rover.loop_closures),
            *((f"loop closure '{c.name}'", c.body_b, bodies) for c in rover.loop_closures),
        ):
            if name is not None and name not in known:
                raise InputRefused(f"{what} names '{name}', which does not exist; {nearest_names(name, known)}")

    def _say_what_stays(self) -> None:
        """Say what no other program's format can take."""
        kinds = sorted({effect.kind for effect in self.rover.effects if effect.kind not in FRICTION})
        if kinds:
            self.note(f"effects are not exported, but for dry and viscous friction of joints: {', '.join(kinds)}")
        if self.rover.sensors:
            self.note(f"{len(self.rover.sensors)} sensors are not exported")
        if self.rover.wheels:
            self.note("wheels are exported as bodies with their collision shapes; wheel-soil contact is not part of any exported format")
        loose = sum(1 for instance in self.rover.instances if instance.body is None)
        if loose and not self.held:
            self.note(f"{loose} part instances belong to no body and are not exported")


def _one_freedom(rover: Rover, name: str, movable: set[str], subject: str) -> None:
    joint = find_joint(rover, name, subject)
    if name not in movable:
        raise InputRefused(f"{subject} acts on joint '{name}', which is {joint.kind}; use a hinge or prismatic joint")


def relative(pose: Pose, origin: Array) -> tuple[Array, Array]:
    """Position (3,) and rotation (3, 3) of a pose in M, seen from a frame parallel to M at ``origin`` (3,)."""
    return np.asarray(pose.position, dtype=float) - origin, matrix_of(pose.rotation)


def unit(axis: tuple[float, float, float]) -> Array:
    """Axis (3,) of length 1."""
    vector = np.asarray(axis, dtype=float)
    return vector / np.linalg.norm(vector)
