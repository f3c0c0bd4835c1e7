"""Does import store what was measured: units, steps, splits, long files, and what an interruption leaves?"""

import math

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from machines import cart
from recording_files import drive, write_bag, write_mcap
from recording_import import CHANNELS, load, manifest
from rille import store
from rille.cli.record_check import check
from rille.model import InputRefused
from rille.model.recording import Channel, Correction
from rille.recording import importing
from rille.recording.columns import _factor
from rille.recording.corrections import correct
from rille.recording.gate import gate
from rille.recording.manifest import ChannelSheet
from rille.recording.spool import Spool


def table(folder, columns, name="d.parquet"):
    pq.write_table(pa.table(columns), folder / name)
    return folder / name


def smooth(n=1000, seed=5):
    t = np.cumsum(np.random.default_rng(seed).uniform(0.9e-3, 1.1e-3, n))
    return {"t": t, "q": np.sin(t), "v": np.cos(t)}


def test_units_scale_and_offset(tmp_path):
    data = smooth()
    table(tmp_path, {"t": 1e3 * data["t"], "q": np.degrees(data["q"]), "i": data["v"]})
    channels = """
[[channel]]
column = "q"
quantity = "joint.position"
target = "knee"
unit = "deg"
scale = -1
offset = "10 deg"
noise = "0.5 deg"
delay = "7 ms"
[[channel]]
column = "i"
quantity = "joint.effort"
target = "knee"
unit = "mA"
scale = "0.095 N m/A"
"""
    (done,) = load(manifest(tmp_path, "d.parquet", channels=channels, time='[time]\ncolumn = "t"\nunit = "ms"'), tmp_path / "m.db")
    recording = store.read_recording(tmp_path / "m.db", "drive")
    angle, effort = recording.channels
    # one multiplication and one addition each: some units in the last place
    np.testing.assert_allclose(angle.time, data["t"], rtol=1e-15)
    np.testing.assert_allclose(angle.value, math.radians(10) - data["q"], atol=1e-15)
    np.testing.assert_allclose(effort.value, 0.095e-3 * data["v"], rtol=1e-14)
    assert (angle.unit, effort.unit, angle.delay) == ("rad", "N m", 0.007)
    assert angle.noise == pytest.approx(math.radians(0.5))
    assert [(c.kind, c.channel) for c in recording.corrections] == [("scale", "q"), ("scale", "i")]
    assert done.samples == 2000


def test_what_the_manifest_accepts_stays_accepted(tmp_path, capsys):
    """Missing values are an error unless the manifest accepts them; a later check is told of the same manifest."""
    data = smooth()
    data["q"][300:320] = np.nan
    table(tmp_path, data)
    channels = CHANNELS.replace('target = "knee"\nunit = "rad"\n', 'target = "knee"\nunit = "rad"\nmissing = "accept"\n')
    load(manifest(tmp_path, "d.parquet", channels=channels), tmp_path / "m.db", gate=gate)
    before = store.read_recording(tmp_path / "m.db", "drive").findings
    assert "the manifest accepts it" in next(f.message for f in before if f.code == "missing")
    check(tmp_path / "m.db")
    assert store.read_recording(tmp_path / "m.db", "drive").findings == before
    assert "error" not in capsys.readouterr().out


@pytest.mark.parametrize("kind", ["mcap", "bag", "folder"])
def test_messages_from_an_epoch_begin_at_zero(tmp_path, kind):
    path = tmp_path / {"mcap": "d.mcap", "bag": "d.bag", "folder": "d"}[kind]
    (write_mcap if kind == "mcap" else write_bag)(path, n=500)
    channels = """
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
target = "base"
unit = "m"
"""
    load(manifest(tmp_path, path.name, channels=channels, time=""), tmp_path / "m.db")
    recording = store.read_recording(tmp_path / "m.db", "drive")
    stamp, position, _, x = drive(n=500)
    left, place = recording.channels
    stamp = stamp - stamp[0]
    np.testing.assert_array_equal(left.time, stamp / 1e9)  # integers until the origin is subtracted: nothing is rounded twice
    np.testing.assert_array_equal(left.value, position[:, 0])
    np.testing.assert_array_equal(place.time, stamp[::10] / 1e9)
    np.testing.assert_array_equal(place.value, x[::10])
    assert (left.clock, place.clock) == ("/joint_states", "/x")
    assert [c.kind for c in recording.corrections] == ["origin"]


