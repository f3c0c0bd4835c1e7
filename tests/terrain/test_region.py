"""Regions: which points, in which frame, what of the scene comes along, and what is refused.

The grid of the scene is not square in any sense and does not have its origin in its middle.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from machines import LUNAR_SOIL
from rille import store
from rille.model import InputRefused, LandformInstance, MaterialPair, Obstacle, Population, Pose, SoilPatch, Terrain
from rille.model.grid import bilinear
from rille.model.polygon import soil_codes
from rille.model.rotation import from_rpy, matrix_of, quaternion
from rille.terrain import landforms
from rille.terrain.extraction import extract_from_scene, extract_from_terrain
from rille.terrain.grid import Grid
from rille.terrain.region import MapFrame, ResampledSurface, make_region, terrain_of_region
from rille.terrain.scene import composed

GRID = Grid(n_rows=41, n_cols=61, posting_x=0.5, posting_y=0.25, x_west=-8.0, y_north=6.0)  # x -8..22, y -4..6
FRAME = MapFrame(origin=(1000.0, -500.0), heading=0.4)


def plane(x, y):
    """An asymmetric ramp, which bilinear interpolation keeps exactly."""
    return 0.3 * x - 0.17 * y + 2.0


def ground(**more):
    """The ramp on the grid, with something of everything on it."""
    x, y = GRID.axes(GRID.whole)
    hull = np.array([[a, b, c] for a in (-0.5, 0.5) for b in (-0.2, 0.2) for c in (-0.3, 0.3)])
    place = Pose(position=(10.0, 1.0, float(plane(10.0, 1.0)) + 0.1), rotation=quaternion(from_rpy(0.2, -0.1, 0.9)))
    values = {
        "name": "ramp",
        "heights": plane(x[None, :], y[:, None]),
        "posting_x": 0.5,
        "posting_y": 0.25,
        "x_west": -8.0,
        "y_north": 6.0,
        "soil": LUNAR_SOIL.name,
        "soils": (LUNAR_SOIL, replace(LUNAR_SOIL, name="hard"), replace(LUNAR_SOIL, name="far")),
        "pairs": tuple(MaterialPair(response="bekker_wong", soil=name) for name in (LUNAR_SOIL.name, "hard", "far")),
        "patches": (
            SoilPatch(name="a", soil="hard", polygon=((9.0, 0.0), (12.0, 0.5), (10.0, 3.0))),
            SoilPatch(name="b", soil="far", polygon=((-7.0, 5.0), (-6.0, 5.0), (-6.0, 4.0))),
        ),
        "landforms": (
            LandformInstance(name="near", landform="mound", x=10.5, y=1.5, heading=0.3, drivers={"diameter": 2.0, "height": 0.4}),
            LandformInstance(name="far", landform="mound", x=-6.0, y=-2.0, drivers={"diameter": 2.0, "height": 0.4}),
            LandformInstance(name="own", landform="not in the register", x=-6.0, y=-2.0),
        ),
        "obstacles": (
            Obstacle(name="rock", kind="hull", pose=place, vertices=hull),
            Obstacle(name="far", kind="sphere", pose=Pose(position=(-7.0, -3.0, 0.0)), size=(0.3,)),
        ),
        "crs": "IAU_2015:30110",
        "map_origin": (1000.0, -500.0, 77.0),
        "map_heading": 0.4,
    }
    return Terrain(**(values | more))


def test_without_a_posting_points_are_those_of_the_scene():
    """Box from 1.1 to 4.9 m: points at 1.5 ... 4.5 m of the scene's 0.5 m; exactly, and no others."""
    region = make_region(GRID, box=(1.1, -1.05, 4.9, 2.05))
    x, y = region.grid.axes(region.grid.whole)
    assert x.tolist() == [1.5 + 0.5 * k for k in range(7)]
    assert y.tolist() == [2.0 - 0.25 * k for k in range(13)]
    assert region.grid.aligned
    piece = extract_from_terrain(ground(), box=(4.9, 2.05, 1.1, -1.05))  # corners in any order
    assert np.array_equal(piece.heights, ground().heights[16:29, 19:26])
    assert make_region(GRID).grid == GRID


