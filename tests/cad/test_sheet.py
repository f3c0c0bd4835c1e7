"""Does the sheet turn an assembly into the mechanism that it says, and does each mistake get its own sentence?"""

import math

import numpy as np
import pytest

from rille.cad import build
from rille.model import InputRefused


def test_bodies_joints_and_units(rig_sheet):
    rover = build(rig_sheet())
    bodies = {b.name: b for b in rover.bodies}
    bar, peg = 7850 * 0.1 * 0.01 * 0.01, 7850 * math.pi * 0.004**2 * 0.03
    left = bodies["left"].properties
    # 1e-9: exact B-rep integrals, STEP text of 15 digits (see test_mass_properties).
    assert left.mass == pytest.approx(bar + peg, rel=1e-9)
    np.testing.assert_allclose(left.com, [(bar * 0.05 + peg * 0.1) / (bar + peg), 0, peg * 0.02 / (bar + peg)], atol=1e-12)
    # Composite moment about z: both own moments and the parallel-axis terms m1 m2 / (m1 + m2) d^2.
    own = bar * (0.1**2 + 0.01**2) / 12 + peg * 0.004**2 / 2
    assert left.inertia[2, 2] == pytest.approx(own + bar * peg / (bar + peg) * 0.05**2, rel=1e-9)
    # The same arm, turned by 90 degrees about z: x and y change places, z stays.
    right = bodies["right"].properties
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(right.inertia, turn @ left.inertia @ turn.T, atol=1e-9 * left.inertia.max())
    hinge = next(j for j in rover.joints if j.name == "left_hinge")
    assert hinge.axis == (0, 0, 1)
    assert hinge.limit is not None
    assert hinge.limit.upper == pytest.approx(math.radians(35))
    assert bodies["left"].frame == hinge.point == (0.01, 0, 0)
    assert bodies["base"].frame == (0, 0, 0)
    assert {s.file for s in rover.sources} == {"rig.toml", "rig.step"}
    assert len(rover.parts) == 3
    assert len(rover.instances) == 5


def test_stated_mass_rescales_the_exact_inertia(rig_sheet):
    plain = {p.name: p for p in build(rig_sheet()).parts}["Träger"].properties
    rule = ('[[part]]\nmatch = "*"', '[[part]]\nmatch = "Tr*"\nmass = "500 g"\n[[part]]\nmatch = "*"')
    stated = {p.name: p for p in build(rig_sheet(rule)).parts}["Träger"].properties
    assert stated.mass == 0.5
    np.testing.assert_allclose(stated.inertia / 0.5, plain.inertia / plain.mass, rtol=1e-12)
    assert (stated.mass_provenance, stated.inertia_provenance) == ("stated", "geometry")


def test_a_joint_that_needs_neither_place_nor_axis(rig_sheet):
    """A fixed joint moves nowhere; a ball joint turns about its point; a slide's axis says all."""
    right = 'kind = "hinge"\nparent = "base"\nchild = "right"\npoint = [0, "1 cm", 0.05]\naxis = [0, 0, 1]'
    for kind, rest in (("fixed", ""), ("spherical", "point = [0, 0, 0.05]"), ("prismatic", "axis = [1, 0, 0]")):
        rover = build(rig_sheet((right, f'kind = "{kind}"\nparent = "base"\nchild = "right"\n{rest}')))
        assert next(j.kind for j in rover.joints if j.name == "right_hinge") == kind


