"""Power spectrum of heights."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.terrain.statistics.holes import bridged
from rille.terrain.statistics.samples import Samples

Array = NDArray[np.float64]

PER_OCTAVE = 3  # bands of wave number


@dataclass(frozen=True, slots=True, kw_only=True)
class Spectrum:
    """Power density of heights over all directions. wave_number k (n,) [1/m], cycles; power (n,) [m^4]: its integral over the plane
    of wave vectors is the variance. exponent : of power ~ k^-exponent by least squares over its middle; 2 H + 2 for self-affine ground.
    """

    wave_number: Array
    power: Array
    exponent: float


def spectrum(samples: Samples, posting_x: float, posting_y: float) -> Spectrum:
    """Radially averaged spectrum: plane removed, Hann window in both directions, averaged in bands of a third of an octave.

    Long waves come from the thinned whole, short ones from windows at the DEM's posting. Thinning folds waves shorter than two of
    its steps back; the highest octave of the thinned whole is left to the windows.
    """
    parts = [_power(samples.coarse, posting_x * samples.stride, posting_y * samples.stride)]
    if samples.stride > 1:
        some = [_power(window, posting_x, posting_y) for window in samples.windows]
        k = np.concatenate([s[0] for s in some])
        limit = parts[0][0].max() / 2
        parts = [
            tuple(v[parts[0][0] <= limit] for v in parts[0]),
            (k[k > limit], np.concatenate([s[1] for s in some])[k > limit], np.concatenate([s[2] for s in some])[k > limit]),
        ]
    k, power, count = (np.concatenate([part[i] for part in parts]) for i in range(3))
    band = np.floor(np.log2(k) * PER_OCTAVE).astype(int)
    bands = np.unique(band)
    weight = np.array([count[band == b].sum() for b in bands])
    wave = np.array([np.exp(np.average(np.log(k[band == b]), weights=count[band == b])) for b in bands])
    mean = np.array([np.average(power[band == b], weights=count[band == b]) for b in bands])
    inner = (wave >= 4 * wave[0]) & (wave <= wave[-1] / 4) & (mean > 0)
    exponent = float("nan")
    if inner.sum() >= 3:
        exponent = -float(np.polyfit(np.log(wave[inner]), np.log(mean[inner]), 1, w=np.sqrt(weight[inner]))[0])
    return Spectrum(wave_number=wave, power=mean, exponent=exponent)


def _power(heights: Array, posting_x: float, posting_y: float) -> tuple[Array, Array, Array]:
    """Fine bands: wave number, mean power, number of wave vectors, each (n,)."""
    z = without_plane(bridged(heights)[0])
    n_rows, n_cols = z.shape
    taper = np.hanning(n_rows + 2)[1:-1, None] * np.hanning(n_cols + 2)[None, 1:-1]
    power = np.abs(np.fft.rfft2(z * taper)) ** 2 * posting_x * posting_y / np.sum(taper**2)
    k = np.hypot(np.fft.fftfreq(n_rows, posting_y)[:, None], np.fft.rfftfreq(n_cols, posting_x)[None, :])
    nyquist = 0.5 / max(posting_x, posting_y)
    used = (k > 0) & (k <= nyquist)
    used[:, 0] &= np.arange(n_rows) <= n_rows // 2  # this column holds both signs
    lowest = 1.0 / min(n_rows * posting_y, n_cols * posting_x)
    index = np.floor(np.log2(k[used] / lowest) * 12).astype(int)
    index -= index.min()
    count = np.bincount(index).astype(np.float64)
    full = count > 0
    log_k = np.bincount(index, np.log(k[used]))[full] / count[full]
    return np.exp(log_k), np.bincount(index, power[used])[full] / count[full], count[full]


def without_plane(heights: Array) -> Array:
    """Heights less the plane that fits them best."""
    n_rows, n_cols = heights.shape
    u, v = np.arange(n_cols) - (n_cols - 1) / 2, np.arange(n_rows) - (n_rows - 1) / 2
    mean = heights.mean()
    gx = (heights.mean(axis=0) - mean) @ u / (u @ u)
    gy = (heights.mean(axis=1) - mean) @ v / (v @ v)
    return heights - (mean + gx * u[None, :] + gy * v[:, None])
