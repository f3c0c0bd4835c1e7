"""Every reader of rille, each with a small good file: what ``test_mutated.py`` breaks by the thousand.

A reader is a function of a folder; it writes the good file there and returns its path and what reads it, as far as a command would.
"""

import csv
import sqlite3
import struct
import zlib
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drills.mutating import Random, Read, mutated
from effect_rigs import EARTH
from machines import cart, plane
from recording_files import write_bag, write_mcap
from recording_import import CHANNELS, Nowhere, manifest
from rille import cad, simulate, store, terrain
from rille.model import Command, Effect, InitialJointState, JointLimit, Obstacle, Pose, Scenario, Sensor, SoilPatch, Watch
from rille.model.sheet import read_sheet
from rille.proof.real import read_real, real_truth
from rille.recording import import_recording, read_manifest, targets_of
from rille.recording.gate import gate
from rille.recording.instruments import read_instruments
from rille.recording.reading import open_source
from rille.recording.reading.piece import Wanted
from rille.study import read_study_sheet

REPOSITORY = Path(__file__).resolve().parents[2]
EXAMPLES = REPOSITORY / "examples"
MODES = {f"wheel_{row}_{side}": "speed" for row in ("front", "middle", "rear") for side in ("left", "right")} | {
    f"steering_{row}_{side}": "position" for row in ("front", "rear") for side in ("left", "right")
}

Reader = Callable[[Path], tuple[Path, Read]]
Change = Callable[[bytes, Random], tuple[str, bytes]]
READERS: dict[str, Reader] = {}
CHANGES: dict[str, Change] = {}  # readers whose files are broken in a way of their own


def reader(name: str) -> Callable[[Reader], Reader]:
    def keep(make: Reader) -> Reader:
        READERS[name] = make
        return make

    return keep


def copied(file: str, folder: Path) -> Path:
    path = folder / Path(file).name
    path.write_bytes((EXAMPLES / file).read_bytes())
    return path


# ---------------------------------------------------------------- recordings

KNEE = {"knee"}


def imported(path: Path) -> None:
    """All of an import but what it writes: columns, stamps, units, corrections, the gate."""
    import_recording(read_manifest(path), Nowhere(), path.parent, gate=gate)


def table_lines(n: int = 60) -> list[tuple[float, float, float]]:
    t = 0.02 * np.arange(n)
    return [(round(a, 6), round(float(np.sin(3 * a)), 9), round(float(3 * np.cos(3 * a)), 9)) for a in t]


@reader("csv")
def _csv(folder: Path) -> tuple[Path, Read]:
    good = folder / "d.csv"
    good.write_text("t,q,v\n" + "".join(f"{t},{q},{v}\n" for t, q, v in table_lines()))
    sheet = manifest(folder, "d.csv")
    return good, lambda path: imported(sheet)


@reader("csv of another dialect")
def _semicolons(folder: Path) -> tuple[Path, Read]:
    """A byte order mark, a comment, quotes, semicolons, dates, a column that splits the file."""
    good = folder / "d.csv"
    lines = [f'2024-05-01T12:00:{t:09.6f};"{q}";{v};{"a" if t < 0.6 else "b"}\r\n' for t, q, v in table_lines()]
    good.write_bytes(b"\xef\xbb\xbf# a log\r\nt;q;v;run\r\n" + "".join(lines).encode())
    sheet = manifest(folder, "d.csv", top='split = ["run"]', time='[time]\ncolumn = "t"\norigin = "first"\n')
    return good, lambda path: imported(sheet)


