"""Does a draft say why, and does it import as it stands?"""

import re
import tomllib

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from machines import cart
from recording_files import write_bag, write_mcap
from recording_import import load
from rille import store
from rille.model.recording import Channel, Recording
from rille.model.sheet import data_folder
from rille.recording.columns import targets_of
from rille.recording.draft import draft_manifest
from rille.recording.guess import guess_column, split_unit
from rille.recording.writing import manifest_text, write_recording_file


def drafted(folder, file, targets=None):
    """The draft of a file, written beside it and read as TOML."""
    path = folder / "draft.toml"
    draft = draft_manifest(file, path, targets)
    path.write_text(draft.text)
    content = tomllib.loads(draft.text)
    return path, draft, {channel["column"]: channel for channel in content["channel"]}, content


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("pos_meas1", ("joint.position", "", "rad", "observed")),
        ("vel_cmd_fl", ("joint.velocity", "", "rad/s", "command")),
        ("tau [mN m]", ("joint.effort", "", "mN m", "observed")),
        ("left_wheel_vel", ("joint.velocity", "", "rad/s", "observed")),
        ("icp_x", ("part.position", "x", "m", "observed")),
        ("icp_yaw", ("part.orientation", "yaw", "rad", "observed")),
        ("yaw_deg", ("part.orientation", "yaw", "deg", "observed")),
        ("imu_gyro_z", ("part.angular_velocity", "z", "rad/s", "observed")),
        ("ax", ("part.linear_acceleration", "x", "m/s^2", "observed")),
        ("qw", ("part.orientation", "w", "1", "observed")),
        ("motorCurrent_mA", ("motor.current", "", "mA", "observed")),
        ("wheel_rpm", ("", "", "", "observed")),
        ("tau_des1", ("", "", "", "observed")),
        ("banana", ("", "", "", "observed")),
    ],
)
def test_guesses(name, expected):
    guess = guess_column(name)
    assert (guess.quantity, guess.component, guess.unit, guess.role) == expected
    assert guess.because


def test_units_of_names():
    assert split_unit("height_mm")[:2] == ("height", "mm")
    assert split_unit("speed (km/h)")[:2] == ("speed", "km/h")
    assert split_unit("omega_rad_s")[:2] == ("omega", "rad/s")
    assert split_unit("s")[:2] == ("s", "")


def test_every_guess_says_why(tmp_path):
    t = np.arange(1000) * 10 + 1_700_000_000_000
    columns = {"stamp": t, "q_left_deg": np.sin(t), "cmd_left": np.cos(t), "banana": t * 0.5, "temperature": np.full(1000, 20.0)}
    pq.write_table(pa.table(columns), tmp_path / "d.parquet")
    path, draft, channels, content = drafted(tmp_path, tmp_path / "d.parquet")
    assert content["time"] == {"column": "stamp", "unit": "ms", "origin": "first"}
    assert channels["q_left_deg"]["unit"] == "deg"
    assert channels["banana"] == {"column": "banana", "role": "ignore"}
    assert set(draft.unknown) == {"cmd_left", "banana", "temperature"}
    for line in draft.text.splitlines():
        if re.match(r"(quantity|target|column = \"stamp|format|origin)", line):
            assert "# guess: because" in line, line
        if 'role = "ignore"' in line:
            assert "# unknown:" in line
    load(path, tmp_path / "m.db")
    np.testing.assert_allclose(store.read_recording(tmp_path / "m.db", "d").channels[0].time[:3], [0, 0.01, 0.02])


def several_clocks():
    """Wheels at 50 Hz, the body at 20 Hz, a coarse log of as many rows at other times, and one command."""
    rng = np.random.default_rng(4)
    stamps = {"50hz": np.arange(0, 4, 0.02), "20hz": np.arange(0, 4, 0.05), "late": np.arange(0, 4, 0.05) + 0.013, "commands": np.zeros(1)}
    kinds = [
        ("left_wheel_vel", "joint.velocity", "", "left_wheel", "rad/s", "50hz"),
        ("right_wheel_vel", "joint.velocity", "", "right_wheel", "rad/s", "50hz"),
        ("hull_x", "part.position", "x", "hull", "m", "20hz"),
        ("mast_x", "part.position", "x", "mast", "m", "late"),
        ("left_wheel_vel_cmd", "joint.velocity", "", "left_wheel", "rad/s", "commands"),
    ]
    channels = [
        Channel(
            name=name,
            quantity=quantity,
            component=component,
            target=target,
            unit=unit,
            role="command" if clock == "commands" else "observed",
            clock=clock,
            time=stamps[clock],
            value=rng.standard_normal(len(stamps[clock])),
        )
        for name, quantity, component, target, unit, clock in kinds
    ]
    channels[1].value[50:60] = np.nan
    channels[1].value[-1] = np.nan
    return Recording(name="log", channels=tuple(channels))


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_each_column_gets_its_own_clock(tmp_path, ending):
    """A table as `rille record` writes it comes back by its draft as by the manifest written with it, bit by bit."""
    made, file = several_clocks(), tmp_path / f"d{ending}"
    addresses = write_recording_file(file, made)
    path, _, channels, content = drafted(tmp_path, file)
    assert content["time"]["column"] == "time_50hz"
    assert {name: channel.get("time", "time_50hz") for name, channel in channels.items()} == {n: a.time for n, a in addresses.items()}
    (tmp_path / "own.toml").write_text(manifest_text(made, file.name, ending[1:], addresses))
    load(path, tmp_path / "m.db")
    load(tmp_path / "own.toml", tmp_path / "m.db")
    drafted_one, own = store.read_recording(tmp_path / "m.db", "d"), store.read_recording(tmp_path / "m.db", "log")
    assert len(drafted_one.channels) == len(made.channels)
    for channel in drafted_one.channels:
        other = own.channel(channel.name)
        assert (channel.quantity, channel.component, channel.unit, channel.role) == (
            other.quantity,
            other.component,
            other.unit,
            other.role,
        )
        np.testing.assert_array_equal(channel.time, other.time)
        np.testing.assert_array_equal(channel.value, other.value)


