"""The data gate: silent on clean recordings, and each fault found in the right channel, on seeded machines and on real ones."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
from scipy.spatial.transform import Rotation

from recording.gate_machines import changed, machine
from rille.model.recording import Channel, GateFinding, Recording, Role
from rille.recording.gate import gate
from rille.recording.gate.lag import fit_lag
from rille.recording.gate.quantisation import resolution_of
from rille.recording.gate.runs import held_runs, true_runs
from rille.recording.gate.track import lay
from rille.recording.gate.unit_names import spelt_unit

Fault = Callable[[Recording], Recording]


def loud(recording: Recording) -> list[GateFinding]:
    return [finding for finding in gate([recording])[0] if finding.severity != "note"]


@pytest.mark.parametrize("seed", range(100, 156))
def test_clean_recordings_are_silent(seed: int):
    """Machines with rests, jitter, noise up to 5 % and steps up to 5 % of the spread: no warning. Written before these seeds were run."""
    assert [finding.message for finding in loud(machine(seed, duration=15.0))] == []


def values(name: str, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Fault:
    return lambda recording: changed(recording, name, value=change(recording.channel(name).time, recording.channel(name).value.copy()))


def times(change: Callable[[np.ndarray], np.ndarray], *clocks: str) -> Fault:
    def apply(recording: Recording) -> Recording:
        channels = (replace(c, time=change(c.time)) if not clocks or c.clock in clocks else c for c in recording.channels)
        return replace(recording, channels=tuple(channels))

    return apply


def held(time: np.ndarray, value: np.ndarray) -> np.ndarray:
    inside = (time > 1.0) & (time < 2.6)
    value[inside] = value[inside][0]
    return value


def hole(time: np.ndarray, value: np.ndarray) -> np.ndarray:
    value[(time > 3.0) & (time < 7.0)] = np.nan
    return value


def needles(time: np.ndarray, value: np.ndarray) -> np.ndarray:
    value[[50, 90, 91, 250]] += 40 * value.std()
    return value


FAULTS: dict[str, tuple[Fault, str, str, set[str]]] = {  # fault, code, severity, channels or clocks of which one must be named
    "rate turned": (values("shoulder_velocity", lambda t, v: -v), "sign", "error", {"shoulder_velocity", "shoulder_position"}),
    "gyro turned": (values("gyro", lambda t, v: -v), "sign", "error", {"gyro", "heading"}),
    "degrees": (values("elbow_position", lambda t, v: np.degrees(v)), "unit", "error", {"elbow_position", "elbow_velocity"}),
    "millimetres": (values("east", lambda t, v: 1000 * v), "unit", "error", {"east", "speed"}),
    "rpm": (values("elbow_velocity", lambda t, v: v * 30 / np.pi), "unit", "error", {"elbow_position", "elbow_velocity"}),
    "milliseconds": (times(lambda t: 1e3 * t), "time_unit", "error", {"time", "pose"}),
    "microseconds": (times(lambda t: 1e6 * t), "time_unit", "error", {"time", "pose"}),
    "kiloseconds": (times(lambda t: 1e-3 * t), "time_unit", "error", {"time", "pose"}),
    "held rate": (values("shoulder_velocity", held), "stuck", "warning", {"shoulder_velocity"}),
    "held position": (values("shoulder_position", held), "stuck", "warning", {"shoulder_position"}),
    "held heading": (values("heading", held), "stuck", "warning", {"heading"}),
    "dead": (values("gyro", lambda t, v: np.full(len(v), 0.3)), "stuck", "error", {"gyro"}),
    "cut off": (values("elbow_velocity", lambda t, v: np.clip(v, -v.std(), v.std())), "saturation", "warning", {"elbow_velocity"}),
    "missing": (values("speed", hole), "missing", "error", {"speed"}),
    "infinite": (values("speed", lambda t, v: np.where(t > 5, np.inf, v)), "not_finite", "error", {"speed"}),
    "backwards": (times(lambda t: np.concatenate([t[:60], t[60:80] - 0.5, t[80:]]), "time"), "clock_backwards", "error", {"time"}),
    "twice": (times(lambda t: np.concatenate([t[:61], t[60:-1]]), "time"), "clock_duplicates", "error", {"time"}),
    "gap": (times(lambda t: np.where(t > 4, t + 2.0, t)), "clock_gap", "warning", {"time", "pose"}),
    "scaled": (values("shoulder_velocity", lambda t, v: 1.3 * v), "gain", "warning", {"shoulder_velocity", "shoulder_position"}),
    "biased": (values("gyro", lambda t, v: v + 0.5 * v.std()), "bias", "warning", {"gyro"}),
    "needles": (values("elbow_position", needles), "spike", "warning", {"elbow_position"}),
    "late": (lambda r: changed(r, "gyro", time=r.channel("gyro").time + 0.06), "delay", "warning", {"gyro"}),
    "apart": (times(lambda t: t + 1000.0, "pose"), "clocks_apart", "error", {"time", "pose"}),
    "slow clock": (times(lambda t: 1.004 * t, "pose"), "clock_skew", "warning", {"time", "pose"}),
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("seed", [202, 206])
def test_faults_are_found_and_named(fault: str, seed: int):
    """Two machines without rests at the wrong moment (during the stuck stretch), noise up to 5 %."""
    change, code, severity, names = FAULTS[fault]
    found = loud(change(machine(seed)))
    hits = [finding for finding in found if finding.code == code and finding.severity == severity and finding.channel in names]
    assert hits, [finding.message for finding in found]
    assert not any(finding.severity == "error" and finding.code != code for finding in found), [f.message for f in found]


@pytest.mark.parametrize("rate", [100.0, 250.0, 1000.0])
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_delay_between_sensors(rate: float, noise: float):
    """7 ms between a joint's encoder and its rate, irregular stamps on two clocks: found within 0.3 ms and four standard errors."""
    rng = np.random.default_rng(int(rate))
    t, u = (np.sort(np.arange(0, 20, 1 / rate) + rng.uniform(-0.3, 0.3, int(20 * rate)) / rate) for _ in range(2))
    w = 2 * np.pi * np.array([0.31, 0.83, 2.1])
    position = np.sin(np.multiply.outer(t, w)).sum(-1) + noise * 0.1 * rng.normal(size=len(t))
    velocity = (w * np.cos(np.multiply.outer(u - 0.007, w))).sum(-1) + noise * rng.normal(size=len(u))
    first, second = lay([(t, position)], [0.0], 100.0), lay([(u, velocity)], [0.0], 100.0)
    assert first is not None
    assert second is not None
    fit = fit_lag(first, second, 1)
    assert fit is not None
    assert abs(fit.delay - 0.007) < min(3e-4, 4 * fit.delay_error + 1e-5)  # 1e-5 s: linear interpolation between samples
    assert not fit.ambiguous


