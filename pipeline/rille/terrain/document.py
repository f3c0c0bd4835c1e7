"""What the register says of its landforms, as data and as a page."""

import math
from collections.abc import Mapping
from typing import Any

from rille.terrain.landform import Driver, Landform
from rille.terrain.register import Register

BLENDS = {
    "add": "adds to the ground",
    "replace": "replaces the ground",
    "max": "stands on the ground",
    "drape": "covers the ground and fills its hollows",
}
COMMAND = "rille terrain list --document terrain_library"


def describe(landform: Landform, own: bool) -> dict[str, Any]:
    """Everything that a landform says of itself, in SI; plain values."""
    return {
        "name": landform.name,
        "meaning": landform.meaning,
        "frame": landform.frame,
        "source": landform.source,
        "blend": landform.blend,
        "soil": landform.soil or None,
        "own": own,
        "steep": landform.steep,
        "conserves": landform.conserves or None,
        "populations": landform.radial is not None and landform.blend == "add",
        "example": dict(landform.example),
        "drivers": [
            {
                "name": d.name,
                "unit": d.unit,
                "meaning": d.meaning,
                "lower": d.lower,
                "upper": d.upper,
                "default": d.default,
                "link": d.law or ("by another driver" if d.link is not None else None),
                "reason": d.reason or None,
                "source": d.source or None,
            }
            for d in landform.drivers
        ],
    }


MEGAYEAR = 3.15576e13  # [s], of Julian years
READ_IN = {  # SI units that are read in others: name and size of that in SI
    "rad": ("deg", math.pi / 180),
    "s": ("Myr", MEGAYEAR),
    "m^2/s": ("m^2/Myr", 1 / MEGAYEAR),
    "dimensionless": ("", 1.0),
}


def value_text(value: float, unit: str) -> str:
    """A value with its unit; angles in degrees, ages in millions of years."""
    name, size = READ_IN.get(unit, (unit, 1.0))
    return f"{_short(value / size)} {name}".rstrip()


def range_text(driver: Driver) -> str:
    """``0.1 to 100 m``."""
    name, size = READ_IN.get(driver.unit, (driver.unit, 1.0))
    return f"{_short(driver.lower / size)} to {_short(driver.upper / size)} {name}".rstrip()


def _short(value: float) -> str:
    """Four digits; whole numbers, such as seeds, with all that they have."""
    return f"{value:.0f}" if value == round(value) and abs(value) < 1e10 else f"{value:.4g}"


def default_text(driver: Driver) -> str:
    """The default, the link, or that it must be given."""
    if driver.link is not None:
        return f"= {driver.law}" if driver.law else "by another driver"
    return "must be given" if driver.default is None else value_text(driver.default, driver.unit)


def traits(landform: Landform) -> str:
    """How it meets the ground, in a sentence without a period."""
    parts = [BLENDS[landform.blend]]
    if landform.soil:
        parts.append(f"its soil is {landform.soil}")
    if landform.conserves:
        parts.append("moves soil without loss")
    if landform.children is not None:
        parts.append("brings others along")
    if landform.radial is not None and landform.blend == "add":
        parts.append("can be a population")
    return ", ".join(parts[:-1]) + (" and " if len(parts) > 1 else "") + parts[-1]


def page(register: Register, pictures: Mapping[str, str], sheet: str) -> str:
    """The register as a Markdown page.

    Parameters
    ----------
    pictures : path of the picture of each landform, as seen from the page. sheet : path of the picture of them all.
    """
    forms = [form for name, form in register.landforms.items() if name in register.builtin]
    lines = [
        "# Landforms",
        "",
        f"Written by `{COMMAND}`; do not edit. Soils are in [soils.toml](soils.toml).",
        "",
        "A landform is placed by its origin, heading and scale; its drivers give its shape. Lengths are in metres unless a unit is written",
        '(`diameter = "40 cm"`). A driver with a link follows those before it until it is given. To add one: see',
        "[CONTRIBUTING.md](../CONTRIBUTING.md); without programming, from a profile, a height map, or a solid: [own.md](own.md).",
        "",
        f"![All landforms, each lit from the north-west in its own scale]({sheet})",
        "",
        "| landform | what it is | how it meets the ground | drivers |",
        "|---|---|---|---|",
    ]
    for form in forms:
        drivers = ", ".join(f"`{driver.name}`" for driver in form.drivers)
        lines.append(f"| [{form.name}](#{form.name}) | {_cell(form.meaning)} | {_cell(traits(form))} | {drivers} |")
    for form in forms:
        lines += [
            "",
            f"## {form.name}",
            "",
            f"![{form.name}: plan and profile]({pictures[form.name]})",
            "",
            f"{_sentence(form.meaning)} It {traits(form)}.",
            "",
            f"- Frame: {form.frame}.",
            f"- Source: {form.source}.",
            "",
            "| driver | meaning | range | default or link | why this range; source |",
            "|---|---|---|---|---|",
        ]
        for driver in form.drivers:
            why = "; ".join(text for text in (driver.reason, driver.source) if text)
            lines.append(
                f"| `{driver.name}` | {_cell(driver.meaning)} | {range_text(driver)} | {_cell(default_text(driver))} | {_cell(why)} |"
            )
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    """Text that does not end a cell of a table."""
    return " ".join(text.split()).replace("|", "\\|").replace("*", "\\*")


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:].rstrip(".") + "."
