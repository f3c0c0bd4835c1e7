"""Does a URDF get the wheels that it has, and only these?"""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from command import rille
from rille import store
from rille.cad import build
from rille.cad.exchange import write_urdf
from rille.cad.suggestion.urdf_draft import draft_urdf_sheet, guess_wheels
from rille.model import InputRefused, Rover


@pytest.fixture(scope="module")
def rover(repository) -> Rover:
    return build(repository / "examples" / "rover" / "rover.toml")


def test_wheels_are_found_by_their_collision_cylinders(rover):
    found = {wheel.joint: (wheel.radius, wheel.width) for wheel in guess_wheels(rover)}
    assert found == {wheel.joint: (wheel.radius, wheel.width) for wheel in rover.wheels}


def test_wheels_are_found_by_their_meshes_alone(rover):
    """0.5 mm facets: radius and width within that; steering and rocker hinges have limits, and carry something, so they are none."""
    found = {wheel.joint: wheel for wheel in guess_wheels(replace(rover, collision_shapes=()))}
    assert found.keys() == {wheel.joint for wheel in rover.wheels}
    for wheel in rover.wheels:
        assert found[wheel.joint].radius == pytest.approx(wheel.radius, abs=0.5e-3)
        assert found[wheel.joint].width == pytest.approx(wheel.width, abs=0.5e-3)
        assert (found[wheel.joint].grousers or (0,))[0] == 24


@pytest.mark.parametrize("source", ["cylinders", "meshes"])
def test_a_wheel_stands_where_it_is_drawn_along_its_axis(rover, source, tmp_path):
    """The hinge's point 60 mm inwards, and a hub of a third of the radius about it that is listed first."""
    aside = np.array([0, 0.06, 0])
    joints = tuple(replace(j, point=tuple(j.point - aside)) if j.name.startswith("wheel") else j for j in rover.joints)
    shapes = ()
    if source == "cylinders":
        hubs = [replace(s, size=(s.size[0] / 3, s.size[1])) for s in rover.collision_shapes if s.kind == "cylinder"]
        shapes = (*hubs, *rover.collision_shapes)
    moved = replace(rover, joints=joints, collision_shapes=shapes)
    guesses = guess_wheels(moved)
    found = {wheel.joint: wheel for wheel in guesses}
    assert found.keys() == {wheel.joint for wheel in rover.wheels}
    for wheel in rover.wheels:
        assert found[wheel.joint].radius == pytest.approx(wheel.radius, abs=0.5e-3)
        np.testing.assert_allclose(found[wheel.joint].center, wheel.center, atol=1e-4 if source == "meshes" else 1e-12)
    sheet = tomllib.loads(draft_urdf_sheet(moved, guesses, "rover.urdf"))
    for entry, wheel in zip(sheet["wheel"], guesses, strict=True):
        center = [float(text.removesuffix(" mm")) / 1e3 for text in entry["center"]]
        np.testing.assert_allclose(center, wheel.center, atol=1e-6)


def test_a_wheel_beside_its_hinge_is_none(rover):
    joints = tuple(replace(j, point=(j.point[0] + 0.02, *j.point[1:])) if j.name.startswith("wheel") else j for j in rover.joints)
    assert guess_wheels(replace(rover, joints=joints)) == []


def test_from_a_urdf_to_a_model_with_wheels(rover, tmp_path):
    folder = tmp_path / "exported"
    write_urdf(rover, folder, name="rover", mimic=True)
    urdf = next(Path(folder).glob("*.urdf"))
    sheet = tmp_path / "rover.toml"
    assert rille("cad", "new", urdf, "-o", sheet).returncode == 0
    with pytest.raises(InputRefused, match="nobody has accepted"):
        build(sheet)
    sheet.write_text(sheet.read_text().replace("accepted = false", "accepted = true"))
    done = rille("cad", "build", sheet, "-o", tmp_path / "rover.db")
    assert done.returncode == 0, done.stderr
    built = store.read_rover(tmp_path / "rover.db")
    assert {w.joint: (w.radius, w.width) for w in built.wheels} == {w.joint: (w.radius, w.width) for w in rover.wheels}
    assert sum(b.properties.mass for b in built.bodies) == pytest.approx(sum(b.properties.mass for b in rover.bodies), rel=1e-12)


def test_a_urdf_is_known_by_what_it_holds(rover, tmp_path):
    folder = tmp_path / "exported"
    write_urdf(rover, folder, name="rover", mimic=True)
    other = folder / "robot.xml"
    next(Path(folder).glob("*.urdf")).rename(other)
    assert len(build(other).bodies) == len(rover.bodies)
    done = rille("cad", "new", other, "-o", tmp_path / "sheet.toml", "--picture", tmp_path / "p.png")
    assert done.returncode == 3, done.stderr
    assert "`rille cad preview` draws it" in done.stderr
    done = rille("cad", "inspect", other)
    assert "is XML, not a STEP file; of a URDF, `rille cad new" in done.stderr


def test_a_urdf_without_wheels_says_so(rover):
    text = draft_urdf_sheet(rover, [], "arm.urdf")
    assert "no wheel is suggested" in text
    assert "[[wheel]]" not in text


def test_a_step_file_is_no_sheet(repository):
    with pytest.raises(InputRefused, match="does not say what moves; draft a sheet with `rille cad new"):
        build(repository / "examples" / "rover" / "rover.step")
