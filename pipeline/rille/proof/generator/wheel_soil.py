"""Stresses under a rigid wheel on soft soil, integrated by adaptive quadrature with error control.

Angles from the downward vertical, positive towards the direction of travel:

    theta_f = acos(1 - z/r),  theta_r = -acos(1 - lambda z/r),  theta_m = (a0 + a1 s) theta_f, kept inside [theta_r, theta_f]
    sigma(theta) = p(r (cos theta - cos theta_f)) in front of theta_m; behind it p is read at the angle that theta is the image of,
    theta_e = theta_f - (theta - theta_r)/(theta_m - theta_r) (theta_f - theta_m);  bekker: theta_m = theta_r = 0
    j_x = r [(theta_f - theta) - kappa (sin theta_f - sin theta)],  kappa = v/(r w);  j_y = r (theta_f - theta) |v_y|/(r w)
    |tau| = (c + sigma tan phi) (1 - exp(-|e|)),  e = (j_x/K, j_y/k_y), along e
    N = r b Int(sigma cos + tau_x sin),  D = r b Int(tau_x cos - sigma sin),  F_y = r b Int tau_y,  T = r^2 b Int tau_x

Pressure p(z) = k z^n, k = kc/b + kphi (Bekker 1956) or (c kc' + gamma b kphi')/b^n (Reece 1965). Packed soil (Wong 2008, ch. 2.4.2) follows
k_u (z - z_e) up to the depth z_u that it was packed to, z_e = z_u - p(z_u)/k_u. Sources: Wong & Reece 1967, J. Terramechanics 4, part I;
Janosi & Hanamoto 1961; quadrature: QUADPACK's pair of 7 and 15 points (Piessens et al. 1983) on halved intervals.
"""

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Columns of a table of wheels on soils: [m, m, Pa/m^n, -, Pa, -, m, m, -, -, -, m, Pa/m, 1: one zone]
RADIUS, WIDTH, MODULUS, EXPONENT, COHESION, TAN_PHI, SHEAR, LATERAL_SHEAR, PEAK, PEAK_SLIP, EXIT, PACKED, PACKED_STIFFNESS, ONE_ZONE = (
    range(14)
)
# Columns of a table of motions: [m, -, -, -]
SINKAGE, SLIP, TRAVEL, LATERAL = range(4)
# Columns of a table of reactions: [N, N, N, N m, N m, rad, rad, rad]. ROLLING_TORQUE: T of the same normal stresses at zero slip (kappa =
# 1), of a wheel that drifts as fast
LOAD, PULL, SIDE, TORQUE, ROLLING_TORQUE, ENTRY_ANGLE, PEAK_ANGLE, EXIT_ANGLE = range(8)

_NODES = np.array(
    [
        0.9914553711208126,
        0.9491079123427585,
        0.8648644233597691,
        0.7415311855993944,
        0.5860872354676911,
        0.4058451513773972,
        0.2077849550078985,
        0.0,
    ]
)
_KRONROD = np.array(
    [
        0.0229353220105292,
        0.0630920926299786,
        0.1047900103222502,
        0.1406532597155259,
        0.1690047266392679,
        0.1903505780647854,
        0.2044329400752989,
        0.2094821410847278,
    ]
)
_GAUSS = np.array([0.1294849661688697, 0.2797053914892767, 0.3818300505051189, 0.4179591836734694])  # of every second node
_MOST_HALVINGS = 24
_HALVES = 0.5 * np.pi

jit: Any = numba.njit(cache=True, error_model="numpy")


@jit
def _pressure(depth: float, wheel: Array, floor: float, stiffness: float) -> float:
    """[Pa] at a depth [m] below the floor of the rut (of virgin soil: its surface, ``floor`` = 0)."""
    if depth <= 0.0:
        return 0.0
    if depth + floor < wheel[PACKED]:
        return stiffness * depth
    return wheel[MODULUS] * (depth + floor) ** wheel[EXPONENT]


