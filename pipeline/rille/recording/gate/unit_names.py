"""Units as column names write them, and the factors by which units get mixed up."""

import math
import re

TURN = math.pi / 180
STANDARD_GRAVITY = 9.80665  # [m/s^2]
SPELT = {  # SI unit: ending of a name -> factor to SI
    "rad": {
        "deg": TURN,
        "degree": TURN,
        "degrees": TURN,
        "rad": 1.0,
        "radians": 1.0,
        "mrad": 1e-3,
        "rev": 2 * math.pi,
        "turns": 2 * math.pi,
    },
    "rad/s": {
        "rpm": math.pi / 30,
        "degps": TURN,
        "dps": TURN,
        "deg/s": TURN,
        "deg_s": TURN,
        "radps": 1.0,
        "rad/s": 1.0,
        "rad_s": 1.0,
        "rps": 2 * math.pi,
    },
    "m": {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "km": 1e3, "um": 1e-6},
    "m/s": {
        "mps": 1.0,
        "m/s": 1.0,
        "m_s": 1.0,
        "mmps": 1e-3,
        "mm/s": 1e-3,
        "mm_s": 1e-3,
        "cm/s": 1e-2,
        "cm_s": 1e-2,
        "kmh": 1 / 3.6,
        "km/h": 1 / 3.6,
        "kph": 1 / 3.6,
    },
    "m/s^2": {"g": STANDARD_GRAVITY, "mg": STANDARD_GRAVITY / 1000, "mps2": 1.0, "m/s2": 1.0, "m/s^2": 1.0, "m_s2": 1.0},
    "N": {"n": 1.0, "kn": 1e3, "kgf": STANDARD_GRAVITY},
    "N m": {"nm": 1.0, "n_m": 1.0, "mnm": 1e-3, "ncm": 1e-2},
    "A": {"a": 1.0, "ma": 1e-3},
    "V": {"v": 1.0, "mv": 1e-3},
    "1": {"percent": 0.01, "pct": 0.01, "%": 0.01},
    "s": {
        "s": 1.0,
        "sec": 1.0,
        "secs": 1.0,
        "seconds": 1.0,
        "ms": 1e-3,
        "msec": 1e-3,
        "us": 1e-6,
        "usec": 1e-6,
        "ns": 1e-9,
        "nsec": 1e-9,
        "min": 60.0,
    },
}
FACTORS = {  # value is too large by: what was probably meant
    180 / math.pi: "deg instead of rad",
    math.pi / 180: "rad instead of deg",
    30 / math.pi: "rpm instead of rad/s",
    math.pi / 30: "rad/s instead of rpm",
    2 * math.pi: "turns and radians mixed up",
    1 / (2 * math.pi): "turns and radians mixed up",
    60.0: "per minute instead of per second",
    1 / 60: "per second instead of per minute",
    3.6: "km/h instead of m/s",
    1 / 3.6: "m/s instead of km/h",
    1e3: "milli instead of the unit (mm for m)",
    1e-3: "the unit instead of milli (m for mm)",
    1e2: "percent or centi instead of the unit",
    1e-2: "the unit instead of percent or centi",
    1e6: "micro instead of the unit",
    1e-6: "the unit instead of micro",
    STANDARD_GRAVITY: "m/s^2 instead of g",
    1 / STANDARD_GRAVITY: "g instead of m/s^2",
}


def nearest_factor(gain: float, within: float) -> tuple[float, str] | None:
    """The known factor that ``gain`` (sign apart) is within a relative ``within`` of, and its meaning."""
    factor = min(FACTORS, key=lambda known: abs(math.log(abs(gain) / known))) if gain and math.isfinite(gain) else 1.0
    return (factor, FACTORS[factor]) if factor != 1.0 and abs(math.log(abs(gain) / factor)) < within else None


def spelt_unit(name: str, unit: str) -> tuple[str, float] | None:
    """The unit that a column's name ends in or holds in brackets, and its factor to the SI ``unit``: "yaw_deg", "speed [mm/s]"."""
    known = SPELT.get(unit, {})
    text = name.strip().lower()
    bracket = re.search(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$", text)
    endings = [bracket.group(1)] if bracket else []
    words = [word for word in re.split(r"[\s_\-.]+", text) if word]
    endings += ["_".join(words[-2:])] if len(words) > 2 else []
    endings += words[-1:] if len(words) > 1 else []
    for ending in endings:
        if ending in known:
            return ending, known[ending]
    return None
