"""What contacts leave free: the twists that every contact between two rigid groups permits (Reuleaux 1876, Ball 1900).

A twist t = (omega, v) is a small motion about a reference point c: a point p moves by v + omega x (p - c). A cylinder in a hole allows
turning and sliding along one axis, a flat on a flat turning about the normal and sliding in the plane, a ball in a socket turning. Each
contact is the list of directions it forbids; what all of them together leave free is the null space of their rows.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Kind = Literal["locked", "hinge", "prismatic", "cylindrical", "spherical", "free"]

LENGTH = 0.01  # [m] makes turning and sliding comparable; axes that differ by FREE * LENGTH are one axis
FREE = 0.03  # singular values below this are motion that stays free


@dataclass(frozen=True, slots=True, kw_only=True)
class Mobility:
    """kind of motion that is left, its axis (3,) unit, and a point (3,) [m] of the axis (hinge, cylindrical, spherical)."""

    kind: Kind
    axis: Array
    point: Array


def cylinder_rows(point: Array, axis: Array, center: Array, slides: bool = True) -> Array:
    """Rows that a shaft in a hole forbids, shape (4, 6), or (5, 6) if it cannot slide."""
    u, w = _across(axis)
    rows = [_translation(point, d, center) for d in ((u, w) if slides else (u, w, axis))]
    return np.array([*rows, _rotation(u), _rotation(w)])


def face_rows(point: Array, normal: Array, center: Array) -> Array:
    """Rows that a flat on a flat forbids, shape (3, 6)."""
    u, w = _across(normal)
    return np.array([_translation(point, normal, center), _rotation(u), _rotation(w)])


def ball_rows(point: Array, center: Array) -> Array:
    """Rows that a ball in a socket forbids, shape (3, 6)."""
    return np.array([_translation(point, d, center) for d in np.eye(3)])


def mobility(rows: list[Array], center: Array) -> Mobility:
    """Classify what rows of contacts, all about ``center``, leave free."""
    none = Mobility(kind="free", axis=np.array([0.0, 0.0, 1.0]), point=center)
    if not rows:
        return none
    _, values, basis = np.linalg.svd(np.concatenate(rows), full_matrices=True)
    rank = int(np.count_nonzero(values > FREE))
    free: Array = np.asarray(basis[rank:], np.float64)
    if len(free) == 0:
        return Mobility(kind="locked", axis=none.axis, point=center)
    turns = free[:, :3]
    n_turns = int(np.count_nonzero(np.linalg.svd(turns, compute_uv=False) > FREE))
    if len(free) == 1 and n_turns == 0:
        return Mobility(kind="prismatic", axis=_unit(free[0, 3:]), point=center)
    if len(free) <= 2 and n_turns == 1:
        twist = free[np.argmax(np.linalg.norm(turns, axis=1))]
        omega, v = twist[:3] / LENGTH, twist[3:]
        point = center + np.cross(omega, v) / (omega @ omega)
        axis = _unit(omega)
        if len(free) == 1:
            pitch = abs(omega @ v) / (omega @ omega)
            return Mobility(kind="hinge" if pitch < FREE * LENGTH else "free", axis=axis, point=point)
        still = np.linalg.svd(turns.T)[2][-1]  # the combination of the two twists that does not turn
        slide = _unit(still @ free[:, 3:])
        return Mobility(kind="cylindrical" if abs(slide @ axis) > 1 - FREE else "free", axis=axis, point=point)
    if len(free) == 3 and n_turns == 3:
        # omega x (p - c) + v = 0 for all three: least squares for the fixed point.
        lever = np.concatenate([_cross_matrix(t[:3] / LENGTH) for t in free])
        offset, *_ = np.linalg.lstsq(lever, -free[:, 3:].ravel(), rcond=None)
        return Mobility(kind="spherical", axis=none.axis, point=center + offset)
    return none


def positive(axis: Array) -> Array:
    """The unit vector of an axis, turned so that its largest component is positive: an axis has no sense of its own."""
    axis = axis / np.linalg.norm(axis)
    return axis if axis[np.argmax(np.abs(axis) > np.abs(axis).max() - 1e-6)] > 0 else -axis


def _translation(point: Array, direction: Array, center: Array) -> Array:
    """No motion of ``point`` along a direction: d . v + ((p - c) x d) . omega = 0; omega is scaled by LENGTH."""
    return np.array([*(np.cross(point - center, direction) / LENGTH), *direction])


def _rotation(direction: Array) -> Array:
    return np.array([*direction, 0.0, 0.0, 0.0])


def _across(axis: Array) -> tuple[Array, Array]:
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    u = _unit(np.cross(axis, helper))
    return u, np.cross(axis, u)


def _cross_matrix(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _unit(v: Any) -> Array:
    return np.asarray(v / np.linalg.norm(v), np.float64)
