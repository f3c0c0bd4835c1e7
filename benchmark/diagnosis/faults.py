"""What is wrong in a trial: an effect that the model lacks, a number that it has wrong, a sensor that lies; of any size."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from instrument_sets import instruments
from subjects import Subject

from rille import store
from rille.model import Effect, EffectKind, EffectParameter, Rover, Soil
from rille.recording.instrument import Instrument, Instruments

Numbers = Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A thing that is wrong, but for its size.

    cause : effect, parameter, sensor or none. kind, target : as in the catalogue; of a parameter its name; of a sensor fault the channel.
    direction : what a size of 1 does to the numbers. fixed : the other numbers. first, most : size to begin with, and the largest.
    least : smallest size, of faults that are there or not.
    """

    cause: str
    kind: str = ""
    target: str = ""
    direction: Numbers = field(default_factory=dict)
    fixed: Numbers = field(default_factory=dict)
    first: float = 1.0
    most: float = 1.0
    least: float = 0.0

    def numbers(self, size: float) -> dict[str, float]:
        """All numbers at that size."""
        return dict(self.fixed) | {name: size * value for name, value in self.direction.items()}

    def machine(self, subject: Subject, size: float) -> Subject:
        """The machine as it really is."""
        if self.cause == "effect":
            made = Effect(kind=self.kind, target=self.target, parameters=self.numbers(size))
            return replace(subject, effects=(*subject.effects, made))
        return PARAMETERS[self.kind](subject, self.target, size) if self.cause == "parameter" else subject

    def sensors(self, made: Instruments, size: float) -> Instruments:
        """The instruments as they really are."""
        if self.cause != "sensor":
            return made
        owner = next(one for one in made.sensors if self.target in one.columns)
        if self.kind == "clock_skew":
            clock = made.clocks[owner.clock]
            return replace(made, clocks={**made.clocks, clock.name: replace(clock, skew=size * self.direction["skew"])})
        number = owner.columns.index(self.target)
        wrong = replace(_part(owner, (number,)), **_sensor_change(self.kind, size, self.direction))
        rest = tuple(k for k in range(len(owner.columns)) if k != number)
        pieces = [wrong] + ([_part(owner, rest)] if rest else [])
        sensors = tuple(piece for one in made.sensors for piece in (pieces if one is owner else [one]))
        return replace(made, sensors=sensors)


NOTHING = Fault(cause="none", most=0.0)


def _part(one: Instrument, chosen: Sequence[int]) -> Instrument:
    """An instrument of some of the components of another."""
    return replace(
        one,
        columns=tuple(one.columns[k] for k in chosen),
        components=tuple(one.components[k] for k in chosen) if one.components else (),
    )


def _sensor_change(kind: str, size: float, direction: Numbers) -> dict[str, object]:
    value = size * next(iter(direction.values()))
    return {
        "bias": {"bias": value},
        "scale": {"scale": 1.0 + value},
        "delay": {"delay": value},
        "drift": {"trend": value},
        "saturation": {"lower": -1.0 / value, "upper": 1.0 / value} if value else {},
        "wrong_sign": {"scale": -1.0},
    }[kind]


# --- effects

SHAPES = ("stiffness", "damping", "rotor_inertia", "damping_ratio", "seed", "reference_speed", "reference_width")  # stay as they are
KIND_TARGETS = {"wheel": "wheel", "body": "body", "world": "world", "terrain": "terrain"}
# Where the usual values of the catalogue do not fit the machines here: kind -> parameter -> value.
OWN = {
    "backlash": {"stiffness": 2000.0, "damping": 1.0, "rotor_inertia": 1e-4},
    "joint_elasticity": {"damping": 0.05, "rotor_inertia": 1e-4},
}


def effect_targets(subject: Subject, kind: EffectKind) -> tuple[str, ...]:
    """Names of what an effect can be put at on a machine; () if it makes no sense there."""
    if kind.target in ("sensor", "any") or (kind.name == "soil_change" and subject.kind == "points"):
        return ()
    have = {(e.kind, e.target) for e in subject.effects}  # more of what is known is a wrong number
    word = ("driven" if kind.needs == "drive" else "joint") if kind.target == "joint" else KIND_TARGETS[kind.target]
    return tuple(t for t in subject.targets.get(word, ()) if (kind.name, t) not in have)


