"""Own landforms: formulas, profiles, height maps, solids; each against a closed form, and what is refused."""

import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from rille.model import InputRefused, Terrain
from rille.terrain import own
from rille.terrain.delivery import deliver
from rille.terrain.delivery import plan as plan_outputs
from rille.terrain.grid import Grid
from rille.terrain.own import zbuffer
from rille.terrain.own.formula import FUNCTIONS, parse_formula
from rille.terrain.own.proof import prove
from rille.terrain.own.zbuffer import rasterise
from rille.terrain.register import landforms, soils

HEAD = """
name = "form"
meaning = "a form"
frame = "origin at the centre, height zero at the ground"
source = "test"
"""
DIAMETER = """
[[driver]]
name = "diameter"
meaning = "foot to foot"
range = ["10 cm", "100 m"]
[[driver]]
name = "height"
meaning = "height of the top"
range = [-10, 10]
link = "0.1 * diameter"
[example]
diameter = "8 m"
"""


PLY = b"""ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
"""


def form_of(tmp_path, text, head=HEAD):
    """The landform of a sheet."""
    file = tmp_path / "form.toml"
    file.write_text(head + text)
    return own.read_own(file)


def keep(tmp_path, relief, made_from, **more):
    """A relief in a library; the landform."""
    terms = {"name": "form", "meaning": None, "source": None, "blend": None, "soil": "", "replace": False} | more
    return own.keep_heights(relief, made_from=made_from, folder=tmp_path / "library", builtin=(), soils=soils(), **terms).landform


class TestFormula:
    @pytest.mark.parametrize(
        ("text", "expected"),
        [
            ("1 + 2 * 3 ** 2", 19.0),
            ("-x ** 2", -4.0),
            ("7 % 4 / 2", 1.5),
            ("where(x > 1, 10, 20)", 10.0),
            ("min(3, x, 5) + max(1, x)", 4.0),
            ("hypot(3, 4) * sin(pi / 2)", 5.0),
            ("smooth_step(0.5) + clip(9, 0, 1)", 1.5),
            ("1e3", 1000.0),
        ],
    )
    def test_values(self, text, expected):
        assert parse_formula(text, ["x"], "it")({"x": 2.0}) == pytest.approx(expected, rel=1e-15)

    def test_every_function_works_on_arrays(self):
        """The same elementwise as one by one, to the rounding of vectorised functions."""
        at = np.array([0.3, 0.7])
        for name, (_, count) in FUNCTIONS.items():
            formula = parse_formula(f"{name}({', '.join(['u', '0.4', '0.9'][: 2 if count < 0 else count])})", ["u"], "it")
            assert formula({"u": at}) == pytest.approx([float(formula({"u": u})) for u in at], rel=1e-14), name

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("dept * 2", ["'dept'", "did you mean 'depth'"]),
            ("sqr(depth)", ["'sqr'", "did you mean 'sqrt'"]),
            ("__import__('os').system('true')", ["no arithmetic"]),
            ("depth.real", ["'depth.real'", "no arithmetic"]),
            ("[1, 2]", ["no arithmetic"]),
            ("lambda: 1", ["no arithmetic"]),
            ("depth if depth else 1", ["no arithmetic"]),
            ("'a'", ["no arithmetic"]),
            ("True", ["no arithmetic"]),
            ("sqrt", ["function 'sqrt'", "sqrt(...)"]),
            ("sqrt(1, 2)", ["sqrt 2 values", "takes 1"]),
            ("min(1)", ["min 1 values", "two or more"]),
            ("1 +", ["no formula"]),
            ("(" * 300 + "1" + ")" * 300, ["formula"]),
            ("-" * 200 + "1", ["nested more than 60 deep"]),
            ("1+" * 2000 + "1", ["characters long"]),
            ("0 < depth < 1", ["no arithmetic"]),
        ],
    )
    def test_what_is_no_arithmetic_is_refused(self, text, words):
        with pytest.raises(InputRefused) as refused:
            parse_formula(text, ["depth"], "height of it")
        for word in words:
            assert word in str(refused.value)
        assert "\n" not in str(refused.value)

    def test_a_tower_of_powers_ends_at_once(self):
        assert np.isinf(parse_formula("9**9**9**9", [], "it")({}))


