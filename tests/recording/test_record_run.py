"""A recorded run is the run that `rille run` stores, seen through its instruments; the files import again."""

import json
import signal
import subprocess
import time
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from command import RILLE, assert_refused, rille
from effect_rigs import flywheel, free_space
from machines import cart, free_arm, plane
from rille import store
from rille.cli.record_run import run as record_run
from rille.cli.record_run import simulated_recording
from rille.model import Command, Effect, InitialJointState, InputRefused, Pose, Scenario, Sensor, Watch
from rille.recording.instruments import read_instruments
from rille.simulate import run
from rille.simulate.recorder import Wanted, record


def drive(**more):
    """Three seconds on soft soil: off, faster on one side (the cart turns), slower."""
    commands = [Command(drive=d.name, time=0.0, value=1.0) for d in cart(5.0, 0.15, 0.165).drives]
    commands += [Command(drive=f"wheel_{end}_left", time=1.0, value=2.0) for end in ("front", "rear")]
    commands += [Command(drive="wheel_rear_left", time=2.0123, value=0.5)]
    fields = {
        "name": "go",
        "duration": 3.0,
        "gravity": (0, 0, -1.625),
        "terrain": "plane",
        "placement": "on_terrain",
        "settle_time": 2.0,
        "output_interval": 0.05,
        "start": Pose(rotation=(float(np.cos(0.3)), 0, 0, float(np.sin(0.3)))),
        "commands": tuple(commands),
    }
    return Scenario(**{**fields, **more})


@pytest.fixture
def model(make_model):
    """Database with the cart on a slope across its way."""
    return make_model(cart(5.0, 0.15, 0.165), drive(), plane(0.05, 0.1))


def sheet(tmp_path, text):
    """Instruments for the cart."""
    path = tmp_path / "sensors.toml"
    path.write_text(text)
    return read_instruments(path, cart(5.0, 0.15, 0.165))


CLEAN = """
[[sensor]]
quantity = "part.position"
target = "chassis"
rate = "50 Hz"
[[sensor]]
quantity = "part.orientation"
target = "chassis"
components = ["w", "x", "y", "z"]
rate = "50 Hz"
[[sensor]]
quantity = "part.angular_velocity"
target = "chassis"
rate = "50 Hz"
frame = "body"
[[sensor]]
quantity = "joint.velocity"
target = "wheel_*"
rate = "50 Hz"
[[sensor]]
quantity = "wheel.slip_ratio"
target = "wheel_front_left"
rate = "50 Hz"
[[command]]
"""


def test_the_states_are_bit_by_bit_those_of_a_run(model, tmp_path):
    done = run(model)
    trace = store.read_trace(model, done.run_id)
    times = trace.time
    body, joint, wheel = trace.bodies[0], trace.joints[2], trace.wheels[1]
    wanted = [
        Wanted(quantity="part.position", target="chassis", components=("x", "y", "z"), frame="world", times=times),
        Wanted(quantity="part.linear_velocity", target="chassis", components=("z",), frame="world", times=times),
        *(
            Wanted(quantity=f"joint.{q}", target=joint.name, components=(), frame="world", times=times)
            for q in ("position", "velocity", "effort")
        ),
        *(
            Wanted(quantity=f"wheel.{q}", target=wheel.name, components=(), frame="world", times=times)
            for q in ("sinkage", "drawbar_pull", "slip_ratio")
        ),
    ]
    taken = record(model, store.read_scenario(model), store.read_rover(model), wanted)
    assert taken.status == "done"
    assert taken.reached == pytest.approx(3.0)
    expected = (
        body.position,
        body.velocity[:, 2:],
        joint.position,
        joint.velocity,
        joint.effort,
        wheel.sinkage,
        wheel.drawbar_pull,
        wheel.slip_ratio,
    )
    for want, value, true in zip(wanted, taken.values, expected, strict=True):
        np.testing.assert_array_equal(value, true.reshape(len(times), -1), err_msg=want.quantity)