def effect_fault(subject: Subject, kind: EffectKind, target: str, rng: np.random.Generator) -> Fault:
    """One effect with shape numbers drawn about their usual values; where places and times matter, where and when the machine is."""
    amplitudes = [p for p in kind.parameters if p.amplitude]
    direction = {p.name: _drawn_amplitude(p, rng) for p in amplitudes}
    fixed = {p.name: _drawn_shape(kind, p, rng) for p in kind.parameters if not p.amplitude}
    fixed |= {name: value for name, value in _situated(subject, kind, rng).items() if name in fixed}
    if kind.name == "external_pulse":  # a push: a force, seldom a moment too
        direction = {name: value if name.startswith("force") else 0.0 for name, value in direction.items()}
    if kind.name == "rate_dependence":
        fixed["reference_speed"] = 0.1
    most = min(
        ((p.upper if direction[p.name] > 0 else -p.lower) / abs(direction[p.name]) for p in amplitudes if direction[p.name]), default=1.0
    )
    return Fault(
        cause="effect", kind=kind.name, target=target, direction=direction, fixed=fixed, first=min(0.3, 0.3 * most), most=0.95 * most
    )


def _drawn_amplitude(p: EffectParameter, rng: np.random.Generator) -> float:
    usual = abs(p.typical) or p.spread
    signed = p.lower < 0
    return float(usual * (rng.choice([-1.0, 1.0]) if signed else 1.0) * rng.uniform(0.5, 1.5))


def _drawn_shape(kind: EffectKind, p: EffectParameter, rng: np.random.Generator) -> float:
    own = OWN.get(kind.name, {})
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


def _situated(subject: Subject, kind: EffectKind, rng: np.random.Generator) -> dict[str, float]:
    """Times within the recording, places near the machine."""
    pulse = {"start": float(rng.uniform(0.2, 0.8) * subject.duration), "duration": float(rng.uniform(0.1, 0.4))}
    if kind.name == "soil_change":
        return {"center_x": float(rng.uniform(-3, 1)), "center_y": float(rng.uniform(-2, 2)), "radius": float(rng.uniform(1.5, 3))}
    if kind.name == "tether_pull":
        reach = {"pendulum": 0.25, "arm": 0.35, "free_body": 3.0, "rover": 1.0}.get(subject.name, 1.0)
        away = 1.2 if subject.name != "rover" else 6.0
        place = {"anchor_x": -away, "anchor_y": 0.2, "anchor_z": 0.3}
        return place | {"length": float(away + reach * rng.uniform(-0.3, 0.3))}
    return pulse


# --- parameters


def _rover_with(subject: Subject, rover: Rover) -> Subject:
    return replace(subject, rover=rover)


def _mass(subject: Subject, target: str, size: float) -> Subject:
    bodies = []
    for body in subject.rover.bodies:
        if body.name == target:
            p = body.properties
            body = replace(body, properties=replace(p, mass=p.mass * (1 + size), inertia=p.inertia * (1 + size)))
        bodies.append(body)
    return _rover_with(subject, replace(subject.rover, bodies=tuple(bodies)))


def _gravity(subject: Subject, target: str, size: float) -> Subject:
    x, y, z = subject.gravity
    return replace(subject, gravity=(x * (1 + size), y * (1 + size), z * (1 + size)))


def _drive_number(name: str) -> Callable[[Subject, str, float], Subject]:
    def change(subject: Subject, target: str, size: float) -> Subject:
        drives = tuple(
            replace(drive, **{name: getattr(drive, name) * (1 + size)}) if drive.name == target else drive for drive in subject.rover.drives
        )
        return _rover_with(subject, replace(subject.rover, drives=drives))

    return change


def _soil_number(name: str) -> Callable[[Subject, str, float], Subject]:
    def change(subject: Subject, target: str, size: float) -> Subject:
        assert subject.terrain is not None
        soils: list[Soil] = []
        for soil in subject.terrain.soils:
            value = getattr(soil, name)
            new = float(np.arctan(np.tan(value) * (1 + size))) if name == "friction_angle" else value * (1 + size)
            soils.append(replace(soil, **{name: new}))
        return replace(subject, terrain=replace(subject.terrain, soils=tuple(soils)))

    return change


def _wheel_radius(subject: Subject, target: str, size: float) -> Subject:
    wheels = tuple(replace(w, radius=w.radius * (1 + size)) if target in ("*", w.name) else w for w in subject.rover.wheels)
    return _rover_with(subject, replace(subject.rover, wheels=wheels))


