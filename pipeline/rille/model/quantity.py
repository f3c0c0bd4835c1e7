"""Values at the door: strings with units become SI numbers. Inside rille there are only SI and radians."""

import math
import os
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rille.model.errors import InputRefused

if TYPE_CHECKING:
    import pint
    from pint.facets.plain import PlainQuantity

# Dimension of each kind of quantity, as a unit that it must be convertible to.
SI_UNITS = {
    "length": "m",
    "mass": "kg",
    "density": "kg/m^3",
    "inertia": "kg m^2",
    "angle": "rad",
    "time": "s",
    "speed": "m/s",
    "angular_speed": "rad/s",
    "torque": "N m",
    "force": "N",
    "pressure": "Pa",
    "acceleration": "m/s^2",
    "rate": "Hz",
}

# Units that nearly every sheet is written in, besides SI itself: factor to SI. With them pint is not even imported, which takes as long
# as all else.
USUAL = {
    ("km", "m"): 1000.0,
    ("cm", "m"): 0.01,
    ("mm", "m"): 0.001,
    ("deg", "rad"): math.pi / 180,
    ("ms", "s"): 0.001,
    ("Myr", "s"): 1e6 * 365.25 * 86400,
}
# One number, or one number over another ("1/2 in"), and one unit: names with small whole powers, side by side, multiplied or divided.
# Pint alone would take "1,5 m" for 15, "2 2 m" for 4, and compute "9**9**9 kg".
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_POWER = r"(?:(?:\^|\*\*)-?\d(?:\.\d+)?|[²³]|(?<=[^\W\d_])[234](?![\w.]))"
_FACTOR = rf"\(*(?:[^\W\d_][^\W\d]*|°|%){_POWER}?(?:\){_POWER}?)*"
NUMBER_AND_UNIT = re.compile(
    rf"\s*(?P<number>{_NUMBER})(?:\s*/\s*(?P<divisor>{_NUMBER}))?"
    rf"\s*(?P<unit>1|(?:1\s*/\s*)?{_FACTOR}(?:(?:\s*[*·/]\s*|\s+){_FACTOR})*|)\s*"
)
TURNING = ("rad", "rad/s", "rad/s^2")  # units in which a ratio, or a count of events per second, is not what was meant


@cache
def unit_registry() -> "pint.UnitRegistry":
    """The units that pint knows, read once."""
    import pint

    kept = Path(os.environ.get("RILLE_CACHE") or "~/.cache/rille").expanduser() / "pint"
    try:
        registry = pint.UnitRegistry(cache_folder=kept)  # parsed definitions, kept: saves 0.3 s of every start
    except Exception:  # whatever is wrong with kept files, parsing anew is right
        registry = pint.UnitRegistry()
    registry.define("@alias turn = rev")  # as tachometers are labelled: rev/min
    registry.preprocessors.append(lambda text: re.sub(r"\b([A-Za-z]+)([234])\b", r"\1**\2", text))  # m/s2, as headers have it
    return registry


def to_si(value: object, kind: str, what: str) -> float:
    """Turn ``"35 deg"``, ``"120 mm"`` or a bare number (already SI) into an SI number.

    Parameters
    ----------
    value : number, or string with a number and a unit.
    kind : key of ``SI_UNITS``, or an SI unit such as ``"N/m^2"``.
    what : name of the quantity for the error sentence ("radius of wheel 'front_left'").

    Raises
    ------
    InputRefused : if the text is no quantity, its unit has another dimension, or the value is not finite.
    """
    unit = SI_UNITS.get(kind, kind)
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise InputRefused(f'{what} is {value!r}; give a number in {unit} or a string with a unit such as "1 {unit}"')
    if isinstance(value, int | float):
        number = float(value)
    elif (match := NUMBER_AND_UNIT.fullmatch(value)) is None:
        raise InputRefused(
            f'{what} is "{value}", which is not one number (with a decimal point) and one unit; write for example "1 {unit}"'
        )
    else:
        given = match["unit"]
        number = float(match["number"])
        if match["divisor"]:
            number = _divided(number, float(match["divisor"]), value, what)
        if given and given != unit:
            number = number * USUAL[given, unit] if (given, unit) in USUAL else _converted(number, given, kind, value, what)
    if not math.isfinite(number):
        raise InputRefused(f"{what} is {value}; give a finite value in {unit}")
    return number


def angle_with_unit(text: str, what: str) -> float:
    """Turn ``"30 deg"`` into radians. A bare number is refused, since 30 may mean degrees as well as radians; only 0 needs no unit.

    Parameters
    ----------
    text : number and unit, as a person typed it. what : name of the angle for the error sentence ("heading of the rover").

    Raises
    ------
    InputRefused : without a unit, and for whatever :func:`to_si` refuses.
    """
    angle = to_si(text, "angle", what)
    match = NUMBER_AND_UNIT.fullmatch(text)
    if angle != 0 and (match is None or match["unit"] in ("", "1")):
        raise InputRefused(f"{what} is {text.strip()} without a unit; write for example '{text.strip()} deg'")
    return angle


def counts_no_turns(quantity: "PlainQuantity[Any]", unit: str) -> bool:
    """Whether a ratio, a count or a frequency stands where ``unit``, of an angle or a turning, is meant.

    pint takes radians for pure numbers: 1 Hz may mean 1 rad/s or 1 turn/s. quantity : one that ``unit`` measures.
    """
    return unit in TURNING and "radian" not in str(quantity.to_root_units().units)


def _divided(number: float, divisor: float, text: str, what: str) -> float:
    if divisor == 0:
        raise InputRefused(f'{what} is "{text}", which divides by zero; give a finite value')
    return number / divisor


def _converted(number: float, given: str, kind: str, text: str, what: str) -> float:
    """A number of some unit in that of a kind, by pint."""
    import pint

    unit = SI_UNITS.get(kind, kind)
    registry = unit_registry()
    try:
        quantity = registry.Quantity(number, given)
        if str(quantity.units) == "dimensionless":
            return float(quantity.m)
        converted = float(quantity.m_as(unit))
    except (pint.PintError, ValueError, TypeError, AttributeError, ArithmeticError, SyntaxError) as error:
        raise InputRefused(f'{what} is "{text}", which is no {kind} ({error}); write for example "1 {unit}"') from None
    except Exception as error:  # pint lets errors of its tokeniser through
        raise InputRefused(f'{what} is "{text}", which cannot be read ({error}); write for example "1 {unit}"') from None
    if counts_no_turns(quantity, unit):
        meant = "an angle: a grade of 30 % is 16.7 deg" if unit == "rad" else "a turning speed: 1 turn/s is 6.28 rad/s"
        raise InputRefused(f'{what} is "{text}", which is no unit of {meant}; write deg, rad or turn')
    return converted


def factor_of(unit: str, si: str) -> float | None:
    """Factor from a unit to an SI unit: 1e-3 from "mm" to "m"; None if it is no unit, or none of that quantity."""
    try:
        return to_si(f"1 {unit}", si, "unit")
    except InputRefused:
        return None


def is_unit(text: str) -> bool:
    """Whether a text is a unit: "deg/s", "N m"."""
    match = NUMBER_AND_UNIT.fullmatch(f"1 {text}")
    if match is None or match["unit"] in ("", "1"):
        return False
    try:
        unit_registry().parse_units(match["unit"])
    except Exception:  # pint lets errors of its tokeniser through
        return False
    return True
