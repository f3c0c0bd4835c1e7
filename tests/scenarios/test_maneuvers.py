"""What every rover must be able to do, each with its reason and its picture (out/maneuvers, made by `make maneuvers` as by this test)."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rille import store

RILLE = str(Path(sys.executable).parent / "rille")
SCENES = {
    "climb_rock": "yard",
    "cross_crater": "yard",
    "slide_down": "slope32",
    "park": "slope15",
    "drive_backwards": "yard",
    "turn_in_place": "yard",
}
SHOWN_AT = {"climb_rock": 9.3, "cross_crater": 19.0, "slide_down": 4.0, "turn_in_place": 10.0}
MOON = 1.625


def rille(*arguments):
    """Run the command as a user does."""
    done = subprocess.run([RILLE, *map(str, arguments)], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return done


@pytest.fixture(scope="module")
def rover(repository, tmp_path_factory):
    """The example rover on the three grounds."""
    path = tmp_path_factory.mktemp("maneuvers") / "rover.db"
    examples = repository / "examples"
    rille("cad", "build", examples / "rover/rover.toml", "-o", path)
    for scene in sorted(set(SCENES.values())):
        rille("terrain", "build", examples / f"maneuvers/{scene}.toml", "-o", path)
    return path


@pytest.fixture
def drive(rover, repository, tmp_path):
    """Run a maneuver and draw it; returns its trace and the chassis."""

    def make(name):
        path = tmp_path / f"{name}.db"
        shutil.copyfile(rover, path)
        rille("run", path, "--scenario", repository / f"examples/maneuvers/{name}.toml")
        pictures = tmp_path / "pictures"
        rille("view", path, "-o", pictures, *(["--time", SHOWN_AT[name]] if name in SHOWN_AT else []))
        kept = repository / "out/maneuvers"
        kept.mkdir(parents=True, exist_ok=True)
        assert (pictures / "rover.png").stat().st_size > 50_000
        shutil.copyfile(pictures / "rover.png", kept / f"{name}.png")
        trace = store.read_trace(path)
        return path, trace, next(body for body in trace.bodies if body.name == "chassis")

    return make


def wheel(trace, name):
    """Trace of one wheel."""
    return next(w for w in trace.wheels if w.name == name)


def yaw(body):
    """Heading [rad] over time, unwrapped."""
    w, x, y, z = body.rotation.T
    return np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def test_it_climbs_a_rock(drive):
    """The left wheels go over a rock whose top stands a wheel's radius above the ground, while the right ones stay on it.

    Reason: rigid contacts beside soft soil, friction that carries a wheel up, and a differential that lets the sides move apart.
    """
    _, trace, chassis = drive("climb_rock")
    assert trace.status == "stopped"  # by its watch, beyond the rock
    assert chassis.position[-1, 0] > 1.55
    for name in ("wheel_front_left", "wheel_middle_left", "wheel_rear_left"):
        lift = wheel(trace, name).center[:, 2] - wheel(trace, name).ground_height - 0.15
        assert lift.max() > 0.10, name
    for name in ("wheel_front_right", "wheel_middle_right", "wheel_rear_right"):
        lift = wheel(trace, name).center[:, 2] - wheel(trace, name).ground_height - 0.15
        assert lift.max() < 0.03, name
    kinds = [event.kind for event in trace.events]
    assert kinds.count("contact_begin") >= 3
    assert not {"tip_over", "stuck"} & set(kinds)


def test_it_crosses_a_crater(drive):
    """Down one wall and up the other. Reason: slopes of both signs within a body's length, loads that shift between wheels."""
    _, trace, chassis = drive("cross_crater")
    assert chassis.position[-1, 0] > 2.0
    assert chassis.position[:, 2].min() < chassis.position[0, 2] - 0.15
    assert abs(chassis.position[-1, 2] - chassis.position[0, 2]) < 0.12
    assert max(np.percentile(abs(w.slip_ratio), 99) for w in trace.wheels) < 0.7  # a wheel may spin for a moment at the rim


def test_it_slides_down_beyond_the_friction_angle(drive):
    """Locked wheels on 32 degrees of scree with a friction angle of 24: the acceleration is g (sin - mu cos) with the mu of the bench.

    Reason: shear strength is a bound, not a spring. mu of the law at full braking contains the shallow rut, so that it is taken from the
    bench at the loads that the wheels carry; 10 %: loads differ from wheel to wheel while it slides.
    """
    path, trace, chassis = drive("slide_down")
    late = trace.time > 1.5
    speed = np.linalg.norm(chassis.velocity[late], axis=1)
    slope = np.radians(32)
    from rille import simulate
    from rille.model import BenchWheel

    soil = next(s for s in store.read_soils(path) if s.name == "scree")
    loads = np.array([w.normal_load[late].mean() for w in trace.wheels])
    point = simulate.bench(
        "bekker_wong", soil, BenchWheel(radius=0.15, width=0.165), load=loads[loads > 1], slip_ratio=-0.98, gravity=MOON
    ).points
    mu = -point.drawbar_pull.sum() / point.load.sum()
    expected = MOON * (np.sin(slope) - mu * np.cos(slope))
    got = np.polyfit(trace.time[late], speed, 1)[0]
    assert np.tan(np.radians(24)) < mu < np.tan(slope)
    assert got == pytest.approx(expected, rel=0.1)
    assert chassis.position[-1, 0] < chassis.position[0, 0] - 2


def test_it_parks_on_15_degrees(drive):
    """At most 1 mm in a minute. Reason: the slip law is singular at rest; a solver that regularises it crudely creeps."""
    _, trace, chassis = drive("park")
    crept = np.linalg.norm(chassis.position[-1] - chassis.position[0])
    print(f"crept {1e3 * crept:.4f} mm in 60 s")
    assert crept < 1e-3
    assert trace.time[-1] == pytest.approx(60)


def test_it_drives_backwards(drive):
    """Reason: signs. The distance is that of the rims less their slip, drawbar pulls balance, and torques have the sign of the motion."""
    _, trace, chassis = drive("drive_backwards")
    late = trace.time > 5
    slip = np.mean([w.slip_ratio[late].mean() for w in trace.wheels])
    moved = chassis.position[late][-1, 0] - chassis.position[late][0, 0]
    assert moved == pytest.approx(-1.2 * 0.15 * (1 - slip) * (trace.time[-1] - 5), rel=0.02)
    assert 0.05 < slip < 0.4
    assert all(w.drive_torque[late].mean() < 0 for w in trace.wheels)
    weight = sum(w.normal_load[late].mean() for w in trace.wheels)
    assert abs(sum(w.drawbar_pull[late].mean() for w in trace.wheels)) < 0.03 * weight


def test_it_turns_in_place(drive):
    """A turn of the angle that the rims ask for, less their slip, on the spot. Reason: side forces, steering, opposite signs of slip."""
    _, trace, chassis = drive("turn_in_place")
    turned = yaw(chassis)[-1] - yaw(chassis)[0]
    asked = 0.8 * 0.15 / np.hypot(0.62, 0.5) * 12.0
    assert 0.75 * asked < turned < asked
    assert np.linalg.norm(chassis.position[-1, :2] - chassis.position[0, :2]) < 0.1
    assert "stuck" not in {event.kind for event in trace.events}
