"""One landform on flat ground, to be shown: plan and profiles."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model import LandformInstance
from rille.terrain.base.plane import Plane
from rille.terrain.composition import compose
from rille.terrain.document import value_text
from rille.terrain.grid import Grid
from rille.terrain.landform import Landform
from rille.terrain.placed import Placed

Array = NDArray[np.float64]

MARGIN = 1.12  # of flat ground that is shown around its footprint
CUT = 1201  # points of a profile
SEEN = 0.2  # of its whole relief: what a profile must show


@dataclass(frozen=True, slots=True, kw_only=True)
class Exhibit:
    """Heights (n_rows, n_cols) [m] at x (n_cols,), y (n_rows,) descending [m] in the landform's frame.

    values : of all drivers, SI. drivers : the same, name and text with unit. cut_x, cut_y : coordinate (n,) and height (n,) [m] along the
    axes, finer than the plan, and the other coordinate there: 0, or where the form is highest (or deepest) if it is hardly seen on the
    axis.
    """

    name: str
    meaning: str
    values: dict[str, float]
    drivers: tuple[tuple[str, str], ...]
    x: Array
    y: Array
    heights: Array
    cut_x: tuple[Array, Array, float]
    cut_y: tuple[Array, Array, float]


def exhibit(
    landform: Landform, register: Mapping[str, Landform], given: Mapping[str, object] | None = None, *, points: int = 360
) -> Exhibit:
    """Evaluate a landform on flat ground with its example's drivers, changed by ``given``; what is scattered with it comes along.

    Parameters
    ----------
    points : along the longer side of the plan.

    Raises
    ------
    InputRefused : as :meth:`Landform.values`.
    """
    changed = dict(given or {})
    values = landform.values({**landform.example, **changed}, f"landform '{landform.name}'")
    half_x, half_y = (MARGIN * half for half in landform.footprint(values))
    step = 2 * max(half_x, half_y) / (points - 1)
    n_rows, n_cols = (max(2 * int(np.ceil(half / step)) + 1, 3) for half in (half_y, half_x))
    plan = Grid(
        n_rows=n_rows, n_cols=n_cols, posting_x=step, posting_y=step, x_west=-(n_cols - 1) / 2 * step, y_north=(n_rows - 1) / 2 * step
    )
    placed = Placed(instance=LandformInstance(name=landform.name, landform=landform.name, x=0.0, y=0.0, drivers=values), landform=landform)
    ground, _ = compose(plan, Plane(), [placed], dict(register))
    x, y = plan.axes(plan.whole)
    heights = ground.render(plan, plan.whole)
    extreme = np.argwhere(np.abs(heights) >= 0.999 * np.abs(heights).max())
    row, column = extreme[np.hypot(*(extreme - np.median(extreme, axis=0)).T).argmin()]
    span = float(np.ptp(heights))
    at_y = 0.0 if np.ptp(heights[n_rows // 2]) > SEEN * span else float(y[row])
    at_x = 0.0 if np.ptp(heights[:, n_cols // 2]) > SEEN * span else float(x[column])
    along_x, along_y = np.linspace(-half_x, half_x, CUT), np.linspace(-half_y, half_y, CUT)
    return Exhibit(
        name=landform.name,
        meaning=landform.meaning,
        values=values,
        drivers=tuple((driver.name, value_text(values[driver.name], driver.unit)) for driver in landform.drivers),
        x=x,
        y=y,
        heights=heights,
        cut_x=(along_x, ground.at(along_x, np.full(CUT, at_y)), at_y),
        cut_y=(along_y, ground.at(np.full(CUT, at_x), along_y), at_x),
    )
