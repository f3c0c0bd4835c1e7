"""A value on a sheet that may be a number, a quantity with a unit, or a formula of drivers."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from rille.model import InputRefused
from rille.model.quantity import to_si
from rille.terrain.own.formula import is_formula, parse_formula

Term = Callable[[Mapping[str, Any]], Any]


def term(value: float | int | str, kind: str, known: Iterable[str], what: str) -> Term:
    """A function of driver values [SI, numbers or arrays] for what stands on a sheet.

    Parameters
    ----------
    value : number [SI], quantity ("12 cm"), or formula ("0.2 * diameter"). kind : of quantity, as of :func:`rille.model.quantity.to_si`.
    known : drivers that it may use. what : subject of the error sentence.

    Raises
    ------
    InputRefused : for an unknown name in a formula or a wrong unit; when called, for a value that is not finite.
    """
    if isinstance(value, str) and is_formula(value):
        formula = parse_formula(value, known, what)

        def evaluated(drivers: Mapping[str, Any]) -> Any:
            result = formula(drivers)
            if not np.isfinite(result).all():
                stated = ", ".join(f"{n} = {np.ravel(drivers[n])[0]:g}" for n in sorted(formula.names))
                raise InputRefused(f'{what}, "{value}", is not finite for {stated or "any driver"}; change the formula or the ranges')
            return result

        return evaluated
    number = to_si(value, kind, what)
    return lambda drivers: number


def positive(inner: Term, what: str) -> Term:
    """The same, refused where it is not above zero."""

    def checked(drivers: Mapping[str, Any]) -> Any:
        value = inner(drivers)
        if not (np.asarray(value) > 0).all():
            raise InputRefused(f"{what} is {np.min(value):g}; it must be above 0, change the formula or the drivers")
        return value

    return checked
