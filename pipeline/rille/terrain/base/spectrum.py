"""The power spectrum of measured ground: its power law, and the shortest wave that it holds in full."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RINGS = 4  # per octave
WHITE = 4.0  # exponent that flattens natural ground about
USUAL = 3.7, 0.2  # exponent of natural ground and its spread: H = 0.76 on maria, 0.95 on highlands (Rosenburg et al. 2011)
SCATTER = 0.3  # of log density of real ground about a power law, besides chance
DEEPEST = 1000.0  # below the law by this factor, a density is leakage and noise
CAUTION = 4.0  # misfit that a roll-off must save
LEAST = 4  # rings that a law is fitted to


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerSpectrum:
    """Power spectral density [m^4] (n,) at frequencies [1/m] (n,), ascending, from ``count`` (n,) modes each.

    Two-sided over the plane of frequencies: its integral over that plane is the variance.
    """

    frequency: Array
    density: Array
    count: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerLaw:
    """density = level (f / 1 m^-1)^-exponent [m^4], fitted to waves longer than ``resolution`` [m]."""

    level: float
    exponent: float
    resolution: float

    @property
    def hurst(self) -> float:
        """H = exponent / 2 - 1: the deviogram of such ground grows as L^H."""
        return self.exponent / 2 - 1

    def density(self, frequency: Array) -> Array:
        """[m^4] at frequencies > 0 [1/m]."""
        return self.level * frequency**-self.exponent


def power_spectrum(heights: Array, posting: tuple[float, float], *, means: bool = False) -> PowerSpectrum:
    """Radial power spectrum.

    A plane is taken off, a Hann window laid over; densities are gathered in rings, four to the octave, from the third mode to the
    lower Nyquist frequency. The two modes next to either axis are left out: seams of a mosaic, stripes and borders lie there. The value of
    a ring is its median over ln 2, the mean of exponential densities, which a few wild modes do not move. Within a ring, the fall of the
    spectrum is taken out by f^4.

    Parameters
    ----------
    heights : [m], (n_rows, n_cols), finite. posting : (x, y) [m].
    means : they are means over cells; then the density of the ground itself is given, by the response of averaging it (:func:`_averaged`).
    """
    n_rows, n_cols = heights.shape
    y, x = np.linspace(-1, 1, n_rows), np.linspace(-1, 1, n_cols)
    level = heights - heights.mean()
    slope_y, slope_x = (float(np.sum(level.mean(axis=other) * v) / np.sum(v**2)) for other, v in ((1, y), (0, x)))
    window = np.outer(np.hanning(n_rows + 2)[1:-1], np.hanning(n_cols + 2)[1:-1])
    modes = np.fft.rfft2((level - slope_y * y[:, None] - slope_x * x) * window)
    power = np.abs(modes) ** 2 * (posting[0] * posting[1] / np.sum(window**2))
    fx, fy = np.fft.rfftfreq(n_cols, posting[0])[None, :], np.fft.fftfreq(n_rows, posting[1])[:, None]
    f = np.hypot(fx, fy)
    if means:
        power /= _averaged(*(np.asarray(v, np.float64) for v in (fx * posting[0], fy * posting[1])))
    lowest = 3 / min(n_cols * posting[0], n_rows * posting[1])
    highest = 0.5 / max(posting)
    if highest <= lowest:
        raise ValueError(f"it has only {n_rows} x {n_cols} heights")
    edges = highest * 2.0 ** (-np.arange(int(np.log2(highest / lowest) * RINGS), -1, -1) / RINGS)
    used = (np.abs(fx) * n_cols * posting[0] > 2.5) & (np.abs(fy) * n_rows * posting[1] > 2.5) & (f > edges[0]) & (f <= edges[-1])
    power, f = power[used], f[used]
    ring = np.searchsorted(edges, f) - 1
    frequency, density, count = [], [], []
    for k in range(edges.size - 1):
        there = ring == k
        modes_there = int(np.count_nonzero(there))
        if modes_there >= 8:
            middle = float(np.sqrt(edges[k] * edges[k + 1]))
            frequency.append(middle)
            density.append(np.median(power[there] * (f[there] / middle) ** WHITE) / np.log(2))
            count.append(float(modes_there))
    return PowerSpectrum(frequency=np.array(frequency), density=np.array(density), count=np.array(count))


def _averaged(u: Array, v: Array) -> Array:
    """Power that means over cells show of natural ground, against that ground's, at u, v cycles per cell: sinc^2 along each axis, and
    what sampling folds from shorter waves of a spectrum f^-q, q = USUAL."""
    own = np.hypot(u, v)
    own[own == 0] = 1.0
    shown = np.zeros(own.shape)
    for m in (-1, 0, 1):
        for n in (-1, 0, 1):
            away = np.hypot(u + m, v + n)
            away[away == 0] = 1.0
            shown += (np.sinc(u + m) * np.sinc(v + n)) ** 2 * (own / away) ** USUAL[0]
    return shown


def fit_law(spectrum: PowerSpectrum, shortest: float, *, exponent: float | None = None, resolution: float | None = None) -> PowerLaw:
    """The power law of the waves that the ground holds in full, and the shortest of them.

    log density = a - q log f - k log(1 + (f / f0)^2 / k) is fitted for many f0 and k, and without roll-off (f0 infinite): a Gaussian blur
    has k infinite, interpolation of sparse points a small k. The resolution is the wave at which the roll-off halves the density.
    Few waves of real ground are resolved, and they scatter by ``SCATTER``; so q is drawn to what is usual of natural ground.

    Parameters
    ----------
    shortest : twice the posting [m], the resolution where there is no roll-off. exponent, resolution [m] : q, and the resolution, as given.

    Raises
    ------
    ValueError : if there are less than ``LEAST`` rings above the resolution, or no relief.
    """
    x, y = np.log(spectrum.frequency), np.log(np.maximum(spectrum.density, 1e-300))
    if x.size < LEAST:
        raise ValueError("it shows too few waves")
    if spectrum.density.max() <= 0:
        raise ValueError("it has no relief")
    flat = y + USUAL[0] * x
    gone = np.flatnonzero((flat < flat.max() - np.log(DEEPEST)) & (np.arange(x.size) > np.argmax(flat)))
    end = gone[0] if gone.size else x.size
    if resolution is not None:  # without a roll-off to be found, the law is a line through what is resolved
        end = int(np.searchsorted(x, -np.log(resolution), side="right"))
    x, y, weight = x[:end], y[:end], 1 / (1 / spectrum.count[:end] + SCATTER**2)
    if x.size < LEAST:
        raise ValueError("it shows too few waves above its resolution")
    usual, spread = USUAL if exponent is None else (exponent, 1e-6)
    root = np.append(np.sqrt(weight), 1 / spread)
    basis = np.vstack([np.column_stack([np.ones(x.size), -x]), [[0.0, 1.0]]]) * root[:, None]
    best, found = np.inf, PowerLaw(level=0.0, exponent=0.0, resolution=shortest)
    for half, sharpness in _roll_offs(x) if resolution is None else [(np.inf, 1.0)]:
        fall = _roll_off(x, half, sharpness)
        wanted = np.append(y - fall, usual) * root
        line = np.linalg.lstsq(basis, wanted, rcond=None)[0]
        misfit = float(np.sum((wanted - basis @ line) ** 2)) + (CAUTION if np.isfinite(half) else 0.0)
        if misfit < best:
            wave = resolution or max(float(np.exp(-half)), shortest)
            best, found = misfit, PowerLaw(level=float(np.exp(line[0])), exponent=float(line[1]), resolution=wave)
    return found


def _roll_offs(x: Array) -> list[tuple[float, float]]:
    """Roll-offs to be tried: log of the frequency that has lost half of its power, and k. The first is none."""
    halves = np.arange(x[LEAST - 1], x[-1], np.log(2) / 8)
    return [(np.inf, 1.0)] + [(float(half), k) for half in halves for k in (1.5, 2.0, 3.0, 5.0, np.inf)]


def _roll_off(x: Array, half: float, k: float) -> Array:
    """log of the power that is left at log frequencies x."""
    if half == np.inf:
        return np.zeros(x.shape)
    u = np.exp(2 * (x - half))
    return -np.log(2) * u if k == np.inf else -k * np.log1p(u * (2 ** (1 / k) - 1))
