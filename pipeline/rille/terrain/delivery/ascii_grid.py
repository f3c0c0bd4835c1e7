"""ESRI ASCII grid: text, with all digits of every height."""

from pathlib import Path

from rille.model import InputRefused, Terrain
from rille.terrain.delivery.appearing import appearing
from rille.terrain.delivery.strips import Progress, strips

NO_VALUE = -1.0e6  # [m]


def write(terrain: Terrain, path: Path, progress: Progress | None = None) -> None:
    """Map heights as an ESRI ASCII grid, row 0 north, with the shortest digits that give the same float64, and the projection as .prj.

    ``xllcenter`` and ``yllcenter`` are the south-western point itself. GDAL reads such files in single precision unless it is told
    ``-oo DATATYPE=Float64``.

    Raises
    ------
    InputRefused : for a posting that differs in x and y or a turned terrain, which the format cannot express, or if it cannot be written.
    """
    n_rows, n_cols = terrain.heights.shape
    if abs(terrain.posting_x - terrain.posting_y) > 1e-12 * terrain.posting_x:
        raise InputRefused(
            f"terrain '{terrain.name}' has a posting of {terrain.posting_x:g} m x {terrain.posting_y:g} m, but an ASCII grid has square "
            f"cells; extract it with --posting {min(terrain.posting_x, terrain.posting_y):g}"
        )
    if terrain.map_heading != 0.0:
        raise InputRefused(
            f"terrain '{terrain.name}' is turned by {terrain.map_heading:g} rad on the map, which an ASCII grid cannot express; deliver a "
            "GeoTIFF, or extract it with heading 0"
        )
    east, north, zero = terrain.map_origin
    header = {
        "ncols": n_cols,
        "nrows": n_rows,
        "xllcenter": repr(float(east + terrain.x_west)),
        "yllcenter": repr(float(north + terrain.y_north - (n_rows - 1) * terrain.posting_y)),
        "cellsize": repr(float(terrain.posting_x)),
        "NODATA_value": repr(NO_VALUE),
    }
    with appearing(path) as folder:
        with (folder / path.name).open("w", encoding="ascii") as file:
            file.writelines(f"{key:<14}{value}\n" for key, value in header.items())
            for _, block in strips(terrain, f"writing {path.name}", progress):
                for row in block:
                    file.write(" ".join([repr(z) if z == z else repr(NO_VALUE) for z in (row + zero).tolist()]) + "\n")
        if terrain.crs:
            from rasterio.crs import CRS

            (folder / f"{path.stem}.prj").write_text(CRS.from_user_input(terrain.crs).to_wkt(version="WKT1_ESRI") + "\n")
