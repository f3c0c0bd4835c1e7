"""What a registered landform is: a profile in its own frame, drivers, a footprint, a way to blend, a soil, a source."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, nearest_names
from rille.model.quantity import to_si

Array = NDArray[np.float64]
Values = dict[str, float]
Profile = Callable[[Array, Array, Values], Array]
Blend = Literal["add", "replace", "max", "drape"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Driver:
    """A named parameter of a landform.

    unit : SI ("dimensionless" for numbers). default None without ``link``: must be given.
    link : value from the drivers before this one, where it is not given; ``law`` says it in words ("0.196 diameter^1.01 (Melosh 1989)").
    reason : why the range ends where it does. source : of default and range.
    """

    name: str
    unit: str
    meaning: str
    lower: float
    upper: float
    default: float | None = None
    link: Callable[[Values], float] | None = None
    law: str = ""
    reason: str = ""
    source: str = ""

    @property
    def required(self) -> bool:
        """True if nothing stands in for it."""
        return self.default is None and self.link is None


@dataclass(frozen=True, slots=True, kw_only=True)
class Radial:
    """A form that depends on the elliptical distance only: z = amplitude * shape(r, state), r = |(x / a, y / b)|, 0 for r >= reach.

    Such forms are placed by the ten thousand: shapes are tabulated once, and a compiled loop stamps them.

    semi_axes : drivers -> (a, b) [m]. amplitude : drivers -> [m]. state : drivers -> [-] in [0, 1], which member of a one-parameter
    family of shapes. All three take drivers as numbers or arrays (n,) and return the like.
    shape : (r, state) -> [-], r an array, state a number; exactly 0 for r >= reach.
    """

    semi_axes: Callable[[dict[str, Any]], tuple[Any, Any]]
    amplitude: Callable[[dict[str, Any]], Any]
    shape: Callable[[Array, float], Array]
    state: Callable[[dict[str, Any]], Any] | None = None
    reach: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Scattered:
    """Children of a landform, in its frame: x, y [m], heading [rad], each (n,); drivers: name -> (n,), of the radial ``landform``."""

    landform: str
    x: Array
    y: Array
    heading: Array
    drivers: dict[str, Array]


@dataclass(frozen=True, slots=True, kw_only=True)
class Landform:
    """A registered landform.

    frame : where its origin lies, where x points, and what height zero is.
    profile : (x, y, drivers) -> height [m]; x, y [m] in the landform's frame, arrays of one shape; exactly zero outside the footprint.
        A ``radial`` landform needs none.
    footprint : drivers -> (half_x, half_y) [m], a box around the origin along the landform's own axes.
    blend : how the profile p meets the ground g it is placed on (w: weight, d: datum):
        ``add``      z = g + p;
        ``replace``  z = g + w (d + p - g): what was there is gone; d is the plane that fits the ground along the outline;
        ``max``      z = max(g, d + p) where p > 0: a solid that stands upright; d is the lowest ground along the outline;
        ``drape``    z = g + w max(d + p - g, 0): a cover that fills hollows; d is the plane as of ``replace``.
    level : True if ``replace`` takes d level, at the mean of the ground around, instead of the plane (a pad).
    crowd : how members of one population meet each other: ``add`` their profiles, or ``max``: the highest counts (rocks).
    weight : (x, y, drivers) -> 0..1, 0 at the border of the footprint; None: falls smoothly over the outer fifth of the footprint.
    outline : drivers -> corners (n, 2) [m] of the region that takes ``soil`` (or the soil named in the scene), and border
        along which the ground below gives the datum; None: the footprint.
    soil : name of the soil of its surface; empty: that of the ground.
    children : drivers -> landforms scattered with it (rocks around a crater); deterministic, from a driver ``seed``.
    example : drivers that show it well; the library's picture and the tests of the register use them.
    conserves : "volume" if the profile claims to move soil without loss, so that its integral is zero.
    steep : True if its surface may be vertical at its border (rocks, steps).
    digest : of the file that defines it, set by the register: what was evaluated with another one is evaluated again.
    check : drivers -> why these values do not go together, in words; empty if they do.
    """

    name: str
    meaning: str
    frame: str
    source: str
    drivers: tuple[Driver, ...]
    footprint: Callable[[Values], tuple[float, float]]
    example: dict[str, float]
    profile: Profile = field(default=None)  # type: ignore[assignment]
    radial: Radial | None = None
    blend: Blend = "add"
    level: bool = False
    crowd: Literal["add", "max"] = "add"
    weight: Callable[[Array, Array, Values], Array] | None = None
    outline: Callable[[Values], Array] | None = None
    soil: str = ""
    children: Callable[[Values], tuple[Scattered, ...]] | None = None
    conserves: Literal["", "volume"] = ""
    steep: bool = False
    digest: str = ""
    check: Callable[[Values], str] | None = None

    def __post_init__(self) -> None:
        """Derive the profile of a radial landform."""
        if self.profile is None:
            if self.radial is None:
                raise ValueError(f"landform '{self.name}' has neither a profile nor a radial shape")
            object.__setattr__(self, "profile", _radial_profile(self.radial))

    def border(self, drivers: Values) -> Array:
        """Corners (n, 2) [m] of its outline; where it states none, the ellipse of a radial form or the box of its footprint."""
        if self.outline is not None:
            return np.asarray(self.outline(drivers), float)
        if self.radial is not None:
            around = np.arange(72) * (2 * np.pi / 72)
            a, b = self.radial.semi_axes(drivers)
            return self.radial.reach * np.column_stack([a * np.cos(around), b * np.sin(around)])
        half_x, half_y = self.footprint(drivers)
        return np.array([[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]])

    def values(self, given: dict[str, object], subject: str) -> Values:
        """Driver values in SI, in the order of the drivers; links and defaults filled in.

        Raises
        ------
        InputRefused : for an unknown driver (with the nearest names), a missing one, a wrong unit, a value out of range
            (with the range and its reason), or values that do not go together.
        """
        known = {driver.name: driver for driver in self.drivers}
        for name in given:
            if name not in known:
                raise InputRefused(f"{subject} sets the driver '{name}', which {self.name} does not have; {nearest_names(name, known)}")
        values: Values = {}
        for driver in self.drivers:
            what = f"driver '{driver.name}' of {subject}"
            if driver.name in given:
                value = to_si(given[driver.name], driver.unit, what)
            elif driver.link is not None:
                value = float(driver.link(values))
            elif driver.default is not None:
                value = driver.default
            else:
                raise InputRefused(f"{subject} needs the driver '{driver.name}' [{driver.unit}]: {driver.meaning}")
            if not driver.lower <= value <= driver.upper:
                because = f" ({driver.reason})" if driver.reason else ""
                origin = "" if driver.name in given else f" by its link {driver.law}"
                raise InputRefused(
                    f"{what} is {value:g} {driver.unit}{origin}; it must lie between {driver.lower:g} and {driver.upper:g}{because}"
                )
            values[driver.name] = value
        if self.check is not None and (wrong := self.check(values)):
            raise InputRefused(f"{subject}: {wrong}")
        return values


def _radial_profile(radial: Radial) -> Profile:
    def profile(x: Array, y: Array, drivers: Values) -> Array:
        a, b = radial.semi_axes(drivers)
        state = 0.0 if radial.state is None else float(radial.state(drivers))
        return radial.amplitude(drivers) * radial.shape(np.hypot(x / a, y / b), state)

    return profile


def smooth_step(u: Array) -> Array:
    """3 u^2 - 2 u^3 on [0, 1], constant outside: value and slope join."""
    u = np.clip(u, 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)


def border_weight(x: Array, y: Array, half_x: float, half_y: float, share: float = 0.2) -> Array:
    """1 inside a box of half lengths, falling smoothly to 0 over the outer ``share`` of them."""
    across = np.minimum((half_x - np.abs(x)) / (share * half_x), (half_y - np.abs(y)) / (share * half_y))
    return smooth_step(across)
