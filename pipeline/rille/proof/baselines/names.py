"""Terms that a sparse regression may choose from, and what the catalogue calls each of them.

The map from a term to a name is as good as one can make it by hand: where a law of the catalogue is linear in its number, its term is that
very law; where it is not, the term is its first order in small amounts. What has no such form (elasticity, play, sloshing, soft patches,
faults of sensors over time) a regression on forces cannot name.

Features of a table over time: ``position/J``, ``velocity/J`` of joints, ``command/J``, ``command_rate/J``, ``effort/J`` of driven ones,
``position/B/x``, ``velocity/B/x`` [m, m/s], ``felt/B/x`` [m/s^2] (g - a) of centres of mass in W, ``turning/B/x`` [N m] rate of a body's
own angular momentum, ``axis/B/xx`` rotation matrices, row by row, ``swing/B/xx`` [1/s^2] their second derivatives,
``normal_load/W``, ``slip_ratio/W``, ``slip_angle/W``, ``sinkage/W`` of wheels, ``turning_rate``. Of points: ``load``, ``slip_ratio``,
``slip_angle``, and ``simulated/R`` of responses.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.proof.baselines.residuals import Input, ResidualTable

Array = NDArray[np.float64]
Forces = tuple[tuple[int, Array], ...]  # (number of the input, (W, K) force), summed
SOFT = 0.02  # of usual speeds: sign(w) is tanh(w/w0)
STICKING = 0.1  # of usual speeds, in which static friction acts
CYCLES = (2, 3, 4, 5, 6, 8, 10, 12, 16)  # per turn, of ripple
AXES = "xyz"
LEAST_GAP = 0.05  # of R above the floor: the share that is closed of less than that is chance


@dataclass(frozen=True, slots=True, kw_only=True)
class Named:
    """A name: cause (effect, parameter, sensor), kind and target, as a diagnosis gives them."""

    cause: str
    kind: str
    target: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BaselineAnswer:
    """What a baseline says of a trial.

    name : of what is concealed; None: nothing, or the baseline gives no names. number : its size [unit of the term or parameter].
    differs : whether it says that something differs. before, after : R on what was held out, G : share of the gap to the noise that is
    closed. detail : terms or numbers in words.
    """

    baseline: str
    name: Named | None
    number: float
    differs: bool
    before: float
    after: float
    gap_closed: float
    detail: str

    def as_json(self) -> dict[str, Any]:
        """Plain JSON values, as the ledger keeps them; null for what is not known, and for a G of a gap that is none."""
        numbers = {"number": self.number, "before": self.before, "after": self.after}
        numbers["gap_closed"] = self.gap_closed if self.before > 1.0 + LEAST_GAP else math.nan
        told = {name: float(value) if math.isfinite(value) else None for name, value in numbers.items()}
        return {"name": asdict(self.name) if self.name is not None else None, "differs": bool(self.differs), "detail": self.detail, **told}


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """A term of the library. words : formula. forces : what it adds, for a coefficient of 1."""

    name: Named
    words: str
    forces: Forces


def library(table: ResidualTable, usual: Mapping[str, float]) -> list[Term]:
    """All terms that mean something on this machine.

    usual : feature -> size that most of its values stay below, as of ``usual_sizes`` of the training table, so that a term is the same
    function on all recordings.
    """
    made = _Maker(table, usual)
    if table.scope.channels:
        return list(made.points())
    return [*made.joints(), *made.bodies(), *made.world(), *made.wheels()]


def usual_sizes(table: ResidualTable) -> dict[str, float]:
    """Feature -> 95 % quantile of its size."""
    return {name: float(np.quantile(np.abs(values), 0.95)) for name, values in table.features.items()}


class _Maker:
    """Makes the terms of one table."""

    def __init__(self, table: ResidualTable, usual: Mapping[str, float]) -> None:
        self._table, self._features, self._scope, self._usual = table, table.features, table.scope, usual
        self._place = {one: number for number, one in enumerate(table.inputs)}
        self._one = np.ones(table.shape)

    def joints(self) -> Iterable[Term]:
        """Friction, ripple, drives and pushes, at every joint."""
        for joint, child in self._scope.joints.items():
            at = self._place.get(Input(kind="effort", target=joint))
            q, w = self._features.get(f"position/{joint}"), self._features.get(f"velocity/{joint}")
            if at is None or q is None or w is None or self._usual[f"velocity/{joint}"] <= 0:
                continue
            usual = self._usual[f"velocity/{joint}"]
            sign = np.tanh(w / (SOFT * usual))
            for kind, words, force in (
                ("coulomb_friction", "-sign(w)", -sign),
                ("viscous_friction", "-w", -w),
                ("viscous_friction", "-w|w|", -w * np.abs(w)),
                ("stribeck_friction", "-sign(w) exp(-(w/ws)^2)", -sign * np.exp(-((w / (STICKING * usual)) ** 2))),
                ("joint_pulse", "1", self._one),
            ):
                yield self._term(kind, joint, words, ((at, force),))
            yield self._term("com_offset", child, "sin q", ((at, np.sin(q)),))
            yield self._term("com_offset", child, "cos q", ((at, np.cos(q)),))
            for k in CYCLES:
                yield self._term("torque_ripple", joint, f"sin {k}q", ((at, np.sin(k * q)),))
                yield self._term("torque_ripple", joint, f"cos {k}q", ((at, np.cos(k * q)),))
            yield from self._driven(joint, at, sign, w)

    def _driven(self, joint: str, at: int, sign: Array, w: Array) -> Iterable[Term]:
        """What drives do: a delay or lag T is to first order -T dc/dt."""
        if joint not in self._scope.drives:
            return
        effort, command = self._features[f"effort/{joint}"], self._features[f"command/{joint}"]
        yield self._term("load_friction", joint, "-|effort| sign(w)", ((at, -np.abs(effort) * sign),))
        yield self._term("motor_saturation", joint, "-effort |w|", ((at, -effort * np.abs(w)),))
        yield self._term("command_gain", joint, "command", ((at, command),))
        yield self._term("motor_lag", joint, "-d(command)/dt", ((at, -self._features[f"command_rate/{joint}"]),))
        if self._scope.drives[joint] != "torque":
            yield self._term("supply_sag", joint, "-effort", ((at, -effort),))

    def bodies(self) -> Iterable[Term]:
        """Drag, pushes, tethers, masses and centres of mass, of every body that matters."""
        for body, mass in self._scope.masses.items():
            v, felt = self._vector("velocity", body), self._vector("felt", body)
            speed = np.sqrt(sum(component**2 for component in v))
            yield self._term("linear_drag", body, "-v", self._forces(body, [-c for c in v]))
            yield self._term("quadratic_drag", body, "-|v| v", self._forces(body, [-speed * c for c in v]))
            turning = [-c for c in self._vector("turning", body)]
            own = self._forces(body, [c / mass for c in turning], "torque")  # the inertia grows with the mass
            yield self._term("mass_change", body, "g - a", (*self._forces(body, felt), *own))
            inertia = Named(cause="parameter", kind="inertia", target=body)
            yield Term(name=inertia, words=f"-dL/dt at {body}", forces=self._forces(body, turning, "torque"))
            for number, axis in enumerate(AXES):
                pushes = [self._one if other == axis else 0 * self._one for other in AXES]
                yield self._term("external_pulse", body, f"1 along {axis}", self._forces(body, pushes))
                offset = [self._features[f"axis/{body}/{row}{axis}"] for row in AXES]
                swing = [-mass * self._features[f"swing/{body}/{row}{axis}"] for row in AXES]
                moment = self._forces(body, _cross(offset, [mass * f for f in felt]), "torque")
                yield self._term("com_offset", body, f"{axis} x (g - a)", (*moment, *self._forces(body, swing)))
                if body == self._scope.root:
                    pull = [-c if k == number else 0 * c for k, c in enumerate(self._vector("position", body))]
                    yield self._term("tether_pull", body, f"-{axis}", self._forces(body, pull))

    def world(self) -> Iterable[Term]:
        """Gravity that leans or has another size, on all bodies."""
        gx, gy, gz = self._scope.gravity
        if not any(self._scope.gravity):
            return
        for words, change in (("roll", (0.0, -gz, gy)), ("pitch", (gz, 0.0, -gx)), ("size", (gx, gy, gz))):
            forces = [
                part
                for body, mass in self._scope.masses.items()
                for part in self._forces(body, [mass * component * self._one for component in change])
            ]
            name = Named(cause="parameter", kind="gravity", target="") if words == "size" else self._named("gravity_tilt", "")
            yield Term(name=name, words=f"gravity: {words}", forces=tuple(forces))

    def wheels(self) -> Iterable[Term]:
        """What soil and rolling do at wheels, to first order; of all wheels together, and of each."""
        names = [wheel for wheel in self._scope.wheels if f"normal_load/{wheel}" in self._features]
        for kind, words in (
            ("rolling_resistance", "-N r sign(w)"),
            ("skid_scrub", "-N sign(turning rate)"),
            ("slip_sinkage", "-N |s|"),
            ("bulldozing", "-z^2"),
            ("grouser_thrust", "N s"),
            ("exit_angle", "-N"),
            ("lateral_bulldozing", "-N sin(slip angle)"),
        ):
            each = [(wheel, self._wheel(kind, wheel)) for wheel in names]
            for wheel, forces in each:
                yield self._term(kind, wheel, words, forces)
            if len(names) > 1:
                yield self._term(kind, "*", words, tuple(force for _, forces in each for force in forces))

    def _wheel(self, kind: str, wheel: str) -> Forces:
        """Forces of a law at one wheel: along or across the heading of the root, or about the vertical, or at its joint."""
        joint, root = self._scope.wheels[wheel], self._scope.root
        body = self._scope.joints.get(joint, "")
        load, slip = self._features[f"normal_load/{wheel}"], self._features[f"slip_ratio/{wheel}"]
        if kind == "rolling_resistance":
            at = self._place.get(Input(kind="effort", target=joint))
            w = self._features[f"velocity/{joint}"]
            sign = np.tanh(w / max(SOFT * self._usual[f"velocity/{joint}"], 1e-12))
            return () if at is None else ((at, -load * self._scope.radii[wheel] * sign),)
        if kind == "skid_scrub":
            rate = self._features["turning_rate"]
            about = -load * np.tanh(rate / max(SOFT * self._usual["turning_rate"], 1e-12))
            return self._forces(root, [0 * about, 0 * about, about], "torque")
        along, across = ([self._features[f"axis/{root}/{row}{axis}"] for row in AXES] for axis in "xy")
        if kind == "lateral_bulldozing":
            size = -load * np.sin(self._features[f"slip_angle/{wheel}"])
            return self._forces(body, [size * c for c in across])
        size = {
            "slip_sinkage": -load * np.abs(slip),
            "bulldozing": -(self._features[f"sinkage/{wheel}"] ** 2),
            "grouser_thrust": load * slip,
            "exit_angle": -load,
        }[kind]
        return self._forces(body, [size * c for c in along])

    def points(self) -> Iterable[Term]:
        """Terms of a bench: how load, slip and sinkage enter each response."""
        load, slip, angle = (self._features[name] for name in ("load", "slip_ratio", "slip_angle"))
        sinkage = np.nan_to_num(self._features["simulated/sinkage"])
        (wheel,) = self._scope.wheels
        soil = self._scope.soil
        laws: dict[str, list[tuple[str, str, str, str, Array]]] = {
            "sinkage": [
                ("effect", "slip_sinkage", wheel, "z |s|", sinkage * np.abs(slip)),
                ("parameter", "stiffness", soil, "z", sinkage),
                ("effect", "rate_dependence", wheel, "z (1 - s)", sinkage * (1 - slip)),
                ("parameter", "sinkage_exponent", soil, "z log N", sinkage * np.log(load)),
            ],
            "drawbar_pull": [
                ("effect", "bulldozing", wheel, "-z^2", -(sinkage**2)),
                ("effect", "exit_angle", wheel, "-z", -sinkage),
                ("effect", "slip_sinkage", wheel, "-z |s|", -sinkage * np.abs(slip)),
                ("effect", "grouser_thrust", wheel, "sign(s)", np.tanh(slip / SOFT)),
                ("parameter", "shear_modulus", soil, "N s", load * slip),
                ("parameter", "friction_angle", soil, "N", load),
            ],
            "side_force": [
                ("effect", "lateral_bulldozing", wheel, "z^2 sin b", sinkage**2 * np.sin(angle)),
                ("effect", "lateral_bulldozing", wheel, "z sin b", sinkage * np.sin(angle)),
                ("parameter", "lateral_shear_modulus", soil, "N sin b", load * np.sin(angle)),
            ],
            "drive_torque": [
                ("effect", "rolling_resistance", wheel, "N", load),
                ("effect", "grouser_thrust", wheel, "sign(s)", np.tanh(slip / SOFT)),
                ("parameter", "shear_modulus", soil, "N s", load * slip),
                ("parameter", "cohesion", soil, "z", sinkage),
                ("effect", "slip_sinkage", wheel, "z |s|", sinkage * np.abs(slip)),
            ],
        }
        for response, column in self._scope.channels.items():
            at = self._place[Input(kind="response", target=response)]
            simulated = np.nan_to_num(self._features[f"simulated/{response}"])
            for cause, kind, target, words, force in (
                *laws[response],
                ("sensor", "bias", column, "1", self._one),
                ("sensor", "scale", column, "value", simulated),
            ):
                yield Term(name=Named(cause=cause, kind=kind, target=target), words=f"{words} in {response}", forces=((at, force),))

    def _term(self, kind: str, target: str, words: str, forces: Forces) -> Term:
        return Term(name=self._named(kind, target), words=f"{words} at {target}" if target else words, forces=forces)

    def _named(self, kind: str, target: str) -> Named:
        """An effect that the model has already can only have a wrong number."""
        if kind == "viscous_friction" and (kind, target) in self._scope.effects:
            return Named(cause="parameter", kind="viscous_friction.coefficient", target=target)
        return Named(cause="effect", kind=kind, target=target)

    def _vector(self, word: str, body: str) -> list[Array]:
        return [self._features[f"{word}/{body}/{axis}"] for axis in AXES]

    def _forces(self, body: str, vector: list[Array], kind: str = "force") -> Forces:
        """A vector in W on a body; what is no input of the table has no answer there."""
        found = []
        for axis, component in zip(AXES, vector, strict=True):
            number = self._place.get(Input(kind=kind, target=body, axis=axis))
            if number is not None:
                found.append((number, component))
        return tuple(found)


def _cross(a: list[Array], b: list[Array]) -> list[Array]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
