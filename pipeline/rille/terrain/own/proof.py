"""What an own landform must keep before it is taken into a library."""

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.terrain.landform import Landform, Values

Array = NDArray[np.float64]

POINTS = 257  # along each side of the trial grid
BORDER = 2e-3  # of the largest height: what may be left at the border of a form that is not steep
LOSS = 0.01  # of the soil moved: what may be left of the volume of a form that conserves it
WALL = "let it fade out there (`fade`), or set steep = true if a wall is meant"


def prove(landform: Landform, wall: str = WALL) -> None:
    """Evaluate its example, and every driver at both ends of its range. wall : what to do about one at its border, for the sentence.

    Raises
    ------
    InputRefused : if heights are not finite, all zero, not zero outside the footprint, if it ends in a wall though it is not ``steep``, or
        if it claims to conserve volume and does not.
    """
    subject = f"landform '{landform.name}'"
    values = landform.values(dict(landform.example), subject)
    x, y, heights = _sample(landform, values, f"the example of {subject}")
    largest = float(np.abs(heights).max())
    if largest == 0:
        raise InputRefused(f"{subject} is flat for its example; choose drivers that show it")
    half_x, half_y = landform.footprint(values)
    outside = (np.abs(x) > half_x) | (np.abs(y) > half_y)
    if np.abs(heights[outside]).max() > 0:
        raise InputRefused(f"{subject} is not zero outside its footprint of {2 * half_x:g} m x {2 * half_y:g} m; enlarge the footprint")
    if not landform.steep and landform.blend in ("add", "max"):
        _no_wall(landform, values, largest, subject, wall)
    if landform.conserves:
        moved, left = np.abs(heights).sum(), heights.sum()
        if abs(left) > LOSS * moved:
            raise InputRefused(
                f"{subject} claims to conserve volume, but {100 * left / moved:.1f} % of what it moves is left over; "
                "change it, or leave out `conserves`"
            )
    for driver in landform.drivers:
        for end in (driver.lower, driver.upper):
            try:
                extreme = landform.values({**landform.example, driver.name: end}, subject)
            except InputRefused:  # another driver leaves its range by its link: whoever asks for it is told so
                continue
            _sample(landform, extreme, f"{subject} with {driver.name} = {end:g} {driver.unit}")


def _sample(landform: Landform, values: Values, subject: str) -> tuple[Array, Array, Array]:
    half_x, half_y = landform.footprint(values)
    if not (np.isfinite([half_x, half_y]).all() and half_x > 0 and half_y > 0):
        raise InputRefused(f"the footprint of {subject} is {2 * half_x:g} m x {2 * half_y:g} m; both must be above 0")
    x, y = np.meshgrid(np.linspace(-1.25, 1.25, POINTS) * half_x, np.linspace(-1.25, 1.25, POINTS) * half_y)
    heights = np.asarray(landform.profile(x, y, values), np.float64)
    if not np.isfinite(heights).all():
        k = int(np.argmin(np.isfinite(heights)))
        raise InputRefused(f"the height of {subject} is not finite at x = {x.flat[k]:g} m, y = {y.flat[k]:g} m; change it or its ranges")
    return x, y, heights


def _no_wall(landform: Landform, values: Values, largest: float, subject: str, advice: str) -> None:
    half_x, half_y = landform.footprint(values)
    along = np.linspace(-1.0, 1.0, POINTS)
    side = np.ones(POINTS)
    border = np.concatenate([np.column_stack(v) for v in ((along, side), (along, -side), (side, along), (-side, along))]) * [half_x, half_y]
    if landform.outline is not None:
        border = np.concatenate([border, np.asarray(landform.outline(values), np.float64)])
    border = border * (1 - 1e-6)
    left = np.abs(landform.profile(border[:, 0], border[:, 1], values))
    k = int(np.argmax(left))
    if left[k] > BORDER * largest:
        raise InputRefused(
            f"{subject} is still {left[k]:.3g} m from zero at its border (x = {border[k, 0]:.3g} m, y = {border[k, 1]:.3g} m); {advice}"
        )
