"""Laws that the catalogue of effects has no name for: what is outside of all that diagnosis knows."""

from collections.abc import Mapping
from functools import cache

import numpy as np

from rille.model import EffectKind, EffectParameter
from rille.proof.generator.law import Array, Law, dry
from rille.proof.generator.moment import Moment

NONE = np.empty(0)


class CableSpring(Law):
    """tau = -stiffness (q - rest): a cable or hose along the joint (Hooke 1678)."""

    def act(self, moment: Moment, state: Array) -> Array:
        n = self.numbers
        moment.add_effort(self.target, -n["stiffness"] * (moment.position(self.target) - n["rest"]))
        return NONE


class CubicFriction(Law):
    """tau = -coefficient |w|^2 w: friction of a shear-thickening grease (power law of Ostwald 1925)."""

    def act(self, moment: Moment, state: Array) -> Array:
        w = moment.speed(self.target)
        moment.add_effort(self.target, -self.numbers["coefficient"] * w**3)
        return NONE


class OneWayFriction(Law):
    """tau = -torque sign(w) for w > 0 only: a seal or pawl that drags one way (Armstrong-Helouvry et al. 1994, Automatica 30, sec. 2)."""

    def act(self, moment: Moment, state: Array) -> Array:
        moment.add_effort(self.target, -self.numbers["torque"] * max(dry(moment.speed(self.target)), 0.0))
        return NONE


class SectorFriction(Law):
    """tau = -torque sign(w) while |q - centre| < width: a joint that rubs in one place."""

    def act(self, moment: Moment, state: Array) -> Array:
        n = self.numbers
        off = (moment.position(self.target) - n["centre"] + np.pi) % (2 * np.pi) - np.pi
        if abs(off) < n["width"]:
            moment.add_effort(self.target, -n["torque"] * dry(moment.speed(self.target)))
        return NONE


class WearingFriction(Law):
    """tau = -torque (t / time) sign(w): friction that grows as the joint wears (Archard 1953, J. Appl. Phys. 24)."""

    def act(self, moment: Moment, state: Array) -> Array:
        n = self.numbers
        moment.add_effort(self.target, -n["torque"] * moment.time / n["time"] * dry(moment.speed(self.target)))
        return NONE


class FadingMotor(Law):
    """tau -> tau (1 - loss (1 - exp(-t/time_constant))): magnets and windings that get warm (Hanselman 2003, ch. 4)."""

    def act(self, moment: Moment, state: Array) -> Array:
        n = self.numbers
        share = n["loss"] * (1.0 - np.exp(-moment.time / n["time_constant"]))
        moment.add_effort(self.target, -share * moment.drive_effort[self.target])
        return NONE


class LoadCogging(Law):
    """tau += share tau_drive sin(cycles q + phase): ripple that grows with the load (Holtz & Springob 1996, eq. 5)."""

    def act(self, moment: Moment, state: Array) -> Array:
        n = self.numbers
        wave = np.sin(n["cycles"] * moment.position(self.target) + n["phase"])
        moment.add_effort(self.target, n["share"] * moment.drive_effort[self.target] * wave)
        return NONE


class SoftStop(Law):
    """tau = -stiffness max(0, q - from)^1.5: a rubber bump within the range (Hertz 1881)."""

    def act(self, moment: Moment, state: Array) -> Array:
        n = self.numbers
        moment.add_effort(self.target, -n["stiffness"] * max(0.0, moment.position(self.target) - n["from"]) ** 1.5)
        return NONE


class HystereticCable(Law):
    """tau = -torque s, s' = w/twist (1 - |s|^2 (1 + sign(w s))/2): a stranded cable (Bouc 1967, Wen 1976, J. Eng. Mech. 102). State : s."""

    states = 1

    def act(self, moment: Moment, state: Array) -> Array:
        n, w = self.numbers, moment.speed(self.target)
        moment.add_effort(self.target, -n["torque"] * state[0])
        return np.array([w / n["twist"] * (1.0 - state[0] ** 2 * 0.5 * (1.0 + dry(w) * np.tanh(50 * state[0])))])


class MagnusForce(Law):
    """F = coefficient w x v at the centre of mass (Magnus 1852)."""

    def act(self, moment: Moment, state: Array) -> Array:
        velocity, turning = moment.motion(self.target)
        moment.add_force(self.target, self.numbers["coefficient"] * np.cross(turning, velocity))
        return NONE


