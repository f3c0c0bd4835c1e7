"""Equivalent descriptions must give equal motion, and equal input equal bytes."""

import sqlite3
from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation

from machines import cart, plane
from rille.model import Command, Pose, Scenario


def drive_scenario(rover, speeds, **more):
    """Left and right wheels at their own speeds [rad/s] for 6 s."""
    commands = tuple(Command(drive=d.name, time=0.0, value=speeds["left" if "left" in d.name else "right"]) for d in rover.drives)
    return Scenario(
        name="drive",
        duration=6,
        step=2e-3,
        terrain="plane",
        placement="on_terrain",
        settle_time=3.0,
        commands=commands,
        **more,
    )


def final_pose(simulation):
    simulation.settle()
    assert simulation.step(3000) == "running"
    return simulation.bodies()[0]


def test_a_mirrored_drive_gives_the_mirrored_path(make_model):
    """Reflection at the x-z plane: swap left and right, and y, roll and yaw change sign.

    The mirrored sums are added in another order, so they agree to rounding grown over 3000 steps, not to the bit.
    """
    rover = cart(5.0, 0.15, 0.165)
    one = final_pose(Simulation(str(make_model(rover, drive_scenario(rover, {"left": 0.6, "right": 1.2}), plane(0.05)))))
    two = final_pose(Simulation(str(make_model(rover, drive_scenario(rover, {"left": 1.2, "right": 0.6}), plane(0.05)))))
    mirror = np.array([1, -1, 1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1])
    assert abs(one[1]) > 0.02  # it did turn
    assert one * mirror == pytest.approx(two, abs=1e-7)


def test_a_turned_world_gives_the_turned_path(make_model):
    """Slope and heading turned together by 90 degrees: the path turns with them, to rounding grown over 3000 steps."""
    rover = cart(5.0, 0.15, 0.165)
    half = np.sqrt(0.5)
    east = drive_scenario(rover, {"left": 0.6, "right": 1.0})
    north = replace(east, start=Pose(rotation=(half, 0.0, 0.0, half)))
    one = final_pose(Simulation(str(make_model(rover, east, plane(slope_x=0.05)))))
    two = final_pose(Simulation(str(make_model(rover, north, plane(slope_y=0.05)))))
    assert np.array([-one[1], one[0], one[2]]) == pytest.approx(two[:3], abs=1e-7)
    assert np.array([-one[8], one[7], one[9]]) == pytest.approx(two[7:10], abs=1e-7)


def test_a_wheel_heads_forward_whichever_way_its_joint_was_drawn(make_model):
    """Axes of the right wheels reversed, and their commands: the same drive, and the same forces of the wheels in sign and size."""
    rover = cart(5.0, 0.15, 0.165)
    mirrored = replace(rover, joints=tuple(replace(j, axis=(0, -1, 0)) if "right" in j.name else j for j in rover.joints))
    speeds = {"left": 1.2, "right": 0.8}
    one = Simulation(str(make_model(rover, drive_scenario(rover, speeds), plane(0.05))))
    two = Simulation(str(make_model(mirrored, drive_scenario(rover, speeds | {"right": -0.8}), plane(0.05))))
    assert final_pose(one) == pytest.approx(final_pose(two), abs=1e-9)
    assert one.wheels() == pytest.approx(two.wheels(), abs=1e-7)
    assert np.sign(two.joints()[:, 2]).tolist() == [1, -1, 1, -1]  # a joint's effort stays about its own axis


def test_same_database_in_same_results_out(make_model, tmp_path):
    """Two runs of two copies of one database leave identical files, byte for byte."""
    from shutil import copyfile

    from rille.simulate import run

    rover = cart(5.0, 0.15, 0.165)
    model = make_model(rover, drive_scenario(rover, {"left": 0.6, "right": 1.2}), plane(0.05))
    with sqlite3.connect(model) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()
    copies = [tmp_path / "one.db", tmp_path / "two.db"]
    for copy in copies:
        copyfile(model, copy)
        run(copy)
    assert copies[0].read_bytes() == copies[1].read_bytes()
    assert copies[0].stat().st_size > model.stat().st_size
