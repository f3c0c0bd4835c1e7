"""Every format of delivery, read back by another program: positions, row order, offsets, holes, refusals.

The ground is an asymmetric ramp with a spike on a grid that is not square in any sense, shifted, and once turned on the map: whatever is
mirrored, transposed, shifted by half a cell or offset in height shows.
"""

import errno
import json
import math
import struct
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
import rasterio
from PIL import Image
from rasterio.crs import CRS

from machines import LUNAR_SOIL
from rille.model import InputRefused, MaterialPair, Obstacle, Pose, SoilPatch, Terrain
from rille.terrain import build
from rille.terrain.delivery import FORMATS, deliver, find_format, left_out, mesh_rows, plan, strips
from rille.terrain.delivery import appearing as appearing_module

MOON = "IAU_2015:30110"


def ramp(n_rows=37, n_cols=53, posting=(0.5, 0.25), **more):
    """z = 0.3 x - 0.1 y + noise, with one spike; 53 x 37 points; x from -7.25 m, y from 11.5 m down."""
    x, y = -7.25 + posting[0] * np.arange(n_cols), 11.5 - posting[1] * np.arange(n_rows)
    heights = 0.3 * x[None, :] - 0.1 * y[:, None] + np.random.default_rng(3).uniform(-0.2, 0.2, (n_rows, n_cols))
    heights[n_rows // 8, n_cols // 3] += 5.0
    values = {
        "name": "ramp & co",
        "heights": heights,
        "posting_x": posting[0],
        "posting_y": posting[1],
        "x_west": -7.25,
        "y_north": 11.5,
        "soil": LUNAR_SOIL.name,
        "soils": (LUNAR_SOIL, replace(LUNAR_SOIL, name="hard <rock>")),
        "pairs": (MaterialPair(response="bekker_wong", soil=LUNAR_SOIL.name),),
        "patches": (SoilPatch(name="p", soil="hard <rock>", polygon=((-5.0, 10.0), (2.0, 10.0), (2.0, 6.0))),),
        "crs": MOON,
        "map_origin": (1000.0, 2000.0, -1500.5),
    }
    return Terrain(**(values | more))


def holed():
    """The ramp without a corner and without one value in the middle."""
    terrain = ramp()
    heights = terrain.heights.copy()
    heights[20, 30] = np.nan
    heights[:4, -5:] = np.nan
    return replace(terrain, heights=heights)


def axes(terrain):
    """x of columns and y of rows."""
    n_rows, n_cols = terrain.heights.shape
    return terrain.x_west + terrain.posting_x * np.arange(n_cols), terrain.y_north - terrain.posting_y * np.arange(n_rows)


def written(terrain, path, name=None):
    """Deliver in one format."""
    deliver(terrain, plan([path], name))
    return path


def on_the_map(terrain, i, j):
    """Easting and northing of the point in row i, column j, from the definition of map_origin and map_heading."""
    x, y = axes(terrain)
    c, s = np.cos(terrain.map_heading), np.sin(terrain.map_heading)
    return (
        terrain.map_origin[0] + c * x[j] - s * y[i],
        terrain.map_origin[1] + s * x[j] + c * y[i],
    )


@pytest.mark.parametrize("ending", [".tif", ".cog.tif", ".soil.tif"])
@pytest.mark.parametrize("heading", [0.0, 0.7, -2.5])
def test_every_cell_of_a_geotiff_has_its_centre_at_its_point(tmp_path, ending, heading):
    """To 1e-9 m: rounding of a few operations on numbers of 1e3 m."""
    terrain = ramp(map_heading=heading)
    with rasterio.open(written(terrain, tmp_path / f"t{ending}")) as raster:
        for i, j in ((0, 0), (36, 0), (0, 52), (4, 17)):
            assert raster.xy(i, j) == pytest.approx(on_the_map(terrain, i, j), abs=1e-9)
        assert raster.crs == CRS.from_string(MOON)
        if ending != ".soil.tif":
            assert np.array_equal(raster.read(1), terrain.heights + terrain.map_origin[2])


def test_a_terrain_without_projection_gets_a_local_one_in_metres(tmp_path):
    with rasterio.open(written(ramp(crs=""), tmp_path / "t.tif")) as raster:
        assert 'UNIT["metre",1' in raster.crs.to_wkt()
        assert raster.transform.a == 0.5


def test_a_terrain_without_projection_can_be_read_as_a_base_again(tmp_path):
    from rille.terrain import read_dem

    terrain = ramp(crs="")
    dem = read_dem(written(terrain, tmp_path / "t.tif"))
    assert np.array_equal(dem.heights, terrain.heights - 1500.5)
    assert (dem.x_west, dem.y_north) == pytest.approx((1000 - 7.25, 2000 + 11.5))
    assert dem.crs == ""


def test_a_cog_is_one_and_its_overviews_are_points(tmp_path):
    heights = np.arange(700 * 1100, dtype=float).reshape(700, 1100)
    path = written(ramp(heights=heights), tmp_path / "t.cog.tif")
    with rasterio.open(path) as raster:
        assert raster.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
        assert raster.overviews(1)[0] == 2
        assert np.array_equal(raster.read(1), heights - 1500.5)
    with rasterio.open(path, overview_level=0) as raster:
        assert np.isin(raster.read(1), heights - 1500.5).all()
    assert list(tmp_path.iterdir()) == [path]


def test_ascii_keeps_every_bit_and_says_where_its_points_are(tmp_path):
    terrain = replace(holed(), posting_y=0.5)
    path = written(terrain, tmp_path / "t.asc")
    lines = path.read_text().splitlines()
    assert [line.split()[0] for line in lines[:6]] == ["ncols", "nrows", "xllcenter", "yllcenter", "cellsize", "NODATA_value"]
    with rasterio.open(path) as raster:
        assert raster.xy(36, 0) == pytest.approx((1000 - 7.25, 2000 + 11.5 - 36 * 0.5), abs=1e-9)
        assert raster.crs is not None
        assert "2015" in raster.crs.to_wkt()
    values = np.array([line.split() for line in lines[6:]], float)
    assert np.array_equal(np.where(values == -1e6, np.nan, values), terrain.heights + terrain.map_origin[2], equal_nan=True)


def test_pds4_holds_the_same_numbers_at_the_same_places(tmp_path):
    terrain = holed()
    path = written(terrain, tmp_path / "t.xml")
    assert sorted(f.name for f in tmp_path.iterdir()) == ["t.img", "t.xml"]
    with rasterio.open(path) as raster:
        values = raster.read(1, masked=True).filled(np.nan)
        assert np.array_equal(values, terrain.heights + terrain.map_origin[2], equal_nan=True)
        assert raster.xy(4, 17) == pytest.approx(on_the_map(terrain, 4, 17), abs=1e-6)
    text = path.read_text()
    assert "${" not in text, "a placeholder of the template was left in"
    assert "urn:rille:terrain:data:ramp_co" in text
    image = np.fromfile(tmp_path / "t.img", "<f8").reshape(37, 53)
    assert image[4, 17] == terrain.heights[4, 17] + terrain.map_origin[2]


@pytest.mark.parametrize("make", [ramp, holed])
def test_png16_comes_back_within_half_a_step(tmp_path, make):
    """z = offset + scale grey from the sidecar alone; the bound is half a step and rounding (1e-12)."""
    terrain = make()
    path = written(terrain, tmp_path / "t.png")
    notes = json.loads((tmp_path / "t.png.json").read_text())
    grey = np.array(Image.open(path))
    assert grey.shape == (37, 53)
    read = notes["offset_m"] + notes["scale_m"] * grey.astype(float)
    if notes["no_value"] is not None:
        read[grey == notes["no_value"]] = np.nan
    assert np.array_equal(np.isnan(read), np.isnan(terrain.heights))
    assert np.nanmax(np.abs(read - terrain.heights)) <= notes["largest_error_m"] + 1e-12
    assert notes["largest_error_m"] < 1e-4
    assert (notes["x_of_column_0_m"], notes["y_of_row_0_m"], notes["posting_m"]) == (-7.25, 11.5, {"x": 0.5, "y": 0.25})


def test_flat_ground_is_a_png_too(tmp_path):
    path = written(ramp(heights=np.full((5, 7), 3.25)), tmp_path / "t.png")
    notes = json.loads((tmp_path / "t.png.json").read_text())
    assert (notes["offset_m"] + notes["scale_m"] * np.array(Image.open(path)) == 3.25).all()


def test_npy_is_the_array(tmp_path):
    terrain = holed()
    assert np.array_equal(np.load(written(terrain, tmp_path / "t.npy")), terrain.heights, equal_nan=True)
    notes = json.loads((tmp_path / "t.npy.json").read_text())
    assert notes["map_origin_m"] == {"east": 1000.0, "north": 2000.0, "z": -1500.5}
    assert "northernmost" in notes["row_order"]
    assert "n - 1 cells" in notes["points"]


def lattice(terrain):
    """Points (n, 3) of all heights."""
    x, y = axes(terrain)
    points = np.stack([*np.broadcast_arrays(x[None, :], y[:, None]), terrain.heights], axis=-1).reshape(-1, 3)
    return points[np.isfinite(points[:, 2])]


@pytest.mark.parametrize("ending", [".obj", ".stl", ".glb", ".gltf"])
@pytest.mark.parametrize("make", [ramp, holed])
def test_meshes_have_their_vertices_at_the_heights(tmp_path, monkeypatch, ending, make):
    """Read by trimesh; OBJ exactly, the others to single precision of 20 m (2e-6 m). Strips of few rows, so that their seams show."""
    import trimesh

    monkeypatch.setattr(strips, "BLOCK", 8)
    monkeypatch.setattr(strips, "VALUES", 1)
    terrain = make()
    path = written(terrain, tmp_path / f"t{ending}")
    mesh = trimesh.load(path, force="mesh", process=False)
    points = np.asarray(mesh.vertices)
    if ending in (".glb", ".gltf"):
        points = points[:, [0, 2, 1]] * [1, -1, 1]  # y is up there
    expected = lattice(terrain)
    tolerance = 0 if ending == ".obj" else 2e-6
    if ending != ".stl":  # triangles without numbered vertices: the next test
        assert points.shape == expected.shape
        assert np.abs(points - expected).max() <= tolerance
    z = terrain.heights
    full = np.isfinite(z[:-1, :-1] + z[1:, :-1] + z[:-1, 1:] + z[1:, 1:])
    assert len(mesh.faces) == 2 * full.sum()
    up = mesh.face_normals[:, 1 if ending in (".glb", ".gltf") else 2]
    assert (up > 0).all()
    corners = points[mesh.faces]
    area = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]).sum() / 2
    assert area == pytest.approx(0.125 * full.sum(), rel=1e-5)