class CompassTorque(Law):
    """M = moment x_body x e_y: a magnet along the body's x in a field along y of W (Maxwell 1873, art. 386)."""

    def act(self, moment: Moment, state: Array) -> Array:
        _, turned = moment.mechanism.pose(self.target)
        moment.add_force(self.target, np.zeros(3), self.numbers["moment"] * np.cross(turned[:, 0], [0.0, 1.0, 0.0]))
        return NONE


class Gust(Law):
    """F = force sum_k sin(w_k t + p_k)/2 along a heading in the horizontal plane, four paces of 1 to 6 rad/s: a turbulent wind."""

    def __init__(self, target: str, numbers: Mapping[str, float]) -> None:
        super().__init__(target, numbers)
        rng = np.random.default_rng(int(numbers["seed"]))
        self._paces, self._phases = rng.uniform(1, 6, 4), rng.uniform(0, 2 * np.pi, 4)

    def act(self, moment: Moment, state: Array) -> Array:
        n = self.numbers
        size = 0.5 * float(np.sin(self._paces * moment.time + self._phases).sum()) * n["force"]
        moment.add_force(self.target, size * np.array([np.cos(n["heading"]), np.sin(n["heading"]), 0.0]))
        return NONE


class RootDrag(Law):
    """F = -coefficient v / sqrt|v| at the centre of mass: resistance with the root of speed, as of a skin that tears off the flow."""

    def act(self, moment: Moment, state: Array) -> Array:
        velocity, _ = moment.motion(self.target)
        moment.add_force(self.target, -self.numbers["coefficient"] * velocity / np.sqrt(np.linalg.norm(velocity) + 1e-6))
        return NONE


STRANGE_LAWS: Mapping[str, type[Law]] = {
    "cable_spring": CableSpring,
    "cubic_friction": CubicFriction,
    "one_way_friction": OneWayFriction,
    "sector_friction": SectorFriction,
    "wearing_friction": WearingFriction,
    "fading_motor": FadingMotor,
    "load_cogging": LoadCogging,
    "soft_stop": SoftStop,
    "hysteretic_cable": HystereticCable,
    "magnus_force": MagnusForce,
    "compass_torque": CompassTorque,
    "gust": Gust,
    "root_drag": RootDrag,
}
# Of each: what it acts on, what it needs, its amplitude with unit and usual size, its other numbers with usual sizes.
_NUMBERS: Mapping[str, tuple[str, str, tuple[str, str, float], Mapping[str, float]]] = {
    "cable_spring": ("joint", "", ("stiffness", "N m/rad", 0.3), {"rest": 0.4}),
    "cubic_friction": ("joint", "", ("coefficient", "N m s^3/rad^3", 0.02), {}),
    "one_way_friction": ("joint", "", ("torque", "N m", 0.1), {}),
    "sector_friction": ("joint", "", ("torque", "N m", 0.2), {"centre": 0.3, "width": 0.4}),
    "wearing_friction": ("joint", "", ("torque", "N m", 0.2), {"time": 5.0}),
    "fading_motor": ("joint", "drive", ("loss", "1", 0.2), {"time_constant": 3.0}),
    "load_cogging": ("joint", "drive", ("share", "1", 0.1), {"cycles": 6.0, "phase": 0.0}),
    "soft_stop": ("joint", "", ("stiffness", "N m/rad^1.5", 2.0), {"from": 0.3}),
    "hysteretic_cable": ("joint", "", ("torque", "N m", 0.1), {"twist": 0.2}),
    "magnus_force": ("body", "", ("coefficient", "kg", 0.05), {}),
    "compass_torque": ("body", "", ("moment", "N m", 0.05), {}),
    "gust": ("body", "", ("force", "N", 1.0), {"heading": 1.0, "seed": 7.0}),
    "root_drag": ("body", "", ("coefficient", "N (s/m)^0.5", 0.3), {}),
}


@cache
def strange_kinds() -> tuple[EffectKind, ...]:
    """The laws as the catalogue would list them, so that they are drawn like its own."""
    found = []
    for name, (target, needs, (amplitude, unit, usual), others) in _NUMBERS.items():
        numbers = [
            EffectParameter(name=amplitude, unit=unit, amplitude=True, lower=0, upper=1e4 * usual, typical=usual, spread=usual, meaning="")
        ]
        numbers += [
            EffectParameter(name=other, unit="SI", amplitude=False, lower=0, upper=1e3, typical=value, spread=value, meaning="")
            for other, value in others.items()
        ]
        law = STRANGE_LAWS[name]
        found.append(
            EffectKind(
                name=name,
                family="strange",
                target=target,
                passive=False,
                channel="",
                equation=(law.__doc__ or "").split(":")[0],
                meaning="",
                source="",
                parameters=tuple(numbers),
                needs=needs,
            )
        )
    return tuple(found)
