"""What is concealed in a trial: an effect, a wrong number, a sensor that lies, a law without a name; of any size."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from rille.model import Effect, EffectKind, EffectParameter
from rille.proof.sensors import Sensor, Sensors
from rille.proof.subject import Subject
from rille.proof.wrong_numbers import value_of, wrong_number

Cause = Literal["effect", "parameter", "sensor", "outside"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """One thing that is concealed, but for its size.

    cause : ``effect`` of the catalogue, ``parameter`` of the model, ``sensor`` fault, or a law ``outside`` the catalogue. kind, target :
    as in the catalogue; of a parameter its name and owner; of a sensor fault the channel. direction : what a size of 1 does to the
    numbers. fixed : the other numbers. first : size to begin with; most, least : bounds of the size (``least`` = ``most``: there or not).
    """

    cause: Cause
    kind: str
    target: str
    direction: Mapping[str, float]
    fixed: Mapping[str, float] = field(default_factory=dict)
    first: float = 1.0
    most: float = 1.0
    least: float = 0.0

    def numbers(self, size: float) -> dict[str, float]:
        """All numbers at that size."""
        return dict(self.fixed) | {name: size * value for name, value in self.direction.items()}

    def laws(self, size: float) -> tuple[Effect, ...]:
        """What the generator adds to the machine."""
        if self.cause not in ("effect", "outside"):
            return ()
        return (Effect(kind=self.kind, target=self.target, parameters=self.numbers(size)),)

    def machine(self, machine: Subject, size: float) -> Subject:
        """The machine as it really is."""
        if self.cause != "parameter":
            return machine
        return wrong_number(machine, self.kind, self.target, size * self.direction[self.kind])

    def reference(self, machine: Subject) -> float | None:
        """What the model says of the number that is wrong; None: it is no number."""
        return value_of(machine, self.kind, self.target) if self.cause == "parameter" else None

    def sensors(self, sensors: Sensors, size: float) -> Sensors:
        """The sensors as they really are."""
        if self.cause != "sensor":
            return sensors
        if self.kind == "clock_skew":
            clock = next(sensors.clocks[s.clock] for s in sensors.sensors if s.channel == self.target)
            skewed = replace(clock, skew=size * self.direction["skew"])
            return replace(sensors, clocks={**sensors.clocks, clock.name: skewed})
        value = size * next(iter(self.direction.values()))
        return replace(sensors, sensors=tuple(_lying(s, self.kind, value) if s.channel == self.target else s for s in sensors.sensors))


def _lying(sensor: Sensor, kind: str, value: float) -> Sensor:
    """A sensor with a fault of the catalogue of some size."""
    match kind:
        case "bias":
            return replace(sensor, bias=value)
        case "scale":
            return replace(sensor, scale=1.0 + value)
        case "delay":
            return replace(sensor, late=value)
        case "drift":
            return replace(sensor, trend=value)
        case "saturation":
            return replace(sensor, limit=1.0 / value if value else np.inf)
        case "wrong_sign":
            return replace(sensor, scale=1.0 - 2.0 * value)
    raise KeyError(kind)


# --- effects

SHAPES = ("stiffness", "damping", "rotor_inertia", "damping_ratio", "seed", "reference_speed", "reference_width")  # stay as they are
LIGHT = 0.01  # of what a joint carries: up to this the rotor behind a spring or a play is none of what is concealed
# Where the usual values of the catalogue do not fit machines of this size: kind -> parameter -> value.
OWN: Mapping[str, Mapping[str, float]] = {
    "backlash": {"stiffness": 2000.0, "damping": 1.0, "rotor_inertia": 1e-6},
    "joint_elasticity": {"rotor_inertia": 1e-6},  # light: what is concealed is the spring, not an inertia
    "rate_dependence": {"reference_speed": 0.1},
}


def effect_targets(machine: Subject, kind: EffectKind) -> tuple[str, ...]:
    """Names of what an effect can be concealed at on a machine; () if it makes no sense there."""
    if kind.target in ("sensor", "any") or (kind.name == "soil_change" and machine.kind == "points"):
        return ()
    have = {(e.kind, e.target) for e in machine.effects}  # more of what is known is a wrong number
    word = ("driven" if kind.needs == "drive" else "joint") if kind.target == "joint" else kind.target
    rotor = OWN.get(kind.name, {}).get("rotor_inertia", 0.0)
    return tuple(t for t in machine.targets.get(word, ()) if (kind.name, t) not in have and rotor <= LIGHT * _carried(machine, t))


def _carried(machine: Subject, target: str) -> float:
    """Inertia [kg m^2] of a joint's child about the joint's axis and the child's centre; inf where it has none."""
    for joint in machine.rover.joints:
        if joint.name == target:
            axis = np.asarray(joint.axis, dtype=float)
            inertia = next((b.properties.inertia for b in machine.rover.bodies if b.name == joint.child), None)
            return float(axis @ inertia @ axis) if inertia is not None else np.inf
    return np.inf


