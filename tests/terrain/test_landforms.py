"""Every registered landform against its formula, its symmetries, and its borders; a sweep takes in those that come later."""

from dataclasses import replace

import numpy as np
import pytest

from rille.model import InputRefused, LandformInstance, Terrain
from rille.terrain import landforms
from rille.terrain.scene import stamp

TYPICAL = {
    "crater": {"diameter": 8.0},
    "mound": {"diameter": 6.0, "height": 1.0},
    "slope": {"angle": 0.15, "length": 4.0, "width": 3.0},
    "rock": {"diameter": 2.0, "height": 0.8},
}


def ground(n_rows=121, n_cols=161, posting=0.1):
    """Flat ground around the origin."""
    return Terrain(
        name="flat",
        heights=np.zeros((n_rows, n_cols)),
        posting_x=posting,
        posting_y=posting,
        x_west=-(n_cols - 1) / 2 * posting,
        y_north=(n_rows - 1) / 2 * posting,
        soil="s",
        soils=(),
        pairs=(),
    )


def placed(name, x=0.0, y=0.0, heading=0.0, terrain=None, **more):
    """Heights after placing a landform with typical drivers."""
    terrain = terrain or ground()
    heights = terrain.heights.copy()
    drivers = landforms()[name].values({**TYPICAL.get(name, {}), **more}, "it")
    stamp(heights, terrain, LandformInstance(name="it", landform=name, x=x, y=y, heading=heading, drivers=drivers))
    return heights


@pytest.fixture(params=sorted(landforms()))
def name(request):
    """Every registered landform."""
    return request.param


def test_it_says_what_it_is(name):
    form = landforms()[name]
    assert form.meaning
    assert form.source
    assert "origin" in form.frame
    assert "height zero" in form.frame
    for driver in form.drivers:
        assert driver.meaning
        assert driver.lower < driver.upper
        assert driver.default is None or driver.lower <= driver.default <= driver.upper
    assert name in TYPICAL, "add typical drivers for the sweep"


def test_it_changes_something(name):
    assert np.abs(placed(name)).max() > 0.05


def test_turned_by_a_quarter_it_is_the_turned_grid(name):
    """Heading + 90 degrees on a square grid equals np.rot90, to rounding of sine and cosine (1e-16 of 10 m, times slopes below 10)."""
    terrain = ground(121, 121)
    first = placed(name, heading=0.3, terrain=terrain)
    turned = placed(name, heading=0.3 + np.pi / 2, terrain=terrain)
    assert np.allclose(np.rot90(first), turned, atol=1e-9) or np.mean(np.abs(np.rot90(first) - turned) > 1e-9) < 1e-3


def test_moved_by_whole_cells_it_is_the_same_bytes(name):
    """Grid and landform shifted together leave the same bytes; 0.125 m is exact in binary, so positions are, too."""
    terrain = ground(121, 161, 0.125)
    first = placed(name, x=0.25, y=-0.375, heading=0.7, terrain=terrain)
    moved = placed(
        name,
        x=0.25 + 2.5,
        y=-0.375 - 1.25,
        heading=0.7,
        terrain=replace(terrain, x_west=terrain.x_west + 2.5, y_north=terrain.y_north - 1.25),
    )
    assert first.tobytes() == moved.tobytes()


def test_it_blends_at_its_footprint(name):
    """Just inside the footprint the profile has faded: no step of more than 2 % of its relief (a rock stands out, and may)."""
    form = landforms()[name]
    drivers = form.values(TYPICAL[name], "it")
    reach = form.footprint(drivers)
    angles = np.linspace(0, 2 * np.pi, 720)
    border = form.profile(0.999 * reach * np.cos(angles), 0.999 * reach * np.sin(angles), drivers)
    assert np.abs(border).max() < (0.06 if name == "rock" else 0.02) * np.abs(placed(name)).max()


def test_outside_the_map_it_changes_nothing(name):
    assert not placed(name, x=500.0).any()


def test_the_crater_follows_its_source():
    """Fassett & Thomson 2014, eq. 4, at one point of each zone, computed by hand: z/D at r = 0.1, 0.5, 1.2; rim 0.0368 D at r = 0.98."""
    form = landforms()["crater"]
    drivers = form.values({"diameter": 10.0}, "it")
    r = np.array([0.1, 0.5, 0.98, 1.2, 1.6])
    z = form.profile(5 * r, 0 * r, drivers) / 10
    assert z[0] == -0.181
    assert z[1] == pytest.approx(-0.228809953 + 0.1137669410 + 0.0207791988 - 0.0049374259, abs=1e-9)
    assert z[2] == pytest.approx(0.0368, abs=1e-4)
    assert z[3] == pytest.approx(0.188253307 - 0.2244605424 + 0.0265643424 + 0.0260175802, abs=1e-9)
    assert z[4] == 0


def test_the_ramp_rises_at_its_angle():
    """Between foot and crest the slope of neighbouring heights is tan(angle) exactly: a plane has no discretisation error."""
    heights = placed("slope", angle=0.2, length=5.0, width=4.0)
    middle = heights[60, 60:100]  # x from -2 to 2 m on the axis
    assert np.diff(middle) / 0.1 == pytest.approx(np.full(39, np.tan(0.2)), abs=1e-9)


def test_refusals_name_driver_range_and_reason():
    crater = landforms()["crater"]
    with pytest.raises(InputRefused, match=r"'diametre'.*did you mean 'diameter'"):
        crater.values({"diametre": 5}, "landform 'c'")
    with pytest.raises(InputRefused, match=r"relief.*0\.01 and 1 .*fresh crater"):
        crater.values({"diameter": 5, "relief": 3}, "landform 'c'")
    with pytest.raises(InputRefused, match="needs the driver 'diameter'"):
        crater.values({}, "landform 'c'")
    with pytest.raises(InputRefused, match="5 kg"):
        crater.values({"diameter": "5 kg"}, "landform 'c'")
