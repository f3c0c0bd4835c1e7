"""What is said about the verbs is true: every verb has help with an example, and stands in the README."""

import subprocess
import sys
from pathlib import Path

import pytest
import typer.main

from rille.cli.main import app


def verbs():
    """Every command of ``rille`` with its words."""
    found = []

    def walk(command, words):
        for name, child in getattr(command, "commands", {}).items():
            walk(child, [*words, name])
        if not hasattr(command, "commands"):
            found.append((" ".join(words), command))

    walk(typer.main.get_command(app), ["rille"])
    return found


@pytest.mark.parametrize(("verb", "command"), verbs(), ids=[v for v, _ in verbs()])
def test_every_verb_has_help_with_an_example(verb, command):
    assert command.help
    assert f"Example: {verb}" in command.help


def test_help_shows_every_example_on_a_line_of_its_own():
    shown = subprocess.run([Path(sys.executable).parent / "rille", "diagnose", "--help"], capture_output=True, text=True, check=True).stdout
    examples = [line for line in shown.splitlines() if "Example:" in line]
    assert len(examples) == 3
    assert all(line.strip().startswith("Example: rille diagnose") for line in examples)


@pytest.mark.parametrize(("verb", "command"), verbs(), ids=[v for v, _ in verbs()])
def test_every_verb_has_json_but_version(verb, command):
    options = {option for parameter in command.params for option in parameter.opts}
    assert "--json" in options or verb == "rille version"


@pytest.mark.parametrize("verb", [v for v, _ in verbs()])
def test_every_verb_stands_in_the_readme(repository, verb):
    assert verb in (repository / "README.md").read_text()


def test_help_does_not_import_what_takes_seconds():
    """Start-up budget: 0.3 s. Imports are what costs it, so imports are what is tested, not time."""
    heavy = ("OCP", "cadquery", "pyvista", "vtkmodules", "rasterio", "matplotlib", "scipy", "pint", "pyarrow", "plotly", "mcap", "rosbags")
    code = f"import rille.cli.main, sys; print(' '.join(m for m in {heavy} if m in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