class TestProfiles:
    def test_radial_points_in_metres_go_through_the_points(self, tmp_path):
        """Without drivers: its own size. Interpolation meets the points; slope 0 in the centre and at the foot (to the step's square)."""
        form = form_of(tmp_path, 'kind = "radial"\n[radial]\npoints = [[0, -1], [2, -0.5], [4, 0.4], [6, 0]]\n')
        prove(form)
        values = form.values({}, "it")
        assert values == pytest.approx({"diameter": 12.0, "height": 1.0})
        assert form.values({"diameter": 6}, "it")["height"] == pytest.approx(0.5)  # its shape is kept unless a height is given
        at = np.array([0.0, 2.0, 4.0, 6.0, 7.0])
        assert form.profile(at, 0 * at, values) == pytest.approx([-1, -0.5, 0.4, 0, 0], abs=1e-14)
        assert form.profile(-at * 0.6, at * 0.8, values) == pytest.approx([-1, -0.5, 0.4, 0, 0], abs=1e-14)
        near = np.array([1e-4, 6 - 1e-4])
        assert np.abs(form.profile(near, 0 * near, values) - [-1, 0]).max() < 1e-7
        larger = form.values({"diameter": 24, "height": "-2 m"}, "it")
        assert form.profile(2 * at, 0 * at, larger) == pytest.approx([2, 1, -0.8, 0, 0], abs=1e-14)
        assert form.footprint(larger) == (12.0, 12.0)

    def test_radial_lines_are_a_cone(self, tmp_path):
        text = '[radial]\nradius = "diameter / 2"\nheight = "height"\ninterpolation = "linear"\npoints = [[0, 1], [1, 0]]\n'
        form = form_of(tmp_path, DIAMETER + text, HEAD + 'kind = "radial"\n')
        values = form.values({"diameter": "10 m"}, "it")
        x, y = np.random.default_rng(1).uniform(-6, 6, (2, 500))
        assert form.profile(x, y, values) == pytest.approx(np.maximum(1 - np.hypot(x, y) / 5, 0), abs=1e-14)
        assert form.drivers[1].law == "0.1 * diameter"
        many = {"diameter": np.array([1.0, 2.0]), "height": np.array([0.1, 0.4])}
        assert form.radial.semi_axes(many)[0] == pytest.approx([0.5, 1.0])
        assert form.radial.amplitude(many) == pytest.approx([0.1, 0.4])

    def test_a_section_is_drawn_out_and_fades(self, tmp_path):
        """A triangle 2 m wide: z = (1 - |x|) s((5 - |y|) / fade), s = 3 u^2 - 2 u^3."""
        text = 'kind = "section"\n[section]\npoints = [[-1, 0], [0, 1], [1, 0]]\nlength = 10\nfade = "2 m"\ninterpolation = "linear"\n'
        form = form_of(tmp_path, text)
        prove(form)
        values = form.values({}, "it")
        x, y = np.random.default_rng(1).uniform(-6, 6, (2, 500))
        u = np.clip((5 - np.abs(y)) / 2, 0, 1)
        assert form.profile(x, y, values) == pytest.approx(np.maximum(1 - np.abs(x), 0) * (3 * u**2 - 2 * u**3), abs=1e-14)
        assert form.footprint(values) == (1.0, 5.0)
        assert form.profile(np.array([2.0]), np.zeros(1), form.values({"width": 8, "height": 1}, "it")) == pytest.approx([0.5])

    def test_the_formula_of_a_built_in_landform_gives_it_again(self, tmp_path):
        """The mound's formula as a sheet: equal to the built-in one to rounding."""
        text = '[formula]\nradius = "diameter / 2"\nheight = "height * cos(pi * r / diameter) ** 2"\n'
        form = form_of(tmp_path, DIAMETER + text, HEAD + 'kind = "formula"\n')
        prove(form)
        built_in = landforms()["mound"]
        given = {"diameter": 6.0, "height": 1.5}
        x, y = np.random.default_rng(1).uniform(-4, 4, (2, 1000))
        theirs = built_in.profile(x, y, built_in.values(given, "it"))
        assert np.abs(form.profile(x, y, form.values(given, "it")) - theirs).max() < 1e-12
        assert np.ptp(theirs) > 1.4

    def test_a_box_of_a_formula_ends_in_a_fade(self, tmp_path):
        form = form_of(tmp_path, 'kind = "formula"\n[formula]\nhalf_x = 2\nhalf_y = "50 cm"\nfade = 0.25\nheight = "1"\n')
        prove(form)
        x, y = np.array([0.0, 1.875, 0.0, 2.1]), np.array([0.0, 0.0, 0.375, 0.0])
        assert form.profile(x, y, {}) == pytest.approx([1, 0.5, 0.5, 0], abs=1e-14)

    def test_where_a_formula_is_not_defined_outside_its_footprint_does_not_matter(self, tmp_path):
        form = form_of(tmp_path, 'kind = "formula"\nsteep = true\n[formula]\nradius = 2\nheight = "sqrt(4 - r ** 2)"\n')
        prove(form)
        assert form.profile(np.array([0.0, 2.0, 3.0]), np.zeros(3), {}) == pytest.approx([2, 0, 0], abs=1e-14)

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ('kind = "radial"\n', ["needs the table [radial]"]),
            ('kind = "cube"\n', ["'kind'"]),
            ('kind = "radial"\n[radial]\npoints = [[0, 1], [2, 0]]\n[formula]\nheight = "1"\n', ["a table [formula], too"]),
            ('kind = "radial"\n[radial]\npoints = [[0, 1], [2, 0.1]]\n', ["end at 2 with the height 0.1", "steep = true"]),
            ('kind = "radial"\n[radial]\npoints = [[1, 1], [2, 0]]\n', ["begin at the distance 1", "[0, 1]"]),
            ('kind = "radial"\n[radial]\npoints = [[0, 1], [2, 0.5], [1, 0]]\n', ["from 2 to 1 at point 3", "must rise"]),
            ('kind = "radial"\n[radial]\npoints = [[0, 1], [2]]\n', ["point 2", "two numbers"]),
            ('kind = "radial"\n[radial]\npoints = [[0, 1], ["2 m", 0]]\n', ["point 2", "two numbers"]),
            ('kind = "radial"\n[radial]\npoints = [[0, 1], [2, nan], [3, 0]]\n', ["hold nan at point 2"]),
            ('kind = "radial"\n[radial]\npoints = [[0, 1], [1e308, 0]]\n', ["hold 1e+308 at point 2"]),
            ('kind = "radial"\n[radial]\nradius = "2 m"\npoints = [[0, 1], [2, 0]]\n', ["no driver", "points in metres"]),
            ('kind = "formula"\n[formula]\nheight = "r"\n', ["either `radius`, or `half_x` and `half_y`"]),
            ('kind = "formula"\n[formula]\nheight = "r"\nradius = 1\nhalf_x = 1\nhalf_y = 1\n', ["either `radius`"]),
            ('kind = "formula"\n[formula]\nheight = "z"\nradius = 1\n', ["height of landform 'form'", "'z'", "does not know"]),
            ('kind = "formula"\n[formula]\nheight = "r"\nradius = "3 kg"\n', ["radius of landform 'form'", "3 kg"]),
            (
                'kind = "heights"\n[heights]\nfile = "no.npy"\nposting = [1, 1]\nwest = 0\nnorth = 0\nlength = 1\nheight = 1\n',
                ["driver 'height'"],
            ),
        ],
    )
    def test_what_makes_no_landform_is_refused(self, tmp_path, text, words):
        with pytest.raises(InputRefused) as refused:
            form_of(tmp_path, text)
        for word in ("form.toml", *words):
            assert word in str(refused.value)
        assert "\n" not in str(refused.value)

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("0.1 * diameter", "0.1 * height", ["link of driver 'height'", "'height', which it does not know"]),
            ('name = "height"', 'name = "height"\nunit = "deg"', ["driver 'height'", "'deg'", "SI", "rad"]),
            ("range = [-10, 10]", "range = [10, -10]", ["from 10 to -10", "the lower one"]),
            ('link = "0.1 * diameter"', 'link = "0.1 * diameter"\ndefault = 1', ["a default and a link"]),
            ('link = "0.1 * diameter"', "default = 20", ["default of driver 'height'", "between -10 and 10"]),
            ('name = "height"', 'name = "diameter"', ["'diameter'", "exists already"]),
            ('name = "height"', 'name = "x"', ["driver 'x'", "coordinate"]),
            ('diameter = "8 m"', 'diameter = "8 kg"', ["example", "8 kg"]),
            ('diameter = "8 m"', "diam = 8", ["example", "did you mean 'diameter'"]),
            ('[example]\ndiameter = "8 m"', "", ["needs the driver 'diameter'"]),
        ],
    )
    def test_wrong_drivers_are_refused(self, tmp_path, old, new, words):
        assert old in DIAMETER
        with pytest.raises(InputRefused) as refused:
            form_of(tmp_path, DIAMETER.replace(old, new) + '[formula]\nradius = 1\nheight = "1 - r"\n', HEAD + 'kind = "formula"\n')
        for word in words:
            assert word in str(refused.value)

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ('radius = 1\nheight = "1 - r / 2"\n', ["0.5 m from zero at its border", "fade", "steep = true"]),
            ('radius = 1\nheight = "0 * r"\n', ["flat"]),
            ('radius = 1\nheight = "log(r - 0.5)"\n', ["not finite at x ="]),
            ('radius = "1 - 1"\nheight = "1 - r"\n', ["radius of landform 'form' is 0", "above 0"]),
            ('radius = "sqrt(0 - 1)"\nheight = "1 - r"\n', ["not finite"]),
        ],
    )
    def test_what_does_not_keep_its_promises_is_refused(self, tmp_path, text, words):
        form = form_of(tmp_path, 'kind = "formula"\n[formula]\n' + text)
        with pytest.raises(InputRefused) as refused:
            prove(form)
        for word in words:
            assert word in str(refused.value)

    def test_conservation_is_tested_where_it_is_claimed(self, tmp_path):
        """z = 1/r d/dr [r^2 (1 - r)^2] has no volume: its integral over the disc is 2 pi [r^2 (1 - r)^2] from 0 to 1 = 0."""
        conserving = "2 * (1 - r) ** 2 - 2 * r * (1 - r)"
        made = form_of(tmp_path, f'kind = "formula"\nconserves = "volume"\n[formula]\nradius = 1\nheight = "{conserving}"\n')
        prove(made)
        with pytest.raises(InputRefused, match="claims to conserve volume"):
            prove(form_of(tmp_path, 'kind = "formula"\nconserves = "volume"\n[formula]\nradius = 1\nheight = "(1 - r) ** 2"\n'))

    def test_the_examples_of_the_guide_are_taken(self, repository, tmp_path):
        """Every TOML block of own.md is taken as it is, and the functions that it names are those that there are."""
        text = (repository / "terrain_library/own.md").read_text()
        blocks = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
        assert len(blocks) == 3
        for block in blocks:
            (tmp_path / "block.toml").write_text(block)
            kept = own.keep_profile(
                tmp_path / "block.toml",
                folder=tmp_path / "library",
                builtin=frozenset(landforms()),
                soils=soils(),
                name=None,
                replace=False,
            )
            assert kept.file.read_text() == block
        assert set(re.findall(r"\n`abs ([a-z0-9_ \n]+)`", text)[0].split()) == set(FUNCTIONS) - {"abs", "where"}


