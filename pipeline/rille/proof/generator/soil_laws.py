"""Laws of the catalogue that act on wheels on soil, on all wheels (or points of a bench) at once.

Each law has up to four moments: ``before`` the stresses are integrated it changes soil or sinkage, ``after`` it changes the reaction,
``advance`` moves its memory on, ``steady`` sets its memory as after long steady rolling. Laws of steady rolling see slip and speed as the
soil met them: the mean over the last contact length L = max(sqrt(2 r z), r/20), d mean/d path = (now - mean)/L.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rille.model import Effect, InputRefused
from rille.proof.generator.wheel_soil import (
    ENTRY_ANGLE,
    EXIT_ANGLE,
    LATERAL,
    LOAD,
    PULL,
    ROLLING_TORQUE,
    SIDE,
    SINKAGE,
    SLIP,
    TORQUE,
    reactions,
)

Array = NDArray[np.float64]
ROLLING_SPEED = 5e-3  # [m/s] of the rim: a wheel that is slower does not dig on
LARGEST_THRUST_GAIN = 0.6  # [-] of grousers


@dataclass(slots=True, kw_only=True)
class Contacts:
    """Wheels on soil at an instant; every array (n,) unless said otherwise. Laws change copies of the soil's numbers here.

    place : (n, 2) [m] of the contact in W. angle : of the wheel's joint [rad]. rim : r w, travel : v along the heading [m/s].
    direction : of travel, 1 or -1. motion : (n, 4) as ``wheel_soil.reactions`` takes it; its sinkage is what the stresses see.
    rut_depth : [m] that earlier wheels left where this one enters. one_zone : 1 for the law ``bekker``. reece : 1 where the pressure law
    is Reece's. The rest is as in ``Soil``; stiffness and shear_gain : factors of pressure and shear strength [-].
    """

    radius: Array
    width: Array
    grouser_count: Array
    grouser_height: Array
    sinkage_exponent: Array
    cohesive_modulus: Array
    frictional_modulus: Array
    cohesion: Array
    friction_angle: Array
    shear_modulus: Array
    lateral_shear_modulus: Array
    peak_angle_offset: Array
    peak_angle_slip: Array
    exit_sinkage_ratio: Array
    damping: Array
    unit_weight: Array
    reece_cohesive_modulus: Array
    reece_frictional_modulus: Array
    one_zone: Array
    reece: Array
    place: Array
    angle: Array
    rim: Array
    travel: Array
    direction: Array
    motion: Array
    rut_depth: Array
    stiffness: Array = field(init=False)
    shear_gain: Array = field(init=False)
    packed_depth: Array = field(init=False)
    packed_stiffness: Array = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.radius)
        self.stiffness, self.shear_gain, self.packed_depth, self.packed_stiffness = np.ones(n), np.ones(n), np.zeros(n), np.zeros(n)

    def table(self) -> Array:
        """Rows for ``wheel_soil.reactions``, (n, 14). Moduli of Reece that are not given (NaN) are Bekker's, read at the wheel's width."""
        width, exponent = self.width, self.sinkage_exponent
        modulus = self.cohesive_modulus / width + self.frictional_modulus
        if self.reece.any():
            cohesive = self.cohesion * self.reece_cohesive_modulus * width**-exponent
            frictional = self.unit_weight * self.reece_frictional_modulus * width ** (1 - exponent)
            cohesive = np.where(np.isnan(cohesive), self.cohesive_modulus / width, cohesive)
            frictional = np.where(np.isnan(frictional), self.frictional_modulus, frictional)
            modulus = np.where(self.reece > 0, cohesive + frictional, modulus)
        columns = (
            self.radius,
            width,
            modulus * self.stiffness,
            exponent,
            self.cohesion * self.shear_gain,
            np.tan(self.friction_angle) * self.shear_gain,
            self.shear_modulus,
            self.lateral_shear_modulus,
            self.peak_angle_offset,
            self.peak_angle_slip,
            self.exit_sinkage_ratio,
            self.packed_depth,
            self.packed_stiffness,
            self.one_zone,
        )
        return np.array(columns).T.copy()


@dataclass(slots=True, kw_only=True)
class Reaction:
    """What the soil does. table : (n, 8) as of ``wheel_soil.reactions``. scrub : (n,) [N m] largest torque about the ground's normal."""

    table: Array
    scrub: Array


def contact_length(contacts: Contacts, table: Array) -> Array:
    """Chord of the contact (n,) [m]."""
    return contacts.radius * (np.sin(table[:, ENTRY_ANGLE]) - np.sin(table[:, EXIT_ANGLE]))


