"""[base] of a scene file: the ground before landforms."""

from typing import Literal

from pydantic import Field

from rille.model.sheet import Sheet

Number = float | int | str
Pair = list[Number]


class DetailSheet(Sheet):
    """[base.detail]: relief below the true resolution of a measured base.

    hurst : exponent H of the power law k^-(2 H + 2); default: fitted to the waves that the base resolves.
    strength : amplitude against that law; 1 = its continuation. seed : of the random numbers.
    resolution : shortest wave that the base holds in full [m]; default: where its spectrum falls below half of its law.
    fill : also restore the power that is missing between ``resolution`` and twice the base's posting. This changes the base's own
    heights; without it they are kept.
    """

    hurst: float | None = Field(None, gt=0, lt=1)
    strength: float = Field(1.0, ge=0, le=100)
    seed: int = Field(0, ge=0)
    resolution: Number | None = None
    fill: bool = False


class BaseSheet(Sheet):
    """[base].

    size, center, posting : extent [m] and middle in W, distance of neighbouring heights.
    plane : rises by ``slope`` towards ``direction``. fractal : ``hurst``, ``seed``; ``median_slope`` is the median of |dz| / posting
    over neighbours along rows and columns.
    dem : file in a projection in metres; ``band``, default the first, which is told where there are several; ``origin`` is the map point
    (east, north) that becomes the origin of W, default the middle; ``fill_holes`` interpolates missing heights, which are otherwise
    refused.
    values : what the numbers of a DEM are: heights at "points" (the ground is their bilinear surface), or "means" over cells (the ground
    is a smooth surface with these means). Default "points", with [base.detail] "means".
    """

    kind: Literal["flat", "plane", "fractal", "dem"]
    size: Pair | None = Field(None, min_length=2, max_length=2)
    center: Pair = Field([0.0, 0.0], min_length=2, max_length=2)
    posting: Number | None = None
    slope: Number = 0.0
    direction: Number = 0.0
    hurst: float = Field(0.8, gt=0, lt=1)
    median_slope: Number = "2 deg"
    seed: int = Field(0, ge=0)
    file: str | None = None
    band: int = Field(1, ge=1)
    origin: Pair | None = Field(None, min_length=2, max_length=2)
    fill_holes: bool = False
    values: Literal["points", "means"] | None = None
    detail: DetailSheet | None = None
