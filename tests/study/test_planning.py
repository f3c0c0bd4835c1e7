"""Sheets that ask for what cannot be, or for what would do nothing, are refused before the first case."""

import pytest

from rille import store
from rille.model import Command, InputRefused, Scenario
from rille.model.sheet import validate_sheet
from rille.study import StudySheet, Subject, plan_study, study_of_options

ANY = (1.0, -1e30, 1e30)
BOUNDS = {
    **{f"soil.{soil}.{number}": ANY for soil in ("l", "[a]") for number in ("cohesion", "friction_angle")},
    "soil.a.cohesion": ANY,
    "gravity.z": (-1.62, -1e30, 1e30),
    "effect.coulomb_friction.hub.torque": (0.5, 0.0, 1000.0),
}
COMMANDS = tuple(Command(drive=name, time=time, value=1.0) for name in ("wheel", "arm", "pad@8") for time in (0.0, 8.0))
SUBJECT = Subject(
    bounds=BOUNDS,
    drives={"wheel": "speed", "arm": "position", "pad@8": "position"},
    scenario=Scenario(name="s", duration=20.0, step=0.002, gravity=(0.0, 0.0, -1.62), commands=COMMANDS),
    effects=store.effect_kinds(),
    ground={"base": {"kind": "plane"}},
    targets={"wheel": ["front", "rear"]},
)


def planned(*vary, subject=SUBJECT, **more):
    """A study of factors between 0.1 and 0.2, unless they say more."""
    tables = [{"name": one, "low": 0.1, "high": 0.2} if isinstance(one, str) else one for one in vary]
    sheet = validate_sheet({"name": "s", "model": "m", "vary": tables, "samples": 4, **more}, StudySheet, "sheet")
    return plan_study(sheet, subject, [], parts={"wheel": ["[a]", "a"]})


def refused(*vary, words, **more):
    with pytest.raises(InputRefused) as caught:
        planned(*vary, **more)
    for word in words:
        assert word in str(caught.value), str(caught.value)


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        (["effect.sinkage_transient.*.time_constant"], ["changes nothing", "effect.sinkage_transient.*.depth"]),
        (["base.hurst"], ["base.hurst", "plane", "base.slope"]),
        (["effect.coulomb_friction.*.torque"], ["second coulomb_friction", "effect.coulomb_friction.hub.torque"]),
        (["effect.bulldozing.*.efficiency", "effect.bulldozing.front.efficiency"], ["two bulldozing", "front"]),
        (["soil.l.*"], ["several units", "[Pa]", "[rad]", "relative"]),
        (["command.*@0"], ["several units", "rad/s"]),
        (["soil.*.cohesion", "soil.l.cohesion"], ["'soil.*.cohesion'", "'soil.l.cohesion'"]),
        (["scenario.gravity", "gravity.z"], ["'scenario.gravity'", "'gravity.z'", "both"]),
        ([{"name": "scenario.step", "low": 1, "high": 60, "relative": True}], ["scenario.step", "0.12", "0.1"]),
        (["soil.?.friction_angel"], ["friction_angel", "friction_angle"]),
    ],
)  # fmt: skip
def test_refused(vary, words):
    refused(*vary, words=words)


def test_an_effect_needs_an_amplitude_that_is_not_always_0():
    name = "effect.sinkage_transient.*.time_constant"
    refused(name, words=["changes nothing"], set={"effect.sinkage_transient.*.depth": 0})
    assert len(planned(name, set={"effect.sinkage_transient.*.depth": 0.02}).cases) == 4
    assert len(planned(name, {"name": "effect.sinkage_transient.*.depth", "low": 0, "high": 0.1}).cases) == 4


def test_relative_numbers_of_a_scenario_are_of_its_own():
    """Half to twice a step of 2 ms, and of 1.62 m/s^2."""
    vary = [{"name": f"scenario.{key}", "low": 0.5, "high": 2, "relative": True} for key in ("step", "gravity", "duration")]
    assert len(planned(*vary).cases) == 4


def test_a_pattern_of_several_units_may_be_relative():
    asked = planned({"name": "soil.l.*", "low": 0.5, "high": 2, "relative": True})
    assert {change.name for change in asked.plan.factors[0].changes} == {"soil.l.cohesion", "soil.l.friction_angle"}


def test_a_name_is_first_of_all_itself():
    """Brackets are a set of letters to a pattern: soil.[a].cohesion is another's, too."""
    (factor,) = planned("soil.[a].cohesion").plan.factors
    assert [change.name for change in factor.changes] == ["soil.[a].cohesion"]
    trace = {"quantity": "wheel.sinkage", "target": "[a]"}
    asked = planned("soil.l.cohesion", trace=[trace])
    assert [channel.target for channel in asked.plan.traced] == ["[a]"]


@pytest.mark.parametrize(("name", "places"), [("command.pad@8@8", ["1"]), ("command.pad@8@0", ["0"]), ("command.wheel@8", ["1"])])
def test_a_drive_may_have_an_at_in_its_name(name, places):
    (factor,) = planned(name).plan.factors
    assert [change.number for change in factor.changes] == places


def test_a_drive_with_an_at_has_all_its_commands():
    (factor,) = planned({"name": "command.pad@8", "low": 0.5, "high": 2, "relative": True}).plan.factors
    assert [(change.name, change.number) for change in factor.changes] == [("pad@8", "0"), ("pad@8", "1")]


@pytest.mark.parametrize("interval", ["1 ns", 0, -1, "21 s"])
def test_traces_are_bounded(interval):
    trace = [{"quantity": "wheel.sinkage", "target": "a"}]
    refused("soil.l.cohesion", words=["trace_interval"], trace=trace, trace_interval=interval)


def test_traces_end_within_the_duration():
    """20 s in steps of 6 s: 0, 6, 12, 18."""
    asked = planned("soil.l.cohesion", trace=[{"quantity": "wheel.sinkage", "target": "a"}], trace_interval=6)
    assert asked.plan.trace_time == (0.0, 6.0, 12.0, 18.0)


@pytest.mark.parametrize("seed", [0, -3, 2**32])
def test_seeds_are_bounded(seed):
    refused("soil.l.cohesion", words=["seed"], seed=seed)


def test_options_of_values_only_are_a_grid(tmp_path):
    """All combinations of what is listed, unless somebody asks for samples; ranges are sampled."""
    model, values, ends = tmp_path / "m.db", "start.heading=0 deg,45 deg", "start.x=0 m:1 m"
    assert study_of_options(model, [values], {}).design == "grid"
    assert study_of_options(model, [values, ends], {}).design == "latin_hypercube"
    assert study_of_options(model, [values], {"samples": 8}).design == "latin_hypercube"
    with pytest.raises(InputRefused, match="a grid has all combinations, so --samples 8 says nothing"):
        study_of_options(model, [values], {"samples": 8, "design": "grid"})
    sheet = tmp_path / "s.toml"
    sheet.write_text('name = "s"\nmodel = "m.db"\n[[vary]]\nname = "start.x"\nvalues = [1, 2]\n')
    with pytest.raises(InputRefused, match="is a study sheet"):
        study_of_options(sheet, [values], {})