def write_png(path, values):
    """A grey PNG of unsigned integers."""
    import rasterio

    shape = {"height": values.shape[0], "width": values.shape[1], "count": 1, "dtype": values.dtype}
    with rasterio.open(path, "w", driver="PNG", **shape) as raster:
        raster.write(values, 1)


def write_tif(path, values, *, crs="IAU_2015:30110", posting=(2.0, 1.0), corner=(100.0, 500.0), unit=None, dtype="float32"):
    """A GeoTIFF; corner: of its north-western cell."""
    import rasterio
    from rasterio.transform import Affine

    shape = {"height": values.shape[0], "width": values.shape[1], "count": 1, "dtype": dtype}
    place = {"transform": Affine(posting[0], 0, corner[0], 0, -posting[1], corner[1]), "crs": crs} if crs else {}
    with rasterio.open(path, "w", driver="GTiff", **shape, **place) as raster:
        raster.write(values.astype(dtype), 1)
        if unit:
            raster.units = [unit]


@pytest.mark.filterwarnings("ignore:Dataset has no geotransform")
class TestHeightMaps:
    @pytest.fixture
    def ramp(self):
        """An asymmetric ramp of 5 rows and 9 columns, unequal in all corners: z = 10 + column + 20 row."""
        return np.add.outer(20.0 * np.arange(5), np.arange(9.0)) + 10

    def test_a_geotiff_stands_where_it_says(self, tmp_path, ramp):
        """Every height at its place, east to the right and north up, without fading; posting 2 m x 1 m."""
        write_tif(tmp_path / "map.tif", ramp, unit="metre")
        relief = own.read_height_map(tmp_path / "map.tif", own.Georeference(zero="0", fade="0"))
        form = keep(tmp_path, relief, tmp_path / "map.tif", blend="replace")
        values = form.values({}, "it")
        assert values == pytest.approx({"length": 16.0, "height": 98.0})
        columns, rows = np.meshgrid(np.arange(9), np.arange(5))
        x, y = (columns - 4) * 2.0, (2 - rows) * 1.0
        assert form.profile(x, y, values) == pytest.approx(ramp, abs=1e-5)  # kept as 32-bit numbers
        half = form.values({"length": 8, "height": 49}, "it")
        assert form.profile(x / 2, y / 2, half) == pytest.approx(ramp / 2, abs=1e-5)
        assert form.footprint(values) == (8.0, 2.0)
        assert form.profile(np.array([8.01]), np.zeros(1), values) == 0.0

    def test_the_unit_is_what_the_file_says(self, tmp_path, ramp):
        write_tif(tmp_path / "map.tif", ramp, unit="mm")
        relief = own.read_height_map(tmp_path / "map.tif", own.Georeference(zero="0", fade="0"))
        assert relief.heights == pytest.approx(ramp / 1000)

    def test_black_and_white_are_no_marks(self, tmp_path):
        """A stamp in 16 signed bits, whose black is -32768, says what its grey levels mean."""
        stamp = np.where(np.add.outer(np.arange(9), np.arange(9)) % 4 < 2, -32768, 32767)
        write_tif(tmp_path / "map.tif", stamp, dtype="int16")
        relief = own.read_height_map(tmp_path / "map.tif", own.Georeference(height_range="0 m, 1 m", zero="0", fade="0"))
        assert np.unique(relief.heights).tolist() == [0.0, 1.0]

    @pytest.mark.parametrize(
        ("origin", "expected"),
        [
            ("corner", (0, 4)),
            ("centre", (-8, 2)),
            ("pixel 3, 1", (-6, 1)),
            ("105, 497.5", (-4, 2)),  # the western column stands at 101, the northern row at 499.5
        ],
    )
    def test_the_origin(self, tmp_path, ramp, origin, expected):
        write_tif(tmp_path / "map.tif", ramp)
        relief = own.read_height_map(tmp_path / "map.tif", own.Georeference(unit="m", origin=origin))
        assert (relief.grid.x_west, relief.grid.y_north) == pytest.approx(expected)

    def test_grey_levels_become_heights(self, tmp_path):
        """Level 0 is the lower, level 65535 the upper height; 8 bits are told."""
        values = np.zeros((9, 9), np.uint16)
        values[4, 4], values[4, 5] = 65535, 13107
        write_png(tmp_path / "map.png", values)
        stated = own.Georeference(height_range="-1 m, 4 m", length="4 m", zero="lowest", fade="0")
        relief = own.read_height_map(tmp_path / "map.png", stated)
        assert relief.grid.posting_x == 0.5
        assert relief.heights[4, 3:7] == pytest.approx([0, 5, 1, 0])
        assert relief.notes == ()
        write_png(tmp_path / "map.png", (values >> 8).astype(np.uint8))
        relief = own.read_height_map(tmp_path / "map.png", stated)
        assert relief.heights.max() == pytest.approx(5)
        assert "grey levels" in relief.notes[0]
        relief = own.read_height_map(tmp_path / "map.png", replace(stated, height_range=None, unit="2 cm"))
        assert relief.heights.max() == pytest.approx(5.1)

    def test_signed_levels_begin_at_the_lowest(self, tmp_path):
        """Level -32768 is the lower, level 32767 the upper height."""
        values = np.full((5, 5), -32768)
        values[2, 2], values[2, 3] = 32767, -1
        write_tif(tmp_path / "map.tif", values, dtype="int16")
        relief = own.read_height_map(tmp_path / "map.tif", own.Georeference(height_range="2 m, 6 m", zero="2 m", fade="0"))
        assert relief.heights[2] == pytest.approx([0, 0, 4, 4 * 32767 / 65535, 0])

    def test_zero_and_fade(self, tmp_path):
        """A dome on a plateau of 7 m: the border's mean is the zero, and heights fade by the smooth step over 3 cells."""
        values = np.full((21, 21), 7.0)
        values[8:13, 8:13] = 9.0
        write_tif(tmp_path / "map.tif", values, posting=(1.0, 1.0))
        border = own.read_height_map(tmp_path / "map.tif", own.Georeference(unit="m"))
        assert border.heights[10, 10] == 2.0
        assert border.heights[0, 0] == 0.0
        faded = own.read_height_map(tmp_path / "map.tif", own.Georeference(unit="m", zero="6.5 m", fade="4 m"))
        assert faded.heights[10, :5] == pytest.approx(0.5 * np.array([0, 0.15625, 0.5, 0.84375, 1]))
        prove(keep(tmp_path, faded, tmp_path / "map.tif"))

    def test_a_form_is_cut_out_of_its_slope(self, tmp_path):
        """A cone on an inclined plane: with the plane of its border as zero, the cone alone is left; what is told is rounding."""
        x, y = np.meshgrid(np.arange(-20.0, 21), np.arange(15.0, -16, -1))
        cone = np.maximum(5 - 0.5 * np.hypot(x, y), 0)
        write_tif(tmp_path / "map.tif", cone + 0.2 * x - 0.1 * y + 7, posting=(1.0, 1.0), dtype="float64")
        relief = own.read_height_map(tmp_path / "map.tif", own.Georeference(unit="m", zero="plane", fade="0"))
        assert np.abs(relief.heights - cone).max() < 1e-12

    @pytest.mark.parametrize(
        ("file", "stated", "words"),
        [
            ("grey.png", {"length": "4 m"}, ["grey levels (uint16)", "--height-range", "--unit"]),
            ("grey.png", {"height_range": "0, 1"}, ["--posting or --length"]),
            ("grey.png", {"height_range": "1, 0", "length": "4"}, ["from 1 to 0"]),
            ("grey.png", {"height_range": "1", "length": "4"}, ["two lengths"]),
            ("grey.png", {"height_range": "0 kg, 1 m", "length": "4"}, ["0 kg"]),
            ("grey.png", {"height_range": "0, 1", "unit": "m", "length": "4"}, ["both --height-range and --unit"]),
            ("grey.png", {"height_range": "0, 1", "posting": "1", "length": "4"}, ["both --posting and --length"]),
            ("grey.png", {"height_range": "0, 1", "length": "-4"}, ["above 0"]),
            ("colors.png", {"height_range": "0, 1", "length": "4"}, ["3 bands", "grey"]),
            ("floats.tif", {}, ["unit of its heights", "--unit m"]),
            ("floats.tif", {"unit": "kg"}, ["kg"]),
            ("floats.tif", {"height_range": "0, 1"}, ["float32", "--unit m"]),
            ("floats.tif", {"unit": "m", "origin": "top"}, ["origin", "top", "corner"]),
            ("floats.tif", {"unit": "m", "origin": "pixel 3"}, ["pixel 120, 80"]),
            ("floats.tif", {"unit": "m", "origin": "0, 0"}, ["outside the map"]),
            ("floats.tif", {"unit": "m", "zero": "sea"}, ["--zero", "sea"]),
            ("floats.tif", {"unit": "m", "fade": "9"}, ["fade", "half its shorter side"]),
            ("degrees.tif", {"unit": "m"}, ["--posting or --length"]),
            ("holes.tif", {"unit": "m"}, ["1 heights missing", "gdal_fillnodata"]),
            ("flat.tif", {"unit": "m"}, ["flat"]),
            ("marks.tif", {"unit": "m"}, ["1 height of exactly -9999 m", "below all others (10 to 98)", "gdal_edit -a_nodata -9999"]),
            ("fathoms.tif", {}, ["in 'sea fathoms'", "no known length", "--unit m"]),
            ("text.tif", {"unit": "m"}, ["cannot be read as a raster"]),
            ("absent.tif", {"unit": "m"}, ["there is no height map"]),
        ],
    )
    def test_nothing_is_guessed(self, tmp_path, ramp, file, stated, words):
        import rasterio

        write_png(tmp_path / "grey.png", ramp.astype(np.uint16))
        with rasterio.open(tmp_path / "colors.png", "w", driver="PNG", height=5, width=9, count=3, dtype="uint8") as raster:
            raster.write(np.zeros((3, 5, 9), np.uint8))
        write_tif(tmp_path / "floats.tif", ramp)
        write_tif(tmp_path / "degrees.tif", ramp, crs="IAU_2015:30100", posting=(0.1, 0.1), corner=(0, 10))
        write_tif(tmp_path / "holes.tif", np.where(ramp == ramp[2, 2], np.nan, ramp))
        write_tif(tmp_path / "flat.tif", 0 * ramp)
        write_tif(tmp_path / "marks.tif", np.where(ramp == ramp[2, 2], -9999.0, ramp))
        write_tif(tmp_path / "fathoms.tif", ramp, unit="sea fathoms")
        (tmp_path / "text.tif").write_text("no raster")
        with pytest.raises(InputRefused) as refused:
            own.read_height_map(tmp_path / file, own.Georeference(**stated))
        for word in words:
            assert word in str(refused.value)
        assert "\n" not in str(refused.value)

    def test_a_map_that_ends_in_a_wall_is_refused(self, tmp_path, ramp):
        write_tif(tmp_path / "map.tif", ramp)
        relief = own.read_height_map(tmp_path / "map.tif", own.Georeference(unit="m", fade="0"))
        with pytest.raises(InputRefused, match=r"from zero at its border.*--fade.*--blend replace"):  # options that there are
            keep(tmp_path, relief, tmp_path / "map.tif")


