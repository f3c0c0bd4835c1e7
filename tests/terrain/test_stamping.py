"""Populations stamped by the compiled loop, against the profiles of their landforms point by point."""

import math
import threading
from dataclasses import replace

import numpy as np
import pytest

from rille import _terrain
from rille.model import InputRefused, Population
from rille.terrain import landforms
from rille.terrain.grid import Grid, Window
from rille.terrain.landform import Landform, Radial
from rille.terrain.radial_table import tabulate
from rille.terrain.stamping import stamp, stamp_points


def radial(shape, *, state=None, reach=1.0, crowd="add"):
    """A landform of half axes ``a``, ``b`` and height ``h``."""
    return Landform(
        name="form",
        meaning="",
        frame="",
        source="",
        drivers=(),
        footprint=lambda d: (d["a"] * reach, d["b"] * reach),
        example={},
        crowd=crowd,
        radial=Radial(semi_axes=lambda d: (d["a"], d["b"]), amplitude=lambda d: d["h"], shape=shape, state=state, reach=reach),
    )


def bell(r, state):
    return np.where(r < 1, (1 - np.minimum(r, 1) ** 2) ** 2, 0.0)


def worn(r, state):
    """A bowl to 0.6 that fills with the state, a rim with a kink and a jump, a flank to 1.25."""
    bowl = -np.cos(r / 0.6 * math.pi / 2) * np.exp(-state) + 0.2
    return np.select([r < 0.6, r < 1.25], [bowl, 0.3 * (1.25 - r)], 0.0)


BELL = radial(bell)
WORN = radial(worn, state=lambda d: d["s"], reach=1.25)
ROCK = radial(lambda r, state: np.sqrt(np.maximum(1 - r**2, 0.0)), crowd="max")

GRID = Grid(n_rows=150, n_cols=210, posting_x=0.5, posting_y=0.4, x_west=-50.0, y_north=31.0)
TURNED = replace(GRID, origin=(7.0, -3.0), heading=0.6)


def population(n=60, seed=3, **more):
    """Forms of many sizes, some beyond the border of the grid, some smaller than a cell."""
    random = np.random.default_rng(seed)
    a = np.exp(random.uniform(-2, 2.7, n))
    drivers = {
        "a": a,
        "b": np.where(np.arange(n) % 3 == 0, a, a * random.uniform(0.1, 1.0, n)),
        "h": random.normal(size=n),
        "s": np.where(np.arange(n) % 2 == 0, random.random(n), 0.25),
    }
    facts = {"x": random.uniform(-70, 70, n), "y": random.uniform(-45, 45, n), "heading": random.uniform(-9, 9, n), "drivers": drivers}
    return Population(name="many", landform="form", **{**facts, **more})


def by_profile(grid, landform, population):
    """What each form adds at each value of a grid (n, n_rows, n_cols), by the landform's own profile."""
    x, y = grid.points(grid.whole)
    layers = []
    for k in range(len(population.x)):
        dx, dy = x - population.x[k], y - population.y[k]
        cosine, sine = math.cos(population.heading[k]), math.sin(population.heading[k])
        drivers = {name: float(values[k]) for name, values in population.drivers.items()}
        s = population.scale
        layers.append(s * landform.profile((cosine * dx + sine * dy) / s, (cosine * dy - sine * dx) / s, drivers))
    return np.array(layers)


def stamped(grid, landform, population, *, threads=1, ground=0.0):
    """Heights of a whole grid."""
    heights = np.full(grid.shape, ground)
    stamp(heights, grid.whole, grid, landform, population, threads=threads)
    return heights


@pytest.mark.parametrize("grid", [GRID, TURNED], ids=["straight", "turned"])
def test_smooth_forms_equal_their_profile(grid):
    """2e-7 of each height: the error that the table states is below 1e-7."""
    many = population()
    truth = by_profile(grid, BELL, many).sum(axis=0)
    found = stamped(grid, BELL, many)
    assert np.abs(truth).max() > 1
    assert np.abs(found - truth).max() < 2e-7 * np.abs(many.drivers["h"]).sum()


@pytest.mark.parametrize("grid", [GRID, TURNED], ids=["straight", "turned"])
def test_kinks_jumps_and_states_keep_their_place(grid):
    """1e-6 of each height: the errors that the table states, 1e-7 in r and 5e-7 in the state, although shapes have a kink and a jump."""
    many = population(scale=1.3)
    table = tabulate(WORN.radial)
    assert table.knots == pytest.approx([0, 0.6 / 1.25, 1], abs=1e-11)
    assert table.error_r <= 1e-7
    assert table.error_state <= 5e-7
    truth = by_profile(grid, WORN, many).sum(axis=0)
    assert np.abs(stamped(grid, WORN, many) - truth).max() < 1e-6 * np.abs(many.drivers["h"]).sum()


