"""A study sheet -> a plan with its cases, and the work that runs them."""

import pickle
import tempfile
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rille.cli.sweep_ground import require_scene, scene_text, with_numbers
from rille.cli.sweep_job import CasesOfModel
from rille.cli.talk import say

if TYPE_CHECKING:
    from rille.model import Scenario
    from rille.model.study import Case, Change, Factor, StudyPlan
    from rille.simulate.case import CaseRunner
    from rille.study import StudySheet, Subject


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """A study that can begin. plan, cases : see ``rille.study``. work : runs cases, on any worker."""

    plan: "StudyPlan"
    cases: "tuple[Case, ...]"
    work: CasesOfModel

    def ordered(self, cases: "Sequence[Case]") -> "list[Case]":
        """Cases so that those on the same ground come together, and grounds as if drawn: a part of the design is not one end of it."""
        return sorted(cases, key=lambda case: _place_of(_ground_of(case, self.plan), self.plan.seed))


def prepare(sheet: "StudySheet", folder: Path, update: Callable[[str, float], None]) -> Prepared:
    """Make of a sheet what can be carried out. folder : that its paths are relative to.

    Raises
    ------
    InputRefused : for anything in sheet, model, scenario or scene that cannot be.
    """
    import rille
    from rille import store
    from rille.model.sheet import expand
    from rille.simulate.case import CaseRunner
    from rille.study import plan_study

    with tempfile.TemporaryDirectory(prefix="rille-sweep-") as place:
        draft, model = Path(place) / "draft.db", Path(place) / "model.db"
        source = expand(sheet.model, folder)
        update("reading the model", 0.0)
        scene = "" if sheet.terrain is None else scene_text(_existing(expand(sheet.terrain, folder), "terrain"))
        scenario = _draft(draft, source, sheet, folder, scene, update)
        store.copy_model(draft, model, scenario.name)
        runner = CaseRunner(model, scenario)
        subject = _subject(model, runner, scenario, scene)
        asked = plan_study(sheet, subject, runner.measures, parts=_parts(model))
        _require_ground(asked.constants, [c for f in asked.plan.factors for c in f.changes], scenario, subject.ground)
        _require_ends(asked.constants, asked.plan, Path(place), scene)
        plan = replace(asked.plan, model_file=source.name, model=_digest(store.model_digest(model), scene), version=rille.__version__)
        parts: dict[str, Any] = {
            "content": model.read_bytes(),
            "scenario": scenario,
            "changes": tuple(factor.changes for factor in plan.factors),
            "constants": asked.constants,
            "channels": asked.channels,
            "traced": plan.traced,
            "trace_time": plan.trace_time,
            "scene": scene if _grounds(asked.constants, plan) else "",
        }
    work = CasesOfModel(key=sha256(pickle.dumps(parts)).hexdigest(), **parts)
    return Prepared(plan=plan, cases=asked.cases, work=work)


def _existing(path: Path, what: str) -> Path:
    from rille.model import InputRefused

    if not path.is_file():
        raise InputRefused(f"there is no {what} '{path}'; the study's paths are relative to its sheet")
    return path


def _draft(draft: Path, source: Path, sheet: "StudySheet", folder: Path, scene: str, update: Callable[[str, float], None]) -> "Scenario":
    """The model with its ground and its scenario in one database; returns the scenario."""
    from rille import cad, simulate, store, terrain
    from rille.model import InputRefused
    from rille.model.sheet import expand

    named = sheet.scenario is not None and sheet.scenario.endswith(".toml")
    _existing(source, "model")
    if source.suffix == ".db":
        store.copy_model(source, draft, without_scenarios=True)
    else:
        store.create(draft)
        store.write_rover(draft, cad.build(source, progress=update, note=say, find_part=store.find_part))
    rover = store.read_rover(draft)
    if scene:
        update("building the ground", 0.5)
        file = draft.with_suffix(".toml")
        file.write_text(scene, encoding="utf-8")
        store.write_terrain(draft, terrain.build(file), replace=True)
    if named:
        assert sheet.scenario is not None
        scenario = simulate.read_scenario_file(expand(sheet.scenario, folder), rover)
    elif source.suffix == ".db":
        scenario = store.read_scenario(source, sheet.scenario)
    else:
        raise InputRefused(f"the study '{sheet.name}' names no scenario file; give it scenario = \"FILE.toml\"")
    store.write_scenario(draft, scenario)
    return scenario


