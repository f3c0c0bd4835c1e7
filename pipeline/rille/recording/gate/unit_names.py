"""The unit that a column's name says, and the factors by which units get mixed up."""

import math
import re

from rille.model.quantity import factor_of, is_unit
from rille.model.unit_names import SPELT, STANDARD_GRAVITY

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
    """The unit that a column's name ends in or holds in brackets, and its factor to the SI ``unit``: "yaw_deg", "speed [mm/s]".

    In square brackets it may be any unit that pint knows.
    """
    known = SPELT.get(unit, {})
    bracket = re.search(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$", name)
    shown = bracket[1] if bracket else ""
    words = [word for word in re.split(r"[\s_\-.]+", name.lower()) if word]
    endings = {shown.lower(): shown, re.sub(r"[\s*·]+", "", shown.lower()): shown}
    endings |= {ending: ending for ending in ("_".join(words[-2:]) if len(words) > 2 else "", words[-1] if len(words) > 1 else "")}
    for ending, written in endings.items():
        if ending in known:
            return written, known[ending]
    square = re.search(r"\[\s*([^\[\]]+?)\s*\]\s*$", name)
    factor = factor_of(square[1], unit) if square and is_unit(square[1]) else None
    return None if square is None or factor is None else (square[1], factor)