def test_the_highest_of_a_crowd_counts():
    """Hemispheres have slopes without bound at their border: 2e-6 of the height, the error that the table states of their inside."""
    n = 40
    random = np.random.default_rng(1)
    a = random.uniform(1, 6, n)
    drivers = {"a": a, "b": 0.5 * a, "h": random.uniform(-0.5, 2, n)}
    many = population(n, x=random.uniform(-12, 12, n), y=random.uniform(-12, 12, n), drivers=drivers)
    layers = by_profile(GRID, ROCK, many)
    truth = np.maximum(layers.max(axis=0), 0.0)
    found = stamped(GRID, ROCK, many, ground=-3.0) + 3.0
    assert (layers > 0).sum(axis=0).max() > 4
    assert (layers < 0).any()
    assert np.abs(found - truth).max() < 2e-6 * 2.0


def test_a_table_says_its_error():
    """Errors found at random places are below those that the table states; a form of a state that is a row of the table is the row."""
    table = tabulate(WORN.radial)
    states = np.array([0.0, 0.5, 1.0])
    assert np.all(table.position(states) == np.round(table.position(states)))
    state = np.random.default_rng(0).random(50)
    t = table.position(state) / (table.shapes.n_states - 1)
    assert t * t * (5 + 4 * t) / 9 == pytest.approx(state, abs=1e-12)
    line = Grid(n_rows=1, n_cols=3001, posting_x=0.0005, posting_y=1.0, x_west=0.0, y_north=0.0)
    r = line.axes(line.whole)[0]
    for k in range(50):
        one = population(1, x=np.zeros(1), y=np.zeros(1), drivers={name: np.ones(1) for name in "abh"} | {"s": state[k : k + 1]})
        error = np.abs(stamped(line, WORN, one)[0] - worn(r, state[k])).max()
        assert error < 1.5 * (table.error_r + table.error_state) * 0.8


@pytest.mark.parametrize("landform", [BELL, WORN, ROCK], ids=["bell", "worn", "rock"])
def test_tiles_and_threads_change_no_byte(landform):
    many = population(n=400)
    grid = replace(TURNED, n_rows=600, n_cols=700, posting_x=0.15, posting_y=0.1)
    whole = stamped(grid, landform, many, ground=2.0)
    assert stamped(grid, landform, many, threads=5, ground=2.0).tobytes() == whole.tobytes()
    for size in (53, 256):
        tiled = np.full(grid.shape, 2.0)
        for tile in grid.tiles(size):
            stamp(tiled[tile.slices], tile, grid, landform, many, threads=2)
        assert tiled.tobytes() == whole.tobytes()


def test_tiles_on_two_python_threads_change_no_byte():
    many = population(n=400)
    whole = stamped(GRID, WORN, many)
    tiled = np.zeros(GRID.shape)
    tiles = GRID.tiles(40)

    def work(mine):
        for tile in mine:
            stamp(tiled[tile.slices], tile, GRID, WORN, replace(many), threads=1)

    both = [threading.Thread(target=work, args=(tiles[k::2],)) for k in range(2)]
    for thread in both:
        thread.start()
    for thread in both:
        thread.join()
    assert tiled.tobytes() == whole.tobytes()


def test_whole_cells_shift_the_same_bytes():
    """Numbers of cells and postings are chosen to be exact in binary."""
    grid = replace(GRID, posting_x=0.5, posting_y=0.25, x_west=-48.0, y_north=24.0)
    random = np.random.default_rng(2)
    many = population()
    many = replace(many, x=random.integers(-100, 100, 60) / 8, y=random.integers(-100, 100, 60) / 8)
    whole = stamped(grid, WORN, many)
    moved = stamped(grid, WORN, replace(many, x=many.x + 4.0, y=many.y - 1.0))
    assert np.any(whole)
    assert moved[4:, 8:].tobytes() == whole[:-4, :-8].tobytes()


def test_nothing_outside_the_window_or_the_form():
    one = Population(name="one", landform="form", x=np.array([0.0]), y=np.array([0.0]), heading=np.array([0.3]),
                     drivers={"a": np.array([9.0]), "b": np.array([4.0]), "h": np.array([1.0])})  # fmt: skip
    heights = np.zeros(GRID.shape)
    window = Window(row0=60, row1=80, col0=90, col1=120)
    stamp(heights[window.slices], window, GRID, BELL, one)
    assert np.any(heights[window.slices])
    heights[window.slices] = 0
    assert not np.any(heights)
    outside = by_profile(GRID, BELL, one)[0] == 0
    assert not np.any(stamped(GRID, BELL, one)[outside])


