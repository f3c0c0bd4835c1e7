"""URDF -> Rover."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rille.cad.exchange.mesh_in import Piece, draw, find_mesh, load_mesh
from rille.cad.exchange.meshes import hull_mesh
from rille.cad.exchange.urdf_file import Geometry, Inertial, Shape, UrdfFile, UrdfJoint, read_urdf_file
from rille.cad.exchange.urdf_units import wrong_units
from rille.cad.exchange.writing import UNBOUNDED, Names
from rille.cad.geometry import compose
from rille.cad.masses import MASSLESS, check_inertia, principal_moments
from rille.model import (
    Body,
    CollisionShape,
    Drive,
    Effect,
    Gear,
    InputRefused,
    Joint,
    JointLimit,
    MassProperties,
    Mesh,
    Part,
    PartInstance,
    Rover,
)
from rille.model.rotation import pose_of

Array = NDArray[np.float64]
Note = Callable[[str], None]

KINDS: dict[str, Literal["hinge", "prismatic", "fixed"]] = {
    "revolute": "hinge",
    "continuous": "hinge",
    "prismatic": "prismatic",
    "fixed": "fixed",
}
GREY = "#9aa0a6"
WRITTEN = 1e-5
"""Relative breach of the triangle inequality that digits of a file explain; what is larger is refused."""


def read_urdf(path: Path, *, note: Note | None = None, require_meshes: bool = False) -> Rover:
    """Read a URDF and its meshes. M is the frame of its root link, with all joints at zero.

    Links become bodies with the mass properties of their <inertial> (provenance "stated"). A link without mass is part of the body that it
    is fixed to. A root without mass is the world if it is called ``world`` or if it carries its children by moving joints; a floating joint
    below it makes its child free. <mimic> becomes a gear, <dynamics> effects of viscous and dry friction, effort and velocity the bounds of
    a drive where a <transmission> or <ros2_control> says that the joint is driven. Every mesh or primitive of a <visual> becomes a part
    without mass (one prototype where it is used again), a <collision> a shape: boxes, spheres and cylinders as they are, meshes as their
    convex hull.

    Parameters
    ----------
    path : of the URDF.
    note : called with a sentence for whatever was left out or changed.
    require_meshes : refuse a mesh that is missing or damaged; else the model is read without it.

    Raises
    ------
    InputRefused : with one sentence, that names file and line, for whatever cannot be used.
    """
    tell = note or (lambda sentence: None)
    path = Path(path)
    if path.is_dir():
        raise InputRefused(f"'{path}' is a folder; name the URDF in it")
    return _Reader(read_urdf_file(path, tell), path, tell, require_meshes).rover()


class _Reader:
    """Gathers links into bodies. top : of every link, the link of its body that a joint carries. heavy : of every top, the link that
    names the body (None: the world). placed : pose (4, 4) of every link in M."""

    def __init__(self, file: UrdfFile, path: Path, note: Note, require_meshes: bool) -> None:
        self.file = file
        self.path = path
        self.note = note
        self.require_meshes = require_meshes
        self.placed = self._place()
        self.top = self._gather()
        self.heavy = self._weigh()
        self.failures: dict[str, None] = {}
        self.meshes: dict[tuple[str, tuple[float, float, float]], tuple[Piece, ...]] = {}
        self.parts: dict[tuple[Geometry, int, str], Part] = {}
        self.part_names = Names()
        self.stuck = self._stuck()

    def rover(self) -> Rover:
        bodies = tuple(self._body(top, link) for top, link in self.heavy.items() if link is not None)
        if not bodies:
            raise InputRefused(f"'{self.path}' has no link with a mass; give its links an <inertial>")
        instances = self._instances()
        for sentence in wrong_units(self.file, self._pieces):
            self.note(sentence)
        shapes = self._shapes()
        joints = self._joints()
        self._check_roots(bodies, joints)
        movable = {joint.name for joint in joints if joint.kind != "fixed"}
        moving = [joint for joint in self.file.joints if joint.name in movable]
        if self.failures:
            first = next(iter(self.failures))
            self.note(f"{len(self.failures)} meshes cannot be used, the model goes on without them: {first}")
        return Rover(
            parts=tuple(self.parts.values()),
            instances=instances,
            bodies=bodies,
            collision_shapes=shapes,
            joints=joints,
            drives=self._drives(moving),
            gears=tuple(
                Gear(name=f"{joint.name}_mimic", joint_a=joint.mimic[0], joint_b=joint.name, ratio=joint.mimic[1])
                for joint in moving
                if joint.mimic is not None and joint.mimic[0] in movable
            ),
            effects=self._frictions(moving),
        )

    def _place(self) -> dict[str, Array]:
        """Pose (4, 4) of every link in M."""
        placed: dict[str, Array] = {}
        for link in self.file.order:
            joint = self.file.carrier.get(link)
            placed[link] = np.eye(4) if joint is None else placed[joint.parent] @ joint.origin
        return placed

    def _gather(self) -> dict[str, str]:
        """The top link of every link's body: links without mass or inertia, and what they are fixed to, are one body."""
        top: dict[str, str] = {}
        solid: set[str] = set()  # tops whose body has an inertia already
        for name in self.file.order:
            link, joint = self.file.links[name], self.file.carrier.get(name)
            top[name] = name
            if joint is not None and joint.kind == "fixed":
                carrier = top[joint.parent]
                world = carrier == self.file.root and self._is_world()
                if (world and link.inertial is None) or (not world and (not link.solid or carrier not in solid)):
                    top[name] = carrier
            if link.solid:
                solid.add(top[name])
        return {name: top[name] for name in self.file.links}

    def _is_world(self) -> bool:
        root = self.file.links[self.file.root]
        return root.inertial is None and root.name.lower() == "world"

    def _weigh(self) -> dict[str, str | None]:
        """The link that gives a body (by its top link) its name and its inertia; None: it has no mass, it is the world."""
        links, root = self.file.links, self.file.root
        heavy: dict[str, str | None] = {}
        for name, top in self.top.items():
            heavy.setdefault(top, None)
            if links[name].solid:
                heavy[top] = name
        for name, top in self.top.items():
            joint = self.file.carrier.get(top)
            if heavy[top] is None and (joint is not None or links[name].inertial is not None):
                lumped = links[name].inertial is not None
                where = "" if joint is None else f", line {joint.line}"
                carried = f" on joint '{joint.name}'" if joint is not None else ""
                raise InputRefused(
                    f"'{self.path.name}'{where}: link '{name}' moves{carried} but has no {'inertia' if lumped else 'mass'}; "
                    "give it a whole <inertial>, or fix it to a link that has one"
                )
        merged = [name for name, top in self.top.items() if not links[name].solid and heavy[top] is not None]
        if merged:
            shown = ", ".join(f"'{name}'" for name in merged[:8]) + (", ..." if len(merged) > 8 else "")
            self.note(f"links without mass or inertia are part of the bodies that they are fixed to: {shown}")
        if heavy[root] is None and not self._is_world() and any(j.parent == root and j.kind != "floating" for j in self.file.joints):
            self.note(
                f"root link '{root}' has no mass, so it is taken as the world and holds the mechanism; to let it move, give it a mass"
            )
        return heavy

    def _name(self, link: str | None) -> str | None:
        """Name of the body of a link; None: the world."""
        return None if link is None else self.heavy[self.top[link]]

    def _body(self, top: str, name: str) -> Body:
        weights = [
            self._in_model(link, inertial)
            for link, owner in self.top.items()
            if owner == top and (inertial := self.file.links[link].inertial) is not None
        ]
        mass, com, inertia = weights[0] if len(weights) == 1 else compose(weights)
        properties = MassProperties(
            mass=mass,
            com=com,
            inertia=self._possible((inertia + inertia.T) / 2, name),
            mass_provenance="stated",
            inertia_provenance="stated",
        )
        x, y, z = map(float, self.placed[top][:3, 3])
        return Body(name=name, properties=properties, frame=(x, y, z))

    def _in_model(self, link: str, inertial: Inertial) -> tuple[float, Array, Array]:
        """Mass, centre and inertia of a link, in M."""
        turned, position = self.placed[link][:3, :3], self.placed[link][:3, 3]
        inertia = inertial.inertia if np.array_equal(turned, np.eye(3)) else turned @ inertial.inertia @ turned.T
        return inertial.mass, turned @ inertial.com + position, inertia

    def _possible(self, inertia: Array, link: str) -> Array:
        """The inertia, with the triangle inequality restored where only the file's digits break it."""
        subject = f"link '{link}' of '{self.path.name}'"
        moments = principal_moments(inertia, subject)
        excess = moments[2] - moments[0] - moments[1]
        if 1e-9 * moments[2] < excess <= WRITTEN * moments[2] and moments[0] > 0:
            self.note(f"inertia of {subject} breaks the triangle inequality by {excess:.2g} kg m^2; as much was added to its moments")
            inertia = inertia + excess * np.eye(3)
        check_inertia(inertia, subject)
        return inertia

    def _joints(self) -> tuple[Joint, ...]:
        joints = []
        for joint in self.file.joints:
            if self.top[joint.child] != joint.child:
                continue  # inside a body
            if joint.kind == "floating":
                if self._name(joint.parent) is not None:
                    raise InputRefused(
                        f"'{self.path.name}', line {joint.line}: joint '{joint.name}' floats on link '{joint.parent}', which has a mass; "
                        "only the root of a mechanism is free, leave the joint out"
                    )
                continue
            joints.append(self._joint(joint))
        return tuple(joints)

    def _joint(self, joint: UrdfJoint) -> Joint:
        place = self.placed[joint.child]
        x, y, z = map(float, place[:3, 3])
        a, b, c = map(float, place[:3, :3] @ joint.axis)
        kind, limit = KINDS[joint.kind], joint.limit
        if limit is not None and limit[0] == limit[1]:
            if limit[0] != 0:
                raise InputRefused(
                    f"'{self.path.name}', line {joint.line}: both limits of joint '{joint.name}' are {limit[0]:g}, away from its zero; "
                    "move its origin there and make it fixed"
                )
            self.note(f"both limits of joint '{joint.name}' are 0, so it is fixed")
            kind, limit = "fixed", None
        elif joint.name in self.stuck and joint.mimic is not None:
            self.note(f"joint '{joint.name}' mimics '{joint.mimic[0]}', which is fixed, so it is fixed, too")
            kind, limit = "fixed", None
        return Joint(
            name=joint.name,
            kind=kind,
            parent=self._name(joint.parent),
            child=self._name(joint.child) or "",
            point=(x, y, z),
            axis=(a, b, c),
            limit=None if limit is None else JointLimit(lower=limit[0], upper=limit[1]),
        )

    def _stuck(self) -> frozenset[str]:
        """Joints that cannot move: fixed, with both limits 0, or mimicking one that cannot."""
        found = {joint.name for joint in self.file.joints if joint.kind == "fixed" or joint.limit == (0.0, 0.0)}
        while more := {j.name for j in self.file.joints if j.mimic is not None and j.mimic[0] in found} - found:
            found |= more
        return frozenset(found)

    def _check_roots(self, bodies: tuple[Body, ...], joints: tuple[Joint, ...]) -> None:
        carried = {joint.child for joint in joints}
        free = [body.name for body in bodies if body.name not in carried]
        if len(free) + any(joint.parent is None for joint in joints) > 1:
            raise InputRefused(
                f"'{self.path}': {', '.join(repr(name) for name in free)} are free beside the rest; a mechanism is one tree, "
                "join its links by joints"
            )

    def _drives(self, moving: list[UrdfJoint]) -> tuple[Drive, ...]:
        drives, powerless = [], []
        for joint in moving:
            mode = self.file.modes.get(joint.name)
            if mode is None:
                continue
            if joint.effort is None or not 0 < joint.effort < float("inf"):
                powerless.append(joint.name)
                continue
            fastest = joint.velocity if joint.velocity is not None and 0 < joint.velocity < UNBOUNDED else None
            drives.append(Drive(name=joint.name, joint=joint.name, mode=mode, max_torque=joint.effort, max_speed=fastest))
        if powerless:
            self.note(f"joints {', '.join(powerless)} are driven but state no effort, so they have no drive; give them one in a sheet")
        return tuple(drives)

    def _frictions(self, moving: list[UrdfJoint]) -> tuple[Effect, ...]:
        effects = []
        for joint in moving:
            for kind, key, value in (
                ("viscous_friction", "coefficient", joint.damping),
                ("coulomb_friction", "torque", joint.friction),
            ):
                if value < 0:
                    raise InputRefused(
                        f"'{self.path.name}', line {joint.line}: {kind} of joint '{joint.name}' is {value:g}; it must not be below 0"
                    )
                if value > 0:
                    effects.append(Effect(kind=kind, target=joint.name, parameters={key: value}))
        return tuple(effects)

    def _pieces(self, geometry: Geometry) -> tuple[Piece, ...]:
        """Meshes of a shape; none where its file is missing or damaged."""
        if geometry.kind != "mesh":
            return (draw(geometry),)
        key = geometry.file, geometry.scale
        if key not in self.meshes:
            try:
                self.meshes[key] = load_mesh(find_mesh(geometry.file, self.path.parent), geometry.scale)
            except InputRefused as refusal:
                if self.require_meshes:
                    raise
                self.failures[str(refusal)] = None
                self.meshes[key] = ()
        return self.meshes[key]

    def _instances(self) -> tuple[PartInstance, ...]:
        paths = Names()
        instances = []
        for name, link in self.file.links.items():
            for shape in link.visuals:
                for index, piece in enumerate(self._pieces(shape.geometry)):
                    part = self._part(shape, index, piece)
                    path = shape.name if "/" in shape.name else f"{name}/{shape.name or part.name}"
                    pose = pose_of(self.placed[name] @ shape.origin)
                    instances.append(PartInstance(path=paths.take(path), part=part.name, pose=pose, body=self._name(name)))
        return tuple(instances)

    def _part(self, shape: Shape, index: int, piece: Piece) -> Part:
        color = shape.color or piece.color or GREY
        key = shape.geometry, index, color
        if key not in self.parts:
            stem = Path(shape.geometry.file.replace("\\", "/")).stem if shape.geometry.kind == "mesh" else shape.geometry.kind
            mesh = Mesh(vertices=piece.vertices.astype(np.float32), triangles=piece.triangles, tolerance=piece.tolerance)
            name = self.part_names.take(stem)
            self.parts[key] = Part(name=name, volume=piece.volume, properties=MASSLESS, color=color, meshes=(mesh,))
        return self.parts[key]

    def _shapes(self) -> tuple[CollisionShape, ...]:
        found, lost = [], 0
        for name, link in self.file.links.items():
            body = self._name(name)
            for shape in link.collisions:
                if body is None:
                    lost += 1
                    continue
                pose = pose_of(self.placed[name] @ shape.origin)
                if shape.geometry.kind != "mesh":
                    found.append(CollisionShape(body=body, kind=shape.geometry.kind, pose=pose, size=shape.geometry.size))
                    continue
                pieces = self._pieces(shape.geometry)
                if pieces:
                    hull = hull_mesh(np.concatenate([piece.vertices for piece in pieces]))
                    if hull is None:
                        self.note(f"the collision mesh '{shape.geometry.file}' of link '{name}' is flat and is left out")
                    else:
                        found.append(CollisionShape(body=body, kind="hull", pose=pose, vertices=hull[0]))
        if lost:
            self.note(f"{lost} collision shapes of the root link are left out: the world has its own, see `rille terrain`")
        return tuple(found)
