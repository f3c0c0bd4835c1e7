"""Reading measured DEMs: any raster that GDAL knows, north-up, in a projection in metres, window by window.

GDAL's rasters are cells; the value of a cell stands at the cell's centre. A raster of n columns therefore becomes n heights, n - 1 cells
apart, whose outermost points lie half a cell inside the raster's border.
"""

import math
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused

Array = NDArray[np.float64]

METRES = ("", "m", "metre", "metres", "meter", "meters")
HIGHEST = 1e6  # [m]; beyond it, a number is a mark for "no value" whose tag was lost (-3.4e38)
MARKS = (-9999.0, -32768.0, -32767.0, -99999.0)  # values that usually mean "no value" and could be heights
STRIP = 4_000_000  # heights in memory while a large raster is looked through
APART = 0.5  # a mark lies further from all other heights than this share of their range


@dataclass(frozen=True, slots=True, kw_only=True)
class Raster:
    """A band of a raster file. shape : rows, columns. posting (x, y) [m]. corner : map coordinates of the centre of cell (0, 0) [m].

    beside : other files that its values depend on (data beside a header, sources of a VRT, masks). scale, offset : height = offset +
    scale value. bands : how many the file has. crs : WKT; "" for a local frame in metres.
    """

    path: Path
    beside: tuple[Path, ...]
    band: int
    bands: int
    shape: tuple[int, int]
    posting: tuple[float, float]
    corner: tuple[float, float]
    scale: float
    offset: float
    crs: str

    def read(self, rows: tuple[int, int], cols: tuple[int, int]) -> Array:
        """Heights [m] of rows[0] <= i < rows[1] and cols[0] <= j < cols[1]; NaN = no value.

        Raises
        ------
        InputRefused : if the file cannot be read there.
        """
        import rasterio
        from rasterio.errors import RasterioError
        from rasterio.windows import Window

        try:
            with rasterio.open(self.path) as raster:
                window = Window(cols[0], rows[0], cols[1] - cols[0], rows[1] - rows[0])  # type: ignore[call-arg]
                heights = band_values(raster, self.band, window)
        except RasterioError as error:
            raise InputRefused(f"'{self.path}' cannot be read as a raster: {reason_of(error)}") from None
        heights[np.abs(heights) > HIGHEST] = np.nan
        return heights

    def strips(self, rows: tuple[int, int], cols: tuple[int, int]) -> Iterator[Array]:
        """The same in strips of full rows, from the north, of about ``STRIP`` heights each."""
        step = max(STRIP // (cols[1] - cols[0]), 1)
        for row in range(rows[0], rows[1], step):
            yield self.read((row, min(row + step, rows[1])), cols)

    def lost_marks(self) -> "LostMarks":
        """An account of heights that are read from it."""
        return LostMarks(self.path, self.scale, self.offset)


class LostMarks:
    """An account of marks for "no value" whose tag was lost, kept while heights pass by: they would be pits kilometres deep.

    A value is taken for one if it is exactly one of ``MARKS``, and lies away from all other heights by more than half of their range.
    True ground has heights in between, whatever its relief is.
    """

    def __init__(self, path: Path, scale: float = 1.0, offset: float = 0.0, unit: str = "m") -> None:
        """Of a file; height = offset + scale value, of the values in it. unit : of the heights, for the sentence; "" without a name."""
        self._path, self._unit = path, unit
        self._marks = {mark: offset + scale * mark for mark in MARKS}
        self._counts = dict.fromkeys(MARKS, 0)
        self._low, self._high = math.inf, -math.inf

    def look(self, heights: Array) -> None:
        """Take some of the heights into account; NaN = no value."""
        others = np.isfinite(heights)
        for mark, height in self._marks.items():
            marked = heights == height
            self._counts[mark] += int(np.count_nonzero(marked))
            others &= ~marked
        if others.any():
            self._low, self._high = min(self._low, float(heights[others].min())), max(self._high, float(heights[others].max()))

    def refuse(self) -> None:
        """Refuse what was found, once all heights that matter were looked at.

        Raises
        ------
        InputRefused : with the mark, how many heights hold it, how far off they are, and what to do.
        """
        low, high, unit = self._low, self._high, self._unit
        for mark in (mark for mark in MARKS if self._counts[mark]):
            count, height = self._counts[mark], self._marks[mark]
            away = max(low - height, height - high)
            if low <= high and away <= APART * (high - low):
                continue
            side = "below" if height < low else "above"
            where = f", {away:.0f}{f' {unit}'.rstrip()} {side} all others ({low:g} to {high:g})" if low <= high else ""
            raise InputRefused(
                f"'{self._path}' has {count} height{'s' * (count != 1)} of exactly {f'{height:g} {unit}'.strip()}{where}: a mark "
                f'for "no value" whose tag was lost; put it back (gdal_edit -a_nodata {mark:g}, or gdal_translate -a_nodata {mark:g}; in '
                f"an .asc the line 'NODATA_value {mark:g}')"
            )


def band_values(raster: Any, band: int, window: Any = None) -> Array:
    """Values of a band of an open raster: offset + scale number, of the numbers in the file; NaN = no value. window : None: all."""
    values = raster.read(band, window=window, masked=True).astype(np.float64).filled(np.nan)
    scale, offset = raster.scales[band - 1], raster.offsets[band - 1]
    return values if (scale, offset) == (1.0, 0.0) else values * scale + offset


def height_unit(raster: Any, band: int) -> str:
    """Unit of heights that an open raster states, for its band or in a compound projection; "" where it states none."""
    stated = (raster.units[band - 1] or "").strip()
    return stated or ("" if raster.crs is None else _vertical_unit(raster.crs.to_wkt()))


def reason_of(error: BaseException) -> str:
    """What GDAL says of a failure, in one line; rasterio's own sentence often only points at its cause."""
    while error.__cause__ is not None:
        error = error.__cause__
    text = (str(error) or type(error).__name__).splitlines()[0]
    return f"it ends early ({text.rstrip('.')})" if "File short" in text else text


def open_raster(path: Path, band: int = 1) -> Raster:
    """Look at a raster and refuse what is no DEM in metres.

    Raises
    ------
    InputRefused : for a missing or unreadable file, a band that it lacks, no projection, degrees, another unit than metres (in the plane
        or in height), a rotated or flipped raster, or less than 2 x 2 heights.
    """
    import rasterio
    from rasterio.errors import NotGeoreferencedWarning, RasterioError

    path = Path(path)
    if not path.is_file():
        raise InputRefused(f"there is no DEM '{path}'")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)  # refused below, in words
            raster = rasterio.open(path)
        with raster:
            if band > raster.count:
                raise InputRefused(
                    f"'{path}' has {raster.count} band{'s' * (raster.count != 1)}, so there is no band {band}; choose another"
                )
            if raster.dtypes[band - 1].startswith("complex"):
                raise InputRefused(f"'{path}' holds complex numbers; a DEM needs real heights: choose another file or band")
            shape, transform, crs, bands = raster.shape, raster.transform, raster.crs, raster.count
            beside = tuple(file for file in map(Path, sorted(raster.files)) if file.suffix != ".ovr" and file.is_file() and file != path)
            scale, offset, unit = raster.scales[band - 1], raster.offsets[band - 1], height_unit(raster, band)
    except (RasterioError, UnicodeDecodeError) as error:  # of names in a damaged header
        raise InputRefused(f"'{path}' cannot be read as a raster: {reason_of(error)}") from None
    if min(shape) < 2:
        raise InputRefused(f"'{path}' has {shape[0]} x {shape[1]} heights; at least 2 x 2 are needed")
    if crs is None:
        raise InputRefused(
            f"'{path}' has no projection, so its scale is unknown; assign one (gdal_edit -a_srs; beside an .asc a .prj file)"
        )
    projection = metric_projection(crs, f"'{path}'")
    if unit.lower() not in METRES:
        raise InputRefused(f"the heights of '{path}' are in {unit}, not in metres; convert them first (gdal_calc, then gdal_edit -units m)")
    if not np.isfinite(transform).all():
        raise InputRefused(
            f"'{path}' does not say where it lies (its georeference has a number that is not finite); repair it (gdal_edit -a_ullr)"
        )
    if transform.b != 0 or transform.d != 0 or transform.a <= 0 or transform.e >= 0:
        raise InputRefused(f"'{path}' is not north-up (rotated or flipped); warp it first (gdalwarp)")
    return Raster(
        path=path,
        beside=beside,
        band=band,
        bands=bands,
        shape=(int(shape[0]), int(shape[1])),
        posting=(float(transform.a), float(-transform.e)),
        corner=(float(transform.c + transform.a / 2), float(transform.f + transform.e / 2)),
        scale=float(scale),
        offset=float(offset),
        crs=projection,
    )


def metric_projection(crs: Any, what: str) -> str:
    """WKT of a raster's projection in metres; "" for a local frame in metres, that of a scene without projection.

    Raises
    ------
    InputRefused : for degrees and other lengths than metres.
    """
    wkt = crs.to_wkt()
    local = re.match(r'(?:LOCAL_CS|ENGCRS)\[.*UNIT\["([^"]+)",([0-9.eE+-]+)', wkt, re.DOTALL)
    if not crs.is_projected and local is None:
        raise InputRefused(f"{what} is in degrees, not in metres; project it first (gdalwarp -t_srs)")
    name, factor = crs.linear_units_factor if local is None else (local.group(1), float(local.group(2)))
    if abs(factor - 1) > 1e-9:
        raise InputRefused(f"{what} is in {name}, not in metres; project it first (gdalwarp -t_srs)")
    return wkt if local is None else ""


def _vertical_unit(wkt: str) -> str:
    """Unit of heights that a compound projection names, "" where it names none."""
    vertical = re.search(r'VERT_?C(?:RS|S)\[.*?(?:LENGTH)?UNIT\["([^"]+)"', wkt, re.DOTALL)
    return vertical.group(1) if vertical else ""
