"""Does a URDF get the wheels that it has, and only these?"""

from dataclasses import replace
from pathlib import Path

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


def test_a_urdf_without_wheels_says_so(rover):
    text = draft_urdf_sheet(rover, [], "arm.urdf")
    assert "no wheel is suggested" in text
    assert "[[wheel]]" not in text


def test_a_step_file_is_no_sheet(repository):
    with pytest.raises(InputRefused, match="does not say what moves; draft a sheet with `rille cad new"):
        build(repository / "examples" / "rover" / "rover.step")
