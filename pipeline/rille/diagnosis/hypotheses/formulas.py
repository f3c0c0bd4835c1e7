"""Laws without a name: what a force may depend on, in dimensionless groups of the state, as formulas that the solver runs.

Each law has one number in front, the size of the force where its groups are 1. ``loses``: it only takes energy out if that number is
positive. ``stores``: a function of position alone, which gives back what it took. Others are never proposed: a passive machine has none.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, cast

from rille.diagnosis.hypotheses.natural import Natural
from rille.model.hypothesis import FreeNumber, Hypothesis, Setting
from rille.model.machine import Machine

TargetKind = Literal["joint", "body", "wheel"]
GENTLE = 0.02  # share of the usual speed over which a sign changes
TRIAL = 0.1  # share of the usual force


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """One number times one function of the state.

    parts : (output, formula) with C for the number in front, K for the place: one, or three for a vector. unit : of C. size : usual C.
    scales : constants of the formula, name -> (value, unit). pattern : how a person writes it, {k} for the place. loses : C must be
    positive. named : the catalogue has it, alone or as a part of a law.
    """

    target_kind: TargetKind
    target: str
    pattern: str
    parts: tuple[tuple[str, str], ...]
    unit: str
    size: float
    scales: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    loses: bool = True
    named: bool = False

    @property
    def words(self) -> str:
        """How a person writes it."""
        return self.pattern if self.place is None else self.pattern.format(k=f"{self.place / self.scales['a'][0]:.3g}")

    @property
    def place(self) -> float | None:
        """Position from which on it acts, a second number that is free; None if it acts everywhere."""
        return self.scales[PLACE][0] if PLACE in self.scales else None

    @property
    def numbers(self) -> int:
        """How many numbers are free."""
        return 1 if self.place is None else 2

    def at(self, place: float) -> "Law":
        """The same from another position on."""
        return replace(self, scales={**self.scales, PLACE: (float(place), self.scales[PLACE][1])})


PLACE = "K"
JOINT_LAWS = (
    ("sign(v)", "tanh(velocity/(e*w))", True),
    ("sign(v) where v > 0", "max(tanh(velocity/(e*w)),0)", True),
    ("sign(v) where v < 0", "min(tanh(velocity/(e*w)),0)", True),
    ("v", "velocity/w", True),
    ("v |v|", "velocity*abs(velocity)/w^2", True),
    ("v^2", "(velocity/w)^2", False),
    ("v^3", "(velocity/w)^3", True),
    ("sign(v) sqrt|v|", "tanh(velocity/(e*w))*sqrt(abs(velocity)/w)", True),
    ("sign(v) exp(-|v|)", "tanh(velocity/(e*w))*exp(-abs(velocity)/w)", True),
    ("v q^2", "velocity/w*(position/a)^2", True),
    ("sign(v) |q|", "tanh(velocity/(e*w))*abs(position)/a", True),
    ("sign(v) |effort|", "tanh(velocity/(e*w))*abs(drive_effort)/f", True),
    ("v |effort|", "velocity/w*abs(drive_effort)/f", True),
    ("1", "1", False),
    ("q", "position/a", False),
    ("q^3", "(position/a)^3", False),
    ("sin(q)", "sin(position/a)", False),
    ("cos(q)", "cos(position/a)", False),
    ("sin(2 q)", "sin(2*position/a)", False),
    ("cos(2 q)", "cos(2*position/a)", False),
)
NAMED: Mapping[str, tuple[str, ...]] = {
    "joint": ("sign(v)", "v", "sign(v) exp(-|v|)", "sign(v) |effort|", "v |effort|", "sin(q)", "cos(q)", "sin(2 q)", "cos(2 q)"),
    "body": ("v", "v |v|"),
}  # dry, viscous and Stribeck friction, that of gears under load, saturation of a motor, weight, ripple; drag
BEYOND = (("q - {k} where q > {k}", "max(position-K,0)/a"), ("q - {k} where q < {k}", "min(position-K,0)/a"))
PLACES = (0.2, 0.4, 0.6, 0.8)  # of the range that a joint was seen in, where a spring may begin
SPEED = "sqrt(vx^2+vy^2+vz^2)"
BODY_LAWS = (
    ("v", "v{k}/w", True),
    ("v |v|", "v{k}*S/w^2", True),
    ("v |v|^2", "v{k}*S^2/w^3", True),
    ("v / |v|", "v{k}/(S+e*w)", True),
    ("v sqrt(|v|) / |v|", "v{k}/w/sqrt(S/w+e)", True),
)
WHEEL_LAWS = (
    ("drawbar_pull", "N sign(v)", "-C*normal_load*tanh(travel_speed/(e*w))", True),
    ("drawbar_pull", "N v", "-C*normal_load*travel_speed/w", True),
    ("drawbar_pull", "N sign(v) |s|", "-C*normal_load*tanh(travel_speed/(e*w))*abs(slip_ratio)", True),
    ("drawbar_pull", "N sign(v) z/r", "-C*normal_load*tanh(travel_speed/(e*w))*sinkage/radius", True),
    ("side_force", "N sin(beta)", "C*normal_load*sin(slip_angle)", True),
    ("side_force", "N sin(beta) z/r", "C*normal_load*sin(slip_angle)*sinkage/radius", True),
    ("drive_torque", "N r", "C*normal_load*radius", True),
    ("drive_torque", "N r |s|", "C*normal_load*radius*abs(slip_ratio)", True),
    ("drive_torque", "N r z/r", "C*normal_load*sinkage", True),
    ("normal_load", "N |s|", "-C*normal_load*abs(slip_ratio)", True),
    ("normal_load", "N u", "-C*normal_load*abs(rim_speed)/w", False),
)  # side_force and drive_torque count against the motion


def laws_of(machine: Machine, scales: Natural, target_kind: TargetKind, target: str) -> tuple[Law, ...]:
    """Laws that may act on a joint, a body or a wheel; () for one that they cannot act on."""
    here = scales.at(target_kind, target)
    if target_kind == "joint":
        joint = next((j for j in machine.joints if j.name == target and j.kind in ("hinge", "prismatic")), None)
        driven = any(d.joint == target for d in machine.drives)
        return _joint_laws(target, joint.kind == "prismatic", here, driven, scales.ranges.get(target)) if joint else ()
    if target_kind == "body" and here:
        return _body_laws(target, here)
    if target_kind == "wheel" and machine.soft_ground and (target == "*" or any(w.name == target and w.soft for w in machine.wheels)):
        return _wheel_laws(target, scales)
    return ()


def _joint_laws(target: str, slides: bool, here: Mapping[str, float], driven: bool, seen: tuple[float, float] | None) -> tuple[Law, ...]:
    force, length = ("N", "m") if slides else ("N m", "rad")
    constants = {
        "w": (here["rad"] / here["s"], f"{length}/s"),
        "a": (here["rad"], length),
        "f": (here["N"], force),
        "e": (GENTLE, "1"),
    }

    def law(words: str, formula: str, loses: bool, place: float | None = None) -> Law:
        own = constants if place is None else {**constants, PLACE: (place, length)}
        return Law(
            target_kind="joint",
            target=target,
            pattern=words,
            parts=(("joint.effort", f"-C*{formula}"),),
            unit=force,
            size=here["N"],
            scales={name: own[name] for name in _names(formula, own)},
            loses=loses,
            named=words in NAMED["joint"],
        )

    places = [seen[0] + share * (seen[1] - seen[0]) for share in PLACES] if seen is not None else []
    return (
        *(law(words, formula, loses) for words, formula, loses in JOINT_LAWS if driven or "drive_effort" not in formula),
        *(law(words, formula, False, place) for words, formula in BEYOND for place in places),
    )


def _body_laws(target: str, here: Mapping[str, float]) -> tuple[Law, ...]:
    constants = {"w": (here["m"] / here["s"], "m/s"), "a": (here["m"], "m"), "e": (GENTLE, "1")}
    return tuple(
        Law(
            target_kind="body",
            target=target,
            pattern=words,
            parts=tuple((f"part.force_{k}", f"-C*{formula.replace('S', SPEED).format(k=k)}") for k in "xyz"),
            unit="N",
            size=here["N"],
            scales={name: constants[name] for name in _names(formula, constants)},
            loses=loses,
            named=words in NAMED["body"],
        )
        for words, formula, loses in BODY_LAWS
    )


def _wheel_laws(target: str, scales: Natural) -> tuple[Law, ...]:
    constants = {"w": (max(scales.speed, 1e-3), "m/s"), "e": (GENTLE, "1")}
    return tuple(
        Law(
            target_kind="wheel",
            target=target,
            pattern=words,
            parts=((f"wheel.{output}", formula),),
            unit="1",
            size=1.0,
            scales={name: constants[name] for name in _names(formula, constants)},
            loses=loses,
        )
        for output, words, formula, loses in WHEEL_LAWS
    )


def _names(formula: str, constants: Mapping[str, object]) -> list[str]:
    """Constants of one letter that a formula uses."""
    words = "".join(c if c.isalnum() or c == "_" else " " for c in formula.replace("{k}", "x")).split()
    return [name for name in constants if name in words]


def as_setting(laws: Sequence[Law], numbers: Sequence[float]) -> Setting:
    """Laws at one target with their numbers [unit], one expression for each output."""
    outputs: dict[str, list[str]] = {}
    constants: dict[str, list[object]] = {}
    for k, (law, number) in enumerate(zip(laws, numbers, strict=True), start=1):
        place = f"k{k}"  # scales are the same for all laws at a target, places are not
        constants[f"c{k}"] = [float(number), law.unit]
        constants |= {place if name == PLACE else name: [value, unit] for name, (value, unit) in law.scales.items()}
        for output, formula in law.parts:
            outputs.setdefault(output, []).append(formula.replace("C", f"c{k}").replace(PLACE, place))
    return tuple(
        Hypothesis(
            cause="effect",
            kind="expression",
            target=laws[0].target,
            target_kind=laws[0].target_kind,
            free=(FreeNumber(name="gain", unit="1", amplitude=True, lower=0.0, upper=1.0, start=1.0, spread=0.5),),
            words={
                "formula": " + ".join(f"({formula})" for formula in formulas),
                "output": output,
                "constants": {name: pair for name, pair in constants.items() if name in _names(" ".join(formulas), constants)},
                "target_kind": laws[0].target_kind,
            },
            passive=all(law.loses for law in laws),
        ).at({"gain": 1.0})
        for output, formulas in outputs.items()
    )


def sharper(setting: Setting, share: float) -> Setting:
    """Expressions whose signs change over this share of the speed that they do; themselves where none does."""
    found = []
    for term in setting:
        constants = dict(cast(Mapping[str, Any], term.hypothesis.words["constants"]))
        if "e" in constants:
            value, unit = constants["e"]
            words = {**term.hypothesis.words, "constants": {**constants, "e": [share * value, unit]}}
            term = replace(term, hypothesis=replace(term.hypothesis, words=words))
        found.append(term)
    return tuple(found)


def in_words(laws: Sequence[Law], numbers: Sequence[float]) -> str:
    """The sum as a person writes it: "- 0.031 N m (v^3) - 0.2 N m (q), v in units of 4.2 rad/s, q in units of 1 rad"."""
    terms = []
    for law, number in zip(laws, numbers, strict=True):
        value = -number if law.parts[0][1].startswith("-") else number
        unit = "" if law.unit == "1" else f" {law.unit}"
        terms.append(f"{'-' if value < 0 else '+'} {abs(value):.3g}{unit} ({law.words})")
    symbols = {"w": "speed" if laws[0].target_kind == "wheel" else "v", "a": "q", "f": "effort"}
    used = {name: pair for law in laws for name, pair in law.scales.items() if name in symbols}
    where = ", ".join(f"{symbols[name]} in units of {value:.3g} {unit}" for name, (value, unit) in used.items())
    return " ".join(terms) + (f", {where}" if where else "")