@pytest.mark.parametrize("seed", [4, 5, 9, 10, 13, 14, 17, 21, 28])
def test_delay_of_a_command(seed: int):
    """Held commands at 500 Hz that act after 7 ms are found within 1 ms; without delay nothing is claimed."""
    delays = [
        finding for finding in gate([machine(seed, delay=0.007)])[0] if finding.code == "delay" and finding.detail["kind"] == "response"
    ]
    assert len(delays) == 2  # shoulder and elbow
    for finding in delays:
        error = finding.detail["error"]
        assert isinstance(error, float)
        assert abs(float(str(finding.detail["delay"])) - 0.007) < min(1e-3, 4 * error)
    assert not [f for f in gate([machine(seed)])[0] if f.code == "delay" and f.detail["kind"] == "response"]


@pytest.mark.parametrize(("commanded", "told"), [((-5.0, -2.0), 0), ((2.0, 30.0), 0), ((20.5, 30.0), 1)])
def test_commands_may_be_earlier_than_what_is_seen_but_not_later(commanded: tuple[float, float], told: int):
    """A command holds until the next one; one that came after the last sample did nothing in it."""
    time = np.arange(0, 20, 0.01)
    seen = Channel(name="angle", quantity="joint.position", target="elbow", unit="rad", time=time, value=np.sin(time))
    asked = Channel(
        name="asked", quantity="joint.velocity", target="elbow", unit="rad/s", role="command", clock="asked",
        time=np.array(commanded), value=np.array([1.0, 0.0]),
    )  # fmt: skip
    found = gate([Recording(name="r", channels=(seen, asked))])[0]
    assert sum(finding.code == "clocks_apart" for finding in found) == told


