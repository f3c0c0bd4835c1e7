"""A measured DEM as the base of a scene."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille import __version__
from rille.model import InputRefused, SourceFile
from rille.model.quantity import to_si
from rille.model.sheet import expand
from rille.terrain.base.cells import cells
from rille.terrain.base.detail import make_detail
from rille.terrain.base.ground import Base, Ground, Progress, Sum, grid_shape
from rille.terrain.base.lattice import Lattice, Range, Surface
from rille.terrain.base.means import HALO, REACH, MeanSurface, coefficient_lattice
from rille.terrain.base.sheet import BaseSheet
from rille.terrain.dem import relative_to_data
from rille.terrain.grid import Grid, Window, place_of
from rille.terrain.ground_metres import check_metres
from rille.terrain.raster import Raster, open_raster

Array = NDArray[np.float64]

FORM = "measured 1"  # changes when the same sheet and file give other heights


def measured(sheet: BaseSheet, scene_file: Path, progress: Progress) -> Ground:
    """The region of a DEM that a scene asks for.

    Without ``posting`` the scene's grid is the DEM's own, and its heights (``values`` "points") are the file's, less the height of W's
    origin: the whole number of metres nearest to the height in the middle.

    Raises
    ------
    InputRefused : for what :func:`open_raster` refuses, a projection whose metre is none on the ground there, a region beyond the file,
        missing heights that are not to be filled, or detail that has no room or no law.
    """
    if sheet.file is None:
        raise InputRefused("the base is a dem and needs `file`")
    path = expand(sheet.file, scene_file.parent)
    progress(f"reading {path.name}", 0.0)
    raster = open_raster(path, sheet.band)
    origin = _origin(sheet, raster)
    corner = raster.corner[0] - origin[0], raster.corner[1] - origin[1]
    grid = _grid(sheet, raster, corner)
    known = _needed(grid, raster, corner)
    middle = grid.x_west + (grid.n_cols - 1) * grid.posting_x / 2, grid.y_north - (grid.n_rows - 1) * grid.posting_y / 2
    check_metres(raster, origin[0] + middle[0], origin[1] + middle[1])
    as_means = (sheet.values or ("means" if sheet.detail else "points")) == "means"
    values, marks = cells(raster, *known, halo=HALO + REACH if as_means else 0, fill=sheet.fill_holes)
    zero = _zero(values, corner, raster, grid)
    file, beside = _source_file(path), [_sha256(other) for other in raster.beside]
    detail = None if sheet.detail is None else make_detail(sheet.detail, raster, grid, corner, known, means=as_means)
    taken = None if detail is None else detail.means
    key = f"{FORM} {file.sha256} {beside} {sheet!r} {corner!r} {raster.posting!r} {grid!r} {zero!r}"
    digest = hashlib.sha256(key.encode()).hexdigest()

    def smooth(means: Callable[[Range, Range], Array], zero: float) -> MeanSurface:
        coefficients = coefficient_lattice(means, raster.shape, known)
        return MeanSurface(coefficients=coefficients, corner=corner, posting=raster.posting, known=known, digest=digest, zero=zero)

    parts: list[Base] = []
    if as_means:
        parts.append(smooth(_difference(_present(values), taken), zero))
    else:
        parts.append(Surface(lattice=values, corner=corner, posting=raster.posting, digest=digest, zero=zero))
        if taken is not None:
            parts.append(smooth(_difference(None, taken), 0.0))
    if detail is not None:
        parts.append(detail.texture)
    return Ground(
        base=parts[0] if len(parts) == 1 else Sum(tuple(parts), digest),
        grid=grid,
        crs=raster.crs,
        map_origin=(*origin, zero),
        source=relative_to_data(path) + (f", band {raster.band} of {raster.bands}" if raster.bands > 1 else ""),
        sources=(file,),
        holes=None if marks is None else _Holes(Surface(lattice=marks, corner=corner, posting=raster.posting, digest="")),
        notes=(*_choice(sheet, raster), *(() if detail is None else detail.notes)),
    )


def _choice(sheet: BaseSheet, raster: Raster) -> tuple[str, ...]:
    """Says so where a file leaves a choice that the scene has not made."""
    silent = raster.bands > 1 and "band" not in sheet.model_fields_set
    return (f"'{raster.path.name}' has {raster.bands} bands, band {raster.band} taken; choose with `band`",) if silent else ()


def _present(values: Lattice) -> Callable[[Range, Range], Array]:
    """Values of a lattice; a missing one takes the nearest. (Missing values that matter are filled or refused before.)"""

    def means(rows: Range, cols: Range) -> Array:
        part = values.outer(np.arange(*rows), np.arange(*cols))
        holes = np.isnan(part)
        if holes.any():
            from scipy.ndimage import distance_transform_edt

            nearest = distance_transform_edt(holes, return_distances=False, return_indices=True)
            part = part[tuple(np.asarray(nearest))]
        return part

    return means


def _difference(
    means: Callable[[Range, Range], Array] | None, taken: Callable[[Range, Range], Array] | None
) -> Callable[[Range, Range], Array]:
    """means - taken; what is None is zero."""

    def difference(rows: Range, cols: Range) -> Array:
        left = np.zeros((rows[1] - rows[0], cols[1] - cols[0])) if means is None else means(rows, cols)
        return left if taken is None else left - taken(rows, cols)

    return difference


def _origin(sheet: BaseSheet, raster: Raster) -> tuple[float, float]:
    """Map coordinates of W's origin [m]."""
    if sheet.origin is not None:
        east, north = (place_of(v, "origin of the base") for v in sheet.origin)
        return east, north
    n_rows, n_cols = raster.shape
    return raster.corner[0] + raster.posting[0] * ((n_cols - 1) // 2), raster.corner[1] - raster.posting[1] * ((n_rows - 1) // 2)


def _grid(sheet: BaseSheet, raster: Raster, corner: tuple[float, float]) -> Grid:
    """The scene's grid; without a posting of its own it is part of the DEM's. corner : of the DEM in W [m]."""
    n_rows, n_cols = raster.shape
    posting_x, posting_y = raster.posting
    if sheet.size is None and sheet.posting is None:
        return Grid(n_rows=n_rows, n_cols=n_cols, posting_x=posting_x, posting_y=posting_y, x_west=corner[0], y_north=corner[1])
    width, height = (n_cols - 1) * posting_x, (n_rows - 1) * posting_y
    center = [corner[0] + width / 2, corner[1] - height / 2]
    if sheet.size is not None:
        width, height = (to_si(v, "length", "size of the base") for v in sheet.size)
        center = [place_of(v, "center of the base") for v in sheet.center]
    if sheet.posting is not None:
        posting_x = posting_y = to_si(sheet.posting, "length", "posting of the base")
    rows, cols = grid_shape(width, height, posting_x, posting_y)
    x_west, y_north = center[0] - (cols - 1) * posting_x / 2, center[1] + (rows - 1) * posting_y / 2
    if sheet.posting is None:  # keep the DEM's own values: move the region onto its grid
        x_west = corner[0] + round((x_west - corner[0]) / posting_x) * posting_x
        y_north = corner[1] - round((corner[1] - y_north) / posting_y) * posting_y
    return Grid(n_rows=rows, n_cols=cols, posting_x=posting_x, posting_y=posting_y, x_west=x_west, y_north=y_north)


def _needed(grid: Grid, raster: Raster, corner: tuple[float, float]) -> tuple[Range, Range]:
    """Rows and columns of the DEM, first and last + 1, that the grid's heights lie between."""
    slack = 1e-6
    west, east = ((x - corner[0]) / raster.posting[0] for x in (grid.x_west, grid.x_west + (grid.n_cols - 1) * grid.posting_x))
    north, south = ((corner[1] - y) / raster.posting[1] for y in (grid.y_north, grid.y_north - (grid.n_rows - 1) * grid.posting_y))
    n_rows, n_cols = raster.shape
    if west < -slack or north < -slack or east > n_cols - 1 + slack or south > n_rows - 1 + slack:
        raise InputRefused(
            f"the region reaches beyond the DEM, which spans x {corner[0]:.1f} to {corner[0] + (n_cols - 1) * raster.posting[0]:.1f} m "
            f"and y {corner[1] - (n_rows - 1) * raster.posting[1]:.1f} to {corner[1]:.1f} m around its origin; change center or size"
        )
    return _between(north, south, n_rows), _between(west, east, n_cols)


def _between(low: float, high: float, count: int) -> Range:
    """At least two indices of 0 .. count - 1 around fractional ones, the last + 1."""
    first = min(max(int(np.floor(low + 1e-6)), 0), count - 2)
    return first, max(min(int(np.ceil(high - 1e-6)) + 1, count), first + 2)


def _zero(values: Lattice, corner: tuple[float, float], raster: Raster, grid: Grid) -> float:
    """Height of W's origin [m]: a whole number, so that float32 heights of thousands of metres keep every bit."""
    row, col = (grid.n_rows - 1) // 2, (grid.n_cols - 1) // 2
    middle = Window(row0=row, row1=row + 1, col0=col, col1=col + 1)
    return float(np.round(Surface(lattice=values, corner=corner, posting=raster.posting, digest="").window(grid, middle)[0, 0]))


@dataclass(frozen=True, slots=True)
class _Holes:
    """Where a height rests on an interpolated one. marks : 1 where a value was missing."""

    marks: Surface

    def __call__(self, grid: Grid, window: Window) -> NDArray[np.bool_]:
        """True where the base had no value, of the window's shape."""
        return self.marks.window(grid, window) > 0.0


def _source_file(path: Path) -> SourceFile:
    return SourceFile(subject="base", file=path.name, sha256=_sha256(path), tool=f"rille {__version__}")


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
