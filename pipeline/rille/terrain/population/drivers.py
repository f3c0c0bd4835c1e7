"""Driver values of many landforms of one kind at once."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, nearest_names
from rille.model.quantity import to_si
from rille.terrain.landform import Driver, Landform

Array = NDArray[np.float64]
Range = tuple[float, float]


def ranges(landform: Landform, given: Mapping[str, object], subject: str) -> dict[str, Range]:
    """What a scene gives for drivers, as lowest and highest value in SI; equal for a fixed one.

    Raises
    ------
    InputRefused : for a driver that the landform does not have, that the law sets, a wrong unit, or a range turned round.
    """
    known = {driver.name: driver for driver in landform.drivers}
    found = {}
    for name, value in given.items():
        if name not in known:
            raise InputRefused(f"{subject} sets the driver '{name}', which {landform.name} does not have; {nearest_names(name, known)}")
        if name == "diameter":
            raise InputRefused(f"{subject} sets the driver 'diameter', which its law draws; use the key `diameter` of the population")
        found[name] = value_range(value, known[name].unit, f"driver '{name}' of {subject}")
    return found


def value_range(value: object, unit: str, what: str) -> Range:
    """``value`` or ``[lowest, highest]`` in SI.

    Raises
    ------
    InputRefused : for a wrong unit or count, or a range turned round.
    """
    if not isinstance(value, list):
        number = to_si(value, unit, what)
        return number, number
    if len(value) != 2:
        raise InputRefused(f"{what} has {len(value)} values; give one, or [lowest, highest]")
    low, high = (to_si(v, unit, what) for v in value)
    if low > high:
        raise InputRefused(f"{what} is [{low:g}, {high:g}]; write the lower value first")
    return low, high


def evaluate(landform: Landform, given: Mapping[str, Array], count: int, subject: str) -> dict[str, Array]:
    """All drivers, each (count,), in SI: given ones, links, defaults; the vector form of :meth:`Landform.values`.

    Raises
    ------
    InputRefused : for a driver that is missing or leaves its range.
    """
    values: dict[str, Array] = {}
    for driver in landform.drivers:
        if driver.name in given:
            values[driver.name] = np.asarray(given[driver.name], np.float64)
        elif driver.link is not None:
            values[driver.name] = _linked(driver, values, count)
        elif driver.default is not None:
            values[driver.name] = np.full(count, float(driver.default))
        else:
            raise InputRefused(f"{subject} needs the driver '{driver.name}' [{driver.unit}]: {driver.meaning}")
        _check(driver, values, driver.name in given, subject)
    return values


def _linked(driver: Driver, values: dict[str, Array], count: int) -> Array:
    """A link by arrays if it takes them and gives the numbers that it gives one by one; else one by one."""
    assert driver.link is not None

    def single(k: int) -> float:
        return float(driver.link({name: float(v[k]) for name, v in values.items()}))  # type: ignore[misc]

    if count == 0:
        return np.zeros(0)
    try:
        found = np.broadcast_to(np.asarray(driver.link(values), np.float64), (count,)).copy()  # type: ignore[arg-type]
        probes = range(0, count, max(count // 16, 1))
        if all(found[k] == single(k) or abs(found[k] - single(k)) <= 1e-12 * abs(found[k]) for k in probes):
            return found
    except (TypeError, ValueError, KeyError):
        pass
    return np.array([single(k) for k in range(count)])


def _check(driver: Driver, values: dict[str, Array], given: bool, subject: str) -> None:
    outside = ~((values[driver.name] >= driver.lower) & (values[driver.name] <= driver.upper))
    if not outside.any():
        return
    k = int(np.argmax(outside))
    value = values[driver.name][k]
    because = f" ({driver.reason})" if driver.reason else ""
    origin = "" if given else f" by its link {driver.law}" if driver.law else " by its link"
    size = values.get("diameter")
    where = f" where the diameter is {size[k]:.4g} m" if size is not None and driver.name != "diameter" else ""
    raise InputRefused(
        f"driver '{driver.name}' of {subject} is {value:.4g} {driver.unit}{origin}{where}; it must lie between {driver.lower:g} and "
        f"{driver.upper:g}{because}"
    )
