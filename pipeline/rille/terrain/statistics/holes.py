"""Missing heights, bridged for methods that need all of them."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def bridged(heights: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Heights with holes filled from their borders, and where the holes were; statistics leave those places out or say so."""
    holes = ~np.isfinite(heights)
    if not holes.any():
        return heights, holes
    if holes.all():
        return np.zeros_like(heights), holes
    from rasterio.fill import fillnodata

    mean = float(heights[~holes].mean())
    filled = fillnodata(
        np.where(holes, 0.0, heights - mean).astype(np.float32),
        mask=(~holes).astype(np.uint8),
        max_search_distance=float(max(heights.shape)),
    )
    return np.where(holes, filled.astype(np.float64) + mean, heights), holes