def test_a_posting_and_a_size_are_kept_as_asked():
    region = make_region(GRID, center=(3.03, 1.01), size=(4.0, 2.0), posting=(0.1, 0.25))
    x, y = region.grid.points(region.grid.whole)
    assert region.grid.shape == (9, 41)
    assert (x.min(), x.max(), y.min(), y.max()) == pytest.approx((1.03, 5.03, 0.01, 2.01), abs=1e-12)
    odd = make_region(GRID, center=(3.0, 1.0), size=(4.0, 2.0), posting=(0.3, 0.7)).grid  # no multiple: inside, in the middle
    assert odd.shape == (3, 14)
    x, y = odd.points(odd.whole)
    assert (x.min() + x.max(), y.min() + y.max()) == pytest.approx((6.0, 2.0), abs=1e-12)
    assert np.ptp(x) == pytest.approx(3.9)


@pytest.mark.parametrize("heading", [0.6, -2.9, math.pi / 2])
def test_a_turned_region_has_its_own_frame_around_its_middle(heading):
    region = make_region(GRID, center=(7.0, 1.0), size=(3.0, 5.0), posting=(0.5, 0.25), heading=heading)
    x, y = region.grid.axes(region.grid.whole)
    assert (x[0], x[-1], y[0], y[-1]) == pytest.approx((-1.5, 1.5, 2.5, -2.5), abs=1e-12)
    assert region.grid.origin == pytest.approx((7.0, 1.0), abs=1e-12)
    sx, sy = region.grid.points(region.grid.whole)
    step = np.array([sx[0, 1] - sx[0, 0], sy[0, 1] - sy[0, 0]])
    assert step == pytest.approx(0.5 * np.array([math.cos(heading), math.sin(heading)]), abs=1e-12)
    stated = make_region(GRID, center=(7.0, 1.0), size=(3.0, 5.0), posting=(0.5, 0.25), heading=heading, origin=(6.0, 0.5))
    assert stated.grid.origin == (6.0, 0.5)
    for a, b in zip(stated.grid.points(stated.grid.whole), (sx, sy), strict=True):
        assert a == pytest.approx(b, abs=1e-12)


def test_map_coordinates_and_headings_count_on_the_map():
    """The same region, said in W and on a map that is turned by 0.4 rad against it."""
    local = make_region(GRID, FRAME, center=(7.0, 1.0), size=(3.0, 5.0), heading=0.2)
    east, north = (float(v) for v in FRAME.to_map(7.0, 1.0))
    mapped = make_region(GRID, FRAME, center=(east, north), size=(3.0, 5.0), heading=0.6, in_map=True)
    assert mapped.grid.shape == local.grid.shape
    for a, b in zip(mapped.grid.points(mapped.grid.whole), local.grid.points(local.grid.whole), strict=True):
        assert a == pytest.approx(b, abs=1e-9)
    box = make_region(GRID, FRAME, box=(east - 1, north - 2, east + 1, north + 2), in_map=True).grid
    e, n = FRAME.to_map(*box.points(box.whole))
    assert (e.min(), e.max(), n.min(), n.max()) == pytest.approx((east - 1, east + 1, north - 2, north + 2), abs=1e-9)
    assert np.ptp(n[0]) < 1e-9, "rows of a region in map coordinates run east"


