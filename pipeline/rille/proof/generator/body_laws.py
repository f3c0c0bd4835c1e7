"""Laws of bodies. Equations and sources: the catalogue (``rille effects show NAME``)."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from rille.model import Effect, InputRefused
from rille.proof.generator.law import Array, Law
from rille.proof.generator.moment import Moment
from rille.proof.subject import Subject

NONE = np.empty(0)


class LinearDrag(Law):
    """F = -coefficient v at the centre of mass."""

    def act(self, moment: Moment, state: Array) -> Array:
        velocity, _ = moment.motion(self.target)
        moment.add_force(self.target, -self.numbers["coefficient"] * velocity)
        return NONE


class QuadraticDrag(Law):
    """F = -coefficient |v| v at the centre of mass."""

    def act(self, moment: Moment, state: Array) -> Array:
        velocity, _ = moment.motion(self.target)
        moment.add_force(self.target, -self.numbers["coefficient"] * np.linalg.norm(velocity) * velocity)
        return NONE


class TetherPull(Law):
    """T = stiffness max(0, |x - anchor| - length), from the centre of mass to the anchor."""

    def act(self, moment: Moment, state: Array) -> Array:
        n = self.numbers
        reach = np.array([n["anchor_x"], n["anchor_y"], n["anchor_z"]]) - moment.centre(self.target)
        distance = float(np.linalg.norm(reach))
        if distance > n["length"]:
            moment.add_force(self.target, n["stiffness"] * (distance - n["length"]) / distance * reach)
        return NONE


class ExternalPulse(Law):
    """A force and a torque in W from start for duration, at the centre of mass."""

    def act(self, moment: Moment, state: Array) -> Array:
        begin, end = self.switches()
        if begin <= moment.time < end:
            force, torque = (np.array([self.numbers.get(f"{word}_{axis}", 0.0) for axis in "xyz"]) for word in ("force", "torque"))
            moment.add_force(self.target, force, torque)
        return NONE

    def switches(self) -> tuple[float, ...]:
        return self.numbers["start"], self.numbers["start"] + self.numbers["duration"]


class PayloadSlosh(Law):
    """m x'' = m g - m w^2 (x - x_body) - 2 zeta m w (x' - x'_body); the body, lighter by m, feels the opposite at its centre of mass.

    States : offset x - x_body (3,) [m] and velocity x' (3,) [m/s]; hangs at rest in the body at first.
    """

    states = 6

    def __init__(self, target: str, numbers: Mapping[str, float], gravity: Array) -> None:
        super().__init__(target, numbers)
        self._gravity = gravity

    def start(self, moment: Moment) -> Array:
        velocity, _ = moment.motion(self.target)
        return np.concatenate([self._gravity / self.numbers["natural_frequency"] ** 2, velocity])

    def act(self, moment: Moment, state: Array) -> Array:
        mass, pace, share = (self.numbers[name] for name in ("mass", "natural_frequency", "damping_ratio"))
        velocity, _ = moment.motion(self.target)
        relative = state[3:] - velocity
        pull = mass * pace**2 * state[:3] + 2 * share * mass * pace * relative
        moment.add_force(self.target, pull)
        return np.concatenate([relative, self._gravity - pull / mass])


BODY_LAWS: Mapping[str, type[Law]] = {
    "linear_drag": LinearDrag,
    "quadratic_drag": QuadraticDrag,
    "tether_pull": TetherPull,
    "external_pulse": ExternalPulse,
}


def with_other_bodies(machine: Subject, laws: Sequence[Effect]) -> Subject:
    """The machine with masses, centres of mass and gravity as laws change them: mass_change, com_offset, payload_slosh, gravity_tilt."""
    bodies = list(machine.rover.bodies)
    gravity = np.array(machine.gravity)
    for law in laws:
        n: Mapping[str, Any] = law.parameters
        for k, body in enumerate(bodies):
            p = body.properties
            if law.target not in ("*", body.name):
                continue
            if law.kind in ("mass_change", "payload_slosh"):
                mass = p.mass + (n["mass"] if law.kind == "mass_change" else -n["mass"])
                if not mass > 0:
                    raise InputRefused(f"{law.kind} of {n['mass']:.3g} kg leaves body '{body.name}' of {p.mass:.3g} kg without mass")
                bodies[k] = replace(body, properties=replace(p, mass=mass, inertia=mass / p.mass * p.inertia))
            elif law.kind == "com_offset":
                offset = np.array([n.get(axis, 0.0) for axis in "xyz"])
                bodies[k] = replace(body, properties=replace(p, com=p.com + offset))
        if law.kind == "gravity_tilt":
            gravity = Rotation.from_euler("xy", [n.get("roll", 0.0), n.get("pitch", 0.0)]).apply(gravity)
    return replace(machine, rover=replace(machine.rover, bodies=tuple(bodies)), gravity=tuple(gravity.tolist()))