@reader("csv of a wheel bench")
def _bench_points(folder: Path) -> tuple[Path, Read]:
    good = folder / "b.csv"
    good.write_text("slip,load,pull,z\n" + "".join(f"{0.1 * (k % 9)},30,{2 * (k % 9)},{5 + k % 9}\n" for k in range(40)))
    channel = '[[channel]]\ncolumn = "{}"\nquantity = "wheel.{}"\ntarget = "wheel"\nunit = "{}"\nrole = "{}"\n'
    rows = [("slip", "slip_ratio", "1", "command"), ("load", "normal_load", "N", "command"), ("pull", "drawbar_pull", "N", "observed")]
    sheet = folder / "b.toml"
    head = 'name = "b"\nfile = "b.csv"\nkind = "points"\n[bench]\nradius = "58 mm"\nwidth = "50 mm"\n'
    sheet.write_text(head + "".join(channel.format(*row) for row in rows) + channel.format("z", "sinkage", "mm", "observed"))
    return good, lambda path: imported(sheet)


@reader("parquet")
def _parquet(folder: Path) -> tuple[Path, Read]:
    import pyarrow
    import pyarrow.parquet

    good = folder / "d.parquet"
    t, q, v = np.array(table_lines()).T
    pyarrow.parquet.write_table(pyarrow.table({"t": t, "q": q, "v": v}), good)
    sheet = manifest(folder, "d.parquet")
    return good, lambda path: imported(sheet)


TOPICS = """
[[channel]]
column = "/joint_states.position[left]"
name = "left"
quantity = "joint.position"
target = "left"
unit = "rad"
[[channel]]
column = "/x.data"
quantity = "part.position"
component = "x"
target = "body"
unit = "m"
"""


def every_message(path: Path) -> None:
    """Two topics by their headers and by their log."""
    source = open_source(path)
    joints = ("/joint_states.position[0]", "/joint_states.velocity[1]")
    for wanted in (Wanted(clocks={"/joint_states": joints}, header=True), Wanted(clocks={"/joint_states": joints, "/x": ("/x.data",)})):
        source.check([column for columns in wanted.clocks.values() for column in columns])
        for _ in source.pieces(wanted):
            pass


def messages(write: Callable[[Path], Path], name: str) -> Reader:
    def make(folder: Path) -> tuple[Path, Read]:
        good = write(folder / name)
        sheet = manifest(folder, name, channels=TOPICS, time='[time]\nsource = "header"\n')
        sheet.write_text(sheet.read_text().replace('"/x.data"', '"/joint_states.velocity[0]"'))

        def read(path: Path) -> None:
            every_message(path)
            imported(sheet)

        return good, read

    return make


READERS["mcap, json"] = messages(lambda path: write_mcap(path, "json", n=30), "d.mcap")
READERS["mcap, ros 1"] = messages(lambda path: write_mcap(path, "ros1", n=30), "d.mcap")
READERS["mcap, ros 2"] = messages(lambda path: write_mcap(path, "cdr", n=30), "d.mcap")
READERS["ros 1 bag"] = messages(lambda path: write_bag(path, n=30), "d.bag")


def bag_folder(ending: str) -> Reader:
    def make(folder: Path) -> tuple[Path, Read]:
        write_bag(folder / "d", n=30)
        (good,) = (folder / "d").glob(f"*{ending}")
        return good, lambda path: every_message(folder / "d")

    return make


READERS["ros 2 bag, its database"] = bag_folder(".db3")
READERS["ros 2 bag, its metadata"] = bag_folder(".yaml")


@reader("manifest")
def _manifest(folder: Path) -> tuple[Path, Read]:
    (folder / "d.csv").write_text("t,q,v\n" + "".join(f"{t},{q},{v}\n" for t, q, v in table_lines()))
    channels = CHANNELS + 'scale = 1.5\nnoise = "0.01 rad/s"\ndelay = "3 ms"\nresolution = 0.001\naccepted = ["missing"]\n'
    channels += '[[correction]]\nkind = "cut"\nreason = "standing"\nstart = "0.1 s"\nend = "1 s"\n'
    channels += '[[correction]]\nkind = "resample"\nreason = "jitter"\nclock = "t"\nrate = "100 Hz"\n'
    good = manifest(folder, "d.csv", channels=channels)
    return good, imported