def test_a_polygon_keeps_its_border_and_nothing_else():
    """Points that shapely covers, with corners and edges on grid points; a posting that is no fraction in binary."""
    from shapely import Polygon, covers, points

    corners = [(1.0, 0.0), (6.0, 0.0), (6.0, 4.0), (3.0, 1.0)]
    piece = extract_from_terrain(ground(), polygon=corners)
    x, y = piece.x_west + 0.5 * np.arange(piece.heights.shape[1]), piece.y_north - 0.25 * np.arange(piece.heights.shape[0])
    assert (x[0], x[-1], y[0], y[-1]) == (1.0, 6.0, 4.0, 0.0)
    inside = covers(Polygon(corners), points(*np.broadcast_arrays(x[None, :], y[:, None])))
    assert np.array_equal(np.isfinite(piece.heights), inside)
    assert np.nanmax(np.abs(piece.heights - plane(x[None, :], y[:, None]))) < 1e-12
    square = extract_from_terrain(ground(), polygon=[(1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)], posting=(0.1, 0.1), heading=0.3)
    assert np.isfinite(square.heights).sum() == pytest.approx(121, abs=25)  # 1 m^2 at 0.1 m, turned: its border decides


def test_a_turned_polygon_may_reach_to_the_border_of_the_scene():
    """Its box lies partly outside; only the polygon itself must be inside."""
    piece = extract_from_terrain(ground(), polygon=[(-8.0, 1.0), (0.0, 6.0), (0.0, 1.0)], heading=0.8)
    assert np.isfinite(piece.heights).sum() > 100


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ({"box": (0, 0, 30, 2)}, r"reaches x = 30\.00 m, y = 0\.00 m.*x -8\.00 to 22\.00 m and y -4\.00 to 6\.00 m"),
        ({"center": (20, 4), "size": (3, 3), "heading": 0.7}, r"outside the scene, which spans"),
        ({"polygon": [(0, 0), (1, 7), (2, 0)]}, r"reaches x = 1\.00 m, y = 7\.00 m"),
        ({"center": (0.0, 0.0), "size": (3, 3), "in_map": True}, r"E = .*N = .*spans E 9.* to 10.* m and N -5.* to -4"),
        ({"box": (0, 0, 1, 1), "size": (1, 1)}, "given twice"),
        ({"center": (0, 0)}, "center but no size"),
        ({"size": (-1, 1)}, "-1 m x 1 m; both must be above 0"),
        ({"size": (0.1, 1)}, r"0\.1 m x 1 m, which holds . x . points 0\.5 m x 0\.25 m apart.*smaller posting"),
        ({"posting": (0, 1)}, "posting of the region is 0 m x 1 m"),
        ({"posting": (1e-6, 1e-6)}, r"more than 1e\+10.*larger posting"),
        ({"heading": 0.1}, "turned region needs its extent"),
        ({"polygon": [(0, 0), (1, 1)]}, "2 corners; it needs at least 3"),
        ({"polygon": [(0, 0), (2, 2), (2, 0), (0, 2)]}, r"Self-intersection\[1 1\].*in order"),
        ({"polygon": [(0, 0), (1, 1), (2, 2)]}, "cannot be used"),
    ],
)
def test_impossible_regions_are_one_sentence(where, words):
    with pytest.raises(InputRefused, match=words) as refusal:
        make_region(GRID, FRAME, **where)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("heading", [0.0, 0.7])