def hidden_effect(
    machine: Subject,
    kind: EffectKind,
    target: str,
    rng: np.random.Generator,
    cause: Cause = "effect",
    own: Mapping[str, Mapping[str, float]] = OWN,
) -> Hidden:
    """One effect with shape numbers drawn about their usual values; where places and times matter, where and when the machine is.

    own : effect -> number -> value, where the usual one of the catalogue does not fit.
    """
    amplitudes = [p for p in kind.parameters if p.amplitude]
    direction = {p.name: _drawn_amplitude(p, rng) for p in amplitudes}
    fixed = {p.name: _drawn_shape(p, rng, own.get(kind.name, {})) for p in kind.parameters if not p.amplitude}
    fixed |= {name: value for name, value in _situated(machine, kind, rng).items() if name in fixed}
    if kind.name == "external_pulse":  # a push: a force, seldom a moment too
        direction = {name: value if name.startswith("force") else 0.0 for name, value in direction.items()}
    if kind.name == "com_offset":
        direction = {name: 0.0 if k == _flat_axis(machine) else value for k, (name, value) in enumerate(direction.items())}
    bounds = [(p.upper if direction[p.name] > 0 else -p.lower) / abs(direction[p.name]) for p in amplitudes if direction[p.name]]
    most = min(bounds, default=1.0)
    return Hidden(
        cause=cause, kind=kind.name, target=target, direction=direction, fixed=fixed, first=min(0.3, 0.3 * most), most=0.95 * most
    )


def _flat_axis(machine: Subject) -> int | None:
    """Number of the axis across the plane in which a machine that the world holds moves: no offset along it changes anything; None."""
    axes = {tuple(np.abs(joint.axis).tolist()) for joint in machine.rover.joints}
    held = any(joint.parent is None for joint in machine.rover.joints)
    return next((k for k in range(3) if axes == {tuple(np.eye(3)[k].tolist())}), None) if held else None


def _drawn_amplitude(p: EffectParameter, rng: np.random.Generator) -> float:
    usual = abs(p.typical) or p.spread
    return float(usual * (rng.choice([-1.0, 1.0]) if p.lower < 0 else 1.0) * rng.uniform(0.5, 1.5))


def _drawn_shape(p: EffectParameter, rng: np.random.Generator, own: Mapping[str, float]) -> float:
    if p.name in own:
        return own[p.name]
    if p.name in SHAPES:
        return p.typical
    if p.name == "phase":
        return float(rng.uniform(-3.1, 3.1))
    if p.name == "cycles":
        return float(rng.integers(3, 20))
    if p.lower >= 0 and p.typical > 0:
        return float(np.clip(p.typical * np.exp(rng.uniform(-0.5, 0.5)), p.lower, p.upper))
    return p.typical


