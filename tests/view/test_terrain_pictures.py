"""Pictures of ground show what is there, where it is: checked at pixels against closed forms."""

import math
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from machines import LUNAR_SOIL, cart, plane
from rille.model import InputRefused, Mesh, Obstacle, Part, PartInstance, Population, Pose, SoilPatch, Terrain
from rille.model.grid import bilinear
from rille.view.cad_pictures import project
from rille.view.ground import crop
from rille.view.obstacles import obstacle_items, stated_obstacles
from rille.view.terrain_pictures import Mark, draw_oblique, draw_profile, draw_shade, draw_slope, draw_soil
from rille.view.terrain_pictures.map_sheet import FILLED_LINE, NO_DATA, NO_DATA_LINE, PANEL, MapSheet, counted
from rille.view.terrain_pictures.marks import overlap, place_labels
from rille.view.terrain_pictures.oblique import SIZE, fitted, graded, standing
from rille.view.terrain_pictures.paper import Paper, number, ticks
from rille.view.terrain_pictures.profile import crossed, heights_along
from rille.view.terrain_pictures.raster import Raster, contour_interval, nice, rgb, sample
from rille.view.terrain_pictures.shade import HEIGHT_COLORS
from rille.view.terrain_pictures.slope import CLASS_COLORS, slope_degrees


def ground(function, width=60.0, height=40.0, posting=0.2, name="test", **more):
    """Terrain z = function(x, y), not square, centred at (5, -3)."""
    n_rows, n_cols = round(height / posting) + 1, round(width / posting) + 1
    x_west, y_north = 5.0 - width / 2, -3.0 + height / 2
    x, y = x_west + posting * np.arange(n_cols), y_north - posting * np.arange(n_rows)
    z = np.broadcast_to(function(x[None, :], y[:, None]), (n_rows, n_cols)).astype(float)
    facts = {"posting_x": posting, "posting_y": posting, "x_west": x_west, "y_north": y_north, "soils": (LUNAR_SOIL,)}
    return Terrain(name=name, heights=z, soil=LUNAR_SOIL.name, pairs=(), **{**facts, **more})


def bowl(x, y, radius=8.0, depth=2.0, at=(15.0, 5.0)):
    """A paraboloid hollow."""
    return -depth * np.clip(1 - ((x - at[0]) ** 2 + (y - at[1]) ** 2) / radius**2, 0, None)


def ring(x, y, radius):
    around = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    return np.column_stack([x + radius * np.cos(around), y + radius * np.sin(around)])


def where(terrain, x, y):
    """Column and row of the picture at which (x, y) [m] is drawn."""
    column, row = MapSheet(terrain, sample(terrain), "", "", "").pixels(x, y)
    return round(float(column)), round(float(row))


def pixels(path):
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def around(picture, place, half=4):
    column, row = place
    return picture[row - half : row + half + 1, column - half : column + half + 1].reshape(-1, 3)


def near(colors, color, reach=12):
    """How many colours (n, 3) differ from ``#rrggbb`` by less than ``reach`` in each channel."""
    return int(np.sum(np.all(np.abs(colors - np.array(rgb(color))) < reach, axis=-1)))


@pytest.mark.parametrize("slope", [(0.05, 0.0), (-0.05, 0.0), (0.0, 0.05), (0.0, -0.05)])
def test_a_ramp_rises_where_it_should(tmp_path, slope):
    """East, west, north or south is high: the tint there is the warm end of the colours, at the other side the cool end."""
    terrain = ground(lambda x, y: slope[0] * x + slope[1] * y)
    draw_shade(terrain, tmp_path / "ramp.png")
    picture = pixels(tmp_path / "ramp.png")
    direction = np.sign(slope)
    high = np.array([5.0, -3.0]) + direction * [24, 16]
    low = np.array([5.0, -3.0]) - direction * [24, 16]
    warmth = [float(np.median(around(picture, where(terrain, *p)) @ [1, 0, -1])) for p in (low, high)]
    assert warmth[1] > warmth[0] + 25
    assert np.array(HEIGHT_COLORS[0], int) @ [1, 0, -1] < 0 < np.array(HEIGHT_COLORS[-1], int) @ [1, 0, -1]


