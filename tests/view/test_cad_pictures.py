"""Pictures of assemblies: marks stand where the scene has them, labels do not cover each other."""

import itertools

import numpy as np
import pytest

from rille.view.cad_pictures import SIZE, AxisMark, Solid, WheelMark, draw_assembly, project, spread
from rille.view.drawing import Camera

CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)


def cube(center, half, color):
    return Solid(vertices=np.array(center) + half * CUBE, triangles=FACES, color=color)


def test_the_focus_is_in_the_middle_and_up_is_up():
    camera = Camera(position=(10.0, 0.0, 0.0), focus=(0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), view_angle=90.0)
    pixels = project(np.array([[0, 0, 0], [0, 0, 1.0], [0, 1.0, 0]]), camera)
    assert pixels[0] == pytest.approx([SIZE[0] / 2, SIZE[1] / 2])
    # Half the height is tan(45 deg) x 10 m: one metre is a tenth of it. Looking along -x, y is to the right.
    assert pixels[1] == pytest.approx([SIZE[0] / 2, SIZE[1] / 2 - SIZE[1] / 20])
    assert pixels[2] == pytest.approx([SIZE[0] / 2 + SIZE[1] / 20, SIZE[1] / 2])


def test_projection_is_that_of_the_renderer(tmp_path):
    """A small red cube away from the middle is drawn where ``project`` says."""
    from matplotlib.image import imread

    from rille.view.drawing import Drawing, Item, draw

    camera = Camera(position=(6.0, -8.0, 5.0), focus=(0.0, 0.0, 0.0), view_angle=30.0)
    center = np.array([1.0, 0.6, -0.4])
    item = Item(vertices=center + 0.05 * CUBE, triangles=FACES, color="#ff0000", lit=False)
    path = tmp_path / "dot.png"
    assert draw({path: Drawing(items=[item], camera=camera, size=SIZE, background=("#ffffff", "#ffffff"))}) == []
    rows, columns = np.nonzero(imread(path)[..., 1] < 0.5)
    assert np.array([columns.mean(), rows.mean()]) == pytest.approx(project(center, camera)[0], abs=2.0)


def test_labels_keep_their_order_and_distance():
    placed = spread([100.0, 101.0, 99.0, 400.0], 30.0, 0.0, 1000.0)
    order = np.argsort([100.0, 101.0, 99.0, 400.0])
    assert np.all(np.diff(np.array(placed)[order]) >= 30.0 - 1e-9)
    assert placed[3] == 400.0
    crowded = spread([990.0] * 5, 30.0, 0.0, 1000.0)
    assert max(crowded) <= 1000.0
    assert sorted(np.diff(sorted(crowded))) == pytest.approx([30.0] * 4)
    assert spread([], 30.0, 0.0, 10.0) == []


def test_a_picture_shows_parts_axes_and_wheels(tmp_path):
    from matplotlib.image import imread

    path = tmp_path / "machine.png"
    axis = AxisMark(point=np.zeros(3), axis=np.array([0.0, 1.0, 0.0]), kind="hinge", label="elbow 0.93")
    slide = AxisMark(point=np.array([3.0, 0, 0]), axis=np.array([1.0, 0.0, 0.0]), kind="prismatic", label="slide 0.31", sure=False)
    wheel = WheelMark(center=np.array([3.0, 0, 0]), axis=np.array([0.0, 1.0, 0.0]), radius=0.8)
    notes = draw_assembly(
        path,
        [cube((0, 0, 0), 1.0, "#4e79a7"), cube((3, 0, 0), 0.7, "#f28e2b")],
        axes=[axis, slide],
        wheels=[wheel],
        title="two cubes",
        legend=[("base", "#4e79a7"), ("arm", "#f28e2b")],
    )
    assert notes == []
    pixels = imread(path)[..., :3]
    assert pixels.shape[:2] == (SIZE[1], SIZE[0])
    assert pixels[5:40, -300:].min() > 0.85  # light background
    red = (pixels[..., 0] > 0.6) & (pixels[..., 1] < 0.15) & (pixels[..., 2] < 0.25)
    blue = (pixels[..., 0] < 0.15) & (pixels[..., 1] < 0.45) & (pixels[..., 2] > 0.6)
    assert red.sum() > 200
    assert blue.sum() > 100


def test_nothing_to_draw_is_a_note(tmp_path):
    assert "no part has a surface" in draw_assembly(tmp_path / "no.png", [])[0]