class SoilLaw:
    """A law that does nothing. state : (n,) what it remembers, or (0,)."""

    reads_ruts = False
    state: Array = np.empty(0)

    def before(self, c: Contacts) -> None:
        """Changes soil or sinkage."""

    def after(self, c: Contacts, reaction: Reaction) -> None:
        """Changes the reaction."""

    def advance(self, c: Contacts, step: float) -> None:
        """Moves its memory on by ``step`` [s]."""

    def steady(self, c: Contacts) -> None:
        """Memory as after long steady rolling; what ripples is at its mean."""


def react(laws: Sequence[SoilLaw], contacts: Contacts, tolerance: float = 1e-7) -> Reaction:
    """Reaction of the soil under all laws. ``contacts`` is changed by what they do before."""
    for law in laws:
        law.before(contacts)
    reaction = Reaction(table=reactions(contacts.table(), contacts.motion, tolerance), scrub=np.zeros(len(contacts.radius)))
    for law in laws:
        law.after(contacts, reaction)
    return reaction


def _path_mean(mean: Array, now: Array, c: Contacts, step: float) -> Array:
    """Mean of a quantity over the last contact length after a step [s], implicit in its path."""
    length = np.maximum(np.sqrt(2 * c.radius * np.maximum(c.motion[:, SINKAGE], 0)), c.radius / 20)
    share = step * np.maximum(np.abs(c.rim), np.abs(c.travel)) / length
    return (mean + share * now) / (1 + share)


Numbers = Callable[[str], float]


class SlipSinkage(SoilLaw):
    """n = n_0 + slip_gain |s|. Source: Ding et al. 2015, J. Field Robotics 32, eq. 9."""

    def __init__(self, get: Numbers, on: Array) -> None:
        self.gain, self.state = get("slip_gain") * on, np.zeros(len(on))

    def before(self, c: Contacts) -> None:
        c.sinkage_exponent = c.sinkage_exponent + self.gain * self.state

    def advance(self, c: Contacts, step: float) -> None:
        self.state = _path_mean(self.state, np.abs(c.motion[:, SLIP]), c, step)

    def steady(self, c: Contacts) -> None:
        self.state = np.abs(c.motion[:, SLIP])


class SinkageTransient(SoilLaw):
    """z = z_s + z_k, dz_k/dt = (depth |s| - z_k)/time_constant while the wheel rolls. Source: Yoshida et al. 2003, FSR."""

    def __init__(self, get: Numbers, on: Array) -> None:
        self.depth, self.time_constant, self.state = get("depth") * on, get("time_constant"), np.zeros(len(on))

    def before(self, c: Contacts) -> None:
        c.motion[:, SINKAGE] -= self.state

    def advance(self, c: Contacts, step: float) -> None:
        share = np.where(np.abs(c.rim) > ROLLING_SPEED, step / self.time_constant, 0.0)
        self.state = (self.state + share * self.depth * np.abs(c.motion[:, SLIP])) / (1 + share)

    def steady(self, c: Contacts) -> None:
        self.state = self.depth * np.abs(c.motion[:, SLIP])


class GrouserThrust(SoilLaw):
    """Shear strength x (1 + min(efficiency N h/(2 pi r), 0.6)). Source: Iizuka et al. 2006, IROS."""

    def __init__(self, get: Numbers, on: Array) -> None:
        self.efficiency = get("efficiency") * on

    def before(self, c: Contacts) -> None:
        share = c.grouser_count * c.grouser_height / (2 * np.pi * c.radius)
        c.shear_gain = c.shear_gain * (1 + np.minimum(self.efficiency * share, LARGEST_THRUST_GAIN))


class GrouserRipple(SoilLaw):
    """Stresses x (1 + relative_amplitude sin(N theta + phase)). Source: Irani et al. 2011, J. Terramechanics 48, eqs 16-18."""

    def __init__(self, get: Numbers, on: Array) -> None:
        self.amplitude, self.phase = get("relative_amplitude") * on, get("phase")

    def after(self, c: Contacts, reaction: Reaction) -> None:
        factor = 1 + self.amplitude * np.sin(c.grouser_count * c.angle + self.phase)
        reaction.table[:, [LOAD, PULL, SIDE, TORQUE, ROLLING_TORQUE]] *= factor[:, None]
        reaction.scrub *= factor

    def steady(self, c: Contacts) -> None:
        self.amplitude = np.zeros_like(self.amplitude)


