"""One ground for everybody: solver, GeoTIFF, every other export, picture and collider; and nothing floats.

The ground is an asymmetric ramp with random relief, landforms, rocks and obstacles, on grids that are not square in any sense, shifted,
and turned on the map: a mirrored, transposed or shifted copy would be off by decimetres.
"""

import json
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
import rasterio
from PIL import Image
from rille._solver import Model, Simulation

from machines import cart
from rille import store
from rille.model import Pose, Scenario
from rille.model.rotation import matrix_of
from rille.terrain import delivery, height_at
from rille.terrain.extraction import extract_from_scene, extract_from_terrain
from rille.view import ground as picture

SCENE = """
name = "agreement"
soil = "lunar_sourcebook"
[base]
kind = "fractal"
size = ["48 m", "26 m"]
center = ["-7 m", "11 m"]
posting = "0.25 m"
hurst = 0.7
median_slope = "6 deg"
seed = 4
[[landform]]
name = "ramp"
landform = "slope"
x = -12
y = 8
heading = "20 deg"
drivers = { angle = "9 deg", length = "12 m", width = "14 m" }
[[landform]]
name = "pit"
landform = "crater"
x = -4
y = 13
drivers = { diameter = "6 m" }
[[population]]
name = "rocks"
landform = "rock"
law = "viper_rocks"
diameter = ["0.5 m", "1.5 m"]
count = 60
seed = 2
collide = "0.6 m"
[[soil_patch]]
name = "p"
soil = "lunar_soft"
polygon = [[-10, 5], [-2, 6], [-5, 14]]
[[obstacle]]
name = "block"
kind = "box"
size = ["1 m", "0.6 m", "0.5 m"]
x = -8
y = 12
embedded = 0.2
roll = "20 deg"
[[obstacle]]
name = "stone"
kind = "rock"
size = ["0.8 m", "0.7 m", "0.6 m"]
x = -6
y = 9
embedded = 0.1
[[obstacle]]
name = "ball"
kind = "sphere"
size = ["0.4 m"]
x = -13
y = 13
embedded = 0.05
[[obstacle]]
name = "drum"
kind = "cylinder"
size = ["0.3 m", "0.9 m"]
x = -9
y = 6
pitch = "70 deg"
"""

# box of the scene's own points; another posting in x and y; turned; turned in a polygon
REGIONS = {
    "whole": {},
    "shifted": {"box": (-19.0, 4.0, 3.0, 17.0)},
    "posting": {"center": (-7.1, 10.3), "size": (18.0, 11.0), "posting": (0.31, 0.17)},
    "coarse": {"center": (-7.0, 10.0), "size": (20.0, 14.0), "posting": (1.0, 0.7)},
    "turned": {"center": (-8.0, 10.5), "size": (15.0, 9.0), "posting": (0.2, 0.15), "heading": 0.65},
}


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """The scene file, with a cache of its own."""
    folder = tmp_path_factory.mktemp("scene")
    path = folder / "scene.toml"
    path.write_text(SCENE)
    patch = pytest.MonkeyPatch()
    patch.setenv("RILLE_CACHE", str(folder / "cache"))
    yield path
    patch.undo()


@pytest.fixture(scope="module")
def pieces(scene):
    """Extracted terrains by name."""
    return {name: extract_from_scene(scene, **where) for name, where in REGIONS.items()}


def solver_model(terrain, path):
    """The solver's model of a cart on that ground, in the middle of it."""
    n_rows, n_cols = terrain.heights.shape
    store.create(path)
    store.write_rover(path, cart(5.0, 0.15, 0.165))
    store.write_terrain(path, terrain)
    at = (terrain.x_west + 0.6 * n_cols * terrain.posting_x, terrain.y_north - 0.3 * n_rows * terrain.posting_y, 0.0)
    scenario = Scenario(name="s", duration=1, terrain=terrain.name, placement="on_terrain", settle_time=0.5, start=Pose(position=at))
    store.write_scenario(path, scenario)
    return path