# ---------------------------------------------------------------- sheets


@reader("scenario")
def _scenario(folder: Path) -> tuple[Path, Read]:
    good = copied("first_drive/traverse.toml", folder)
    watch = '\n[[watch]]\nname = "w"\nquantity = "part.position"\ntarget = "chassis"\nabove = 3\nhold = "1 s"\naction = "stop"\n'
    good.write_text(good.read_text() + watch)
    return good, lambda path: simulate.read_scenario_file(path, MODES)


@reader("commands of a scenario, csv")
def _command_table(folder: Path) -> tuple[Path, Read]:
    good = folder / "commands.csv"
    good.write_text("time,wheel_* [deg/s],steering_front_left\n" + "".join(f"{k},{10 * k},{0.01 * k if k % 3 else ''}\n" for k in range(12)))
    scenario = folder / "s.toml"
    scenario.write_text('name = "s"\nduration = "12 s"\ngravity = "moon"\ncommand_table = "commands.csv"\n')
    return good, lambda path: simulate.read_scenario_file(scenario, MODES)


SCENE = """
name = "small"
soil = "lunar_sourcebook"

[base]
kind = "fractal"
size = ["12 m", "8 m"]
posting = "0.5 m"
hurst = 0.8
median_slope = "3 deg"
seed = 7

[[landform]]
name = "shallow"
landform = "crater"
x = "-2.5 m"
y = "2.2 m"
heading = "20 deg"
age = 20
drivers = { diameter = "4 m", relief = 0.4 }

[[landform]]
name = "ramp"
landform = "slope"
x = "2.5 m"
y = "0.3 m"
drivers = { angle = "7 deg", length = "3 m", width = "2 m", shoulder = "1.5 m" }

[[population]]
name = "rocks"
landform = "rock"
law = "haworth"
diameter = ["0.35 m", "1 m"]
seed = 8
exclude = ["ramp"]
drivers = { embedded = [0.2, 0.6], aspect = [0.6, 1.0] }
age = 4

[[soil_patch]]
name = "soft"
soil = "own"
polygon = [[0.4, -2.0], [2.6, -2.4], [3.2, 0.2], [0.1, 0.4]]

[[soils]]
name = "own"
sinkage_exponent = 1.0
cohesive_modulus = 1400
frictional_modulus = 820e3
cohesion = "170 Pa"
friction_angle = "35 deg"
shear_modulus = "17.8 mm"
density = "1700 kg/m^3"
source = "test"

[[pair]]
response = "rigid"
friction = 0.6

[[obstacle]]
name = "stone"
kind = "sphere"
x = "1 m"
y = "1 m"
size = ["0.3 m"]
"""


@reader("terrain scene")
def _scene(folder: Path) -> tuple[Path, Read]:
    from rille.terrain.scene import read_scene

    good = folder / "scene.toml"
    good.write_text(SCENE)
    return good, read_scene


@reader("soils")
def _soils(folder: Path) -> tuple[Path, Read]:
    from rille.terrain.register import _SoilLibrary

    good = folder / "soils.toml"
    good.write_bytes((REPOSITORY / "terrain_library/soils.toml").read_bytes())
    return good, lambda path: [sheet.value() for sheet in read_sheet(path, _SoilLibrary).soil]


