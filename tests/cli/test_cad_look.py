"""`rille cad inspect` and `rille cad new` as a user meets them."""

import json

import pytest

from command import assert_refused, rille


@pytest.fixture(scope="module")
def hinge(tmp_path_factory):
    """A plate with a pin and an arm on it."""
    import cadquery as cq

    base = cq.Workplane().box(120, 60, 10).union(cq.Workplane(origin=(10, 5, 5)).circle(6).extrude(12))
    arm = cq.Workplane(origin=(40, 5, 5)).rect(100, 20).extrude(8).cut(cq.Workplane(origin=(10, 5, 0)).circle(6.02).extrude(30))
    path = tmp_path_factory.mktemp("look") / "hinge.step"
    cq.Assembly(name="m").add(base, name="base").add(arm, name="arm").export(str(path))
    return path


def test_inspect_prints_the_tree_and_draws(hinge, tmp_path):
    picture = tmp_path / "hinge.png"
    done = rille("cad", "inspect", hinge, "--picture", picture)
    assert done.returncode == 0, done.stderr
    assert "m/  (2 instances)" in done.stdout
    assert "2 solids" in done.stdout
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_inspect_as_json(hinge):
    value = json.loads(rille("cad", "inspect", hinge, "--json").stdout)
    assert value["instances"] == 2
    assert {p["name"] for p in value["parts"]} == {"base", "arm"}


def test_new_drafts_a_sheet_that_builds_once_it_is_accepted(hinge, tmp_path):
    """The way of a modeler: new, read, accept, build."""
    sheet, picture, database = tmp_path / "hinge.toml", tmp_path / "hinge.png", tmp_path / "hinge.db"
    done = rille("cad", "new", hinge, "-o", sheet, "--picture", picture)
    assert done.returncode == 0, done.stderr
    assert "base -> arm" in done.stdout
    assert "accepted = true" in done.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert_refused(rille("cad", "build", sheet, "-o", database), "accepted")
    assert not database.exists()
    sheet.write_text(sheet.read_text().replace("accepted = false", "accepted = true", 1))
    built = rille("cad", "build", sheet, "-o", database, "--json")
    assert built.returncode == 0, built.stderr
    assert {b["body"] for b in json.loads(built.stdout)["bodies"]} == {"base", "arm"}


def test_new_never_writes_over_a_sheet_unasked(hinge, tmp_path):
    sheet = tmp_path / "mine.toml"
    sheet.write_text("# my work\n")
    assert_refused(rille("cad", "new", hinge, "-o", sheet), "mine.toml", "--force")
    assert sheet.read_text() == "# my work\n"
    assert rille("cad", "new", hinge, "-o", sheet, "--force").returncode == 0
    assert "[[joint]]" in sheet.read_text()


def test_new_as_json(hinge, tmp_path):
    value = json.loads(rille("cad", "new", hinge, "-o", tmp_path / "a.toml", "--json").stdout)
    (joint,) = value["joints"]
    assert joint["kind"] == "hinge"
    assert joint["active"]
    assert joint["point_m"][:2] == pytest.approx([0.010, 0.005], abs=1e-8)
    assert joint["evidence"]
    assert value["root"] == "base"


def test_new_refuses_what_it_cannot_use(tmp_path):
    missing = tmp_path / "no.step"
    assert_refused(rille("cad", "new", missing), "no.step")
    text = tmp_path / "text.step"
    text.write_text("hello")
    assert_refused(rille("cad", "new", text), "text.step")