def test_what_is_read_between_steps_lies_between_them(model):
    """Against the same run with half the distance of instants: linear within a step, held for efforts."""
    fine = np.arange(0, 2.0, 0.00025)
    wanted = [
        Wanted(quantity=q, target=t, components=c, frame="world", times=fine)
        for q, t, c in (("part.position", "chassis", ("x",)), ("joint.effort", "wheel_rear_left", ()))
    ]
    position, effort = (value[:, 0] for value in record(model, store.read_scenario(model), store.read_rover(model), wanted).values)
    assert np.abs(np.diff(position[::4]).repeat(4)[: len(position) - 8] / 4 - np.diff(position)[: len(position) - 8]).max() < 1e-12
    for k in range(4):  # an instant within a step sees the effort of that step: that read where the step ends
        np.testing.assert_array_equal(effort[1 + k : -4 : 4], effort[4::4][: len(effort[1 + k : -4 : 4])])


def test_own_sensors_say_what_the_solver_lets_them_say(make_model):
    """Delay, gain, bias, drift, range and skew of the model's effects, against the samples that `rille run` stores."""
    sensors = (
        Sensor(name="encoder", quantity="joint.position", target="wheel_front_left", rate=40.0),
        Sensor(name="imu", quantity="part.linear_acceleration", target="chassis", rate=100.0, frame="body"),
        Sensor(name="attitude", quantity="part.orientation", target="chassis", rate=20.0),
    )
    faults = (
        Effect(kind="delay", target="encoder", parameters={"delay": 0.0373}),
        Effect(kind="scale", target="encoder", parameters={"relative_error": 0.03}),
        Effect(kind="bias", target="imu", parameters={"offset": 0.2}),
        Effect(kind="drift", target="imu", parameters={"rate": 0.01}),
        Effect(kind="saturation", target="imu", parameters={"inverse_range": 1 / 1.7}),
        Effect(kind="clock_skew", target="attitude", parameters={"skew": 1e-3}),
    )
    rover = replace(cart(5.0, 0.15, 0.165), sensors=sensors)
    path = make_model(rover, drive(), plane(0.05, 0.1), faults)
    from rille.recording.instruments import own_instruments

    made, _ = simulated_recording(path, own_instruments(sensors, store.read_effects(path), rover))
    samples = store.read_samples(path, run(path).run_id)
    for sensor in sensors:
        channels = [channel for channel in made.channels if channel.name.startswith(sensor.name)]
        times, values = samples[sensor.name]
        there = np.isin(np.round(times, 9), np.round(channels[0].time, 9)) & (times > 0)  # at 0 s an accelerometer knows no change yet
        ours = np.isin(np.round(channels[0].time, 9), np.round(times[there], 9))
        assert there.sum() > 0.9 * len(times)
        # the solver saturates before it adds the drift, one of the orders in which faults can follow each other
        some = slice(None) if sensor.name != "imu" else (np.abs(values[there]) < 1.6).all(axis=1)
        said = np.column_stack([channel.value[ours] for channel in channels])
        np.testing.assert_allclose(said[some], values[there][some], atol=1e-12, err_msg=sensor.name)


def test_faults_of_all_sensors_and_of_one_come_together(make_model):
    """As in the solver: offsets add, gains multiply, the narrower range holds."""
    from rille.recording.instruments import own_instruments

    sensor = Sensor(name="encoder", quantity="joint.position", target="wheel_front_left", rate=40.0)
    faults = [
        Effect(kind=kind, target=target, parameters={name: value})
        for kind, name, values in (
            ("bias", "offset", (1.0, 0.5)),
            ("scale", "relative_error", (0.1, 0.2)),
            ("delay", "delay", (0.02, 0.03)),
            ("saturation", "inverse_range", (0.1, 0.05)),
        )
        for target, value in zip(("*", "encoder"), values, strict=True)
    ]
    (made,) = own_instruments([sensor], faults, cart(5.0, 0.15, 0.165)).sensors
    assert (made.bias, made.scale, made.delay, made.upper) == pytest.approx((1.5, 1.32, 0.05, 10.0))


def test_a_position_drive_is_recorded_where_it_holds(make_model):
    """Without a command it stays where it was, and is not asked to go to 0."""
    scenario = free_space(
        duration=1.0,
        initial_states=(InitialJointState(joint="hub", position=0.5),),
        commands=(Command(drive="motor", time=0.6, value=0.8),),
    )
    rover = flywheel(2.0, "position", position_gain=10.0)
    wanted = Wanted(quantity="joint.position", target="hub", components=(), frame="world", times=np.array([0.0, 0.3, 0.59]))
    taken = record(make_model(rover, scenario), scenario, rover, [wanted])
    assert taken.values[0][:, 0] == pytest.approx(0.5, abs=1e-12)
    times, values = taken.commands["motor"]
    assert (times.tolist(), values.tolist()) == ([0.0, 0.6], [0.5, 0.8])


