"""Real machines from their drawings to a comparison with what was recorded: the double pendulum, dropped balls, the Husky."""

import json
import runpy
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rille._solver import Simulation
from scipy.integrate import solve_ivp

from rille.cad import build
from rille.model import Command, InitialJointState, Scenario
from rille.simulate.scenario_file import read_scenario_file

GRAVITY = 9.81  # [m/s^2] of the makers' parameters


def makers_acceleration(p, q, v, torque):
    """The makers' equation of motion (make_identified.py writes it out), dry friction cf pi/2 smoothed over 1 mrad/s. Returns (2,)."""
    coupling = p["m2"] * p["l1"] * p["r2"]
    m11 = p["I1"] + p["I2"] + p["m2"] * p["l1"] ** 2 + 2 * coupling * np.cos(q[1]) + (p["gr"] ** 2 + 1) * p["Ir"]
    m12 = p["I2"] + coupling * np.cos(q[1]) - p["gr"] * p["Ir"]
    m22 = p["I2"] + p["gr"] ** 2 * p["Ir"]
    bend = coupling * np.sin(q[1])
    centrifugal = np.array([-bend * (2 * v[0] + v[1]) * v[1], bend * v[0] ** 2])
    lower = p["m2"] * p["r2"] * np.sin(q[0] + q[1])
    gravity = GRAVITY * np.array([(p["m1"] * p["r1"] + p["m2"] * p["l1"]) * np.sin(q[0]) + lower, lower])
    friction = [p[f"b{k}"] * v[k - 1] + p[f"cf{k}"] * np.pi / 2 * np.tanh(v[k - 1] / 1e-3) for k in (1, 2)]
    return np.linalg.solve([[m11, m12], [m12, m22]], torque - centrifugal - gravity - friction)


@pytest.fixture(scope="module")
def pendulum(repository, rille_data):
    """The identified double pendulum, and the makers' parameters."""
    folder = repository / "examples/double_pendulum"
    return build(folder / "identified.toml"), runpy.run_path(str(folder / "make_identified.py"))["identified"]()


def test_the_sheet_is_what_its_script_writes(repository, rille_data):
    folder = repository / "examples/double_pendulum"
    script = runpy.run_path(str(folder / "make_identified.py"))
    written = script["sheet"]((folder / "pendulum.toml").read_text(encoding="utf-8"), script["identified"]())
    assert written == (folder / "identified.toml").read_text(encoding="utf-8")


def test_the_identified_pendulum_moves_by_its_makers_equation(make_model, pendulum):
    """Released and driven for 0.5 s at up to 7 rad/s. Rotors, masses and friction go another way here (bodies, gears, rows): what is left
    is the step's error, which halves with it, 3e-4 rad at 0.25 ms."""
    rover, p = pendulum
    start, torque = np.array([1.5, -0.8]), np.array([0.6, -0.4])
    exact = solve_ivp(
        lambda _, y: np.r_[y[2:], makers_acceleration(p, y[:2], y[2:], torque)],
        (0, 0.5),
        np.r_[start, 0, 0],
        method="Radau",
        rtol=1e-9,
        atol=1e-10,
    ).y[:, -1]
    gears = {g.joint_b: (g.joint_a, g.ratio) for g in rover.gears}
    places = dict(zip(("shoulder", "elbow"), start, strict=True))
    places |= {rotor: ratio * places[joint] for rotor, (joint, ratio) in gears.items()}
    scenario = Scenario(
        name="driven",
        duration=1,
        gravity=(0, 0, -GRAVITY),
        initial_states=tuple(InitialJointState(joint=joint, position=float(place)) for joint, place in places.items()),
        commands=tuple(
            Command(drive=drive, time=0.0, value=float(value)) for drive, value in zip(("shoulder", "elbow"), torque, strict=True)
        ),
    )
    errors = []
    for step in (0.5e-3, 0.25e-3):
        simulation = Simulation(str(make_model(rover, replace(scenario, step=step), effects=rover.effects)))
        simulation.step(round(0.5 / step))
        joints = simulation.joints()[[simulation.joint_names.index(name) for name in ("shoulder", "elbow")]]
        errors.append(np.abs(joints[:, 0] - exact[:2]).max())
    assert errors[1] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.2)


def test_a_ball_falls_freely(make_model, repository):
    """z = z_0 - g t^2/2. Semi-implicit Euler or better: within g t h/2 = 15 mm of 44 m."""
    folder = repository / "examples/ball_drops"
    ball = build(folder / "ball.toml")
    simulation = Simulation(str(make_model(ball, read_scenario_file(folder / "fall.toml", ball))))
    simulation.step(3000)
    assert simulation.bodies()[0, 2] == pytest.approx(48 - 9.80665 * 9 / 2, abs=0.015)


