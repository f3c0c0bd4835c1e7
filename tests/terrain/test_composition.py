"""The recipe of a ground: blending rules, order of age, datums, tiles, turned grids."""

from dataclasses import replace

import numpy as np
import pytest

from rille.model import InputRefused, Population
from rille.terrain.base.plane import Plane
from rille.terrain.composition import compose
from rille.terrain.crowd import Crowd
from rille.terrain.grid import Grid, Window
from rille.terrain.landform import border_weight
from terrain_forms import BOWL, at, crowd, form

STEEP = replace(BOWL, radial=replace(BOWL.radial, shape=lambda r, state: np.sqrt(np.maximum(1 - r**2, 0.0))))
GRID = Grid(n_rows=97, n_cols=129, posting_x=0.125, posting_y=0.125, x_west=-8.0, y_north=6.0)


def ground(*items, slope=0.2, direction=0.3, grid=GRID):
    """Items on a plane."""
    return compose(grid, Plane(slope=slope, direction=direction), items, {"bowl": BOWL})[0]


def plane(grid=GRID, slope=0.2, direction=0.3):
    x, y = grid.points(grid.whole)
    return np.tan(slope) * (np.cos(direction) * x + np.sin(direction) * y)


def test_add_keeps_the_relief_below():
    """z = g + p: the ground rises by 0.5 m inside the block and nowhere else; float64 of a few metres keeps 1e-14."""
    rise = ground(at(form())).render(GRID, GRID.whole) - plane()
    x, y = GRID.points(GRID.whole)
    inside = (np.abs(x) <= 1) & (np.abs(y) <= 0.5)
    assert rise[inside] == pytest.approx(0.5, abs=1e-13)
    assert not rise[~inside].any()


def test_replace_puts_its_own_shape_on_the_plane_that_fits():
    """On a plane the datum is that plane exactly (least squares of points on it), so with weight 1 the block is the same as added. On the
    bump of an older landform, which it wipes out, nothing of it is left at the centre."""
    full = form("replace", weight=lambda x, y, drivers: np.ones_like(x))
    alone = ground(at(full)).render(GRID, GRID.whole)
    assert alone == pytest.approx(ground(at(form())).render(GRID, GRID.whole), abs=1e-12)
    bump = form(name="bump", footprint=lambda d: (0.3, 0.3))
    assert ground(at(bump), at(full)).render(GRID, GRID.whole) == pytest.approx(alone, abs=1e-12)
    assert ground(at(full), at(bump)).render(GRID, GRID.whole)[48, 64] == pytest.approx(alone[48, 64] + 0.5, abs=1e-12)


def test_max_stands_upright_on_the_lowest_ground_under_it():
    """Its top is level: 0.5 m above the lowest of the ground around it, which is found exactly at x = -1; where the ground is higher, the
    ground stays."""
    found = ground(at(form("max")), slope=0.6, direction=0.0).render(GRID, GRID.whole)
    bare = plane(slope=0.6, direction=0.0)
    changed = found != bare
    assert np.ptp(found[changed]) < 1e-12
    assert found[changed][0] == pytest.approx(0.5 - np.tan(0.6), abs=1e-12)
    assert (found >= bare).all()


def test_drape_fills_hollows_and_never_digs():
    pit = form(name="pit", profile=lambda x, y, d: -1.0 + 0 * x, footprint=lambda d: (0.3, 0.3))
    sheet = form("drape", weight=lambda x, y, d: border_weight(x, y, 1.0, 0.5, 0.1))
    found = ground(at(pit), at(sheet)).render(GRID, GRID.whole)
    assert found[48, 64] == pytest.approx(plane()[48, 64] + 0.5, abs=1e-12)  # the pit is gone
    assert (found >= ground(at(pit)).render(GRID, GRID.whole) - 1e-12).all()
    assert (ground(at(sheet), slope=0.0).render(GRID, GRID.whole) >= 0).all()


def test_scale_enlarges_in_all_directions():
    found = ground(at(form(), scale=2.0), slope=0.0).render(GRID, GRID.whole)
    x, y = GRID.points(GRID.whole)
    assert found == pytest.approx(np.where((np.abs(x) <= 2) & (np.abs(y) <= 1), 1.0, 0.0))