def test_what_stands_in_the_scene_stands_at_the_same_place_of_the_map(heading):
    """Every corner of a rock, of a patch, a landform and its heading: the same easting, northing and height, to 1e-9 m."""
    terrain = ground()
    piece = extract_from_terrain(terrain, center=(10.0, 1.0), size=(4.0, 5.0), posting=(0.25, 0.25), heading=heading, name="piece")
    before, after = (MapFrame(origin=t.map_origin[:2], heading=t.map_heading) for t in (terrain, piece))
    assert piece.map_heading == pytest.approx(0.4 + heading)
    assert piece.map_origin[2] == 77.0

    def corners(t):
        rock = t.obstacles[0]
        points = rock.vertices @ matrix_of(rock.pose.rotation).T + np.array(rock.pose.position)
        east, north = (before if t is terrain else after).to_map(points[:, 0], points[:, 1])
        return np.column_stack([east, north, points[:, 2]])

    assert [o.name for o in piece.obstacles] == ["rock"]
    assert corners(piece) == pytest.approx(corners(terrain), abs=1e-9)
    assert [p.name for p in piece.patches] == ["a"]
    assert {s.name for s in piece.soils} == {LUNAR_SOIL.name, "hard"} == {p.soil for p in piece.pairs}
    for mine, theirs in zip(piece.patches[0].polygon, terrain.patches[0].polygon, strict=True):
        assert np.array(after.to_map(*mine)) == pytest.approx(np.array(before.to_map(*theirs)), abs=1e-9)
    assert [f.name for f in piece.landforms] == ["near", "own"]
    form = piece.landforms[0]
    assert np.array(after.to_map(form.x, form.y)) == pytest.approx(np.array(before.to_map(10.5, 1.5)), abs=1e-9)
    assert form.heading + piece.map_heading == pytest.approx(0.3 + 0.4)
    assert piece.source == "region of ramp"


def test_members_of_a_population_outside_the_region_are_left_out():
    x = np.array([-7.0, 9.0, 10.0, 13.5])
    craters = Population(
        name="p",
        landform="crater",
        x=x,
        y=np.ones(4),
        heading=np.zeros(4),
        drivers={"diameter": np.full(4, 2.0), "relief": np.full(4, 0.5)},
    )
    piece = extract_from_terrain(ground(populations=(craters,)), center=(10.0, 1.0), size=(4.0, 4.0), heading=0.0)
    (kept,) = piece.populations
    assert kept.x.tolist() == [9.0, 10.0, 13.5]  # the last one's ejecta reach into the region
    assert len(kept.drivers["diameter"]) == 3


def test_obstacles_keep_their_depth_on_another_posting():
    """On curved ground, other points are another surface: the rock moves with the lowest ground around it, and stays as deep in it."""
    terrain = ground()
    x, y = GRID.axes(GRID.whole)
    terrain = replace(terrain, heights=0.3 * np.sin(2 * x)[None, :] + 0.2 * np.cos(3 * y)[:, None])
    coarse = extract_from_terrain(terrain, center=(10.1, 1.1), size=(7.0, 6.0), posting=(1.3, 0.9), heading=0.5)

    def depth(t, turn):
        px, py, pz = t.obstacles[0].pose.position
        points = t.obstacles[0].vertices @ matrix_of(t.obstacles[0].pose.rotation).T
        reach = np.hypot(points[:, 0], points[:, 1]).max()
        around = np.arange(16) * np.pi / 8 - turn
        ring = bilinear(
            t.heights, (t.x_west, t.y_north), (t.posting_x, t.posting_y), px + reach * np.cos(around), py + reach * np.sin(around)
        )
        return pz - ring.min()

    assert depth(coarse, 0.5) == pytest.approx(depth(terrain, 0.0), abs=1e-9)
    assert coarse.obstacles[0].pose.position[2] != terrain.obstacles[0].pose.position[2]


def test_obstacles_outside_the_outline_are_left_out():
    piece = extract_from_terrain(ground(), polygon=[(11.0, -1.0), (14.0, -1.0), (14.0, 3.0)])
    assert piece.obstacles == ()


def test_resampling_in_windows_gives_the_same_bytes():
    """Any tiling of a turned grid, also where it leaves the scene."""
    grid = Grid(n_rows=50, n_cols=33, posting_x=0.3, posting_y=0.41, x_west=-4, y_north=9, origin=(12.0, 0.3), heading=-0.6)
    noise = np.random.default_rng(1).normal(size=GRID.shape)
    surface = ResampledSurface(replace(ground(), heights=noise), grid)
    whole = surface[:, :]
    pieces = np.empty(grid.shape)
    for window in grid.tiles(7):
        pieces[window.slices] = surface[window.slices]
    assert whole.tobytes() == pieces.tobytes()
    x, y = grid.points(grid.whole)
    expected = bilinear(noise, (-8.0, 6.0), (0.5, 0.25), x, y)
    assert np.array_equal(np.isnan(whole), np.isnan(expected))
    assert np.nanmax(np.abs(whole - expected)) < 1e-12