def test_stated_delays_are_believed():
    """A delay that the manifest states leaves nothing to find."""
    recording = changed(machine(202), "gyro", time=machine(202).channel("gyro").time + 0.06, delay=0.06)
    assert loud(recording) == []


def test_no_delay_is_claimed_where_nothing_can_be_seen():
    """Two channels of noise, one of which is late by half a second: no finding but what each is by itself."""
    rng = np.random.default_rng(2)
    time = np.arange(0, 20, 0.01)
    channels = tuple(
        Channel(name=name, quantity=quantity, target="arm", unit=unit, time=time, value=rng.normal(size=len(time)) * scale)
        for name, quantity, unit, scale in (("q", "joint.position", "rad", 1e-3), ("v", "joint.velocity", "rad/s", 0.14))
    )
    assert gate([Recording(name="still", channels=channels)])[0] == ()


def test_rest_is_not_stuck():
    """A machine without noise that moves, stands still and moves again; one encoder that counts and one rate."""
    time = np.arange(0, 20, 0.01)
    pace = np.clip(np.abs(time - 10) - 3, 0, 1)
    velocity = pace * np.sin(2 * time)
    position = np.round(np.cumsum(velocity) * 0.01 / 0.005) * 0.005
    channels = (
        Channel(name="q", quantity="joint.position", target="arm", unit="rad", time=time, value=position),
        Channel(name="v", quantity="joint.velocity", target="arm", unit="rad/s", time=time, value=velocity),
        Channel(name="lonely", quantity="joint.effort", target="arm", unit="N m", time=time, value=np.where(pace > 0, 2 * velocity, 0.0)),
    )
    assert loud(Recording(name="rest", channels=channels)) == []


def test_header_against_manifest():
    manifest = """
    [time]
    column = "stamp_ms"
    unit = "s"
    [[channel]]
    column = "yaw_deg"
    unit = "rad"
    [[channel]]
    column = "speed [mm/s]"
    unit = "mm/s"
    [[channel]]
    column = "torque_mNm"
    unit = "N m"
    scale = 0.001
    [[channel]]
    column = "x [mm]"
    time = "gps [ms]"
    name = "x"
    unit = "m"
    """
    time = np.arange(0, 5, 0.01)
    channels = (
        Channel(name="yaw_deg", quantity="part.orientation", component="yaw", target="base", unit="rad", time=time, value=np.sin(time)),
        Channel(
            name="speed [mm/s]", quantity="part.linear_velocity", component="x", target="base", unit="m/s", time=time, value=np.cos(time)
        ),
        Channel(name="torque_mNm", quantity="joint.effort", target="arm", unit="N m", time=time, value=np.cos(3 * time)),
        Channel(name="x", quantity="part.position", component="x", target="mast", unit="m", time=time, value=np.cos(2 * time)),
    )
    found = loud(Recording(name="named", manifest=manifest, channels=channels))
    assert {(finding.code, finding.channel) for finding in found} == {("time_unit", ""), ("header", "yaw_deg"), ("header", "x")}
    assert {finding.detail["name"] for finding in found} == {"ms", "deg", "mm"}
    assert sum(finding.code == "time_unit" for finding in found) == 2


@pytest.mark.parametrize(
    ("name", "unit", "expected"),
    [
        ("yaw_deg", "rad", "deg"),
        ("Gyro Z (deg/s)", "rad/s", "deg/s"),
        ("wheel_rpm", "rad/s", "rpm"),
        ("pos_m", "m", "m"),
        ("a", "A", None),
        ("team", "m", None),
        ("stamp_us", "s", "us"),
        ("v_mm_s", "m/s", "mm_s"),
        ("rate z [°/s]", "rad/s", "°/s"),
        ("angle °", "rad", "°"),
        ("Torque [N m]", "N m", "N m"),
        ("Force [MN]", "N", "MN"),
        ("a [m/s²]", "m/s^2", "m/s²"),
        ("range [in]", "m", "in"),
        ("pos (in)", "m", None),  # a word, for all one knows
        ("angle [%]", "rad", None),
        ("angle [1]", "rad", None),
        ("pitch", "rad", None),
    ],
)
def test_units_in_names(name: str, unit: str, expected: str | None):
    spelt = spelt_unit(name, unit)
    assert (spelt[0] if spelt else None) == expected


