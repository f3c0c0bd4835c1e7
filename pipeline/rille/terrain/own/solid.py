"""A solid as a landform: its highest surface, seen from above."""

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.terrain.grid import Grid
from rille.terrain.own.mesh_file import turn_up
from rille.terrain.own.relief import Relief, height_of, length_of, two_lengths
from rille.terrain.own.zbuffer import rasterise

Array = NDArray[np.float64]

CELLS = 400  # along the longer side, unless a posting is asked for
MOST = 4000


def heights_of_solid(
    vertices: Array,
    triangles: NDArray[np.integer],
    *,
    subject: str,
    up: str = "z",
    origin: str = "centre",
    zero: str = "bottom",
    embed: str | None = None,
    posting: str | None = None,
) -> Relief:
    """Seen from above on a grid whose points lie on whole multiples of its posting from the origin; 0 where there is nothing.

    Parameters
    ----------
    vertices : (n, 3) [m]. triangles : (m, 3). up : axis of the vertices that becomes z.
    origin : of the landform in plan: "centre" (of the box around it), "coordinates" (that of the file), or "x, y" there.
    zero : which height of the solid is height zero: "bottom", "centre", "coordinates" (zero of the file), or a height there.
    embed : how deep that height lies below the ground. posting : of the grid; default: a 400th of the longer side, rounded down.

    Raises
    ------
    InputRefused : for an origin, height, axis or posting that cannot be used, and a solid that ends up below the ground.
    """
    points = turn_up(np.asarray(vertices, np.float64), up)
    used = points[np.unique(triangles)]
    low, high = used.min(axis=0), used.max(axis=0)
    at, where = _origin(origin, low, high, subject)
    base, level = _zero(zero, low, high, subject)
    top = float(high[2]) - base
    depth = 0.0 if embed is None else height_of(embed, f"depth of {subject} in the ground")
    if not top > 0:
        raise InputRefused(f"{subject} reaches {top:g} m above its height zero, so nothing of it is seen; choose another --zero or --up")
    if not 0 <= depth < top:
        raise InputRefused(f"{subject} is embedded by {depth:g} m; it must be at least 0 and less than its height of {top:g} m")
    longer = float((high - low)[:2].max())
    if not longer > 0:
        raise InputRefused(f"{subject} has no extent in plan; check --up")
    step = _round_down(longer / CELLS) if posting is None else length_of(posting, f"posting of {subject}")
    if longer / step > MOST or longer < 2 * step:
        raise InputRefused(
            f"posting of {subject} is {step:g} m at a size of {longer:g} m; take between {longer / MOST:.2g} and {longer / 2:.2g} m"
        )
    west, south = (np.floor((low[:2] - at) / step + 1e-9) - 1) * step
    east, north = (np.ceil((high[:2] - at) / step - 1e-9) + 1) * step
    grid = Grid(
        n_rows=round((north - south) / step) + 1,
        n_cols=round((east - west) / step) + 1,
        posting_x=step,
        posting_y=step,
        x_west=float(west),
        y_north=float(north),
    )
    seen = rasterise(points - [*at, base], triangles, grid)
    if not np.nanmax(np.append(seen.ravel(), 0.0)) > 0:
        raise InputRefused(f"nothing of {subject} is seen from above at a posting of {step:g} m; take a finer --posting, or check --up")
    return Relief(
        grid=grid,
        heights=np.nan_to_num(np.maximum(seen, 0.0), nan=0.0),
        length=float(high[0] - low[0]),
        frame=f"origin at {where}, x and y as drawn, height zero at {level}, which `embedded` puts below the ground",
        reference=f"{len(triangles)} triangles seen along -{up.removeprefix('+')} at {step:g} m, origin {origin}, zero {zero}",
        embedded=depth / top,
    )


def _origin(text: str, low: Array, high: Array, subject: str) -> tuple[Array, str]:
    if text in ("centre", "center"):
        return (low[:2] + high[:2]) / 2, "the centre of the box around it"
    if text == "coordinates":
        return np.zeros(2), "the origin of its file"
    if "," not in text:
        raise InputRefused(f"origin of {subject} is '{text}'; give centre, coordinates, or a point such as \"1 m, 20 cm\"")
    point = two_lengths(text, f"origin of {subject}")
    return np.array(point), f"({point[0]:g}, {point[1]:g}) m of its file"


def _zero(text: str, low: Array, high: Array, subject: str) -> tuple[float, str]:
    named = {"bottom": float(low[2]), "centre": float(low[2] + high[2]) / 2, "coordinates": 0.0}
    words = {"bottom": "its lowest point", "centre": "half its height", "coordinates": "height zero of its file"}
    if text in named:
        return named[text], words[text]
    value = height_of(text, f"--zero of {subject} (bottom, centre, coordinates, or a height)")
    return value, f"{value:g} m of its file"


def _round_down(value: float) -> float:
    """To 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(m for m in (1, 2, 5) if m <= value / power + 1e-9))