def _known_friction(subject: Subject, target: str, size: float) -> Subject:
    effects = tuple(
        replace(e, parameters={name: float(value) * (1 + size) for name, value in e.parameters.items()}) if e.target == target else e  # type: ignore[arg-type]
        for e in subject.effects
    )
    return replace(subject, effects=effects)


PARAMETERS: dict[str, Callable[[Subject, str, float], Subject]] = {
    "mass": _mass,
    "gravity": _gravity,
    "speed_gain": _drive_number("speed_gain"),
    "position_gain": _drive_number("position_gain"),
    "cohesion": _soil_number("cohesion"),
    "friction_angle": _soil_number("friction_angle"),
    "frictional_modulus": _soil_number("frictional_modulus"),
    "shear_modulus": _soil_number("shear_modulus"),
    "sinkage_exponent": _soil_number("sinkage_exponent"),
    "radius": _wheel_radius,
    "viscous_friction": _known_friction,
}
WRONG_NUMBERS: dict[str, tuple[tuple[str, str], ...]] = {  # machine -> (parameter, target)
    "pendulum": (("mass", "upper"), ("mass", "lower"), ("gravity", "*")),
    "arm": (("mass", "fore"), ("mass", "upper"), ("speed_gain", "waist"), ("viscous_friction", "shoulder"), ("viscous_friction", "elbow")),
    "free_body": (("mass", "flywheel"), ("gravity", "*")),
    "rover": (("cohesion", SOIL_NAME := "regolith"), ("friction_angle", SOIL_NAME), ("frictional_modulus", SOIL_NAME)),
    "bench": (
        ("frictional_modulus", SOIL_NAME),
        ("friction_angle", SOIL_NAME),
        ("shear_modulus", SOIL_NAME),
        ("sinkage_exponent", SOIL_NAME),
    ),
}
WRONG_NUMBERS["rover"] += (("speed_gain", "wheel_middle_left"), ("position_gain", "steering_front_left"), ("mass", "chassis"))


def parameter_fault(subject: Subject, kind: str, target: str, rng: np.random.Generator) -> Fault:
    """A number of the model that is really larger or smaller."""
    sign = float(rng.choice([-1.0, 1.0]))
    return Fault(cause="parameter", kind=kind, target=target, direction={kind: sign}, first=0.05, most=0.8 if sign < 0 else 4.0)


# --- sensors

SENSOR_FAULTS = ("bias", "scale", "delay", "drift", "clock_skew", "saturation", "wrong_sign")
UNITS = {"joint.position": 0.01, "joint.velocity": 0.1, "joint.effort": 0.1, "part.position": 0.01, "part.orientation": 0.01}


def sensor_targets(subject: Subject) -> tuple[str, ...]:
    """Names of the channels of a machine."""
    made, _, _ = instruments(subject, np.random.default_rng(0))
    return tuple(column for sensor in made.sensors for column in sensor.columns)


def sensor_fault(subject: Subject, kind: str, target: str, rng: np.random.Generator) -> Fault:
    """A channel that lies. Sizes in what is usual for its quantity."""
    made, _, _ = instruments(subject, np.random.default_rng(0))
    quantity = next(one.quantity for one in made.sensors if target in one.columns)
    sign = float(rng.choice([-1.0, 1.0]))
    unit = UNITS.get(quantity, 0.02)
    name, value, most = {
        "bias": ("offset", sign * unit, 1e4),
        "scale": ("relative_error", sign * 0.05, 15.0),
        "delay": ("delay", 0.01, 20.0),
        "drift": ("rate", sign * 0.2 * unit, 1e4),
        "clock_skew": ("skew", sign * 0.002, 100.0),
        "saturation": ("inverse_range", 0.02 / unit, 1e4),
        "wrong_sign": ("flip", 1.0, 1.0),
    }[kind]
    least = 1.0 if kind == "wrong_sign" else 0.0
    return Fault(cause="sensor", kind=kind, target=target, direction={name: value}, first=least or 0.5, most=most, least=least)


def all_effects(subject: Subject) -> list[tuple[EffectKind, str]]:
    """Every effect of the catalogue at every target of the machine."""
    return [(kind, target) for kind in store.effect_kinds() for target in effect_targets(subject, kind)]