NOISY = """
[noise]
seed = 5
[[sensor]]
name = "speed"
quantity = "joint.velocity"
target = "wheel_front_left"
rate = "400 Hz"
noise = "0.02 rad/s"
bias = "0.1 rad/s"
delay = "7 ms"
[[sensor]]
name = "angle"
quantity = "joint.position"
target = "wheel_front_left"
clock = { rate = "100 Hz", jitter = "2 ms", offset = "0.5 s", skew = 1e-3, gaps = { fraction = 0.1, mean_length = "0.1 s" } }
resolution = "0.5 deg"
saturation = "2 rad"
unit = "deg"
[[sensor]]
name = "yaw"
quantity = "part.orientation"
component = "yaw"
target = "chassis"
rate = "50 Hz"
dropout = { fraction = 0.2 }
stuck = [["1 s", "1.5 s"]]
[[command]]
delay = "30 ms"
"""


def test_the_chain_of_distortions(model, tmp_path):
    instruments = sheet(tmp_path, NOISY)
    made, taken = simulated_recording(model, instruments)
    dense = np.arange(0, 3.0005, 0.001)
    names = (
        ("joint.velocity", "wheel_front_left", ()),
        ("joint.position", "wheel_front_left", ()),
        ("part.orientation", "chassis", ("yaw",)),
    )
    wanted = [Wanted(quantity=q, target=t, components=c, frame="world", times=dense) for q, t, c in names]
    velocity, position, heading = (v[:, 0] for v in record(model, store.read_scenario(model), store.read_rover(model), wanted).values)

    speed = made.channel("speed")
    assert speed.time[0] == pytest.approx(0.0075)  # the first sample that is not older than the run
    residual = speed.value - np.interp(speed.time - 0.007, dense, velocity) - 0.1
    n = len(residual)
    assert abs(residual.std() / 0.02 - 1) < 4 / np.sqrt(2 * n)
    assert abs(residual.mean()) < 4 * 0.02 / np.sqrt(n)
    assert abs(np.mean(residual[1:] * residual[:-1])) < 4 * 0.02**2 / np.sqrt(n)
    assert (speed.noise, speed.delay) == (pytest.approx(0.02), pytest.approx(0.007))

    angle = made.channel("angle")
    instants = (angle.time - 0.5) / 1.001
    assert 0.05 < 1 - len(angle.time) / 301 < 0.2  # gaps of 0.1 s in 3 s: 30 of them would be needed to say more
    assert np.std(instants * 100 - np.round(instants * 100)) == pytest.approx(0.2, abs=0.04)  # 2 ms of 10 ms, 270 samples
    step = np.radians(0.5)
    true = np.interp(instants, dense, position)
    assert np.abs(angle.value - np.clip(true, -2, 2)).max() <= step / 2 + 1e-9
    np.testing.assert_allclose(angle.value / step, np.round(angle.value / step), atol=1e-9)
    assert true.max() > 2.1

    yaw = made.channel("yaw")
    lost = np.isnan(yaw.value)
    assert abs(lost.mean() - 0.2) < 4 * np.sqrt(0.16 / len(lost))
    inside = (yaw.time >= 1.0) & (yaw.time < 1.5)
    kept = ~lost & ~inside
    np.testing.assert_allclose(yaw.value[kept], np.interp(yaw.time[kept], dense, heading), atol=1e-9)
    assert len(np.unique(yaw.value[inside & ~lost])) == 1

    command = made.channel("wheel_rear_left_command")
    assert command.role == "command"
    np.testing.assert_allclose(command.time, [0, 0.97, 1.9823, 2.97])  # 30 ms before they act; the last row says until when
    np.testing.assert_array_equal(command.value, [1.0, 2.0, 0.5, 0.5])
    assert taken.status == "done"