def test_points_equal_the_grid():
    """Coordinates are formed in another frame, so rounding of 1e-14 of a slope of some units may show."""
    many = population()
    heights = np.full(GRID.shape, 1.0)
    stamp(heights, GRID.whole, GRID, WORN, many)
    x, y = GRID.points(GRID.whole)
    found = np.full(x.size, 1.0)
    stamp_points(found, x.ravel(), y.ravel(), WORN, many)
    assert np.abs(found - heights.ravel()).max() < 1e-11


@pytest.mark.parametrize("name", ["crater", "degraded_crater"])
def test_craters_of_the_library(name):
    """Craters to 1 km across: below a tenth of a millimetre where the table is exact in the state, else its stated error."""
    landform = landforms()[name]
    random = np.random.default_rng(5)
    d = 10 ** random.uniform(0.5, 3, 25)
    cases = [landform.values({"diameter": float(v), **({"age": float(a)} if name == "degraded_crater" else {})}, "it") for v, a in
             zip(d, random.uniform(1e14, 1e17, 25), strict=True)]  # fmt: skip
    drivers = {key: np.array([case[key] for case in cases]) for key in cases[0]}
    grid = Grid(n_rows=120, n_cols=90, posting_x=10.0, posting_y=9.0, x_west=-450.0, y_north=540.0)
    many = Population(name="c", landform=name, x=random.uniform(-400, 400, 25), y=random.uniform(-400, 400, 25), heading=np.zeros(25),
                      drivers=drivers)  # fmt: skip
    table = tabulate(landform.radial)
    error = np.abs(stamped(grid, landform, many) - by_profile(grid, landform, many).sum(axis=0)).max()
    if name == "crater":
        assert error < 1e-4
    assert error < (table.error_r + table.error_state) * 0.3 * d.sum()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"x": np.array([math.nan, 0.0])}, r"the x \[m\] of form 0 .* is nan"),
        ({"heading": np.array([0.0, math.inf])}, "heading .* of form 1"),
        ({"a": np.array([1.0, 0.0])}, "form 1 .* semi-axes"),
        ({"a": np.array([1.0, -2.0])}, "form 1 .* semi-axes"),
        ({"h": np.array([1.0, math.nan])}, "amplitude .* of form 1"),
        ({"s": np.array([math.nan, 1.0])}, "state of form 0"),
        ({"a": np.array([1.0, 1e-30])}, "form 1 .* infinitely small"),
    ],
)
def test_populations_that_make_no_sense_are_refused(change, words):
    facts = {name: np.zeros(2) for name in ("x", "y", "heading")} | {name: np.ones(2) for name in "abhs"} | change
    drivers = {name: facts.pop(name) for name in "abhs"}
    heights = np.zeros(GRID.shape)
    with pytest.raises(InputRefused, match=words):
        stamp(heights, GRID.whole, GRID, WORN, Population(name="p", landform="form", drivers=drivers, **facts))
    assert not np.any(heights)


def test_arrays_that_do_not_fit_are_refused():
    many = population(5)
    with pytest.raises(ValueError, match="shape"):
        stamp(np.zeros((3, 4)), GRID.whole, GRID, BELL, many)
    with pytest.raises(ValueError, match="side by side"):
        stamp(np.zeros(GRID.shape, order="F"), GRID.whole, GRID, BELL, many)
    with pytest.raises(TypeError):
        stamp(np.zeros(GRID.shape, np.float32), GRID.whole, GRID, BELL, many)
    frozen = np.zeros(GRID.shape)
    frozen.flags.writeable = False
    with pytest.raises(TypeError):
        stamp(frozen, GRID.whole, GRID, BELL, many)
    for threads in (0, -1, 100000):
        with pytest.raises(ValueError, match="threads"):
            stamp(np.zeros(GRID.shape), GRID.whole, GRID, BELL, many, threads=threads)
    with pytest.raises(ValueError, match="one per form"):
        _terrain.RadialForms(np.zeros(2), np.zeros(2), np.ones((3, 2, 2)), np.ones(2), np.zeros(2))
    with pytest.raises(TypeError):
        _terrain.RadialForms(np.zeros(2), np.zeros(2), np.ones((2, 2)), np.ones(2), np.zeros(2))
    with pytest.raises(ValueError, match="need"):
        _terrain.RadialShapes(np.array([0.0, 1.0]), np.array([4]), np.zeros((1, 3, 2)))


def test_a_shape_that_is_not_finite_is_refused():
    with pytest.raises(InputRefused, match=r"shape .* must be finite"):
        stamped(GRID, radial(lambda r, state: np.where(r < 0.5, np.nan, 0.0)), population(3))


def test_an_empty_population_changes_nothing():
    assert not np.any(stamped(GRID, BELL, population(0)))