@jit
def _stresses(theta: float, front: float, entry: float, wheel: Array, motion: Array, floor: float, stiffness: float, out: Array) -> None:
    """Integrands of N, D, F_y, T, T_0 [Pa] at theta; ``front``: where in the front zone its normal stress is read."""
    radius = wheel[RADIUS]
    depth = 2.0 * radius * np.sin(0.5 * (entry + front)) * np.sin(0.5 * (entry - front))
    sigma = _pressure(depth, wheel, floor, stiffness)
    sine, cosine = np.sin(theta), np.cos(theta)
    rolled, travelled = entry - theta, np.sin(entry) - sine
    x, x_0 = radius / wheel[SHEAR] * (rolled - motion[TRAVEL] * travelled), radius / wheel[SHEAR] * (rolled - travelled)
    y = radius / wheel[LATERAL_SHEAR] * rolled * motion[LATERAL]
    y_0 = y / max(motion[TRAVEL], 1.0)
    strength = wheel[COHESION] + sigma * wheel[TAN_PHI]
    size, size_0 = np.hypot(x, y), np.hypot(x_0, y_0)
    per_size = -strength * np.expm1(-size) / size if size > 0.0 else strength
    per_size_0 = -strength * np.expm1(-size_0) / size_0 if size_0 > 0.0 else strength
    out[0] = sigma * cosine + per_size * x * sine
    out[1] = per_size * x * cosine - sigma * sine
    out[2] = per_size * y
    out[3] = per_size * x
    out[4] = per_size_0 * x_0


