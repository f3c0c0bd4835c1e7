"""Sheets of instruments: what they mean for a machine, and one sentence for each that cannot be meant."""

import math

import pytest

from machines import cart, free_arm
from rille.model import Drive, Effect, InputRefused, Joint, Rover, Sensor
from rille.recording.instruments import own_instruments, read_instruments


def read(tmp_path, text, rover=None):
    path = tmp_path / "sensors.toml"
    path.write_text(text)
    return read_instruments(path, rover or cart(5.0, 0.15, 0.165))


def slider():
    """A mass on a prismatic joint with a torque drive."""
    arm = free_arm()
    joints = (Joint(name="slide", kind="prismatic", parent="base", child="upper", point=(0, 0, 0), axis=(1, 0, 0)), arm.joints[1])
    return Rover(bodies=arm.bodies, joints=joints, drives=(Drive(name="motor", joint="slide", mode="torque", max_torque=3.0),))


def test_units_targets_and_columns(tmp_path):
    made = read(
        tmp_path,
        """
        name = "yard"
        [noise]
        seed = 9
        [[clock]]
        name = "fast"
        rate = "1 kHz"
        jitter = "20 us"
        skew = 2e-5
        [[sensor]]
        quantity = "joint.velocity"
        target = ["wheel_front_*", "wheel_rear_left"]
        clock = "fast"
        unit = "deg/s"
        noise = { white = "3 deg/s", coloured = { sigma = "4 deg/s", time_constant = "200 ms" }, drift = "1 deg/s/s^0.5" }
        saturation = ["-90 deg/s", "180 deg/s"]
        [[sensor]]
        name = "where"
        quantity = "part.position"
        target = "chassis"
        components = ["x", "z"]
        rate = 20
        [[sensor]]
        quantity = "part.orientation"
        target = "chassis"
        rate = "20 Hz"
        delay = "40 ms"
        [[command]]
        drive = "wheel_rear_*"
        delay = "7 ms"
        """,
    )
    assert (made.name, made.seed) == ("yard", 9)
    assert [sensor.columns for sensor in made.sensors] == [
        ("wheel_front_left_velocity",),
        ("wheel_front_right_velocity",),
        ("wheel_rear_left_velocity",),
        ("where_x", "where_z"),
        ("chassis_roll", "chassis_pitch", "chassis_yaw"),
    ]
    speed, where, attitude = made.sensors[0], made.sensors[3], made.sensors[4]
    degree = math.pi / 180
    assert (speed.unit, speed.written_unit, speed.factor) == ("rad/s", "deg/s", pytest.approx(degree))
    assert (speed.white, speed.drift) == (pytest.approx(3 * degree), pytest.approx(degree))
    assert speed.coloured == (pytest.approx(4 * degree), pytest.approx(0.2))
    assert speed.noise == pytest.approx(5 * degree)  # 3 and 4 together
    assert (speed.lower, speed.upper) == (pytest.approx(-math.pi / 2), pytest.approx(math.pi))
    assert (where.unit, attitude.unit) == ("m", "rad")
    assert where.clock == attitude.clock == "20hz"  # the same plain rate is the same clock
    assert {name: clock.rate for name, clock in made.clocks.items()} == {"fast": 1000.0, "20hz": 20.0}
    assert [(log.column, log.quantity, log.target, log.delay) for log in made.commands] == [
        ("wheel_rear_left_command", "joint.velocity", "wheel_rear_left", pytest.approx(0.007)),
        ("wheel_rear_right_command", "joint.velocity", "wheel_rear_right", pytest.approx(0.007)),
    ]


def test_a_prismatic_joint_is_measured_in_metres(tmp_path):
    made = read(
        tmp_path,
        '[[sensor]]\nquantity = "joint.position"\ntarget = "slide"\nrate = 10\nnoise = "1 mm"\n'
        '[[sensor]]\nquantity = "joint.effort"\ntarget = "slide"\nrate = 10\n'
        '[[command]]\nrate = "50 Hz"\n',
        slider(),
    )
    assert [(sensor.unit, sensor.white) for sensor in made.sensors] == [("m", 0.001), ("N", 0.0)]
    assert [(log.quantity, log.target, log.unit, log.clock) for log in made.commands] == [("joint.effort", "slide", "N", "50hz")]


