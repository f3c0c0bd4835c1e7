"""Machines of boxes and cylinders whose masses, contacts and collisions have closed forms, and ways to change them."""

from dataclasses import replace

import numpy as np

from rille.model import (
    Body,
    Differential,
    Drive,
    Joint,
    JointLimit,
    MassProperties,
    Mesh,
    Part,
    PartInstance,
    Pose,
    Rover,
    Wheel,
)

FLAT = 1e-5  # tolerance [m] of meshes that are exact


def box_mesh(size):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(size) / 2
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return Mesh(vertices=corners.astype(np.float32), triangles=np.array(triangles, np.int32), tolerance=FLAT)


def cylinder_mesh(radius, width, n=96):
    """Prism of n sides around y."""
    angles = 2 * np.pi * np.arange(n) / n
    ring = np.column_stack([radius * np.cos(angles), np.zeros(n), radius * np.sin(angles)])
    half = np.array([0, width / 2, 0])
    vertices = np.concatenate([ring - half, ring + half, [-half, half]])
    k, m = np.arange(n), (np.arange(n) + 1) % n
    low, high = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    triangles = np.concatenate(
        [
            np.column_stack([k, n + k, n + m]),
            np.column_stack([k, n + m, m]),
            np.column_stack([k, m, low]),
            np.column_stack([n + m, n + k, high]),
        ]
    )
    return Mesh(
        vertices=vertices.astype(np.float32), triangles=triangles.astype(np.int32), tolerance=float(radius * (1 - np.cos(np.pi / n))) + FLAT
    )


def properties(mass, inertia, com=(0, 0, 0)):
    return MassProperties(
        mass=mass, com=np.array(com, float), inertia=np.array(inertia, float), mass_provenance="stated", inertia_provenance="geometry"
    )


def box_part(name, size, mass):
    x, y, z = size
    inertia = mass / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])
    return Part(name=name, volume=x * y * z, properties=properties(mass, inertia), meshes=(box_mesh(size),), brep_hash=f"box {size}")


def wheel_part(name, radius, width, mass):
    across, along = mass * (3 * radius**2 + width**2) / 12, mass * radius**2 / 2
    return Part(
        name=name,
        volume=float(np.pi * radius**2 * width),
        properties=properties(mass, np.diag([across, along, across])),
        meshes=(cylinder_mesh(radius, width),),
        brep_hash=f"wheel {radius} {width}",
    )


def body_of(name, placed, frame=(0, 0, 0)):
    """Body of (part, place) by the parallel-axis theorem."""
    masses = np.array([part.properties.mass for part, _ in placed])
    places = np.array([np.array(at, float) for _, at in placed])
    com = masses @ places / masses.sum()
    inertia = sum(
        part.properties.inertia + part.properties.mass * (d @ d * np.eye(3) - np.outer(d, d))
        for (part, _), d in zip(placed, places - com, strict=True)
    )
    return Body(name=name, properties=properties(float(masses.sum()), inertia, com), frame=tuple(map(float, frame)))


def assembled(layout, **more):
    """Rover of {body: [(path, part, place), ...]}; joints and the rest in ``more``. Frames lie on the carriers' points."""
    frames = {joint.child: joint.point for joint in more.get("joints", ())}
    parts = {part.name: part for pieces in layout.values() for _, part, _ in pieces}
    return Rover(
        parts=tuple(parts.values()),
        instances=tuple(
            PartInstance(path=path, part=part.name, body=body, pose=Pose(position=tuple(map(float, at))))
            for body, pieces in layout.items()
            for path, part, at in pieces
        ),
        bodies=tuple(body_of(body, [(p, at) for _, p, at in pieces], frames.get(body, (0, 0, 0))) for body, pieces in layout.items()),
        **more,
    )