def plan(n_rows=81, n_cols=121, posting=0.025):
    """A grid around the origin."""
    return Grid(
        n_rows=n_rows,
        n_cols=n_cols,
        posting_x=posting,
        posting_y=posting,
        x_west=-(n_cols - 1) / 2 * posting,
        y_north=(n_rows - 1) / 2 * posting,
    )


class TestRasterisation:
    def test_a_tilted_plane_is_exact(self):
        """Two triangles of z = 0.3 x - 0.2 y + 1, no point on the common diagonal is lost."""
        corners = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
        vertices = np.column_stack([corners, 0.3 * corners[:, 0] - 0.2 * corners[:, 1] + 1])
        heights = rasterise(vertices, np.array([[0, 1, 2], [0, 2, 3]]), plan())
        x, y = plan().points(plan().whole)
        inside = np.maximum(np.abs(x), np.abs(y)) <= 1 + 1e-9
        assert (np.isfinite(heights) == inside).all()
        assert np.abs(heights - (0.3 * x - 0.2 * y + 1))[inside].max() < 1e-14

    def test_a_box_turned_in_plan(self):
        """Height 0.5 inside the turned square, nothing outside it; the bottom face is hidden."""
        mesh = trimesh.creation.box((1.2, 0.8, 0.5))
        mesh.apply_transform(trimesh.transformations.rotation_matrix(0.4, [0, 0, 1]))
        heights = rasterise(mesh.vertices, mesh.faces, plan())
        x, y = plan().points(plan().whole)
        u, v = np.cos(0.4) * x + np.sin(0.4) * y, np.cos(0.4) * y - np.sin(0.4) * x
        inside = (np.abs(u) < 0.6) & (np.abs(v) < 0.4)
        assert (np.isfinite(heights) == inside).all()
        assert heights[inside] == pytest.approx(0.25, abs=1e-14)

    def test_a_cone_of_many_sides(self):
        """Between the cone that holds it and the one that it holds: chords lie 1 - cos(pi / n) of the radius inside."""
        n = 64
        mesh = trimesh.creation.cone(1.0, 0.7, sections=n)
        heights = rasterise(mesh.vertices, mesh.faces, plan())
        x, y = plan().points(plan().whole)
        r = np.hypot(x, y)
        inner = np.isfinite(heights) & (heights > 0)
        assert (inner | (r > np.cos(np.pi / n))).all()
        assert (heights[inner] <= 0.7 * (1 - r[inner]) + 1e-12).all()
        assert (heights[inner] >= 0.7 * (1 - r[inner] / np.cos(np.pi / n)) - 1e-12).all()

    def test_a_sphere_converges_with_the_square_of_its_edges(self):
        """Chords of length e lie e^2 / 8 inside: from one subdivision to the next the largest error falls to a quarter (measured away from
        the silhouette, where the slope is infinite)."""
        x, y = plan().points(plan().whole)
        inside = np.hypot(x, y) < 0.6
        exact = np.sqrt(1 - np.hypot(x, y)[inside] ** 2)
        errors = []
        for subdivisions in (3, 4, 5):
            mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=1.0)
            seen = rasterise(mesh.vertices, mesh.faces, plan())[inside]
            assert (seen <= exact + 1e-12).all()
            errors.append(float((exact - seen).max()))
        assert errors[0] / errors[1] == pytest.approx(4, rel=0.25)
        assert errors[1] / errors[2] == pytest.approx(4, rel=0.25)

    def test_rays_say_the_same(self):
        """Against trimesh's ray casting, at points that lie on no edge."""
        mesh = trimesh.creation.torus(0.7, 0.25, major_sections=24, minor_sections=12)
        grid = replace(plan(41, 61, 0.05), x_west=-1.4937, y_north=0.9871)
        seen = rasterise(mesh.vertices, mesh.faces, grid)
        x, y = grid.points(grid.whole)
        down = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 5.0)])
        hits, rays, _ = mesh.ray.intersects_location(down, np.tile([0.0, 0, -1], (x.size, 1)), multiple_hits=True)
        expected = np.full(x.size, -np.inf)
        np.maximum.at(expected, rays, hits[:, 2])
        assert (np.isfinite(seen).ravel() == np.isfinite(expected)).all()
        known = np.isfinite(expected)
        assert seen.ravel()[known] == pytest.approx(expected[known], abs=1e-9)

    def test_portions_change_nothing(self, monkeypatch):
        mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.9)
        whole = rasterise(mesh.vertices, mesh.faces, plan())
        monkeypatch.setattr(zbuffer, "MOST", 1000)
        assert rasterise(mesh.vertices, mesh.faces, plan()).tobytes() == whole.tobytes()


