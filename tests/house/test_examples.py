"""Examples stay alive: each runs as its README says."""

import json
import os
import signal
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
    assert {Path(p).name for p in pictures["pictures"]} == {"traces.png", "map.png", "ruts.png", "scene.png", "rover.png"}


def test_drive_on_the_real_lunar_dem(repository, rille_data, tmp_path):
    _, run, pictures = drive(tmp_path, repository / "examples", "lunar_dem.toml", "lunar_dem.toml")
    assert run["summary"]["distance"] > 1.0
    assert len(pictures["pictures"]) == 5


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


def python(script, *arguments):
    """Run a script of the examples; return what it prints."""
    done = subprocess.run([sys.executable, str(script), *map(str, arguments)], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_comparison_of_the_paper(repository, tmp_path):
    """The rig against adaptive quadrature: within 1 % of the load is asked; 1e-6 is reached at every mass."""
    lines = python(repository / "examples/bench/paper.py", tmp_path / "paper.png").splitlines()
    assert [line.split()[0] for line in lines[1:5]] == ["3", "5", "7", "20"]
    assert all(float(number) < 1e-6 for line in lines[1:5] for number in line.split()[1:])
    assert (tmp_path / "paper.png").stat().st_size > 20_000


def test_soils_are_fitted_to_real_benches(repository, rille_data, tmp_path):
    for name in ("cmu", "tohoku"):
        script = repository / f"examples/soil_fit/{name}.sh"
        environment = os.environ | {"RILLE": RILLE, "RILLE_DATA": str(rille_data)}
        done = subprocess.run([script, tmp_path], capture_output=True, text=True, env=environment, timeout=300, check=False)
        assert done.returncode == 0, done.stderr
        assert "held out" in done.stdout
        assert (tmp_path / f"{name}.png").is_file()
        assert (tmp_path / f"{name}_sand.toml").read_text().count("fitted, +-") == 2


def test_slope_climb_is_compared(repository, rille_data, tmp_path, monkeypatch):
    """Rover and bench agree within 0.02 of slip at every slope; how far both are from the measurement is what the example reports."""
    monkeypatch.setenv("RILLE_DATA", str(rille_data))
    lines = python(repository / "examples/slope_climb/climb.py", tmp_path / "climb.png").splitlines()
    rows = [[float(number) for number in line.split()] for line in lines[1:5]]
    assert [row[0] for row in rows] == [11, 12, 13, 14]
    assert all(abs(rover - bench) < 0.02 for _, _, rover, bench, _, _ in rows)
    assert (tmp_path / "climb.png").is_file()


def test_notebook_of_the_solver_in_process(repository, tmp_path):
    examples = repository / "examples"
    database = tmp_path / "rover.db"
    rille("cad", "build", examples / "rover/rover.toml", "-o", database)
    rille("terrain", "build", examples / "terrain/composed.toml", "-o", database)
    rille("run", database, "--scenario", examples / "first_drive/traverse.toml", "--duration", "1")
    assert "with slip-sinkage" in python(examples / "in_process/notebook.py", database)


def test_a_session_is_steered_from_a_console_and_hooks_are_called(repository, tmp_path):
    """The control platform of examples/live against `rille serve`; then the hooks; then the page of it all."""
    examples = repository / "examples"
    database = tmp_path / "rover.db"
    rille("cad", "build", examples / "rover/rover.toml", "-o", database)
    rille("terrain", "build", examples / "terrain/composed.toml", "-o", database)
    scenario = examples / "first_drive/traverse.toml"
    command = [RILLE, "serve", str(database), "--scenario", str(scenario), "--port", "0"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        address = server.stdout.readline().strip()
        assert address.startswith("http://127.0.0.1:"), server.stderr.read()
        for _ in range(100):  # the address is printed before the session listens
            if (
                subprocess.run(
                    [sys.executable, "-c", f"import urllib.request; urllib.request.urlopen('{address}')"], capture_output=True
                ).returncode
                == 0
            ):
                break
        printed = python(examples / "live/console.py", address)
        assert "run 1 of scenario 'live-1' is in the database" in printed
    finally:
        server.send_signal(signal.SIGINT)
        assert server.wait(30) == 0
    again = rille("run", database, "--scenario", "live-1")
    assert again["status"] == "done"
    assert again["time_reached"] > 41
    hooked = rille("run", database, "--scenario", scenario, "--hooks", examples / "live/ease_off.py")
    assert (hooked["status"], hooked["scenario"]) == ("stopped", "traverse-hooks-1")
    assert hooked["message"].startswith("5 m at")
    shown = rille("replay", database, "--run", "1", "--against", "3", "-o", tmp_path / "page.html", "-o", tmp_path / "rover.glb")
    assert len(shown["files"]) == 2


def test_soft_ground_is_swept(repository, tmp_path):
    """The study of examples/sweep with two base samples instead of 64."""
    for file in (repository / "examples/sweep").glob("*.toml"):
        (tmp_path / file.name).write_text(file.read_text().replace("samples = 64", "samples = 2"))
    rille("cad", "build", repository / "examples/rover/rover.toml", "-o", tmp_path / "rover.db")
    swept = rille("sweep", tmp_path / "soft_ground.toml", "--figures", tmp_path / "figures", "--parquet", tmp_path / "s.parquet")
    assert (tmp_path / "s.parquet").is_file()
    assert {path.name for path in (tmp_path / "figures").iterdir()} >= {"study.html", "maps.png", "envelopes.png"}
    assert json.dumps(swept).count("distance")