ROVER = """
up = "z"
tolerance = "0.3 mm"

[[material]]
name = "rubber"
density = "1.1 g/cm^3"
source = "test"

[[frame]]
name = "mid"
point = [0, 0, "20 cm"]
axis = [0, 1, 0]

[[body]]
name = "chassis"
mass = "12 kg"
com = [0, 0, "25 cm"]
inertia = [0.5, 0.9, 1.1, 0, 0.01, 0]

[[mass]]
name = "battery"
body = "chassis"
mass = "2 kg"
at = [0.1, 0, 0.2]
size = ["60 mm", "40 mm", "20 mm"]

[[body]]
name = "rocker_left"
mass = 2
com = [0, "40 cm", "20 cm"]
inertia = [0.02, 0.05, 0.04, 0, 0, 0]

[[joint]]
name = "rocker_left"
kind = "hinge"
parent = "chassis"
child = "rocker_left"
at = "mid"
axis = [0, 1, 0]
lower = "-20 deg"
upper = "20 deg"
stop = { stiffness = "500 N m/rad", damping = "5 N m s/rad" }
friction = { coulomb = "0.1 N m", viscous = "0.01 N m s/rad" }

[[body]]
name = "wheel_left"
mass = "1.5 kg"
com = [0, "50 cm", "15 cm"]
inertia = [0.01, 0.02, 0.01, 0, 0, 0]

[[joint]]
name = "wheel_left"
kind = "hinge"
parent = "rocker_left"
child = "wheel_left"
point = [0, "50 cm", "15 cm"]
axis = [0, 1, 0]

[[drive]]
joint = "wheel_left"
mode = "speed"
motor = { stall_torque = "0.2 N m", no_load_speed = "4000 rpm", gear_ratio = 100, efficiency = 0.7 }

[[wheel]]
joint = "wheel_left"
radius = "150 mm"
width = "165 mm"
center = [0, "50 cm", "15 cm"]
material = "rubber"
grousers = { count = 24, height = "1 cm", thickness = "2 mm" }

[[sensor]]
name = "imu"
quantity = "part.linear_acceleration"
target = "chassis"
rate = "100 Hz"
frame = "body"

[[differential]]
name = "diff"
carrier = "chassis"
joint_a = "rocker_left"
joint_b = "rocker_right"

[mirror]
"""


@reader("rover sheet")
def _rover(folder: Path) -> tuple[Path, Read]:
    """Bodies with stated masses, so that no child process draws anything; written into a database, as the command does."""
    good, empty, made = folder / "rover.toml", folder / "empty.db", folder / "made.db"
    good.write_text(ROVER)
    store.create(empty)
    fold(empty)
    content = empty.read_bytes()

    def read(path: Path) -> None:
        rover = cad.build(path)
        made.write_bytes(content)
        store.write_rover(made, rover)

    return good, read


@reader("rover sheet with parts that are drawn")
def _drawn_rover(folder: Path) -> tuple[Path, Read]:
    from rille.cad.mirror import mirrored
    from rille.cad.sheet import RoverSheet

    good = copied("rover/rover.toml", folder)
    return good, lambda path: mirrored(read_sheet(path, RoverSheet))


@reader("materials")
def _materials(folder: Path) -> tuple[Path, Read]:
    from rille.cad.materials import Materials

    good = folder / "materials.toml"
    good.write_text('[[material]]\nname = "wood"\ndensity = "600 kg/m^3"\nsource = "test"\n[[material]]\nname = "foil"\ndensity = 2700\n')
    return good, lambda path: [Materials([], folder).find(name, "the sheet") for name in ("wood", "foil", "steel")]


@reader("urdf")
def _urdf(folder: Path) -> tuple[Path, Read]:
    from random_machines import random_machine
    from rille.cad.exchange import read_urdf, write_urdf

    good = write_urdf(random_machine(0, kinds=("hinge", "prismatic", "fixed")), folder)
    return good, read_urdf


@reader("instruments")
def _instruments(folder: Path) -> tuple[Path, Read]:
    good = copied("recording/sensors.toml", folder)
    rover = cart(5.0, 0.15, 0.165)
    good.write_text(good.read_text().replace('["wheel_*", "steering_*"]', '["wheel_*", "wheel_rear_*"]').replace('"wheel_*"\nrate', '"wheel_f*"\nrate'))
    text = good.read_text().replace('target = ["wheel_*", "wheel_rear_*"]', 'target = "wheel_*"')
    good.write_text(text)
    return good, lambda path: read_instruments(path, rover)


