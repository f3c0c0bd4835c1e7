"""How many craters form in a time, and how long they last: lunar production, chronology, exposure ages."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GYR = 1e9 * 365.25 * 86400.0  # [s]

# Neukum, Ivanov & Hartmann 2001, table II: log10 of N(>= D) per km^2 in 1 Gyr over log10 of D in km.
COEFFICIENTS = (-3.0768, -3.557528, 0.781027, 1.021521, -0.156012, -0.444058, 0.019977, 0.08685, -0.005874, -0.006809, 8.25e-4, 5.54e-5)
SMALLEST, LARGEST = 10.0, 300e3  # [m] diameters that the polynomial was fitted to

WORN = 0.1  # relief of a crater at the end of its life, when it is lost in the ground around it


def chronology(age: Array | float) -> Array:
    """N(>= 1 km) per km^2 after ``age`` [Gyr]: 5.44e-14 (exp(6.93 T) - 1) + 8.38e-4 T (Neukum et al. 2001 eq. 5)."""
    age = np.asarray(age, np.float64)
    return 5.44e-14 * np.expm1(6.93 * age) + 8.38e-4 * age


def time_of(count: Array) -> Array:
    """Age [Gyr] whose :func:`chronology` is ``count``; inverted on a table to 1e-7 Gyr."""
    ages = np.linspace(0.0, 5.0, 20_001)
    return np.interp(count, chronology(ages), ages)


def production(diameter: Array, age: float) -> Array:
    """N(>= D) per m^2 of craters formed in ``age`` [s] on a surface that forgets none; D [m].

    Below 10 m and above 300 km, where the polynomial has no data, it continues with the slope that it has there.
    Source: Neukum et al. 2001 table II and eq. 5.
    """
    polynomial = np.polynomial.Polynomial(COEFFICIENTS)
    x = np.log10(np.asarray(diameter, np.float64) / 1000.0)
    inside = np.clip(x, np.log10(SMALLEST / 1000.0), np.log10(LARGEST / 1000.0))
    log_number = polynomial(inside) + polynomial.deriv()(inside) * (x - inside)
    return 1e-6 * 10.0**log_number * chronology(age / GYR) / chronology(1.0)


def density(number: Callable[[Array], Array], diameter: Array) -> Array:
    """-dN/dD [1/m^3] of a cumulative law, by the slope between D (1 -+ 1e-4)."""
    diameter = np.asarray(diameter, np.float64)
    step = 1e-4
    return (number(diameter * (1 - step)) - number(diameter * (1 + step))) / (2 * step * diameter)


def kept(number: Callable[[Array], Array], diameter: Array, age: float) -> Array:
    """Share of the craters produced in ``age`` [s] that a law still shows, at most 1."""
    produced = density(lambda d: production(d, age), diameter)
    return np.minimum(density(number, diameter) / produced, 1.0)


def exposure_age(number: Callable[[Array], Array], diameter: Array, u: Array, age: float) -> Array:
    """Ages [s] of craters of a surface of ``age`` [s] that shows the law ``number``; u uniform in [0, 1), shape (n,).

    Craters form at the rate dN/dD of production. If the surface shows only the share s of those formed, it shows the youngest: a
    crater is as old as u s of all production, G(t) = u s G(age), G the chronology (steady state: formation equals erasure).
    """
    return GYR * time_of(u * kept(number, diameter, age) * chronology(age / GYR))


def wear(number: Callable[[Array], Array], diameter: Array, u: Array, age: float, equilibrium: Callable[[Array], Array]) -> Array:
    """Share of a crater's life that has passed [0, 1]: production since it formed over production in a lifetime.

    The lifetime is that in which production fills the equilibrium at its diameter. Diffusion lowers a bowl as 1 / (1 + t / tau);
    with the relief ``WORN`` at the end of its life this is 1 / (1 + (1 / WORN - 1) wear).
    """
    produced = density(lambda d: production(d, age), diameter)
    life = density(equilibrium, diameter) / produced
    return np.minimum(u * kept(number, diameter, age) / life, 1.0)


def relief_of(worn: Array) -> Array:
    """Depth over fresh depth of craters of the given :func:`wear`."""
    return 1.0 / (1.0 + (1.0 / WORN - 1.0) * worn)
