"""The register: every file in ``terrain_library`` that defines a landform, and the soils beside them."""

import importlib.util
import math
import os
from functools import cache
from pathlib import Path

from rille.model import InputRefused, Soil
from rille.model.quantity import to_si
from rille.model.sheet import Sheet, read_sheet
from rille.terrain.landform import Landform

Number = float | int | str


def library_folder() -> Path:
    """Folder of the register: ``RILLE_TERRAIN_LIBRARY``, else that of the checkout, else the installed one."""
    package = Path(__file__).resolve().parent.parent
    stated = os.environ.get("RILLE_TERRAIN_LIBRARY")
    folders = [Path(stated)] if stated else [package.parent.parent / "terrain_library", package / "terrain_library"]
    for folder in folders:
        if (folder / "soils.toml").is_file():
            return folder
    raise InputRefused(f"the terrain library was not found in {', '.join(str(f) for f in folders)}; set RILLE_TERRAIN_LIBRARY")


@cache
def landforms() -> dict[str, Landform]:
    """All registered landforms by name. A landform is one file of the library that defines ``LANDFORM``."""
    found: dict[str, Landform] = {}
    for file in sorted(library_folder().glob("*.py")):
        spec = importlib.util.spec_from_file_location(f"rille_terrain_library_{file.stem}", file)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        landform: Landform = module.LANDFORM
        if landform.name != file.stem:
            raise InputRefused(f"the landform in '{file}' is called '{landform.name}'; name it like its file")
        found[landform.name] = landform
    return found


class SoilSheet(Sheet):
    """A soil as written in ``soils.toml`` or a scene; a missing lateral modulus equals the longitudinal one."""

    name: str
    sinkage_exponent: Number
    cohesive_modulus: Number
    frictional_modulus: Number
    cohesion: Number
    friction_angle: Number
    shear_modulus: Number
    lateral_shear_modulus: Number | None = None
    density: Number
    peak_angle_offset: Number = 0.4
    peak_angle_slip: Number = 0.15
    exit_sinkage_ratio: Number = 0.0
    damping: Number = "3e4 Pa s/m"
    reece_cohesive_modulus: float | None = None
    reece_frictional_modulus: float | None = None
    source: str = ""

    def value(self) -> Soil:
        """The soil in SI."""
        what = f"of soil '{self.name}'"

        def si(name: str, unit: str) -> float:
            return to_si(getattr(self, name), unit, f"{name} {what}")

        shear = si("shear_modulus", "m")
        soil = Soil(
            name=self.name,
            sinkage_exponent=si("sinkage_exponent", "dimensionless"),
            cohesive_modulus=float(self.cohesive_modulus),
            frictional_modulus=float(self.frictional_modulus),
            cohesion=si("cohesion", "Pa"),
            friction_angle=si("friction_angle", "rad"),
            shear_modulus=shear,
            lateral_shear_modulus=shear if self.lateral_shear_modulus is None else si("lateral_shear_modulus", "m"),
            density=si("density", "kg/m^3"),
            peak_angle_offset=si("peak_angle_offset", "dimensionless"),
            peak_angle_slip=si("peak_angle_slip", "dimensionless"),
            exit_sinkage_ratio=si("exit_sinkage_ratio", "dimensionless"),
            damping=si("damping", "Pa s/m"),
            reece_cohesive_modulus=self.reece_cohesive_modulus,
            reece_frictional_modulus=self.reece_frictional_modulus,
            source=self.source,
        )
        _check(soil)
        return soil


# Bounds of the schema, said here with the reason, so that a scene is refused before anything is built.
_BOUNDS = {
    "sinkage_exponent": (0.3, 3.0, "published exponents lie between 0.4 and 2.5"),
    "frictional_modulus": (0.0, math.inf, "pressure must not fall with sinkage"),
    "cohesion": (0.0, math.inf, "soil does not push itself apart"),
    "friction_angle": (0.0, 1.5707, "its tangent is the ratio of shear to pressure"),
    "shear_modulus": (1e-9, math.inf, "it divides the shear displacement"),
    "lateral_shear_modulus": (1e-9, math.inf, "it divides the shear displacement"),
    "density": (1e-9, math.inf, "it is a mass"),
    "peak_angle_offset": (0.0, 1.0, "the peak lies inside the contact"),
    "peak_angle_slip": (-1.0, 1.0, "the peak lies inside the contact"),
    "exit_sinkage_ratio": (0.0, 2.0, "the rear contact is at most as high as the axle"),
    "damping": (0.0, math.inf, "damping takes energy out"),
}


def _check(soil: Soil) -> None:
    for name, (lower, upper, reason) in _BOUNDS.items():
        value = getattr(soil, name)
        if not lower <= value <= upper:
            raise InputRefused(f"{name} of soil '{soil.name}' is {value:g}; it must lie between {lower:g} and {upper:g} ({reason})")


class _SoilLibrary(Sheet):
    soil: list[SoilSheet]


@cache
def soils() -> dict[str, Soil]:
    """Soils of the library by name."""
    return {sheet.name: sheet.value() for sheet in read_sheet(library_folder() / "soils.toml", _SoilLibrary).soil}
