"""Recordings of a wheel bench: the table [bench], the conditions, and the gate for points."""

from dataclasses import replace

import numpy as np
import pytest

from rille.model import InputRefused
from rille.model.recording import Channel, Recording
from rille.recording.gate import gate
from rille.recording.points import along_heading, bench_conditions, bench_setup, bench_target
from rille.recording.points_gate import points_findings


def channel(name, value, role="observed", target="wheel", unit="N"):
    value = np.asarray(value, dtype=float)
    return Channel(name=name, quantity=f"wheel.{name}", target=target, unit=unit, role=role, time=np.arange(len(value)) * 1.0, value=value)


def clean(seed=0, n=60, **setup):
    """A bench that behaves: pull and torque grow with slip, side force is against the drift."""
    random = np.random.default_rng(seed)
    slip, angle = random.uniform(-0.5, 0.9, n), random.choice([-0.2, 0.0, 0.2], n)
    return Recording(
        name="bench",
        kind="points",
        setup=setup,
        channels=(
            channel("slip_ratio", slip, "command", unit="1"),
            channel("slip_angle", angle, "command", unit="rad"),
            channel("normal_load", random.normal(50, 2, n), "command"),
            channel("drawbar_pull", 15 * np.tanh(3 * slip) + random.normal(0, 1, n)),
            channel("side_force", 40 * angle + random.normal(0, 1, n)),
            channel("drive_torque", 3 * np.tanh(3 * slip) + random.normal(0, 0.2, n), unit="N m"),
            channel("sinkage", 0.01 + 0.01 * np.abs(slip) + random.normal(0, 5e-4, n), unit="m"),
        ),
    )


def changed(recording, name, value):
    """The recording with other values in one channel."""
    return replace(recording, channels=tuple(replace(c, value=value(c.value)) if c.name == name else c for c in recording.channels))


def test_the_table_bench_becomes_plain_si_numbers():
    table = {"radius": "58 mm", "width": 0.05, "grousers": "24 x 10 mm", "soil": "lete_sand", "load": "6.6 kN", "slip_angle": "4 deg"}
    setup = bench_setup(table, "'cmu.toml'")
    assert setup["wheel"] == {"radius": pytest.approx(0.058), "width": 0.05, "grouser_count": 24, "grouser_height": pytest.approx(0.01)}
    assert setup["load"] == pytest.approx(6600)
    assert setup["slip_angle"] == pytest.approx(np.radians(4))
    assert (setup["law"], setup["gravity"], setup["slip_speed"], setup["speed"]) == ("bekker_wong", "earth", "heading", 0.05)
    assert bench_setup({}, "'x'")["wheel"] == {}


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ({"radius": "58 mm"}, "states half a wheel"),
        ({"radius": "58 N", "width": 0.1}, "radius in .*58 N"),
        ({"radius": 0, "width": 0.1}, "radius in .* is 0 m; it must be above 0"),
        ({"radius": 0.1, "width": 0.1, "grousers": "many"}, 'are "many"; write'),
        ({"radius": 0.1, "width": 0.1, "grouser_count": -3}, "states -3 grousers"),
        ({"law": "janosi"}, "law"),
        ({"radios": 0.1}, "'radios' is unknown.*radius"),
        ({"load": "-3 N"}, "load in .* is -3 N"),
        ({"slip_speed": "ground"}, "slip_speed"),
    ],
)
def test_a_table_that_is_wrong_is_one_sentence(table, sentence):
    with pytest.raises(InputRefused, match=sentence) as refused:
        bench_setup(table, "'bench.toml'")
    assert "\n" not in str(refused.value)


def test_slip_along_the_heading_is_that_of_the_speeds():
    """Against 1 - v/(r w) and (r w)/v - 1 with v = V cos b, written out for rim speeds from standstill to ten times the travel."""
    rim, angle = (grid.ravel() for grid in np.meshgrid([0.0, 0.3, 0.5, 0.99, 1.0, 1.3, 10.0], np.radians([-60, 0, 15, 75])))
    recorded = np.where(rim >= 1, 1 - 1 / np.maximum(rim, 1e-9), rim - 1)
    ahead = np.cos(angle)
    expected = np.where(rim >= ahead, 1 - ahead / np.maximum(rim, 1e-9), rim / ahead - 1)
    assert along_heading(recorded, angle) == pytest.approx(expected, abs=1e-12)
    assert along_heading(1.0, 0.3) == 1
    assert along_heading(0.4, 0.0) == pytest.approx(0.4)


def test_conditions_come_from_channels_before_constants():
    recording = clean(load=30.0, slip_angle=0.1)
    points = bench_conditions(recording)
    assert np.array_equal(points.load, recording.channel("normal_load").value)
    without = replace(recording, channels=tuple(c for c in recording.channels if c.name not in ("normal_load", "slip_angle")))
    assert set(bench_conditions(without).load) == {30.0}
    assert set(bench_conditions(without).slip_angle) == {0.1}
    assert set(bench_conditions(replace(without, setup={"load": 30.0})).slip_angle) == {0.0}
    with pytest.raises(InputRefused, match="does not say the load"):
        bench_conditions(replace(without, setup={}))


