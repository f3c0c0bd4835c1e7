"""A run as an animated glTF for other programs: y up, one clip."""

import numpy as np
from numpy.typing import NDArray

from rille.model import Rover, Terrain, Trace
from rille.view.scene3d.glb import Glb
from rille.view.scene3d.land import add_ground
from rille.view.scene3d.machine import add_bodies
from rille.view.scene3d.scene import View

Y_UP = (np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0)  # quaternion w x y z: z of W becomes y of glTF


def animated_glb(rover: Rover, terrain: Terrain | None, view: View, trace: Trace) -> bytes:
    """Machine and ground with one animation: translation and rotation of every body at every stored time, linear in between.

    Quaternions keep to one half of the sphere, so that no program takes the long way round.
    """
    glb = Glb()
    origin = np.array(view.origin)
    nodes = add_bodies(glb, rover, origin)
    if terrain is not None:
        add_ground(glb, terrain, np.array(view.center), view.reach, origin)
    scene = glb.gltf.scenes[0]
    scene.nodes = [glb.node("W", rotation=Y_UP, children=list(scene.nodes or []))]
    moves = {nodes[body.name]: (body.position - origin, continuous(body.rotation)) for body in trace.bodies}
    glb.animate(f"run {trace.run_id}", trace.time - trace.time[0], moves)
    return glb.to_bytes()


def continuous(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions (n, 4) with signs such that neighbours are near each other."""
    dots = np.sum(rotation[1:] * rotation[:-1], axis=1)
    signs = np.concatenate([[1.0], np.cumprod(np.where(dots < 0, -1.0, 1.0))])
    return rotation * signs[:, None]