def everything():
    """All kinds of items over each other."""
    return ground(
        at(form(), 1, 1, 0.4),
        crowd(),
        at(form("replace"), -2, 1, 0.8, 2.0),
        at(form("max"), 3, -2, -0.5),
        at(form("drape"), -1, -1, 1.0, 3.0),
    )


def test_tiles_hold_the_bytes_of_the_whole():
    """A window is a pure function of the recipe, so cutting it anywhere changes no bit."""
    composition = everything()
    whole = composition.render(GRID, GRID.whole)
    for size in (7, 32, 100):
        for tile in GRID.tiles(size):
            assert composition.render(GRID, tile).tobytes() == np.ascontiguousarray(whole[tile.slices]).tobytes()


def test_a_turned_grid_sees_the_same_ground():
    """Heights of a grid turned by 37 degrees, non-square and shifted, equal those asked for at its points in W. The forms are evaluated
    in both cases, not interpolated: what is left is the rounding of the rotation (1e-15 of 10 m) times slopes, except where a point
    lies on an edge of a block within that rounding, and the table of the radial forms (the same in both)."""
    composition = everything()
    turned = Grid(
        n_rows=41, n_cols=23, posting_x=0.11, posting_y=0.17, x_west=-1.0, y_north=3.0, origin=(0.7, -0.4), heading=np.radians(37)
    )
    x, y = turned.points(turned.whole)
    found = composition.render(turned, turned.whole)
    there = composition.at(x.ravel(), y.ravel()).reshape(found.shape)
    assert np.mean(np.abs(found - there) > 1e-9) < 2e-3


def test_the_younger_lies_on_the_older():
    cut, fill = (form("replace", name=n, profile=lambda x, y, d, h=h: h + 0 * x) for n, h in (("cut", -1.0), ("fill", 1.0)))
    first = ground(at(cut), at(fill), slope=0.0).render(GRID, GRID.whole)[48, 64]
    last = ground(at(fill), at(cut), slope=0.0).render(GRID, GRID.whole)[48, 64]
    assert (first, last) == pytest.approx((1.0, -1.0))


def test_a_datum_of_another_grid_is_not_taken():
    """Between the points of another grid the same plane differs by rounding; a datum that was known there is found anew here."""
    coarse = Grid(n_rows=49, n_cols=65, posting_x=0.25, posting_y=0.25, x_west=-8.0, y_north=6.0)
    shifted = Grid(n_rows=160, n_cols=200, posting_x=0.1, posting_y=0.1, x_west=-9.95, y_north=7.95)
    items = [at(form("replace"), x, 0.3 * x, 0.7, 2.0) for x in (-3.0, -1.0, 0.1, 1.0, 2.0)]
    base = Plane(slope=0.2, direction=0.3)
    for one, other in ((coarse, shifted), (shifted, coarse)):
        _, known = compose(one, base, items, {})
        assert compose(other, base, items, {}, known)[1] == compose(other, base, items, {})[1]


def test_the_window_of_a_population_holds_all_that_it_changes():
    """Forms whose border lies on points of the grid but for rounding (0.3 m on 0.1 m): nothing outside the window changes by a bit."""
    grid = Grid(n_rows=200, n_cols=200, posting_x=0.1, posting_y=0.1, x_west=-7.3, y_north=11.9)
    r = np.random.default_rng(4)
    for _ in range(200):
        x, y, radius = (np.round(r.uniform(*span, 1), 1) for span in ((-6.0, 6.0), (-6.0, 8.0), (0.2, 3.0)))
        drivers = {"radius": radius, "height": np.array([1e9])}
        many = Crowd(population=Population(name="one", landform="bowl", x=x, y=y, heading=0 * x, drivers=drivers), landform=STEEP)
        heights = np.zeros(grid.shape)
        many.stamp(heights, grid, grid.whole)
        heights[many.window(grid).slices] = 0.0
        assert not heights.any()


def test_a_population_must_be_radial():
    few = crowd(3).population
    with pytest.raises(InputRefused, match="not a radial form"):
        Crowd(population=few, landform=form())


def test_a_window_outside_a_landform_is_left_alone():
    window = Window(row0=0, row1=5, col0=0, col1=5)
    assert ground(at(form())).render(GRID, window).tobytes() == np.ascontiguousarray(plane()[window.slices]).tobytes()
