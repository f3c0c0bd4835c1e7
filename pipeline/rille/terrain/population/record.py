"""What was asked for, and what is to be expected of it: the record that travels with a population."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.terrain.population.field import Extent, Field
from rille.terrain.population.laws import Law
from rille.terrain.population.sheet import PopulationSheet
from rille.terrain.population.sizes import KNOTS, Sizes

Array = NDArray[np.float64]

QUADRATURE = 200  # points along each side at which a density and zones are integrated


def record(sheet: PopulationSheet, law: Law, sizes: Sizes, reach: Array, field: Field) -> dict[str, Any]:
    """What was asked for, JSON-able."""
    inside, expected = _expected(sizes, reach, field, sheet.count)
    some = np.unique(np.linspace(0, KNOTS - 1, 65).astype(int))
    record: dict[str, Any] = {
        "law": law.name,
        "of": law.of,
        "parameters": law.parameters,
        "source": law.source,
        "valid": [law.valid[0], law.valid[1] if math.isfinite(law.valid[1]) else None],
        "diameter": [float(sizes.knots[0]), float(sizes.knots[-1])],
        "seed": sheet.seed,
        "count": sheet.count,
        "box": list(inside),
        "expected": {"diameter": sizes.knots[some].tolist(), "number": expected[some].tolist()},
    }
    for key in ("region", "exclude", "clear", "density", "drivers", "heading"):
        value = getattr(sheet, key)
        if value not in (None, [], {}) and (key != "clear" or sheet.exclude):
            record[key] = value.model_dump(exclude_none=True) if key == "density" else value
    return record


def _expected(sizes: Sizes, reach: Array, field: Field, count: int | None) -> tuple[Extent, Array]:
    """Box [m] in which centres are counted, and the expected number in it from each knot's diameter on.

    The box is the part of the extent in which forms are drawn. With a region, zones or a density the area that counts depends on
    the form's reach; it is summed over QUADRATURE^2 points, good to about 2e-3 of the box for borders that are not finer.
    """
    x0, y0, x1, y1 = (f(a, b) for f, a, b in zip((max, max, min, min), field.box, field.extent, strict=True))
    if x0 >= x1 or y0 >= y1:
        return (x0, y0, max(x0, x1), max(y0, y1)), np.zeros(KNOTS)
    steps = sizes.number[:-1] - sizes.number[1:]
    plain = field.region is None and field.density is None and not field.zones
    area = np.full(KNOTS, (x1 - x0) * (y1 - y0)) if plain else field.peak * _open_area((x0, y0, x1, y1), reach, field)
    if count is None:
        weighted = steps * (area[:-1] + area[1:]) / 2
    else:
        everywhere = area if field.box == (x0, y0, x1, y1) or plain else field.peak * _open_area(field.box, reach, field)
        weighted = steps * (area[:-1] + area[1:]) / 2
        weighted *= count / max(float((steps * (everywhere[:-1] + everywhere[1:]) / 2).sum()), 1e-300)
    return (x0, y0, x1, y1), np.concatenate([np.cumsum(weighted[::-1])[::-1], [0.0]])


def _open_area(inside: Extent, reach: Array, field: Field) -> Array:
    """Area [m^2] of a box in which forms of each reach stay, weighted by their density over the largest."""
    x0, y0, x1, y1 = inside
    u = (np.arange(QUADRATURE) + 0.5) / QUADRATURE
    x, y = (v.ravel() for v in np.meshgrid(x0 + u * (x1 - x0), y0 + u * (y1 - y0)))
    share = field.share(x, y)
    free = field.free(x, y)
    order = np.argsort(-free)
    summed = np.concatenate([[0.0], np.cumsum(share[order])])
    within = np.searchsorted(-free[order], -(reach if field.clear else np.zeros_like(reach)), side="left")
    return summed[within] * (x1 - x0) * (y1 - y0) / QUADRATURE**2