def test_split_and_where(tmp_path):
    n = 100
    runs = np.repeat([3.0, 1.0, 2.0], n)
    robots = np.array(["a"] * (2 * n) + ["b"] * n)
    table(tmp_path, {"t": np.tile(np.arange(n) * 0.01, 3), "q": np.arange(3.0 * n), "v": np.zeros(3 * n), "run": runs, "robot": robots})
    path = manifest(tmp_path, "d.parquet", top='split = ["robot", "run"]', time='[where]\nrobot = "a"\n[time]\ncolumn = "t"\nunit = "s"')
    load(path, tmp_path / "m.db")
    assert store.recording_names(tmp_path / "m.db") == ("drive/a/3", "drive/a/1")
    np.testing.assert_array_equal(store.read_recording(tmp_path / "m.db", "drive/a/1").channel("q").value, np.arange(n, 2.0 * n))


def test_rows_without_a_label_are_a_recording_called_none(tmp_path):
    """An empty label ended the name of a recording with a slash."""
    (tmp_path / "d.csv").write_text("t,run,q\n0,,1\n1,,2\n0,b,3\n1,b,4\n")
    channels = '[[channel]]\ncolumn = "q"\nquantity = "joint.position"\ntarget = "knee"\nunit = "rad"\n'
    load(manifest(tmp_path, "d.csv", top='split = ["run"]', channels=channels), tmp_path / "m.db")
    assert store.recording_names(tmp_path / "m.db") == ("drive/none", "drive/b")


def test_one_command_for_two_drives(tmp_path):
    table(tmp_path, {"t": [0.0, 1.0], "u": [1.0, 2.0]})
    channels = '[[channel]]\ncolumn = "u"\nquantity = "joint.velocity"\ntarget = ["fl", "rl"]\nunit = "rad/s"\nrole = "command"\n'
    load(manifest(tmp_path, "d.parquet", channels=channels), tmp_path / "m.db")
    channels = store.read_recording(tmp_path / "m.db", "drive").channels
    assert [(c.name, c.target, c.value.tolist()) for c in channels] == [("u (fl)", "fl", [1, 2]), ("u (rl)", "rl", [1, 2])]


def test_an_encoder_that_begins_anew_is_counted_on(tmp_path):
    """A counter of 12 bits, 1 mrad a count, turning to and fro over 40 of its lengths, with gaps; and how many samples that moved."""
    t = np.arange(20_000) * 0.01
    true = np.round(90.0 * np.sin(0.02 * t), 3)
    wrapped = np.where(np.arange(len(t)) % 997 == 5, np.nan, np.round(true % 4.096, 3))
    table(tmp_path, {"t": t, "q": wrapped, "v": np.gradient(true, t)})
    step = '[[correction]]\nkind = "unwrap"\nchannel = "q"\nby = "4.096 rad"\nreason = "12 bits"\n'
    channels = CHANNELS.replace('unit = "rad"\n', 'unit = "rad"\nmissing = "accept"\n', 1)
    load(manifest(tmp_path, "d.parquet", channels=channels + step), tmp_path / "m.db")
    recording = store.read_recording(tmp_path / "m.db", "drive")
    there = np.isfinite(wrapped)
    np.testing.assert_array_equal(np.isfinite(recording.channel("q").value), there)
    np.testing.assert_allclose(recording.channel("q").value[there], true[there], atol=1e-9)
    (made,) = recording.corrections
    assert made.detail["samples"] == np.count_nonzero(np.abs(true - wrapped)[there] > 1)
    assert made.detail["by"] == 4.096


def test_corrections_are_made_in_order_and_recorded(tmp_path):
    data = smooth(n=50_000)
    order = np.random.default_rng(1).permutation(50_000)
    twice = np.append(order, order[:100])
    table(tmp_path, {name: column[twice] for name, column in data.items()})
    steps = """
[[correction]]
kind = "sort"
reason = "two loggers were merged"
[[correction]]
kind = "drop_duplicates"
reason = "both logged the beginning"
[[correction]]
kind = "shift_clock"
by = "-0.5 s"
reason = "trigger"
[[correction]]
kind = "drop_samples"
channel = "v"
start = 1
end = "2 s"
reason = "cable was loose"
[[correction]]
kind = "cut"
start = 0
reason = "before the trigger"
"""
    load(manifest(tmp_path, "d.parquet", channels=CHANNELS + steps), tmp_path / "m.db")
    recording = store.read_recording(tmp_path / "m.db", "drive")
    kept = data["t"] - 0.5 >= 0
    q, v = recording.channels
    np.testing.assert_array_equal(q.time, (data["t"] - 0.5)[kept])
    np.testing.assert_array_equal(q.value, data["q"][kept])
    loose = (v.time >= 1) & (v.time <= 2)
    np.testing.assert_array_equal(np.isnan(v.value), loose)
    found = [(c.kind, c.detail["samples"]) for c in recording.corrections]
    assert found[1:] == [("drop_duplicates", 100), ("shift_clock", 50_000), ("drop_samples", int(loose.sum())), ("cut", int((~kept).sum()))]
    assert found[0][0] == "sort"
    assert recording.corrections[0].reason == "two loggers were merged"


