"""All statistics of a DEM, with what its scene asked for and placed, as one JSON-able report."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, Population, Terrain
from rille.terrain.statistics.forms import find_craters, find_rocks
from rille.terrain.statistics.increments import QUANTILES, deviogram, slopes
from rille.terrain.statistics.matched import Found
from rille.terrain.statistics.samples import Samples, Surface, sample
from rille.terrain.statistics.size_frequency import census, counts, diameters_in, edges, poisson_interval
from rille.terrain.statistics.spectrum import spectrum

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

KINDS = {"craters": (("crater",), find_craters), "rocks": (("rock", "boulder"), find_rocks)}
FIELDS = ("rock_field",)  # landforms whose diameter is that of a field


def measure(
    name: str, surface: Surface, posting_x: float, posting_y: float, *, terrain: Terrain | None = None, progress: Progress | None = None
) -> dict[str, Any]:
    """Roughness, slopes, spectrum, craters and rocks of a DEM.

    Parameters
    ----------
    surface : heights [m], NaN where unknown, row 0 north. terrain : the scene it belongs to, whose populations are counted beside.

    Raises
    ------
    InputRefused : if it is too small, or holds no height.
    """
    say = progress or (lambda what, fraction: None)
    n_rows, n_cols = surface.shape[0], surface.shape[1]
    if min(n_rows, n_cols) < 64:
        raise InputRefused(f"'{name}' has {n_rows} x {n_cols} heights; statistics need at least 64 x 64")
    say("roughness", 0.0)
    samples = sample(surface)
    known = np.isfinite(samples.coarse)
    if not known.any():
        raise InputRefused(f"'{name}' has no height at all")
    report: dict[str, Any] = {
        "name": name,
        "rows": n_rows,
        "columns": n_cols,
        "posting_m": [posting_x, posting_y],
        "missing_share": float(1 - known.mean()),
        "roughness_from": samples.said,
        **roughness(samples, posting_x, posting_y),
    }
    say("spectrum", 0.2)
    power = spectrum(samples, posting_x, posting_y)
    report["spectrum"] = {
        "wave_number_per_m": power.wave_number.tolist(),
        "power_m4": power.power.tolist(),
        "exponent": _number(power.exponent),
    }
    box = None
    if terrain is not None:
        east = terrain.x_west + (n_cols - 1) * posting_x
        box = (terrain.x_west, terrain.y_north - (n_rows - 1) * posting_y, east, terrain.y_north)
        report["populations"] = [_population(p) for p in terrain.populations if "expected" in p.law]
    for step, (kind, (_, find)) in enumerate(KINDS.items()):
        say(f"searching {kind}", 0.3 + 0.35 * step)
        placed = None if terrain is None or box is None else _placed(terrain, kind, box)
        report[kind] = _forms(find(surface, posting_x, posting_y), placed, (n_rows - 1) * (n_cols - 1) * posting_x * posting_y)
    say("done", 1.0)
    return report


def roughness(samples: Samples, posting_x: float, posting_y: float) -> dict[str, Any]:
    """Deviogram and slopes, JSON-able."""
    rough = deviogram(samples, posting_x, posting_y)
    steep = slopes(samples, posting_x, posting_y)
    return {
        "deviogram": {
            "lag_m": rough.lag.tolist(),
            "nu_m": rough.nu.tolist(),
            "hurst": _number(rough.hurst),
            "hurst_second": _number(rough.hurst_second),
            "hurst_second_interval": [_number(v) for v in rough.second_interval],
            "fit_m": list(rough.fit),
        },
        "slopes": {"of": "profiles along rows and columns", **_by_baseline(steep.baseline, steep.quantiles, steep.rms)},
        "true_slopes": {
            "of": "the ground: magnitude of its gradient",
            **_by_baseline(steep.baseline, steep.true_quantiles, steep.true_rms),
        },
    }


def _by_baseline(baseline: Array, quantiles: Array, rms: Array) -> dict[str, Any]:
    """Distributions of slopes (k, 5), (k,) [rad] at baselines (k,) [m], in degrees."""
    degrees = np.degrees(quantiles)
    return {
        "baseline_m": baseline.tolist(),
        **{f"p{round(100 * q)}_deg": degrees[:, k].tolist() for k, q in enumerate(QUANTILES)},
        "rms_deg": np.degrees(rms).tolist(),
    }


def _population(population: Population) -> dict[str, Any]:
    counted = census(population)
    record = population.law
    return {
        "name": population.name,
        "landform": population.landform,
        "kind": kind_of(population.landform),
        "law": record["law"],
        "parameters": record["parameters"],
        "source": record["source"],
        "valid_m": record["valid"],
        "from_m": counted.borders[:-1].tolist(),
        "to_m": counted.borders[1:].tolist(),
        "asked": counted.asked.tolist(),
        "band": [counted.low.tolist(), counted.high.tolist()],
        "placed": counted.placed.tolist(),
        "inside_band": counted.inside,
        "on_ground": counted.on_ground,
        "curve": {"diameter_m": record["expected"]["diameter"], "number": record["expected"]["number"]},
    }


def kind_of(landform: str) -> str:
    """ "craters", "rocks" or "" by the name of a landform."""
    if landform in FIELDS:
        return ""
    return next((kind for kind, (words, _) in KINDS.items() if any(word in landform for word in words)), "")


def _placed(terrain: Terrain, kind: str, box: tuple[float, float, float, float]) -> Array:
    """Diameters [m] of all landforms of a kind with their centres on the grid, in populations and alone."""
    many = [diameters_in(p, box) for p in terrain.populations if kind_of(p.landform) == kind and "diameter" in p.drivers]
    single = [
        i.scale * i.drivers["diameter"]
        for i in terrain.landforms
        if kind_of(i.landform) == kind and "diameter" in i.drivers and box[0] <= i.x <= box[2] and box[1] <= i.y <= box[3]
    ]
    return np.concatenate([*many, np.array(single)])


def _forms(found: Found, placed: Array | None, area: float) -> dict[str, Any]:
    """Counts by diameter, and depth (of rocks: height) over diameter."""
    borders = _borders(found.diameter if placed is None else np.concatenate([found.diameter, placed]), (found.smallest, found.largest))
    number = counts(found.diameter, borders) if len(borders) else np.zeros(0, np.int64)
    low, high = poisson_interval(number)
    middle = np.sqrt(borders[:-1] * borders[1:])
    searched = np.where(borders[:-1] >= found.smallest * (1 - 1e-9), found.searched(middle), 0.0)
    ratio = found.height / found.diameter
    which = np.digitize(found.diameter, borders) - 1
    quartiles = [np.quantile(ratio[which == k], [0.25, 0.5, 0.75]).tolist() if (which == k).any() else None for k in range(len(middle))]
    return {
        "area_m2": area,
        "searched": found.said,
        "smallest_searched_m": found.smallest,
        "largest_searched_m": found.largest,
        "found_total": len(found.diameter),
        "placed_total": None if placed is None else int(((placed >= found.smallest) & (placed < found.largest)).sum()),
        "from_m": borders[:-1].tolist(),
        "to_m": borders[1:].tolist(),
        "searched_m2": searched.tolist(),
        "found": number.tolist(),
        "found_interval": [low.tolist(), high.tolist()],
        "placed": None if placed is None else (counts(placed, borders).tolist() if len(borders) else []),
        "depth_over_diameter": {"median": _number(float(np.median(ratio))) if len(ratio) else None, "quartiles": quartiles},
        "each": {"diameter_m": found.diameter.tolist(), "depth_over_diameter": ratio.tolist()},
    }


def _borders(diameter: Array, searched: tuple[float, float]) -> Array:
    """Root-two bins that hold all diameters; bins in which the search begins or ends are cut there: they are searched in part only."""
    if len(diameter) == 0:
        return np.zeros(0)
    borders = edges(float(diameter.min()), float(diameter.max()) * (1 + 1e-9))
    borders[0] = diameter.min()
    for end in searched:
        if borders[0] < end < borders[-1] and np.abs(borders / end - 1).min() > 1e-9:
            borders = np.sort(np.append(borders, end))
    return borders


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
