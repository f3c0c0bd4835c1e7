"""Mechanisms of every kind of joint and shape at random, as model values: names, frames, axes and inertias that nothing lines up with."""

import numpy as np

from rille.model import (
    Body,
    CollisionShape,
    Drive,
    Effect,
    Joint,
    JointLimit,
    MassProperties,
    Mesh,
    Part,
    PartInstance,
    Pose,
    Rover,
)

TETRAHEDRON = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], dtype=np.int32)
NOTHING = MassProperties(mass=0.0, com=np.zeros(3), inertia=np.zeros((3, 3)), mass_provenance="geometry", inertia_provenance="geometry")


def unit(rng, size=3):
    """Random unit vector."""
    vector = rng.normal(size=size)
    return tuple(float(v) for v in vector / np.linalg.norm(vector))


def pose(rng):
    """Random pose."""
    return Pose(position=tuple(map(float, rng.uniform(-1, 1, 3))), rotation=unit(rng, 4))


def inertia(rng, mass):
    """Inertia of a random box, turned at random."""
    squares = rng.uniform(0.05, 0.5, 3) ** 2
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    tensor = turn @ np.diag(squares.sum() - squares) @ turn.T * mass / 12
    return (tensor + tensor.T) / 2


def random_machine(seed, n_bodies=8, kinds=("hinge", "prismatic", "fixed", "spherical"), held=False):
    """Tree of bodies; joints hang off their frames, every third has a limit. Names are unusual and shared by bodies and joints."""
    rng = np.random.default_rng(seed)
    names = [f'body {k} <&"ü{"月" * k}>' for k in range(n_bodies)]
    bodies, joints, drives, instances, shapes, effects = [], [], [], [], [], []
    part = Part(
        name="corner/ß",
        volume=0.001,
        properties=NOTHING,
        color="#804020",
        meshes=(Mesh(vertices=TETRAHEDRON.astype(np.float32), triangles=FACES, tolerance=1e-6),),
    )
    for k, name in enumerate(names):
        mass = float(rng.uniform(0.5, 5))
        properties = MassProperties(
            mass=mass,
            com=rng.uniform(-1, 1, 3),
            inertia=inertia(rng, mass),
            mass_provenance="stated",
            inertia_provenance="stated",
        )
        bodies.append(Body(name=name, properties=properties, frame=tuple(map(float, rng.uniform(-1, 1, 3)))))
        instances.append(PartInstance(path=f"rig/{name}", part=part.name, pose=pose(rng), body=name))
        size = tuple(map(float, rng.uniform(0.1, 0.3, 3)))
        kind = ("box", "sphere", "cylinder", "hull")[k % 4]
        shapes.append(
            CollisionShape(
                body=name,
                kind=kind,
                pose=pose(rng),
                size={"box": size, "sphere": size[:1], "cylinder": size[:2], "hull": ()}[kind],
                vertices=TETRAHEDRON if kind == "hull" else None,
            )
        )
        if k == 0 and not held:
            continue
        kind = kinds[k % len(kinds)]
        limit = JointLimit(lower=-float(rng.uniform(1, 3)), upper=float(rng.uniform(1, 3))) if k % 3 == 0 else None
        joints.append(
            Joint(
                name=name,
                kind=kind,
                parent=None if k == 0 else names[int(rng.integers(k))],
                child=name,
                point=tuple(map(float, rng.uniform(-1, 1, 3))),
                axis=unit(rng),
                limit=limit if kind in ("hinge", "prismatic") else None,
            )
        )
        if kind in ("hinge", "prismatic"):
            mode = ("speed", "torque", "position")[k % 3]
            drives.append(
                Drive(name=f"drive {k}", joint=name, mode=mode, max_torque=float(rng.uniform(1, 9)), max_speed=2.5, speed_gain=3.0)
            )
            effects.append(Effect(kind="viscous_friction", target=name, parameters={"coefficient": float(rng.uniform(0, 1))}))
            effects.append(Effect(kind="coulomb_friction", target=name, parameters={"torque": float(rng.uniform(0, 1))}))
    order = rng.permutation(len(joints))  # carriers need not come first
    return Rover(
        parts=(part,),
        instances=tuple(instances),
        bodies=tuple(bodies),
        collision_shapes=tuple(shapes),
        joints=tuple(joints[i] for i in order),
        drives=tuple(drives),
        effects=tuple(effects),
    )


def composite(rover):
    """Total mass, centre of mass in M and inertia about it at the zero pose, axes of M: summed here from Huygens and Steiner."""
    mass = sum(b.properties.mass for b in rover.bodies)
    com = sum(b.properties.mass * b.properties.com for b in rover.bodies) / mass
    total = np.zeros((3, 3))
    for b in rover.bodies:
        d = b.properties.com - com
        total += b.properties.inertia + b.properties.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return mass, com, total
