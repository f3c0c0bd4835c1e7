"""Round forms found in heights: matched filters over position and scale."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.terrain.statistics.holes import bridged
from rille.terrain.statistics.pyramid import Part, level_shape, read_part, tiles
from rille.terrain.statistics.samples import Surface
from rille.terrain.statistics.spectrum import without_plane

Array = NDArray[np.float64]

HANDOVER = 8.0  # levels are searched for diameters of so many to twice so many values; the finest one for smaller ones, too
PER_OCTAVE = 5  # diameters searched in each octave
PEAK = 0.3  # radius around a peak in which there is no other of about its size, in diameters


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """What is looked for. profile : r = distance / radius (n,) -> height over diameter.

    window : radius [radii] of the ground that is compared. correlation : least correlation of ground and form in it, their planes
    removed. relief : least height of the form, as fraction of its own (a crater's depth of 0.2 diameters, times it).
    prominence : least ratio of the form's height to that of what else correlates with it on this ground (robust standard deviation).
    beyond : largest rise from the form's border to 1.4 radii, as share of the rise from its centre to its border: a fresh crater falls
    off there (-0.16), the inner part of a larger bowl goes on rising (about 1).
    """

    profile: Callable[[Array], Array]
    window: float
    correlation: float
    relief: float
    prominence: float
    beyond: float = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """Forms found, each array (n,). x, y [m] from the centre of the first height, y to the north; diameter [m];
    height [m] : highest less lowest of the mean heights of rings around it; correlation
    [0, 1]; searched : D -> area [m^2] in which forms of D were looked for; smallest, largest : [m] from which on and
    below which they were.
    """

    x: Array
    y: Array
    diameter: Array
    height: Array
    correlation: Array
    searched: Callable[[Array], Array]
    smallest: float
    largest: float
    said: str


def search(surface: Surface, posting_x: float, posting_y: float, shape: Shape, smallest: float, largest: float) -> Found:
    """Forms of a shape with diameters from ``smallest`` to ``largest`` [m].

    At each place and diameter the profile is fitted to the ground by least squares (amplitude A, plane free); it is a candidate
    where the correlation of what is left of both without their planes has a peak over place and diameter, and where A is
    large enough. Of candidates that lie in each other, of about one size, the best stays. Diameters are searched on the level
    where they measure HANDOVER to twice as many values, so work and memory are bounded; see :mod:`pyramid` for very large DEMs.
    """
    posting = max(posting_x, posting_y)
    rows: list[Array] = []
    areas: list[tuple[float, float, float]] = []  # smallest, largest diameter, area searched
    whole = True
    for level in range(0, 30):
        unit = posting * 2**level
        low, high = max(smallest, HANDOVER * unit if level else 0.0), min(largest, 2 * HANDOVER * unit)
        n_rows, n_cols = level_shape(surface, level)
        if low > largest or min(n_rows, n_cols) < 2 * HANDOVER:
            break
        if high <= low:
            continue
        margin = math.ceil(shape.window * HANDOVER * 1.3) + 2
        chosen = tiles(surface, level)
        count = 0
        for tile in chosen:
            part = read_part(surface, level, tile, margin)
            count += part.share
            rows.append(_search_part(part, posting_x * 2**level, posting_y * 2**level, shape, low, high, posting_x, posting_y))
        whole &= count == n_rows * n_cols
        areas.append((low, high, count * posting_x * posting_y * 4**level))
    table = np.concatenate(rows) if rows else np.zeros((0, 5))
    table = _best(table)

    def searched(diameter: Array) -> Array:
        area = np.zeros(np.shape(diameter))
        for low, high, value in areas:
            area = np.where((diameter >= low) & (diameter < high * (1 + 1e-12)), value, area)
        return area

    share = min((value for _, _, value in areas), default=0.0) / (surface.shape[0] * surface.shape[1] * posting_x * posting_y)
    return Found(
        x=table[:, 0],
        y=table[:, 1],
        diameter=table[:, 2],
        height=table[:, 3],
        correlation=table[:, 4],
        searched=searched,
        smallest=smallest,
        largest=max(smallest, largest),
        said="nowhere" if not areas else "everywhere" if whole else f"the smallest in {100 * share:.2g} % of the area",
    )


def _search_part(part: Part, px: float, py: float, shape: Shape, low: float, high: float, fine_x: float, fine_y: float) -> Array:
    """Rows x, y, diameter, amplitude, correlation (n, 5) of peaks within a part's inner tile."""
    from scipy.ndimage import maximum_filter

    filled, holes = bridged(part.heights)
    z = without_plane(filled)
    count = max(math.ceil(math.log2(high / low) * PER_OCTAVE), 1)
    # one more diameter on each side, so that a peak at the end of the range is told from a slope
    diameters = low * (high / low) ** (np.arange(-1, count + 2) / count)
    correlation, amplitude = _responses(z, px, py, shape, diameters)
    found = []
    for k in range(1, len(diameters) - 1):
        d = diameters[k]
        size = tuple(max(2 * math.floor(PEAK * d / p) + 1, 3) for p in (py, px))
        near = np.maximum(np.maximum(correlation[k - 1], correlation[k]), correlation[k + 1])
        peak = (correlation[k] >= maximum_filter(near, size=size)) & (correlation[k] > shape.correlation)
        peak &= amplitude[k] > shape.relief
        inner = np.zeros_like(peak)
        inner[part.inner] = True
        peak &= inner & ~holes
        if not peak.any():
            continue
        noise = 1.4826 * float(np.median(np.abs(amplitude[k])))
        i, j = np.nonzero(peak & (amplitude[k] > shape.prominence * noise))
        # parabola over log diameter through three correlations
        a, b, c = (correlation[m][i, j].astype(np.float64) for m in (k - 1, k, k + 1))
        shift = np.clip(0.5 * (a - c) / np.minimum(a - 2 * b + c, -1e-12), -0.5, 0.5)
        diameter = d * (diameters[k + 1] / d) ** shift
        keep = (diameter >= low) & (diameter < high)
        i, j, diameter = i[keep], j[keep], diameter[keep]
        rise, share = _rings(z, i, j, diameter / 2, px, py)
        alone = share < shape.beyond
        offset = (2**part.level - 1) / 2
        x = ((part.col0 + j) * 2**part.level + offset) * fine_x
        y = -((part.row0 + i) * 2**part.level + offset) * fine_y
        found.append(np.column_stack([x, y, diameter, rise, correlation[k][i, j]])[alone])
    return np.concatenate(found) if found else np.zeros((0, 5))


def _rings(z: Array, i: NDArray[np.intp], j: NDArray[np.intp], radius: Array, px: float, py: float) -> tuple[Array, Array]:
    """Highest less lowest mean height (n,) [m] of rings out to 1.2 radii, and the rise from 1 to 1.4 radii over that from 0 to 1."""
    from scipy.ndimage import map_coordinates

    around = np.arange(24) * (2 * np.pi / 24)
    shares = np.array([0.0, 0.15, 0.3, 0.85, 0.925, 1.0, 1.075, 1.15, 1.4])
    distance = radius[:, None, None] * shares[None, :, None]
    rows, cols = i[:, None, None] - distance * np.sin(around) / py, j[:, None, None] + distance * np.cos(around) / px
    mean = map_coordinates(z, [rows, cols], order=1, mode="nearest").mean(axis=2)
    inner, border = mean[:, :2].mean(axis=1), mean[:, 5]
    rise = border - inner
    sign = np.sign(rise)
    height = np.where(sign > 0, mean[:, 3:8].max(axis=1) - mean[:, :3].min(axis=1), mean[:, :3].max(axis=1) - mean[:, 3:8].min(axis=1))
    return height, (mean[:, 8] - border) / np.where(rise == 0, np.inf, rise)


def _responses(z: Array, px: float, py: float, shape: Shape, diameters: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Correlation and amplitude (diameters, n_rows, n_cols), float32."""
    import scipy.fft

    fft: Any = scipy.fft  # its stubs know its arrays only
    reach = math.ceil(shape.window * diameters[-1] / 2 / min(px, py))
    size = tuple(fft.next_fast_len(n + 2 * reach, real=True) for n in z.shape)
    padded = np.pad(z, reach, mode="edge")
    spectrum, squared = fft.rfft2(padded, size, workers=2), fft.rfft2(padded**2, size, workers=2)

    def correlate(of: Array, kernel: Array) -> Array:
        """Sum of ground times kernel around each height."""
        half_i, half_j = kernel.shape[0] // 2, kernel.shape[1] // 2
        full = fft.irfft2(of * np.conj(fft.rfft2(kernel, size, workers=2)), size, workers=2)
        return full[reach - half_i : reach - half_i + z.shape[0], reach - half_j : reach - half_j + z.shape[1]]

    correlation, amplitude = (np.empty((len(diameters), *z.shape), np.float32) for _ in range(2))
    for k, diameter in enumerate(diameters):
        radius = diameter / 2
        rows, cols = (math.ceil(shape.window * radius / p) for p in (py, px))
        y, x = np.meshgrid(-np.arange(-rows, rows + 1) * py, np.arange(-cols, cols + 1) * px, indexing="ij")
        r = np.hypot(x, y) / radius
        disc = (r <= shape.window).astype(np.float64)
        n, xx, yy = disc.sum(), float((disc * x**2).sum()), float((disc * y**2).sum())
        total = correlate(squared, disc) - correlate(spectrum, disc) ** 2 / n
        total -= correlate(spectrum, disc * x) ** 2 / xx + correlate(spectrum, disc * y) ** 2 / yy
        total = np.maximum(total, 1e-12 * np.median(np.abs(total)) + 1e-30)
        form = diameter * shape.profile(r) * disc
        form = (form - form.sum() / n) * disc
        power = float((form**2).sum())
        product = correlate(spectrum, form)
        correlation[k] = product / np.sqrt(power * total)
        amplitude[k] = product / power
    return correlation, amplitude


def _best(table: Array) -> Array:
    """Without those that lie in a better one of about their size: centres nearer than half the mean radius sum, sizes within 1.6."""
    from scipy.spatial import KDTree

    if len(table) == 0:
        return table
    table = table[np.argsort(-table[:, 4], kind="stable")]
    kept = np.ones(len(table), bool)
    tree = KDTree(table[:, :2])
    for k in range(len(table)):
        if not kept[k]:
            continue
        d = table[k, 2]
        for other in tree.query_ball_point(table[k, :2], 0.45 * d * 1.3):
            ratio = table[other, 2] / d
            apart = math.hypot(*(table[other, :2] - table[k, :2]))
            if other > k and 1 / 1.6 < ratio < 1.6 and apart < 0.45 * (d + table[other, 2]) / 2:
                kept[other] = False
    return table[kept]