class TestSolids:
    @pytest.fixture
    def wedge(self):
        """A wedge 2 m long (x), 1 m wide, rising to 0.5 m at x = 2, its corner at the origin of the file."""
        corners = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [2, 0, 0.5], [2, 1, 0.5]], float)
        triangles = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 4], [3, 5, 2], [1, 2, 5], [1, 5, 4], [0, 4, 5], [0, 5, 3]])
        return corners, triangles

    def test_it_is_enlarged_and_embedded(self, tmp_path, wedge):
        """z = max(x / 4 - depth, 0) on the wedge, to a thousandth of its size (it is kept as a grid)."""
        file = tmp_path / "wedge.stl"
        trimesh.Trimesh(*wedge).export(file)
        vertices, triangles = own.read_triangles(file, "m")
        relief = own.heights_of_solid(vertices, triangles, subject="wedge", origin="coordinates", embed="10 cm")
        form = keep(tmp_path, relief, file)
        assert (form.blend, form.steep) == ("max", True)
        values = form.values({}, "it")
        assert values["length"] == pytest.approx(2)
        assert values["height"] == pytest.approx(0.5)
        assert values["embedded"] == pytest.approx(0.2)
        x, y = np.random.default_rng(1).uniform((0.02, 0.02), (1.98, 0.98), (500, 2)).T
        assert form.profile(x, y, values) == pytest.approx(np.maximum(x / 4 - 0.1, 0), abs=5e-4)
        assert form.profile(np.array([-0.1, 2.1]), np.array([0.5, 0.5]), values) == pytest.approx([0, 0])
        larger = form.values({"length": "4 m", "height": 1.0, "embedded": 0.0}, "it")
        assert form.profile(2 * x, 2 * y, larger) == pytest.approx(x / 2, abs=1e-3)

    @pytest.mark.parametrize(
        ("reference", "lowest_corner"),
        [
            ({"origin": "coordinates"}, (0, 0, 0)),
            ({"origin": "centre"}, (-1, -0.5, 0)),
            ({"origin": "50 cm, 0"}, (-0.5, 0, 0)),
            ({"origin": "coordinates", "zero": "centre"}, (0, 0, -0.25)),
            ({"origin": "coordinates", "zero": "20 cm"}, (0, 0, -0.2)),
        ],
    )
    def test_the_reference(self, wedge, reference, lowest_corner):
        relief = own.heights_of_solid(*wedge, subject="wedge", **reference)
        x, y = relief.grid.points(relief.grid.whole)
        raised = relief.heights > 0
        left, south, bottom = lowest_corner
        assert x[raised].max() == pytest.approx(left + 2, abs=1e-9)
        assert (y[raised].min(), y[raised].max()) == pytest.approx((south, south + 1), abs=1e-9)
        assert relief.heights.max() == pytest.approx(bottom + 0.5)
        assert np.abs(relief.heights - np.maximum((x - left) / 4 + bottom, 0))[raised].max() < 1e-12

    @pytest.mark.parametrize(("up", "size"), [("z", (2, 1, 0.5)), ("x", (0.5, 1, 2)), ("-y", (2, 0.5, 1)), ("-z", (2, 1, 0.5))])
    def test_the_axis_that_points_up(self, wedge, up, size):
        relief = own.heights_of_solid(*wedge, subject="wedge", up=up, posting="2 cm")
        extent = [2 * max(abs(relief.grid.x_west), 0) - 0.04, 2 * relief.grid.y_north - 0.04, relief.heights.max()]
        assert extent == pytest.approx(size, abs=0.041)

    def test_turning_it_mirrors_nothing(self):
        """Every choice of the axis is a rotation: a right-handed triple stays right-handed."""
        for up in ("x", "y", "z", "-x", "-y", "-z"):
            from rille.terrain.own.mesh_file import turn_up

            turned = turn_up(np.eye(3), up)
            assert np.linalg.det(turned) == pytest.approx(1)
            axis = np.eye(3)["xyz".index(up[-1])] * (-1 if up[0] == "-" else 1)
            assert turn_up(axis[None], up)[0] == pytest.approx([0, 0, 1])

    @pytest.mark.parametrize(("up", "kept"), [("y", "x"), ("-y", "x"), ("x", "y"), ("-x", "y"), ("z", "xy"), ("-z", "x")])
    def test_the_axis_is_brought_up_by_the_shortest_turn(self, up, kept):
        """A turn about the axis that is square to both: that one stays where it is, and so do both where nothing is to be turned."""
        for axis in kept:
            unit = np.eye(3)["xyz".index(axis)]
            assert own.mesh_file.turn_up(unit[None], up)[0].tolist() == unit.tolist()

    @pytest.mark.parametrize("ending", ["glb", "gltf", "obj", "stl"])
    def test_what_rille_exports_comes_back_as_it_was(self, tmp_path, ending):
        """A wedge with a ridge on one side looks different from everywhere. Heights in single precision: 1e-6 m."""
        y, x = np.mgrid[6:-1:-1, 0:9] * 0.5
        heights = 0.2 + 0.1 * x + np.where(y > 2.2, 0.3, 0.0) + 0.05 * x * y
        form = Terrain(name="form", heights=heights, posting_x=0.5, posting_y=0.5, x_west=-1.0, y_north=2.0, soil="", soils=(), pairs=())
        path = tmp_path / f"form.{ending}"
        deliver(form, plan_outputs([path]))
        vertices, triangles = own.read_triangles(path, None if ending.startswith("gl") else "m")
        where = {"origin": "coordinates", "zero": "coordinates", "posting": "0.5 m"}
        relief = own.heights_of_solid(vertices, triangles, subject="form", up=own.up_axis(path), **where)
        assert (relief.grid.x_west, relief.grid.y_north) == pytest.approx((-1.5, 2.5))  # a border of one point
        assert np.abs(relief.heights[1:-1, 1:-1] - heights).max() < 1e-6

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            ({"origin": "corner"}, ["origin of wedge", "coordinates"]),
            ({"origin": "1 kg, 2"}, ["1 kg"]),
            ({"zero": "top"}, ["--zero", "top"]),
            ({"zero": "1 m"}, ["-0.5 m above its height zero", "--zero"]),
            ({"embed": "1 m"}, ["embedded by 1 m", "less than its height of 0.5 m"]),
            ({"up": "w"}, ["'w'", "-z"]),
            ({"posting": "3 m"}, ["posting of wedge is 3 m", "take between"]),
            ({"posting": "1 um"}, ["take between"]),
        ],
    )
    def test_what_cannot_be_placed_is_refused(self, wedge, options, words):
        with pytest.raises(InputRefused) as refused:
            own.heights_of_solid(*wedge, subject="wedge", **options)
        for word in words:
            assert word in str(refused.value)

    def test_units_of_meshes(self, tmp_path, wedge):
        mesh = trimesh.Trimesh(*wedge)
        for suffix in (".stl", ".obj", ".ply"):
            mesh.export(tmp_path / f"wedge{suffix}")
            with pytest.raises(InputRefused, match="--unit mm"):
                own.read_triangles(tmp_path / f"wedge{suffix}", None)
            vertices, _ = own.read_triangles(tmp_path / f"wedge{suffix}", "mm")
            assert np.ptp(vertices, axis=0) == pytest.approx([2e-3, 1e-3, 0.5e-3])
        mesh.export(tmp_path / "wedge.glb")
        assert np.ptp(own.read_triangles(tmp_path / "wedge.glb", None)[0], axis=0) == pytest.approx([2, 1, 0.5])
        assert (own.up_axis(tmp_path / "wedge.glb"), own.up_axis(tmp_path / "wedge.stl")) == ("y", "z")

    def test_a_triangle_of_a_vertex_that_is_not_there(self, tmp_path, wedge):
        content = trimesh.Trimesh(*wedge).export(file_type="glb")
        first = np.asarray(wedge[1][0], "<u4").tobytes()
        assert content.count(first) == 1
        (tmp_path / "mesh.glb").write_bytes(content.replace(first, np.array([0, 2, 99], "<u4").tobytes()))
        with pytest.raises(InputRefused, match="names the vertex 99, but has 6"):
            own.read_triangles(tmp_path / "mesh.glb", None)

    @pytest.mark.parametrize(
        ("name", "content", "words"),
        [
            ("mesh.stl", b"", ["mesh.stl"]),
            ("mesh.stl", b"solid x\nendsolid x\n", ["mesh.stl"]),
            ("mesh.ply", b"ply\nformat ascii 1.0\nelement vertex x\n", ["cannot be read"]),
            ("mesh.abc", b"", ["of a kind that is not read", ".stl"]),
            ("mesh.obj", b"v 0 0 0\nv 1 0 0\nv 0 1e30 0\nf 1 2 3\n", ["a coordinate of 1e+27 m", "--unit"]),
            ("mesh.ply", PLY + b"3 0 1 9\n", ["mesh.ply", "cannot be read", "9"]),
        ],
    )
    def test_broken_meshes_are_refused(self, tmp_path, name, content, words):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputRefused) as refused:
            own.read_triangles(tmp_path / name, "mm")
        for word in words:
            assert word in str(refused.value)
