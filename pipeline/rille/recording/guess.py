"""What a column may mean, from its name: each guess with its reason. Nothing is used before a person has read it."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from rille.model.quantity import factor_of
from rille.model.recording import ANGLES, QUANTITIES
from rille.recording.names import read_name, words_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Guess:
    """quantity "" : unknown, or, of a command, what its drive takes. rest : words of the name that say neither quantity, unit nor role."""

    quantity: str = ""
    component: str = ""
    unit: str = ""
    role: str = "observed"
    frame: str = "world"
    rest: tuple[str, ...] = ()
    because: str = ""


# endings of names that say a unit, longest first
UNIT_ENDINGS = {
    **{"rad_per_s": "rad/s", "rad_s": "rad/s", "radps": "rad/s", "rads": "rad/s", "deg_per_s": "deg/s", "deg_s": "deg/s", "degps": "deg/s"},
    "dps": "deg/s",
    **{"m_per_s": "m/s", "m_s": "m/s", "mps": "m/s", "mm_s": "mm/s", "kmh": "km/h", "m_s2": "m/s^2", "mps2": "m/s^2", "rpm": "rpm"},
    **{"rad": "rad", "deg": "deg", "degree": "deg", "degrees": "deg", "m": "m", "mm": "mm", "cm": "cm", "meter": "m", "meters": "m"},
    **{"nm": "N m", "mnm": "mN m", "n_m": "N m", "n": "N", "kn": "kN", "ma": "mA", "amp": "A", "amps": "A", "mv": "mV", "volt": "V"},
    **{"a": "A", "v": "V", "pct": "percent", "percent": "percent", "g": "g_0", "s": "s", "sec": "s", "ms": "ms", "us": "us", "ns": "ns"},
}
QUANTITY_WORDS = (
    ("wheel.slip_angle", ("slip", "angle")),
    ("wheel.slip_ratio", ("slip", "ratio")),
    ("wheel.slip_ratio", ("slip",)),
    ("wheel.sinkage", ("sinkage",)),
    ("wheel.drawbar_pull", ("drawbar", "pull")),
    ("wheel.drawbar_pull", ("drawbar",)),
    ("motor.current", ("current",)),
    ("motor.current", ("cur",)),
    ("motor.voltage", ("voltage",)),
    ("motor.voltage", ("volt",)),
    ("joint.effort", ("tau",)),
    ("joint.effort", ("torque",)),
    ("joint.effort", ("effort",)),
    ("joint.velocity", ("velocity",)),
    ("joint.velocity", ("vel",)),
    ("joint.velocity", ("speed",)),
    ("joint.velocity", ("rate",)),
    ("joint.velocity", ("omega",)),
    ("joint.velocity", ("qd",)),
    ("joint.velocity", ("dq",)),
    ("joint.position", ("position",)),
    ("joint.position", ("pos",)),
    ("joint.position", ("angle",)),
    ("joint.position", ("encoder",)),
    ("joint.position", ("enc",)),
    ("joint.position", ("theta",)),
    ("joint.position", ("q",)),
)
TIME_UNITS = ("s", "ms", "us", "ns", "min")
TIME_WORDS = (
    *("time", "stamp", "timestamp", "datetime", "date", "clock", "epoch", "elapsed", "utc", "gmt", "sec", "secs", "second", "seconds"),
    *("zeit", "zeitstempel", "uhrzeit", "datum", "sekunden", "temps", "heure", "horodatage", "tiempo", "hora", "fecha"),
    *("tempo", "ora", "orario", "tijd", "tijdstip", "tid", "czas"),
)
TRIPLE_WORDS = ("rpy", "euler", "attitude", "orientation", "tilt", "angles")  # of a vector that is roll, pitch, yaw
COMMAND_WORDS = ("cmd", "command", "commanded", "con", "control", "setpoint", "ref")
OTHER_WORDS = ("fric", "friction", "pert", "std", "var", "cov", "err", "error", "raw", "count", "status", "min", "max", "limit", "quality")
WISH_WORDS = ("des", "desired", "goal", "plan", "planned")
SMALL = re.compile(r"^(v|w|a|q|p)([xyzw])$")  # vx, wz, ax, qw, px
SMALL_QUANTITY = {
    "v": "part.linear_velocity",
    "w": "part.angular_velocity",
    "a": "part.linear_acceleration",
    "q": "part.orientation",
    "p": "part.position",
}
AXIS_WORDS = {
    **dict.fromkeys(("gyro", "omega", "angular", "rate", "angvel"), "part.angular_velocity"),
    **dict.fromkeys(("acc", "accel", "acceleration"), "part.linear_acceleration"),
    **dict.fromkeys(("vel", "velocity", "speed", "linear"), "part.linear_velocity"),
    **dict.fromkeys(("quat", "quaternion", "orientation"), "part.orientation"),
    **dict.fromkeys(("pos", "position", "point", "pose", "icp", "gps", "odom", "mocap", "vicon", "slam"), "part.position"),
}
BODY = ("part.angular_velocity", "part.linear_acceleration")  # an IMU tells these in its own axes
SI = {
    **{"joint.position": "rad", "joint.velocity": "rad/s", "joint.effort": "N m", "motor.current": "A", "motor.voltage": "V"},
    **{"part.position": "m", "part.linear_velocity": "m/s", "part.angular_velocity": "rad/s", "part.linear_acceleration": "m/s^2"},
    **{"wheel.slip_ratio": "1", "wheel.slip_angle": "rad", "wheel.sinkage": "m", "wheel.drawbar_pull": "N"},
}


def split_unit(name: str) -> tuple[str, str, str]:
    """Name without its unit, the unit, and the ending that says it: "yaw_deg" -> ("yaw", "deg", "_deg"), "v [m/s]" -> ("v", "m/s", ...)."""
    bracket = re.fullmatch(r"(.*?)\s*[\[(]([^\])]+)[\])]\s*", name)
    if bracket:
        unit = bracket[2].strip()
        return bracket[1], UNIT_ENDINGS.get(unit.lower(), unit), f"[{unit}]"
    lowered = name.lower()
    for ending in sorted(UNIT_ENDINGS, key=len, reverse=True):
        if lowered.endswith("_" + ending) and len(lowered) > len(ending) + 1:
            return name[: -len(ending) - 1], UNIT_ENDINGS[ending], name[-len(ending) - 1 :]
    return name, "", ""


def guess_column(name: str) -> Guess:
    """What a column of a table may be."""
    bare, unit, ending = split_unit(name)
    words = words_of(bare)
    role, why_role = "observed", ""
    for word in words:
        if word in COMMAND_WORDS:
            role, why_role = "command", f", '{word}' says a command"
        elif word in WISH_WORDS:
            return Guess(because=f"'{word}' says what was wished, neither measured nor sent to a drive")
        elif word in OTHER_WORDS:
            return Guess(because=f"'{word}' says that it is not the quantity itself")
    words = [word for word in words if word not in (*COMMAND_WORDS, "meas", "measured", "act", "actual")]
    quantity, component, used = _meaning(words, unit)
    if not quantity and role == "command":
        return Guess(role=role, unit=unit, rest=tuple(words), because=f"no word of its name is a quantity{why_role}")
    if not quantity:
        return Guess(because="no word of its name is a quantity")
    found_unit = unit or ("1" if component in ("w", "x", "y", "z") and quantity == "part.orientation" else SI.get(quantity, "rad"))
    if quantity == "part.orientation" and component in ANGLES and not unit:
        found_unit = "rad"
    why_unit = f", ending '{ending}' says {found_unit}" if unit else f"; no unit in the name, so SI ({found_unit})"
    rest = tuple(word for k, word in enumerate(words) if k not in used)
    because = f"{' '.join(words[k] for k in sorted(used))} reads as {quantity}{'.' + component if component else ''}{why_unit}{why_role}"
    frame = "body" if quantity in BODY else "world"
    return Guess(quantity=quantity, component=component, unit=found_unit, role=role, frame=frame, rest=rest, because=because)


def says_time(name: str) -> bool:
    """Whether a name says that it is a time, and no unit of something else: "UTC", "time_50hz", "t"; not "t_left" or "clock [m]"."""
    bare, unit, _ = split_unit(name)
    words = set(words_of(bare))
    return not _other_unit(unit) and (bool(words & set(TIME_WORDS)) or ("t" in words and not _says_what(name)))


def may_be_time(name: str) -> bool:
    """Whether a name leaves it open that it is a time: it says no quantity, no unit of something else, and no place on a machine."""
    _, unit, _ = split_unit(name)
    return says_time(name) or not (_says_what(name) or (unit and not is_time_unit(unit)))


def _says_what(name: str) -> bool:
    """Whether a name says a quantity, whoever may have said, wished or counted it, or a place on a machine."""
    bare, unit, _ = split_unit(name)
    return bool(_meaning(words_of(bare), unit)[0]) or read_name(bare).placed


def is_time_unit(unit: str) -> bool:
    """Whether times are told in a unit."""
    return unit in TIME_UNITS or (bool(unit) and factor_of(unit, "s") is not None)


def _other_unit(unit: str) -> bool:
    """Whether a unit is one of the vocabulary's quantities, and none of time; "UTC" and "local" in brackets are no units."""
    units = {si for quantity in QUANTITIES.values() for si in quantity.units}
    return bool(unit) and not is_time_unit(unit) and (unit in UNIT_ENDINGS.values() or any(factor_of(unit, si) is not None for si in units))


