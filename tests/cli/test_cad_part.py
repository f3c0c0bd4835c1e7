"""Parts that are used again: from a model into the library, from the library onto a sheet."""

import json
from pathlib import Path

import pytest

from command import assert_refused, rille


@pytest.fixture(scope="module")
def rover(repository, tmp_path_factory) -> Path:
    """The example rover."""
    path = tmp_path_factory.mktemp("rover") / "rover.db"
    done = rille("cad", "build", repository / "examples/rover/rover.toml", "-o", path)
    assert done.returncode == 0, done.stderr
    return path


@pytest.fixture
def library(tmp_path, monkeypatch) -> Path:
    """A part library that does not exist yet."""
    path = tmp_path / "library" / "parts.db"
    monkeypatch.setenv("RILLE_PARTS", str(path))
    return path


def data(*arguments):
    """What the command prints with ``--json``."""
    done = rille(*arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_part_travels_from_one_model_to_another(rover, library, tmp_path):
    assert data("cad", "part", "list") == []
    added = data("cad", "part", "add", rover, "antenna", "--as", "dish")
    assert added["done"] == "added"
    assert added["mass_kg"] == pytest.approx(0.6)
    assert [row["part"] for row in data("cad", "part", "list")] == ["dish"]
    sheet = tmp_path / "mast.toml"
    sheet.write_text('# my own words stay\n[[body]]\nname = "mast"\n')
    data("cad", "part", "use", "dish", "--sheet", sheet, "--body", "mast", "--at", "0, 0, 1.2 m", "--rpy", "0, 90 deg, 0")
    assert sheet.read_text().startswith("# my own words stay\n")
    built = data("cad", "build", sheet, "-o", tmp_path / "mast.db")
    assert built["total_mass_kg"] == pytest.approx(0.6)
    assert built["bodies"][0]["mass_from"] == "stated"


def test_refusals_of_the_library(rover, library, tmp_path):
    sheet = tmp_path / "s.toml"
    sheet.write_text('[[body]]\nname = "b"\n')
    use = ("cad", "part", "use", "antenna", "--sheet", sheet, "--body", "b")
    assert_refused(rille(*use), "does not exist yet", "rille cad part add")
    assert_refused(rille("cad", "part", "add", rover, "antena"), "has no part 'antena'; did you mean 'antenna'")
    assert data("cad", "part", "add", rover, "antenna")["done"] == "added"
    assert_refused(rille("cad", "part", "add", rover, "antenna", "--as", "dish"), "the same geometry as part 'antenna'")
    assert_refused(rille("cad", "part", "add", rover, "mast", "--as", "antenna"), "another part 'antenna'", "--force")
    assert data("cad", "part", "add", rover, "mast", "--as", "antenna", "--force")["done"] == "added"
    assert_refused(rille(*use, "--at", "0, 1"), "2 values; give three")
    assert_refused(rille(*use, "--at", "0, 1 kg, 0"), "no length")
    assert sheet.read_text() == '[[body]]\nname = "b"\n'  # a refusal changes nothing
