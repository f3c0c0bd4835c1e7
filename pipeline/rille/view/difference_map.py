"""The residual on the map: where along the way the model misses most, over the ground's hill-shade."""

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import Terrain
from rille.model.comparison import Comparison
from rille.model.difference import Difference
from rille.view.difference_plots import normalised_residual
from rille.view.ground import Patch, colors, crop
from rille.view.page import packed

Array = NDArray[np.float64]

PLACES = 4_000  # on the map
PIXELS = 600  # of the ground's picture, along a side
LEAST_WAY = 0.05  # [m] what moves less has no map


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """Places of one recording: x, y (P,) [m], window (P,), scores (1 + channels, P): over all channels that take part, then of each."""

    x: Array
    y: Array
    window: NDArray[np.int64]
    scores: Array


def map_data(difference: Difference, comparisons: Sequence[Comparison], terrain: Terrain | None) -> dict[str, object] | None:
    """Places along the way with the normalised residual around each.

    ``x``, ``y`` (P,) [m]; ``recording`` index and ``window`` (P,); ``scores``: "all" and each channel's index -> (P,) RMS of the normalised
    residuals between one place and the next; ``image``: the ground below, None without terrain. None if nothing moved.
    """
    ways = ways_of(difference, comparisons)
    if not ways:
        return None
    x, y = np.concatenate([way.x for _, way in ways]), np.concatenate([way.y for _, way in ways])
    scores = np.concatenate([way.scores for _, way in ways], axis=1)
    names = ["all", *map(str, range(len(difference.channels)))]
    return {
        "x": packed(x),
        "y": packed(y),
        "recording": np.concatenate([np.full(len(way.x), index) for index, way in ways]),
        "window": np.concatenate([way.window for _, way in ways]),
        "scores": {name: packed(row) for name, row in zip(names, scores, strict=True) if np.isfinite(row).any()},
        "image": None if terrain is None else ground_image(terrain, x, y),
    }


def ways_of(difference: Difference, comparisons: Sequence[Comparison]) -> list[tuple[int, Way]]:
    """Index and places of every recording whose way is known; empty if nothing moved."""
    found = [_way(difference, comparison, PLACES // len(comparisons)) for comparison in comparisons]
    ways = [(index, way) for index, way in enumerate(found) if way is not None]
    if not ways:
        return []
    reach = max(np.ptp(np.concatenate([getattr(way, axis) for _, way in ways])) for axis in "xy")
    return ways if reach >= LEAST_WAY else []


def _way(difference: Difference, comparison: Comparison, most: int) -> Way | None:
    """Places of one recording; None if nobody knows where it was."""
    regimes = comparison.regimes
    if "x" not in regimes.values or "y" not in regimes.values or len(regimes.time) < 2:
        return None
    places = int(min(len(regimes.time), max(12, most)))
    edges = np.unique(np.linspace(0, len(regimes.time), places + 1).astype(int))
    first, last = edges[:-1], edges[1:] - 1
    middle = (first + last) // 2
    starts = regimes.time[first]
    sums = np.zeros((len(difference.channels), len(first)))
    counts = np.zeros_like(sums)
    numbers = {channel.name: number for number, channel in enumerate(difference.channels)}
    for channel in comparison.channels:
        number = numbers.get(channel.channel.name)
        if number is None:
            continue
        normalised = normalised_residual(channel)
        known = np.isfinite(normalised) & (channel.time >= starts[0])
        place = np.searchsorted(starts, channel.time[known], side="right") - 1
        sums[number] += np.bincount(place, normalised[known] ** 2, len(first))
        counts[number] += np.bincount(place, minlength=len(first))
    counted = np.array([not channel.left_out for channel in difference.channels], bool)
    together = np.vstack([sums[counted].sum(axis=0), sums]), np.vstack([counts[counted].sum(axis=0), counts])
    with np.errstate(invalid="ignore", divide="ignore"):
        scores = np.sqrt(np.where(together[1] > 0, together[0] / together[1], np.nan))
    return Way(x=regimes.values["x"][middle], y=regimes.values["y"][middle], window=regimes.window[middle], scores=scores)


def ground_image(terrain: Terrain, x: Array, y: Array) -> dict[str, Any] | None:
    """The ground below the way as a lit picture, with its place."""
    from PIL import Image

    low, high = np.array([np.nanmin(x), np.nanmin(y)]), np.array([np.nanmax(x), np.nanmax(y)])
    n_rows, n_columns = terrain.heights.shape
    inside = (
        high[0] > terrain.x_west
        and low[0] < terrain.x_west + (n_columns - 1) * terrain.posting_x
        and low[1] < terrain.y_north
        and high[1] > terrain.y_north - (n_rows - 1) * terrain.posting_y
    )
    if not inside:
        return None
    patch = _fine(crop(terrain, (low + high) / 2, reach=max(4.0, 0.75 * float(max(high - low)))))
    sun = np.array([-0.6, 0.6, 0.53])
    pixels = colors(patch, terrain, sun / np.linalg.norm(sun)).reshape(*patch.z.shape, 3)
    with io.BytesIO() as file:
        Image.fromarray(pixels).save(file, "JPEG", quality=88)
        content = base64.b64encode(file.getvalue()).decode()
    return {
        "source": f"data:image/jpeg;base64,{content}",
        "west": float(patch.x[0]),
        "east": float(patch.x[-1]),
        "north": float(patch.y[0]),
        "south": float(patch.y[-1]),
    }


def _fine(patch: Patch) -> Patch:
    """The same ground with at least ``PIXELS`` points a side: the grain of a coarser one would look like relief."""
    x, y = (np.linspace(side[0], side[-1], max(PIXELS, len(side))) for side in (patch.x, patch.y))
    return Patch(x=x, y=y, z=patch.height(x[None, :], y[:, None]))