def _meaning(words: Sequence[str], unit: str) -> tuple[str, str, set[int]]:
    """Quantity, component and the places of the words that say them."""
    for k, word in enumerate(words):
        if word in (*ANGLES, "heading"):
            angle = "yaw" if word == "heading" else word
            if any(w in ("rate", "gyro", "vel", "velocity") for w in words) or unit in ("rad/s", "deg/s"):
                return "part.angular_velocity", "xyz"[ANGLES.index(angle)], {k}
            return "part.orientation", angle, {k}
        if word in ("height", "altitude", "elevation"):
            return "part.position", "z", {k}
        small = SMALL.match(word)
        if small and (small[2] != "w" or small[1] == "q"):
            return SMALL_QUANTITY[small[1]], small[2], {k}
    for k, word in enumerate(words):
        if word in ("x", "y", "z") or (word == "w" and any(w in ("quat", "quaternion", "orientation") for w in words)):
            for j, other in enumerate(words):
                if other in AXIS_WORDS and (other not in ("angular", "linear") or len(words) > 1):
                    return AXIS_WORDS[other], word, {j, k}
            return "part.position", word, {k}
    if unit == "m/s" and any(word in ("velocity", "vel", "speed") for word in words):
        k = next(k for k, word in enumerate(words) if word in ("velocity", "vel", "speed"))
        return "part.linear_velocity", "x", {k}
    for quantity, needed in QUANTITY_WORDS:
        if all(word in words for word in needed):
            return quantity, "", {words.index(word) for word in needed}
    return "", "", set()


