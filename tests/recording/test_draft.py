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
from rille.model.errors import InputRefused
from rille.model.recording import Channel, Recording
from rille.model.sheet import data_folder
from rille.recording.columns import Targets, targets_of
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


def dates(n, step="20ms"):
    """(n,) dates that are a step apart, in the night of a leap to summer time."""
    return np.datetime64("2026-03-29T00:59:59.500", "ns") + np.arange(n) * np.timedelta64(int(step[:-2]), step[-2:])


@pytest.mark.parametrize("name", ["UTC", "Zeitstempel", "Messung 7"])
@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_dates_go_before_what_merely_rises(tmp_path, name, ending):
    """A wheel that rolls on, an odometer and a counter rise too, whatever the dates are called."""
    angle = np.arange(50) * 1.25
    table = {"count": np.arange(50), "wheel_front_left_position_deg": angle, "odometer [m]": angle, name: dates(50)}
    file = tmp_path / f"d.{ending}"
    if ending == "parquet":
        pq.write_table(pa.table(table), file)
    else:
        rows = zip(*(column.astype(str) for column in table.values()), strict=True)
        file.write_text("\n".join(",".join(row) for row in [table.keys(), *rows]) + "\n")
    path, _, channels, content = drafted(tmp_path, file)
    assert content["time"] == {"column": name, "origin": "first"}
    assert channels["wheel_front_left_position_deg"]["quantity"] == "joint.position"
    load(path, tmp_path / "m.db")
    (channel,) = store.read_recording(tmp_path / "m.db", "d").channels
    np.testing.assert_allclose(channel.time, np.arange(50) * 0.02, atol=1e-12)


def test_a_time_in_numbers_goes_before_dates_that_do_not_rise(tmp_path):
    """The day on which a sensor was calibrated, and a satellite's clock that stands for a second at a time."""
    t = np.arange(100) * 0.02
    table = {"calibration date": dates(100)[:1].repeat(100), "gps": dates(100).astype("datetime64[s]"), "elapsed_s": t, "q_left": np.sin(t)}
    pq.write_table(pa.table(table), tmp_path / "d.parquet")
    _, _, _, content = drafted(tmp_path, tmp_path / "d.parquet")
    assert content["time"] == {"column": "elapsed_s", "unit": "s"}


def test_a_time_that_begins_anew_goes_before_the_days_of_its_runs(tmp_path):
    """And dates of which two are the same, which is a fault of the logger, go before a number that stands."""
    runs = {"day": dates(2, "20ms").repeat(50), "run": np.arange(2).repeat(50), "time": np.tile(np.arange(50) * 0.1, 2), "q": np.ones(100)}
    pq.write_table(pa.table(runs), tmp_path / "d.parquet")
    assert drafted(tmp_path, tmp_path / "d.parquet")[3]["time"] == {"column": "time", "unit": "s"}
    logged = {"time zone": np.full(100, 2), "logged": dates(100)[np.maximum(1, np.arange(100))], "q": np.ones(100)}
    pq.write_table(pa.table(logged), tmp_path / "d.parquet")
    assert drafted(tmp_path, tmp_path / "d.parquet")[3]["time"] == {"column": "logged", "origin": "first"}


@pytest.mark.parametrize(
    "name",
    [
        "wheel_fl_position_deg",
        "q",
        "encoder_count_left",
        "left ticks",
        "odometer [m]",
        "temperature [degC]",
        "motor_current",
        "clock [m]",
        "t_x",
    ],
)
def test_what_rises_and_says_something_else_is_no_time(tmp_path, name):
    pq.write_table(pa.table({"v": [1.0, -1.0, 1.0, 2.0], name: [0.0, 1.0, 2.0, 3.0]}), tmp_path / "d.parquet")
    with pytest.raises(InputRefused, match=r"no column of .* holds dates, is named like a time, or rises"):
        draft_manifest(tmp_path / "d.parquet", tmp_path / "d.toml")


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        *(("Zeit (UTC)", "s"), ("temps [ms]", "ms"), ("tiempo_us", "us"), ("current_time", "s"), ("epoch", "s"), ("t", "s")),
        *(("clock [hours]", "hours"), ("Uhrzeit [seconds]", "seconds"), ("tick", "s")),
    ],
)
def test_times_have_many_names_and_units(tmp_path, name, unit):
    """Beside a wheel that rolls on, which stands first."""
    pq.write_table(pa.table({"wheel_fl_pos": [0.0, 1.0, 2.0], name: [0.0, 0.5, 1.0]}), tmp_path / "d.parquet")
    path, _, _, content = drafted(tmp_path, tmp_path / "d.parquet")
    assert content["time"] == {"column": name, "unit": unit}
    load(path, tmp_path / "m.db")


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


def rover_targets():
    """Names of a rover with rockers, bogies, six wheels of which four are steered, and a mast that is fixed."""
    places = [f"{end}_{side}" for side in ("left", "right") for end in ("front", "middle", "rear")]
    wheels, steered = [f"wheel_{place}" for place in places], [f"steering_{place}" for place in places if "middle" not in place]
    arms = [f"{kind}_{side}" for side in ("left", "right") for kind in ("rocker", "bogie")]
    return Targets(
        joints={"mast": "fixed", **dict.fromkeys([*arms, *wheels, *steered], "hinge")},
        parts=frozenset(["chassis", *arms, *wheels]),
        wheels=frozenset(wheels),
        drives={drive: drive for drive in [*wheels, *steered]},
        commands={**dict.fromkeys(wheels, "joint.velocity"), **dict.fromkeys(steered, "joint.position")},
    )


