"""The wheel-soil laws as the papers print them, by adaptive quadrature: slow, and independent of the solver.

Wong & Reece 1967 (bekker_wong), Bekker 1969 (bekker: no stress behind the lowest point), Reece 1965 (reece).
"""

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from rille.model import Soil


def forces(law: str, soil: Soil, r: float, b: float, z: float, slip: float, unit_weight: float = 0.0) -> tuple[float, float, float]:
    """Normal load [N], drawbar pull [N] and drive torque [N m] of a wheel of radius r, width b [m] at a sinkage z [m] and a slip ratio."""
    entry = np.arccos(1 - z / r)
    if law == "bekker":
        peak = leave = 0.0
    else:
        leave = -np.arccos(1 - soil.exit_sinkage_ratio * z / r)
        peak = np.clip((soil.peak_angle_offset + soil.peak_angle_slip * slip) * entry, leave, entry)
    travel_ratio = 1 - slip if slip >= 0 else 1 / (1 + slip)  # v / (r w)
    tan_phi = np.tan(soil.friction_angle)

    def sigma(theta: float) -> float:
        read = theta if theta >= peak else entry - (theta - leave) / (peak - leave) * (entry - peak)
        depth = max(0.0, r * (np.cos(read) - np.cos(entry)))
        if law == "reece" and soil.reece_cohesive_modulus is not None and soil.reece_frictional_modulus is not None:
            modulus = soil.cohesion * soil.reece_cohesive_modulus + unit_weight * soil.reece_frictional_modulus * b
            return modulus * (depth / b) ** soil.sinkage_exponent
        return (soil.cohesive_modulus / b + soil.frictional_modulus) * depth**soil.sinkage_exponent

    def tau(theta: float) -> float:
        j = r * ((entry - theta) - travel_ratio * (np.sin(entry) - np.sin(theta)))
        return (soil.cohesion + sigma(theta) * tan_phi) * np.sign(j) * -np.expm1(-abs(j) / soil.shear_modulus)

    def over_contact(f) -> float:
        pieces = [(peak, entry)] + ([(leave, peak)] if peak > leave else [])
        return sum(quad(f, *piece, epsabs=1e-12, epsrel=1e-11, limit=400)[0] for piece in pieces)

    normal = r * b * over_contact(lambda t: sigma(t) * np.cos(t) + tau(t) * np.sin(t))
    pull = r * b * over_contact(lambda t: tau(t) * np.cos(t) - sigma(t) * np.sin(t))
    return normal, pull, r * r * b * over_contact(tau)


def under_load(law: str, soil: Soil, r: float, b: float, load: float, slip: float) -> tuple[float, float, float]:
    """Sinkage [m], drawbar pull [N] and drive torque [N m] at which the soil carries the load [N]."""
    z = brentq(lambda z: forces(law, soil, r, b, z, slip)[0] - load, 1e-9 * r, 0.9 * r, xtol=1e-14, rtol=1e-14)
    return z, *forces(law, soil, r, b, z, slip)[1:]
