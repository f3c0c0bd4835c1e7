"""The machine as nodes of a scene: one for every moving body, its parts below it."""

import numpy as np
import trimesh
from numpy.typing import NDArray

from rille.model import Body, CollisionShape, Pose, Rover, Wheel
from rille.view.obstacles import facets
from rille.view.scene3d.glb import Glb, rgb

Array = NDArray[np.float64]
EDGE = np.radians(30.0)  # sharper ones stay edges
GREY, TYRE = "#9aa0a6", "#5b6066"
POINT = 0.05  # [m] radius of a body that nothing is known of but its mass


def axle(rover: Rover, wheel: Wheel) -> tuple[float, float, float]:
    """Unit vector along a wheel's axle, to the left; in the frame of the body that turns, which is parallel to M at the zero pose."""
    joint = next(joint for joint in rover.joints if joint.name == wheel.joint)
    x, y, z = joint.axis
    return (x, y, z) if y >= 0 else (-x, -y, -z)


def add_bodies(glb: Glb, rover: Rover, origin: Array) -> dict[str, int]:
    """Add a node for each body, at its place in M at the zero pose less ``origin``; returns them by the body's name."""
    meshes: dict[tuple[str, int], int] = {}
    parts = {part.name: part for part in rover.parts}
    found = {}
    for body in rover.bodies:
        children = []
        for instance in rover.instances:
            if instance.body != body.name:
                continue
            part = parts[instance.part]
            for number, mesh in enumerate(part.meshes):
                if mesh.purpose != "visual":
                    continue
                if (part.name, number) not in meshes:
                    meshes[part.name, number] = smooth(glb, mesh.vertices.astype(float), mesh.triangles, part.color)
                position = np.array(instance.pose.position) - np.array(body.frame)
                children.append(glb.node(instance.path, mesh=meshes[part.name, number], position=position, rotation=instance.pose.rotation))
        children = children or stand_in(glb, rover, body)
        place = np.array(body.frame) - origin
        found[body.name] = glb.node(body.name, position=place, children=children, extras={"rille": "body", "name": body.name}, top=True)
    return found


def smooth(glb: Glb, vertices: Array, triangles: NDArray[np.int32], color: str) -> int:
    """A mesh with round faces shaded round and edges kept."""
    whole = trimesh.Trimesh(vertices, triangles, process=False)
    shaded = trimesh.graph.smooth_shade(whole, angle=EDGE)
    return glb.mesh(shaded.vertices, shaded.faces, normals=shaded.vertex_normals, material=glb.material(rgb(color)))


def stand_in(glb: Glb, rover: Rover, body: Body) -> list[int]:
    """Nodes of a body without visual meshes: its collision shapes and wheels, else a ball at its centre of mass with rods to its joints."""
    frame = np.array(body.frame)
    nodes = []
    for shape in rover.collision_shapes:
        if shape.body == body.name:
            nodes.append(_flat(glb, facets(shape) - frame, GREY))
    joints = {joint.name: joint for joint in rover.joints}
    for wheel in rover.wheels:
        if joints[wheel.joint].child == body.name:
            rim = trimesh.creation.cylinder(wheel.radius, wheel.width, sections=48)
            turn = trimesh.geometry.align_vectors([0, 0, 1], axle(rover, wheel))
            rim.apply_transform(turn)
            vertices = rim.vertices + np.array(wheel.center) - frame
            nodes.append(glb.node(wheel.name, mesh=smooth(glb, vertices, rim.faces, TYRE)))
    if not nodes:
        com = np.array(body.properties.com)
        pose = Pose(position=(float(com[0]), float(com[1]), float(com[2])))
        ball = CollisionShape(body=body.name, kind="sphere", pose=pose, size=(POINT,))
        nodes.append(_flat(glb, facets(ball) - frame, GREY))
        for joint in rover.joints:  # rods to the joints that hold it and that it holds
            arm = np.array(joint.point) - com
            if body.name in (joint.child, joint.parent) and np.linalg.norm(arm) > POINT:
                rod = trimesh.creation.cylinder(POINT / 4, segment=[com - frame, com - frame + arm], sections=16)
                nodes.append(glb.node(joint.name, mesh=smooth(glb, rod.vertices, rod.faces, TYRE)))
    return nodes


def _flat(glb: Glb, corners: Array, color: str) -> int:
    """A node of facets (m, 3, 3) whose edges all stay edges."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    triangles = np.arange(3 * len(corners)).reshape(-1, 3)
    mesh = glb.mesh(corners.reshape(-1, 3), triangles, normals=np.repeat(normals, 3, axis=0), material=glb.material(rgb(color)))
    return glb.node("shape", mesh=mesh)