OWN_HEAD = 'name = "form"\nmeaning = "a form"\nframe = "origin at the centre"\nsource = "test"\n'
OWN_DRIVERS = """
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
OWN = {
    "radial": OWN_DRIVERS + '[radial]\nradius = "diameter / 2"\nheight = "height"\npoints = [[0, -1], [0.4, -0.9], [1, 0.25], [1.8, 0]]\n',
    "section": '[section]\npoints = [[-1.4, 0], [-0.5, 0.42], [0.1, 0.46], [1.2, 0]]\nlength = "12 m"\nfade = "1.5 m"\n',
    "formula": OWN_DRIVERS + '[formula]\nheight = "height * exp(-4 * r**2 / diameter**2) + where(x > 0, 0.1, 0)"\nradius = "diameter"\nfade = "1 m"\n',
}


def own_landform(kind: str) -> Reader:
    def make(folder: Path) -> tuple[Path, Read]:
        from rille.terrain import own
        from rille.terrain.own.proof import prove

        good = folder / "form.toml"
        good.write_text(OWN_HEAD + f'kind = "{kind}"\n' + OWN[kind])
        return good, lambda path: prove(own.read_own(path))

    return make


for _kind in OWN:
    READERS[f"own landform, {_kind}"] = own_landform(_kind)


@reader("study sheet")
def _study(folder: Path) -> tuple[Path, Read]:
    return copied("sweep/soft_ground.toml", folder), read_study_sheet


@reader("trial of a real machine")
def _trial(folder: Path) -> tuple[Path, Read]:
    return copied("double_pendulum/friction_trial.toml", folder), lambda path: real_truth(path, 1)


@reader("trial of pushes")
def _pushes(folder: Path) -> tuple[Path, Read]:
    good = copied("double_pendulum/pushes_trial.toml", folder)
    good.write_text(good.read_text().replace("${RILLE_DATA}/data/recordings/", ""))
    with (folder / "double_pendulum_acrobot_disturbed_truth.csv").open("w", newline="") as file:
        csv.writer(file).writerows([("exp", "joint", "t_peak_s", "amp_Nm"), ("a", "1", 1.5, 0.4), ("b", "2", 2.5, -0.4)])
    return good, lambda path: (read_real(path), real_truth(path, 1))


@reader("bench table")
def _bench(folder: Path) -> tuple[Path, Read]:
    good = folder / "bench.csv"
    good.write_text("slip_ratio,load [N],drawbar_pull [N],sinkage [mm]\n" + "".join(f"{0.1 * k},30,{2 * k},{5 + k}\n" for k in range(9)))
    return good, simulate.read_bench_csv


# ---------------------------------------------------------------- heights


def heights(n_rows: int = 20, n_cols: int = 24) -> np.ndarray:
    y, x = np.mgrid[0:n_rows, 0:n_cols]
    return np.exp(-((x - n_cols / 2) ** 2 + (y - n_rows / 2) ** 2) / 20).astype("f4")


def write_tif(path: Path, values: np.ndarray, **more: Any) -> Path:
    import warnings

    import rasterio
    from rasterio.transform import from_origin

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        options = {"driver": "GTiff", "width": values.shape[1], "height": values.shape[0], "count": 1, "dtype": values.dtype, **more}
        with rasterio.open(path, "w", transform=from_origin(0, 20, 1, 1), **options) as file:
            file.write(values, 1)
    return path


def write_asc(path: Path) -> Path:
    """A grid in text, and its projection beside it."""
    import rasterio

    path.with_suffix(".prj").write_text(rasterio.CRS.from_epsg(32633).to_wkt("WKT1_ESRI"))
    head = "ncols 24\nnrows 20\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -9999\n"
    path.write_text(head + "\n".join(" ".join(f"{v:.3f}" for v in row) for row in heights()))
    return path


@reader("dem, geotiff")
def _dem_tif(folder: Path) -> tuple[Path, Read]:
    return write_tif(folder / "dem.tif", heights(), crs="EPSG:32633", nodata=-9999.0), terrain.read_dem


@reader("dem, packed geotiff")
def _dem_packed(folder: Path) -> tuple[Path, Read]:
    more = {"compress": "deflate", "predictor": 2, "crs": "EPSG:32633", "tiled": True, "blockxsize": 16, "blockysize": 16}
    return write_tif(folder / "dem.tif", (1000 * heights()).astype("i2"), **more), terrain.read_dem


@reader("dem, ascii")
def _dem_asc(folder: Path) -> tuple[Path, Read]:
    return write_asc(folder / "dem.asc"), terrain.read_dem


@reader("dem under a scene")
def _dem_scene(folder: Path) -> tuple[Path, Read]:
    from rille.terrain.scene import read_scene

    good, scene = write_tif(folder / "dem.tif", heights(), crs="EPSG:32633"), folder / "scene.toml"
    scene.write_text('name = "s"\nsoil = "lunar_soft"\n[base]\nkind = "dem"\nfile = "dem.tif"\nfill_holes = true\n')
    return good, lambda path: read_scene(scene)


def height_map(name: str) -> Reader:
    def make(folder: Path) -> tuple[Path, Read]:
        from rille.terrain.own import Georeference, read_height_map

        good = folder / name
        if good.suffix == ".png":
            write_png(good, (60000 * heights()).astype(">u2"))
            return good, lambda path: read_height_map(path, Georeference(height_range="0 m, 40 cm", length="3 m"))
        return write_tif(good, heights()), lambda path: read_height_map(path, Georeference(unit="m", posting="1 m"))

    return make


def write_png(path: Path, values: np.ndarray) -> None:
    """A grey picture of 16 bits."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", values.shape[1], values.shape[0], 16, 0, 0, 0, 0)
    rows = b"".join(b"\0" + row.tobytes() for row in values)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


