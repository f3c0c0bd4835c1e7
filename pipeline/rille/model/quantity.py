"""Values at the door: strings with units become SI numbers. Inside rille there are only SI and radians."""

import math
import os
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from rille.model.errors import InputRefused

if TYPE_CHECKING:
    import pint

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
NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([a-zA-Z].*?|1/.*?)\s*")


@cache
def unit_registry() -> "pint.UnitRegistry":
    """The units that pint knows, read once."""
    import pint

    kept = Path(os.environ.get("RILLE_CACHE") or "~/.cache/rille").expanduser() / "pint"
    try:
        return pint.UnitRegistry(cache_folder=kept)  # parsed definitions, kept: saves 0.3 s of every start
    except Exception:  # whatever is wrong with kept files, parsing anew is right
        return pint.UnitRegistry()


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
    elif (usual := NUMBER_AND_UNIT.fullmatch(value)) and (usual[2] == unit or (usual[2], unit) in USUAL):
        number = float(usual[1]) * USUAL.get((usual[2], unit), 1.0)
    else:
        import pint

        try:
            quantity = unit_registry().Quantity(value)
            number = float(quantity.m if str(quantity.units) == "dimensionless" else quantity.m_as(unit))
        except (pint.PintError, ValueError, TypeError, AttributeError, ArithmeticError, SyntaxError) as error:
            raise InputRefused(f'{what} is "{value}", which is no {kind} ({error}); write for example "1 {unit}"') from None
        except Exception as error:  # pint lets errors of its tokeniser through
            raise InputRefused(f'{what} is "{value}", which cannot be read ({error}); write for example "1 {unit}"') from None
    if not math.isfinite(number):
        raise InputRefused(f"{what} is {value}; give a finite value in {unit}")
    return number
