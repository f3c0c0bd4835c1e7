"""``rille terrain stats``: what a DEM says of itself, beside what was asked for and beside another DEM."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rille.cli.talk import Json, print_json, progress, say

if TYPE_CHECKING:
    from rille.model import Terrain

Update = Callable[[str, float], None]


def stats(
    ground: Annotated[Path, typer.Argument(help="Scene (TOML), database with a terrain (.db), or DEM (any raster in metres).")],
    against: Annotated[Path | None, typer.Option(help="Another scene, database or DEM, measured beside it.")] = None,
    name: Annotated[str | None, typer.Option(help="Terrain of the database, if it holds several.")] = None,
    picture: Annotated[Path | None, typer.Option("--picture", "-p", help="Also draw it: PNG, SVG or PDF.")] = None,
    as_json: Json = False,
) -> None:
    """Measure roughness (deviogram, Hurst exponent), slopes by baseline, size-frequency of craters and rocks, depth over diameter.

    Slopes are given twice: along profiles in rows and columns, as in publications on roughness, and true, as on a slope map: a plane
    that dips between both has a smaller slope along profiles. For a scene, all stand beside the laws asked for and the landforms placed.
    Large DEMs are measured on samples, which is said.

    Example: rille terrain stats scene.toml --against moon.tif --picture stats.png
    """
    with progress(f"measuring {ground.name}") as update:
        share = 1.0 if against is None else 0.5
        report = _measured(ground, name, lambda what, fraction: update(what, share * fraction))
        if against is not None:
            report["against"] = _measured(against, None, lambda what, fraction: update(what, 0.5 + 0.5 * fraction))
        if picture is not None:
            from rille.view.terrain_statistics import draw_statistics

            update("drawing", 1.0)
            draw_statistics(report, picture)
            report["picture"] = str(picture)
    if as_json:
        print_json(report)
        return
    print("\n".join(table(report)))
    if picture is not None:
        say(f"wrote {picture}")


def _measured(ground: Path, name: str | None, update: Update) -> dict[str, Any]:
    """The report on a scene, a terrain in a database, or a DEM."""
    from rille.terrain import statistics

    suffix = ground.suffix.lower()
    if suffix == ".toml":
        from rille import terrain

        built = terrain.build(ground, progress=lambda what, fraction: update(what, 0.4 * fraction), tell=say)
        report = _of_terrain(built, lambda what, fraction: update(what, 0.4 + 0.6 * fraction))
        base = _base(ground)
        return report if base is None else {**report, "base": base}
    if suffix == ".db":
        from rille import store

        return _of_terrain(store.read_terrain(ground, name, heights=False), update)
    from rille.terrain.ground_metres import check_metres
    from rille.terrain.raster import open_raster

    raster = open_raster(ground)
    if raster.bands > 1:
        say(f"'{ground.name}' has {raster.bands} bands, band {raster.band} measured")
    (n_rows, n_cols), (east, north), (along_x, along_y) = raster.shape, raster.corner, raster.posting
    check_metres(raster, east + along_x * (n_cols - 1) / 2, north - along_y * (n_rows - 1) / 2)
    marks = raster.lost_marks()
    for heights in raster.strips((0, n_rows), (0, n_cols)):  # all of them: what is measured may be a sample
        marks.look(heights)
    marks.refuse()
    surface = _Windows(raster.shape, raster.read)
    return statistics.measure(ground.name, surface, *raster.posting, progress=update)


def _of_terrain(built: "Terrain", update: Update) -> dict[str, Any]:
    from rille.terrain import statistics

    return statistics.measure(built.name, built.heights, built.posting_x, built.posting_y, terrain=built, progress=update)


def _base(scene: Path) -> dict[str, Any] | None:
    """Roughness asked of a fractal base, and that of the base alone, before landforms; None for other bases."""
    import math

    from rille.model.quantity import to_si
    from rille.model.sheet import read_sheet
    from rille.terrain import statistics
    from rille.terrain.base import make_base
    from rille.terrain.grid import Window
    from rille.terrain.scene import SceneSheet

    sheet = read_sheet(scene, SceneSheet).base
    if sheet.kind != "fractal":
        return None
    ground = make_base(sheet, scene, lambda what, fraction: None)
    grid = ground.grid

    def read(rows: tuple[int, int], cols: tuple[int, int]) -> Any:
        return ground.base.window(grid, Window(row0=rows[0], row1=rows[1], col0=cols[0], col1=cols[1]))

    samples = statistics.sample(_Windows(grid.shape, read))
    slope = math.degrees(to_si(sheet.median_slope, "angle", "median_slope of the base"))
    return {
        "asked": {"hurst": sheet.hurst, "median_slope_deg": slope, "baseline_m": grid.posting_x},
        **statistics.roughness(samples, grid.posting_x, grid.posting_y),
    }


class _Windows:
    """Heights read by two slices."""

    def __init__(self, shape: tuple[int, int], read: Callable[[tuple[int, int], tuple[int, int]], Any]) -> None:
        self.shape, self._read = shape, read

    def __getitem__(self, key: tuple[slice, slice]) -> Any:
        rows, cols = (part.indices(length)[:2] for part, length in zip(key, self.shape, strict=True))
        return self._read(rows, cols)


def table(report: dict[str, Any]) -> list[str]:
    """The report as lines for people."""
    other = report.get("against")
    return [*_head(report), *_rough(report, other), *_slopes(report, other), *_census(report), *_found(report, other)]


def _head(report: dict[str, Any]) -> list[str]:
    px, py = report["posting_m"]
    missing = f", {100 * report['missing_share']:.2g} % of them missing" if report["missing_share"] else ""
    posting = f"{px:.4g} m" if px == py else f"{px:.4g} m x {py:.4g} m"
    return [
        f"{report['name']}: {report['rows']} x {report['columns']} heights at {posting}{missing}; measured on {report['roughness_from']}"
    ]


def _hurst(report: dict[str, Any]) -> str:
    """H from second differences with its interval, and the lags that it was taken from."""
    rough = report["deviogram"]
    if rough["hurst_second"] is None:
        return "none: level ground" if rough["hurst"] is None else "none: a plane"
    low, high = rough["fit_m"]
    ends = rough["hurst_second_interval"]
    spread = "" if ends[0] is None else f" +- {(ends[1] - ends[0]) / 2:.3f}"
    smooth = "; above 1: blurred or interpolated" if rough["hurst_second"] > 1 else ""
    return f"{rough['hurst_second']:.3f}{spread} ({low:.3g} to {high:.3g} m{smooth}), from second differences"


def _deviogram(report: dict[str, Any]) -> str:
    """H of the deviogram."""
    hurst = report["deviogram"]["hurst"]
    return "none" if hurst is None else f"{hurst:.3f}"


def _rough(report: dict[str, Any], other: dict[str, Any] | None) -> list[str]:
    lines = [
        "",
        f"{'Hurst exponent':22}{_hurst(report)}",
        f"{'  of the deviogram':22}{_deviogram(report)}, which tilts and waves longer than the DEM move",
    ]
    base = report.get("base")
    if base is not None:
        asked = base["asked"]
        median = base["slopes"]["p50_deg"][0]
        lines.append(f"{'  of the base alone':22}{_hurst(base)}, asked {asked['hurst']:.3f}; of its deviogram {_deviogram(base)}")
        over = f"{median:.3f} deg over {base['slopes']['baseline_m'][0]:.3g} m"
        lines.append(f"{'  its median slope':22}along profiles {over}, asked {asked['median_slope_deg']:.3f} deg")
    if other is not None:
        lines.append(f"{'  ' + other['name']:22} {_hurst(other)}; of its deviogram {_deviogram(other)}")
    return lines


def _slopes(report: dict[str, Any], other: dict[str, Any] | None) -> list[str]:
    columns = f"{'5 %':>9}{'median':>9}{'95 %':>9}{'RMS':>9}"
    lines = [
        "",
        f"{'slope [deg]':>14}{'along profiles (rows, columns)':>38}{'true (magnitude of the gradient)':>36}",
        f"{'over [m]':>14}  {columns}{columns}",
    ]
    for each, mark in ((report, ""), (other, " *")) if other is not None else ((report, ""),):
        kinds = [each[kind][column] for kind in ("slopes", "true_slopes") for column in ("p5_deg", "p50_deg", "p95_deg", "rms_deg")]
        rows = zip(each["slopes"]["baseline_m"], *kinds, strict=True)
        lines += [f"{length:14.4g}  {''.join(f'{value:9.2f}' for value in values)}{mark}" for length, *values in rows]
    if other is not None:
        lines.append(f"* {other['name']}")
    return lines


def _census(report: dict[str, Any]) -> list[str]:
    lines = []
    for p in report.get("populations", []):
        given = ", ".join(f"{key} {_value(key, value)}" for key, value in p["parameters"].items())
        law = f"population '{p['name']}' of {p['landform']}, law {p['law']}{' (' + given + ')' if given else ''}{_beyond(p)}"
        if not p["on_ground"]:
            lines += ["", f"{law}: no part of its region lies on the ground"]
            continue
        verdict = "inside its Poisson band" if p["inside_band"] else "OUTSIDE its Poisson band"
        lines += ["", f"{law}: {verdict}", f"{'diameter [m]':>18}{'asked':>11}{'band':>17}{'placed':>9}"]
        for low, high, asked, least, most, placed in zip(p["from_m"], p["to_m"], p["asked"], *p["band"], p["placed"], strict=True):
            lines.append(f"{low:8.3g} to {high:6.3g}{asked:11.1f}{f'{least:.0f} to {most:.0f}':>17}{placed:9d}")
    return lines


def _beyond(population: dict[str, Any]) -> str:
    """Says so where a law is used for diameters that its source does not speak of."""
    low, high = population["valid_m"]
    if population["from_m"][0] >= low * (1 - 1e-9) and (high is None or population["to_m"][-1] <= high * (1 + 1e-9)):
        return ""
    return f", extrapolated beyond {low:g} to {high:g} m"


def _value(key: str, value: float | str) -> str:
    """A parameter of a law for people."""
    from rille.terrain.population.chronology import GYR

    if isinstance(value, str):
        return value
    return f"{value / GYR:g} Gyr" if key == "surface_age" else f"{value:g}"


def _found(report: dict[str, Any], other: dict[str, Any] | None) -> list[str]:
    lines = []
    for kind in ("craters", "rocks"):
        for each, mark in ((report, ""), (other, f" of {other['name']}" if other else "")):
            if each is not None:
                lines += ["", *_counts(each[kind], kind, mark)]
    return lines


def _counts(forms: dict[str, Any], kind: str, mark: str) -> list[str]:
    placed = forms["placed"]
    beside = "" if placed is None else f", {forms['placed_total']} of these sizes placed"
    where = f"from {forms['smallest_searched_m']:.3g} to {forms['largest_searched_m']:.3g} m, searched {forms['searched']}"
    lines = [f"{kind}{mark} in the DEM {where}: {forms['found_total']} found{beside}"]
    rows = [k for k, count in enumerate(forms["found"]) if forms["searched_m2"][k] > 0 and (count or (placed and placed[k]))]
    if not rows:
        return lines
    ratio = "depth/diameter" if kind == "craters" else "height/diameter"
    lines.append(f"{'diameter [m]':>18}{'placed':>9}{'found':>9}{'per km^2':>12}{ratio:>16}")
    for k in rows:
        per_km2 = 1e6 * forms["found"][k] / forms["searched_m2"][k]
        middle = forms["depth_over_diameter"]["quartiles"][k]
        lines.append(
            f"{forms['from_m'][k]:8.3g} to {forms['to_m'][k]:6.3g}{'-' if placed is None else placed[k]:>9}{forms['found'][k]:9d}"
            f"{per_km2:12.4g}{'-' if middle is None else f'{middle[1]:.3f}':>16}"
        )
    return lines
