"""The machine at one moment: what laws read of it, and where they put their forces."""

import numpy as np
from numpy.typing import NDArray

from rille.model import Rover
from rille.proof.generator.mechanism import Mechanism

Array = NDArray[np.float64]


class Moment:
    """A state of a mechanism and the forces on it.

    time : [s]. force : (size,) reduced forces that were added so far. drive_effort : joint -> effort of its drive [N m or N].
    """

    def __init__(self, mechanism: Mechanism, rover: Rover) -> None:
        self.mechanism = mechanism
        self._centres = {body.name: body.properties.com - np.array(body.frame) for body in rover.bodies}
        self._places = {joint.name: (mechanism.joint_place(joint.name), mechanism.row(joint.name)) for joint in rover.joints}
        self.time = 0.0
        self.q = self.z = self.force = np.empty(0)
        self.drive_effort: dict[str, float] = {}

    def at(self, time: float, q: Array, z: Array) -> None:
        """Another state, without forces."""
        self.time, self.q, self.z = time, q, z
        self.mechanism.move(q, z)
        self.force = np.zeros(self.mechanism.size)
        self.drive_effort = {}

    def position(self, joint: str) -> float:
        """[rad or m]."""
        return float(self.q[self._places[joint][0]])

    def speed(self, joint: str) -> float:
        """[rad/s or m/s]."""
        return float(self._places[joint][1] @ self.z)

    def add_effort(self, joint: str, effort: float) -> None:
        """An effort in a joint [N m or N], positive along its axis."""
        self.force += effort * self._places[joint][1]

    def centre(self, body: str) -> Array:
        """Centre of mass (3,) [m] in W."""
        position, turned = self.mechanism.pose(body)
        return position + turned @ self._centres[body]

    def motion(self, body: str) -> tuple[Array, Array]:
        """Velocity of the centre of mass [m/s] and angular velocity [rad/s], (3,) each, in W."""
        linear, angular = self.mechanism.jacobian(body, self.centre(body))
        return linear @ self.z, angular @ self.z

    def add_force(self, body: str, force: Array, torque: Array | None = None) -> None:
        """A force (3,) [N] at the centre of mass and a torque (3,) [N m], both in W."""
        linear, angular = self.mechanism.jacobian(body, self.centre(body))
        self.force += linear.T @ force
        if torque is not None:
            self.force += angular.T @ torque