def test_impossible_values():
    time = np.arange(0, 5, 0.01)
    channels = (
        Channel(name="slip", quantity="wheel.slip_ratio", target="wheel", unit="1", time=time, value=40 + 20 * np.sin(time)),
        Channel(name="pitch", quantity="part.orientation", component="pitch", target="base", unit="rad", time=time, value=9 * np.sin(time)),
        Channel(name="roll", quantity="part.orientation", component="roll", target="base", unit="rad", time=time, value=0.2 * np.sin(time)),
    )
    found = loud(Recording(name="odd", channels=channels))
    assert {(finding.code, finding.channel) for finding in found} == {("range", "slip"), ("range", "pitch")}


@pytest.mark.parametrize("step", [1e-4, 0.0174533, 3.0])
def test_resolution(step: float):
    """The step of a quantised walk comes out to 0.1 %; of continuous values there is none."""
    rng = np.random.default_rng(3)
    walk = np.cumsum(rng.normal(size=5000)) * step
    assert resolution_of(np.round(walk / step) * step + 0.3) == pytest.approx(step, rel=1e-3)
    assert resolution_of((np.round(walk / step) * step).astype(np.float32).astype(float)) == pytest.approx(step, rel=1e-3)
    assert resolution_of(walk) is None
    assert resolution_of(np.zeros(100)) is None


def test_runs():
    first, last = true_runs(np.array([True, True, False, True, False, False, True]))
    assert (first.tolist(), last.tolist()) == ([0, 3, 6], [2, 4, 7])
    first, last = held_runs(np.array([1.0, 1, 1, 2, np.nan, np.nan, 3, 3]), 2)
    assert (first.tolist(), last.tolist()) == ([0, 6], [3, 8])


def test_clocks_of_commands_have_no_rate():
    """Commands are stamped when they change: twelve in a minute are neither gaps nor a wrong unit of time."""
    time = np.array([0.0, 1, 9, 10, 25, 26, 27, 40, 41, 55, 56, 60])
    command = Channel(
        name="c", quantity="joint.effort", target="arm", unit="N m", role="command", clock="c", time=time, value=np.arange(12.0) % 3
    )
    assert gate([Recording(name="sparse", channels=(command,))])[0] == ()