def test_a_triangle_of_an_stl_lies_on_the_heights(tmp_path):
    """Every corner of every triangle, looked up in the grid: to single precision."""
    terrain = ramp()
    data = written(terrain, tmp_path / "t.stl").read_bytes()
    (count,) = struct.unpack("<I", data[80:84])
    assert count == 2 * 36 * 52
    facets = np.frombuffer(data[84:], np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")]))
    corners = facets["c"].reshape(-1, 3).astype(float)
    j, i = np.rint((corners[:, 0] + 7.25) / 0.5).astype(int), np.rint((11.5 - corners[:, 1]) / 0.25).astype(int)
    assert np.abs(corners[:, 2] - terrain.heights[i, j]).max() < 2e-6
    assert np.abs(np.linalg.norm(facets["n"], axis=1) - 1).max() < 1e-5


def triangle_heights(terrain, x, y):
    """Heights at points when a cell is two triangles: split north-west to south-east, and the other way."""
    column, row = (x - terrain.x_west) / terrain.posting_x, (terrain.y_north - y) / terrain.posting_y
    j, i = column.astype(int), row.astype(int)
    u, v = column - j, row - i
    z = terrain.heights
    nw, ne, sw, se = z[i, j], z[i, j + 1], z[i + 1, j], z[i + 1, j + 1]
    falling = np.where(u > v, nw + u * (ne - nw) + v * (se - ne), nw + v * (sw - nw) + u * (se - sw))
    rising = np.where(u + v < 1, nw + u * (ne - nw) + v * (sw - nw), se + (1 - u) * (sw - se) + (1 - v) * (ne - se))
    return falling, rising


def test_mujoco_stands_on_the_same_ground(tmp_path):
    """Rays from above at 500 random points, and at every grid point: MuJoCo's two triangles a cell through our heights, to single
    precision of the relief (13 m x 6e-8 x a few = 5e-6 m). Obstacles are where they are."""
    import mujoco

    rock = Obstacle(name="block", kind="box", pose=Pose(position=(60.0, 0.0, 5.0)), size=(2.0, 1.0, 0.5))
    corners = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-0.5, 0.5)]) * [1.0, 0.5, 1.0]
    hull = Obstacle(name="hull", kind="hull", pose=Pose(position=(70.0, 3.0, 2.0)), vertices=corners + [0.3, 0, 0.25])
    terrain = ramp(obstacles=(rock, hull))
    path = written(terrain, tmp_path / "t.mjcf")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    hit = np.zeros(1, np.int32)

    def top(x, y):
        distance = mujoco.mj_ray(model, data, np.array([x, y, 50.0]), np.array([0.0, 0.0, -1.0]), None, 1, -1, hit)
        return 50.0 - distance

    random = np.random.default_rng(5)
    x, y = random.uniform(-7.24, -7.25 + 51.9 * 0.5, 500), random.uniform(11.5 - 35.9 * 0.25, 11.49, 500)
    found = np.array([top(a, b) for a, b in zip(x, y, strict=True)])
    falling, rising = triangle_heights(terrain, x, y)
    assert min(np.abs(found - falling).max(), np.abs(found - rising).max()) < 5e-6
    cx, cy = axes(terrain)
    inner = [(i, j) for i in range(1, 36, 5) for j in range(1, 52, 7)]
    assert np.abs([top(cx[j], cy[i]) - terrain.heights[i, j] for i, j in inner]).max() < 1e-5
    assert top(60.9, 0.4) == pytest.approx(5.25, abs=1e-6)
    assert top(70.0 + 0.3 + 0.9, 3.0) == pytest.approx(2.75, abs=1e-6)
    assert top(70.0 + 0.3 - 1.1, 3.0) > 49  # past its edge: nothing