def points_in(terrain, count=3000, seed=0):
    """Random points (n, 2) of W' inside the grid, on its border and at its corners."""
    n_rows, n_cols = terrain.heights.shape
    east, south = terrain.x_west + (n_cols - 1) * terrain.posting_x, terrain.y_north - (n_rows - 1) * terrain.posting_y
    random = np.random.default_rng(seed)
    inside = np.column_stack([random.uniform(terrain.x_west, east, count), random.uniform(south, terrain.y_north, count)])
    corners = [(terrain.x_west, terrain.y_north), (east, terrain.y_north - 1e-9), (terrain.x_west, south + 1e-9)]
    return np.vstack([inside, corners])


def to_map(terrain, points):
    """Easting and northing of points of W'."""
    c, s = np.cos(terrain.map_heading), np.sin(terrain.map_heading)
    return points @ np.array([[c, s], [-s, c]]) + np.array(terrain.map_origin[:2])


def sampled(path, places):
    """Bilinear values of a raster at map places, by an interpolation that is not ours (scipy), from what the file alone says."""
    from scipy.ndimage import map_coordinates

    with rasterio.open(path) as raster:
        columns, rows = ~raster.transform @ places.T  # of cell corners: centres are at + 0.5
        return map_coordinates(raster.read(1), [np.asarray(rows) - 0.5, np.asarray(columns) - 0.5], order=1, mode="nearest")


@pytest.mark.parametrize("name", REGIONS)
def test_wheel_heights_of_the_solver_equal_the_geotiff(pieces, tmp_path, name):
    """3000 random points, borders and corners: to 1e-6 m (found: 1e-9 m, rounding of coordinates of 1e2 m on slopes of 1)."""
    terrain = pieces[name]
    places = points_in(terrain)
    model = Model(str(solver_model(terrain, tmp_path / "m.db")))
    solver = model.ground_height(places)[:, 0]
    delivery.deliver(terrain, delivery.plan([tmp_path / "t.tif", tmp_path / "t.cog.tif"]))
    for file in ("t.tif", "t.cog.tif"):
        raster = sampled(tmp_path / file, to_map(terrain, places)) - terrain.map_origin[2]
        assert np.abs(raster - solver).max() < 1e-6
    assert np.ptp(solver) > 1.0
    assert np.isnan(model.ground_height(places[:1] + [1e4, 0.0])).all()


@pytest.mark.parametrize("name", ["shifted", "turned"])
def test_wheels_that_stand_on_it_say_so_too(pieces, tmp_path, name):
    """`ground_height` of each wheel after a run, the value in table wheel_state, against the raster below its centre, to 1e-6 m."""
    terrain = replace(pieces[name], obstacles=())  # so that nothing is in the way
    simulation = Simulation(str(solver_model(terrain, tmp_path / "m.db")))
    simulation.settle()
    simulation.step(200)
    wheels = simulation.wheels()
    delivery.deliver(terrain, delivery.plan([tmp_path / "t.tif"]))
    raster = sampled(tmp_path / "t.tif", to_map(terrain, wheels[:, :2])) - terrain.map_origin[2]
    assert np.abs(wheels[:, 3] - raster).max() < 1e-6
    above = np.sort(wheels[:, 2] - wheels[:, 3])
    assert above[1] < 0.4, "wheels of 0.15 m stand on that ground, not elsewhere; on rough ground a stiff cart may lift the others"


