"""What a scene says about a population."""

from typing import Any, Literal

from pydantic import Field

from rille.model.sheet import Sheet

Number = float | int | str


class LawSheet(Sheet):
    """law = { name = "golombek", k = 0.05 }: a law with its parameters.

    surface_age : time since the ground was new ("3.5 Gyr"), of `neukum` and `production_or_equilibrium`. equilibrium : which law
    limits it: "trask", "hartmann", "viper". k : share of the ground that rocks cover, of `golombek`. coefficient, exponent : of
    `power`: N(>= D) = coefficient D^-exponent per m^2, D in m.
    """

    name: str
    surface_age: Number | None = None
    equilibrium: str | None = None
    k: Number | None = None
    coefficient: Number | None = None
    exponent: Number | None = None


class DensitySheet(Sheet):
    """density = { map = "rocks.tif" } or { around = "crater_1" }: a factor on the law from place to place.

    map : raster of factors >= 0 in the scene's map coordinates; nothing is placed outside of it. around : name of a placed landform
    with a driver `diameter`; the factor is 1 up to its rim and falls as exp(-r / fall) beyond, r in its radii.
    """

    map: str | None = None
    around: str | None = None
    fall: float = Field(0.7, gt=0)


class PopulationSheet(Sheet):
    """[[population]]: many landforms of one kind, drawn from a law.

    law : name, or table with parameters. diameter : smallest and largest. seed : with the name, of the random numbers.
    count : exactly so many, of the law's sizes only; without it, as many as the law asks for, Poisson-distributed.
    region : [x_min, y_min, x_max, y_max] or corners [[x, y], ...] that hold the centres; without it, the whole grid and so much
    around it that forms reach in from outside. exclude : zones [x, y, radius], [[x, y], ...], or names of placed landforms.
    clear : "footprint": no form reaches into a zone; "centre": no centre lies in it. drivers : value, or [lowest, highest] for
    uniform ones. heading : likewise; random without. age : the older lie below the younger. collide : forms of this diameter and
    more become collision bodies of ``material``, too.
    """

    name: str = Field(min_length=1)
    landform: str
    law: str | LawSheet
    diameter: list[Number] = Field(min_length=2, max_length=2)
    seed: int = Field(0, ge=0)
    count: int | None = Field(None, ge=1)
    region: list[Any] | None = None
    exclude: list[Any] = []
    clear: Literal["footprint", "centre"] = "footprint"
    density: DensitySheet | None = None
    drivers: dict[str, Number | list[Number]] = {}
    heading: Number | list[Number] | None = None
    age: Number | None = None
    collide: Number | None = None
    material: str | None = None
