"""Published laws of craters that several landforms share: fresh profile, depth, ejecta, rocks, diffusion."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RIM = 0.98  # distance over radius at which the wall meets the flank
REACH = 1.5  # distance over radius at which the flank ends

FASSETT_THOMSON = "C. I. Fassett & B. J. Thomson 2014, J. Geophys. Res. Planets 119, 2255, eq. 4"
STOPAR = "J. D. Stopar et al. 2017, Icarus 298, 34 (classes down to 40 m; 0.11 and 0.10 below are extrapolated, as in NASA synthterrain)"

# Smallest diameter [m] of each class and its depth over diameter.
_CLASSES = ((10.0, 0.11), (40.0, 0.13), (100.0, 0.15), (200.0, 0.17), (400.0, 0.21))


def fresh_profile(r: Array) -> Array:
    """z / D of a fresh simple crater at r = distance / radius: floor to 0.2, wall to 0.98, flank to 1.5 (Fassett & Thomson 2014 eq. 4)."""
    wall = -0.228809953 + 0.227533882 * r + 0.083116795 * r**2 - 0.039499407 * r**3
    flank = 0.188253307 - 0.187050452 * r + 0.01844746 * r**2 + 0.01505647 * r**3
    return np.select([r <= 0.2, r <= RIM, r < REACH], [-0.181, wall, np.maximum(flank, 0.0)], 0.0)


RIM_HEIGHT = float(fresh_profile(np.array(RIM)))  # over diameter: 0.0368
FRESH_DEPTH = RIM_HEIGHT - float(fresh_profile(np.array(0.0)))  # rim to floor over diameter: 0.2178


def shallow_profile(r: Array, depth_ratio: float) -> Array:
    """z / D of a crater whose floor lies ``depth_ratio`` D below its rim; rim and flank are those of :func:`fresh_profile`.

    Inside the rim, depth below the rim is scaled by depth_ratio / 0.2178.
    """
    fresh = fresh_profile(r)
    return fresh + np.where(r <= RIM, (1.0 - depth_ratio / FRESH_DEPTH) * (RIM_HEIGHT - fresh), 0.0)


def small_crater_depth(diameter: Any) -> Any:
    """Depth over diameter of a fresh crater, by classes of diameter [m]: small ones are shallower (Stopar et al. 2017).

    diameter : number or array (n,).
    """
    bounds, ratios = zip(*_CLASSES, strict=True)
    return np.asarray((0.10, *ratios))[np.searchsorted(bounds, diameter, side="right")]


def ejecta_thickness(radius: Any) -> Any:
    """Thickness [m] of ejecta at the rim of a crater of ``radius`` [m]: 0.14 R^0.74 (McGetchin et al. 1973); falls outside as r^-3."""
    return 0.14 * radius**0.74


def largest_block(diameter: Any) -> Any:
    """Diameter [m] of the largest block that a crater of ``diameter`` [m] throws out: 0.29 D^(2/3).

    Exponent and factor after Bart & Melosh 2007, quoted from memory: not checked against the paper.
    """
    return 0.29 * diameter ** (2.0 / 3.0)


def diffusivity(diameter: Any) -> Any:
    """Topographic diffusivity [m^2/s] that a crater of ``diameter`` [m] feels: 3.1 D_km^1.05 m^2 per Myr (Fassett et al. 2022).

    It grows with size, since larger craters average over larger impacts. Published values disagree: 5.5 m^2/Myr for any size
    (Fassett & Thomson 2014, craters of 0.8 to 5 km), 3.6 D_km^0.87 m^2/Myr.
    """
    return 3.1 * (diameter / 1000.0) ** 1.05 / MEGAYEAR


MEGAYEAR = 1e6 * 365.25 * 86400.0  # [s]

SHARPEST = 1e-4  # kappa t / R^2 below which diffusion takes less than 0.002 D off the rim: fresh and diffused are blended there
_NODES = ((0.0, 0.2, 48), (0.2, RIM, 192), (RIM, REACH, 128))  # from, to, Gauss-Legendre nodes: panels end where the profile breaks


@lru_cache(maxsize=8)
def _sources(fewer: int) -> tuple[Array, Array]:
    """Nodes s (n,) in r and the fresh profile times s and weight (n,): what diffuses. fewer : divides the number of nodes."""
    nodes, masses = [], []
    for low, high, count in _NODES:
        x, w = np.polynomial.legendre.leggauss(max(count // fewer, 12))
        s = low + (high - low) * (x + 1.0) / 2.0
        nodes.append(s)
        masses.append(fresh_profile(s) * s * w * (high - low) / 2.0)
    return np.concatenate(nodes), np.concatenate(masses)


def diffused_profile(r: Array, tau: float) -> Array:
    """z / D of a fresh crater after diffusion dz/dt = kappa laplacian z on a plane without end, r (n,) = distance / radius.

    Exact solution for radial symmetry, tau = kappa t / R^2 > 0:
    z(r) = 1 / (2 tau) integral of f(s) exp(-(r^2 + s^2) / (4 tau)) I0(r s / (2 tau)) s ds, f the fresh profile
    (heat kernel of the plane integrated around a circle; Carslaw & Jaeger 1959, section 10.3). The quadrature holds for tau >= 1e-5.
    """
    from scipy.special import i0e

    s, mass = _sources(2 ** int(np.clip(np.log2(np.sqrt(tau) / 0.02), 0, 4)))  # wide kernels need fewer nodes
    far = (r[:, None] - s) ** 2 / (4.0 * tau)
    near = far < 40.0  # beyond, the kernel is below rounding
    apart = np.zeros(far.shape)
    apart[near] = np.exp(-far[near]) * i0e((r[:, None] * s)[near] / (2.0 * tau))
    return apart @ mass / (2.0 * tau)