@pytest.mark.parametrize("name", REGIONS)
def test_every_export_holds_the_solvers_heights(pieces, tmp_path, name):
    """At every grid point, read from the files alone: exactly where the format can, else to its stated error."""
    import mujoco
    import trimesh

    terrain = pieces[name]
    n_rows, n_cols = terrain.heights.shape
    x = terrain.x_west + np.arange(n_cols) * terrain.posting_x
    y = terrain.y_north - np.arange(n_rows) * terrain.posting_y
    lattice = np.stack([*np.broadcast_arrays(x[None, :], y[:, None])], axis=-1).reshape(-1, 2)
    inner = lattice.reshape(n_rows, n_cols, 2)[1:-1, 1:-1].reshape(-1, 2)
    model = Model(str(solver_model(terrain, tmp_path / "m.db")))
    # inside by a rounding: a point of the border may lie outside of the solver's grid by its last digit
    solver = model.ground_height(np.ascontiguousarray(inner)).reshape(n_rows - 2, n_cols - 2)
    files = [tmp_path / f"t{ending}" for ending in (".npy", ".png", ".obj", ".stl", ".glb", ".mjcf")]
    delivery.deliver(terrain, delivery.plan(files))
    inside = slice(1, -1)

    assert np.abs(np.load(tmp_path / "t.npy")[inside, inside] - solver).max() < 1e-9
    notes = json.loads((tmp_path / "t.png.json").read_text())
    png = notes["offset_m"] + notes["scale_m"] * np.array(Image.open(tmp_path / "t.png")).astype(float)
    assert np.abs(png[inside, inside] - solver).max() <= notes["largest_error_m"] + 1e-9
    obj = np.array([line.split()[1:] for line in (tmp_path / "t.obj").read_text().splitlines() if line.startswith("v ")], float)
    obj = obj[: n_rows * n_cols]  # then obstacles
    assert np.abs(obj[:, 2].reshape(n_rows, n_cols)[inside, inside] - solver).max() < 1e-9
    assert np.abs(obj[:, :2] - lattice).max() < 1e-9
    ground = next(part for part in trimesh.load(tmp_path / "t.glb", process=False).dump() if len(part.vertices) == n_rows * n_cols)
    glb = np.asarray(ground.vertices)
    assert np.abs(glb[:, 1].reshape(n_rows, n_cols)[inside, inside] - solver).max() < 1e-5
    assert np.abs(np.column_stack([glb[:, 0], -glb[:, 2]]) - lattice).max() < 1e-5
    stl = np.asarray(trimesh.load(tmp_path / "t.stl", process=False).triangles).reshape(-1, 3)
    j, i = np.rint((stl[:, 0] - x[0]) / terrain.posting_x).astype(int), np.rint((y[0] - stl[:, 1]) / terrain.posting_y).astype(int)
    assert np.abs(stl[:, 2] - terrain.heights[i, j]).max() < 1e-5
    scene = mujoco.MjModel.from_xml_path(str(tmp_path / "t.mjcf"))
    size, place = scene.hfield_size[0], scene.geom_pos[0]
    field = scene.hfield_data.reshape(n_rows, n_cols)[::-1] * size[2] + place[2]
    assert np.abs(field[inside, inside] - solver).max() < 1e-5
    assert (place[0] - size[0], place[0] + size[0]) == pytest.approx((x[0], x[-1]), abs=1e-9)
    assert (place[1] - size[1], place[1] + size[1]) == pytest.approx((y[-1], y[0]), abs=1e-9)


@pytest.mark.parametrize("name", REGIONS)
def test_the_picture_shows_the_solvers_heights(pieces, tmp_path, name):
    """Every point that the picture draws, inside the grid, to 1e-9 m; between two of them it is within what the ground curves."""
    terrain = pieces[name]
    model = Model(str(solver_model(terrain, tmp_path / "m.db")))
    middle = points_in(terrain, 1, seed=3)[0]
    patch = picture.crop(terrain, middle, reach=4.0)
    drawn = np.stack([*np.broadcast_arrays(patch.x[None, :], patch.y[:, None])], axis=-1).reshape(-1, 2)
    solver = model.ground_height(np.ascontiguousarray(drawn)).reshape(patch.z.shape)
    known = np.isfinite(solver)
    assert known.mean() > 0.9
    assert np.abs(patch.z - solver)[known].max() < 1e-9


def test_a_stored_region_is_the_same_ground_for_the_solver(scene, pieces, tmp_path):
    """Cut from the database at its own points, the solver finds the very same heights at the same places."""
    path = solver_model(pieces["whole"], tmp_path / "whole.db")
    lazy = store.read_terrain(path, "agreement", heights=False)
    piece = extract_from_terrain(lazy, box=(-19.0, 4.0, 3.0, 17.0))
    places = points_in(piece)
    a = Model(str(path)).ground_height(places)
    b = Model(str(solver_model(piece, tmp_path / "piece.db"))).ground_height(places)
    assert np.nanmax(np.abs(a - b)) < 1e-9
    assert np.array_equal(piece.heights, pieces["shifted"].heights)


