"""Evaluated ground is kept: an edit evaluates what changed, an interruption loses nothing, a full disk is a sentence."""

import errno
import os

import numpy as np
import pytest

from rille.model import InputRefused
from rille.terrain import surface
from rille.terrain.base.plane import Plane
from rille.terrain.composition import compose
from rille.terrain.grid import Grid
from rille.terrain.surface import HeightFile, evaluate, evaluate_aside, kept
from terrain_forms import at, crowd, form

GRID = Grid(n_rows=1100, n_cols=1300, posting_x=0.05, posting_y=0.05, x_west=-32.0, y_north=27.0)


class Counting:
    """A base that counts the values that it was asked for, and may fail."""

    def __init__(self, stop_after=None):
        self.plane, self.asked, self.stop_after = Plane(slope=0.1, direction=1.0), 0, stop_after
        self.digest = self.plane.digest

    def window(self, grid, window):
        self.asked += window.shape[0] * window.shape[1]
        if self.stop_after is not None and self.asked > self.stop_after:
            raise KeyboardInterrupt
        return self.plane.window(grid, window)

    def at(self, x, y):
        return self.plane.at(x, y)


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache"))


def made(scene, *items, base=None, counts=None):
    """Heights of items, evaluated with what is kept of the scene."""
    with kept(scene) as store:
        composition, datums = compose(GRID, base or Plane(slope=0.1, direction=1.0), items, {}, store.datums)
        counted = []
        heights = evaluate(composition, store, datums, lambda what, fraction: counted.append(fraction))
        if counts is not None:
            counts.append(len(counted))
        return heights


def fresh(*items):
    """The same, evaluated at once without anything kept."""
    composition, _ = compose(GRID, Plane(slope=0.1, direction=1.0), items, {})
    return composition.render(GRID, GRID.whole)


def test_an_edit_gives_the_bytes_of_a_fresh_evaluation(tmp_path):
    """Add, move, reorder and remove landforms; after each, the kept heights equal those made from nothing, bit for bit."""
    scene = tmp_path / "scene.toml"
    a, b, c = at(form(), 1, 1, 0.4), at(form("replace"), -2, 1, 0.8, 4.0), at(form("drape"), -1, -1, 1.0, 3.0)
    moved = at(form(), 4, -3, 0.4)
    many = crowd()
    for items in ([many, a, b, c], [many, moved, b, c], [many, b, moved, c], [many, c, b], [a], [crowd(seed=2), a], []):
        assert made(scene, *items).tobytes() == fresh(*items).tobytes()


def test_an_edit_evaluates_only_what_changed(tmp_path):
    """Moving a block of 2 m x 1 m asks the base for nothing (it is kept) and evaluates two windows of at most four tiles each."""
    scene = tmp_path / "scene.toml"
    counts = []
    base = Counting()
    made(scene, at(form()), base=base, counts=counts)
    assert base.asked == GRID.n_rows * GRID.n_cols
    made(scene, at(form(), 3, 2), base=base, counts=counts)
    made(scene, at(form(), 3, 2), base=base, counts=counts)
    assert base.asked == GRID.n_rows * GRID.n_cols
    assert counts[0] == len(GRID.tiles(surface.TILE))
    assert 1 <= counts[1] <= 8
    assert counts[2] == 0


