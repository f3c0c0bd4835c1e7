"""Talk on stderr, data on stdout."""

import json
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
Force = Annotated[bool, typer.Option("--force", help="Delete what depends on what is replaced.")]


def number(text: str) -> float | str:
    """A bare number is SI; everything else is read as a quantity."""
    try:
        return float(text)
    except ValueError:
        return text


def assignments(texts: Iterable[str] | None, example: str) -> dict[str, str]:
    """``["a=1", "b=2"]`` to ``{"a": "1", "b": "2"}``; what is none is refused with the example."""
    from rille.model import InputRefused

    found = {}
    for text in texts or ():
        key, equals, value = text.partition("=")
        if not equals or not key:
            raise InputRefused(f"'{text}' is no NAME=VALUE, for example {example}")
        found[key] = value
    return found


def say(text: str) -> None:
    """A line of talk on stderr."""
    print(text, file=sys.stderr)


def print_json(value: Any) -> None:
    """Data for programs on stdout."""
    print(json.dumps(value, indent=2, ensure_ascii=False, default=str))


@contextmanager
def progress(title: str) -> Iterator[Callable[[str, float], None]]:
    """A bar on stderr, on a terminal only; yields ``update(what, fraction)``."""
    if not sys.stderr.isatty():
        yield lambda what, fraction: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.fields[title]}"), BarColumn(), TimeRemainingColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0, title=title)
        yield lambda what, fraction: bar.update(task, completed=fraction, description=what)