@pytest.mark.parametrize("seed", range(4))
def test_a_tumbling_body_is_no_fault(seed: int):
    """Far from level, angles and turning rates are no rates of each other: the component x of the turning rate is not that of the roll."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, 8, 0.01)
    turn = Rotation.from_euler("ZYX", rng.uniform(-1, 1, 3))
    rate = rng.normal(0, 1.2, 3)
    channels = []
    attitudes = Rotation.from_rotvec(time[:, None] * rate) * turn
    angles = np.unwrap(attitudes.as_euler("ZYX"), axis=0)
    for k, component in enumerate(("yaw", "pitch", "roll")):
        value = angles[:, k] + rng.normal(0, 1e-3, len(time))
        channels.append(
            Channel(name=component, quantity="part.orientation", component=component, target="ball", unit="rad", time=time, value=value)
        )
    wobble = 1 + 0.3 * np.sin(3 * time)  # so that the rates vary, too
    for k, component in enumerate("xyz"):
        value = rate[k] * wobble + rng.normal(0, 1e-3, len(time))
        channels.append(
            Channel(
                name=f"rate_{component}",
                quantity="part.angular_velocity",
                component=component,
                target="ball",
                unit="rad/s",
                time=time,
                value=value,
            )
        )
    assert [f.message for f in loud(Recording(name="tumbling", channels=tuple(channels))) if f.code in ("unit", "gain", "sign")] == []


def test_small_gains_within_a_joint():
    """5 % between rate and position, and between torque and command, are said where nothing else parts them; 2 % are not."""
    time = np.arange(0, 20, 0.01)
    angle, rate = np.sin(time) + 0.3 * np.sin(3.1 * time), np.cos(time) + 0.93 * np.cos(3.1 * time)

    def joint(gain: float) -> list[GateFinding]:
        columns: tuple[tuple[str, str, str, Role, np.ndarray], ...] = (
            ("q", "joint.position", "rad", "observed", angle),
            ("v", "joint.velocity", "rad/s", "observed", gain * rate),
            ("u", "joint.effort", "N m", "command", angle),
            ("tau", "joint.effort", "N m", "observed", gain * angle),
        )
        channels = tuple(
            Channel(name=name, quantity=quantity, target="arm", unit=unit, role=role, time=time, value=value)
            for name, quantity, unit, role, value in columns
        )
        return loud(Recording(name="scaled", channels=channels))

    assert {(finding.code, finding.severity, finding.channel) for finding in joint(1.05)} == {
        ("gain", "warning", "v"),
        ("gain", "warning", "tau"),
    }
    assert joint(1.02) == []


def test_rates_at_more_than_a_second():
    """Stamps 1.5 ms apart that were declared seconds: a lonely rate tells; ninety samples, or a lonely position, do not."""
    time = np.linspace(0.25, 598.75, 400)
    channel = Channel(name="v", quantity="joint.velocity", target="arm", unit="rad/s", time=time, value=np.sin(0.01 * time))
    (found,) = loud(Recording(name="slow", channels=(channel,)))
    assert (found.code, found.severity, found.channel, found.detail["unit"]) == ("time_unit", "error", "time", "ms")
    assert loud(Recording(name="short", channels=(replace(channel, time=time[:90], value=channel.value[:90]),))) == []
    assert loud(Recording(name="position", channels=(replace(channel, quantity="joint.position", unit="rad"),))) == []


def test_read_piece_by_piece_finds_the_same():
    """``load`` gives one channel at a time; a recording that is longer than what comparisons take is looked at where it moves."""
    whole = FAULTS["gyro turned"][0](machine(202, duration=200.0))
    bare = replace(whole, channels=tuple(replace(c, time=np.empty(0), value=np.empty(0)) for c in whole.channels))
    asked = []

    def load(recording: str, channel: str, span: tuple[float, float] | None) -> Channel:
        asked.append((recording, channel))
        return whole.channel(channel)

    told = []
    found = gate([bare], lambda what, done: told.append(done), load=load)
    assert found == gate([whole])
    assert [finding.code for finding in found[0] if finding.severity == "error"] == ["sign"]
    assert {channel for _, channel in asked} == {channel.name for channel in whole.channels}
    assert told == sorted(told)
    assert told[-1] == 1.0


def double_pendulum(data: Path, name: str, runs: str) -> list[Recording]:
    path = data / "data" / "recordings" / f"double_pendulum_{name}.parquet"
    if not path.is_file():
        pytest.skip(f"no {path}")
    table = parquet.read_table(path)
    run = np.array(table[runs].to_pylist())
    recordings = []
    for of in dict.fromkeys(run):
        rows = run == of
        channels = []
        for number, joint in (("1", "shoulder"), ("2", "elbow")):
            kinds: tuple[tuple[str, str, str, Role], ...] = (
                ("pos_meas", "joint.position", "rad", "observed"),
                ("vel_meas", "joint.velocity", "rad/s", "observed"),
                ("tau_con", "joint.effort", "N m", "command"),
                ("tau_meas", "joint.effort", "N m", "observed"),
            )
            for column, quantity, unit, role in kinds:
                time, value = (np.asarray(table[key].to_numpy(), float)[rows] for key in ("time", column + number))
                channels.append(
                    Channel(name=column + number, quantity=quantity, target=joint, unit=unit, role=role, time=time, value=value)
                )
        recordings.append(Recording(name=f"{name}/{of}", channels=tuple(channels)))
    return recordings


@pytest.mark.parametrize(("name", "runs"), [("acrobot_clean", "exp"), ("pendubot_clean", "exp"), ("sysid", "run")])
def test_double_pendulum(rille_data: Path, name: str, runs: str):
    """The makers' clean runs: no warning, and the torque of the first motor follows its command by the 6 to 8 ms that are known.

    The second motor, behind its belt, lags longer in slow changes; that is said, but 6 to 8 ms do not describe it.
    """
    found = gate(double_pendulum(rille_data, name, runs))
    assert not [finding.message for findings in found for finding in findings if finding.severity != "note"]
    delay = next(finding for finding in found[0] if finding.code == "delay" and finding.channel == "tau_con1")
    assert 6e-3 < float(str(delay.detail["delay"])) < 8e-3
    assert float(str(delay.detail["error"])) < 1e-3
    assert all(delay in findings for findings in found)  # pooled over the runs


def test_husky_heading_of_its_inertial_unit(rille_data: Path):
    """``imu_yaw`` is useless; lidar heading, wheel speeds and commands tell so together, without anybody having said it."""
    path = rille_data / "data" / "recordings" / "husky_drive_windows.npz"
    if not path.is_file():
        pytest.skip(f"no {path}")
    windows = np.load(path)
    time = np.linspace(0, 1.95, 40)
    columns: tuple[tuple[str, str, str, str, str, Role], ...] = (
        ("cmd_left", "joint.velocity", "", "front_left", "rad/s", "command"),
        ("cmd_right", "joint.velocity", "", "front_right", "rad/s", "command"),
        ("left_wheel_vel", "joint.velocity", "", "front_left", "rad/s", "observed"),
        ("right_wheel_vel", "joint.velocity", "", "front_right", "rad/s", "observed"),
        ("icp_x", "part.position", "x", "chassis", "m", "observed"),
        ("icp_y", "part.position", "y", "chassis", "m", "observed"),
        ("icp_yaw", "part.orientation", "yaw", "chassis", "rad", "observed"),
        ("imu_yaw", "part.orientation", "yaw", "chassis", "rad", "observed"),
    )
    recordings = [
        Recording(
            name=f"husky/{k}",
            channels=tuple(
                Channel(
                    name=name,
                    quantity=quantity,
                    component=part,
                    target=of,
                    unit=unit,
                    role=role,
                    time=time,
                    value=windows[name][k].astype(float),
                )
                for name, quantity, part, of, unit, role in columns
            ),
        )
        for k in range(len(windows["icp_x"]))
    ]
    found = gate(recordings)
    assert {(f.code, f.channel) for findings in found for f in findings if f.severity != "note"} == {("bad_channel", "imu_yaw")}
    assert all(findings for findings in found)


def test_where_a_coarse_channel_turns_round_it_is_not_cut_off():
    """A joint that turns slowly at the end of its swing says one rounded value four times, and nowhere else so often: no end of a range."""
    t = np.arange(0.0, 4.86, 0.01)
    value = 8.7e-4 * np.round(np.cos(1.1 * t) / 8.7e-4)
    made = Channel(name="angle", quantity="joint.position", unit="rad", target="a", clock="time", time=t[60:], value=value[60:])
    assert np.count_nonzero(made.value == made.value.min()) >= 4
    (report,) = gate([Recording(name="r", channels=(made,))])
    assert not [finding for finding in report if finding.code == "saturation"]


@pytest.mark.parametrize(("resolution", "found"), [(0.0, True), (0.05, False)], ids=["fine", "coarse"])
def test_one_short_top_is_enough_where_values_never_repeat(resolution: float, found: bool):
    """Four samples in a row at the very same, farthest value: no chance if all others differ, as usual if values are rounded to a step."""
    t = np.arange(0.0, 5.0, 0.01)
    rng = np.random.default_rng(4)
    value = (0.6 + 0.1 * t) * np.sin(7.0 * t) + 1e-3 * rng.standard_normal(len(t))
    peak = int(np.argmax(value))
    value = np.minimum(value, np.sort(value[peak - 4 : peak + 5])[-4])
    assert np.count_nonzero(value == value.max()) == 4
    if resolution:
        value = resolution * np.round(value / resolution)
    alone = Channel(name="rate", quantity="joint.velocity", unit="rad/s", target="a", clock="time", time=t, value=value)
    (report,) = gate([Recording(name="r", channels=(alone,))])
    assert [finding.detail["sure"] for finding in report if finding.code == "saturation"] == [True] * found


def test_a_channel_that_reaches_its_end_and_stays_is_cut_off():
    """It moves by far more from sample to sample than its noise, and stands still for most of the time: neither makes it a coarse one."""
    t = np.arange(0.0, 4.0, 0.04)
    rng = np.random.default_rng(2)
    value = np.minimum(0.3 * t + 2e-3 * rng.standard_normal(len(t)), 0.6247355)
    assert np.count_nonzero(value == value.max()) > 40
    made = Channel(name="x", quantity="part.position", component="x", unit="m", target="a", clock="time", time=t, value=value)
    (report,) = gate([Recording(name="r", channels=(made,))])
    assert [finding.detail["sure"] for finding in report if finding.code == "saturation"] == [True]
    coarse = replace(made, value=0.012 * np.round(value / 0.012))
    (report,) = gate([Recording(name="r", channels=(coarse,))])
    assert not [finding for finding in report if finding.code == "saturation"]