def _situated(machine: Subject, kind: EffectKind, rng: np.random.Generator) -> dict[str, float]:
    """Times within the recording, places near the machine."""
    pulse = {"start": float(rng.uniform(0.2, 0.8) * machine.duration), "duration": float(rng.uniform(0.1, 0.4))}
    if kind.name == "soil_change":
        return {"center_x": float(rng.uniform(-3, 1)), "center_y": float(rng.uniform(-2, 2)), "radius": float(rng.uniform(1.5, 3))}
    if kind.name == "tether_pull":
        reach = {"pendulum": 0.25, "arm": 0.35, "free_body": 3.0, "rover": 1.0}[machine.name]
        away = 6.0 if machine.rover.wheels else 1.2
        place = {"anchor_x": -away, "anchor_y": 0.2, "anchor_z": 0.3}
        return place | {"length": float(away + reach * rng.uniform(-0.3, 0.3))}
    return pulse


# --- sensors

SENSOR_FAULTS = ("bias", "scale", "delay", "drift", "clock_skew", "saturation", "wrong_sign")
USUAL = {"joint.position": 0.01, "joint.velocity": 0.1, "joint.effort": 0.1, "part.position": 0.01, "part.orientation": 0.01}


def hidden_sensor_fault(quantity: str, kind: str, channel: str, rng: np.random.Generator) -> Hidden:
    """A channel that lies. Sizes in what is usual for its quantity."""
    sign = float(rng.choice([-1.0, 1.0]))
    unit = USUAL.get(quantity, 0.02)
    name, value, most = {
        "bias": ("offset", sign * unit, 1e4),
        "scale": ("relative_error", sign * 0.05, 15.0),
        "delay": ("delay", 0.01, 20.0),
        "drift": ("rate", sign * 0.2 * unit, 1e4),
        "clock_skew": ("skew", sign * 0.002, 10.0),  # 2 %: no oscillator is worse
        "saturation": ("inverse_range", 0.02 / unit, 1e4),
        "wrong_sign": ("flip", 1.0, 1.0),
    }[kind]
    least = 1.0 if kind == "wrong_sign" else 0.0
    return Hidden(cause="sensor", kind=kind, target=channel, direction={name: value}, first=least or 0.5, most=most, least=least)


# --- numbers of the model

WRONG_NUMBERS: Mapping[str, tuple[tuple[str, str], ...]] = {  # machine -> (number, of what)
    "pendulum": (("mass", "upper"), ("mass", "lower"), ("gravity", "*")),
    "arm": (("mass", "fore"), ("mass", "upper"), ("speed_gain", "waist"), ("viscous_friction", "shoulder"), ("viscous_friction", "elbow")),
    "free_body": (("mass", "flywheel"), ("gravity", "*")),
    "rover": (
        ("cohesion", "regolith"),
        ("friction_angle", "regolith"),
        ("frictional_modulus", "regolith"),
        ("speed_gain", "wheel_middle_left"),
        ("position_gain", "steering_front_left"),
        ("mass", "chassis"),
    ),
    "bench": tuple((number, "regolith") for number in ("frictional_modulus", "friction_angle", "shear_modulus", "sinkage_exponent")),
}


FARTHEST_OFF = {"gravity": 0.1}  # relative; another planet is no wrong number


def hidden_number(kind: str, target: str, rng: np.random.Generator) -> Hidden:
    """A number of the model that is really larger or smaller, in proportion; as far off as one may be without being noticed at a glance."""
    sign = float(rng.choice([-1.0, 1.0]))
    most = FARTHEST_OFF.get(kind, 0.5 if sign < 0 else 1.0)
    return Hidden(cause="parameter", kind=kind, target=target, direction={kind: sign}, first=0.05, most=most)


def same_thing(one: Hidden, other: Hidden) -> bool:
    """Whether two concealed things are of one kind at one target."""
    return (one.kind, one.target) == (other.kind, other.target)


def all_effects(machine: Subject, kinds: Sequence[EffectKind]) -> list[tuple[EffectKind, str]]:
    """Every effect of the catalogue at every target of the machine."""
    return [(kind, target) for kind in kinds for target in effect_targets(machine, kind)]
