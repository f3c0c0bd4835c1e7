"""What ``landform.toml`` says of an own landform."""

from typing import Literal

from pydantic import Field

from rille.model.sheet import Sheet

Number = float | int | str
Kind = Literal["radial", "section", "formula", "heights"]


class DriverSheet(Sheet):
    """[[driver]]: a named parameter; ``link`` is a formula of the drivers before it."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    unit: str = "m"
    meaning: str = Field(min_length=1)
    range: list[Number] = Field(min_length=2, max_length=2)
    default: Number | None = None
    link: str | None = None
    reason: str = ""
    source: str = ""


class RadialSheet(Sheet):
    """[radial]: points (distance from the centre in ``radius``, height in ``height``), joined smoothly or by straight lines."""

    points: list[list[Number]] = Field(min_length=2)
    radius: Number = "1 m"
    height: Number = "1 m"
    interpolation: Literal["smooth", "linear"] = "smooth"


class SectionSheet(Sheet):
    """[section]: points (x in ``width``, height in ``height``), drawn out along y over ``length``, fading over ``fade`` at its ends."""

    points: list[list[Number]] = Field(min_length=2)
    length: Number
    width: Number = "1 m"
    height: Number = "1 m"
    fade: Number | None = None
    interpolation: Literal["smooth", "linear"] = "smooth"


class FormulaSheet(Sheet):
    """[formula]: height in x, y, r and the drivers, within ``radius`` or the box ``half_x``, ``half_y``; ``fade``: over its outer part."""

    height: str
    radius: Number | None = None
    half_x: Number | None = None
    half_y: Number | None = None
    fade: Number = 0.0


class HeightsSheet(Sheet):
    """[heights]: a grid in a file beside; the value of row i, column j stands at x = west + j posting[0], y = north - i posting[1] [m].

    length : size along x, height : height of its top (largest height or depth, unless ``solid``), at which it is as it was made.
    made_from, sha256, reference : where it comes from.
    """

    file: str
    posting: list[float] = Field(min_length=2, max_length=2)
    west: float
    north: float
    length: float = Field(gt=0)
    height: float = Field(gt=0)
    solid: bool = False
    made_from: str = ""
    sha256: str = ""
    reference: str = ""


class OwnSheet(Sheet):
    """The whole file."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    meaning: str = Field(min_length=1)
    frame: str = Field(min_length=1)
    source: str = Field(min_length=1)
    kind: Kind
    blend: Literal["add", "replace", "max", "drape"] = "add"
    soil: str = ""
    steep: bool = False
    conserves: Literal["", "volume"] = ""
    example: dict[str, Number] = {}
    driver: list[DriverSheet] = []
    radial: RadialSheet | None = None
    section: SectionSheet | None = None
    formula: FormulaSheet | None = None
    heights: HeightsSheet | None = None
