"""Polygonal ground: cells bounded by troughs, as thermal contraction makes them in ice-rich soil."""

from functools import lru_cache

import numpy as np

from rille.terrain.landform import Driver, Landform, border_weight, smooth_step

STEEPEST = 0.61  # [rad] loose soil slides beyond about 35 deg
CHUNK = 1 << 12  # points at a time: their distances to all centres stay in the cache


ROW = np.sqrt(0.75)  # distance of rows of centres over that of centres in a row
# Rows and columns around a point's own in which its neighbours may lie, wherever in their cells they are.
NEAR = [(i, (-1, 0, 1) if abs(i) == 2 else (-2, -1, 0, 1, 2)) for i in (-2, -1, 0, 1, 2)]


@lru_cache(maxsize=16)
def _centres(n_rows, n_cols, irregularity, seed):
    """x and y of the cells' centres in units of their size, each (n_rows, n_cols): rows in turn are shifted by half, each centre strays."""
    rng = np.random.default_rng(seed)
    row, column = np.meshgrid(np.arange(n_rows), np.arange(n_cols), indexing="ij")
    stray = irregularity * rng.uniform(-0.5, 0.5, (2, n_rows, n_cols))
    return column + 0.5 * (row % 2) + stray[0], row * ROW + stray[1]


def profile(x, y, drivers):
    """-depth (1 - product over neighbouring cells of (1 - t(e))), e the distance to the border with that cell.

    t(e) = 1 - 3 u^2 + 2 u^3, u = 2 e / width, falls from 1 on the border to 0 half a trough's width away; the product joins troughs
    smoothly where three cells meet.
    """
    x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
    size, half_x, half_y = drivers["size"], drivers["length"] / 2, drivers["width"] / 2
    shape = int(np.ceil(2 * half_y / (size * ROW))) + 5, int(np.ceil(2 * half_x / size)) + 5
    centres = _centres(*shape, drivers["irregularity"], round(drivers["seed"]))
    inside = (np.abs(x) < half_x) & (np.abs(y) < half_y)
    u, v = (x[inside] + half_x) / size + 2.0, (y[inside] + half_y) / size + 2.0 * ROW
    cut = np.empty(u.shape)
    for start in range(0, len(u), CHUNK):
        part = slice(start, start + CHUNK)
        cut[part] = _trough(u[part], v[part], *centres, drivers["trough_width"] / size / 2.0)
    height = np.zeros(x.shape)
    height[inside] = -drivers["trough_depth"] * cut * border_weight(x[inside], y[inside], half_x, half_y)
    return height


def _trough(u, v, centre_x, centre_y, half_width):
    """1 on the borders of cells, 0 inside. u, v : points (n,) in units of the cell size; half_width : of a trough, likewise."""
    n_cols = centre_x.shape[1]
    flat_x, flat_y = centre_x.ravel(), centre_y.ravel()
    row = np.rint(v / ROW).astype(np.int64)
    across, along, square = np.empty((3, sum(len(columns) for _, columns in NEAR), len(u)))
    k = 0
    for i, columns in NEAR:
        r = row + i
        site = r * n_cols + np.rint(u - 0.5 * (r & 1)).astype(np.int64)
        for j in columns:
            across[k], along[k] = flat_x[site + j] - u, flat_y[site + j] - v
            square[k] = across[k] ** 2 + along[k] ** 2
            k += 1
    nearest, points = square.argmin(axis=0), np.arange(len(u))
    own_x, own_y, least = across[nearest, points], along[nearest, points], square[nearest, points]
    # A border is at least half as far as the distances differ: most neighbours cut nothing here.
    limit = (np.sqrt(least) + 2.0 * half_width) ** 2
    flat = np.ones(u.shape)
    for k in range(len(square)):
        n = np.flatnonzero((square[k] < limit) & (nearest != k))
        apart = np.hypot(across[k, n] - own_x[n], along[k, n] - own_y[n])
        flat[n] *= smooth_step((square[k, n] - least[n]) / (2.0 * apart * half_width))
    return 1.0 - flat


