"""Ground of studies: what cannot be is refused before the first case, and a part of the design is no end of it."""

import pytest

from effect_rigs import EARTH
from machines import cart
from rille import store, terrain
from rille.cli.sweep_ground import require_sendable, scene_text
from rille.cli.sweep_prepare import prepare
from rille.model import InputRefused
from rille.model.sheet import validate_sheet
from rille.study import StudySheet

SCENE = """name = "ground"
soil = "lunar_soft"
[base]
kind = "{kind}"
size = ["16 m", "6 m"]
posting = "0.5 m"
"""


@pytest.fixture
def study(tmp_path):
    """Prepares studies of a cart on a base."""
    model = tmp_path / "model.db"
    store.create(model)
    store.write_rover(model, cart(5.0, 0.15, 0.165))
    (tmp_path / "drive.toml").write_text(
        f'name = "drive"\nterrain = "ground"\nduration = "1 s"\ngravity = [0, 0, -{EARTH}]\n', encoding="utf-8"
    )

    def prepared(kind, *vary, **more):
        (tmp_path / "ground.toml").write_text(SCENE.format(kind=kind), encoding="utf-8")
        head = {"name": "s", "model": "model.db", "scenario": "drive.toml", "terrain": "ground.toml", "vary": list(vary)}
        return prepare(validate_sheet(head | more, StudySheet, "sheet"), tmp_path, lambda what, fraction: None)

    return prepared


@pytest.mark.parametrize(
    ("kind", "vary", "more", "words"),
    [
        ("plane", {"name": "base.slope", "low": 0, "high": 1.6}, {}, ["base.slope = 1.6", "89 deg"]),
        ("fractal", {"name": "base.hurst", "values": [0.5, 1.5]}, {}, ["base.hurst = 1.5", "hurst"]),
        ("fractal", {"name": "base.median_slope", "low": 0, "high": 0.2}, {"set": {"base.hurst": 1.5}}, ["what is set", "hurst"]),
    ],
)
def test_ground_that_cannot_be_is_refused_at_once(study, kind, vary, more, words):
    with pytest.raises(InputRefused) as caught:
        study(kind, vary, **more)
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_ground_that_nobody_drives_on_is_refused(study, tmp_path):
    """The model has a ground of the scenario's name; what varies is another one."""
    file = tmp_path / "ground.toml"
    file.write_text(SCENE.format(kind="plane").replace('"ground"', '"floor"'), encoding="utf-8")
    store.write_terrain(tmp_path / "model.db", terrain.build(file))
    (tmp_path / "drive.toml").write_text((tmp_path / "drive.toml").read_text().replace('"ground"', '"floor"'), encoding="utf-8")
    with pytest.raises(InputRefused, match="stands on 'floor', not on the scene of the study, 'ground'"):
        study("plane", {"name": "base.slope", "values": [0.0, 0.1]})


def test_grounds_come_in_an_order_that_is_none(study):
    """Cases on one ground together; the first half of 40 grounds from 0 to 0.4 has a middle that is nobody's end: of 20 drawn at random
    the mean lies within 0.2 +- 4 x 0.115 / sqrt(20) / sqrt(2), the last factor for drawing half of all.
    """
    vary = [{"name": "base.slope", "low": 0, "high": 0.4}, {"name": "body.chassis.mass", "values": [9, 10]}]
    prepared = study("plane", *vary, design="grid", levels=40)
    slopes = [case.values[0] for case in prepared.ordered(prepared.cases)]
    assert all(a == b for a, b in zip(slopes[::2], slopes[1::2], strict=True))
    assert abs(sum(slopes[:40]) / 40 - 0.2) < 0.075
    assert slopes != sorted(slopes)
    assert prepared.ordered(prepared.cases[20:]) == [case for case in prepared.ordered(prepared.cases) if case.number >= 20]


def test_ground_made_from_files_is_not_sent(tmp_path):
    scene = tmp_path / "ground.toml"
    scene.write_text(SCENE.format(kind="plane"), encoding="utf-8")
    require_sendable(scene_text(scene))
    scene.write_text(SCENE.format(kind="dem") + 'file = "moon.tif"\n', encoding="utf-8")
    with pytest.raises(InputRefused, match=r"moon\.tif"):
        require_sendable(scene_text(scene))
