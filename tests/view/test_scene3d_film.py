"""What films are drawn from: frames, a ghost that is not always there, ruts, words."""

from pathlib import Path

import numpy as np
import pytest

from machines import cart
from rille.model import BodyTrace, InputRefused, Trace
from rille.view import scene3d
from rille.view.scene3d.film import MOST_FRAMES, _numbered, _poses
from rille.view.scene3d.overlay import BACK, letters, panel, stamp
from rille.view.scene3d.ruts import SINKAGE, SLIP, Pressed, slip_color

ROVER = cart(5.0, 0.15, 0.165)
VIEW = scene3d.View(center=(100.0, 0.0), reach=5.0, origin=(100.0, 0.0, 2.0))


def standing(first, last):
    """A run whose bodies move along x at 1 m/s."""
    time = np.linspace(first, last, 11)
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (11, 1))
    way = np.column_stack([100 + time, 0 * time, 0 * time + 2])
    bodies = tuple(
        BodyTrace(name=b.name, position=way + b.frame, rotation=turned, velocity=way, angular_velocity=way) for b in ROVER.bodies
    )
    return Trace(run_id=1, scenario="s", status="done", message="", step=0.1, time=time, bodies=bodies, joints=(), wheels=(), events=())


def test_frames_are_evenly_spaced_and_both_ends_are_there():
    take = scene3d.Take(start=2.0, stop=3.0, speed=0.5, fps=10)
    assert take.count == 21
    assert take.times()[[0, 1, -1]] == pytest.approx([2.0, 2.05, 3.0])


def test_a_film_that_never_ends_is_refused(tmp_path):
    take = scene3d.Take(start=0.0, stop=10.0, speed=1e-3, fps=100)
    with pytest.raises(InputRefused, match=f"1000001 frames; it must have at most {MOST_FRAMES}"):
        scene3d.shoot(Path(tmp_path / "f.mp4"), b"", ROVER, standing(0, 10), VIEW, take)
    assert list(tmp_path.iterdir()) == []


def test_stills_that_are_a_millisecond_apart_are_different_files():
    names = [path.name for path in _numbered(Path("s.png"), np.array([0.1, 1234.561, 1234.562]))]
    assert names == ["s-0.1s.png", "s-1234.561s.png", "s-1234.562s.png"]


def test_a_ghost_is_nowhere_before_it_begins_and_after_it_ends():
    positions, rotations = _poses(standing(2, 4), ROVER, VIEW, np.array([1.0, 2.0, 3.0, 5.0]))
    assert np.isnan(positions[:, [0, 3]]).all()
    assert positions[0, 1:3, 0] - ROVER.bodies[0].frame[0] == pytest.approx([2.0, 3.0])
    assert np.isfinite(rotations).all()


def test_a_rut_is_as_wide_as_the_wheel_as_deep_as_it_sank_and_has_the_colour_of_its_slip():
    """Along x at y = 0: cells wholly below the wheel are pressed by all of its sinkage, those at its edge by their share."""
    rows, columns, posting, width, sinkage = 41, 101, 0.05, 0.3, 0.02
    x, y = np.meshgrid(np.arange(columns) * posting, 1.0 - np.arange(rows) * posting)
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.5)])
    grid = {"rows": rows, "columns": columns, "posting_x": posting, "posting_y": posting, "x_west": 0.0, "y_north": 1.0}
    pressed = Pressed(points, np.full((x.size, 3), 200, np.uint8), grid)
    track = np.zeros((21, 11))
    track[:, 0], track[:, 3], track[:, SINKAGE], track[:, SLIP] = np.linspace(1.0, 4.0, 21), 0.5, sinkage, 0.7
    assert pressed.press(track[None], 20, [width])
    depth = (0.5 - pressed.points[:, 2]).reshape(rows, columns)
    across = depth[:, 50]  # at x = 2.5 m, in the middle of the way
    assert across[np.abs(y[:, 0]) < width / 2 - posting / 2 - 1e-9] == pytest.approx(sinkage)
    assert across[np.abs(y[:, 0]) > width / 2 + posting / 2 + 1e-9] == pytest.approx(0.0)
    assert across.sum() * posting == pytest.approx(sinkage * width, rel=1e-6)  # what lies below the edges is shared rightly
    red, green, blue = pressed.colors.reshape(rows, columns, 3)[20, 50].astype(int)
    assert red > green > blue
    assert (slip_color(0.7) == [226, 81, 46]).all()
    assert pressed.height(np.array([2.5]), np.array([0.0]))[0] == pytest.approx(0.5 - sinkage)
    assert not pressed.press(track[None], 20, [width])  # all of it was pressed


def test_words_are_cut_off_where_the_frame_ends():
    frame = np.full((40, 60, 3), 100, np.uint8)
    stamp(frame, panel([[("a very long title indeed", (255, 255, 255))]], letters(40)), 50, 30)
    assert (frame[:30] == 100).all()
    assert (frame[32:, 54:] != 100).any()
    assert BACK[3] < 255  # and what is behind shows through
