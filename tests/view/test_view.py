"""Numbers and pictures of a run, from hand-made traces."""

from dataclasses import replace

import numpy as np
import pytest

from machines import box, cart, plane
from rille.model import (
    BodyTrace,
    InputRefused,
    JointTrace,
    Mesh,
    Part,
    PartInstance,
    Pose,
    Rover,
    Trace,
    WheelTrace,
)
from rille.view import render, summary
from rille.view.pose import to_world


def hand_made(n=41):
    """A cart that moves 4 m along x in 4 s at a slip of 0.2, and its rover with a cube as picture."""
    rover = cart(5.0, 0.15, 0.165)
    cube = np.array([[x, y, z] for x in (-0.3, 0.3) for y in (-0.2, 0.2) for z in (0.1, 0.4)], np.float32)
    faces = [
        [0, 1, 3],
        [0, 3, 2],
        [4, 6, 7],
        [4, 7, 5],
        [0, 4, 5],
        [0, 5, 1],
        [2, 3, 7],
        [2, 7, 6],
        [0, 2, 6],
        [0, 6, 4],
        [1, 5, 7],
        [1, 7, 3],
    ]
    mesh = Mesh(vertices=cube, triangles=np.array(faces, np.int32), tolerance=1e-3)
    part = Part(name="cube", volume=0.07, properties=box("c", 1, (0, 0, 0), (1, 1, 1)).properties, color="#ff0000", meshes=(mesh,))
    rover = replace(rover, parts=(part,), instances=(PartInstance(path="cube", part="cube", body="chassis", pose=Pose()),))
    time = np.linspace(0, 4, n)
    still = np.tile([1.0, 0, 0, 0], (n, 1))
    forward = np.column_stack([time - 2, 0 * time, 0 * time])
    bodies = tuple(
        BodyTrace(name=b.name, position=forward, rotation=still, velocity=0 * forward, angular_velocity=0 * forward) for b in rover.bodies
    )
    spin = np.full(n, 1 / 0.8 / 0.15)
    joints = tuple(JointTrace(name=j.name, position=0 * time, velocity=spin, effort=0 * time + 1, work=2.5 * time) for j in rover.joints)
    wheels = tuple(
        WheelTrace(
            name=w.name,
            center=forward + np.array(w.center),
            ground_height=0 * time,
            slip_ratio=0 * time + 0.2,
            slip_angle=0 * time,
            sinkage=0.01 + 0.001 * time,
            normal_load=0 * time + 50,
            drawbar_pull=0 * time,
            side_force=0 * time,
            drive_torque=0 * time + 1,
        )
        for w in rover.wheels
    )
    trace = Trace(
        run_id=1, scenario="hand", status="done", message="", step=1e-3, time=time, bodies=bodies, joints=joints, wheels=wheels, events=()
    )
    return trace, rover


def test_summary_is_what_was_put_in():
    trace, rover = hand_made()
    result = summary(trace, rover)
    assert result.distance == pytest.approx(4.0)
    assert result.duration == 4.0
    assert result.energy == pytest.approx(4 * 2.5 * 4)
    assert result.max_sinkage == pytest.approx(0.014)
    for wheel in result.wheels:
        assert wheel.mean_slip_ratio == pytest.approx(0.2)
        assert wheel.mean_normal_load == 50
        assert wheel.mean_drive_torque == 1
    assert any("mean slip ratio" in line for line in result.lines())


def test_times_at_rest_do_not_dilute_the_mean_slip():
    trace, rover = hand_made()
    still = trace.time < 2
    parked = replace(trace, joints=tuple(replace(j, velocity=np.where(still, 0, j.velocity)) for j in trace.joints))
    wheels = tuple(
        replace(w, slip_ratio=np.where(still, 0, 0.2), center=np.where(still[:, None], w.center[20], w.center)) for w in trace.wheels
    )
    result = summary(replace(parked, wheels=wheels), rover)
    assert result.wheels[0].mean_slip_ratio == pytest.approx(0.2, abs=0.011)  # one sample at the edge


def test_a_part_stands_where_its_body_carries_it():
    """Body frame at (1, 0, 0) of M, turned by 90 degrees about z at (10, 20, 30): a point at (2, 0, 0) of M lies at (10, 21, 30) of W."""
    body = replace(box("b", 1, (0, 0, 0), (1, 1, 1)), frame=(1.0, 0.0, 0.0))
    half = np.sqrt(0.5)
    trace = BodyTrace(
        name="b",
        position=np.array([[10.0, 20, 30]]),
        rotation=np.array([[half, 0, 0, half]]),
        velocity=np.zeros((1, 3)),
        angular_velocity=np.zeros((1, 3)),
    )
    instance = PartInstance(path="p", part="p", body="b", pose=Pose(position=(2.0, 0.0, 0.0), rotation=(half, 0.0, 0.0, half)))
    points = to_world(np.array([[0.0, 0, 0], [1.0, 0, 0]]), instance, body, trace, 0)
    assert points == pytest.approx(np.array([[10.0, 21, 30], [9.0, 21, 30]]))  # part's x -> M's y -> W's -x


def test_pictures_show_the_machine_on_its_ground(tmp_path):
    """All four pictures; the red cube is in the 3-D ones, and gone when the rover has no meshes."""
    from matplotlib.image import imread

    trace, rover = hand_made()
    paths, notes = render(trace, rover, plane(0.02), tmp_path / "p")
    assert notes == []
    assert {path.name for path in paths} == {"traces.png", "map.png", "scene.png", "rover.png"}
    for path in paths:
        assert imread(path).std() > 0.05, f"{path} is blank"
    pixels = imread(tmp_path / "p" / "scene.png")
    assert pixels.shape[:2] == (1000, 1600)
    red = (pixels[..., 0] > 0.3) & (pixels[..., 1] < 0.1) & (pixels[..., 2] < 0.1)
    assert red.mean() > 0.005


def test_a_machine_without_meshes_still_has_plots(tmp_path):
    trace, rover = hand_made()
    paths, notes = render(trace, Rover(bodies=rover.bodies, joints=rover.joints, wheels=rover.wheels), None, tmp_path)
    assert [path.name for path in paths] == ["traces.png"]
    assert "no visual meshes" in notes[0]


def test_a_renderer_that_dies_is_a_note_not_a_crash(tmp_path, monkeypatch):
    """VTK without EGL dies by a signal; plots appear all the same."""
    trace, rover = hand_made()
    killer = tmp_path / "python"
    killer.write_text("#!/bin/sh\nkill -SEGV $$\n")
    killer.chmod(0o755)
    monkeypatch.setattr("sys.executable", str(killer))
    paths, notes = render(trace, rover, plane(), tmp_path / "p")
    assert {path.name for path in paths} == {"traces.png", "map.png"}
    assert "signal 11" in notes[0]
    assert "libegl1" in notes[0]


def test_an_empty_run_is_refused(tmp_path):
    trace, rover = hand_made()
    with pytest.raises(InputRefused, match="no states"):
        render(replace(trace, time=np.empty(0)), rover, None, tmp_path)
