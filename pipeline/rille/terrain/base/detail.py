"""Relief below the resolution of a measured base, without counting twice what the base holds.

Ground of the base's own power law is made, at the posting of the scene, and what a smooth surface of its means over the base's cells would
show is taken away from it. What is left has mean zero over every cell, so that the composed ground keeps the base's values; and as
the base is to its ground what that smooth surface is to the made one, both spectra join at the base's posting without gap or overlap:
with P the way from ground to the smooth surface of its means, the composition is P(real) + (1 - P)(made).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.model.quantity import to_si
from rille.terrain.base.cells import filled
from rille.terrain.base.lattice import Lattice, Lazy, Range, Surface
from rille.terrain.base.means import HALO, REACH
from rille.terrain.base.sheet import DetailSheet
from rille.terrain.base.spectrum import PowerLaw, PowerSpectrum, fit_law, power_spectrum
from rille.terrain.base.spline import weighted
from rille.terrain.base.synthesis import Spectrum, Synthesis, synthesise
from rille.terrain.grid import Grid
from rille.terrain.raster import Raster

Array = NDArray[np.float64]

SAMPLE = 1024  # cells across the part of a DEM that its spectrum is taken of
STRIP = 4_000_000  # heights in memory at once


@dataclass(frozen=True, slots=True, kw_only=True)
class Detail:
    """What is added to a base. texture : the made ground. means : what is to be taken off the means of the base's cells; None: nothing."""

    texture: Surface
    means: Callable[[Range, Range], Array] | None
    notes: tuple[str, ...]


def make_detail(
    sheet: DetailSheet, raster: Raster, grid: Grid, corner: tuple[float, float], known: tuple[Range, Range], *, means: bool
) -> Detail:
    """Detail for a scene's grid over a DEM.

    Parameters
    ----------
    corner : of the DEM's cell (0, 0) in W [m]. known : rows and columns of the DEM, first and last + 1, that the grid lies between.
    means : its values are means over cells, not heights of points.

    Raises
    ------
    InputRefused : if the grid is no finer than the DEM, or no law can be fitted.
    """
    cell, posting = max(raster.posting), grid.posting_x
    if grid.posting_y != posting or posting >= min(raster.posting):
        raise InputRefused(
            f"detail lies below the base's own posting of {min(raster.posting):g} m, and the posting of the scene is {posting:g} m; "
            "set a smaller `posting` in [base], or leave [base.detail] away"
        )
    law, spectrum = _law(sheet, raster, _sample(raster, known), means)
    density, longest = missing_spectrum(law, sheet.strength, spectrum) if sheet.fill else detail_spectrum(law, sheet.strength, cell)
    # indices of the texture count from the DEM's corner, so that it stays where it is when the region moves
    row0, col0 = round((corner[1] - grid.y_north) / posting), round((grid.x_west - corner[0]) / posting)
    start = (grid.y_north - corner[1]) / posting, (corner[0] - grid.x_west) / posting
    ratio = raster.posting[1] / posting, raster.posting[0] / posting
    margin = HALO + REACH + 1
    rows, cols = (
        (math.floor(s + (a - margin) * r) - 1, math.ceil(s + (b + margin) * r) + 2)
        for s, (a, b), r in zip(start, known, ratio, strict=True)
    )

    def make() -> Synthesis:
        moved = (rows[0] + row0, rows[1] + row0), (cols[0] + col0, cols[1] + col0)
        return Synthesis(synthesise(density, posting, *moved, longest, sheet.seed), rows, cols, row0, col0)

    lattice = Lazy(rows=rows, cols=cols, make=make)
    return Detail(
        texture=Surface(lattice=lattice, corner=(grid.x_west, grid.y_north), posting=(posting, posting), digest=""),
        means=None if sheet.fill else CellMeans(lattice=lattice, start=start, ratio=ratio),
        notes=_notes(sheet, law, density, cell),
    )


def _law(sheet: DetailSheet, raster: Raster, sample: Array, means: bool) -> tuple[PowerLaw, PowerSpectrum]:
    exponent = None if sheet.hurst is None else 2 * sheet.hurst + 2
    resolution = None if sheet.resolution is None else to_si(sheet.resolution, "length", "resolution of [base.detail]")
    shortest = 2 * max(raster.posting)
    if resolution is not None and resolution < shortest:
        raise InputRefused(
            f"the resolution of [base.detail] is {resolution:g} m; it must be at least {shortest:g} m, two postings of the base"
        )
    try:
        spectrum = power_spectrum(sample, raster.posting, means=means)
        law = fit_law(spectrum, shortest, exponent=exponent, resolution=resolution)
    except ValueError as error:
        raise InputRefused(
            f"no power law can be fitted to '{raster.path}' for [base.detail]: {error}; take another DEM, or no detail"
        ) from None
    if not 0 < law.hurst < 2:
        raise InputRefused(
            f"the spectrum of '{raster.path}' falls as f^-{law.exponent:.2f}, unlike any ground (2 to 6); give `hurst` in [base.detail]"
        )
    return law, spectrum


