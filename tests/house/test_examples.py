"""Examples stay alive: each runs as its README says."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

RILLE = str(Path(sys.executable).parent / "rille")


def rille(*arguments):
    """Run the command; return its JSON."""
    done = subprocess.run([RILLE, *map(str, arguments), "--json"], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def drive(folder, examples, scene, scenario):
    """cad build, terrain build, run, view."""
    database = folder / "rover.db"
    built = rille("cad", "build", examples / "rover/rover.toml", "-o", database)
    rille("terrain", "build", examples / "terrain" / scene, "-o", database, "--geotiff", folder / "terrain.tif")
    run = rille("run", database, "--scenario", examples / "first_drive" / scenario, "--duration", "10")
    pictures = rille("view", database, "-o", folder / "pictures")
    return built, run, pictures


def test_first_drive(repository, tmp_path):
    built, run, pictures = drive(tmp_path, repository / "examples", "composed.toml", "traverse.toml")
    assert built["total_mass_kg"] == pytest.approx(140, abs=5)
    assert run["status"] == "done"
    assert run["summary"]["distance"] > 0.5
    assert pictures["notes"] == []
    assert {Path(p).name for p in pictures["pictures"]} == {"traces.png", "map.png", "scene.png", "rover.png"}


def test_drive_on_the_real_lunar_dem(repository, rille_data, tmp_path):
    _, run, pictures = drive(tmp_path, repository / "examples", "lunar_dem.toml", "lunar_dem.toml")
    assert run["summary"]["distance"] > 1.0
    assert len(pictures["pictures"]) == 4


def test_double_pendulum_is_released_and_compared(repository, rille_data, tmp_path):
    examples = repository / "examples/double_pendulum"
    database = tmp_path / "pendulum.db"
    built = rille("cad", "build", examples / "pendulum.toml", "-o", database)
    assert [body["body"] for body in built["bodies"]] == ["stand", "upper_link", "lower_link"]
    assert rille("run", database, "--scenario", examples / "release.toml")["status"] == "done"
    assert "scene.png" in " ".join(rille("view", database, "-o", tmp_path / "pictures")["pictures"])
    done = subprocess.run([sys.executable, str(examples / "compare.py")], capture_output=True, text=True, check=True)
    assert done.stdout.count("\n") == 9
    assert "identified" in done.stdout