def rule(text):
    return ('[[part]]\nmatch = "*"', f'[[part]]\nmatch = "base"\n{text}\n[[part]]\nmatch = "*"')


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            ('"rig/arm_left"', '"rig/arm_lefd"'),
            r"body 'left' names the part 'rig/arm_lefd'.*did you mean .*rig/arm_left",
        ),
        (('match = "*"', 'match = "bsae"'), r"a \[\[part\]\] names the part 'bsae'.*did you mean 'base'"),
        (('parts = ["rig/base"]', 'parts = ["rig/base", "rig/arm_left/*"]'), "belongs to bodies 'base' and 'left'"),
        (('parts = ["rig/arm_right"]', 'parts = ["rig/arm_right/peg*"]'), "belongs to no body"),
        (rule('mass = "0 kg"'), "mass of part 'base' is 0 kg; it must be above 0"),
        (rule("mass = -1"), "mass of part 'base' is -1 kg; it must be above 0"),
        (rule('mass = "3 m"'), "mass of part 'base'.*is no mass"),
        (
            rule("mass = 1\ninertia = [1, 1, 3, 0, 0, 0]"),
            "inertia of part 'base' breaks the triangle inequality: 3 > 1",
        ),
        (rule("mass = 1\ninertia = [1, 1, -1, 0, 0, 0]"), "inertia of part 'base' has the principal moment -1"),
        (rule("inertia = [1, 1, 1, 0, 0, 0]"), r"the \[\[part\]\] 'base' has a stated inertia or centre but no stated mass"),
        (rule(""), r"the \[\[part\]\] 'base' says nothing; give its `material` or its `mass`"),
        (
            ('material = "steel"\n[[body]]', 'material = "steel"\n[[part]]\nmatch = "base"\nmass = 1\nmaterial = "steel"\n[[body]]'),
            r"the material in the \[\[part\]\] 'base' is that of no part: the \[\[part\]\] '\*' stands before it",
        ),
        (
            ('material = "steel"', 'material = "steal"'),
            "the material 'steal', which is neither on the sheet nor in the library; did you mean 'steel'",
        ),
        (('density = "7.85 g/cm^3"', "density = 0"), "density of material 'steel' is 0"),
        (("axis = [0, 0, 2]", "axis = [0, 0, 0]"), "axis of joint 'left_hinge' has no length"),
        (("axis = [0, 0, 2]\n", ""), "joint 'left_hinge' is a hinge joint without an `axis`; give the joint an `axis`"),
        (('point = ["10 mm", 0, 0]\n', ""), "joint 'left_hinge' is a hinge joint without a place; give it a `point`"),
        (
            (
                'kind = "hinge"\nparent = "base"\nchild = "right"\npoint = [0, "1 cm", 0.05]\naxis = [0, 0, 1]',
                'kind = "prismatic"\nparent = "base"\nchild = "right"',
            ),
            "joint 'right_hinge' is a prismatic joint without an `axis`",
        ),
        (
            ('child = "right"', 'child = "left"'),
            "body 'left' is the child of joint 'left_hinge' and of joint 'right_hinge'",
        ),
        (('parent = "base"', 'parent = "bass"'), "joint 'left_hinge' names the body 'bass'.*did you mean 'base'"),
        (('upper = "35 deg"', 'upper = "-40 deg"'), "lower must be below upper"),
        (('upper = "35 deg"\n', ""), "only one of `lower` and `upper`"),
        (
            ('lower = "-35 deg"', 'lowest = "-35 deg"'),
            r"the key 'joint.\[1\].lowest' is unknown; did you mean 'lower'|lowest",
        ),
        (("rig.step", "rag.step"), "there is no STEP file"),
        (('name = "right"', 'name = "left"'), "2 bodys called 'left'|2 bodies called 'left'"),
    ],
)
def test_refusals(rig_sheet, change, sentence):
    with pytest.raises(InputRefused, match=sentence) as refused:
        build(rig_sheet(change))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (
            '[[drive]]\njoint = "left_hing"\nmode = "speed"\nmax_torque = 1\n',
            "the joint 'left_hing'.*did you mean 'left_hinge'",
        ),
        ('[[drive]]\njoint = "left_hinge"\nmode = "speed"\nmax_torque = 0\n', "max_torque of drive 'left_hinge' is 0"),
        ('[[wheel]]\njoint = "left_hinge"\nradius = 0\nwidth = 1\n', "radius of wheel 'left_hinge' is 0"),
        (
            '[[differential]]\nname = "d"\ncarrier = "left"\njoint_a = "left_hinge"\njoint_b = "right_hinge"\n',
            "differential 'd' needs hinges on its carrier 'left'",
        ),
        ('[[gear]]\nname = "g"\njoint_a = "left_hinge"\njoint_b = "right_hinge"\nratio = 0\n', "gear 'g' has ratio 0"),
        (
            '[[joint]]\nname = "back"\nkind = "hinge"\nparent = "left"\nchild = "base"\npoint = [0, 0, 0]\naxis = [0, 0, 1]\n',
            "circle of joints",
        ),
    ],
)
def test_refusals_of_what_is_added(rig_sheet, more, sentence):
    with pytest.raises(InputRefused, match=sentence):
        build(rig_sheet(more=more))


def test_ignored_parts_weigh_nothing(rig_sheet):
    full = build(rig_sheet())
    sheet = rig_sheet()
    sheet.write_text('ignore = ["*/peg_part"]\n' + sheet.read_text(encoding="utf-8"), encoding="utf-8")
    slim = build(sheet)
    peg = 7850 * math.pi * 0.004**2 * 0.03
    total = [sum(b.properties.mass for b in rover.bodies) for rover in (full, slim)]
    assert total[0] - total[1] == pytest.approx(2 * peg, rel=1e-9)


def test_free_shells_are_reported_and_seen_but_not_weighed(write_step, tmp_path):
    import cadquery as cq

    step = write_step("mixed.step", [(cq.Solid.makeBox(10, 10, 10), "box"), (cq.Face.makePlane(9, 9), "label")])
    head = f'step = "{step}"\ndefault_material = "foam"\nignore = ["label"]\n[[material]]\nname = "foam"\ndensity = 50\n'
    sheet = tmp_path / "mixed.toml"
    sheet.write_text(head + '[[body]]\nname = "b"\nparts = ["box"]\n')
    said: list[str] = []
    rover = build(sheet, note=said.append)
    assert rover.bodies[0].properties.mass == pytest.approx(50e-6, rel=1e-9)
    assert rover.bodies[0].properties.mass_provenance == "default"
    assert any("part 'label' has no solid" in what for what in said)
    sheet.write_text(head.replace('ignore = ["label"]', "") + '[[body]]\nname = "b"\nparts = ["*"]\n')
    seen = build(sheet)
    assert seen.bodies[0].properties.mass == rover.bodies[0].properties.mass  # the surface is seen, not weighed
    assert {part.name for part in seen.parts if part.meshes} == {"box", "label"}
    sheet.write_text(head.replace('ignore = ["label"]', 'ignore = ["box"]') + '[[body]]\nname = "b"\nparts = ["label"]\n')
    with pytest.raises(InputRefused, match="body 'b' has no mass: none of its parts has a solid"):
        build(sheet)
