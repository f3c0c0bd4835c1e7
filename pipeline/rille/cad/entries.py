"""Entries of the sheet as SI values, and the refusals that they share."""

import fnmatch
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, nearest_names
from rille.model.quantity import to_si
from rille.model.rover import Vector

Matrix = NDArray[np.float64]
Number = float | int | str


def positive(value: Number, kind: str, what: str) -> float:
    """SI value above zero."""
    number = to_si(value, kind, what)
    if number <= 0:
        raise InputRefused(f"{what} is {number:g}; it must be above 0")
    return number


def optional_positive(value: Number | None, kind: str, what: str) -> float | None:
    """SI value above zero, or None where nothing is given."""
    return None if value is None else positive(value, kind, what)


def not_negative(value: Number, kind: str, what: str) -> float:
    """SI value of zero or more."""
    number = to_si(value, kind, what)
    if number < 0:
        raise InputRefused(f"{what} is {number:g}; it must not be below 0")
    return number


def triple_of(values: Sequence[Number], kind: str, what: str) -> Matrix:
    """Three SI values, shape (3,)."""
    return np.array([to_si(v, kind, what) for v in values])


def direction(values: Sequence[Number], what: str) -> Matrix:
    """Unit vector, shape (3,)."""
    axis = triple_of(values, "dimensionless", what)
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise InputRefused(f"{what} has no length; give a direction, for example [0, 1, 0]")
    return axis / length


def symmetric_matrix(values: Sequence[Number], what: str) -> Matrix:
    """Tensor (3, 3) of ixx, iyy, izz, ixy, ixz, iyz [kg m^2]."""
    xx, yy, zz, xy, xz, yz = (to_si(v, "inertia", what) for v in values)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def vector(values: Matrix) -> Vector:
    """Three plain numbers."""
    x, y, z = map(float, values)
    return x, y, z


def known(name: str, names: Iterable[str], what: str, subject: str) -> str:
    """The name, refused unless it is one of ``names``."""
    there = list(names)
    if name not in there:
        raise InputRefused(f"{subject} names the {what} '{name}', which is not on the sheet; {nearest_names(name, there)}")
    return name


def is_named(name: str, pattern: str) -> bool:
    """Whether a pattern names a part; names with brackets match themselves, too."""
    return name == pattern or fnmatch.fnmatchcase(name, pattern)


def unique(names: list[str], what: str) -> None:
    """Refuse a name that is given twice."""
    for name in names:
        if names.count(name) > 1:
            raise InputRefused(
                f"the sheet has {names.count(name)} {'bodies' if what == 'body' else what + 's'} called '{name}'; give each its own name"
            )
