"""A setting put into a simulator: its effects and numbers of the model. Sensor faults stay outside: they change the recording."""

from collections.abc import Callable, Mapping
from typing import Any

from rille.model import Effect
from rille.model.hypothesis import Setting, Term

Simulators = Mapping[str, Any] | Callable[[str], Any]


def setting_effects(setting: Setting, values: Mapping[str, float]) -> tuple[tuple[Effect, ...], dict[str, float]]:
    """What a setting changes in a model.

    Parameters
    ----------
    values : of the model's parameters by name [SI]; those that the setting moves must be there.

    Returns
    -------
    Effects that come on top of the model's own (terms without any amplitude are left out), and the new values of the parameters that move.
    """
    effects, moved = [], {}
    for term in setting:
        if is_absent(term):
            continue
        hypothesis = term.hypothesis
        if hypothesis.cause == "effect":
            effects.append(Effect(kind=hypothesis.kind, target=hypothesis.target or "*", parameters={**hypothesis.words, **term.numbers}))
        elif hypothesis.cause == "parameter":
            absent = {number.name: number.absent for number in hypothesis.free}
            for number, parameter, factor in hypothesis.moves:
                before = moved.get(parameter, values[parameter])
                moved[parameter] = before + factor * (term.numbers[number] - absent.get(number, 0.0))
    return tuple(effects), moved


def is_absent(term: Term) -> bool:
    """Whether a term changes nothing: all of its amplitudes are absent."""
    free = zip(term.hypothesis.free, term.values, strict=True)
    amplitudes = [(number.absent, value) for number, value in free if number.amplitude]
    return bool(amplitudes) and all(absent == value for absent, value in amplitudes)


def sensor_terms(setting: Setting) -> Setting:
    """The faults of sensors that are at work in a setting."""
    return tuple(term for term in setting if term.hypothesis.cause == "sensor" and not is_absent(term))


def applied(simulator: Any, setting: Setting) -> Any:
    """The simulator with the setting's effects and parameters, driven as before; itself if there is nothing to change.

    Raises
    ------
    InputRefused : for a target or parameter that the model does not have, or a value that it cannot have.
    """
    physics = [term for term in setting if term.hypothesis.cause != "sensor" and not is_absent(term)]
    if not physics:
        return simulator
    values = parameter_values(simulator) if any(term.hypothesis.cause == "parameter" for term in physics) else {}
    effects, parameters = setting_effects(tuple(physics), values)
    return simulator.changed(effects, parameters)


def parameter_values(simulator: Any) -> dict[str, float]:
    """Values [SI] of the parameters of a simulator by name."""
    return {name: bounds[0] for name, bounds in simulator.machine().parameters.items()}


def of_scenario(simulators: Simulators, scenario: str | None) -> Any:
    """The simulator of a recording's scenario; of a mapping with one entry that one, whatever the recording says."""
    if not isinstance(simulators, Mapping):
        return simulators(scenario or "")
    if (scenario or "") in simulators:
        return simulators[scenario or ""]
    if len(simulators) == 1:
        return next(iter(simulators.values()))
    from rille.model import InputRefused, nearest_names

    raise InputRefused(f"there is no simulation of the scenario '{scenario or ''}'; {nearest_names(scenario or '', list(simulators))}")