def test_gazebo_stretches_the_image_over_the_points(tmp_path):
    """By Gazebo's rule z = pos_z + size_z grey / 65535, x and y stretched over size: read from the world alone, to half a step."""
    terrain = ramp(33, 33)
    path = written(terrain, tmp_path / "t.sdf")
    world = ET.parse(path).getroot()
    heightmap = world.find(".//collision//heightmap")
    size, pos = (np.array(heightmap.find(name).text.split(), float) for name in ("size", "pos"))
    grey = np.array(Image.open(tmp_path / heightmap.find("uri").text)).astype(float)
    assert grey.max() == 65535
    assert np.abs(pos[2] + size[2] * grey / 65535 - terrain.heights).max() <= size[2] / 65535 / 2 + 1e-12
    x, y = axes(terrain)
    assert pos[0] - size[0] / 2 == pytest.approx(x[0])
    assert pos[0] + size[0] / 2 == pytest.approx(x[-1])
    assert pos[1] + size[1] / 2 == pytest.approx(y[0])
    assert pos[1] - size[1] / 2 == pytest.approx(y[-1])


def stones():
    """One obstacle of each kind, turned, with names that formats must take."""
    turned = (math.cos(0.4), 0.0, math.sin(0.4), 0.0)  # by 0.8 rad about y
    corners = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-0.5, 0.5)]) * [0.5, 0.25, 0.5]
    return (
        Obstacle(name="block", kind="box", pose=Pose(position=(1.0, 2.0, 3.0), rotation=turned), size=(2.0, 1.0, 0.5)),
        Obstacle(name="ball & co", kind="sphere", pose=Pose(position=(3.0, 2.0, 3.0)), size=(0.5,)),
        Obstacle(name="post", kind="cylinder", pose=Pose(position=(5.0, 2.0, 3.0), rotation=turned), size=(0.2, 1.5)),
        Obstacle(name="terrain", kind="hull", pose=Pose(position=(7.0, 2.0, 3.0), rotation=turned), vertices=corners + [0.1, 0.0, 0.0]),
    )