def test_a_hollow_is_where_it_was_put_and_lit_from_the_north_west(tmp_path):
    terrain = ground(bowl)
    draw_shade(terrain, tmp_path / "bowl.png")
    picture = pixels(tmp_path / "bowl.png").mean(axis=2)
    step = 5.0 / math.sqrt(2)
    dark, bright, level = (
        float(np.median(around(picture[..., None].repeat(3, axis=2), where(terrain, *p)))) for p in
        ((15 - step, 5 + step), (15 + step, 5 - step), (-15, -10))
    )  # fmt: skip
    assert dark < level - 40
    assert bright > dark + 60


def test_contours_lie_at_their_heights():
    """On z = x / 10 the contours of 0.5 m are 5 m apart; the line's middle is within a pixel of its place, and nothing lies between."""
    terrain = ground(lambda x, y: 0.1 * x + 0 * y)
    raster = Raster(sample(terrain), (600, 400))  # 10 pixels a metre
    opacity = raster.contours(0.5, 1.0)
    columns = np.flatnonzero(opacity[200] > 0.4)
    x = -25.0 + (columns + 0.5) / 10
    assert np.all(np.abs(x / 5 - np.rint(x / 5)) * 5 <= 0.1 + 1e-6)
    assert len(np.unique(np.rint(x / 5))) in (11, 12, 13)  # -25 to 35 m, the ones at the border may be lost
    assert opacity.max(axis=0)[columns[5] + 4 : columns[5] + 30].max() == 0.0 or len(columns) == 0


def test_level_ground_has_no_contours(tmp_path):
    """z = 0 exactly on a contour would otherwise be one black plate."""
    terrain = ground(lambda x, y: 0 * x + 0 * y)
    assert Raster(sample(terrain), (300, 200)).contours(0.5, 1.0).max() == 0.0
    draw_shade(terrain, tmp_path / "level.png")
    inside = around(pixels(tmp_path / "level.png"), where(terrain, 5, -3), 40)
    assert np.ptp(inside, axis=0).max() == 0


@pytest.mark.parametrize(("degrees", "expected"), [(2.0, 0), (7.5, 1), (12.0, 2), (17.0, 3), (23.0, 4), (28.0, 5), (41.0, 6)])
def test_slopes_have_the_colour_of_their_class(tmp_path, degrees, expected):
    """A plane inclined towards (3, 4): every pixel of the map, and the slope itself to 1e-3 deg (heights are drawn in single precision)."""
    rise = math.tan(math.radians(degrees))
    terrain = ground(lambda x, y: rise * (0.6 * x + 0.8 * y))
    assert np.abs(slope_degrees(sample(terrain)) - degrees).max() < 1e-3
    facts = draw_slope(terrain, tmp_path / "slope.png")
    assert facts["median_deg"] == pytest.approx(degrees, abs=1e-3)
    assert facts["baseline_m"] == pytest.approx(0.4)
    picture = pixels(tmp_path / "slope.png")
    (left, top), (right, bottom) = where(terrain, -24.5, 16.5), where(terrain, 34.5, -22.5)
    assert np.all(picture[top:bottom, left:right] == rgb(CLASS_COLORS[expected]))


def test_slopes_on_either_side_of_a_roof(tmp_path):
    """3 deg in the west, 22 deg in the east of x = 5, on a grid whose postings differ."""
    rise = [math.tan(math.radians(a)) for a in (3, 22)]
    terrain = ground(lambda x, y: np.where(x < 5, rise[0] * (x - 5), -rise[1] * (x - 5)) + 0 * y)
    terrain = replace(terrain, heights=np.ascontiguousarray(terrain.heights[::2]), posting_y=0.4)
    draw_slope(terrain, tmp_path / "roof.png")
    picture = pixels(tmp_path / "roof.png")
    assert near(around(picture, where(terrain, -10, 2)), CLASS_COLORS[0], 2) == 81
    assert near(around(picture, where(terrain, 20, -8)), CLASS_COLORS[4], 2) == 81


