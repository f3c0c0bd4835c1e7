"""An own landform from its file."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from rille.model import InputRefused
from rille.model.quantity import to_si
from rille.model.sheet import read_sheet
from rille.terrain.landform import Driver, Landform
from rille.terrain.own.formula import parse_formula
from rille.terrain.own.own_size import in_own_size, own_size
from rille.terrain.own.profile import circle, formula_form, radial_form, section_form
from rille.terrain.own.raised import raised_form
from rille.terrain.own.sheet import DriverSheet, OwnSheet
from rille.terrain.own.term import term

RESERVED = {"pi"}
UNITS = ("m", "m^2", "m^3", "1/m", "1/m^2", "rad", "s", "m/s", "m^2/s", "kg", "kg/m^3", "Pa", "dimensionless")


def read_own(file: Path) -> Landform:
    """The landform of a file ``landform.toml`` (or ``<name>.toml``).

    Raises
    ------
    InputRefused : with one sentence that names the file and what cannot be used.
    """
    sheet = read_sheet(file, OwnSheet)
    try:
        return _landform(sheet, file.parent)
    except InputRefused as refused:
        raise InputRefused(f"'{file}': {refused}") from None


def _landform(sheet: OwnSheet, folder: Path) -> Landform:
    subject = f"landform '{sheet.name}'"
    table = getattr(sheet, sheet.kind)
    if table is None:
        raise InputRefused(f"{subject} is of kind '{sheet.kind}' and needs the table [{sheet.kind}]")
    for other in ("radial", "section", "formula", "heights"):
        if other != sheet.kind and getattr(sheet, other) is not None:
            raise InputRefused(f"{subject} is of kind '{sheet.kind}' and has a table [{other}], too; leave one of them")
    drivers = tuple(_drivers(sheet.driver, subject)) or own_size(sheet, subject)
    names = [driver.name for driver in drivers]
    faded = sheet.blend in ("replace", "drape")
    made: dict[str, Any] = {}
    if sheet.radial is not None:
        page = sheet.radial if sheet.driver else sheet.radial.model_copy(update=in_own_size(sheet.radial.points, centred=True))
        radial, footprint = radial_form(page, names, subject, steep=sheet.steep, faded=faded)
        made = {"radial": radial, "footprint": footprint, "outline": circle(footprint)}
    elif sheet.section is not None:
        page = sheet.section
        if not sheet.driver:
            page = page.model_copy(update=in_own_size(page.points, centred=False) | {"length": "length"})
        profile, footprint = section_form(page, names, subject, steep=sheet.steep, faded=faded)
        made = {"profile": profile, "footprint": footprint}
    elif sheet.formula is not None:
        profile, footprint, round_ = formula_form(sheet.formula, names, subject)
        made = {"profile": profile, "footprint": footprint} | ({"outline": circle(footprint)} if round_ else {})
    elif sheet.heights is not None:
        missing = {"length", "height"} - set(names)
        if missing:
            raise InputRefused(f"{subject} is a grid of heights and needs the driver '{min(missing)}'; register it again")
        profile, footprint, outline = raised_form(sheet.heights, folder, subject)
        made = {"profile": profile, "footprint": footprint, "outline": outline}
    landform = Landform(
        name=sheet.name,
        meaning=sheet.meaning,
        frame=sheet.frame,
        source=sheet.source,
        drivers=drivers,
        blend=sheet.blend,
        soil=sheet.soil,
        steep=sheet.steep,
        conserves=sheet.conserves,
        example={},
        **made,
    )
    example = landform.values(dict(sheet.example), f"the example of {subject}")
    return replace(landform, example={name: example[name] for name in sheet.example})


def _drivers(sheets: list[DriverSheet], subject: str) -> list[Driver]:
    found: list[Driver] = []
    for sheet in sheets:
        what = f"driver '{sheet.name}' of {subject}"
        names = [driver.name for driver in found]
        if sheet.name in names or sheet.name in RESERVED:
            raise InputRefused(f"{what} exists already; give each driver its own name")
        if sheet.default is not None and sheet.link is not None:
            raise InputRefused(f"{what} has a default and a link; leave one of them")
        if sheet.unit not in UNITS:
            raise InputRefused(f"{what} has the unit '{sheet.unit}'; formulas count in SI, so take one of {', '.join(UNITS)}")
        lower, upper = (to_si(value, sheet.unit, f"range of {what}") for value in sheet.range)
        if not lower < upper:
            raise InputRefused(f"range of {what} goes from {lower:g} to {upper:g} {sheet.unit}; the first must be the lower one")
        default = None if sheet.default is None else to_si(sheet.default, sheet.unit, f"default of {what}")
        if default is not None and not lower <= default <= upper:
            raise InputRefused(f"default of {what} is {default:g} {sheet.unit}; it must lie between {lower:g} and {upper:g}")
        link = None
        if sheet.link is not None:
            parse_formula(sheet.link, names, f"link of {what}")
            link = term(sheet.link, sheet.unit, names, f"link of {what}")
        found.append(
            Driver(
                name=sheet.name,
                unit=sheet.unit,
                meaning=sheet.meaning,
                lower=lower,
                upper=upper,
                default=default,
                link=link,
                law=sheet.link or "",
                reason=sheet.reason,
                source=sheet.source,
            )
        )
    return found