def test_filled_values_are_marked_in_whatever_depends_on_them():
    filled = np.zeros(GRID.shape, bool)
    filled[20, 30] = True  # x = 7, y = 1
    same = extract_from_terrain(ground(filled=filled), box=(6.0, 0.0, 8.0, 2.0))
    assert np.argwhere(same.filled).tolist() == [[4, 2]]
    finer = extract_from_terrain(ground(filled=filled), box=(6.0, 0.0, 8.0, 2.0), posting=(0.25, 0.25))
    assert np.argwhere(finer.filled).tolist() == [[4, 3], [4, 4], [4, 5]]
    assert extract_from_terrain(ground(filled=filled), box=(0.0, 0.0, 2.0, 2.0)).filled is None


SCENE = """
name = "scene"
soil = "lunar_sourcebook"
[base]
kind = "plane"
size = ["40 m", "30 m"]
center = ["3 m", "-2 m"]
posting = "0.5 m"
slope = "4 deg"
direction = "25 deg"
[[landform]]
name = "pit"
landform = "crater"
x = 4
y = 1
drivers = { diameter = "5 m", relief = 0.6 }
[[obstacle]]
name = "block"
kind = "box"
size = ["1 m", "0.6 m", "0.5 m"]
x = 6
y = -1
embedded = 0.3
"""


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """A scene file."""
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def test_a_region_of_a_scene_is_evaluated_at_its_own_points(scene):
    """Turned and five times finer: the composition's own heights at these points, not an interpolation (which is off by centimetres).

    The block is buried by 30 %, against the lowest ground around it, which the finer points change by millimetres.
    """
    where = {"center": (4.0, 0.5), "size": (7.0, 5.0), "posting": (0.1, 0.1), "heading": 0.6}
    piece = extract_from_scene(scene, **where)
    with composed(scene) as (_, composition, _, _):
        grid = make_region(composition.grid, **where).grid
        x, y = grid.points(grid.whole)
        exact = composition.at(x.ravel(), y.ravel()).reshape(grid.shape)
    assert np.abs(piece.heights - exact).max() < 1e-9
    whole = extract_from_scene(scene)
    coarse = extract_from_terrain(whole, **where)
    assert np.abs(piece.heights - coarse.heights).max() > 1e-3
    assert [o.name for o in piece.obstacles] == ["block"]
    x, y, z = piece.obstacles[0].pose.position
    ground_there = float(bilinear(piece.heights, (piece.x_west, piece.y_north), (0.1, 0.1), x, y))
    assert z - ground_there == pytest.approx(0.5 / 2 - 0.3 * 0.5, abs=0.01)


ROCKS = """
[[population]]
name = "rocks"
landform = "rock"
law = { name = "golombek", k = 0.1 }
diameter = ["1 m", "3 m"]
seed = 4
count = 40
region = [-6, -8, 14, 9]
collide = "1 m"
"""


@pytest.fixture
def rocks(scene):
    """The scene on steep rough ground, with rocks of a few postings that are bodies, too."""
    steep = SCENE.replace('kind = "plane"', 'kind = "fractal"\nhurst = 0.7\nseed = 5\nmedian_slope = "12 deg"')
    scene.write_text("".join(line for line in steep.splitlines(True) if not line.startswith(("slope", "direction"))) + ROCKS)
    return scene


def ground_of(piece, x, y):
    """Bilinear heights [m] at points of its frame, NaN outside."""
    return bilinear(piece.heights, (piece.x_west, piece.y_north), (piece.posting_x, piece.posting_y), x, y)