@pytest.mark.parametrize(
    ("name", "factor", "sentence", "code"),
    [
        ("slip_ratio", 100, "percent", "range"),
        ("slip_angle", 180 / np.pi, "degrees", "range"),
        ("normal_load", -1, "scale = -1", "sign"),
    ],
)
def test_conditions_that_no_wheel_has_are_found_and_refused(name, factor, sentence, code):
    recording = changed(clean(), name, lambda value: factor * value)
    found = [f for f in points_findings(recording) if f.severity == "error"]
    assert [(f.code, f.channel) for f in found] == [(code, name)]
    with pytest.raises(InputRefused, match=sentence):
        bench_conditions(recording)


def test_single_points_without_load_are_missing():
    recording = changed(clean(), "normal_load", lambda value: np.where(np.arange(len(value)) < 3, 0.0, value))
    assert [(f.code, f.severity, f.channel) for f in points_findings(recording)] == [("range", "warning", "normal_load")]
    assert np.flatnonzero(np.isnan(bench_conditions(recording).load)).tolist() == [0, 1, 2]


@pytest.mark.parametrize("name", ["drawbar_pull", "side_force", "drive_torque", "sinkage"])
def test_a_response_with_the_wrong_sign_is_found(name):
    found = points_findings(changed(clean(), name, np.negative))
    assert [(f.code, f.severity, f.channel) for f in found] == [("sign", "warning", name)]


def test_stuck_missing_and_copied_points_are_found():
    assert [f.code for f in points_findings(changed(clean(), "sinkage", lambda value: 0 * value + 0.01))] == ["stuck"]
    gaps = points_findings(changed(clean(), "sinkage", lambda value: np.where(np.arange(len(value)) < 9, np.nan, value)))
    assert [(f.code, f.severity, f.detail["count"]) for f in gaps] == [("missing", "note", 9)]
    recording = clean()
    twice = replace(recording, channels=tuple(replace(c, value=np.tile(c.value, 2)) for c in recording.channels))
    assert [(f.code, f.detail["count"]) for f in points_findings(twice)] == [("duplicates", 60)]


@pytest.mark.parametrize(
    ("radius", "factor", "severity"),
    [(0.09, 1000.0, "error"), (0.09, 5.0, "warning"), (0.09, 1.0, None), (None, 1000.0, "error"), (None, 5.0, None)],
)
def test_sinkage_beyond_the_wheel_is_found(radius, factor, severity):
    """10 to 20 mm: in metres none of any wheel; five times that goes beyond the radius at some points, not beyond the diameter."""
    setup = {} if radius is None else {"wheel": {"radius": radius, "width": 0.1, "grouser_height": 0.0}}
    found = points_findings(changed(clean(**setup), "sinkage", lambda value: factor * value))
    assert [(f.code, f.severity, f.channel) for f in found] == ([("range", severity, "sinkage")] if severity else [])


def test_sinkage_from_some_mark_is_not_judged():
    recording = clean(wheel={"radius": 0.09, "width": 0.1}, unknown_zero=["sinkage"])
    assert points_findings(changed(recording, "sinkage", lambda value: value + 0.3)) == ()


@pytest.mark.parametrize(("radius", "width", "count"), [(90.0, 100.0, 2), (0.09, 1e-4, 1), (0.09, 0.1, 0), (2.0, 1.2, 0)])
def test_a_wheel_in_another_unit_is_found(radius, width, count):
    found = points_findings(clean(wheel={"radius": radius, "width": width, "grouser_count": 0, "grouser_height": 0.0}))
    assert [(f.code, f.severity, f.channel) for f in found] == count * [("range", "error", "")]
    assert not radius > 5 or 'radius = "90 mm"' in found[0].message


@pytest.mark.parametrize(
    ("column", "unit", "name", "factor"),
    [("Torque [Nm]", "mN m", "", 1e3), ("Sinkage [mm]", "m", "sinkage", 1e-3), ("Torque [N m]", "N m", "", None)],
)
def test_the_unit_in_a_columns_name_is_checked_as_of_recordings(column, unit, name, factor):
    manifest = f'[[channel]]\ncolumn = "{column}"\nunit = "{unit}"\n' + (f'name = "{name}"\n' if name else "")
    own = "sinkage" if "Sinkage" in column else "drive_torque"
    recording = clean()
    named = tuple(replace(c, name=name or column) if c.name == own else c for c in recording.channels)
    (found,) = gate([replace(recording, manifest=manifest, channels=named)])
    assert [(f.code, f.severity, f.channel) for f in found] == ([("header", "error", name or column)] if factor else [])
    assert not factor or found[0].detail["factor"] == pytest.approx(factor)


@pytest.mark.parametrize("seed", range(50))
def test_a_clean_bench_is_met_with_silence(seed):
    assert points_findings(clean(seed, n=12 + 4 * seed)) == ()


def test_points_of_two_wheels_are_refused():
    recording = clean()
    with pytest.raises(InputRefused, match="2 wheels"):
        bench_target(replace(recording, channels=(*recording.channels, channel("sinkage", [0.01], target="rear"))))
    assert bench_target(recording) == "wheel"
    with pytest.raises(InputRefused, match="no channel of a wheel"):
        bench_target(replace(recording, channels=()))