def check(drivers):
    """Sides of troughs no steeper than soil stands; where troughs meet they are up to half as steep again."""
    side = np.arctan(4.5 * drivers["trough_depth"] / drivers["trough_width"])
    if side > STEEPEST:
        return (
            f"troughs {drivers['trough_depth']:g} m deep and {drivers['trough_width']:g} m wide have sides of up to {np.degrees(side):.0f} "
            f"deg; soil slides beyond {np.degrees(STEEPEST):.0f} deg: widen them or make them shallower"
        )
    if drivers["trough_width"] > 0.5 * drivers["size"]:
        return f"troughs {drivers['trough_width']:g} m wide leave nothing of cells of {drivers['size']:g} m; take at most half the size"
    if drivers["length"] * drivers["width"] > 1e6 * drivers["size"] ** 2:
        return f"it would hold more than a million cells of {drivers['size']:g} m; enlarge them or shrink the field"
    return ""


LANDFORM = Landform(
    name="polygonal_pavement",
    meaning="ground cracked into polygons with troughs between them",
    frame="origin at the centre, x along its length, height zero at the level of the polygons",
    source="rille: Voronoi cells; sizes after J. Levy et al. 2009, J. Geophys. Res. 114, E01007",
    drivers=(
        Driver(
            name="length",
            unit="m",
            meaning="extent along x; it fades over the outer tenth at either end",
            lower=1.0,
            upper=10000.0,
            default=40.0,
            reason="at least a few cells",
            source="rille",
        ),
        Driver(
            name="width",
            unit="m",
            meaning="extent along y; it fades over the outer tenth at either side",
            lower=1.0,
            upper=10000.0,
            link=lambda drivers: drivers["length"],
            law="length",
            reason="at least a few cells",
            source="rille",
        ),
        Driver(
            name="size",
            unit="m",
            meaning="mean distance of the centres of neighbouring polygons",
            lower=0.1,
            upper=300.0,
            default=5.0,
            reason="mud cracks measure decimetres, polygons of thermal contraction metres to 25 m, giant ones hundreds of metres",
            source="J. Levy et al. 2009: small polygons on Mars below 25 m",
        ),
        Driver(
            name="trough_width",
            unit="m",
            meaning="brink to brink",
            lower=0.01,
            upper=150.0,
            link=lambda drivers: 0.2 * drivers["size"],
            law="0.2 size (troughs a couple of metres wide between polygons of 10 to 20 m, HiRISE TRA_000828_2495)",
            reason="at most half of a cell is trough",
            source="HiRISE image TRA_000828_2495 (University of Arizona)",
        ),
        Driver(
            name="trough_depth",
            unit="m",
            meaning="depth below the polygons",
            lower=0.001,
            upper=30.0,
            link=lambda drivers: np.tan(0.35) / 3.0 * drivers["trough_width"],
            law="0.12 trough_width: sides of 20 deg, up to 29 deg where troughs meet",
            reason="soil slides beyond 35 deg",
            source="rille",
        ),
        Driver(
            name="irregularity",
            unit="dimensionless",
            meaning="how far centres stray: 0 regular hexagons, 1 half a cell either way",
            lower=0.0,
            upper=1.0,
            default=0.7,
            reason="beyond 1 cells would collapse",
            source="rille",
        ),
        Driver(
            name="seed",
            unit="dimensionless",
            meaning="another number gives another pattern",
            lower=0.0,
            upper=2147483647.0,
            default=1.0,
            reason="a seed is a whole number of 31 bits",
            source="rille",
        ),
    ),
    profile=profile,
    footprint=lambda drivers: (drivers["length"] / 2, drivers["width"] / 2),
    check=check,
    example={"length": 30.0, "width": 20.0, "size": 3.5, "trough_width": 0.9, "trough_depth": 0.12},
)