@pytest.mark.parametrize("turn", [{"heading": -1.2}, {"heading": 0.0, "posting": (0.3, 0.3)}])
def test_bodies_of_rocks_stand_on_the_ground_of_a_region(rocks, turn):
    """Other points are another surface. Visible corners lie on it, or above on steep ground, and no root within a twentieth below.

    A root lies below the lowest ground around it by 0.55 of its depth, at least 0.15 / 1.15 of the whole body: 7 %.
    """
    piece = extract_from_scene(rocks, center=(4.0, 0.5), size=(16.0, 14.0), **turn)
    seen = 0
    for body in piece.obstacles:
        corners = body.vertices + np.array(body.pose.position) if body.vertices is not None else np.full((1, 3), np.nan)
        over = (corners[:, 2] - ground_of(piece, corners[:, 0], corners[:, 1])) / np.ptp(corners[:, 2])
        if np.isfinite(over).all():
            seen += 1
            assert ((over > -1e-9) | (over < -0.05)).all(), body.name
    assert seen > 5


def test_bodies_of_rocks_keep_their_bytes_where_the_points_are_the_scene_s(rocks):
    """A part of the scene cut out has its bodies; one that reaches beyond a turned part is kept too, where the rock stands in it."""
    whole = {o.name: o for o in extract_from_scene(rocks).obstacles}
    part = extract_from_scene(rocks, box=(-4.0, -6.0, 12.0, 7.0)).obstacles
    assert len(part) > 5
    for body in part:
        assert body.vertices is None or body.vertices.tobytes() == whole[body.name].vertices.tobytes()
        assert body.pose.position == pytest.approx(whole[body.name].pose.position, abs=1e-12)
    turned = extract_from_scene(rocks, center=(4.0, 0.5), size=(16.0, 13.0), heading=0.3)
    places = {name: turned_place(o) for name, o in whole.items()}
    assert {o.name for o in turned.obstacles} == {name for name, place in places.items() if np.isfinite(ground_of(turned, *place))}


def turned_place(body):
    """Its x and y [m] in a frame around (4.0, 0.5), turned by 0.3."""
    x, y = body.pose.position[0] - 4.0, body.pose.position[1] - 0.5
    c, s = math.cos(0.3), math.sin(0.3)
    return c * x + s * y, c * y - s * x


def test_a_stored_terrain_stays_in_its_database_and_gives_the_same(scene, tmp_path):
    terrain = extract_from_scene(scene)
    path = tmp_path / "t.db"
    store.create(path)
    store.write_terrain(path, terrain)
    lazy = store.read_terrain(path, heights=False)
    for where in ({"box": (0.0, -3.0, 5.0, 4.0)}, {"center": (4.0, 0.5), "size": (7.0, 5.0), "posting": (0.1, 0.2), "heading": 0.6}):
        a, b = extract_from_terrain(lazy, **where), extract_from_terrain(terrain, **where)
        assert a.heights.tobytes() == b.heights.tobytes()
        assert a.obstacles == b.obstacles


def test_soils_of_a_turned_region_are_those_of_the_scene():
    """Codes at the region's points equal those of the scene's patches at the same places, but for points on a border by rounding."""
    terrain = ground()
    region = make_region(GRID, center=(10.0, 1.0), size=(5.0, 5.0), posting=(0.05, 0.05), heading=0.7)
    piece = terrain_of_region(terrain, region, np.zeros(region.grid.shape), register=landforms())
    mine = soil_codes(piece.soil, piece.patches, *region.grid.axes(region.grid.whole))
    x, y = region.grid.points(region.grid.whole)
    triangle = np.array(terrain.patches[0].polygon)
    edges = np.roll(triangle, -1, axis=0) - triangle
    side = [e[0] * (y - p[1]) - e[1] * (x - p[0]) for p, e in zip(triangle, edges, strict=True)]
    inside = np.logical_and.reduce([s > 1e-9 for s in side])
    outside = np.logical_or.reduce([s < -1e-9 for s in side])
    assert (mine[inside] == 1).all()
    assert (mine[outside] == 0).all()
    assert inside.sum() > 1000