READERS["height map, geotiff"] = height_map("map.tif")
READERS["height map, png"] = height_map("map.png")


@reader("heights of an own landform, npy")
def _own_npy(folder: Path) -> tuple[Path, Read]:
    from rille.terrain import own

    relief = own.read_height_map(write_tif(folder / "map.tif", heights()), own.Georeference(unit="m", posting="1 m"))
    library: dict[str, Any] = {"folder": folder / "library", "builtin": (), "soils": (), "soil": "", "replace": False, "blend": None}
    kept = own.keep_heights(relief, made_from=folder / "map.tif", name="form", meaning=None, source=None, **library)
    (good,) = kept.file.parent.glob("*.npy")
    return good, lambda path: own.read_own(kept.file)


@reader("density map")
def _density(folder: Path) -> tuple[Path, Read]:
    from rille.terrain.population.density import Frame, _mapped

    good = write_tif(folder / "density.tif", heights())
    return good, lambda path: _mapped(path, "population 'p'", Frame(crs="", origin=(0.0, 0.0))).factor(np.arange(9.0), np.arange(9.0))


@reader("region, geojson")
def _geojson(folder: Path) -> tuple[Path, Read]:
    from rille.cli.terrain_extract import _from_geojson

    good = folder / "region.geojson"
    good.write_text('{"type": "Polygon", "coordinates": [[[0, 0], [10, 0], [10.5, 8], [0, 0]]]}')
    return good, _from_geojson


# ---------------------------------------------------------------- meshes

CUBE = "o cube\n" + "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
CUBE += "".join(f"f {a} {b} {c} {d}\n" for a, b, c, d in ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)))


def mesh(ending: str) -> Reader:
    def make(folder: Path) -> tuple[Path, Read]:
        import io

        import trimesh

        from rille.cad.exchange.mesh_in import load_mesh
        from rille.terrain.own.mesh_file import read_triangles

        good = folder / f"mesh{ending}"
        cube = trimesh.load(io.BytesIO(CUBE.encode()), file_type="obj")
        cube.export(good)

        def read(path: Path) -> None:
            load_mesh(path, (1.0, 1.0, 1.0))
            read_triangles(path, "m")

        return good, read

    return make


