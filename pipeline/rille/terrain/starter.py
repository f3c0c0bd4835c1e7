"""A scene to begin with: readable, with comments that say what can be written where."""

from pathlib import Path
from typing import Literal

from rille.model import InputRefused
from rille.model.sheet import toml_string
from rille.terrain import history
from rille.terrain.base.cells import HeightsMissing
from rille.terrain.scene import read_scene

Kind = Literal["flat", "plane", "fractal", "dem"]


def new_scene(
    scene: Path,
    *,
    name: str | None = None,
    base: Kind = "fractal",
    size: tuple[str, str] | None = None,
    posting: str | None = None,
    dem: str | None = None,
    soil: str = "lunar_sourcebook",
) -> tuple[str, ...]:
    """Write a scene with a base and nothing on it; returns notes worth telling. Heights that a DEM lacks are interpolated, which is noted.

    Parameters
    ----------
    size : along x and y, with units; default 60 m x 40 m, of a DEM all of it. posting : default 0.1 m, of a DEM its own.
    dem : file of a base that is a DEM, from the scene's folder or with ``${RILLE_DATA}``.

    Raises
    ------
    InputRefused : if the file exists, cannot be written, or the base cannot be made.
    """
    if not scene.name or scene.is_dir():
        raise InputRefused(f"'{scene}' is a folder; name the scene file to be written, for example {scene / 'site.toml'}")
    if (base == "dem") != (dem is not None):
        raise InputRefused(f"the base is '{base}'" + (" and needs its file: --dem FILE" if base == "dem" else "; --dem needs --base dem"))

    def text(fill: bool) -> str:
        return "\n".join([*_head(name or scene.stem, soil), "", *_base(base, size, posting, dem, fill), *_TAIL])

    try:
        history.create(scene, text(False), read_scene)
    except HeightsMissing as missing:
        history.create(scene, text(True), read_scene)
        return (f"{missing.count} heights of '{dem}' are missing; the scene interpolates them (fill_holes = true)",)
    return ()


def _head(name: str, soil: str) -> list[str]:
    return [
        "# A scene: a base, what is placed on it, and soils. Lengths and angles carry their unit; bare numbers are SI (m, rad).",
        "# x points east, y north, headings turn from x towards y. `rille terrain place`, move, rotate, scale, set, remove and undo edit",
        "# this file and keep its comments; `rille terrain preview` draws it; `rille terrain build` makes the ground.",
        f"name = {toml_string(name)}",
        f"soil = {toml_string(soil)}  # of all the ground that has no soil of its own",
    ]


def _base(base: Kind, size: tuple[str, str] | None, posting: str | None, dem: str | None, fill: bool) -> list[str]:
    width, height = size or ("60 m", "40 m")
    extent = [f"size = [{toml_string(width)}, {toml_string(height)}]  # along x and y, around the origin"]
    spacing = [f"posting = {toml_string(posting or '0.1 m')}  # distance of neighbouring heights"]
    lines = ["[base]", f'kind = "{base}"']
    if base == "flat":
        return [*lines, *extent, *spacing]
    if base == "plane":
        return [*lines, *extent, *spacing, 'slope = "5 deg"', 'direction = "0 deg"  # in which it rises']
    if base == "fractal":
        return [
            *lines,
            *extent,
            *spacing,
            "hurst = 0.8  # roughness falls with scale: 0.5 rugged, 0.95 smooth",
            'median_slope = "3 deg"  # between neighbouring heights',
            "seed = 1  # another one, another ground",
        ]
    return [
        *lines,
        f"file = {toml_string(dem or '')}",
        *(extent if size is not None else ['# size = ["60 m", "40 m"]  # a part of it, around center = ["0 m", "0 m"]']),
        *(spacing if posting is not None else ['# posting = "0.5 m"  # resampled; without, the heights of the file are kept']),
        "fill_holes = true  # missing heights are interpolated" if fill else "# fill_holes = true  # interpolate missing heights",
    ]


_TAIL = [
    "",
    "# Landforms lie on the base in the order of this file; those with an age (the older below) lie under those without.",
    "# `rille terrain list` shows what can be placed, with its drivers. For example:",
    "#",
    "# [[landform]]",
    '# name = "crater_1"',
    '# landform = "crater"',
    '# x = "5 m"',
    '# y = "-2 m"',
    '# drivers = { diameter = "6 m" }',
    "",
    "# A region with its own soil:",
    "#",
    "# [[soil_patch]]",
    '# name = "soft"',
    '# soil = "lunar_soft"',
    "# polygon = [[0, -2], [3, -2], [3, 2], [0, 2]]",
    "",
]