def test_columns_go_to_what_they_name_in_any_order_and_spelling_or_to_nothing(tmp_path):
    """Names of several machines for the same wheels; a motor may be that of a wheel or that of its steering."""
    expected = {
        "right_rear_wheel_joint_pos_rad": "wheel_rear_right",
        "back_left_wheel_pos_rad": "wheel_rear_left",
        "wheel_lf_pos_rad": "wheel_front_left",
        "LF_steer_angle_deg": "steering_front_left",
        "wheelFL_current": "wheel_front_left",
        "slip_ratio_mr": "wheel_middle_right",
        "bogie_pos": None,
        "wheel_3_pos": None,
        "rear_left_motor_pos_rad": None,
        "cmd_front_right": None,
        "cmd_fr_wheel": "wheel_front_right",
        "knuckle_front_left_pos": None,
        "base_roll": "chassis",
        "imu_roll": None,
    }
    t = np.arange(20) * 0.1
    pq.write_table(pa.table({"t": t, **{name: np.sin(k + t) for k, name in enumerate(expected)}}), tmp_path / "d.parquet")
    _, draft, channels, _ = drafted(tmp_path, tmp_path / "d.parquet", rover_targets())
    assert {name: channel.get("target") for name, channel in channels.items()} == expected
    for rest in ("rear left motor", "front right"):
        place = "rear_left" if "rear" in rest else "front_right"
        assert f"'{rest}' is ambiguous: it fits wheel_{place} and steering_{place} equally well" in draft.text
    assert "no joint of the model fits 'knuckle front left' (wheel_front_left, steering_front_left, " in draft.text


@pytest.mark.parametrize("ending", [".mcap", ".bag"])
def test_joints_of_messages_go_to_what_they_name(tmp_path, ending):
    names, t = ["front_left_wheel_joint", "rear_right_wheel_joint", "left_rear_steering_joint", "front_left_joint"], np.arange(20) * 0.1
    joints = [Channel(name=name, quantity="joint.position", target=name, unit="rad", time=t, value=np.sin(t)) for name in names]
    write_recording_file(tmp_path / f"d{ending}", Recording(name="d", channels=tuple(joints)))
    _, draft, channels, _ = drafted(tmp_path, tmp_path / f"d{ending}", rover_targets())
    targets = [channels[f"/{name}.position[{name}]"].get("target") for name in names]
    assert targets == ["wheel_front_left", "wheel_rear_right", "steering_rear_left", None]
    assert "'front_left_joint' is ambiguous" in draft.text


def test_a_number_that_two_names_say_is_ambiguous(tmp_path):
    joints = dict.fromkeys(["pan", "wheel1", "steer1"], "hinge")
    targets = Targets(joints=joints, parts=frozenset(), wheels=frozenset(), drives={}, commands={})
    pq.write_table(pa.table({"t": [0.0, 1.0, 2.0], "q1": [0.0, 1.0, 0.0]}), tmp_path / "d.parquet")
    _, draft, channels, _ = drafted(tmp_path, tmp_path / "d.parquet", targets)
    assert channels["q1"]["role"] == "ignore"
    assert "'1' is ambiguous: it fits wheel1 and steer1 equally well" in draft.text


@pytest.mark.parametrize(("first", "expected"), [(1, ["shoulder", "elbow", None]), (0, [None, None, None])])
def test_numbers_from_1_count_the_joints_that_move_and_those_from_0_may_be_a_quaternion(tmp_path, first, expected):
    joints = {"mount": "fixed", **dict.fromkeys(["shoulder", "elbow", "wrist"], "hinge")}
    targets = Targets(joints=joints, parts=frozenset(), wheels=frozenset(), drives={}, commands={})
    names = [f"pos_{first + k}" for k in range(2)] + [f"joint{first + 2 if first == 0 else 4}_pos"]
    t = np.arange(20) * 0.1
    pq.write_table(pa.table({"t": t, **{name: np.sin(k + t) for k, name in enumerate(names)}}), tmp_path / "d.parquet")
    _, _, channels, _ = drafted(tmp_path, tmp_path / "d.parquet", targets)
    assert [channels[name].get("target") for name in names] == expected


def test_the_only_thing_of_a_kind_is_meant_unless_the_name_says_another(tmp_path):
    targets = Targets(joints={"wheel_left": "hinge"}, parts=frozenset(), wheels=frozenset(), drives={}, commands={})
    t = np.arange(20) * 0.1
    pq.write_table(pa.table({"t": t, "pos": np.sin(t), "right_pos": np.cos(t), "steer_angle": np.cos(t)}), tmp_path / "d.parquet")
    _, _, channels, _ = drafted(tmp_path, tmp_path / "d.parquet", targets)
    assert {name: channel.get("target") for name, channel in channels.items()} == {
        "pos": "wheel_left",
        "right_pos": None,
        "steer_angle": None,
    }


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