def test_the_same_seed_gives_the_same_recording_and_channels_do_not_share_random_numbers(model, tmp_path):
    first, _ = simulated_recording(model, sheet(tmp_path, NOISY))
    again, _ = simulated_recording(model, sheet(tmp_path, NOISY))
    more, _ = simulated_recording(
        model,
        sheet(
            tmp_path,
            '[[sensor]]\nquantity = "part.position"\ntarget = "chassis"\nrate = "10 Hz"\n'
            + NOISY.replace("[noise]\nseed = 5", "")
            + "[noise]\nseed = 5\n",
        ),
    )
    other, _ = simulated_recording(model, replace(sheet(tmp_path, NOISY), seed=6))
    for one, two, three in zip(first.channels, again.channels, more.channels[3:], strict=True):
        np.testing.assert_array_equal(one.value, two.value)
        np.testing.assert_array_equal(one.time, two.time)
        np.testing.assert_array_equal(one.value, three.value)
    assert (first.channel("speed").value - other.channel("speed").value).std() > 0.02  # sqrt(2) times 0.02


def test_commands_of_watches_are_logged(make_model, tmp_path):
    """Past 0.5 rad a watch stops one wheel; the log says when, and what was commanded before."""
    watch = Watch(
        name="far", action="command", quantity="joint.position", target="wheel_front_left", above=0.5, drive="wheel_front_left", value=0.0
    )
    path = make_model(cart(5.0, 0.15, 0.165), drive(watches=(watch,), commands=drive().commands[:4]), plane())
    made, _ = simulated_recording(path, sheet(tmp_path, CLEAN))
    log = made.channel("wheel_front_left_command")
    assert log.value.tolist() == [1.0, 0.0, 0.0]
    assert log.time[1] == pytest.approx(0.5, abs=0.01)  # 0.5 rad at 1 rad/s
    speed = made.channel("wheel_front_left_velocity")
    assert np.abs(speed.value[speed.time > log.time[1] + 0.02]).max() < 1e-3


def test_body_axes_and_accelerations(make_model, tmp_path):
    """Of a tumbling arm: rates in the body's axes against the derivative of the quaternion, specific force against that of the velocity."""
    scenario = Scenario(name="tumble", duration=3.0, gravity=(0, 0, -1.625), start_angular_velocity=(1.0, -2.0, 0.7))
    path = make_model(free_arm(), scenario)
    text = ""
    for quantity, frame in (
        ("orientation", "world"),
        ("angular_velocity", "body"),
        ("linear_velocity", "world"),
        ("linear_acceleration", "world"),
    ):
        text += f'[[sensor]]\nquantity = "part.{quantity}"\ntarget = "base"\nrate = "1 kHz"\nframe = "{frame}"\n'
    text = text.replace('"base"', '"base"\ncomponents = ["w", "x", "y", "z"]', 1)
    text += '[[sensor]]\nname = "felt"\nquantity = "part.linear_acceleration"\ntarget = "base"\nrate = "1 kHz"\nframe = "body"\n'
    (tmp_path / "sensors.toml").write_text(text)
    made, _ = simulated_recording(path, read_instruments(tmp_path / "sensors.toml", free_arm()))

    def columns(stem, parts="xyz"):
        return np.column_stack([made.channel(f"{stem}_{part}").value for part in parts])

    q = columns("base_orientation", "wxyz")
    q *= np.cumprod(np.sign(np.sum(q * np.vstack([q[:1], q[:-1]]), axis=1)))[:, None]  # q and -q are one orientation
    w, u = q[:, 0], q[:, 1:]
    dw, du = np.gradient(w, 0.001), np.gradient(u, 0.001, axis=0)
    rate = 2 * (w[:, None] * du - dw[:, None] * u - np.cross(u, du))  # 2 q* dq/dt
    measured = columns("base_angular_velocity")
    assert np.abs(measured).max() > 1
    assert np.abs(rate - measured)[1:-1].max() < 1e-4  # h^2/6 |d3q/dt3|: 2e-7 times the cube of a few rad/s
    acceleration, velocity, felt = columns("base_linear_acceleration"), columns("base_linear_velocity"), columns("felt")
    np.testing.assert_allclose(
        acceleration[1:], np.diff(velocity, axis=0) / 0.001 + [0, 0, 1.625], atol=1e-9
    )  # across chunks of steps, too
    np.testing.assert_array_equal(acceleration[0], acceleration[1])
    turned = felt + 2 * np.cross(u, np.cross(u, felt) + w[:, None] * felt)  # from the body's axes to those of the world
    np.testing.assert_allclose(turned, acceleration, atol=1e-9)