# volumes [m^3]; round ones of 24 segments are smaller than the round body by 1.1 % (2 pi / 24 over its sine) and 2 %
VOLUMES = {"block": (1.0, 1e-6), "ball & co": (np.pi / 6, 0.03), "post": (0.06 * np.pi, 0.012), "terrain": (0.25, 1e-6)}


def test_gazebo_has_the_obstacles_where_they_are(tmp_path):
    """Links of a static model with collision and visual; the mesh of a rock is a file of its own, and is listed with what was written."""
    import trimesh

    terrain = ramp(33, 33, obstacles=stones())
    files = deliver(terrain, plan([tmp_path / "t.sdf"]))
    assert [file.name for file in files] == ["t.sdf", "t.png", "t.rock_1.obj"]
    model = ET.parse(tmp_path / "t.sdf").getroot().find("world/model[@name='obstacles']")
    assert model.find("static").text == "true"
    links = {link.get("name"): link for link in model.findall("link")}
    assert list(links) == [stone.name for stone in stones()]
    for stone in stones():
        pose = links[stone.name].find("pose")
        x, y, z, qx, qy, qz, qw = (float(v) for v in pose.text.split())
        assert pose.get("rotation_format") == "quat_xyzw"
        assert ((x, y, z), (qw, qx, qy, qz)) == (stone.pose.position, stone.pose.rotation)
        collision, visual = (links[stone.name].find(f"{part}/geometry")[0] for part in ("collision", "visual"))
        assert ET.tostring(collision) == ET.tostring(visual)
        numbers = {"box": "size", "sphere": "radius", "cylinder": "radius length"}.get(stone.kind, "").split()
        assert [float(v) for name in numbers for v in collision.find(name).text.split()] == list(stone.size)
    rock = trimesh.load(tmp_path / links["terrain"].find("collision/geometry/mesh/uri").text, force="mesh")
    assert rock.volume == pytest.approx(0.25)
    assert rock.bounds == pytest.approx(np.array([[-0.4, -0.25, -0.25], [0.6, 0.25, 0.25]]))


