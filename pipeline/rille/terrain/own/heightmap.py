"""A raster file as heights of a landform. What the file does not say is asked for, never guessed."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused
from rille.model.quantity import to_si
from rille.terrain.grid import Grid
from rille.terrain.landform import smooth_step
from rille.terrain.own.relief import Relief, height_of, length_of, two_lengths
from rille.terrain.raster import HIGHEST, LostMarks, band_values, height_unit, reason_of

Array = NDArray[np.float64]

MOST = 25_000_000  # values


@dataclass(frozen=True, slots=True, kw_only=True)
class Georeference:
    """What a designer states of a map; texts with units.

    unit : length that one step of its values means ("m", "0.25 mm"). height_range : "low, high", heights of the lowest and the highest
    grey level that its type can hold. posting, length : distance of its points, or from its first column to its last.
    origin : "centre", "corner" (south-west), "pixel COLUMN, ROW", or "x, y" in the map's coordinates (without any: metres from the
    south-western corner). zero : "border" (mean of it), "plane" (that fits it), "lowest", or a height. fade : width along the border
    over which heights go to zero; None: a tenth of the shorter side.
    """

    unit: str | None = None
    height_range: str | None = None
    posting: str | None = None
    length: str | None = None
    origin: str = "centre"
    zero: str = "border"
    fade: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Raster:
    values: Array
    posting: tuple[float, float] | None
    corner: tuple[float, float]  # map coordinates of value (0, 0) [m]
    type_name: str
    levels: tuple[float, float] | None  # lowest and highest that an integer type holds
    unit: str  # of its heights as the file states it, "" where it does not
    scale: float  # value = offset + scale number in the file
    offset: float


def read_height_map(path: Path, stated: Georeference) -> Relief:
    """Heights of a raster in any format that GDAL reads, around an origin, from a zero height, fading at the border.

    Heights in cells are heights at their centres. z = (v - zero) s(d / fade), d the distance from the border, s the smooth step.

    Raises
    ------
    InputRefused : for a file that is no raster of heights, and for whatever it does not say: the sentence names the option.
    """
    path = Path(path)
    raster = _read(path)
    heights, how = _heights(raster, stated, path)
    missing = int((~np.isfinite(heights)).sum())
    if missing:
        raise InputRefused(f"'{path}' has {missing} heights missing; fill them first (gdal_fillnodata), or cut a part without")
    posting = _posting(raster, stated, path)
    n_rows, n_cols = heights.shape
    origin, where = _origin(stated.origin, raster, posting, path)
    zero, level = _zero(stated.zero, heights, path)
    size = (n_cols - 1) * posting[0], (n_rows - 1) * posting[1]
    fade = min(size) / 10 if stated.fade is None else height_of(stated.fade, f"fade of '{path}'")
    if not 0 <= fade <= min(size) / 2:
        raise InputRefused(f"fade of '{path}' is {fade:g} m; it must lie between 0 and half its shorter side, {min(size) / 2:g} m")
    grid = Grid(n_rows=n_rows, n_cols=n_cols, posting_x=posting[0], posting_y=posting[1], x_west=-origin[0], y_north=size[1] - origin[1])
    heights = heights - zero
    if fade > 0:
        across = (np.minimum(np.arange(n), np.arange(n)[::-1]) * step for n, step in ((n_cols, posting[0]), (n_rows, posting[1])))
        x, y = across
        heights = heights * smooth_step(np.minimum(x[None, :], y[:, None]) / fade)
    if not np.abs(heights).max() > 0:
        raise InputRefused(f"'{path}' is flat; there is no landform in it")
    return Relief(
        grid=grid,
        heights=heights,
        length=size[0],
        frame=f"origin at {where}, x to the east of the map, height zero at {level}",
        reference=f"{raster.type_name}, {how}, posting {posting[0]:g} m x {posting[1]:g} m, origin {stated.origin}, zero {stated.zero}, "
        f"fading over {fade:g} m",
        notes=_notes(raster, heights, path),
    )


def _read(path: Path) -> _Raster:
    import warnings

    import rasterio
    from rasterio.enums import ColorInterp
    from rasterio.errors import NotGeoreferencedWarning, RasterioError

    if not path.is_file():
        raise InputRefused(f"there is no height map '{path}'")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            with rasterio.open(path) as raster:
                colors = list(raster.colorinterp)
                bands = [color for color in colors if color != ColorInterp.alpha]
                if len(bands) != 1 or bands[0] == ColorInterp.palette:
                    kind = "a palette of colours" if len(bands) == 1 else f"{len(bands)} bands (colours)"
                    raise InputRefused(f"'{path}' has {kind}; save it with one band of heights (grey)")
                if min(raster.shape) < 3 or raster.width * raster.height > MOST:
                    raise InputRefused(
                        f"'{path}' has {raster.height} x {raster.width} heights; at least 3 x 3 and at most {MOST:.0e} are taken"
                    )
                band = colors.index(bands[0]) + 1
                name = str(raster.dtypes[band - 1])
                if np.dtype(name).kind == "c":
                    raise InputRefused(f"'{path}' holds complex numbers; save it with one band of heights")
                values = band_values(raster, band)
                scale, offset = float(raster.scales[band - 1]), float(raster.offsets[band - 1])
                scaled = (scale, offset) != (1.0, 0.0)
                kind = np.dtype(name).kind
                levels = (float(np.iinfo(name).min), float(np.iinfo(name).max)) if kind in "iu" and not scaled else None
                posting, corner = _georeference(raster, path)
                unit = height_unit(raster, band)
    except (RasterioError, UnicodeDecodeError) as error:  # of names in a damaged header
        raise InputRefused(f"'{path}' cannot be read as a raster: {reason_of(error)}") from None
    return _Raster(values=values, posting=posting, corner=corner, type_name=name, levels=levels, unit=unit, scale=scale, offset=offset)


def _georeference(raster: Any, path: Path) -> tuple[tuple[float, float] | None, tuple[float, float]]:
    """Posting and place of value (0, 0) [m] as the file states them; None: it does not."""
    transform, crs = raster.transform, raster.crs
    if crs is None or crs.is_geographic or transform.is_identity:
        return None, (0.0, 0.0)
    if transform.b != 0 or transform.d != 0 or transform.a <= 0 or transform.e >= 0:
        raise InputRefused(f"'{path}' is not north-up (rotated or flipped); warp it first (gdalwarp)")
    try:
        factor = float(crs.linear_units_factor[1])
    except Exception:  # a coordinate system without a linear unit
        return None, (0.0, 0.0)
    x, y = factor * (transform.c + transform.a / 2), factor * (transform.f + transform.e / 2)
    return (factor * float(transform.a), -factor * float(transform.e)), (float(x), float(y))


def _heights(raster: _Raster, stated: Georeference, path: Path) -> tuple[Array, str]:
    if stated.height_range is not None and stated.unit is not None:
        raise InputRefused(f"both --height-range and --unit are stated for '{path}'; one of them says what its values mean")
    if stated.height_range is not None:
        if raster.levels is None:
            raise InputRefused(
                f"'{path}' holds {raster.type_name}, which has no grey levels; state the unit of its heights instead: --unit m"
            )
        low, high = two_lengths(stated.height_range, f"height range of '{path}'")
        if not low < high:
            raise InputRefused(f"height range of '{path}' goes from {low:g} to {high:g} m; the first must be the lower one")
        least, most = raster.levels
        return low + (raster.values - least) * ((high - low) / (most - least)), f"grey levels from {low:g} to {high:g} m"
    unit = stated.unit or raster.unit
    if not unit:
        if raster.levels is not None:
            raise InputRefused(
                f"'{path}' holds grey levels ({raster.type_name}) and does not say how high they are; state the heights of the lowest and "
                'the highest level, for example --height-range "0 m, 12 m", or the height of one level, for example --unit "0.5 mm"'
            )
        raise InputRefused(f"'{path}' does not say the unit of its heights; state it, for example --unit m")
    try:
        factor = to_si(unit if unit[:1].isdigit() else f"1 {unit}", "length", f"unit of '{path}'")
    except InputRefused:
        if stated.unit is not None:
            raise
        raise InputRefused(f"the heights of '{path}' are in '{unit}', which is no known length; state it, for example --unit m") from None
    if not factor > 0:
        raise InputRefused(f"unit of '{path}' is {unit}; it must be above 0")
    heights = factor * raster.values
    heights[np.abs(heights) > HIGHEST] = np.nan
    marks = LostMarks(path, raster.scale, raster.offset, unit="" if unit[:1].isdigit() else unit)
    marks.look(raster.values)
    marks.refuse()
    return heights, f"values in {unit}"


def _posting(raster: _Raster, stated: Georeference, path: Path) -> tuple[float, float]:
    if stated.posting is not None and stated.length is not None:
        raise InputRefused(f"both --posting and --length are stated for '{path}'; one of them says how large it is")
    if stated.posting is not None:
        step = length_of(stated.posting, f"posting of '{path}'")
        return step, step
    if stated.length is not None:
        step = length_of(stated.length, f"length of '{path}'") / (raster.values.shape[1] - 1)
        return step, step
    if raster.posting is None:
        raise InputRefused(
            f"'{path}' does not say in metres how far apart its heights are; state --posting or --length, for example --length 20m"
        )
    return raster.posting


def _origin(text: str, raster: _Raster, posting: tuple[float, float], path: Path) -> tuple[tuple[float, float], str]:
    """The origin [m] from the south-western value, and where that is."""
    n_rows, n_cols = raster.values.shape
    width, height = (n_cols - 1) * posting[0], (n_rows - 1) * posting[1]
    if text in ("centre", "center"):
        return (width / 2, height / 2), "the centre of the map"
    if text == "corner":
        return (0.0, 0.0), "the south-western corner of the map"
    if text.startswith("pixel"):
        try:
            column, row = (float(v) for v in text.removeprefix("pixel").replace(",", " ").split())
        except ValueError:
            raise InputRefused(
                f"origin of '{path}' is '{text}'; write for example \"pixel 120, 80\" (column, row from the top left)"
            ) from None
        point, where = (column * posting[0], height - row * posting[1]), f"pixel ({column:g}, {row:g}) of the map"
    elif "," in text:
        x, y = two_lengths(text, f"origin of '{path}'")
        known = raster.posting is not None and raster.posting == posting
        south = raster.corner[1] - height
        point, where = (x - raster.corner[0], y - south) if known else (x, y), f"({x:g}, {y:g}) m of the map"
    else:
        raise InputRefused(f"origin of '{path}' is '{text}'; give centre, corner, \"pixel 120, 80\", or a point such as \"1 m, 20 cm\"")
    if not (-0.5 * posting[0] <= point[0] <= width + 0.5 * posting[0] and -0.5 * posting[1] <= point[1] <= height + 0.5 * posting[1]):
        raise InputRefused(
            f"origin of '{path}' lies at ({point[0]:g}, {point[1]:g}) m from its south-western corner, "
            f"outside the map of {width:g} m x {height:g} m"
        )
    return point, where


def _zero(text: str, heights: Array, path: Path) -> tuple[float | Array, str]:
    border = np.ones(heights.shape, bool)
    border[1:-1, 1:-1] = False
    if text == "border":
        return float(heights[border].mean()), "the mean of its border"
    if text == "plane":
        row, column = np.indices(heights.shape)
        columns = np.stack([np.ones(heights.shape), row, column], axis=-1)
        fitted = np.linalg.lstsq(columns[border], heights[border], rcond=None)[0]
        return columns @ fitted, "the plane that fits its border, so that its slope is left out"
    if text == "lowest":
        return float(heights.min()), "its lowest height"
    value = height_of(text, f"--zero of '{path}' (border, plane, lowest, or a height)")
    return value, f"{value:g} m of the map"


def _notes(raster: _Raster, heights: Array, path: Path) -> tuple[str, ...]:
    if raster.levels is None or raster.type_name not in ("uint8", "int8"):
        return ()
    distinct = np.unique(raster.values)
    step = float(np.ptp(heights)) / max(len(distinct) - 1, 1)
    return (f"'{path.name}' has {len(distinct)} grey levels, {1e3 * step:.3g} mm apart: steps will show; 16 bit hold finer heights",)