def test_what_has_no_height_is_hatched_and_what_was_filled_is_marked(tmp_path):
    terrain = ground(bowl)
    heights, filled = terrain.heights.copy(), np.zeros(terrain.heights.shape, bool)
    heights[20:60, 30:80] = np.nan  # x -19 to -9, y 13 to 5
    filled[120:160, 200:260] = True  # x 15 to 27, y -7 to -15
    terrain = replace(terrain, heights=heights, filled=filled)
    draw_shade(terrain, tmp_path / "gaps.png")
    picture = pixels(tmp_path / "gaps.png")
    inside = around(picture, where(terrain, -14, 9), 20)
    assert near(inside, NO_DATA, 2) + near(inside, NO_DATA_LINE, 2) == len(inside)
    assert 0.15 < near(inside, NO_DATA_LINE, 2) / len(inside) < 0.35
    assert near(around(picture, where(terrain, 21, -11), 20), FILLED_LINE, 2) > 200
    assert near(around(picture, where(terrain, -10, -15), 20), FILLED_LINE, 2) == 0
    assert near(around(picture, where(terrain, -10, -15), 20), NO_DATA, 2) == 0
    draw_slope(terrain, tmp_path / "slope.png")
    assert near(around(pixels(tmp_path / "slope.png"), where(terrain, -14, 9), 20), NO_DATA, 2) > 1000
    with pytest.raises(InputRefused, match="has no height at all"):
        draw_shade(replace(terrain, heights=np.full_like(heights, np.nan)), tmp_path / "none.png")


def test_placed_landforms_have_names_outlines_and_headings(tmp_path):
    """With a name there are dark letters on white beside the origin; the tick points north for a heading of 90 deg."""
    terrain = ground(lambda x, y: 0.01 * x + 0 * y)
    nameless = Mark(name="", x=0.0, y=0.0, heading=math.pi / 2, outline=ring(0, 0, 6))
    draw_shade(terrain, tmp_path / "without.png", marks=[nameless])
    draw_shade(terrain, tmp_path / "with.png", marks=[replace(nameless, name="landing pad")])
    without, named = pixels(tmp_path / "without.png"), pixels(tmp_path / "with.png")
    column, row = where(terrain, 0, 0)
    changed = np.argwhere(np.any(without != named, axis=2))
    assert len(changed) > 300
    assert np.abs(changed - [row, column]).max() < 160  # beside the origin, nowhere else
    red = np.array(rgb("#b3261e"))
    is_red = np.all(np.abs(named - red) < 40, axis=2)
    assert is_red[row - 13 : row - 6, column - 2 : column + 3].sum() > 8
    assert is_red[row + 6 : row + 14, column - 2 : column + 3].sum() == 0
    for angle in np.linspace(0, 2 * np.pi, 24, endpoint=False):  # the outline is a ring of 6 m
        x, y = where(terrain, 6 * math.cos(angle), 6 * math.sin(angle))
        assert is_red[y - 2 : y + 3, x - 2 : x + 3].any()


def test_names_never_cover_each_other_and_lost_ones_are_counted():
    paper = Paper(900, 700)
    rng = np.random.default_rng(4)
    points = [(f"landform {k}", (float(x), float(y))) for k, (x, y) in enumerate(rng.normal((450, 350), (60, 40), (60, 2)))]
    labels, lost = place_labels(paper, points, (0, 0, 900, 700))
    assert len(labels) + len(lost) == 60
    assert len(labels) > 25
    for k, one in enumerate(labels):
        assert not any(overlap(one.box, other.box) for other in labels[:k])
        assert one.box[0] > 0
        assert one.box[3] < 700


def test_populations_are_counted_and_the_origin_is_told():
    crowd = Population(name="young", landform="crater", x=np.zeros(12345), y=np.zeros(12345), heading=np.zeros(12345), drivers={})
    terrain = ground(
        bowl, populations=(crowd,), crs='PROJCRS["Moon (2015) - Sphere",BASE]', map_origin=(12.5, -7.25, -100.0), map_heading=0.1
    )
    text = counted(terrain)
    assert "population 'young' of 12\u2009345 craters" in text
    assert "E 12.5 m, N \u22127.2 m, height \u2212100.0 m" in text
    assert "Moon (2015) \u2212 Sphere" in text
    assert "5.73\u00b0 against east" in text