@pytest.mark.parametrize("ending", [".obj", ".glb", ".gltf"])
def test_meshes_hold_obstacles_as_objects_of_their_own(tmp_path, ending):
    """Each is closed, outside out (its volume is positive), and has its volume and its middle."""
    import trimesh

    path = written(ramp(9, 9, obstacles=stones()), tmp_path / f"t{ending}")
    loaded = trimesh.load_scene(path, **({"group_material": False, "split_objects": True} if ending == ".obj" else {}))
    parts = {name: mesh for mesh, name in zip(loaded.dump(), loaded.graph.nodes_geometry, strict=True)}
    assert len(parts) == 5
    for stone in stones():
        mesh = parts[f"obstacle_{stone.name.replace(' ', '_')}" if ending == ".obj" else stone.name]
        mesh.merge_vertices()
        volume, tolerance = VOLUMES[stone.name]
        assert mesh.is_watertight
        assert mesh.volume == pytest.approx(volume, rel=tolerance)
        x, y, z = mesh.center_mass
        if ending != ".obj":
            y, z = -z, y
        shift = 0.1 * np.array([math.cos(0.8), 0.0, -math.sin(0.8)]) if stone.kind == "hull" else 0.0
        assert np.array([x, y, z]) == pytest.approx(np.array(stone.pose.position) + shift, abs=1e-6)


def test_formats_without_obstacles_say_so(tmp_path):
    outputs = plan([tmp_path / name for name in ("t.stl", "t.tif", "t.glb", "t.sdf")])
    assert left_out(ramp(), outputs) == ""
    sentence = left_out(ramp(obstacles=stones()), outputs)
    assert sentence.startswith("t.stl, t.tif: the ground alone, without the 4 obstacles of the scene; ")
    assert left_out(ramp(obstacles=stones()), outputs[2:]) == ""


def test_gazebo_says_which_posting_it_takes(tmp_path):
    with pytest.raises(InputRefused, match=r"53 x 37 points.*2\^n \+ 1.*--posting 0\.40625,0\.140625 for 65 x 65"):
        written(ramp(), tmp_path / "t.sdf")


def test_the_soil_map_names_and_colours_its_soils(tmp_path):
    terrain = holed()
    path = written(terrain, tmp_path / "t.soil.tif")
    with rasterio.open(path) as raster:
        codes = raster.read(1)
        assert raster.dtypes == ("uint8",)
        assert raster.nodata == 255
        assert raster.tags(1)["soil_1"] == "hard <rock>"
        assert raster.colormap(1)[0] != raster.colormap(1)[1]
    assert (codes[np.isnan(terrain.heights)] == 255).all()
    x, y = axes(terrain)
    i, j = np.argmin(np.abs(y - 9.5)), np.argmin(np.abs(x - 1.25))
    assert codes[i, j] == 1
    assert codes[i, np.argmin(np.abs(x + 4.75))] == 0  # outside the triangle's slope
    names = [c.text for c in ET.parse(tmp_path / "t.soil.tif.aux.xml").getroot().iter("Category")]
    assert names == [LUNAR_SOIL.name, "hard <rock>"]


