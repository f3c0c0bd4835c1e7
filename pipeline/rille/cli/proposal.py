"""What a setting of a diagnosis changes in a database: effects to add, and new values of the solver's parameters."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rille.model import Effect
    from rille.model.hypothesis import Setting

RIG = "bench."  # begins the names of numbers that belong to a test rig, not to the model


def proposal(database: Path, setting: "Setting", scenario: str | None) -> tuple[tuple["Effect", ...], dict[str, float]]:
    """Effects and parameters [SI]; faults of sensors and numbers of a test rig are no part of a model.

    Raises
    ------
    InputRefused : for a parameter that the database does not hold.
    """
    from rille import store
    from rille.diagnosis.applied import setting_effects

    physics = tuple(term for term in setting if term.hypothesis.cause != "sensor")
    names = {name for term in physics for _, name, _ in term.hypothesis.moves}
    of_rig = {name for name in names if name.startswith(RIG)}
    values = store.parameter_values(database, sorted(names - of_rig), scenario) | dict.fromkeys(of_rig, 1.0)
    effects, parameters = setting_effects(physics, values)
    return effects, {name: value for name, value in parameters.items() if name not in of_rig}


def known_scenario(database: Path, name: str) -> str | None:
    """The scenario if the database has it; else None, which means its only one."""
    from rille import store
    from rille.model import InputRefused

    try:
        return store.read_scenario(database, name or None).name
    except InputRefused:
        return None
