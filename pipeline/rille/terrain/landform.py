"""What a registered landform is: a profile in its own frame, drivers, a footprint, a way to blend, a source."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, nearest_names
from rille.model.quantity import to_si

Array = NDArray[np.float64]
Profile = Callable[[Array, Array, dict[str, float]], Array]


@dataclass(frozen=True, slots=True, kw_only=True)
class Driver:
    """A named parameter of a landform. unit : SI. default None: must be given. reason : why the range ends where it does."""

    name: str
    unit: str
    meaning: str
    lower: float
    upper: float
    default: float | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Landform:
    """A registered landform.

    frame : where its origin lies, where x points, and what height zero is.
    profile : (x, y, drivers) -> height [m]; x, y [m] in the landform's frame, arrays of one shape.
    blend : ``add`` raises the ground by the profile; ``replace`` puts the profile in place of it; ``max`` keeps the higher.
    footprint : drivers -> radius [m] beyond which the profile is zero.
    """

    name: str
    meaning: str
    frame: str
    source: str
    drivers: tuple[Driver, ...]
    profile: Profile
    footprint: Callable[[dict[str, float]], float]
    blend: Literal["add", "replace", "max"] = "add"

    def values(self, given: dict[str, object], subject: str) -> dict[str, float]:
        """Driver values in SI, defaults filled in.

        Raises
        ------
        InputRefused : for an unknown driver (with the nearest names), a missing one, a wrong unit, or a value out of range
            (with the range and its reason).
        """
        known = {driver.name: driver for driver in self.drivers}
        for name in given:
            if name not in known:
                raise InputRefused(f"{subject} sets the driver '{name}', which {self.name} does not have; {nearest_names(name, known)}")
        values = {}
        for driver in self.drivers:
            if driver.name not in given and driver.default is None:
                raise InputRefused(f"{subject} needs the driver '{driver.name}' [{driver.unit}]: {driver.meaning}")
            value = to_si(given.get(driver.name, driver.default), driver.unit, f"driver '{driver.name}' of {subject}")
            if not driver.lower <= value <= driver.upper:
                because = f" ({driver.reason})" if driver.reason else ""
                raise InputRefused(
                    f"driver '{driver.name}' of {subject} is {value:g} {driver.unit}; it must lie between {driver.lower:g} and "
                    f"{driver.upper:g}{because}"
                )
            values[driver.name] = value
        return values