for _ending in (".stl", ".obj", ".ply", ".glb"):
    READERS[f"mesh, {_ending[1:]}"] = mesh(_ending)


# ---------------------------------------------------------------- databases


def fold(path: Path) -> None:
    """One file without a journal beside it."""
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        connection.execute("PRAGMA journal_mode = DELETE")


def full_model(path: Path) -> Path:
    """A cart with a run of half a second, a recording, effects, obstacles, a watch, an old state of everything that has one."""
    rover = cart(5.0, 0.15, 0.165)
    sensors = (Sensor(name="imu", quantity="part.linear_acceleration", target="chassis", rate=50.0, frame="body"),)
    sensors += (Sensor(name="encoder", quantity="joint.velocity", target="wheel_front_left", rate=50.0),)
    first = replace(rover.joints[0], limit=JointLimit(lower=-100.0, upper=100.0))
    ground = plane(0.05, 0.02)
    ground = replace(
        ground,
        obstacles=(Obstacle(name="ball", kind="sphere", pose=Pose(position=(3.0, 0.4, 0.0)), size=(0.15,)),),
        patches=(SoilPatch(name="slab", soil=ground.soil, polygon=((-1.0, -1.0), (0.2, -1.0), (0.2, 1.0))),),
    )
    commands = tuple(Command(drive=d.name, time=0.0, value=1.0) for d in rover.drives)
    watch = Watch(name="far", quantity="part.position", target="chassis", above=0.001, action="mark")
    scenario = Scenario(
        name="s", duration=0.4, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=0.2, commands=commands,
        watches=(watch,), initial_states=(InitialJointState(joint="wheel_rear_left", position=0.1),),
    )  # fmt: skip
    store.create(path)
    store.write_rover(path, replace(rover, sensors=sensors, joints=(first, *rover.joints[1:])))
    store.write_terrain(path, ground)
    store.write_scenario(path, scenario)
    store.write_effects(path, (Effect(kind="multipass", parameters={"memory": 1.0}),))
    simulate.run(path)
    from recording_import import load

    sheet = path.parent / "to_import"
    sheet.mkdir()
    (sheet / "d.csv").write_text("t,q,v\n" + "".join(f"{t},{q},{v}\n" for t, q, v in table_lines()))
    load(manifest(sheet, "d.csv", channels=CHANNELS.replace('"knee"', '"wheel_front_left"')), path)
    fold(path)
    return path


