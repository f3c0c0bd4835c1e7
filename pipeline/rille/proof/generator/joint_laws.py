"""Laws of joints. Equations and sources: the catalogue (``rille effects show NAME``)."""

from collections.abc import Mapping

import numpy as np

from rille.proof.generator.law import Array, Law, dry
from rille.proof.generator.moment import Moment

NONE = np.empty(0)


class CoulombFriction(Law):
    """tau = -torque sign(w)."""

    def act(self, moment: Moment, state: Array) -> Array:
        moment.add_effort(self.target, -self.numbers["torque"] * dry(moment.speed(self.target)))
        return NONE


class ViscousFriction(Law):
    """tau = -coefficient w."""

    def act(self, moment: Moment, state: Array) -> Array:
        moment.add_effort(self.target, -self.numbers["coefficient"] * moment.speed(self.target))
        return NONE


class StribeckFriction(Law):
    """tau = -sign(w) (coulomb_torque + stiction_excess exp(-(w/stribeck_speed)^2))."""

    def act(self, moment: Moment, state: Array) -> Array:
        n, w = self.numbers, moment.speed(self.target)
        size = n["coulomb_torque"] + n["stiction_excess"] * np.exp(-((w / n["stribeck_speed"]) ** 2))
        moment.add_effort(self.target, -size * dry(w))
        return NONE


class LoadFriction(Law):
    """tau = -coefficient |tau_drive| sign(w)."""

    def act(self, moment: Moment, state: Array) -> Array:
        size = self.numbers["coefficient"] * abs(moment.drive_effort[self.target])
        moment.add_effort(self.target, -size * dry(moment.speed(self.target)))
        return NONE


class TorqueRipple(Law):
    """tau = torque sin(cycles q + phase)."""

    def act(self, moment: Moment, state: Array) -> Array:
        n = self.numbers
        moment.add_effort(self.target, n["torque"] * np.sin(n["cycles"] * moment.position(self.target) + n["phase"]))
        return NONE


class JointPulse(Law):
    """tau += torque from start for duration."""

    def act(self, moment: Moment, state: Array) -> Array:
        begin, end = self.switches()
        if begin <= moment.time < end:
            moment.add_effort(self.target, self.numbers["torque"])
        return NONE

    def switches(self) -> tuple[float, ...]:
        return self.numbers["start"], self.numbers["start"] + self.numbers["duration"]


JOINT_LAWS: Mapping[str, type[Law]] = {
    "coulomb_friction": CoulombFriction,
    "viscous_friction": ViscousFriction,
    "stribeck_friction": StribeckFriction,
    "load_friction": LoadFriction,
    "torque_ripple": TorqueRipple,
    "joint_pulse": JointPulse,
}