def test_resampling(tmp_path):
    t = np.array([0.0, 0.1, 0.25, 0.4])
    yaw = np.array([3.0, 3.1, -3.1, -3.0])  # crosses pi
    table(tmp_path, {"t": t, "u": [0.0, 1.0, 2.0, 3.0], "yaw": yaw, "x": 2 * t})
    channels = "".join(
        f'[[channel]]\ncolumn = "{c}"\nquantity = "{q}"\ntarget = "b"\nunit = "{u}"\n{more}\n'
        for c, q, u, more in (
            ("u", "joint.effort", "N m", 'role = "command"'),
            ("yaw", "part.orientation", "rad", 'component = "yaw"'),
            ("x", "part.position", "m", 'component = "x"'),
        )
    )
    step = '[[correction]]\nkind = "resample"\nrate = "20 Hz"\nreason = "one rate for all"\n'
    load(manifest(tmp_path, "d.parquet", channels=channels + step), tmp_path / "m.db")
    u, yaw, x = store.read_recording(tmp_path / "m.db", "drive").channels
    np.testing.assert_allclose(u.time, np.arange(9) * 0.05, atol=1e-15)
    np.testing.assert_allclose(x.value, 2 * u.time, atol=1e-15)  # linear stays linear
    assert u.value.tolist() == [0, 0, 1, 1, 1, 2, 2, 2, 3]  # a command holds
    between = 3.1 + (2 * np.pi - 6.2) / 3  # a third of the way round from 3.1 to -3.1
    np.testing.assert_allclose(yaw.value[3], between, atol=1e-12)


def test_rows_of_one_time_that_two_rates_share_lose_nothing(tmp_path):
    """The outer join of two loggers: t, q, (nothing) and t, (nothing), v."""
    gap = np.nan
    table(tmp_path, {"t": [0.0, 0.0, 1.0, 2.0, 2.0, 2.0], "q": [1.0, gap, 2, gap, 3, 4], "v": [gap, 5.0, gap, 6, gap, 7]})
    step = '[[correction]]\nkind = "drop_duplicates"\nreason = "an outer join"\n'
    load(manifest(tmp_path, "d.parquet", channels=CHANNELS + step), tmp_path / "m.db")
    q, v = store.read_recording(tmp_path / "m.db", "drive").channels
    assert q.time.tolist() == [0, 1, 2]
    assert q.value.tolist() == [1, 2, 3]
    np.testing.assert_array_equal(v.value, [5, np.nan, 6])


def test_turns_are_resampled_between_orientations_not_between_numbers():
    """An encoder that wraps, and two quaternions of one part whose signs flip: between samples lies the angle between them."""
    time = np.arange(0, 2, 0.1)
    angle = 2.5 * time
    sign = np.where(np.arange(len(time)) % 3 == 1, -1.0, 1.0)
    values = {"a": (angle + np.pi) % (2 * np.pi) - np.pi, "w": sign * np.cos(angle / 2), "z": sign * np.sin(angle / 2)}
    values |= {"x": np.zeros(len(time)), "y": np.zeros(len(time))}
    channels = {"a": Channel(name="a", quantity="joint.position", target="j", unit="rad")}
    values |= {"w2": sign * np.cos(angle), "x2": sign * np.sin(angle), "y2": np.zeros(len(time)), "z2": np.zeros(len(time))}
    for c in "wxyz":
        for name in (c, f"{c}2"):
            channels[name] = Channel(name=name, quantity="part.orientation", target="b", component=c, unit="1")
    step = Correction(kind="resample", reason="one rate", detail={"rate": 40.0})
    grid, found, _ = correct(step, "t", time, values, channels)
    np.testing.assert_allclose(found["a"], 2.5 * grid, atol=1e-12)
    turned = 2 * np.unwrap(np.arctan2(found["z"], found["w"]), period=np.pi)  # q and -q are one orientation
    np.testing.assert_allclose(turned, 2.5 * grid, atol=2e-4)  # a chord of 0.125 rad instead of its arc: 0.125^3 / 48 * 2
    np.testing.assert_allclose(found["w"] ** 2 + found["z"] ** 2, 1, atol=1e-12)
    other = 2 * np.unwrap(np.arctan2(found["x2"], found["w2"]), period=np.pi)  # about x, twice as fast
    np.testing.assert_allclose(other, 5 * grid, atol=8e-4)  # 0.25^3 / 48 * 2