MESSAGE_PATTERNS = (
    (r"(?:^|\.)(?:position|point)\.([xyz])$", "part.position", "m", "world"),
    (r"(?:^|\.)(?:orientation|quaternion|rotation)\.([xyzw])$", "part.orientation", "1", "world"),
    (r"(?:^|\.)translation\.([xyz])$", "part.position", "m", "world"),
    (r"(?:^|\.)angular_velocity\.([xyz])$", "part.angular_velocity", "rad/s", "body"),
    (r"(?:^|\.)linear_acceleration\.([xyz])$", "part.linear_acceleration", "m/s^2", "body"),
    (r"(?:^|\.)linear\.([xyz])$", "part.linear_velocity", "m/s", "body"),
    (r"(?:^|\.)angular\.([xyz])$", "part.angular_velocity", "rad/s", "body"),
    (r"^position\[", "joint.position", "rad", "world"),
    (r"^velocity\[", "joint.velocity", "rad/s", "world"),
    (r"^effort\[", "joint.effort", "N m", "world"),
)


def guess_field(topic: str, kind: str, field: str) -> Guess:
    """What a number of a message may be. kind : type of the message."""
    short = kind.rpartition("/")[2]
    named = re.search(r"\[([^\]]+)\]$", field)
    for pattern, quantity, unit, frame in MESSAGE_PATTERNS:
        match = re.search(pattern, field)
        if match:
            if short in ("Twist", "TwistStamped") and any(word in COMMAND_WORDS for word in words_of(topic)):
                return Guess(because="a commanded twist goes to no single drive; give the speeds of the drives")
            rest = (named[1],) if named else tuple(words_of(topic))
            component = match[1] if match.groups() else ""
            return Guess(
                quantity=quantity,
                component=component,
                unit=unit,
                frame=frame,
                rest=rest,
                because=f"{short} tells {field} in {unit}, {frame} axes",
            )
    axis = re.search(r"(?:^|\.)vector\.([xyz])$", field) or (short.startswith("Vector3") and re.fullmatch(r"([xyz])", field))
    if axis:
        return _vector(topic, axis[1])
    if field == "data":
        found = guess_column(topic.strip("/").replace("/", "_"))
        return replace(found, because=f"{found.because} (name of the topic)")
    return Guess(because=f"{short}.{field} is no field that is known here")


def _vector(topic: str, axis: str) -> Guess:
    """What a number of a bare vector may be: its topic says of what."""
    words = words_of(topic)
    for word in words:
        if word in TRIPLE_WORDS:
            quantity, component = "part.orientation", ANGLES["xyz".index(axis)]
        elif word in AXIS_WORDS and AXIS_WORDS[word] != "part.orientation":  # a quaternion is no vector
            quantity, component = AXIS_WORDS[word], axis
        else:
            continue
        return Guess(
            quantity=quantity,
            component=component,
            unit=SI.get(quantity, "rad"),
            frame="body" if quantity in BODY else "world",
            rest=tuple(other for other in words if other != word),
            because=f"'{word}' of the topic reads as {quantity}.{component}; a vector tells no unit, so SI",
        )
    return Guess(because="a vector, and no word of its topic says of what")
