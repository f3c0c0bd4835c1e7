"""Factors on a law from place to place: a map, or a fall with distance from a placed crater."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, LandformInstance, nearest_names
from rille.model.sheet import expand
from rille.terrain.crater_laws import largest_block
from rille.terrain.population.sheet import DensitySheet
from rille.terrain.raster import band_values, metric_projection

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """How W lies in map coordinates: (E, N) = origin + R(heading) (x, y). crs : WKT or code, empty if the map is W itself."""

    crs: str = ""
    origin: tuple[float, float] = (0.0, 0.0)
    heading: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Density:
    """factor : (x, y) (n,) [m] in W -> factor (n,) >= 0. largest : no factor is above it."""

    factor: Callable[[Array, Array], Array]
    largest: float


def make_density(
    sheet: DensitySheet, subject: str, largest_form: float, placed: Mapping[str, LandformInstance], frame: Frame, folder: Path
) -> Density:
    """The factor that a sheet describes; map and fall are multiplied where both are given.

    Parameters
    ----------
    largest_form : [m] largest diameter of the population, to be compared with what the crater can throw out. folder : of the scene.

    Raises
    ------
    InputRefused : if it names neither, an unknown landform, a map that cannot be used, or blocks too large for the crater.
    """
    parts = []
    if sheet.map is not None:
        parts.append(_mapped(expand(sheet.map, folder), subject, frame))
    if sheet.around is not None:
        parts.append(_falling(sheet, subject, largest_form, placed))
    if not parts:
        raise InputRefused(f"the density of {subject} names neither `map` nor `around`; give one of them, or leave it out")

    def factor(x: Array, y: Array) -> Array:
        values = np.ones(np.shape(x))
        for part in parts:
            values = values * part.factor(x, y)
        return values

    return Density(factor=factor, largest=math.prod(part.largest for part in parts))


def _falling(sheet: DensitySheet, subject: str, largest_form: float, placed: Mapping[str, LandformInstance]) -> Density:
    """1 up to the rim, exp(-r / fall) beyond, r = (distance - R) / R; no block is larger than the crater throws out."""
    assert sheet.around is not None
    if sheet.around not in placed:
        raise InputRefused(
            f"the density of {subject} falls around '{sheet.around}', which is not placed; {nearest_names(sheet.around, placed)}"
        )
    center = placed[sheet.around]
    if "diameter" not in center.drivers:
        raise InputRefused(
            f"the density of {subject} falls around '{center.name}', a {center.landform}, which has no diameter; name a crater"
        )
    diameter = center.scale * center.drivers["diameter"]
    block = float(largest_block(diameter))
    if "crater" in center.landform and largest_form > block:
        raise InputRefused(
            f"the largest diameter of {subject} is {largest_form:g} m, but a crater of {diameter:g} m throws out blocks of at most "
            f"{block:.3g} m (0.29 D^(2/3)); lower the largest diameter"
        )
    radius = diameter / 2

    def factor(x: Array, y: Array) -> Array:
        r = np.hypot(x - center.x, y - center.y) / radius - 1.0
        return np.exp(-np.maximum(r, 0.0) / sheet.fall)

    return Density(factor=factor, largest=1.0)


def _mapped(path: Path, subject: str, frame: Frame) -> Density:
    """Value of the cell that a point lies in; 0 outside the raster and where it holds no value."""
    import rasterio
    from rasterio.errors import RasterioError

    what = f"the density map '{path}' of {subject}"
    if not path.is_file():
        raise InputRefused(f"there is no file '{path}' for the density of {subject}")
    try:
        with rasterio.open(path) as raster:
            values = np.nan_to_num(band_values(raster, 1), nan=0.0, posinf=0.0, neginf=0.0)
            if not (np.isfinite(raster.transform).all() and abs(raster.transform.determinant) > 0):
                raise InputRefused(f"{what} has cells without an area; repair its georeference (gdal_edit -a_ullr)")
            inverse, crs = ~raster.transform, raster.crs
    except (RasterioError, UnicodeDecodeError) as error:  # of names in a damaged header
        raise InputRefused(f"{what} cannot be read as a raster: {error}") from None
    if values.min() < 0:
        raise InputRefused(f"{what} holds {values.min():g}; factors on a law must be at least 0")
    if values.max() == 0:
        raise InputRefused(f"{what} is zero everywhere, so nothing would be placed; give factors above 0")
    if crs:
        metric_projection(crs, what)
    if crs and frame.crs and crs != rasterio.CRS.from_user_input(frame.crs):
        raise InputRefused(f"{what} is in another projection than the scene; warp it first (gdalwarp -t_srs)")
    cosine, sine = math.cos(frame.heading), math.sin(frame.heading)

    def factor(x: Array, y: Array) -> Array:
        east = frame.origin[0] + cosine * x - sine * y
        north = frame.origin[1] + sine * x + cosine * y
        column = np.floor(inverse.a * east + inverse.b * north + inverse.c)
        row = np.floor(inverse.d * east + inverse.e * north + inverse.f)
        inside = (column >= 0) & (row >= 0) & (column < values.shape[1]) & (row < values.shape[0])
        found = np.zeros(np.shape(x))
        found[inside] = values[row[inside].astype(int), column[inside].astype(int)]
        return found

    return Density(factor=factor, largest=float(values.max()))
