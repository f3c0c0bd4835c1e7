"""The drafted sheet: it parses, says what is guessed, is refused until accepted, and then builds."""

import tomllib

import pytest

from rille.cad import build, read_step
from rille.cad.sheet import RoverSheet
from rille.cad.suggestion.draft import draft_sheet, shortest_patterns
from rille.cad.suggestion.suggest import suggest
from rille.model import InputRefused


@pytest.fixture(scope="module")
def odd_machine(tmp_path_factory):
    """Parts with names that mean something to TOML, to patterns and to terminals; a hinge, a screw that holds a lid, a free cube."""
    import cadquery as cq

    base = cq.Workplane().box(120, 60, 10).union(cq.Workplane(origin=(10, 5, 5)).circle(6).extrude(12))
    base = base.cut(cq.Workplane(origin=(-45, 0, -10)).circle(2.1).extrude(30))
    arm = cq.Workplane(origin=(40, 5, 5)).rect(100, 20).extrude(8).cut(cq.Workplane(origin=(10, 5, 0)).circle(6.02).extrude(30))
    lid = cq.Workplane(origin=(-45, 0, 7)).box(20, 50, 4).cut(cq.Workplane(origin=(-45, 0, 0)).circle(2.75).extrude(30))
    screw = cq.Workplane(origin=(-45, 0, 9)).circle(4.25).extrude(4).union(cq.Workplane(origin=(-45, 0, -3)).circle(2.5).extrude(13))
    cube = cq.Workplane(origin=(-30, 80, 0)).box(12, 12, 12)
    machine = (
        cq.Assembly(name="rig")
        .add(base, name="base [v*]")
        .add(cq.Assembly(name="arm group").add(arm, name='arm "1"'))
        .add(lid, name="lid")
        .add(screw, name="M5x16")
        .add(cube, name="cube")
    )
    path = tmp_path_factory.mktemp("odd") / "odd.step"
    machine.export(str(path))
    return path


@pytest.fixture(scope="module")
def drafted(odd_machine):
    assembly = read_step(odd_machine)
    return assembly, draft_sheet(assembly, suggest(assembly), odd_machine.name)


def test_the_draft_is_a_sheet_that_waits_for_a_person(drafted, odd_machine):
    _, text = drafted
    page = RoverSheet.model_validate(tomllib.loads(text))
    assert page.accepted is False
    sheet = odd_machine.with_name("waiting.toml")
    sheet.write_text(text)
    with pytest.raises(InputRefused, match="accepted"):
        build(sheet)


def test_an_accepted_draft_builds(drafted, odd_machine):
    assembly, text = drafted
    sheet = odd_machine.with_name("accepted.toml")
    sheet.write_text(text.replace("accepted = false", "accepted = true", 1))
    rover = build(sheet)
    assert [j.kind for j in rover.joints] == ["hinge"]
    assert {i.path for i in rover.instances} == {i.path for i in assembly.instances}
    (joint,) = rover.joints
    assert joint.point[:2] == pytest.approx((0.010, 0.005), abs=1e-8)
    assert joint.axis == pytest.approx((0, 0, 1), abs=1e-8)


def test_the_draft_says_what_is_guessed_assumed_and_unsure(drafted):
    _, text = drafted
    assert "# GUESSED: " in text
    assert "ASSUMED: nothing holds 'cube'" in text
    assert "SUGGESTED (confidence 0." in text
    unsure = text[text.index("UNSURE (confidence") :]
    active = [line for line in unsure.splitlines() if line and not line.startswith("#")]
    assert not any(line.startswith("[[joint]]") for line in active)
    assert max(len(line) for line in text.splitlines() if line.startswith("# ")) < 400


def test_unsure_joints_can_be_uncommented(drafted, odd_machine):
    """The commented tables of an unsure joint are themselves a valid piece of a sheet."""
    _, text = drafted
    start = text.index("UNSURE (confidence")
    block = text[start : text.index("# ---", start)].splitlines()
    keys = [
        line[2:] for line in block if line.startswith(("# [[", "# name", "# parts", "# kind", "# parent", "# child", "# point", "# axis"))
    ]
    page = tomllib.loads("\n".join(keys))
    assert page["joint"][0]["child"] == page["body"][0]["name"]
    assert page["joint"][0]["kind"] == "hinge"


def test_every_part_is_offered_with_its_mass(drafted):
    """Volume of the cube: 1.728 cm^3, 4.666 g of aluminium at 2.7 g/cm^3."""
    _, text = drafted
    at = text.index('# match = "cube"')
    assert "1.728 cm^3; 4.666 g as aluminium (guessed)" in text[at : at + 120]


def test_the_example_rover_drafts_to_the_mechanism_of_its_sheet(repository, tmp_path):
    step = repository / "examples" / "rover" / "rover.step"
    assembly = read_step(step)
    text = draft_sheet(assembly, suggest(assembly), str(step))
    sheet = tmp_path / "drafted.toml"
    sheet.write_text(text.replace("accepted = false", "accepted = true", 1))
    made, truth = build(sheet), build(step.with_suffix(".toml"))
    assert {(j.parent, j.child) for j in made.joints} == {(j.parent, j.child) for j in truth.joints}
    assert {i.path: i.body for i in made.instances} == {i.path: i.body for i in truth.instances}
    assert len(made.wheels) == len(truth.wheels)
    assert all(w.grouser is not None and w.grouser.count == 24 for w in made.wheels)


def test_patterns_select_just_what_is_wanted():
    paths = ["r/a/x", "r/a/y", "r/b/x:1", "r/b/x:2", "r/b/z", "r/x[1]", "r/*", "r/star"]
    assert shortest_patterns([0, 1], paths) == ["r/a"]
    assert shortest_patterns(range(8), paths) == ["r"]
    assert shortest_patterns([2, 3], paths) == ["r/b/x*"]
    assert shortest_patterns([2], paths) == ["r/b/x:1"]
    from rille.cad.assign import matches

    for wanted in ([5], [6], [7], [0, 4, 6], [2, 5, 6]):
        chosen = {i for p in shortest_patterns(wanted, paths) for i, path in enumerate(paths) if matches(path, p)}
        assert chosen == set(wanted)


def test_a_density_that_no_solid_has_is_replaced_aloud(rille_data, tmp_path):
    """The robot arm's file says 7.85 kg/m^3 for its parts, a thousandth of steel."""
    path = rille_data / "data" / "cad" / "low_cost_robot_arm.step"
    if not path.is_file():
        pytest.skip("the robot arm's STEP file is absent")
    assembly = read_step(path)
    from rille.cad.suggestion.values import SuggestedBody, Suggestions

    everything = SuggestedBody(name="all", instances=tuple(range(len(assembly.instances))))
    text = draft_sheet(assembly, Suggestions(bodies=(everything,), joints=(), wheels=(), root="all"), str(path))
    assert "density that no solid has" in text
    page = RoverSheet.model_validate(tomllib.loads(text))
    assert {rule.material for rule in page.part} == {"aluminium"}