def test_an_import_that_was_interrupted_goes_on(tmp_path, monkeypatch):
    n = 400_000
    data = smooth(n)
    table(tmp_path, data)
    path = manifest(tmp_path, "d.parquet")
    monkeypatch.setattr(importing, "COMMIT_EVERY", 0.0)

    def stop(what, fraction):
        if what == "reading" and fraction > 0.35:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        load(path, tmp_path / "m.db", on_progress=stop)
    assert store.recording_names(tmp_path / "m.db") == ()
    (done,) = load(path, tmp_path / "m.db")
    assert 0 < done.kept < done.samples == 2 * n
    recording = store.read_recording(tmp_path / "m.db", "drive")
    for name in ("q", "v"):
        np.testing.assert_array_equal(recording.channel(name).value, data[name])
    np.testing.assert_array_equal(recording.channel("q").time, data["t"])


def test_a_split_that_was_interrupted_while_storing_goes_on(tmp_path):
    table(tmp_path, {"t": [0.0, 1.0, 0.0, 1.0], "q": [1.0, 2, 3, 4], "v": [0.0] * 4, "run": [1, 1, 2, 2]})
    path = manifest(tmp_path, "d.parquet", top='split = ["run"]')

    def stop(what, fraction):
        if what == "storing" and fraction > 0.96:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        load(path, tmp_path / "m.db", on_progress=stop)
    assert store.recording_names(tmp_path / "m.db") == ("drive/1",)
    load(path, tmp_path / "m.db")
    assert store.recording_names(tmp_path / "m.db") == ("drive/1", "drive/2")
    with pytest.raises(InputRefused, match="in the database already"):
        load(path, tmp_path / "m.db")


def test_long_columns_wait_in_files_and_the_gate_can_load_them(tmp_path, monkeypatch):
    spool = Spool(tmp_path)
    values = np.random.default_rng(0).normal(size=700_000)
    for part in np.array_split(np.arange(700_000), 7):
        spool.append("t", part * 1e-3, {"q": values[part]})
    np.testing.assert_array_equal(spool.values("t", "q"), values)
    assert spool.forward("t")
    assert not list(tmp_path.iterdir())  # the files have no names: nothing is left if the process dies
    spool.append("t", np.array([0.0]), {"q": np.array([1.0])})
    assert not spool.forward("t")
    spool.close()

    table(tmp_path, smooth(2000))
    monkeypatch.setattr(importing, "MANY", 10)
    seen = []

    def gate(recordings, on_progress=None, *, load=None, gravity=None):
        whole = load(recordings[0].name, "q", None)
        seen.append((len(whole.value), load(recordings[0].name, "q", (0.5, 1.0)).time))
        return [()]

    load(manifest(tmp_path, "d.parquet"), tmp_path / "m.db", gate=gate)
    assert seen[0][0] == 2000
    assert 0.5 <= seen[0][1].min() < 0.502
    assert 0.998 < seen[0][1].max() <= 1.0


def test_kind_of_joint_decides_the_unit(tmp_path):
    store.create(tmp_path / "m.db")
    rover = cart(5.0, 0.15, 0.165)
    store.write_rover(tmp_path / "m.db", rover)
    name = rover.joints[0].name
    table(tmp_path, {"t": [0.0, 1.0], "q": [0.0, 1.0], "v": [0.0, 1.0]})
    good = CHANNELS.replace("knee", name)
    load(manifest(tmp_path, "d.parquet", channels=good), tmp_path / "m.db")
    with pytest.raises(InputRefused, match="measured in rad;"):
        load(manifest(tmp_path, "d.parquet", channels=good.replace('"rad"', '"mm"')), tmp_path / "m.db")
    with pytest.raises(InputRefused, match=f"model does not have; did you mean '{name}'"):
        load(manifest(tmp_path, "d.parquet", channels=CHANNELS.replace("knee", name[:-1])), tmp_path / "m.db")
    assert store.recording_names(tmp_path / "m.db") == ("drive",)


@pytest.mark.parametrize(("si", "unit"), [("rad/s", u) for u in ("1/min", "s^-1", "kHz", "count/s")] + [("rad", "count"), ("rad", "%")])
def test_a_count_is_no_angle(si, unit):
    """Radians are pure numbers, and so are turns, ticks and per cent: 1/min is what some write for turns per minute."""
    with pytest.raises(InputRefused, match="may mean turns or radians"):
        _factor(ChannelSheet(column="a", quantity="joint.position", unit=unit), (si,), "column 'a'")
    assert _factor(ChannelSheet(column="a", quantity="joint.position", unit="count", scale="0.001 rad/count"), ("rad",), "a") == (
        0.001,
        "rad",
    )