def test_the_models_own_sensors_with_their_faults():
    sensors = (
        Sensor(name="encoder", quantity="joint.position", target="wheel_front_left", rate=50.0),
        Sensor(name="attitude", quantity="part.orientation", target="chassis", rate=10.0),
    )
    effects = (
        Effect(kind="wrong_sign", target="encoder", parameters={"flip": 1.0}),
        Effect(kind="delay", target="*", parameters={"delay": 0.02}),
        Effect(kind="dropout", target="attitude", parameters={"fraction": 0.1}),
    )
    made = own_instruments(sensors, effects, cart(5.0, 0.15, 0.165))
    encoder, attitude = made.sensors
    assert (encoder.scale, encoder.delay, attitude.delay) == (-1.0, 0.02, 0.02)
    assert attitude.columns == ("attitude_w", "attitude_x", "attitude_y", "attitude_z")
    assert attitude.dropout is not None
    assert attitude.dropout.fraction == pytest.approx(0.1)
    assert len(made.commands) == 4
    with pytest.raises(InputRefused, match="no sensors of its own"):
        own_instruments((), (), cart(5.0, 0.15, 0.165))


SPEED = '[[sensor]]\nquantity = "joint.velocity"\ntarget = "wheel_front_left"\nrate = 50\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["neither", "[[sensor]]"]),
        ('[[sensor]]\nquantity = "joint.speed"\ntarget = "wheel_*"\nrate = 50', ["joint.speed", "joint."]),
        (SPEED.replace("wheel_front_left", "weel_front_left"), ["weel_front_left", "did you mean 'wheel_front_left'"]),
        (SPEED.replace("rate = 50", ""), ["neither rate nor clock"]),
        (SPEED.replace("50", "-50"), ["rate", "-50", "above 0"]),
        (SPEED + 'clock = "imu"', ["'imu'", "there are none"]),
        (SPEED + 'noise = "1 mm"', ["noise", "1 mm"]),
        (SPEED + 'noise = "-1 rad/s"', ["noise", "not be negative"]),
        (SPEED + 'noise = { wite = "1 rad/s" }', ["wite"]),
        (SPEED + 'components = ["x"]', ["'x'", "one number"]),
        (SPEED + "dropout = { fraction = 1.0 }", ["fraction"]),
        (SPEED + 'saturation = ["2 rad/s", "1 rad/s"]', ["saturation", "lower"]),
        (SPEED + 'stuck = [["3 s", "2 s"]]', ["stuck", "begin and end"]),
        (SPEED + 'unit = "m/s"', ["unit", "m/s"]),
        (SPEED + SPEED, ["two channels 'wheel_front_left_velocity'", "name ="]),
        ('[[sensor]]\nquantity = "part.position"\ntarget = "chassis"\nrate = 5\nframe = "body"', ["always the same"]),
        ('[[sensor]]\nquantity = "part.orientation"\ntarget = "chassis"\nrate = 5\ncomponents = ["w", "yaw"]', ["mixes angles"]),
        ('[[sensor]]\nquantity = "part.position"\ntarget = "chassis"\nrate = 5\ncomponents = ["q"]', ["'q'", "x, y, z"]),
        ('[[command]]\ndrive = "motor_*"', ["motor_*"]),
        ('[[clock]]\nname = "a"\nrate = 5\n[[clock]]\nname = "a"\nrate = 6\n' + SPEED, ["two clocks 'a'"]),
        ("[[clock]]\nrate = 5\n" + SPEED, ["without a name"]),
        (SPEED.replace("rate = 50", "clock = { rate = 50, skew = 0.9 }"), ["skew", "0.9"]),
        ("[[sensor]\n", ["not valid TOML"]),
    ],
)
def test_what_cannot_be_meant_is_refused_in_a_sentence(tmp_path, text, words):
    with pytest.raises(InputRefused) as refusal:
        read(tmp_path, text)
    for word in words:
        assert word in str(refusal.value)
    assert "\n" not in str(refusal.value)
