"""A number inside a message: ``position[0]``, ``position[left_wheel]`` (by the message's list of names), ``pose.pose.position.x``."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from rille.model.errors import InputRefused, nearest_names

STEP = re.compile(r"(?:^|\.)([^.\[\]]+)|\[([^\[\]]+)\]")
LONGEST = 64  # entries of an array that are told as fields


@dataclass(frozen=True, slots=True, kw_only=True)
class Address:
    """Where a number stands in the messages of a topic. steps : names of fields, numbers of entries, or names of entries."""

    topic: str
    field: str
    steps: tuple[str | int, ...]
    named: tuple[bool, ...]


def parse_address(column: str, topics: "dict[str, str]", file: str) -> Address:
    """``/topic.field.sub[0]`` as an address.

    Raises
    ------
    InputRefused : if there is no such topic, or the field cannot be read.
    """
    topic = max((name for name in topics if column.startswith(name + ".")), key=len, default=None)
    if topic is None:
        wanted = column.partition(".")[0]
        raise InputRefused(f"'{file}' has no topic '{wanted}' (channel '{column}'); {nearest_names(wanted, topics)}")
    field = column[len(topic) + 1 :]
    matches = list(STEP.finditer(field))
    if "".join(match.group(0) for match in matches) != field or not matches:
        raise InputRefused(f"'{column}' names no field of a message; write for example {topic}.pose.position.x or {topic}.position[0]")
    steps = tuple(m.group(1) or (int(m.group(2)) if m.group(2).lstrip("-").isdigit() else m.group(2)) for m in matches)
    named = tuple(m.group(1) is None and isinstance(step, str) for m, step in zip(matches, steps, strict=True))
    return Address(topic=topic, field=field, steps=steps, named=named)


def getter(address: Address) -> Callable[[Any], float]:
    """Function that reads the number from a message; NaN where an entry is not there.

    It raises TypeError or ValueError for what is no number, AttributeError or KeyError for a field that does not exist.
    """

    def read(message: Any) -> float:
        value = message
        for step, named in zip(address.steps, address.named, strict=True):
            if named:
                names = list(_field(message, "name"))
                step = names.index(step) if step in names else len(names)
            if isinstance(step, int):
                if not -len(value) <= step < len(value):
                    return float("nan")
                value = value[step]
            else:
                value = _field(value, step)
        return float(value) if value is not None else float("nan")

    return read


def _field(message: Any, name: str | int) -> Any:
    return message[name] if isinstance(message, dict) else getattr(message, str(name))


def number_fields(message: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """All numbers of a message with their addresses; of long arrays the first entries."""
    if isinstance(message, bool | int | float):
        yield prefix, float(message)
    elif isinstance(message, dict):
        for name, value in message.items():
            yield from number_fields(value, f"{prefix}.{name}" if prefix else str(name))
    elif isinstance(message, str | bytes) or message is None:
        return
    elif hasattr(message, "__len__") and hasattr(message, "__getitem__"):
        for k in range(min(len(message), LONGEST)):
            entry = message[k]
            yield from number_fields(entry.item() if hasattr(entry, "item") else entry, f"{prefix}[{k}]")
    else:
        for name in field_names(message):
            yield from number_fields(getattr(message, name), f"{prefix}.{name}" if prefix else name)


def field_names(message: Any) -> tuple[str, ...]:
    """Names of the fields of a message object, of whichever library decoded it."""
    known = getattr(message, "__dataclass_fields__", None) or getattr(message, "__slots__", None) or vars(message)
    return tuple(name.lstrip("_") for name in known if not name.startswith("__") and name not in ("_type", "_full_text"))
