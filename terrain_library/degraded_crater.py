"""Crater worn by small impacts: the fresh profile, diffused for its age."""

from functools import lru_cache

import numpy as np

from rille.terrain.crater_laws import (
    FASSETT_THOMSON,
    FRESH_DEPTH,
    MEGAYEAR,
    REACH,
    SHARPEST,
    STOPAR,
    diffused_profile,
    diffusivity,
    fresh_profile,
    small_crater_depth,
)
from rille.terrain.landform import Driver, Landform, Radial, smooth_step

WIDEST = 4.0  # largest diffusion length [radii] that is resolved; what is older has less relief than 0.002 of its diameter
SPREAD = 5.0  # the form ends this many diffusion lengths beyond the flank, where less than 0.0003 of its volume lies
LEAST = 0.1  # diffusion length [radii] up to which it ends at the same place, so that tables of the shape keep a fresh rim in place
FADE = 0.9  # share of the reach from which it fades to exactly zero
KNOTS = 768  # of the spline that stands for the integral


def diffusion_length(drivers):
    """sqrt(kappa t) / R [-]."""
    return np.sqrt(drivers["diffusivity"] * drivers["age"]) / (drivers["diameter"] / 2)


def state(drivers):
    """Square root of the diffusion length over the longest: fine where the form changes fast."""
    return np.sqrt(np.minimum(diffusion_length(drivers) / WIDEST, 1.0))


def grown(state):
    """Radius of the form over that of the crater."""
    return REACH + SPREAD * np.hypot(WIDEST * state**2, LEAST)


def semi_axes(drivers):
    """The form's radius [m]: the crater's flank, and how far soil has crept beyond it."""
    radius = drivers["diameter"] / 2 * grown(state(drivers))
    return radius, radius


def amplitude(drivers):
    """Diameter times the share of fresh depth; beyond the longest diffusion length it falls as the exact solution does, 1 / (kappa t)."""
    beyond = np.maximum(diffusion_length(drivers) / WIDEST, 1.0)
    return drivers["diameter"] * drivers["depth_ratio"] / FRESH_DEPTH / beyond**2


@lru_cache(maxsize=1024)
def _curve(state):
    """Cubic spline of the diffused profile over r / reach in [0, 1], exactly 0 at 1."""
    from scipy.interpolate import CubicSpline

    u = np.linspace(0.0, 1.0, KNOTS)
    r = u * grown(state)
    tau = (WIDEST * state**2) ** 2
    z = diffused_profile(r, max(tau, SHARPEST))
    if tau < SHARPEST:
        z += (1.0 - tau / SHARPEST) * (fresh_profile(r) - z)
    z *= smooth_step((1.0 - u) / (1.0 - FADE))
    return CubicSpline(u, z, bc_type="clamped")


def shape(r, state):
    """z / D of the fresh profile after diffusion; r over the form's radius."""
    r = np.asarray(r, np.float64)
    if state == 0.0:
        return fresh_profile(r * grown(0.0))
    return np.where(r < 1.0, _curve(float(state))(np.minimum(r, 1.0)), 0.0)


LANDFORM = Landform(
    name="degraded_crater",
    meaning="crater of some age: rim and floor smoothed by the rain of small impacts (topographic diffusion)",
    frame="origin at the centre, height zero at the ground before the impact",
    source=f"{FASSETT_THOMSON}, diffused exactly: dz/dt = kappa laplacian z",
    drivers=(
        Driver(
            name="diameter",
            unit="m",
            meaning="rim to rim when it was fresh",
            lower=0.1,
            upper=15000.0,
            reason="larger craters on the Moon are complex, not bowls",
            source="R. J. Pike 1974, Geophys. Res. Lett. 1, 291: simple craters end at 10 to 15 km",
        ),
        Driver(
            name="age",
            unit="s",
            meaning='time since the impact ("300 Myr")',
            lower=0.0,
            upper=4500.0 * MEGAYEAR,
            reason="the Moon is 4.5 Gyr old",
            source="age of the Moon",
        ),
        Driver(
            name="diffusivity",
            unit="m^2/s",
            meaning='how fast soil creeps ("5.5 m^2/Myr")',
            lower=0.0,
            upper=100.0 / MEGAYEAR,
            link=lambda drivers: diffusivity(drivers["diameter"]),
            law="3.1 (diameter / km)^1.05 m^2/Myr (Fassett et al. 2022)",
            reason="published values for craters up to 15 km stay below 60 m^2/Myr",
            source="Fassett et al. 2022; others: 5.5 m^2/Myr for any size (Fassett & Thomson 2014), 3.6 (D / km)^0.87 m^2/Myr",
        ),
        Driver(
            name="depth_ratio",
            unit="dimensionless",
            meaning="rim to floor over diameter when it was fresh; the whole profile is scaled to it",
            lower=0.01,
            upper=0.25,
            link=lambda drivers: small_crater_depth(drivers["diameter"]),
            law="0.21, 0.17, 0.15, 0.13 from 400, 200, 100, 40 m, 0.11 and 0.10 below (Stopar et al. 2017)",
            reason="at 0.25 a fresh wall stands at 33 deg, about as steep as loose soil can",
            source=STOPAR,
        ),
    ),
    radial=Radial(semi_axes=semi_axes, amplitude=amplitude, shape=shape, state=state),
    footprint=lambda drivers: tuple(float(a) for a in semi_axes(drivers)),
    example={"diameter": 60.0, "age": 100.0 * MEGAYEAR},
)