class Windowed:
    """A surface that can only be asked for windows, and remembers the largest."""

    def __init__(self, values):
        self.values, self.shape, self.largest = values, values.shape, 0

    def __getitem__(self, window):
        found = self.values[window[0], window[1]]
        assert found.ndim == 2
        self.largest = max(self.largest, found.size)
        return found


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_large_surfaces_are_written_window_by_window_with_the_same_bytes(tmp_path, monkeypatch, name):
    """A surface that knows no more than windows gives the files of the array; no window is larger than a strip."""
    monkeypatch.setattr(strips, "BLOCK", 16)
    monkeypatch.setattr(strips, "VALUES", 16 * 33)
    terrain = ramp(33, 33, posting=(0.5, 0.5)) if name in ("gazebo", "ascii") else ramp(49, 33)
    surface = Windowed(terrain.heights)
    fractions = []
    entry = FORMATS[name]
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    entry.write(terrain, tmp_path / "a" / f"t{entry.endings[0]}")
    entry.write(replace(terrain, heights=surface), tmp_path / "b" / f"t{entry.endings[0]}", lambda what, f: fractions.append(f))
    assert surface.largest <= 16 * 33
    assert fractions[-1] == 1.0
    files = sorted(f.name for f in (tmp_path / "a").iterdir())
    assert files == sorted(f.name for f in (tmp_path / "b").iterdir())
    assert sorted(f.name for f in entry.files(tmp_path / "a" / f"t{entry.endings[0]}")) == files
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes(), file


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_a_full_disk_is_one_sentence_and_leaves_what_was_there(tmp_path, monkeypatch, name):
    """Errors in the middle of writing: the old file keeps its bytes, and no part of the new one stays."""
    entry = FORMATS[name]
    terrain = ramp(33, 33, posting=(0.5, 0.5))
    path = tmp_path / f"t{entry.endings[0]}"
    path.write_bytes(b"old")

    class Full(Windowed):
        def __getitem__(self, window):
            if window[0].start:
                raise OSError(errno.ENOSPC, "No space left on device")
            return super().__getitem__(window)

    monkeypatch.setattr(strips, "BLOCK", 16)
    monkeypatch.setattr(strips, "VALUES", 1)
    module = f"rille.terrain.delivery.{entry.module or name}"
    known = strips.relief(terrain)
    monkeypatch.setattr(f"{module}.relief", lambda ground: known, raising=False)  # so that reading fails while writing, not before
    with pytest.raises(InputRefused, match="the disk is full") as refusal:
        entry.write(replace(terrain, heights=Full(terrain.heights)), path)
    assert "\n" not in str(refusal.value)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_under_gdal_is_the_same_sentence(tmp_path):
    """/dev/full as the folder's file system is not to be had; a limit on the size of files is (SIGXFSZ is ignored by Python)."""
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    heights = np.random.default_rng(1).random((700, 700))
    for ending in (".tif", ".npy", ".cog.tif"):
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, before[1]))
        try:
            with pytest.raises(InputRefused, match=r"could not be written.*nothing of it was left behind") as refusal:
                written(ramp(heights=heights), tmp_path / f"t{ending}")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        assert "\n" not in str(refusal.value)
        assert list(tmp_path.iterdir()) == []


def test_a_missing_or_unwritable_folder_is_one_sentence(tmp_path, monkeypatch):
    with pytest.raises(InputRefused, match=r"no folder .*nowhere.*create it"):
        plan([tmp_path / "nowhere/t.tif"])
    with pytest.raises(InputRefused, match="it is a folder"):
        FORMATS["npy"].write(ramp(), tmp_path)

    def denied(**how):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(appearing_module.tempfile, "mkdtemp", denied)
    with pytest.raises(InputRefused, match=r"permission denied; choose another folder"):
        written(ramp(), tmp_path / "t.tif")


def test_formats_are_found_by_ending_and_by_name(tmp_path):
    for name, entry in FORMATS.items():
        for ending in entry.endings:
            assert find_format(tmp_path / f"a.b{ending.upper()}").name == name
    assert find_format(tmp_path / "x.dat", "cog").name == "cog"
    with pytest.raises(InputRefused, match=r"no format 'geotif'; did you mean 'geotiff'"):
        find_format(tmp_path / "x", "geotif")
    with pytest.raises(InputRefused, match=r"'.*x\.tfi'.*did you mean '\.tif'"):
        find_format(tmp_path / "x.tfi")
    with pytest.raises(InputRefused, match=r"known endings: \.tif"):
        find_format(tmp_path / "x")