def rille(*arguments):
    """Run the command; return what it prints, read as JSON."""
    command = [str(Path(sys.executable).parent / "rille"), *map(str, arguments), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def findings_of(imported, code, channel):
    """What the gate said about a channel: the finding, or None, of each recording."""
    return [
        next((f for f in recording["findings"] if (f["code"], f["channel"]) == (code, channel)), None)
        for recording in imported["recordings"]
    ]


@pytest.fixture(scope="module")
def acrobot(repository, rille_data, tmp_path_factory):
    """The identified pendulum with its ten acrobot runs; what the import said."""
    database = tmp_path_factory.mktemp("pendulum") / "pendulum.db"
    rille("cad", "build", repository / "examples/double_pendulum/identified.toml", "-o", database)
    return database, rille("import", repository / "examples/double_pendulum/acrobot.toml", "-o", database)


def test_the_gate_finds_the_delay_of_the_motors(acrobot):
    """6 to 8 ms from command to torque are known of this machine; samples lie 2 ms apart, and the error stated is below one of them."""
    found = findings_of(acrobot[1], "delay", "tau_con1")
    assert len(found) == 10
    assert all(f is not None and 6e-3 < f["detail"]["delay"] < 8e-3 and f["detail"]["delay_error"] < 1e-3 for f in found)


def test_the_acrobot_differs_from_its_makers_model_at_the_elbow(acrobot):
    """Half a second of a swing-up is told to some hundredths of a radian; encoders see a hundred times less: the difference is sure."""
    found = rille("compare", acrobot[0], "acrobot/1")
    channels = {channel["name"]: channel for channel in found["channels"]}
    assert found["differs"]
    assert found["targets"][0]["name"] == "elbow"
    for name in ("pos_meas1", "pos_meas2"):
        assert 0.005 < channels[name]["rms"] < 0.15
        assert channels[name]["normalised"] > 30
    assert channels["tau_meas1"]["lag_fit"]["delay"] == pytest.approx(6.5e-3, abs=1.5e-3)


def test_light_balls_fall_more_slowly_than_the_model_without_air(repository, rille_data, tmp_path):
    """A whiffle ball has many times the drag of a golf ball, weight for weight: its velocity lies above that of free fall."""
    database = tmp_path / "ball.db"
    rille("cad", "build", repository / "examples/ball_drops/ball.toml", "-o", database)
    rille("import", repository / "examples/ball_drops/drops.toml", "-o", database)
    found = {name: rille("compare", database, f"drops/{name}/1", "--whole") for name in ("Golf Ball", "Yellow Whiffle Ball")}
    bias = {ball: next(c["bias"] for c in whole["channels"] if c["name"] == "velocity_mps") for ball, whole in found.items()}
    assert bias["Yellow Whiffle Ball"] > 3 * abs(bias["Golf Ball"])


@pytest.fixture(scope="module")
def husky(repository, rille_data, tmp_path_factory):
    """The Husky on its ground with the 603 windows, made in a copy of the example; what the import said."""
    folder = tmp_path_factory.mktemp("machine") / "examples/husky"
    shutil.copytree(repository / "examples/husky", folder)
    subprocess.run([sys.executable, str(folder / "make_table.py")], check=True, capture_output=True)
    database = folder / "husky.db"
    rille("cad", "build", folder / "husky.toml", "-o", database)
    rille("terrain", "build", folder / "ground.toml", "-o", database)
    return database, rille("import", folder / "rolled.toml", "-o", database)


def test_the_useless_heading_of_the_husky_is_flagged(husky):
    """By itself, in every one of the 603 recordings, and no other channel with it."""
    flagged = findings_of(husky[1], "bad_channel", "imu_yaw")
    assert len(flagged) == 603
    assert all(flagged)
    for channel in ("icp_x", "icp_y", "icp_yaw", "left_wheel_vel (front_left)", "right_wheel_vel (front_right)"):
        assert not any(findings_of(husky[1], "bad_channel", channel))


def test_the_husky_turns_by_friction(husky):
    """Ideal wheels miss its heading by 1.5 rad in 2 s (SOURCES.md); wheels that scrub on hard ground come within a third of that."""
    found = rille("compare", husky[0], "rolled/10[1-5]", "--window", "2 s")
    yaw = next(channel for channel in found["channels"] if channel["name"] == "icp_yaw")
    assert yaw["rms"] < 0.5