def surface_points(obstacle):
    """Corners of its hull or box, or points of its skin, in W'."""
    if obstacle.vertices is not None:
        local = obstacle.vertices
    elif obstacle.kind == "box":
        local = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) * np.array(obstacle.size) / 2
    else:
        around = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        if obstacle.kind == "cylinder":
            radius, tall = obstacle.size
            ring = np.column_stack([radius * np.cos(around), radius * np.sin(around)])
            local = np.vstack([np.column_stack([ring, np.full(24, end)]) for end in (-tall / 2, tall / 2)])
        else:
            polar = np.linspace(0, np.pi, 13)
            directions = [[np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)] for p in polar for a in around]
            local = obstacle.size[0] * np.array(directions)
    return local @ matrix_of(obstacle.pose.rotation).T + np.array(obstacle.pose.position)


@pytest.mark.parametrize("name", REGIONS)
def test_nothing_floats(pieces, tmp_path, name):
    """Every obstacle and every rock's collision body has a point below the ground that the solver knows there, and one above it where the
    grid is fine enough to hold the rock at all; on random ground of 6 degrees, at every posting."""
    terrain = pieces[name]
    model = Model(str(solver_model(terrain, tmp_path / "m.db")))
    rocks = [o for o in terrain.obstacles if o.name.startswith("rocks")]
    assert len(rocks) >= 3
    assert {"block", "stone", "drum"} <= {o.name for o in terrain.obstacles}
    for obstacle in terrain.obstacles:
        points = surface_points(obstacle)
        below = points[:, 2] - model.ground_height(np.ascontiguousarray(points[:, :2]))[:, 0]
        if np.isfinite(below).any():
            assert np.nanmin(below) < 0, f"{obstacle.name} floats {np.nanmin(below):.3f} m above the ground"
    stated = [o for o in terrain.obstacles if o not in rocks]
    for obstacle in stated:
        points = surface_points(obstacle)
        below = points[:, 2] - model.ground_height(np.ascontiguousarray(points[:, :2]))[:, 0]
        assert np.nanmax(below) > 0.1, f"{obstacle.name} is buried"


@pytest.mark.parametrize("slope", [0, 20, 35])
def test_tilted_obstacles_touch_steep_ground(tmp_path, slope):
    """Drums, beams and rocks, hardly embedded, in every heading: the lowest of their points reaches the ground (to 3 mm: 24 points on a
    circle of 0.3 m). A drum pitched by 70 deg ended 0.11 m above a slope of 20 deg as long as only the ground at its centre counted."""
    kinds = (
        ("cylinder", "[0.3, 1.0]", 'pitch = "70 deg"'),
        ("box", "[2.0, 0.2, 0.2]", 'pitch = "30 deg"'),
        ("rock", "[0.9, 0.5, 0.3]", 'roll = "50 deg"'),
    )
    blocks = [
        f'[[obstacle]]\nname = "{kind}{k}"\nkind = "{kind}"\nsize = {size}\nx = {2 * k - 8}\ny = 0\nembedded = 0.0\n'
        f'heading = "{45 * k} deg"\n{tilt}\n'
        for kind, size, tilt in kinds
        for k in range(8)
    ]
    path = tmp_path / "steep.toml"
    base = f'[base]\nkind = "plane"\nslope = "{slope} deg"\nsize = [24, 10]\nposting = 0.5\n'
    path.write_text('name = "steep"\nsoil = "lunar_sourcebook"\n' + "".join(blocks) + base)
    terrain = extract_from_scene(path)
    for obstacle in terrain.obstacles:
        points = surface_points(obstacle)
        assert (points[:, 2] - height_at(terrain, points[:, 0], points[:, 1])).min() < 3e-3, obstacle.name


def test_the_database_holds_the_soils_that_wheels_meet(pieces, tmp_path):
    """The soil layer, read by hand from the tiles, against the polygon at the points: one ground, one soil."""
    import sqlite3

    terrain = pieces["turned"]
    path = solver_model(terrain, tmp_path / "m.db")
    seen = store.read_window(path, terrain.name, layer="soil")
    with closing(sqlite3.connect(path)) as connection:
        keys = dict(connection.execute("SELECT name, id FROM soil"))
    assert set(np.unique(seen.values)) == {keys["lunar_sourcebook"], keys["lunar_soft"]}
    delivery.deliver(terrain, delivery.plan([tmp_path / "t.soil.tif"]))
    with rasterio.open(tmp_path / "t.soil.tif") as raster:
        assert np.array_equal(raster.read(1) == 1, seen.values == keys["lunar_soft"])
