"""The example "Landing site near Aristarchus": on real ground, and its twin on synthetic ground for where the clip is absent."""

import tomllib

import numpy as np
import pytest

from rille import terrain

FOLDER = "examples/terrain"


def page(repository, name):
    return tomllib.loads((repository / FOLDER / f"{name}.toml").read_text())


def test_both_scenes_differ_in_their_ground_only(repository):
    real, twin = page(repository, "aristarchus_landing"), page(repository, "aristarchus_landing_synthetic")
    for scene in (real, twin):
        assert scene.pop("base")["size"] == ["400 m", "300 m"]
        scene.pop("name")
    assert real == twin
    kinds = {form["landform"] for form in real["landform"]} | {crowd["landform"] for crowd in real["population"]}
    assert len(kinds) >= 12  # the issue asks for eight


def test_the_twin_is_built(repository, tmp_path, monkeypatch):
    """At 1 m instead of 0.2 m, which is quick: the pad is level to 1 mm and all rocks and craters are where they were drawn."""
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path))
    text = (repository / FOLDER / "aristarchus_landing_synthetic.toml").read_text()
    scene = tmp_path / "scene.toml"
    scene.write_text(text.replace('posting = "0.2 m"', 'posting = "1 m"'))
    check(terrain.build(scene), (301, 401))


def test_the_real_site_is_built(repository, rille_data, tmp_path, monkeypatch):
    """The same, on the clip; its projection comes along."""
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path))
    monkeypatch.setenv("RILLE_DATA", str(rille_data))
    text = (repository / FOLDER / "aristarchus_landing.toml").read_text()
    scene = tmp_path / "scene.toml"
    scene.write_text(text.replace('posting = "0.2 m"', 'posting = "1 m"'))
    ground = terrain.build(scene)
    check(ground, (301, 401))
    assert "Aristarchus" in ground.crs
    assert ground.map_origin[2] == pytest.approx(-1357, abs=10)


def check(ground, shape):
    assert ground.heights.shape == shape
    assert np.isfinite(ground.heights).all()
    x = ground.x_west + ground.posting_x * np.arange(shape[1])[None, :] - -50
    y = ground.y_north - ground.posting_y * np.arange(shape[0])[:, None] - 75
    cosine, sine = np.cos(np.radians(15)), np.sin(np.radians(15))
    pad = (np.abs(cosine * x + sine * y) < 12.5) & (np.abs(cosine * y - sine * x) < 12.5)
    assert pad.sum() > 500
    rise = np.linalg.lstsq(np.column_stack([np.ones(pad.sum()), (x + 0 * y)[pad], (y + 0 * x)[pad]]), ground.heights[pad], rcond=None)
    assert np.sqrt(rise[1][0] / pad.sum()) < 1e-3
    assert {crowd.name for crowd in ground.populations} == {"small craters", "rocks"}
    assert len(ground.populations[0].x) > 1000
