"""Random ground of a given power spectrum on a lattice of any size, in bounded memory, a pure function of row and column.

The spectrum is divided among levels. Level l is a random field on a lattice M = 8^l times coarser than the ground's, periodic, made by
filtering white noise; its waves span 2 to 64 of its own postings, which is short against its period. Neighbouring levels share the power
of one octave by a cosine, so that their spectra add up to the whole: no gap, no bump. The finest level is taken as it is; coarser ones are
cubic B-splines whose coefficients are sharpened by the spline's own response, sinc^4 along each axis (Unser 1999).
A period shorter than the ground would show; two fields of periods without a common factor then share the power, so that
nothing repeats before the product of both.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.terrain.base.lattice import Indices, Range, contiguous
from rille.terrain.base.spline import cubic_weights, weighted

Array = NDArray[np.float64]
Spectrum = Callable[[Array], Array]
Spectrum2 = Callable[[Array, Array], Array]

STEP = 8  # of postings from level to level
PERIODS = 1024, 1215  # 2^10, 3^5 5
TOP = 64  # period of the coarsest level against the size of the ground
MOST = 1536  # values across the coarsest level, and
LEAST = 64  # of which it is a multiple
LONGEST = 128  # postings in the longest wave of the coarsest level, where the spectrum ends
MOST_JOINED = 4_000_000  # values of the coarse levels, joined
MARGIN = 24  # values after which a spline's coefficients have forgotten a border: 0.27^24 = 2e-14


@dataclass(frozen=True, slots=True)
class Level:
    """A periodic field on a lattice ``step`` times coarser: values where step is 1, else coefficients of a cubic B-spline."""

    values: Array
    step: int

    def add(self, rows: Indices, cols: Indices, values: Array) -> None:
        """Add its heights at all pairs of ascending rows (n,) and columns (m,) of the ground's lattice to ``values`` (n, m)."""
        n_rows, n_cols = self.values.shape
        if self.step == 1:
            for i, source_i in _runs(rows, n_rows):
                for j, source_j in _runs(cols, n_cols):
                    values[i, j] += self.values[source_i][:, source_j]
            return
        needed_i, needed_j = (np.unique(v[:, None] // self.step + np.arange(-1, 3)) for v in (rows, cols))
        across = np.zeros((cols.size, needed_i.size))
        self._interpolate(self.values[np.ix_(needed_i % n_rows, needed_j % n_cols)].T, needed_j, cols, across)
        self._interpolate(np.ascontiguousarray(across.T), needed_i, rows, values)

    def at(self, rows: Indices, cols: Indices) -> Array:
        """Heights at points of the ground's lattice."""
        n_rows, n_cols = self.values.shape
        if self.step == 1:
            return self.values[rows % n_rows, cols % n_cols]
        table = self._weights()
        i, j = rows // self.step - 1, cols // self.step - 1
        down, over = table[:, rows % self.step], table[:, cols % self.step]
        across = []
        for k in range(4):
            coefficients = [self.values[(i + k) % n_rows, (j + m) % n_cols] for m in range(4)]
            across.append(weighted(coefficients, list(over)))
        return weighted(across, list(down))

    def _interpolate(self, source: Array, needed: Indices, indices: Indices, target: Array) -> None:
        """Add the spline along axis 0 at ``indices`` to ``target``. source : coefficients of the coarse lattice's rows ``needed``."""
        table = self._weights()
        first = np.searchsorted(needed, indices // self.step - 1)
        if not contiguous(indices):
            weights = table[:, indices % self.step, None]
            target += weighted([source[first + k] for k in range(4)], list(weights))
            return
        for start in range(min(self.step, indices.size)):  # every STEP-th row has the same weights
            part = target[start :: self.step]
            begin, count = int(first[start]), part.shape[0]
            part += weighted([source[begin + k : begin + k + count] for k in range(4)], list(table[:, indices[start] % self.step]))

    def _weights(self) -> Array:
        """Weights (4, step) at u = 0, 1 / step ..."""
        return cubic_weights(np.arange(self.step) / self.step)


@dataclass(frozen=True, slots=True)
class Synthesis:
    """A lattice: the sum of levels on rows and cols. row0, col0 : added to indices, to move the ground over its field."""

    levels: tuple[Level, ...]
    rows: Range
    cols: Range
    row0: int = 0
    col0: int = 0

    def outer(self, rows: Indices, cols: Indices) -> Array:
        """Values at all pairs of ascending rows and columns."""
        values = np.zeros((rows.size, cols.size))
        for level in self.levels:
            level.add(rows + self.row0, cols + self.col0, values)
        return values

    def pairs(self, rows: Indices, cols: Indices) -> Array:
        """Values at points."""
        values = np.zeros(rows.shape)
        for level in self.levels:
            values += level.at(rows + self.row0, cols + self.col0)
        return values


def synthesise(
    spectrum: Spectrum, posting: float, rows: Range, cols: Range, longest: float, seed: int, *, folded: Spectrum2 | None = None
) -> tuple[Level, ...]:
    """Levels of a Gaussian field, the finest first; those above it are joined in one where that is small enough.

    Parameters
    ----------
    spectrum : power spectral density [m^4] at |f| [1/m] > 0, so that the variance is its integral over the plane of frequencies.
    posting : [m]. rows, cols : indices that will be asked for.
    longest : longest wave that the spectrum has [m], or infinity: then waves up to ``TOP`` times the size of the ground are made.
    With a finite one, the field does not depend on rows and cols.
    seed : of the random numbers.
    folded : density at (fx, fy) to be added at the finest level.
    """
    extent = rows[1] - rows[0], cols[1] - cols[0]
    top = 0
    while longest > LONGEST * posting * STEP**top and (longest < math.inf or max(extent) * TOP > MOST * STEP**top):
        top += 1
    levels: list[Level] = []
    for level in range(top + 1):
        step = STEP**level
        periods = _periods(extent, step, top=level == top, endless=longest == math.inf)
        for which, period in enumerate(periods):
            noise = np.random.default_rng((seed, level, which)).standard_normal(period)
            fx, fy = np.fft.rfftfreq(period[1], posting * step)[None, :], np.fft.fftfreq(period[0], posting * step)[:, None]
            f = np.hypot(fx, fy)
            f[0, 0] = np.inf
            density = spectrum(f) if folded is None or level else spectrum(f) + folded(fx, fy)
            density *= _share(f, posting, level, top) / len(periods)
            density[0, 0] = 0.0
            response = 1.0 if level == 0 else (np.sinc(fx * posting * step) * np.sinc(fy * posting * step)) ** 4
            filtered = np.fft.rfft2(noise) * (np.sqrt(density) / (posting * step * response))
            levels.append(Level(np.fft.irfft2(filtered, period), step))
    return _joined(levels, rows, cols)


def _periods(extent: tuple[int, int], step: int, *, top: bool, endless: bool) -> list[tuple[int, int]]:
    """Rows and columns of the fields that make a level: one where it does not repeat within the ground, otherwise two."""
    if endless and top:
        rows, cols = (LEAST * math.ceil((n * TOP // step + 4) / LEAST) for n in extent)
        return [(rows, cols)]
    single = endless and max(extent) // step + 4 <= PERIODS[0]
    return [(period, period) for period in PERIODS[: 1 if single else 2]]


def _share(f: Array, posting: float, level: int, top: int) -> Array:
    """Part of the power at frequencies f [1/m] that a level carries; those of all levels sum to 1."""
    share = _long(f, posting * STEP**level) if level else np.ones(f.shape)
    return share if level == top else share * (1.0 - _long(f, posting * STEP ** (level + 1)))


def _long(f: Array, posting: float) -> Array:
    """1 for waves above 8 postings, 0 below 4, a cosine between."""
    return np.cos(np.pi / 2 * np.clip(np.log2(f * 8 * posting), 0.0, 1.0)) ** 2


def _joined(levels: list[Level], rows: Range, cols: Range) -> tuple[Level, ...]:
    """The same field with the coarse levels summed into the finest of them that is small enough on the ground's own rows and columns.

    A spline of a coarse lattice is one of the finer lattice, too; its coefficients there follow from its values (spline filter).
    """
    from scipy.ndimage import spline_filter

    for step in sorted({level.step for level in levels if level.step > 1}):
        (i0, i1), (j0, j1) = ((first // step - 1, (last - 1) // step + 3) for first, last in (rows, cols))
        if (i1 - i0) * (j1 - j0) > MOST_JOINED:
            continue
        i, j = np.arange(i0 - MARGIN, i1 + MARGIN), np.arange(j0 - MARGIN, j1 + MARGIN)
        values = np.zeros((i.size, j.size))
        for level in levels:
            if level.step > step:
                Level(level.values, level.step // step).add(i, j, values)
        values = np.asarray(spline_filter(values, order=3, mode="mirror"))
        for level in levels:
            if level.step == step:
                Level(level.values, 1).add(i, j, values)
        values = values[MARGIN:-MARGIN, MARGIN:-MARGIN]
        whole = np.roll(values, (i0 % values.shape[0], j0 % values.shape[1]), (0, 1))
        return (*(level for level in levels if level.step < step), Level(whole, step))
    return tuple(levels)


def _runs(indices: Indices, period: int) -> Iterator[tuple[slice, slice | Indices]]:
    """Where indices go, and where they come from in a period: runs that do not cross its border, or all at once if they have gaps."""
    if not contiguous(indices):
        yield slice(None), indices % period
        return
    start, first = 0, int(indices[0])
    while start < indices.size:
        source = (first + start) % period
        length = min(indices.size - start, period - source)
        yield slice(start, start + length), slice(source, source + length)
        start += length