class Bulldozing(SoilLaw):
    """D -= efficiency b (gamma z^2 K_p/2 + 2 c z sqrt(K_p)), K_p = tan^2(45 deg + phi/2). Source: Rankine 1857; Wong 2008, ch. 2.5."""

    def __init__(self, get: Numbers, on: Array) -> None:
        self.efficiency = get("efficiency") * on

    def after(self, c: Contacts, reaction: Reaction) -> None:
        depth = np.maximum(c.motion[:, SINKAGE], 0.0)
        passive = (1 + np.sin(c.friction_angle)) / (1 - np.sin(c.friction_angle))
        wall = c.width * (0.5 * c.unit_weight * depth**2 * passive + 2 * c.cohesion * depth * np.sqrt(passive))
        reaction.table[:, PULL] -= self.efficiency * wall


class LateralBulldozing(SoilLaw):
    """F_y += efficiency Int R_b(h) dx (1 - exp(-j_y/k_y)), R_b = D_1 (c h + D_2 gamma h^2/2), dx = r cos theta dtheta, j_y its mean.

    h = r (cos theta - cos theta_f) > 0, D_1 = cot X + tan(X + phi), D_2 = cot X + cot^2 X tan phi, X = 45 deg - phi/2. The integral is
    taken in closed form. Source: Hegedus 1960; Ishigami et al. 2007, J. Field Robotics 24, eqs 12-15.
    """

    def __init__(self, get: Numbers, on: Array) -> None:
        self.efficiency = get("efficiency") * on

    def after(self, c: Contacts, reaction: Reaction) -> None:
        entry, leave = reaction.table[:, ENTRY_ANGLE], reaction.table[:, EXIT_ANGLE]
        wedge = 0.25 * np.pi - 0.5 * c.friction_angle
        cot = 1 / np.tan(wedge)
        d_1, d_2 = cot + np.tan(wedge + c.friction_angle), cot + cot**2 * np.tan(c.friction_angle)
        low, cosine = np.maximum(leave, -entry), np.cos(entry)

        def power(n: int, theta: Array) -> Array:
            """Antiderivative of cos^n."""
            sine = np.sin(theta)
            return (theta, sine, 0.5 * (theta + sine * np.cos(theta)), sine - sine**3 / 3)[n]

        first, second, third = (power(n, entry) - power(n, low) for n in (1, 2, 3))
        depth = second - cosine * first  # Int cos (cos - cos theta_f)
        square = third - 2 * cosine * second + cosine**2 * first
        force = c.radius**2 * d_1 * (c.cohesion * depth + 0.5 * d_2 * c.unit_weight * c.radius * square)
        drift = 0.5 * c.radius * (entry - leave) * c.motion[:, LATERAL]
        reaction.table[:, SIDE] -= self.efficiency * force * np.expm1(-drift / c.lateral_shear_modulus)


class Multipass(SoilLaw):
    """p = k_u (z - z_e) up to z_u = memory x rut depth, k_u = unload_stiffness + stiffness_growth z_u. Source: Wong 2008, ch. 2.4.2, eq.
    2.56.
    """

    reads_ruts = True

    def __init__(self, get: Numbers, on: Array) -> None:
        self.memory, self.stiffness, self.growth = get("memory") * on, get("unload_stiffness"), get("stiffness_growth")

    def before(self, c: Contacts) -> None:
        c.packed_depth = np.minimum(self.memory * c.rut_depth, 0.99 * c.radius)
        c.packed_stiffness = self.stiffness + self.growth * c.packed_depth


class ExitAngle(SoilLaw):
    """theta_r = -acos(1 - (lambda + ratio_change) z/r). Source: Ishigami et al. 2007, J. Field Robotics 24, eq. 6."""

    def __init__(self, get: Numbers, on: Array) -> None:
        self.change = get("ratio_change") * on

    def before(self, c: Contacts) -> None:
        c.exit_sinkage_ratio = np.clip(c.exit_sinkage_ratio + self.change, 0.0, 2.0)


class RateDependence(SoilLaw):
    """k x (1 + gain (|r w|/reference_speed)^exponent), at least 0.05. Source: Grahn 1991, J. Terramechanics 28, eq. 3."""

    def __init__(self, get: Numbers, on: Array) -> None:
        self.gain, self.reference, self.exponent = get("gain") * on, get("reference_speed"), get("exponent")
        self.state = np.zeros(len(on))

    def before(self, c: Contacts) -> None:
        c.stiffness = c.stiffness * np.maximum(1 + self.gain * (self.state / self.reference) ** self.exponent, 0.05)

    def advance(self, c: Contacts, step: float) -> None:
        self.state = _path_mean(self.state, np.abs(c.rim), c, step)

    def steady(self, c: Contacts) -> None:
        self.state = np.abs(c.rim)


