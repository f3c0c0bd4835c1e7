"""Whether a metre of a map is a metre on the ground: the scale of a projection where the ground is taken from.

Mercator doubles all distances at 60 degrees and halves all slopes; equirectangular maps stretch them along parallels by 1/cos(latitude)
(Snyder 1987, Map projections: a working manual, USGS Professional Paper 1395, ch. 4).
"""

import numpy as np

from rille.model import InputRefused
from rille.terrain.raster import Raster

BOUND = 0.02  # relative: so far may a distance be off; less than measured heights are


def check_metres(raster: Raster, east: float, north: float) -> None:
    """Refuse ground whose distances a projection changes by more than 2 %.

    Parameters
    ----------
    east, north : map coordinates [m] of the middle of what is taken.

    Raises
    ------
    InputRefused : with the scale along meridian and parallel, and a projection that is true there.
    """
    if not raster.crs:
        return  # a local frame in metres
    import pyproj
    from pyproj.exceptions import ProjError

    try:
        crs = pyproj.CRS.from_wkt(raster.crs)
        projection = pyproj.Proj(crs)
        longitude, latitude = projection(east, north, inverse=True, errcheck=True)
        factors = projection.get_factors(longitude, latitude, errcheck=True)
    except ProjError:
        return  # a projection that says nothing of its scale
    scale = np.array([factors.meridional_scale, factors.parallel_scale])
    if not np.isfinite(scale).all() or np.abs(scale - 1).max() <= BOUND:
        return
    body = crs.ellipsoid
    figure = "" if body is None else f" +a={body.semi_major_metre:.12g} +b={body.semi_minor_metre:.12g}"
    raise InputRefused(
        f"a metre on the map of '{raster.path}' is no metre on the ground at latitude {latitude:.4g}, longitude {longitude:.4g} degrees: "
        f"distances are {scale[0]:.3g} times too long along the meridian and {scale[1]:.3g} times along the parallel; project it anew "
        f"(gdalwarp -t_srs '+proj=stere +lat_0={latitude:.6g} +lon_0={longitude:.6g}{figure} +units=m')"
    )