def _digest(model: str, scene: str) -> str:
    return sha256(f"{model} {scene}".encode()).hexdigest()


def _grounds(constants: "tuple[tuple[Change, float], ...]", plan: "StudyPlan") -> bool:
    changes = [change for change, _ in constants] + [change for factor in plan.factors for change in factor.changes]
    return any(change.kind == "ground" for change in changes)


def _ground_of(case: "Case", plan: "StudyPlan") -> tuple[float, ...]:
    """Values that make the ground of a case."""
    return tuple(v for v, factor in zip(case.values, plan.factors, strict=True) if any(c.kind == "ground" for c in factor.changes))


def _place_of(ground: tuple[float, ...], seed: int) -> bytes:
    """Where a ground stands in the order of work, always the same."""
    return sha256(repr((seed, ground)).encode()).digest()


def _parts(model: Path) -> dict[str, list[str]]:
    """Names by the first word of a quantity."""
    from rille import store

    rover = store.read_rover(model)
    found = {"joint": [j.name for j in rover.joints], "part": [b.name for b in rover.bodies], "wheel": [w.name for w in rover.wheels]}
    return found | {"motor": [drive.name for drive in rover.drives]}


def _subject(model: Path, runner: "CaseRunner", scenario: "Scenario", scene: str) -> "Subject":
    from rille import store
    from rille.study import Subject

    rover = store.read_rover(model)
    kinds = {joint.name: joint.kind for joint in rover.joints}
    names = {"wheel": rover.wheels, "joint": rover.joints, "body": rover.bodies, "sensor": rover.sensors}
    ground = tomllib.loads(scene) if scene else None
    return Subject(
        bounds=runner.bounds,
        drives={drive.name: drive.mode for drive in rover.drives},
        sliding=frozenset(drive.name for drive in rover.drives if kinds[drive.joint] == "prismatic"),
        scenario=scenario,
        effects=store.effect_kinds(),
        ground=ground,
        drivers={} if ground is None else _drivers(ground),
        targets={kind: [one.name for one in values] for kind, values in names.items()},
    )


def _drivers(scene: dict[str, Any]) -> dict[tuple[str, str], str]:
    """Units of drivers, by name of the placed landform and driver."""
    from rille.terrain.register import read_register

    register = read_register(Path(folder) for folder in scene.get("library", []))
    placed = [(entry["name"], register.landforms[entry["landform"]]) for entry in scene.get("landform", [])]
    return {(name, driver.name): driver.unit for name, landform in placed for driver in landform.drivers}


def _require_ground(
    constants: "tuple[tuple[Change, float], ...]", changes: "list[Change]", scenario: "Scenario", ground: "Mapping[str, Any] | None"
) -> None:
    """Refuse ground that the scenario does not stand on. ground : the scene of the study, if it has one."""
    from rille.model import InputRefused

    varied = [change for change in (*changes, *(change for change, _ in constants)) if change.kind == "ground"]
    if varied and scenario.terrain is None:
        raise InputRefused(f"'{varied[0].name}.{varied[0].number}' varies ground that scenario '{scenario.name}' does not use")
    if ground is not None and scenario.terrain is not None and scenario.terrain != ground["name"]:
        raise InputRefused(
            f"scenario '{scenario.name}' stands on '{scenario.terrain}', not on the scene of the study, '{ground['name']}'; "
            "name one ground in both"
        )


def _require_ends(constants: "tuple[tuple[Change, float], ...]", plan: "StudyPlan", folder: Path, scene: str) -> None:
    """Refuse ground that cannot be at an end of what varies; all else as in the scene, or set."""
    from rille.model import InputRefused, MachineFailed

    fixed = {change: value for change, value in constants if change.kind == "ground"}
    grounds = [("what is set", fixed)] if fixed else []
    for factor in plan.factors:
        if any(change.kind == "ground" for change in factor.changes):
            grounds += [(f"{factor.name} = {end:g}", fixed | dict.fromkeys(factor.changes, end)) for end in _ends(factor)]
    for words, numbers in grounds:
        try:
            require_scene(folder, with_numbers(scene, numbers))
        except MachineFailed:
            raise
        except InputRefused as refusal:
            raise InputRefused(f"with {words} the ground cannot be: {refusal}") from None


def _ends(factor: "Factor") -> tuple[float, ...]:
    """The outermost values that a sheet states."""
    if factor.spread == "values":
        return min(factor.values), max(factor.values)
    return (factor.mean,) if factor.spread == "normal" else (factor.low, factor.high)