@jit
def _zone(
    end: float, peak: float, entry: float, wheel: Array, motion: Array, floor: float, stiffness: float, tolerance: float, total: Array
) -> None:
    """Adds the integrals from ``end`` of the contact to ``peak`` to ``total`` (5,).

    theta = end + (peak - end) sin^2(pi x/2), x in [0, 1]: the root-like rise of the stress at the end becomes smooth. Halves of [0, 1] are
    halved again until both rules agree to ``tolerance`` of the normal stresses, or ``_MOST_HALVINGS`` times.
    """
    lows, highs, halvings = np.empty(2 * _MOST_HALVINGS), np.empty(2 * _MOST_HALVINGS), np.empty(2 * _MOST_HALVINGS)
    lows[0], highs[0], halvings[0] = 0.0, 1.0, 0.0
    waiting = 1
    value, fine, coarse = np.empty(5), np.empty(5), np.empty(5)
    while waiting > 0:
        waiting -= 1
        low, high, depth = lows[waiting], highs[waiting], halvings[waiting]
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        fine[:] = 0.0
        coarse[:] = 0.0
        for k in range(15):
            node = k if k < 8 else 14 - k
            x = middle + half * (_NODES[node] if k < 8 else -_NODES[node])
            share = np.sin(_HALVES * x) ** 2
            jacobian = abs(peak - end) * _HALVES * np.sin(np.pi * x)
            theta = end + (peak - end) * share
            front = entry + (peak - entry) * share
            _stresses(theta, front, entry, wheel, motion, floor, stiffness, value)
            for i in range(5):
                fine[i] += half * _KRONROD[node] * jacobian * value[i]
                if node % 2 == 1:
                    coarse[i] += half * _GAUSS[node // 2] * jacobian * value[i]
        worst, size = 0.0, 0.0
        for i in range(5):
            worst = max(worst, abs(fine[i] - coarse[i]))
            size = max(size, abs(total[i] + fine[i]))
        if worst <= tolerance * size or depth >= _MOST_HALVINGS:
            for i in range(5):
                total[i] += fine[i]
            continue
        for side in range(2):
            lows[waiting], highs[waiting] = (low, middle) if side == 0 else (middle, high)
            halvings[waiting] = depth + 1.0
            waiting += 1


@jit
def _react(wheel: Array, motion: Array, tolerance: float, out: Array) -> None:
    """One row of ``reactions``."""
    out[:] = 0.0
    radius, sinkage, exit_ratio = wheel[RADIUS], motion[SINKAGE], wheel[EXIT]
    floor, stiffness = 0.0, 0.0
    if wheel[PACKED] > 0.0:
        packed = wheel[MODULUS] * wheel[PACKED] ** wheel[EXPONENT]
        stiffness = max(wheel[PACKED_STIFFNESS], packed / wheel[PACKED])
        floor = wheel[PACKED] - packed / stiffness
        sinkage -= floor
        if sinkage > 0.0:
            exit_ratio = max(exit_ratio, min(1.0, packed / (stiffness * sinkage)))
    if sinkage <= 0.0:
        return
    ratio = min(sinkage / radius, 1.0)
    entry = 2.0 * np.arcsin(np.sqrt(0.5 * ratio))
    leave, peak = 0.0, 0.0
    if wheel[ONE_ZONE] == 0.0:
        leave = -2.0 * np.arcsin(np.sqrt(0.5 * min(exit_ratio * ratio, 2.0)))
        peak = min(max((wheel[PEAK] + wheel[PEAK_SLIP] * motion[SLIP]) * entry, leave), entry)
    total = np.zeros(5)
    if peak < entry:
        _zone(entry, peak, entry, wheel, motion, floor, stiffness, tolerance, total)
    if peak > leave:
        _zone(leave, peak, entry, wheel, motion, floor, stiffness, tolerance, total)
    area = radius * wheel[WIDTH]
    out[LOAD], out[PULL], out[SIDE] = area * total[0], area * total[1], area * total[2]
    out[TORQUE], out[ROLLING_TORQUE] = area * radius * total[3], area * radius * total[4]
    out[ENTRY_ANGLE], out[PEAK_ANGLE], out[EXIT_ANGLE] = entry, peak, leave


@jit
def reactions(wheels: Array, motions: Array, tolerance: float = 1e-7) -> Array:
    """Reactions of the soil, (n, 8), see ``LOAD`` ... ``EXIT_ANGLE``, in the direction of travel.

    wheels : (n, 14), see ``RADIUS`` ... ``ONE_ZONE``. motions : (n, 4), see ``SINKAGE`` ... ``LATERAL``. tolerance : between the two
    rules, of the largest integral; the finer rule errs by far less.
    """
    result = np.empty((len(wheels), 8))
    for k in range(len(wheels)):
        _react(wheels[k], motions[k], tolerance, result[k])
    return result


@jit
def sinkages(wheels: Array, motions: Array, loads: Array, deepest: Array, tolerance: float = 1e-9) -> Array:
    """Sinkages (n,) [m] at which N(z) = load, by bisection in (0, deepest); NaN where the soil does not carry the load until there."""
    result = np.empty(len(wheels))
    out = np.empty(8)
    for k in range(len(wheels)):
        motion = motions[k].copy()
        low, high = 0.0, deepest[k]
        motion[SINKAGE] = high
        _react(wheels[k], motion, tolerance, out)
        if not out[LOAD] >= loads[k]:
            result[k] = np.nan
            continue
        while high - low > 1e-13 * high:
            middle = 0.5 * (low + high)
            if middle <= low or middle >= high:
                break
            motion[SINKAGE] = middle
            _react(wheels[k], motion, tolerance, out)
            if out[LOAD] < loads[k]:
                low = middle
            else:
                high = middle
        result[k] = 0.5 * (low + high)
    return result


@jit
def rolling(travel: Array, rim: Array, lateral: Array, floor: float) -> tuple[Array, Array]:
    """Directions of travel (n,), 1 or -1, and motions (n, 4) but for the sinkage, of wheels.

    Slip ratio s = 1 - v/(r w) driven, (r w)/v - 1 braked; kappa = v/(r w). Near rest speeds count as the floor, so that slip vanishes with
    them. travel : v along the heading, rim : r w, lateral : v_y, floor : [m/s].
    """
    most = 1e3  # of the ratios: shear is mobilised fully long before
    direction, motion = np.empty(len(travel)), np.zeros((len(travel), 4))
    for k in range(len(travel)):
        v, u = travel[k], rim[k]
        driven = abs(u) >= abs(v)
        direction[k] = 1.0 if (u if driven else v) >= 0.0 else -1.0
        speed = max(abs(u), abs(v), floor)
        s = direction[k] * (u - v) / speed
        kappa = 1.0 - s if driven else 1.0 / max(1.0 + s, 1.0 / most)
        motion[k, SLIP] = min(max(s, -1.0), 1.0)
        motion[k, TRAVEL] = kappa
        motion[k, LATERAL] = min(abs(lateral[k]) / speed, most) * (1.0 if driven else kappa)
    return direction, motion