def test_an_interruption_loses_nothing(tmp_path):
    """Stopped in the middle, what was made stays; the next evaluation makes the rest and the bytes are those of an undisturbed one."""
    scene = tmp_path / "scene.toml"
    items = [crowd(), at(form("replace"), 2, 2)]
    base = Counting(stop_after=GRID.n_rows * GRID.n_cols // 2)
    with pytest.raises(KeyboardInterrupt):
        made(scene, *items, base=base)
    base.stop_after, before = None, base.asked
    assert made(scene, *items, base=base).tobytes() == fresh(*items).tobytes()
    assert base.asked - before < GRID.n_rows * GRID.n_cols
    assert made(scene, *items, at(form())).tobytes() == fresh(*items, at(form())).tobytes()  # the kept base is complete, too


def test_a_process_that_is_killed_loses_what_it_made_in_the_last_second(tmp_path, monkeypatch):
    """What was on disk when half of the tiles were made is put back, as if the process had ended there: the rest is made, not all. At most
    two tiles for each processor were under way."""
    monkeypatch.setattr(surface, "RECORDED", 0.0)
    monkeypatch.setattr(surface, "TILE", 100)
    scene, items, base = tmp_path / "scene.toml", [crowd(), at(form("replace"), 2, 2)], Counting()
    with kept(scene) as store:
        states = []
        composition, datums = compose(GRID, base, items, {})
        evaluate(composition, store, datums, lambda what, fraction: states.append((store.folder / "state.json").read_bytes()))
        whole = base.asked
        (store.folder / "state.json").write_bytes(states[len(states) // 2])
    assert made(scene, *items, base=base).tobytes() == fresh(*items).tobytes()
    assert base.asked - whole <= 0.55 * whole
    assert made(scene, *items, at(form())).tobytes() == fresh(*items, at(form())).tobytes()  # the kept base is complete, too


def test_a_full_disk_is_one_sentence_and_loses_nothing(tmp_path, monkeypatch):
    scene = tmp_path / "scene.toml"
    made(scene, at(form()))

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(os, "pwrite", full)
        with pytest.raises(InputRefused, match="No space left on device; set RILLE_CACHE"):
            made(scene, at(form(), 3, 2))
    assert made(scene, at(form(), 3, 2)).tobytes() == fresh(at(form(), 3, 2)).tobytes()


def test_a_scene_in_use_is_evaluated_aside(tmp_path):
    """While another evaluation holds the scene (here: this one), a second one neither waits nor disturbs it."""
    scene = tmp_path / "scene.toml"
    with kept(scene) as first:
        assert made(scene, at(form())).tobytes() == fresh(at(form())).tobytes()
        assert not (first.folder / "heights.f64").exists()


def test_a_disk_that_is_full_for_a_larger_base_leaves_no_empty_ground(tmp_path, monkeypatch):
    """The room for other ground cannot be had; back at the ground of before, its heights are those of a fresh evaluation, not zeros."""
    scene = tmp_path / "scene.toml"
    made(scene, at(form()))

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(os, "posix_fallocate", full)
        with pytest.raises(InputRefused, match="No space left on device; set RILLE_CACHE"):
            made(scene, at(form()), base=Plane(slope=0.2))
    assert made(scene, at(form())).tobytes() == fresh(at(form())).tobytes()


def test_killed_while_room_is_made_for_another_base(tmp_path, monkeypatch):
    """Killed after the files were made anew and before their state was written: the ground of before is evaluated again."""
    scene = tmp_path / "scene.toml"
    made(scene, at(form()))

    def killed(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as broken:
        broken.setattr(surface.Kept, "save", killed)
        with pytest.raises(KeyboardInterrupt):
            made(scene, at(form()), base=Plane(slope=0.2))
    assert made(scene, at(form())).tobytes() == fresh(at(form())).tobytes()


def test_what_cannot_be_read_is_made_anew(tmp_path):
    """A broken state, heights or a base that someone took away."""
    scene = tmp_path / "scene.toml"
    made(scene, at(form()))
    with kept(scene) as store:
        (store.folder / "state.json").write_text("{")
    assert made(scene, at(form())).tobytes() == fresh(at(form())).tobytes()
    for name in ("heights.f64", "base.f64"):
        with kept(scene) as store:
            (store.folder / name).unlink()
        assert made(scene, at(form(), 1)).tobytes() == fresh(at(form(), 1)).tobytes()
        made(scene, at(form()))


def test_a_region_that_a_killed_process_left_behind_goes(tmp_path, monkeypatch):
    """Its lock fell with the process; a region that is in use keeps its file, and loses it with its heights."""
    monkeypatch.setattr(surface, "IN_MEMORY", 1000)
    composition, _ = compose(GRID, Plane(), [], {})
    heights = evaluate_aside(composition, GRID)
    left = heights.path.parent.with_name("region-left")
    left.mkdir()
    (left / "lock").touch()
    with kept(tmp_path / "scene.toml"):
        pass
    assert not left.exists()
    assert not heights[3:5, 7:9].any()
    folder = heights.path.parent
    del heights
    assert not folder.exists()


def test_tidying_passes_over_what_is_in_use(tmp_path, monkeypatch):
    """A scene that is in use stays; an older one that is not goes."""
    with kept(tmp_path / "old") as old:
        pass
    with kept(tmp_path / "used") as used:
        monkeypatch.setattr(surface, "KEPT_BYTES", -1)
        made(tmp_path / "new", at(form()))
        assert used.folder.exists()
        assert not old.folder.exists()


def test_large_ground_stays_in_its_file(tmp_path, monkeypatch):
    """Above the limit, heights are read where they are asked for, by slices and by index arrays; a region likewise."""
    monkeypatch.setattr(surface, "IN_MEMORY", 1000)
    whole = fresh(at(form()), crowd())
    heights = made(tmp_path / "scene.toml", at(form()), crowd())
    assert isinstance(heights, HeightFile)
    assert np.array_equal(heights[10:20, 5:9], whole[10:20, 5:9])
    rows, columns = np.array([[3], [7]]), np.array([1, 2])
    assert np.array_equal(heights[rows, columns], whole[rows, columns])
    composition, _ = compose(GRID, Plane(slope=0.1, direction=1.0), [at(form()), crowd()], {})
    aside = evaluate_aside(composition, GRID)
    assert isinstance(aside, HeightFile)
    assert np.array_equal(aside[:, :], whole)
