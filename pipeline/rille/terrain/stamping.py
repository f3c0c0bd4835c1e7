"""Populations of radial landforms stamped into heights by the compiled loop."""

import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille import _terrain  # pyright: ignore[reportMissingModuleSource]
from rille.model import InputRefused, Population
from rille.terrain.grid import Grid, Window
from rille.terrain.landform import Landform, Radial
from rille.terrain.radial_table import RadialTable, table_of

Array = NDArray[np.float64]

KEPT = 2_000_000  # forms that are kept as the compiled loop takes them, of all populations and grids together (100 bytes each)
LEAST = 1000  # forms that a population counts at least: its own arrays are kept with it


def stamp(heights: Array, window: Window, grid: Grid, landform: Landform, population: Population, *, threads: int = 2) -> None:
    """Add a population's forms to ``heights`` of a window of a grid, in place.

    z += sum of amplitude_k shape(r_k, state_k), or, for a landform whose crowd is ``max``, z += max_k of them where it is above zero;
    r_k = |(x_k / a_k, y_k / b_k)| with (x_k, y_k) the point in the frame of form k. Shapes come from the table of
    :func:`rille.terrain.radial_table.tabulate`, whose error it states; everything else is exact to rounding.

    A pure function: the same bytes for any tiling of the grid and any number of threads. Arrays of the population must not change
    while it lives: what the compiled loop takes is kept.

    Parameters
    ----------
    heights : (n_rows, n_cols) of the window [m], float64; rows may be apart (a part of a larger array).
    threads : 1 to 256.

    Raises
    ------
    InputRefused : if a position, heading, semi-axis or height of a form is not finite, or a semi-axis not positive.
    ValueError : if heights are not of the window's shape, or the landform is not radial.
    """
    if landform.radial is None:
        raise ValueError(f"landform '{landform.name}' is not radial")
    if heights.shape != window.shape:
        raise ValueError(f"heights have the shape {heights.shape}, their window {window.shape}")
    if len(population.x) == 0 or window.empty:
        return
    table = table_of(landform)
    forms = _kept_forms(landform.radial, table, grid, population)
    _terrain.stamp(
        shapes=table.shapes,
        forms=forms,
        heights=heights,
        row0=window.row0,
        column0=window.col0,
        highest=landform.crowd == "max",
        threads=threads,
    )


def stamp_points(heights: Array, x: Array, y: Array, landform: Landform, population: Population) -> None:
    """Add a population's forms to ``heights`` (n,) [m] of points x, y (n,) [m] in W, in place; meaning and errors as of :func:`stamp`."""
    if landform.radial is None:
        raise ValueError(f"landform '{landform.name}' is not radial")
    if len(population.x) == 0:
        return
    table = table_of(landform)
    forms = _kept_forms(landform.radial, table, SCENE, population)
    column, row = (np.ascontiguousarray(v) for v in SCENE.index(x, y))
    _terrain.stamp_points(table.shapes, forms, column=column, row=row, heights=heights, highest=landform.crowd == "max")


SCENE = Grid(n_rows=1, n_cols=1, posting_x=1.0, posting_y=1.0, x_west=0.0, y_north=0.0)  # columns are x, rows are -y

_lock = threading.Lock()
_kept: dict[tuple[int, Radial, Grid], tuple[Population, _terrain.RadialForms]] = {}


def _kept_forms(radial: Radial, table: RadialTable, grid: Grid, population: Population) -> _terrain.RadialForms:
    """Forms of a population on a grid, made once for all tiles; the population is kept with them, so that its id stays its own."""
    key = (id(population), radial, grid)
    with _lock:
        found = _kept.pop(key, None)
        if found is None:
            found = population, _forms_of(radial, table, grid, population)
            held = sum(max(len(forms), LEAST) for _, forms in _kept.values()) + max(len(found[1]), LEAST)
            while _kept and held > KEPT:
                held -= max(len(_kept.pop(next(iter(_kept)))[1]), LEAST)
        _kept[key] = found
    return found[1]


def _forms_of(radial: Radial, table: RadialTable, grid: Grid, population: Population) -> _terrain.RadialForms:
    n = population.x.shape
    turn = np.asarray(population.heading, np.float64) - grid.heading
    (a, b), amplitude = radial.semi_axes(population.drivers), radial.amplitude(population.drivers)
    a, b = (_column(v, population, "semi-axis [m]") * population.scale for v in (a, b))
    amplitude = _column(amplitude, population, "amplitude [m]") * population.scale
    state = np.zeros(n) if radial.state is None else _column(radial.state(population.drivers), population, "state")
    for name, values in (("x [m]", population.x), ("y [m]", population.y), ("heading [rad]", turn)):
        _column(values, population, name)
    flat = ~((a > 0) & (b > 0))
    if flat.any():
        k = int(flat.argmax())
        raise InputRefused(
            f"form {k} of population '{population.name}' has the semi-axes {a[k]:g} and {b[k]:g} m; "
            "they must be above zero: check its drivers and its scale"
        )
    round_ = a == b
    cosine, sine = np.where(round_, 1.0, np.cos(turn)), np.where(round_, 0.0, np.sin(turn))
    right, down = grid.posting_x, -grid.posting_y  # [m] per column and row
    along, across = 1.0 / (a * radial.reach), 1.0 / (b * radial.reach)
    matrix = np.empty((*n, 2, 2))
    matrix[:, 0, 0], matrix[:, 0, 1] = cosine * right * along, sine * down * along
    matrix[:, 1, 0], matrix[:, 1, 1] = -sine * right * across, cosine * down * across
    column, row = (np.ascontiguousarray(v) for v in grid.index(population.x, population.y))
    return _terrain.RadialForms(column=column, row=row, matrix=matrix, amplitude=amplitude, state=table.position(state))


def _column(values: Any, population: Population, what: str) -> Array:
    """Numbers or arrays as (n,), refused unless all are finite."""
    column = np.array(np.broadcast_to(np.asarray(values, np.float64), population.x.shape))
    bad = ~np.isfinite(column)
    if bad.any():
        k = int(bad.argmax())
        raise InputRefused(f"the {what} of form {k} of population '{population.name}' is {column[k]}; it must be finite: check its drivers")
    return column