class PlateSize(SoilLaw):
    """k x (b/reference_width)^exponent. Source: Terzaghi 1943, ch. 8; Meyerhof 1951, Geotechnique 2."""

    def __init__(self, get: Numbers, on: Array) -> None:
        self.exponent, self.reference = get("exponent") * on, get("reference_width")

    def before(self, c: Contacts) -> None:
        c.stiffness = c.stiffness * (c.width / self.reference) ** self.exponent


class SoilChange(SoilLaw):
    """Inside a circle: k x (1 + stiffness_change), c x (1 + cohesion_change), tan phi x (1 + friction_change)."""

    def __init__(self, get: Numbers, on: Array) -> None:
        self.center, self.radius = np.array([get("center_x"), get("center_y")]), get("radius")
        self.stiffness, self.cohesion, self.friction = (get(f"{name}_change") for name in ("stiffness", "cohesion", "friction"))

    def before(self, c: Contacts) -> None:
        inside = np.hypot(*(c.place - self.center).T) <= self.radius
        c.stiffness = c.stiffness * (1 + self.stiffness * inside)
        c.cohesion = c.cohesion * (1 + self.cohesion * inside)
        c.friction_angle = np.arctan((1 + self.friction * inside) * np.tan(c.friction_angle))


class RollingResistance(SoilLaw):
    """T += coefficient N r, against the turning. Source: Wong 2008, ch. 1.2."""

    def __init__(self, get: Numbers, on: Array) -> None:
        self.coefficient = get("coefficient") * on

    def after(self, c: Contacts, reaction: Reaction) -> None:
        torque = self.coefficient * np.maximum(reaction.table[:, LOAD], 0.0) * c.radius
        reaction.table[:, TORQUE] += torque
        reaction.table[:, ROLLING_TORQUE] += torque


class SkidScrub(SoilLaw):
    """M = friction N d about the ground's normal; d: mean distance of the points of the footprint from its middle.

    Of a rectangle with half sides A, B: d = sqrt(A^2 + B^2)/3 + A^2/(6B) asinh(B/A) + B^2/(6A) asinh(A/B). Source: Coulomb friction under
    uniform pressure.
    """

    def __init__(self, get: Numbers, on: Array) -> None:
        self.friction = get("friction") * on

    def after(self, c: Contacts, reaction: Reaction) -> None:
        a, b = 0.5 * np.maximum(contact_length(c, reaction.table), 1e-9), 0.5 * c.width
        distance = np.hypot(a, b) / 3 + a**2 / (6 * b) * np.arcsinh(b / a) + b**2 / (6 * a) * np.arcsinh(a / b)
        reaction.scrub += self.friction * np.maximum(reaction.table[:, LOAD], 0.0) * distance


_LAWS: Mapping[str, Callable[[Numbers, Array], SoilLaw]] = {
    "slip_sinkage": SlipSinkage,
    "sinkage_transient": SinkageTransient,
    "grouser_thrust": GrouserThrust,
    "multipass": Multipass,
    "exit_angle": ExitAngle,
    "rate_dependence": RateDependence,
    "plate_size": PlateSize,
    "soil_change": SoilChange,
    "grouser_ripple": GrouserRipple,
    "bulldozing": Bulldozing,
    "lateral_bulldozing": LateralBulldozing,
    "rolling_resistance": RollingResistance,
    "skid_scrub": SkidScrub,
}
SOIL_LAWS = frozenset(_LAWS)
AMPLITUDES = frozenset(
    ("slip_gain", "depth", "efficiency", "relative_amplitude", "memory", "ratio_change", "gain", "stiffness_change", "cohesion_change")
    + ("friction_change", "coefficient", "friction")
)


def soil_laws(effects: Sequence[Effect], wheels: Sequence[str]) -> list[SoilLaw]:
    """The laws among ``effects`` that act on wheels of these names, those of the whole stress first, each with its own memory.

    Raises
    ------
    InputRefused : if a law misses a number.
    """
    found = [effect for effect in effects if effect.kind in SOIL_LAWS]
    order = list(_LAWS)
    made = []
    for effect in sorted(found, key=lambda effect: order.index(effect.kind)):

        def get(name: str, effect: Effect = effect) -> float:
            value = effect.parameters.get(name, 0.0 if name in AMPLITUDES else None)
            if not isinstance(value, int | float):
                raise InputRefused(f"the law '{effect.kind}' on '{effect.target}' has {name} = {value}; give it a number")
            return float(value)

        on = np.array([float(effect.target in ("*", name)) for name in wheels])
        made.append(_LAWS[effect.kind](get, on))
    return made