def test_a_time_in_another_unit_is_no_second_clock(tmp_path):
    t = np.arange(100) * 0.01
    columns = {"t": t, "q_left": np.sin(t), "stamp": t + 1.7e9, "q_right": np.cos(t), "time_ms": 1e3 * t, "q_rear": t, "tick_time": 1e6 * t}
    pq.write_table(pa.table(columns), tmp_path / "d.parquet")
    _, _, channels, _ = drafted(tmp_path, tmp_path / "d.parquet")
    assert {"stamp", "time_ms", "tick_time"} <= channels.keys()
    assert not any("time" in channel for channel in channels.values())


@pytest.mark.parametrize("kind", ["json", "ros1", "cdr", "bag", "folder"])
def test_messages(tmp_path, kind):
    file = tmp_path / {"bag": "d.bag", "folder": "d"}.get(kind, "d.mcap")
    if kind in ("bag", "folder"):
        write_bag(file, n=300)
    else:
        write_mcap(file, kind, n=300)
    path, _, channels, _ = drafted(tmp_path, file)
    assert channels["/joint_states.position[left]"]["target"] == "left"
    assert channels["/joint_states.velocity[right]"]["quantity"] == "joint.velocity"
    assert channels["/x.data"]["component"] == "x"
    load(path, tmp_path / "m.db")
    assert len(store.read_recording(tmp_path / "m.db", "d").channels) == 5


def test_targets_are_those_of_the_model(tmp_path):
    rover = cart(5.0, 0.15, 0.165)
    joint = rover.joints[0].name
    pq.write_table(pa.table({"t": [0.0, 1.0], f"{joint}_velocity": [0.0, 1.0], "x_m": [0.0, 1.0]}), tmp_path / "d.parquet")
    _, _, channels, _ = drafted(tmp_path, tmp_path / "d.parquet", targets_of(rover))
    assert channels[f"{joint}_velocity"]["target"] == joint
    store.create(tmp_path / "m.db")
    store.write_rover(tmp_path / "m.db", rover)
    load(tmp_path / "draft.toml", tmp_path / "m.db")


@pytest.mark.parametrize("ending", [".csv", ".mcap"])
def test_vectors_and_commands_of_our_own_files_are_read_back(tmp_path, ending):
    """A gyro is a bare vector, an attitude is three angles, and a command says no quantity: its drive does."""
    rover = cart(5.0, 0.15, 0.165)
    drive, body = rover.drives[0], rover.bodies[0].name
    time = np.arange(0, 2, 0.02)
    kinds = [(f"{body}_gyro_{axis}", "part.angular_velocity", axis, body, "rad/s", "observed", "body") for axis in "xyz"]
    kinds += [
        (f"{body}_attitude_{angle}", "part.orientation", angle, body, "rad", "observed", "world") for angle in ("roll", "pitch", "yaw")
    ]
    kinds += [(f"{drive.name}_command", "joint.velocity", "", drive.joint, "rad/s", "command", "world")]
    channels = tuple(
        Channel(
            name=n, quantity=q, component=c, target=at, unit=u, role=role, frame=frame, clock="one", time=time, value=0.1 * np.sin(k + time)
        )
        for k, (n, q, c, at, u, role, frame) in enumerate(kinds)
    )
    addresses = write_recording_file(tmp_path / f"d{ending}", Recording(name="d", channels=channels))
    _, draft, found, _ = drafted(tmp_path, tmp_path / f"d{ending}", targets_of(rover))
    assert draft.unknown == ()
    for channel in channels:
        guess = found[addresses[channel.name].column]
        told = (guess["quantity"], guess.get("component", ""), guess["unit"], guess.get("role", "observed"), guess.get("frame", "world"))
        assert told == (channel.quantity, channel.component, channel.unit, channel.role, channel.frame), channel.name
        assert guess["target"] == channel.target
    others = ", ".join(other.name for other in rover.drives[1:])
    assert f"no column was guessed to command {others}: " in draft.text
    write_recording_file(tmp_path / f"e{ending}", Recording(name="e", channels=channels[:-1]))
    _, draft, _, _ = drafted(tmp_path, tmp_path / f"e{ending}", targets_of(rover))
    assert f"no column was guessed to command {drive.name}, {others}: " in draft.text


@pytest.mark.parametrize(
    "name",
    ["ball_drops.csv", "double_pendulum_acrobot_clean.parquet", "double_pendulum_sysid.parquet", "husky_terrain_imu.parquet"],
)
def test_real_files_draft_and_import_as_they_stand(tmp_path, name):
    file = data_folder() / "data/recordings" / name
    if not file.is_file():
        pytest.skip(f"the real recordings are not here ({file}); set RILLE_DATA")
    path, _, _, content = drafted(tmp_path, file)
    assert content["split"]
    load(path, tmp_path / "m.db")
    assert len(store.recording_names(tmp_path / "m.db")) >= 10