def test_a_run_that_ends_early_is_recorded_until_there(make_model, tmp_path):
    path = make_model(cart(5.0, 0.15, 0.165), drive(start=Pose(position=(11.0, 0, 0)), duration=30.0), plane())
    made, taken = simulated_recording(path, sheet(tmp_path, CLEAN))
    assert taken.status == "left_terrain"
    assert 0.5 < taken.reached < 29
    for channel in made.channels:
        assert channel.time[-1] <= taken.reached + 1e-9
        assert np.isfinite(channel.value).all()
    done = rille("record", path, "--sensors", tmp_path / "sensors.toml", "-o", tmp_path / "short.csv")
    assert done.returncode == 4
    assert (tmp_path / "short.csv").is_file()


def test_an_interrupted_recording_keeps_what_was_simulated(model, tmp_path):
    def stop(time, total):
        raise KeyboardInterrupt

    made, taken = simulated_recording(model, sheet(tmp_path, CLEAN), on_progress=stop)
    assert (taken.status, taken.reached) == ("interrupted", pytest.approx(2.048))
    assert made.channel("chassis_position_x").time[-1] == pytest.approx(2.04)
    store.write_scenario(model, drive(name="long", duration=20000.0, commands=()))  # stands still for hours
    command = [
        RILLE,
        "record",
        str(model),
        "--sensors",
        str(tmp_path / "sensors.toml"),
        "--scenario",
        "long",
        "-o",
        str(tmp_path / "long.parquet"),
    ]
    for patience in (5, 20, 60):  # [s]: on a busy machine it has not begun to simulate by then
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            time.sleep(patience)
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=60)
        if (tmp_path / "long.toml").exists():
            break
    assert process.returncode == 130, said
    assert "interrupted" in said
    assert tomllib.loads((tmp_path / "long.toml").read_text())["scenario"] == "long"


def test_faults_that_the_sheet_asks_for_are_no_errors_of_the_recording(model, tmp_path):
    """Saturated and stuck channels are accepted by the manifest that comes with them, unless they are hidden."""
    (tmp_path / "sensors.toml").write_text(NOISY.replace(', offset = "0.5 s"', ""))
    told = rille("record", model, "--sensors", tmp_path / "sensors.toml", "-o", tmp_path / "drive.csv")
    assert told.returncode == 0, told.stderr
    accepted = {c["column"]: c["accepted"] for c in tomllib.loads((tmp_path / "drive.toml").read_text())["channel"] if "accepted" in c}
    assert sorted(set(map(tuple, accepted.values()))) == [("saturation", "stuck"), ("stuck",)]
    done = rille("import", tmp_path / "drive.toml", "-o", model)
    assert done.returncode == 0, done.stderr
    hidden = rille("record", model, "--sensors", tmp_path / "sensors.toml", "-o", tmp_path / "d.csv", "--hide", "stuck,saturation")
    assert hidden.returncode == 0, hidden.stderr
    assert not any("accepted" in channel for channel in tomllib.loads((tmp_path / "d.toml").read_text())["channel"])


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".mcap", ".bag", ""])
def test_every_format_imports_again(model, tmp_path, ending):
    text = NOISY.replace(', offset = "0.5 s"', "").replace('saturation = "2 rad"\n', "").replace('stuck = [["1 s", "1.5 s"]]\n', "")
    (tmp_path / "sensors.toml").write_text(text)
    file = tmp_path / f"drive{ending}"
    done = rille("record", model, "--sensors", tmp_path / "sensors.toml", "-o", file, "--json")
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert (facts["status"], len(facts["channels"])) == ("done", 7)
    made, _ = simulated_recording(model, sheet(tmp_path, text), name="drive")
    done = rille("import", facts["manifest"], "-o", model)
    assert done.returncode == 0, done.stderr
    stored = store.read_recording(model, "drive")
    assert stored.scenario == "go"
    for channel in made.channels:
        again = stored.channel(channel.name)
        for field in ("quantity", "component", "target", "unit", "role", "frame", "noise", "delay", "resolution"):
            assert getattr(again, field) == pytest.approx(getattr(channel, field)), (channel.name, field)
        messages = ending not in (".csv", ".parquet")
        sent = np.isfinite(channel.value) if messages else np.ones(len(channel.value), dtype=bool)
        # messages carry stamps of whole nanoseconds, tables the very same bits; degrees are rounded on the way
        np.testing.assert_allclose(again.time, channel.time[sent], rtol=0, atol=0.6e-9 if messages else 0)
        np.testing.assert_allclose(again.value, channel.value[sent], rtol=4e-16 if channel.name == "angle" else 0, atol=0)


