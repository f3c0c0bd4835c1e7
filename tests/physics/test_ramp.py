"""Frames, end to end: an asymmetric ramp on a non-square grid, from a GeoTIFF to the height of a wheel."""

import numpy as np
import pytest
from rille._solver import Simulation

from machines import cart
from rille import store
from rille.model import Pose, Scenario
from rille.terrain import build


def test_a_ramp_arrives_under_the_wheels_as_it_was_written(tmp_path):
    """z = 0.06 x - 0.11 y + 40: no flip, transposition, half-cell shift or offset leaves the height of a wheel unchanged.

    A bilinear surface holds a plane exactly, so ground heights agree to rounding (map heights of 40 m in float64: 1e-12).
    """
    import rasterio
    from rasterio.transform import Affine

    n_rows, n_cols, posting_x, posting_y = 61, 37, 0.5, 0.25
    west, north = 1000.0, 5000.0  # map coordinates of the first value
    east = west + posting_x * np.arange(n_cols)
    south = north - posting_y * np.arange(n_rows)

    def ramp(e, n):
        return 0.06 * (e - west) - 0.11 * (n - north) + 40.0

    file = tmp_path / "ramp.tif"
    with rasterio.open(
        file,
        "w",
        driver="GTiff",
        height=n_rows,
        width=n_cols,
        count=1,
        dtype="float64",
        crs="EPSG:32633",
        transform=Affine(posting_x, 0, west - posting_x / 2, 0, -posting_y, north + posting_y / 2),
    ) as raster:
        raster.write(ramp(east[None, :], south[:, None]), 1)
    scene = tmp_path / "scene.toml"
    scene.write_text(f'name = "ramp"\nsoil = "lunar_sourcebook"\n[base]\nkind = "dem"\nfile = "{file}"\norigin = [1008.3, 4993.1]\n')
    terrain = build(scene)

    model = tmp_path / "model.db"
    store.create(model)
    store.write_rover(model, cart(5.0, 0.15, 0.165))
    store.write_terrain(model, terrain)
    start = Pose(position=(0.4, -0.7, 0.0), rotation=(np.cos(0.35), 0.0, 0.0, np.sin(0.35)))
    scenario = Scenario(name="stand", duration=1, terrain="ramp", placement="on_terrain", settle_time=5.0, start=start)
    store.write_scenario(model, scenario)
    simulation = Simulation(str(model))
    assert simulation.settle() == "running"
    assert simulation.step(100) == "running"
    wheels = simulation.wheels()
    up = terrain.map_origin[2]
    expected = ramp(wheels[:, 0] + 1008.3, wheels[:, 1] + 4993.1) - up
    assert wheels[:, 3] == pytest.approx(expected, abs=1e-9)
    # The rim's lowest point lies below the plane by the sinkage: height of the centre over the plane, along its normal, is r - z
    # but for the camber of wheels that stand across the slope (below 1 %).
    normal = np.array([-0.06, 0.11, 1.0]) / np.linalg.norm([-0.06, 0.11, 1.0])
    distance = (wheels[:, 2] - expected) * normal[2]
    assert 0.15 - distance == pytest.approx(wheels[:, 6], abs=1.5e-3)
    assert np.all(wheels[:, 6] > 0.005)