def test_a_caption_has_only_the_sentences_that_there_are():
    assert counted(ground(bowl, source="fractal")) == "Base: fractal."
    assert counted(ground(bowl)) == ""


@pytest.fixture
def said(monkeypatch):
    """Texts that are written on pictures."""
    texts = []
    write = Paper.text
    monkeypatch.setattr(Paper, "text", lambda self, at, text, **look: (texts.append(text), write(self, at, text, **look))[1])
    return texts


def test_a_map_of_many_heights_states_the_extent_of_all(tmp_path, said):
    """2501 heights are drawn as every second one; 2500 of 2500 would end one short: the last is no second one."""
    terrain = ground(lambda x, y: 0.1 * x + 0 * y, width=500.0 - 0.2, height=20.0)
    assert terrain.heights.shape[1] == 2500
    draw_shade(terrain, tmp_path / "map.png")
    assert any(text.startswith("499.8 m \u00d7 20 m at 0.2 m") for text in said)


@pytest.mark.parametrize(("heading", "direction"), [(0.0, (0, -1)), (math.pi / 2, (1, 0)), (-math.pi / 2, (-1, 0))])
def test_the_arrow_points_north(tmp_path, heading, direction):
    """x turned by 90 deg against east points north, so that north is to the right of the picture."""
    terrain = ground(bowl, map_heading=heading)
    draw_shade(terrain, tmp_path / "north.png")
    picture = pixels(tmp_path / "north.png")
    sheet = MapSheet(terrain, sample(terrain), "", "", "")
    column, row = round(sheet.panel_x + PANEL - 46), round(sheet.panel_end - 38)
    ink = [int((around(picture, (column + 32 * s * direction[0], row + 32 * s * direction[1]), 5) < 90).all(axis=1).sum()) for s in (1, -1)]
    assert ink[0] > 15  # the letter N
    assert ink[1] == 0


def test_soils_by_colour_and_share(tmp_path):
    """A patch over the western quarter: its share of the area to one column of pixels (960), its colour there and nowhere else."""
    soft = replace(LUNAR_SOIL, name="soft")
    west = SoilPatch(name="west", soil="soft", polygon=((-30, -40), (-10, -40), (-10, 40), (-30, 40)))
    terrain = ground(lambda x, y: 0 * x + 0 * y, patches=(west,), soils=(LUNAR_SOIL, soft))
    shares = draw_soil(terrain, tmp_path / "soil.png")
    assert shares["soft"] == pytest.approx(0.25, abs=1.5 / 960)
    assert sum(shares.values()) == pytest.approx(1.0)
    picture = pixels(tmp_path / "soil.png")
    inside, outside = (np.median(around(picture, where(terrain, x, -15)), axis=0) for x in (-20, 20))
    assert inside[0] - inside[2] > 60  # orange
    assert outside[0] - outside[2] < 0  # grey, bluish


def test_a_profile_has_the_heights_of_the_solver():
    terrain = ground(lambda x, y: np.sin(x) + 0.3 * np.cos(2 * y))
    along, x, y, z = heights_along(terrain, (-20, -15, 30, 12), 0.05)
    expected = bilinear(terrain.heights, (terrain.x_west, terrain.y_north), (0.2, 0.2), x, y)
    assert np.abs(z - expected).max() < 1e-12
    assert along[-1] == pytest.approx(math.hypot(50, 27))
    assert (x[0], y[0], x[-1], y[-1]) == (-20, -15, 30, 12)


def test_a_line_crosses_an_outline_where_it_is():
    """A ring of radius 6 m around (4, 0) is met by y = 0 between x = -2 and 10 m; one value is 0.05 m."""
    x = np.linspace(-20, 20, 801)
    inside = crossed(Mark(name="ring", x=4, y=0, outline=ring(4, 0, 6)), x, np.zeros(801))
    assert x[inside].min() == pytest.approx(-2, abs=0.06)
    assert x[inside].max() == pytest.approx(10, abs=0.06)
    assert inside.sum() == pytest.approx(12 / 0.05, abs=3)
    assert not crossed(Mark(name="point", x=4, y=0), x, 0 * x).any()