def test_two_outputs_never_write_one_file(tmp_path):
    with pytest.raises(InputRefused, match=r"both '.*a\.sdf' and '.*a\.png' would write '.*a\.png'"):
        plan([tmp_path / "a.sdf", tmp_path / "a.png"])


@pytest.mark.parametrize(
    ("ending", "change", "words"),
    [
        (".asc", {}, r"posting of 0\.5 m x 0\.25 m.*--posting 0\.25"),
        (".asc", {"posting_y": 0.5, "map_heading": 0.3}, r"turned by 0\.3 rad.*GeoTIFF"),
        (".xml", {"map_heading": 0.3}, r"turned by 0\.3 rad.*GeoTIFF"),
        (".xml", {"crs": ""}, "no map projection.*GeoTIFF"),
        (".mjcf", {"heights": holed().heights}, "lacks 21 heights.*MuJoCo"),
        (".png", {"heights": np.full((4, 4), np.nan)}, "no height at all"),
    ],
)
def test_what_a_format_cannot_express_is_refused(tmp_path, ending, change, words):
    with pytest.raises(InputRefused, match=words) as refusal:
        written(ramp(**change), tmp_path / f"t{ending}")
    assert "\n" not in str(refusal.value)
    assert list(tmp_path.iterdir()) == []


def test_a_mesh_is_never_thinned_out_silently(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_rows, "MOST_POINTS", 500)
    for ending in (".obj", ".stl", ".glb"):
        with pytest.raises(InputRefused, match=r"1961 vertices, more than 500.*--posting 1"):
            written(ramp(), tmp_path / f"t{ending}")


def test_ruts_lie_on_the_map_as_their_terrain_does(tmp_path):
    """On a turned terrain the rut's cells are turned, too: the centre of one cell, from the definition, to 1e-9 m."""
    from rille.model import Ruts
    from rille.terrain import write_ruts

    terrain = ramp(map_heading=0.7)
    depth = np.zeros((5, 9))
    depth[1, 6] = 0.04
    write_ruts(Ruts(sinkage=depth, pressure=depth, posting=0.02, x_west=1.5, y_north=3.25), terrain, tmp_path / "r.tif")
    with rasterio.open(tmp_path / "r.tif") as raster:
        assert raster.read(1)[1, 6] == 0.04
        x, y = 1.5 + 6 * 0.02, 3.25 - 0.02
        c, s = np.cos(0.7), np.sin(0.7)
        assert raster.xy(1, 6) == pytest.approx((1000 + c * x - s * y, 2000 + s * x + c * y), abs=1e-9)


@pytest.mark.parametrize("name", ["r.png", "r", "r.asc"])
def test_ruts_are_written_under_names_of_a_geotiff_alone(tmp_path, name):
    from rille.model import Ruts
    from rille.terrain import write_ruts

    ruts = Ruts(sinkage=np.zeros((5, 9)), pressure=np.zeros((5, 9)), posting=0.02, x_west=1.5, y_north=3.25)
    with pytest.raises(InputRefused, match=r"does not end in \.tif or \.tiff.* for example r\.tif"):
        write_ruts(ruts, ramp(), tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_what_a_terrain_is_made_of_is_not_written_over(tmp_path):
    """Neither the scene nor its DEM becomes an output, whatever format is asked for; another file of that name elsewhere may."""
    dem = tmp_path / "dem.tif"
    with rasterio.open(dem, "w", driver="GTiff", width=5, height=4, count=1, dtype="float32", crs="EPSG:32633",
                       transform=rasterio.Affine(1, 0, 500000, 0, -1, 4000000)) as raster:  # fmt: skip
        raster.write(np.arange(20, dtype=np.float32).reshape(1, 4, 5))
    scene = tmp_path / "scene.toml"
    scene.write_text('name = "s"\nsoil = "lunar_sourcebook"\n[base]\nkind = "dem"\nfile = "dem.tif"\n')
    before = scene.read_bytes(), dem.read_bytes()
    terrain = build(scene)
    for file, name in ((scene, "npy"), (dem, "geotiff")):
        with pytest.raises(InputRefused, match="is made of"):
            deliver(terrain, plan([tmp_path / "other.npy", file], name))
    assert (scene.read_bytes(), dem.read_bytes()) == before
    assert not (tmp_path / "other.npy").exists()
    (tmp_path / "there").mkdir()
    assert deliver(terrain, plan([tmp_path / "there" / "dem.tif"]))
