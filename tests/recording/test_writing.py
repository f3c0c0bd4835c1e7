"""Files as other programs read them: pyarrow, rosbags and mcap's own readers, without rille's import."""

import tomllib

import numpy as np
import pytest

from rille.model import InputRefused
from rille.model.recording import Channel, Recording
from rille.recording.writing import manifest_text, write_recording_file


def recording():
    """A vector with gaps on one clock, a joint on a slower one, a command, an attitude; numbers that decimals cannot hold."""
    rng = np.random.default_rng(3)
    fast, slow = np.cumsum(rng.uniform(0.5e-3, 1.5e-3, 1000)), np.cumsum(rng.uniform(5e-3, 15e-3, 90))
    lost = rng.random(1000) < 0.1
    channels = [
        Channel(
            name=f"rate_{c}",
            quantity="part.angular_velocity",
            component=c,
            target="hull",
            unit="rad/s",
            frame="body",
            clock="imu",
            noise=0.02,
            time=fast,
            value=np.where(lost, np.nan, rng.standard_normal(1000)),
        )
        for c in "xyz"
    ]
    channels += [
        Channel(
            name="knee angle",
            quantity="joint.position",
            target="knee",
            unit="rad",
            clock="slow",
            delay=0.007,
            resolution=0.001,
            time=slow,
            value=rng.standard_normal(90),
        ),
        Channel(
            name="yaw",
            quantity="part.orientation",
            component="yaw",
            target="hull",
            unit="rad",
            clock="slow",
            time=slow,
            value=rng.standard_normal(90),
        ),
        Channel(
            name="knee_command",
            quantity="joint.effort",
            target="knee",
            unit="N m",
            role="command",
            clock="set",
            time=np.array([0.0, 0.1 + 0.2]),
            value=np.array([1 / 3, -1e-17]),
        ),
    ]
    return Recording(name='a "quoted" name', scenario="fall", channels=tuple(channels))


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_tables_hold_the_very_same_bits(tmp_path, ending):
    import pyarrow.csv
    import pyarrow.parquet

    made, path = recording(), tmp_path / f"t{ending}"
    addresses = write_recording_file(path, made, {"knee angle": ("deg", np.pi / 180)})
    table = pyarrow.parquet.read_table(path) if ending == ".parquet" else pyarrow.csv.read_csv(path)
    assert table.num_rows == 1000
    for channel in made.channels:
        address = addresses[channel.name]
        n = len(channel.value)
        time, value = (table[column].to_numpy() for column in (address.time, address.column))
        np.testing.assert_array_equal(time[:n], channel.time)
        assert np.isnan(time[n:]).all()
        assert np.isnan(value[n:]).all()
        np.testing.assert_array_equal(value[:n], channel.value / address.factor)
    assert addresses["knee angle"].unit == "deg"


@pytest.mark.parametrize("ending", [".bag", ".mcap", ""])
def test_messages_are_those_of_ros(tmp_path, ending):
    from rosbags.highlevel import AnyReader

    made, path = recording(), tmp_path / f"t{ending}"
    addresses = write_recording_file(path, made)
    if ending == ".mcap":
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory

        with path.open("rb") as stream:
            reader = make_reader(stream, decoder_factories=[DecoderFactory()])
            messages = [(m.channel.topic, m.message.log_time, m.decoded_message) for m in reader.iter_decoded_messages()]
    else:
        with AnyReader([path]) as reader:
            messages = [(c.topic, stamp, reader.deserialize(data, c.msgtype)) for c, stamp, data in reader.messages()]
    assert [stamp for _, stamp, _ in messages] == sorted(stamp for _, stamp, _ in messages)
    for channel in made.channels:
        topic, *fields = addresses[channel.name].column.split(".")
        mine = [(stamp, message) for name, stamp, message in messages if name == topic]
        sent = np.isfinite(channel.value)
        np.testing.assert_allclose([stamp * 1e-9 for stamp, _ in mine], channel.time[sent], rtol=0, atol=0.6e-9)
        for (stamp, message), value in zip(mine, channel.value[sent], strict=True):
            part = message
            for field in fields:
                name, _, index = field.partition("[")
                part = getattr(part, name) if not index else getattr(part, name)[0]
            assert part == value
            if hasattr(message, "header"):
                time = message.header.stamp
                assert time.sec * 10**9 + getattr(time, "nanosec", getattr(time, "nsec", 0)) == stamp
    assert addresses["rate_y"].column == "/rate.vector.y"
    assert addresses["knee angle"].column == "/knee_angle.position[0]"
    assert addresses["yaw"].column == "/yaw.vector.z"
    assert addresses["knee_command"].column == "/knee_command.data"


def test_the_manifest_says_what_is_known_and_hides_what_it_shall(tmp_path):
    made = recording()
    addresses = write_recording_file(tmp_path / "t.csv", made)
    told = tomllib.loads(manifest_text(made, "t.csv", "csv", addresses, gaps=True))
    assert (told["name"], told["file"], told["format"], told["scenario"]) == ('a "quoted" name', "t.csv", "csv", "fall")
    assert told["time"] == {"column": "time_imu", "unit": "s"}
    assert told["accepted"] == ["clock_gap"]
    first, knee, command = told["channel"][0], told["channel"][3], told["channel"][5]
    assert first == {
        "column": "rate_x",
        "quantity": "part.angular_velocity",
        "component": "x",
        "target": "hull",
        "unit": "rad/s",
        "role": "observed",
        "frame": "body",
        "noise": "0.02 rad/s",
        "missing": "accept",
    }
    assert (knee["time"], knee["delay"], knee["resolution"]) == ("time_slow", "0.007 s", "0.001 rad")
    assert (command["role"], command["time"]) == ("command", "time_set")
    told = tomllib.loads(
        manifest_text(made, "t.csv", "csv", addresses, gaps=True, hidden={"noise", "delay", "dropout", "gaps", "scenario"})
    )
    assert not {"accepted", "scenario"} & set(told)
    assert "resolution" in told["channel"][3]
    assert not {"noise", "delay", "missing"} & {key for channel in told["channel"] for key in channel}


def test_two_channels_of_one_quantity_are_told_to_be_redundant(tmp_path):
    channels = [
        Channel(name=name, quantity="joint.position", target="knee", unit="rad", time=np.arange(3.0), value=np.zeros(3)) for name in "ab"
    ]
    made = Recording(name="r", channels=tuple(channels))
    told = tomllib.loads(manifest_text(made, "r.csv", "csv", write_recording_file(tmp_path / "r.csv", made)))
    assert [channel.get("redundant", False) for channel in told["channel"]] == [False, True]
    assert told["time"]["column"] == "time"


@pytest.mark.parametrize("ending", [".csv", ".mcap", ".bag", ""])
def test_what_cannot_be_written_leaves_nothing_behind(tmp_path, ending):
    made = recording()
    if ending:  # the folder of a ROS 2 bag is made with those above it
        with pytest.raises(InputRefused, match="cannot be written"):
            write_recording_file(tmp_path / "missing" / f"r{ending}", made)
    if ending != ".csv":
        early = Channel(name="a", quantity="joint.position", target="knee", unit="rad", time=np.array([-1.0]), value=np.zeros(1))
        with pytest.raises(InputRefused, match="before 0 s"):
            write_recording_file(tmp_path / f"r{ending}", Recording(name="r", channels=(early,)))
        assert not (tmp_path / f"r{ending}").exists()
