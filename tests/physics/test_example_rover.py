"""The example rover, built from its STEP file, on the composed terrain and on the real lunar DEM."""

from dataclasses import replace

import numpy as np
import pytest
from rille._solver import Simulation

from machines import plane
from rille import cad, store, terrain
from rille.model import Command, Pose, Scenario
from rille.simulate import read_scenario_file, run


@pytest.fixture(scope="module")
def rover(repository):
    """The example rover."""
    return cad.build(repository / "examples/rover/rover.toml")


def model(tmp_path, rover, ground, scenario):
    """Database with all three."""
    path = tmp_path / "rover.db"
    store.create(path)
    store.write_rover(path, rover)
    store.write_terrain(path, ground)
    store.write_scenario(path, scenario)
    return path


def test_the_differential_holds_over_60_seconds_of_rough_ground(repository, tmp_path, rover):
    """theta_left + theta_right = 2 theta_chassis to 1e-6 rad: rounding is 1e-16, and nothing may build up in 60 000 steps."""
    ground = terrain.build(repository / "examples/terrain/composed.toml")
    scenario = read_scenario_file(repository / "examples/first_drive/traverse.toml", rover)
    simulation = Simulation(str(model(tmp_path, rover, ground, scenario)))
    assert simulation.settle() == "running"
    largest, widest = 0.0, 0.0
    left = simulation.joint_names.index("rocker_left")
    for _ in range(600):
        assert simulation.step(100) == "running"
        largest = max(largest, simulation.differential_error)
        widest = max(widest, abs(simulation.joints()[left, 0]))
    print(f"differential error {largest:.1e} rad while the rockers turned {np.degrees(widest):.1f} deg")
    assert widest > np.radians(1)
    assert largest < 1e-6
    assert simulation.bodies()[0, 0] > 0  # 7 m further than it started


def test_a_mirrored_drive_of_the_example_rover_is_the_mirrored_path(repository, tmp_path, rover):
    """Steering the other way gives the path on the other side, on flat ground.

    The antenna's and the cameras' shapes are symmetric, so the rover is; its STEP file gives coordinates to about 1e-7 m, and sums are
    added in another order: 1e-4 m of 5 m is asked for.
    """
    ground = terrain.build(repository / "examples/terrain/composed.toml")
    flat = replace(ground, heights=np.zeros_like(ground.heights), patches=(), landforms=())
    ends = []
    for sign in (1, -1):
        commands = [Command(drive=d.name, time=0.0, value=1.4) for d in rover.drives if d.mode == "speed"]
        for drive in rover.drives:
            if drive.mode == "position":
                commands.append(Command(drive=drive.name, time=0.0, value=sign * (0.25 if "front" in drive.name else -0.25)))
        scenario = Scenario(
            name="arc",
            duration=25,
            gravity=(0, 0, -1.625),
            step=2e-3,
            terrain="composed",
            placement="on_terrain",
            settle_time=8.0,
            commands=tuple(commands),
        )
        folder = tmp_path / str(sign)
        folder.mkdir()
        simulation = Simulation(str(model(folder, rover, flat, scenario)))
        assert simulation.settle() == "running"
        assert simulation.step(12500) == "running"
        ends.append(simulation.bodies()[0])
    mirror = np.array([1, -1, 1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1])
    assert abs(ends[0][1]) > 1.0
    assert ends[0][:7] * mirror[:7] == pytest.approx(ends[1][:7], abs=1e-3)


def test_the_example_rover_drives_on_the_real_lunar_dem(repository, rille_data, tmp_path, rover):
    """60 s on the Aristarchus clip: it moves, it stays on its wheels, and no wheel slips away."""
    ground = terrain.build(repository / "examples/terrain/lunar_dem.toml")
    scenario = read_scenario_file(repository / "examples/first_drive/lunar_dem.toml", rover)
    path = model(tmp_path, rover, ground, scenario)
    result = run(path)
    assert result.status == "done"
    trace = store.read_trace(path)
    root = trace.bodies[0]
    assert np.linalg.norm(root.position[-1] - root.position[0]) > 5.0
    up = 1 - 2 * (root.rotation[:, 1] ** 2 + root.rotation[:, 2] ** 2)  # z of the chassis' z axis
    assert up.min() > np.cos(np.radians(25))
    assert max(np.abs(wheel.slip_ratio[5:]).max() for wheel in trace.wheels) < 0.9


@pytest.mark.parametrize("slope", [0.0, 10.0, 20.0])
@pytest.mark.parametrize("heading", [0.0, 75.0, 150.0, 225.0, 300.0])
def test_it_settles_on_six_wheels_at_any_heading_and_slope(tmp_path, rover, slope, heading):
    """Bumpy ground under six wheels: placed close to it, so that nothing jumps; at rest, every wheel carries and together they carry all.

    Nothing faster than 0.2 m/s while it settles (a fall of 2 mm on the Moon gives 0.08 m/s); at rest the loads sum to m g cos(slope) within
    3 %, for normals of bumps differ from that of the slope.
    """
    x, y = np.meshgrid(np.linspace(-4, 4, 81), np.linspace(4, -4, 81))
    ground = replace(
        plane(),
        heights=np.tan(np.radians(slope)) * x + 0.03 * np.sin(3 * x + 1) * np.cos(2.3 * y),
        posting_x=0.1,
        posting_y=0.1,
        x_west=-4.0,
        y_north=4.0,
    )
    half = np.radians(heading) / 2
    start = Pose(position=(0.3, -0.2, 0), rotation=(np.cos(half), 0, 0, np.sin(half)))
    scenario = Scenario(
        name="stand", duration=2, gravity=(0, 0, -1.625), terrain="plane", placement="on_terrain", settle_time=10, start=start
    )
    simulation = Simulation(str(model(tmp_path, rover, ground, scenario)))
    placed = simulation.bodies()[0, :3]
    assert simulation.settle() == "running"
    assert [kind for _, kind, _, _ in simulation.events()] == ["settled"]
    assert np.linalg.norm(simulation.bodies()[0, :3] - placed) < 0.05
    loads = simulation.wheels()[:, 7]
    weight = sum(body.properties.mass for body in rover.bodies) * 1.625 * np.cos(np.radians(slope))
    assert loads.min() > 0.02 * weight
    assert loads.sum() == pytest.approx(weight, rel=0.03)
    assert simulation.sample(500, 1, [("part.linear_velocity", "chassis", k) for k in range(3)]) == pytest.approx(0, abs=1e-3)