def test_rocks_of_populations_are_shown_by_the_ground_alone():
    """Their collision bodies lie in the bumps of the ground; a stated obstacle whose name looks alike is still shown."""
    rocks = Population(name="rocks", landform="rock", x=np.zeros(2), y=np.zeros(2), heading=np.zeros(2), drivers={})
    stones = [Obstacle(name=n, kind="sphere", size=(0.4,), pose=Pose(position=(x, 0.0, 0.1))) for n, x in (("rocks_1", 0), ("block_1", 9))]
    terrain = ground(bowl, populations=(rocks,), obstacles=tuple(stones))
    assert [o.name for o in stated_obstacles(terrain)] == ["block_1"]
    (item,) = obstacle_items(terrain)
    assert item.vertices[:, 0].mean() == pytest.approx(9, abs=0.01)
    assert obstacle_items(terrain, np.array([0.0, 0.0]), 5.0) == []
    assert "1 obstacle." in counted(terrain) + "."


def test_a_profile_measures_a_ramp(tmp_path):
    """Uphill along x on z = x tan 10 deg; the exaggeration is that of the drawn axes: 1.25 times the relief fill 264 of 1130 pixels."""
    rise = math.tan(math.radians(10))
    terrain = ground(lambda x, y: rise * x + 0 * y)
    facts = draw_profile(terrain, tmp_path / "p.png", (-20, 0, 30, 0), marks=[Mark(name="here", x=0, y=0, outline=ring(0, 0, 5))])
    assert facts["length_m"] == pytest.approx(50)
    assert facts["steepest_deg"] == pytest.approx(10, abs=1e-6)
    assert facts["vertical_exaggeration"] == pytest.approx(264 / (1.25 * 50 * rise) / (1130 / 50), rel=1e-9)
    picture = pixels(tmp_path / "p.png")
    ground_color = np.all(np.abs(picture[118:382, 84:1214] - np.array(rgb("#c9bda6"))) < 3, axis=2)
    assert ground_color[:, 1000:1100].sum() > 2 * ground_color[:, 100:200].sum()  # it rises to the right


def test_a_profile_that_leaves_the_ground_says_how_much_is_on_it(tmp_path, said):
    """From the middle, x = 5 m, beyond the eastern border at 35 m: 30 of 50 m, to half a posting."""
    terrain = ground(lambda x, y: 0.1 * x + 0 * y)
    facts = draw_profile(terrain, tmp_path / "p.png", (5, 0, 55, 0))
    assert facts["length_m"] == pytest.approx(50)
    assert facts["known_m"] == pytest.approx(30, abs=0.1)
    assert any("50 m long (30 m of it on known ground)" in text for text in said)
    said.clear()
    assert draw_profile(terrain, tmp_path / "p.png", (5, 0, 25, 0))["known_m"] == pytest.approx(20)
    assert not any("known ground" in text for text in said)


def test_lines_that_make_no_profile_are_refused(tmp_path):
    terrain = ground(bowl)
    with pytest.raises(InputRefused, match=r"has no length; give two different points"):
        draw_profile(terrain, tmp_path / "p.png", (1, 1, 1, 1))
    with pytest.raises(InputRefused, match=r"does not meet the terrain, which spans x -25 to 35 m and y -23 to 17 m"):
        draw_profile(terrain, tmp_path / "p.png", (100, 100, 200, 100))


class Filed:
    """Heights as they lie in a file: a shape, and windows of two plain slices, none of them large."""

    def __init__(self, values):
        self.values, self.shape, self.largest = values, values.shape, 0

    def __getitem__(self, key):
        rows, columns = key
        assert rows.step is None
        assert columns.step is None
        window = self.values[rows, columns].copy()
        self.largest = max(self.largest, len(window))
        return window


