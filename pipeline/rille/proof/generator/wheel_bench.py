"""The single-wheel bench, quasi-static: the sinkage at which the soil carries the load, and what it does then.

A carriage travels at ``speed``, the wheel heads off its path by the slip angle. Along the heading v = speed cos(angle), across it
v_y = speed sin(angle); the rim turns at r w = v/(1 - s) for s >= 0, v (1 + s) for s < 0; at s = 1 the carriage stands and the rim has
``speed``.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rille.model import BenchWheel, Effect, Soil
from rille.proof.generator.soil_laws import Contacts, react, soil_laws
from rille.proof.generator.wheel_soil import PULL, SIDE, SINKAGE, TORQUE, rolling, sinkages

Array = NDArray[np.float64]
SOIL_NUMBERS = (
    "sinkage_exponent",
    "cohesive_modulus",
    "frictional_modulus",
    "cohesion",
    "friction_angle",
    "shear_modulus",
    "lateral_shear_modulus",
    "peak_angle_offset",
    "peak_angle_slip",
    "exit_sinkage_ratio",
    "damping",
    "reece_cohesive_modulus",
    "reece_frictional_modulus",
)
TOLERANCE = 1e-10  # of the quadrature
AT_REST = 1e-9  # [m/s] below which slip fades


def soil_columns(soils: Sequence[Soil], responses: Sequence[str], gravity: float) -> dict[str, Array]:
    """Numbers of soils as columns (n,) of ``Contacts``. responses : law of each. gravity : [m/s^2], of the soil's weight."""
    columns = {
        name: np.array([np.nan if (value := getattr(soil, name)) is None else float(value) for soil in soils]) for name in SOIL_NUMBERS
    }
    return columns | {
        "unit_weight": np.array([soil.density * gravity for soil in soils]),
        "one_zone": np.array([float(response == "bekker") for response in responses]),
        "reece": np.array([float(response == "reece") for response in responses]),
    }


def bench_points(
    wheel: BenchWheel,
    soil: Soil,
    law: str,
    *,
    load: ArrayLike,
    slip_ratio: ArrayLike,
    slip_angle: ArrayLike = 0.0,
    laws: Sequence[Effect] = (),
    gravity: float,
    speed: float = 0.05,
) -> dict[str, Array]:
    """Steady points of a wheel.

    Parameters
    ----------
    law : ``bekker``, ``bekker_wong`` or ``reece``. load [N], slip_ratio [-] in [-1, 1], slip_angle [rad] : scalars or (n,).
    laws : those on wheels and terrain act, in their steady state; the wheel stands at the origin of W. gravity : [m/s^2] of the soil's
    weight. speed : of the carriage [m/s].

    Returns
    -------
    sinkage [m], drawbar_pull [N] along the heading, side_force [N] with the sign of the slip angle, drive_torque [N m]: (n,) each, NaN
    where the soil does not carry the load before the wheel is buried to its axle.
    """
    load, slip_ratio, slip_angle = (
        np.ascontiguousarray(a, dtype=float) for a in np.broadcast_arrays(*np.atleast_1d(load, slip_ratio, slip_angle))
    )
    n = len(load)
    carriage = np.where(slip_ratio >= 1, 0.0, speed)
    travel = carriage * np.cos(slip_angle)
    ahead = speed * np.cos(slip_angle)
    with np.errstate(divide="ignore"):
        rim = np.where(slip_ratio >= 1, speed, np.where(slip_ratio >= 0, ahead / (1 - slip_ratio), ahead * (1 + slip_ratio)))
    direction, motion = rolling(travel, rim, carriage * np.sin(slip_angle), AT_REST)

    def contacts(sinkage: Array) -> Contacts:
        moving = motion.copy()
        moving[:, SINKAGE] = sinkage
        return Contacts(
            radius=np.full(n, wheel.radius),
            width=np.full(n, wheel.width),
            grouser_count=np.full(n, float(wheel.grouser_count)),
            grouser_height=np.full(n, wheel.grouser_height),
            place=np.zeros((n, 2)),
            angle=np.zeros(n),
            rim=rim,
            travel=travel,
            direction=direction,
            motion=moving,
            rut_depth=np.zeros(n),
            **soil_columns([soil] * n, [law] * n, gravity),
        )

    acting = soil_laws([replace(effect, target="*") for effect in laws], ["wheel"] * n)
    steady = contacts(np.zeros(n))
    for one in acting:
        one.steady(steady)
    for one in acting:
        one.before(steady)
    dug = -steady.motion[:, SINKAGE]
    z = dug + sinkages(steady.table(), steady.motion, load, wheel.radius - dug, TOLERANCE)
    reaction = react(acting, contacts(z), TOLERANCE).table
    reaction[np.isnan(z)] = np.nan
    return {
        "sinkage": z,
        "drawbar_pull": reaction[:, PULL],
        "side_force": np.sign(slip_angle) * reaction[:, SIDE],
        "drive_torque": reaction[:, TORQUE],
    }