def cart():
    """A chassis with a plate on it, an arm on either side (differential), a wheel on each: nothing to complain about."""
    chassis, plate = box_part("chassis", (0.6, 0.3, 0.2), 18.0), box_part("plate", (0.5, 0.2, 0.02), 5.0)
    arm, wheel = box_part("arm", (0.4, 0.02, 0.04), 0.8), wheel_part("wheel", 0.1, 0.06, 2.0)
    layout = {"chassis": [("cart/chassis", chassis, (0, 0, 0.3)), ("cart/plate", plate, (0, 0, 0.41))]}
    joints, drives, wheels = [], [], []
    limit = JointLimit(lower=-np.deg2rad(35), upper=np.deg2rad(35))
    for side, s in (("left", 1), ("right", -1)):
        layout[f"arm_{side}"] = [(f"cart/arm_{side}", arm, (0, 0.165 * s, 0.3))]
        layout[f"wheel_{side}"] = [(f"cart/wheel_{side}", wheel, (0.15, 0.215 * s, 0.3))]
        joints.append(
            Joint(
                name=f"arm_{side}",
                kind="hinge",
                parent="chassis",
                child=f"arm_{side}",
                point=(0, 0.165 * s, 0.3),
                axis=(0, 1, 0),
                limit=limit,
            )
        )
        center = (0.15, 0.215 * s, 0.3)
        joints.append(
            Joint(name=f"wheel_{side}", kind="hinge", parent=f"arm_{side}", child=f"wheel_{side}", point=center, axis=(0.0, 1.0, 0.0))
        )
        drives.append(Drive(name=f"wheel_{side}", joint=f"wheel_{side}", mode="speed", max_torque=5.0, max_speed=3.0))
        wheels.append(Wheel(name=f"wheel_{side}", joint=f"wheel_{side}", center=center, radius=0.1, width=0.06))
    return assembled(
        layout,
        joints=tuple(joints),
        drives=tuple(drives),
        wheels=tuple(wheels),
        differentials=(Differential(name="differential", carrier="chassis", joint_a="arm_left", joint_b="arm_right"),),
    )


def bar_and_post(low=-60.0, high=60.0):
    """A bar of 0.4 x 0.04 that turns about its end at the origin, and a post whose near corners are at (0.30, 0.10) and (0.34, 0.10)."""
    base, bar, post = (
        box_part("base", (0.1, 0.1, 0.02), 1.0),
        box_part("bar", (0.4, 0.04, 0.02), 1.0),
        box_part("post", (0.04, 0.04, 0.1), 1.0),
    )
    beam = box_part("beam", (0.4, 0.06, 0.01), 1.0)
    layout = {
        "base": [
            ("base", base, (0, 0, -0.03)),
            ("beam", beam, (0.15, 0.10, -0.025)),
            ("post", post, (0.32, 0.12, 0)),
        ],
        "bar": [("bar", bar, (0.2, 0, 0))],
    }
    hinge = Joint(
        name="hinge",
        kind="hinge",
        parent="base",
        child="bar",
        point=(0, 0, 0),
        axis=(0.0, 0.0, 1.0),
        limit=JointLimit(lower=np.deg2rad(low), upper=np.deg2rad(high)),
    )
    return assembled(layout, joints=(hinge,))


def with_row(rover, table, name, **changes):
    """The rover with one row of a table changed."""
    assert name in {row.name for row in getattr(rover, table)}
    return replace(rover, **{table: tuple(replace(row, **changes) if row.name == name else row for row in getattr(rover, table))})


def with_mass(rover, body, **changes):
    """The rover with other mass properties of one body."""
    old = next(b for b in rover.bodies if b.name == body).properties
    return with_row(rover, "bodies", body, properties=replace(old, **{k: np.array(v) if k != "mass" else v for k, v in changes.items()}))


def with_place(rover, path, by):
    """The rover with one instance moved."""
    return replace(
        rover,
        instances=tuple(
            replace(i, pose=replace(i.pose, position=tuple(float(v) for v in np.add(i.pose.position, by)))) if i.path == path else i
            for i in rover.instances
        ),
    )


def moved_rover(rover, rotation, shift, quaternion):
    """The whole model turned and shifted: the same machine in other axes. quaternion : (w, x, y, z) of the rotation."""

    def point(p):
        return tuple(map(float, rotation @ np.array(p) + shift))

    def axis(a):
        return tuple(map(float, rotation @ np.array(a)))

    def pose(p):
        w1, v1 = quaternion[0], np.array(quaternion[1:])
        w2, v2 = p.rotation[0], np.array(p.rotation[1:])
        q = (w1 * w2 - v1 @ v2, *(w1 * v2 + w2 * v1 + np.cross(v1, v2)))
        return Pose(position=point(p.position), rotation=tuple(map(float, q)))

    def mass(p):
        return replace(p, com=rotation @ p.com + shift, inertia=rotation @ p.inertia @ rotation.T)

    return replace(
        rover,
        instances=tuple(replace(i, pose=pose(i.pose)) for i in rover.instances),
        bodies=tuple(replace(b, properties=mass(b.properties), frame=point(b.frame)) for b in rover.bodies),
        collision_shapes=tuple(replace(s, pose=pose(s.pose)) for s in rover.collision_shapes),
        joints=tuple(replace(j, point=point(j.point), axis=axis(j.axis)) for j in rover.joints),
        loop_closures=tuple(replace(c, point=point(c.point)) for c in rover.loop_closures),
        wheels=tuple(replace(w, center=point(w.center)) for w in rover.wheels),
    )