@pytest.mark.parametrize("most", [2400, 300, 77])
def test_heights_in_files_are_drawn_alike(tmp_path, most):
    terrain = ground(lambda x, y: bowl(x, y) + 0.01 * np.sin(7 * x) * y, posting=0.07)
    filed = replace(terrain, heights=Filed(terrain.heights))
    one, other = sample(terrain, most), sample(filed, most)
    assert np.array_equal(one.z, other.z)
    assert max(one.z.shape) <= most
    assert filed.heights.largest <= 256
    assert one.step_x == pytest.approx(0.07 * math.ceil(858 / most))
    draw_shade(terrain, tmp_path / "a.png")
    draw_shade(filed, tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    z = [heights_along(t, (-20, -15, 30, 12), 0.05)[3] for t in (terrain, filed)]
    assert np.array_equal(*z)
    patches = [crop(t, np.array([15.0, 5.0]), 6.0) for t in (terrain, filed)]
    assert np.array_equal(patches[0].z, patches[1].z)


def test_a_cropped_patch_has_the_heights_of_the_solver():
    terrain = ground(lambda x, y: np.sin(x) * np.cos(y))
    patch = crop(terrain, np.array([34.0, -3.0]), 5.0)  # reaches over the eastern border
    expected = bilinear(terrain.heights, (terrain.x_west, terrain.y_north), (0.2, 0.2), patch.x[None, :], patch.y[:, None], clamp=True)
    assert np.abs(patch.z - expected).max() < 1e-12
    assert patch.x[-1] == pytest.approx(35.0)


def test_a_map_is_drawn_at_once(tmp_path):
    """A designer waits for it: 2000 x 1333 heights and 40 names take 0.11 s of processor time here; 0.5 s are allowed."""
    terrain = ground(lambda x, y: bowl(x, y) + 0.02 * np.sin(9 * x) * np.cos(7 * y), posting=0.03)
    places = np.random.default_rng(2).uniform((-24, -22), (34, 16), (40, 2))
    marks = [Mark(name=f"crater {k}", x=float(x), y=float(y), outline=ring(x, y, 2)) for k, (x, y) in enumerate(places)]
    draw_shade(terrain, tmp_path / "warm.png", marks=marks)
    start = time.process_time()
    draw_shade(terrain, tmp_path / "map.png", marks=marks)
    assert time.process_time() - start < 0.5


def test_maps_do_not_need_matplotlib(tmp_path):
    """Its import alone takes longer than an edit may."""
    code = (
        "import sys; sys.path.insert(0, 'tests'); from pathlib import Path; from machines import plane;"
        "from rille.view.terrain_pictures import draw_profile, draw_shade, draw_slope, draw_soil;"
        f"folder = Path({str(tmp_path)!r}); ground = plane(0.1);"
        "[draw(ground, folder / f'{k}.png') for k, draw in enumerate((draw_shade, draw_slope, draw_soil))];"
        "draw_profile(ground, folder / '3.png', (-5, 0, 5, 0));"
        "heavy = {'matplotlib', 'scipy', 'pyvista', 'rasterio', 'trimesh'} & set(sys.modules); sys.exit(str(heavy) if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert len(list(tmp_path.glob("*.png"))) == 4


def test_round_numbers():
    assert ticks(-1, 1, 4) == pytest.approx([-1, -0.5, 0, 0.5, 1])
    assert [number(v, 0.25) for v in (-0.25, 0.0, 1.0)] == ["\u22120.25", "0.00", "1.00"]
    assert [nice(v) for v in (0.9, 1.0, 1.01, 30)] == [1, 1, 2, 50]
    for relief in np.geomspace(0.01, 5000, 40):
        assert 8.7 <= relief / contour_interval(0, relief) <= 22.01


def test_graded_coordinates_are_fine_near_the_middle():
    x = graded(-100, 300, 20, 0.1, 5)
    assert (x[0], x[-1]) == (-100, 300)
    assert np.all(np.diff(x) > 0)
    assert np.diff(x)[np.abs(x[:-1] - 20) < 4].max() < 0.11
    assert len(x) <= 1000


def boxed_cart():
    """A cart on four wheels with a red box of 0.6 x 0.4 x 0.3 m for a body."""
    rover = cart(5.0, 0.15, 0.1)
    corners = np.array([[x, y, z] for x in (-0.3, 0.3) for y in (-0.2, 0.2) for z in (0.15, 0.45)], np.float32)
    faces = "013 032 467 475 045 051 237 276 026 064 157 173"
    triangles = np.array([[int(c) for c in face] for face in faces.split()], np.int32)
    mesh = Mesh(vertices=corners, triangles=triangles, tolerance=1e-3)
    part = Part(name="box", volume=0.07, properties=rover.bodies[0].properties, color="#ff0000", meshes=(mesh,))
    return replace(rover, parts=(part,), instances=(PartInstance(path="box", part="box", body=rover.bodies[0].name, pose=Pose()),))


@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_a_rover_stands_on_the_plane_under_its_wheels(heading):
    """On z = 0.2 x - 0.1 y all lowest points of wheels lie in the plane, the rover's x over its heading."""
    rover = boxed_cart()
    rotation, position = standing(rover, plane(0.2, -0.1), np.array([3.0, -2.0]), heading)
    assert np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-12
    assert np.linalg.det(rotation) == pytest.approx(1)
    normal = np.array([-0.2, 0.1, 1]) / math.sqrt(1.05)
    assert rotation[:, 2] == pytest.approx(normal)
    for wheel in rover.wheels:
        x, y, z = rotation @ np.array(wheel.center) + position - wheel.radius * normal
        assert z == pytest.approx(0.2 * x - 0.1 * y, abs=1e-9)
    assert math.atan2(rotation[1, 0], rotation[0, 0]) == pytest.approx(heading, abs=0.05)


def test_the_view_shows_the_rover_and_names(tmp_path):
    """The red box stands right of the middle in front; the name of the hollow is written above it in white."""
    terrain = ground(bowl, obstacles=(Obstacle(name="rock", kind="sphere", size=(0.4,), pose=Pose(position=(0.0, 0.0, 0.1))),))
    marks = [Mark(name="hollow", x=15.0, y=5.0, outline=ring(15, 5, 8))]
    assert draw_oblique(terrain, tmp_path / "near.png", marks=marks, rover=boxed_cart(), at=(2.0, 0.0)) == []
    picture = pixels(tmp_path / "near.png")
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    red = np.argwhere((picture[..., 0] > 90) & (picture[..., 1] < 60))
    assert len(red) > 3000
    row, column = np.median(red, axis=0)
    assert SIZE[1] / 2 < row < SIZE[1] - 60
    assert SIZE[0] / 2 < column < SIZE[0] - 100
    draw_oblique(terrain, tmp_path / "nameless.png", rover=boxed_cart(), at=(2.0, 0.0), marks=[replace(marks[0], name="")])
    assert np.any(picture != pixels(tmp_path / "nameless.png"), axis=2).sum() > 500


def test_the_overview_has_all_of_the_ground_and_north_behind(tmp_path):
    """The ground's corners are in the picture, the farther border higher up; where the hollow is projected there is ground."""
    terrain = ground(bowl)
    patch = crop(terrain, np.array([5.0, -3.0]), 30.0)
    low, high = np.array([-25.0, -23.0]), np.array([35.0, 17.0])
    camera = fitted(np.array([-0.38, -0.80, 0.62]), low, high, patch)
    corners = project(np.array([[x, y, 0.0] for x in (-25, 35) for y in (-23, 17)]), camera, SIZE)
    assert corners.min() > 0
    assert np.all(corners.max(axis=0) < SIZE)
    assert corners[1, 1] < corners[0, 1]  # north-west above south-west
    assert np.ptp(corners[:, 0]) > 0.8 * SIZE[0]
    assert draw_oblique(terrain, tmp_path / "all.png", marks=[Mark(name="hollow", x=15, y=5, outline=ring(15, 5, 8))]) == []
    picture = pixels(tmp_path / "all.png")
    corner = project(np.array([[15.0, 5.0, -2.0]]), camera, SIZE)[0]
    assert around(picture, (round(corner[0]), round(corner[1])), 30).mean() > 25  # ground, not sky
    assert picture[5:30, 5:30].mean() < 25


def test_places_outside_are_refused(tmp_path):
    with pytest.raises(InputRefused, match=r"\(99, 0\) m lies outside the terrain, which spans x -25 to 35 m"):
        draw_oblique(ground(bowl), tmp_path / "no.png", at=(99.0, 0.0))