def read_everything(path: Path) -> None:
    """All that Python reads of a model's database; every part of it is asked for, whatever another one says."""
    from rille.model import InputRefused

    refusals: list[InputRefused] = []

    def each(read: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
        try:
            return read(path, *arguments, **options)
        except InputRefused as refusal:
            refusals.append(refusal)
            return ()

    each(store.read_rover)
    each(store.read_scenario)
    each(store.read_terrain)
    each(store.read_soils)
    each(store.read_effects)
    each(store.read_findings)
    each(store.list_parts)
    each(store.saved_states)
    each(store.model_digest)
    each(store.info)
    each(store.check)
    for layer in ("height", "soil", "filled"):
        each(store.read_window, layer=layer, level=1, rows=slice(2, 9), columns=slice(3, 11))
    for row in each(store.list_runs):
        each(store.read_trace, row.id)
        each(store.read_reactions, row.id)
        each(store.read_samples, row.id)
        each(store.read_ruts, row.id)
        each(store.read_command_log, row.id)
    for name in each(store.recording_names):
        each(store.recording_clocks, name)
        each(store.read_recording, name)
    if refusals:
        raise refusals[0]


@reader("database, its bytes")
def _database(folder: Path) -> tuple[Path, Read]:
    return full_model(folder / "model.db"), read_everything


@reader("database, its values")
def _values(folder: Path) -> tuple[Path, Read]:
    return full_model(folder / "model.db"), read_everything


def study_database(folder: Path) -> Path:
    from rille.model.study import Case, CaseResult
    from study.function_studies import angles, plan

    path = folder / "study.db"
    planned = plan("latin_hypercube", 6, angles(2))
    cases = [Case(number=k, values=(0.1 * k, 0.2 * k)) for k in range(6)]
    store.create_study(path, planned, cases)
    results = [CaseResult(number=k, status="done", outcomes={"y": 0.5 * k}, seconds=0.1) for k in range(5)]
    store.add_results(path, planned, results)
    fold(path)
    return path


def read_study(path: Path) -> None:
    store.read_plan(path)
    store.read_study(path)
    store.waiting_cases(path)


@reader("study, its bytes")
def _study_bytes(folder: Path) -> tuple[Path, Read]:
    return study_database(folder), read_study


@reader("study, its values")
def _study_values(folder: Path) -> tuple[Path, Read]:
    return study_database(folder), read_study


VALUES = {
    "INTEGER": ("NULL", "-1", "0", "1", "7", "63", "1000000", "2147483648", "9223372036854775807", "-9223372036854775808"),
    "REAL": ("NULL", "-1.0", "0.0", "1e308", "-1e308", "9e999", "-9e999", "1e-308", "0.5", "1e15"),
    "TEXT": ("NULL", "''", "'x'", "'*'", "'{}'", "'[]'", "'[[0,0]]'", "'null'", "'[1,2'", "'nan'", "'[1e999]'", "'é'", "CAST(x'ff' AS TEXT)", "'height'"),
    "BLOB": ("NULL", "x''", "x'00'", "zeroblob(23)", "zeroblob(96)", "zeroblob(8)", "x'789c'", "randomblob(64)"),
}
CATALOGUE = ("effect_kind", "effect_parameter_kind")  # rows of rille's own, in every database


def changed_values(data: bytes, chance: Random) -> tuple[str, bytes]:
    """What a careless program may leave: values that the schema's checks would refuse, rows that are gone, another scale."""
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.deserialize(data)
        connection.execute("PRAGMA ignore_check_constraints = ON")
        every = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%' ORDER BY name")
        tables = [name for (name,) in every if name not in CATALOGUE]
        filled = [table for table in tables if connection.execute(f'SELECT 1 FROM "{table}"').fetchone()]
        said: list[str] = []
        for _ in range(200):
            if len(said) > int(chance.integers(3)):
                break
            table = str(chance.choice(filled))
            columns = connection.execute(f'PRAGMA table_info("{table}")').fetchall()
            _, column, kind, *_ = columns[int(chance.integers(len(columns)))]
            key = next((c[1] for c in columns if c[5] == 1), column)
            keys = connection.execute(f'SELECT DISTINCT "{key}" FROM "{table}" ORDER BY 1').fetchall()
            one = keys[int(chance.integers(len(keys)))] if keys else (None,)
            values = VALUES.get(kind, ("NULL",))
            value = values[int(chance.integers(len(values)))]
            if kind == "REAL" and chance.random() < 0.3:
                value = f'"{column}" * {2.0 ** int(chance.integers(-20, 20))}'
            statement = f'UPDATE "{table}" SET "{column}" = {value}' if chance.random() < 0.9 else f'DELETE FROM "{table}"'
            where, which = (f' WHERE "{key}" IS ?', one) if chance.random() < 0.7 else ("", ())
            try:
                connection.execute(statement + where, which)
            except sqlite3.Error:
                continue  # some keys are unique, some values must be there
            said.append(statement + where)
        connection.commit()
        return "; ".join(said), bytes(connection.serialize())


CHANGES["database, its values"] = CHANGES["study, its values"] = changed_values


def change_of(name: str) -> Change:
    """What breaks the files of a reader."""
    return CHANGES.get(name, mutated)
