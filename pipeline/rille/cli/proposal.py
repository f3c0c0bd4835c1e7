"""What a setting of a diagnosis changes in a database: effects to add, and new values of the solver's parameters."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rille.model import Effect, Soil
    from rille.model.finding import RowChange
    from rille.model.hypothesis import Setting

RIG = "bench."  # begins the names of numbers that belong to a test rig, not to the model


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """effects, parameters : of the solver, SI. soils : of the library that the database does not hold yet. changes : of its rows."""

    effects: tuple["Effect", ...]
    parameters: dict[str, float]
    soils: tuple["Soil", ...]
    changes: tuple["RowChange", ...]
    scenario: str | None


def makes_no_better(verdict: str, gap_closed: float | None) -> bool:
    """Whether something without a name leaves what was held out as it was, so that it is not applied. gap_closed : None or NaN: unknown."""
    return verdict == "unknown" and gap_closed is not None and gap_closed <= 0


def proposal(database: Path, setting: "Setting", scenario: str) -> Proposal:
    """What ``rille apply`` does; faults of sensors and numbers of a test rig are no part of a model.

    Raises
    ------
    InputRefused : for a parameter that the database does not hold.
    """
    from rille import store
    from rille.diagnosis.evidence.applied import setting_effects

    physics = tuple(term for term in setting if term.hypothesis.cause != "sensor")
    names = {name for term in physics for _, name, _ in term.hypothesis.moves}
    of_rig = {name for name in names if name.startswith(RIG)}
    known = _known_scenario(database, scenario)
    soils = _library_soils(database, names)
    values = store.parameter_values(database, sorted(names - of_rig), known, soils) | dict.fromkeys(of_rig, 1.0)
    effects, parameters = setting_effects(physics, values)
    effects = tuple(_on_benches(database, effect) for effect in effects)
    parameters = {name: value for name, value in parameters.items() if name not in of_rig}
    changes = store.planned_changes(database, effects, parameters, known, soils)
    return Proposal(effects=effects, parameters=parameters, soils=soils, changes=changes, scenario=known)


def _known_scenario(database: Path, name: str) -> str | None:
    """The scenario if the database has it; else None, which means its only one."""
    from rille import store
    from rille.model import InputRefused

    try:
        return store.read_scenario(database, name or None).name
    except InputRefused:
        return None


def _library_soils(database: Path, names: Iterable[str]) -> tuple["Soil", ...]:
    """Soils whose numbers are named, and that are the library's only so far."""
    from rille import store, terrain

    wanted = {name.partition(".")[2].rpartition(".")[0] for name in names if name.startswith("soil.")}
    wanted -= {soil.name for soil in store.read_soils(database)} if wanted else set()
    library = dict(terrain.soils()) if wanted else {}
    return tuple(library[name] for name in sorted(wanted) if name in library)


def _on_benches(database: Path, effect: "Effect") -> "Effect":
    """A wheel that only the manifest of a bench knows cannot be named in a database without wheels; there the effect acts on all."""
    from rille import store

    if store.find_effect_kind(effect.kind).target != "wheel" or store.read_rover(database).wheels:
        return effect
    return replace(effect, target="*")