def _sample(raster: Raster, known: tuple[Range, Range]) -> Array:
    """Heights around the scene to take the spectrum of: up to ``SAMPLE`` squared, smaller where many are missing."""
    size = SAMPLE
    while True:
        (i0, i1), (j0, j1) = (
            (min(max((a + b - size) // 2, 0), max(n - size, 0)), min(max((a + b + size) // 2, size), n))
            for (a, b), n in zip(known, raster.shape, strict=True)
        )
        heights = raster.read((i0, i1), (j0, j1))
        holes = np.isnan(heights).mean()
        if holes == 0:
            return heights
        if holes < 0.1 or size <= 64:
            return filled(heights, raster.path)
        size //= 2


def _notes(sheet: DetailSheet, law: PowerLaw, density: Spectrum, cell: float) -> tuple[str, ...]:
    how = "given" if sheet.hurst is not None else "fitted"
    notes = [
        f"detail follows the power law f^-{law.exponent:.2f} (H = {law.hurst:.2f}, {how}) of the waves above {law.resolution:.3g} m, "
        f"which the base holds in full; its cells measure {cell:.3g} m"
    ]
    if sheet.fill:
        change = _change(density, cell)
        notes.append(f"power missing below {law.resolution:.3g} m is restored, which changes the base's own heights by {change:.2g} m RMS")
    elif law.resolution > 4 * cell:
        notes.append(
            f"between {2 * cell:.3g} and {law.resolution:.3g} m the base is smoother than its law, and is left so (fill = true restores it)"
        )
    return tuple(notes)


def _change(density: Spectrum, cell: float) -> float:
    """RMS of the means over cells [m] of ground of a given power: its integral with the cell's response, sinc^2 along each axis."""
    f = np.geomspace(1e-4, 2.0, 400)[:, None] / cell
    around = (np.arange(16) + 0.5) * (np.pi / 32)
    response = (np.sinc(f * cell * np.cos(around)) * np.sinc(f * cell * np.sin(around))) ** 2
    ring = density(f)[:, 0] * response.mean(axis=1) * 2 * np.pi * f[:, 0]
    return float(np.sqrt(np.trapezoid(ring, f[:, 0])))


@dataclass(frozen=True, slots=True, kw_only=True)
class CellMeans:
    """Means over a base's cells of the bilinear surface of a fine lattice, by exact integration.

    Cell (i, j) is centred at fractional row start[0] + i ratio[0] and column start[1] + j ratio[1] of the lattice, and measures
    ratio (rows, columns) of its cells.
    """

    lattice: Lattice
    start: tuple[float, float]
    ratio: tuple[float, float]

    def __call__(self, rows: Range, cols: Range) -> Array:
        """Means (n_rows, n_cols) of cells rows[0] <= i < rows[1] and cols[0] <= j < cols[1]."""
        means = np.empty((rows[1] - rows[0], cols[1] - cols[0]))
        first_j, over = _weights(np.arange(*cols), self.start[1], self.ratio[1])
        fine_cols = np.arange(first_j[0], first_j[-1] + len(over))
        height = max(1, int(STRIP / fine_cols.size / self.ratio[0]))
        for top in range(rows[0], rows[1], height):
            bottom = min(top + height, rows[1])
            first_i, down = _weights(np.arange(top, bottom), self.start[0], self.ratio[0])
            fine = self.lattice.outer(np.arange(first_i[0], first_i[-1] + len(down)), fine_cols)
            along = weighted([fine[first_i - first_i[0] + k] for k in range(len(down))], list(down[:, :, None]))
            means[top - rows[0] : bottom - rows[0]] = weighted([along[:, first_j - first_j[0] + k] for k in range(len(over))], list(over))
        return means


def detail_spectrum(law: PowerLaw, strength: float, cell: float) -> tuple[Spectrum, float]:
    """Power of the ground to be made, before its means are taken away, and its longest wave [m].

    It begins at 8 cells and is complete at 4: longer waves would only be taken away again.
    """

    def density(f: Array) -> Array:
        return strength**2 * law.density(f) * _onset(f, 8 * cell)

    return density, 8 * cell


def missing_spectrum(law: PowerLaw, strength: float, measured: PowerSpectrum) -> tuple[Spectrum, float]:
    """Power that a base lacks against its law, from its resolution to the shortest waves, and the longest wave [m].

    It begins an octave above the resolution. Beyond the base's shortest wave its own power is taken to fall as f^-12, as that of
    its smooth surface does.
    """
    last = float(np.log(measured.frequency[-1]))

    def density(f: Array) -> Array:
        x = np.log(np.where(np.isfinite(f), f, 1e300))
        own = np.exp(np.interp(x, np.log(measured.frequency), np.log(measured.density)) - 12 * np.maximum(x - last, 0.0))
        return strength**2 * np.maximum(law.density(f) - own, 0.0) * _onset(f, 2 * law.resolution)

    return density, 2 * law.resolution


def _onset(f: Array, longest: float) -> Array:
    """0 for waves above ``longest`` [m], 1 below half of it, a sine between."""
    return np.sin(np.pi / 2 * np.clip(np.log2(f * longest), 0.0, 1.0)) ** 2


def _weights(cells: NDArray[np.int_], start: float, ratio: float) -> tuple[NDArray[np.intp], Array]:
    """First fine point that a cell rests on, and the shares (k, n) of it and those that follow: integrals of hat functions."""
    low = np.asarray(start + (cells - 0.5) * ratio, np.float64)
    first = np.floor(low).astype(np.intp)
    points = np.asarray(first + np.arange(math.ceil(ratio) + 2)[:, None], np.float64)
    return first, (_hat_integral(low + ratio - points) - _hat_integral(low - points)) / ratio


def _hat_integral(u: Array) -> Array:
    """Integral of max(1 - |t|, 0) from -infinity to u."""
    u = np.clip(u, -1.0, 1.0)
    return np.where(u < 0, (u + 1) ** 2 / 2, 1 - (1 - u) ** 2 / 2)
