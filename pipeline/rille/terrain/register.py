"""The register: built-in landforms (files of ``terrain_library``), own ones (folders), and the soils."""

import hashlib
import importlib
import math
import os
import sys
import types
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from rille.model import InputRefused, Soil, nearest_names
from rille.model.quantity import to_si
from rille.model.sheet import Sheet, read_sheet
from rille.terrain.landform import Landform
from rille.terrain.own.keeping import SHEET, own_files, own_folder
from rille.terrain.own.reading import read_own

Number = float | int | str

PACKAGE = "rille_terrain_library"  # under which the files of the library are imported; they may import each other relatively


def library_folder() -> Path:
    """Folder of the register: ``RILLE_TERRAIN_LIBRARY``, else that of the checkout, else the installed one."""
    package = Path(__file__).resolve().parent.parent
    stated = os.environ.get("RILLE_TERRAIN_LIBRARY")
    folders = [Path(stated)] if stated else [package.parent.parent / "terrain_library", package / "terrain_library"]
    for folder in folders:
        if (folder / "soils.toml").is_file():
            return folder
    raise InputRefused(f"the terrain library was not found in {', '.join(str(f) for f in folders)}; set RILLE_TERRAIN_LIBRARY")


@dataclass(frozen=True, slots=True, kw_only=True)
class Register:
    """What can be placed. landforms : by name, built-in ones first. files : where each is defined. builtin : names of those of rille.

    broken : own landforms that cannot be used, by name, with the sentence that says why.
    """

    landforms: dict[str, Landform]
    files: dict[str, Path]
    builtin: frozenset[str]
    broken: dict[str, str] = field(default_factory=dict)

    def find(self, name: str, subject: str) -> Landform:
        """A landform that ``subject`` names.

        Raises
        ------
        InputRefused : if it is broken, with what is wrong in its file, or not there, with the nearest names.
        """
        if name in self.landforms:
            return self.landforms[name]
        if name in self.broken:
            raise InputRefused(f"{subject} is a '{name}', which cannot be used: {self.broken[name]}")
        raise InputRefused(f"{subject} is a '{name}', which is not registered; {nearest_names(name, self.landforms)}")


def landforms(folders: Iterable[Path] = ()) -> dict[str, Landform]:
    """All landforms that can be placed, by name; see :func:`read_register`."""
    return read_register(folders).landforms


def read_register(folders: Iterable[Path] = ()) -> Register:
    """The built-in landforms, then those of the user's library, then those of further folders, read again where a file changed.

    A landform of a further folder (that a scene brings along) stands before one of the user's of the same name. An own landform that
    cannot be read, or has the name of a built-in one, is left out and named in ``broken``.

    Raises
    ------
    InputRefused : if a folder is missing, or a file of the terrain library itself is wrong.
    """
    library = library_folder()
    found = dict(_builtin(library, _stamp(sorted(library.glob("*.py")))))
    builtin = frozenset(found)
    files = {name: library / f"{name}.py" for name in found}
    broken: dict[str, str] = {}
    user = own_folder()
    for folder in [*([user] if user.is_dir() else []), *map(Path, folders)]:
        if not folder.is_dir():
            raise InputRefused(f"there is no folder '{folder}' with landforms; correct `library`, or make it")
        here: set[str] = set()
        for file in own_files(folder):
            expected = file.parent.name if file.name == SHEET else file.stem
            try:
                landform = _own(file)
                if landform.name in builtin:
                    raise InputRefused(f"'{file}': '{landform.name}' is the name of a built-in landform; rename it")
                if landform.name != expected:
                    raise InputRefused(f"'{file}': the landform is called '{landform.name}'; name it '{expected}', like its place")
                if expected in here:
                    raise InputRefused(f"'{folder}' has two landforms '{expected}'; remove '{expected}.toml' or the folder '{expected}'")
            except InputRefused as refused:
                if expected not in builtin:
                    found.pop(expected, None)
                broken[expected] = str(refused)
                continue
            here.add(expected)
            found[expected], files[expected] = landform, file
            broken.pop(expected, None)
    return Register(landforms=found, files=files, builtin=builtin, broken=broken)


Stamp = tuple[tuple[str, int, int], ...]


def _stamp(files: Iterable[Path]) -> Stamp:
    """Changes when one of the files does."""
    return tuple((str(file), status.st_mtime_ns, status.st_size) for file in files for status in [file.stat()])


@cache
def _builtin(library: Path, stamp: Stamp) -> dict[str, Landform]:
    """Landforms of the library; ``stamp`` keeps what is cached fresh."""
    for name in [name for name in sys.modules if name == PACKAGE or name.startswith(PACKAGE + ".")]:
        del sys.modules[name]
    package = types.ModuleType(PACKAGE)
    package.__path__ = [str(library)]
    sys.modules[PACKAGE] = package
    found: dict[str, Landform] = {}
    for file in sorted(library.glob("[!_]*.py")):
        landform: Landform = importlib.import_module(f"{PACKAGE}.{file.stem}").LANDFORM
        if landform.name != file.stem:
            raise InputRefused(f"the landform in '{file}' is called '{landform.name}'; name it like its file")
        found[landform.name] = replace(landform, digest=hashlib.sha256(f"{landform.name} ".encode() + file.read_bytes()).hexdigest())
    return found


def _own(file: Path) -> Landform:
    try:
        beside = sorted(file.parent.iterdir()) if file.name == SHEET else [file]
        return _read_own(file, _stamp(path for path in beside if path.is_file()))
    except OSError as error:
        raise InputRefused(f"'{file}' cannot be read: {error.strerror}") from None


@cache
def _read_own(file: Path, stamp: Stamp) -> Landform:
    """``stamp`` keeps what is cached fresh."""
    digest = hashlib.sha256()
    for path, _, _ in stamp:
        digest.update(Path(path).name.encode() + b"\0" + Path(path).read_bytes())
    return replace(read_own(file), digest=digest.hexdigest())


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