def test_what_is_hidden_stands_only_in_the_truth(model, tmp_path):
    (tmp_path / "sensors.toml").write_text(NOISY)
    arguments = ("record", model, "--sensors", tmp_path / "sensors.toml", "-o", tmp_path / "d.csv")
    assert rille(*arguments, "--hide", "all", "--truth", tmp_path / "truth.json").returncode == 0
    told = tomllib.loads((tmp_path / "d.toml").read_text())
    assert "scenario" not in told
    assert "accepted" not in told
    for channel in told["channel"]:
        assert not {"noise", "delay", "resolution", "missing"} & set(channel)
    truth = json.loads((tmp_path / "truth.json").read_text())
    assert truth["instruments"]["sensors"][0]["delay"] == pytest.approx(0.007)
    assert truth["instruments"]["seed"] == 5
    assert_refused(rille(*arguments), "d.csv", "--force")
    assert rille(*arguments, "--force", "--hide", "noise").returncode == 0
    told = tomllib.loads((tmp_path / "d.toml").read_text())
    assert told["scenario"] == "go"
    assert "delay" in told["channel"][0]
    assert "noise" not in told["channel"][0]


def test_refusals_of_the_command(model, tmp_path):
    (tmp_path / "sensors.toml").write_text(CLEAN)
    out = tmp_path / "d.csv"
    for arguments, words in (
        ({"sensors": None}, ("no sensors", "--sensors")),
        ({"sensors": tmp_path / "none.toml"}, ("none.toml",)),
        ({"output": tmp_path / "d.xlsx"}, (".xlsx", ".csv")),
        ({"output": tmp_path / "nowhere" / "d.csv"}, ("nowhere", "create")),
        ({"output": tmp_path, "manifest": tmp_path / "m.toml"}, ("exists already",)),
        ({"output": tmp_path, "manifest": tmp_path / "m.toml", "force": True}, ("no ROS 2 bag",)),
        ({"hide": "nois"}, ("nois", "did you mean 'noise'")),
        ({"scenario": "gone"}, ("gone", "go")),
        ({"duration": 1e9}, ("samples", "rates")),
        ({"duration": float("nan")}, ("nan",)),
        ({"step": 0.5}, ("step",)),
        ({"database": tmp_path / "absent.db"}, ("absent.db",)),
        ({"truth": out}, ("twice",)),
        ({"output": tmp_path / "sensors.csv", "force": True}, ("sensors.toml", "overwritten")),
    ):
        with pytest.raises(InputRefused) as refusal:
            record_run(**{"database": model, "sensors": tmp_path / "sensors.toml", "output": out, **arguments})
        for word in words:
            assert word in str(refusal.value)
    assert_refused(rille("record", model, "--sensors", tmp_path / "sensors.toml", "-o", out, "--hide", "x"), "'x'", "hidden")
    assert not out.exists()


def test_a_file_in_place_of_a_verb_means_run():
    assert rille("record", "run", "--help").stdout == rille("record", "model.db", "--help").stdout
    done = rille("record", "runn")
    assert done.returncode == 2
    assert "runn" in done.stderr


def test_the_example_sheet_reads_the_example_rover(repository, tmp_path):
    """Its channels, and that they are what the README of the example says of them."""
    path = tmp_path / "rover.db"
    assert rille("cad", "build", repository / "examples/rover/rover.toml", "-o", path).returncode == 0
    instruments = read_instruments(repository / "examples/recording/sensors.toml", store.read_rover(path))
    assert sum(len(sensor.columns) for sensor in instruments.sensors) == 34
    assert len(instruments.commands) == 10
    assert set(instruments.clocks) == {"localisation", "100hz", "50hz"}
    store.write_scenario(path, Scenario(name="fall", duration=0.5, gravity=(0, 0, -1.625)))
    made, taken = simulated_recording(path, instruments)
    assert taken.status == "done"
    felt = made.channel("accelerometer_z")
    assert np.abs(felt.value).max() < 5 * 0.0207  # nothing is felt in free fall
