"""Numbers and pictures of a run, from hand-made traces."""

from dataclasses import replace

import numpy as np
import pytest

import check_machines
from figures import figures_of
from machines import box, cart, plane
from rille.model import (
    BodyTrace,
    Drive,
    InputRefused,
    Joint,
    JointTrace,
    Mesh,
    Part,
    PartInstance,
    Pose,
    Rover,
    Trace,
    WheelTrace,
)
from rille.view import plots, render, summary
from rille.view.compose import machine_items, mechanism_drawing
from rille.view.plots import joint_rows
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
        assert wheel.mean_normal_load == pytest.approx(50)
        assert wheel.mean_drive_torque == pytest.approx(1)
    assert any("mean slip ratio" in line for line in result.lines())


def test_times_at_rest_do_not_dilute_the_mean_slip():
    trace, rover = hand_made()
    still = trace.time < 2
    parked = replace(trace, joints=tuple(replace(j, velocity=np.where(still, 0, j.velocity)) for j in trace.joints))
    wheels = tuple(
        replace(w, slip_ratio=np.where(still, 0, 0.2), center=np.where(still[:, None], w.center[20], w.center)) for w in trace.wheels
    )
    result = summary(replace(parked, wheels=wheels), rover)
    assert result.wheels[0].mean_slip_ratio == pytest.approx(0.2)


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


def test_joints_are_drawn_in_the_units_of_their_kind():
    """A hinge without a drive has no torque to draw, a slider moves in metres."""
    trace, rover = hand_made()
    slider = replace(rover.joints[0], kind="prismatic")
    rover = replace(rover, joints=(slider, *rover.joints[1:]), drives=tuple(d for d in rover.drives if d.joint == slider.name))
    labels = {label: [name for name, _ in lines] for label, lines in joint_rows(trace, rover)}
    hinges = [j.name for j in rover.joints[1:]]
    assert labels == {
        "angle [rad]": hinges,
        "rate [rad/s]": hinges,
        "travel [m]": [slider.name],
        "speed [m/s]": [slider.name],
        "drive force [N]": [slider.name],
    }


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


def turning(axis, n=41):
    """A bar of 0.8 m on a base of 0.2 m that turns once about an axis at its end; rover and trace."""
    rotation_axis = np.array(axis, float)
    time = np.linspace(0, 4, n)
    angle = np.pi / 2 * time
    turned = np.column_stack([np.cos(angle / 2), *(np.sin(angle / 2) * component for component in rotation_axis)])
    still = np.tile([1.0, 0, 0, 0], (n, 1))
    at_rest = np.zeros((n, 3))  # of the frame of either body, on the axis
    bodies = tuple(
        BodyTrace(name=name, position=at_rest, rotation=rotation, velocity=at_rest, angular_velocity=at_rest)
        for name, rotation in (("base", still), ("bar", turned))
    )
    parts, instances = [], []
    for name, size, at in (("base", (0.2, 0.2, 0.1), (0, 0, -0.1)), ("bar", (0.8, 0.06, 0.03), (0.4, 0, 0))):
        parts.append(replace(check_machines.box_part(name, size, 1.0), color="#cc6633"))
        instances.append(PartInstance(path=name, part=name, body=name, pose=Pose(position=at)))
    hinge = Joint(name="hinge", kind="hinge", parent="base", child="bar", point=(0, 0, 0), axis=tuple(axis))
    rover = Rover(
        parts=tuple(parts),
        instances=tuple(instances),
        bodies=(check_machines.body_of("base", [(parts[0], (0, 0, -0.1))]), check_machines.body_of("bar", [(parts[1], (0.4, 0, 0))])),
        joints=(hinge,),
    )
    joints = (JointTrace(name="hinge", position=angle, velocity=0 * time + np.pi / 2, effort=0 * time, work=0 * time),)
    return rover, replace(hand_made(n)[0], time=time, bodies=bodies, joints=joints, wheels=())


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)])
def test_a_mechanism_is_seen_from_above_and_whole(axis):
    """The camera stands over what it looks at, and every point projects within the page."""
    drawing = mechanism_drawing(*turning(axis))
    camera, (width, height) = drawing.camera, drawing.size
    place, focus = np.array(camera.position), np.array(camera.focus)
    assert place[2] > focus[2]
    toward = (place - focus) / np.linalg.norm(place - focus)
    right = np.cross(camera.up, toward)
    right /= np.linalg.norm(right)
    rays = np.concatenate([item.vertices for item in drawing.items]) - place
    depth = -rays @ toward
    assert depth.min() > 0
    half = np.tan(np.radians(camera.view_angle) / 2)
    seen = np.array([rays @ right / depth / (half * width / height), rays @ np.cross(toward, right) / depth / half])
    assert np.abs(seen).max() == pytest.approx(0.92, abs=1e-6)  # as near as it can be


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_a_mechanism_is_solid_at_the_time_that_is_shown(share):
    rover, trace = turning((0.0, 1.0, 0.0))
    until = trace.until(share * trace.time[-1])
    solid = [item for item in mechanism_drawing(rover, until).items if item.opacity == 1.0]
    for item, there in zip(solid, machine_items(rover, trace, len(until.time) - 1), strict=True):
        np.testing.assert_array_equal(item.vertices, there.vertices)


def test_every_joint_of_a_plot_is_in_its_legend(tmp_path, monkeypatch):
    """Hinges and sliding joints are in different panels; each has a colour and a name of its own."""
    drawn = figures_of(monkeypatch, plots)
    rover, trace = turning((0.0, 1.0, 0.0))
    rail = Joint(name="rail", kind="prismatic", parent="bar", child="slug", point=(0, 0, 0), axis=(1, 0, 0))
    traces = (*trace.joints, replace(trace.joints[0], name="rail"))
    plots.plot_traces(replace(trace, joints=traces), replace(rover, joints=(*rover.joints, rail)), tmp_path / "t.png")
    (legend,) = drawn[0].legends
    assert [text.get_text() for text in legend.get_texts()] == ["hinge", "rail"]
    assert len({line.get_color() for line in legend.get_lines()}) == 2


@pytest.mark.parametrize(("effort", "words"), [(1.0, "8.33 W (wheel, driving)"), (-1.0, "8.33 W (wheel, braking)")])
def test_peak_power_is_a_size_with_a_direction(effort, words):
    """Effort times speed: 1 N m at 1/(0.8 x 0.15 m) rad/s are 8.33 W, whichever way."""
    trace, rover = hand_made()
    named = trace.joints[-1].name
    joints = tuple(replace(joint, effort=0 * joint.effort + effort) for joint in trace.joints)
    drives = (Drive(name="wheel", joint=named, mode="speed", max_torque=5.0),)
    lines = summary(replace(trace, joints=joints), replace(rover, drives=drives)).lines()
    assert any(line.startswith("peak power of a drive") and line.endswith(words) for line in lines)


def test_losses_on_rigid_ground_are_not_called_rocks():
    names = ("kinetic", "potential", "drive_work", "external_work", "soil_loss", "joint_loss", "contact_loss", "residual")
    balance = dict.fromkeys(names, 0.0) | {"drive_work": 4.9, "contact_loss": 4.9}
    trace, rover = hand_made()
    (line,) = [x for x in replace(summary(trace, rover), balance=balance).lines() if "went into" in x]
    assert "rigid contacts 4.9" in line
    assert "rock" not in line
