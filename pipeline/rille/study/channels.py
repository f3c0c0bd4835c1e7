"""Channels that a sheet asks for -> outcomes and traces, one for each target that a pattern meets."""

from collections.abc import Mapping, Sequence

from rille.model import InputRefused, nearest_names
from rille.model.quantity import to_si
from rille.model.study import ChannelMeasure, Measure, TracedChannel
from rille.study.matching import matching
from rille.study.sheet import Component, OutcomeSheet, TraceSheet

QUANTITIES = {  # quantity -> unit; accelerations are not here: they need every step
    "joint.position": "rad",
    "joint.velocity": "rad/s",
    "joint.effort": "N m",
    "part.position": "m",
    "part.orientation": "-",
    "part.linear_velocity": "m/s",
    "part.angular_velocity": "rad/s",
    "wheel.slip_ratio": "-",
    "wheel.slip_angle": "rad",
    "wheel.sinkage": "m",
    "wheel.normal_load": "N",
    "wheel.drawbar_pull": "N",
    "wheel.side_force": "N",
    "wheel.drive_torque": "N m",
    "motor.current": "A",
    "motor.voltage": "V",
}
SIZES = {"part.position": 3, "part.orientation": 4, "part.linear_velocity": 3, "part.angular_velocity": 3}
LETTERS = "xyz"


def channel_measures(
    entries: Sequence[OutcomeSheet], parts: Mapping[str, Sequence[str]], duration: float
) -> list[tuple[ChannelMeasure, Measure]]:
    """Outcomes of [[outcome]] tables. parts : names by first word of a quantity.

    Raises
    ------
    InputRefused : with the nearest names of a quantity or a target.
    """
    found = []
    for entry in entries:
        after = to_si(entry.after, "time", f"after of an outcome of {entry.quantity}")
        if not 0 <= after < duration:
            raise InputRefused(f"an outcome of {entry.quantity} counts after {after:g} s; the scenario has {duration:g} s")
        for target, component, name, where in _expanded(entry, parts):
            title = name if entry.name else f"{name}.{entry.reduce}"
            channel = ChannelMeasure(
                name=title, quantity=entry.quantity, target=target, component=component, reduce=entry.reduce, after=after
            )
            meaning = f"{entry.reduce} of {where}" + (f" after {after:g} s" if after else "")
            found.append((channel, Measure(name=title, unit=QUANTITIES[entry.quantity], meaning=meaning, main=True)))
    return found


def traced_channels(entries: Sequence[TraceSheet], parts: Mapping[str, Sequence[str]]) -> tuple[TracedChannel, ...]:
    """Channels of [[trace]] tables. Raises as ``channel_measures``."""
    return tuple(
        TracedChannel(name=name, unit=QUANTITIES[entry.quantity], quantity=entry.quantity, target=target, component=component)
        for entry in entries
        for target, component, name, _ in _expanded(entry, parts)
    )


def _expanded(entry: OutcomeSheet | TraceSheet, parts: Mapping[str, Sequence[str]]) -> list[tuple[str, int, str, str]]:
    """(target, component, name, what it is in words) of each target that the entry's pattern meets."""
    if entry.quantity not in QUANTITIES:
        raise InputRefused(f"the quantity '{entry.quantity}' is not known here; {nearest_names(entry.quantity, QUANTITIES)}")
    known = parts[entry.quantity.partition(".")[0]]
    matched = matching(entry.target, known)
    if not matched:
        raise InputRefused(f"{entry.quantity} of '{entry.target}': the model has no such thing; {nearest_names(entry.target, known)}")
    component = _component(entry.component, entry.quantity)
    size = SIZES.get(entry.quantity, 1)
    letters = "wxyz" if size == 4 else LETTERS
    suffix = f".{letters[component]}" if size > 1 else ""
    return [
        (
            target,
            component,
            f"{entry.name}.{target}" if entry.name and len(matched) > 1 else entry.name or f"{entry.quantity}.{target}{suffix}",
            f"{entry.quantity}{suffix} of {target}",
        )
        for target in matched
    ]


def _component(given: Component, quantity: str) -> int:
    size = SIZES.get(quantity, 1)
    letters = "wxyz" if size == 4 else LETTERS[:size] if size > 1 else ""
    place = letters.find(given) if isinstance(given, str) else given
    if not 0 <= place < size:
        raise InputRefused(f"{quantity} has no component {given!r}; it has {size}" + (f": {', '.join(letters)}" if letters else ""))
    return place
