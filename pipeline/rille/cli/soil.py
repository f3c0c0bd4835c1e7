"""``rille soil``: the library of soils, and calibration against a bench."""

import math
import re
from pathlib import Path
from typing import Annotated, Any

import typer

from rille.cli.places import require_place, require_png
from rille.cli.rig import Columns, Where, find_effect, pick_soil, read_points, tell_columns, tell_idle, wheel_of
from rille.cli.talk import Json, assignments, print_json, progress, say

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Soils: the library, and calibration against bench data.\n\nExample: rille soil list",
)

FAR = 3  # prior intervals from the prior that are told
UNITS = {
    "sinkage_exponent": "-",
    "cohesive_modulus": "N/m^(n+1)",
    "frictional_modulus": "N/m^(n+2)",
    "cohesion": "Pa",
    "friction_angle": "rad",
    "shear_modulus": "m",
    "lateral_shear_modulus": "m",
    "peak_angle_offset": "-",
    "peak_angle_slip": "-",
    "exit_sinkage_ratio": "-",
    "density": "kg/m^3",
    "damping": "Pa s/m",
    "reece_cohesive_modulus": "-",
    "reece_frictional_modulus": "-",
}


def _known(database: Path | None) -> dict:
    from rille import store, terrain

    return {s.name: s for s in store.read_soils(database)} if database is not None else dict(terrain.soils())


@app.command("list")
def list_(
    database: Annotated[Path | None, typer.Argument(help="Soils of this database instead of the library's.")] = None, as_json: Json = False
) -> None:
    """Soils by name with where they come from.

    Example: rille soil list
    """
    soils = _known(database)
    if as_json:
        print_json([{"name": s.name, "source": s.source} for s in soils.values()])
        return
    for soil in soils.values():
        print(
            f"{soil.name:22s} n = {soil.sinkage_exponent:<5g} c = {soil.cohesion:<6g} Pa  "
            f"phi = {math.degrees(soil.friction_angle):4.1f} deg  {soil.source}"
        )


@app.command("show")
def show(
    name: Annotated[str, typer.Argument(help="Name of the soil.")],
    database: Annotated[Path | None, typer.Argument(help="Look in this database instead of the library.")] = None,
    as_json: Json = False,
) -> None:
    """All numbers of a soil with their units, as they may be written in a scene.

    Example: rille soil show fjs1_simulant
    """
    soil = pick_soil(_known(database), name)
    if as_json:
        print_json({"name": soil.name, **{k: getattr(soil, k) for k in UNITS}, "provenance": soil.provenance, "source": soil.source})
        return
    for line in _toml(soil):
        print(line)


def _toml(soil, comments: dict[str, str] | None = None) -> list[str]:
    lines = ["[[soils]]", f'name = "{soil.name}"']
    for key, unit in UNITS.items():
        value = getattr(soil, key)
        if value is not None:
            lines.append(f"{key} = {value:.6g}  # [{unit}]{(comments or {}).get(key, '')}")
    return [*lines, f'source = "{soil.source}"']


@app.command("fit")
def fit(
    data: Annotated[Path, typer.Argument(help="CSV of bench points: load, slip, drawbar pull, sinkage, torque ...")],
    parameter: Annotated[list[str], typer.Option("--fit", help="Soil parameter to fit, repeatable.")],
    soil: Annotated[str, typer.Option(help="Soil of the library to start from: the prior.")],
    radius: Annotated[str, typer.Option(help='Radius of the rim, "58 mm".')],
    width: Annotated[str, typer.Option(help='Width of the rim, "50 mm".')],
    law: Annotated[str, typer.Option(help="bekker, bekker_wong or reece.")] = "bekker_wong",
    grousers: Annotated[str | None, typer.Option(help='Number and height of grousers, "24 x 10 mm".')] = None,
    column: Columns = None,
    where: Where = None,
    only: Annotated[list[str] | None, typer.Option(help='Use only points that meet this, "slip_ratio>=0", repeatable.')] = None,
    hold_out: Annotated[
        list[str] | None, typer.Option(help='Points kept for the test, "load>50", "slip_ratio>0.5"; default: every third.')
    ] = None,
    response: Annotated[list[str] | None, typer.Option(help="Responses to fit; default: all that were measured.")] = None,
    noise: Annotated[
        list[str] | None,
        typer.Option(
            help='1 sigma of a response in SI, "drawbar_pull=0.56"; default: from repeats, else from what the fit leaves, at most 3 %.'
        ),
    ] = None,
    keep_unobserved: Annotated[
        bool, typer.Option("--keep-unobserved", help="Hold what the data cannot observe at the prior, and go on.")
    ] = False,
    effect: Annotated[list[str] | None, typer.Option(help='Effect that the model has, "slip_sinkage:slip_gain=0.5", repeatable.')] = None,
    gravity: Annotated[float, typer.Option(help="Gravity of the bench [m/s^2].")] = 9.80665,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write the fitted soil as TOML, ready for a scene.")] = None,
    figure: Annotated[Path | None, typer.Option(help="PNG: measured points, prior and fit.")] = None,
    as_json: Json = False,
) -> None:
    """Fit soil parameters to bench data, with priors, intervals and held-out error; refuse what the data cannot observe.

    Example: rille soil fit bench.csv --soil fjs1_simulant --radius "90 mm" --width "100 mm" --fit friction_angle --fit shear_modulus
    """
    import numpy as np

    from rille import diagnosis, simulate, store
    from rille.model import BenchPoints, InputRefused, Soil

    require_png(figure)
    require_place(output, figure, reads=[data])
    prior = pick_soil(_known(None), soil)
    wheel = wheel_of(radius, width, grousers)
    rows = simulate.effect_rows([find_effect(text) for text in effect or []], store.effect_kinds())
    points = read_points(data, column, where, wheel)
    for text in only or []:
        points = points.where(_meets(points, text))
        if len(points) == 0:
            raise InputRefused(f"--only {text} leaves none of the points of '{data}'; give another bound")
    if hold_out:
        held = np.ones(len(points), dtype=bool)
        for text in hold_out:
            held &= _meets(points, text)
    else:
        conditions = np.column_stack(
            [np.round(points.slip_ratio, 2), np.round(points.slip_angle, 2), np.round(points.load / max(points.load.max(), 1e-9), 1)]
        )
        _, group = np.unique(conditions, axis=0, return_inverse=True)
        held = group.ravel() % 3 == 1
    train, test = points.where(~held), points.where(held)
    if len(train) == 0 or len(test) == 0:
        raise InputRefused(f"{len(train)} points are left to fit and {len(test)} to test; change --hold-out or --only")
    floors = {}
    for name, value in assignments(noise, "--noise drawbar_pull=0.56").items():
        try:
            floors[name] = float(value)
        except ValueError:
            floors[name] = math.nan
        if not floors[name] > 0:
            raise InputRefused(f"'{name}={value}' says no noise; write drawbar_pull=0.56, in SI and above 0")

    def bench(earth: Soil, conditions: BenchPoints) -> BenchPoints:
        return simulate.bench_at(law, earth, wheel, conditions, effects=rows, gravity=gravity)

    with progress("fitting") as update:
        result = diagnosis.fit_soil(
            bench, train, test, prior, parameter, noise=floors, responses=response, keep_unobserved=keep_unobserved, progress=update
        )
    fitted = result.soil
    if output is not None:
        comments = {f.name: f" fitted, +- {f.interval:.3g}" + (", ON ITS BOUND" if f.on_bound else "") for f in result.fitted}
        lines = [f"# Fitted to {data.name} by `rille soil fit`, law {law}, prior {prior.name}.", *_toml(fitted, comments)]
        output.write_text("\n".join(lines) + "\n")
    if figure is not None:
        from rille.view.bench_plots import plot_bench

        _figure(bench, prior, fitted, points, figure, plot_bench, f"{data.name}, {law}, r = {wheel.radius:g} m, b = {wheel.width:g} m")
    tell_columns(data, column)
    tell_idle(wheel, rows, [law], [prior])
    if as_json:
        print_json(_facts(result))
        return
    print(f"{law}, {result.n_train} points fitted, {result.n_held_out} held out, condition {result.condition:.3g}")
    for f in result.fitted:
        flag = f"  {abs(f.offset):.0f} PRIOR INTERVALS AWAY: is the prior's soil the bench's?" if abs(f.offset) > FAR else ""
        flag = "  ON ITS BOUND: the law wants what no soil has" if f.on_bound else flag
        print(
            f"  {f.name:22s} {f.prior:12.5g} -> {f.value:12.5g} +- {f.interval:9.3g} {UNITS[f.name]:10s} "
            f"({f.shrink:.0%} of the prior's interval){flag}"
        )
    for name in result.held_at_prior:
        print(f"  {name:22s} held at {getattr(prior, name):.5g}: the data do not observe it")
    print(f"  {'RMS':14s} {'prior':>10s} {'fitted':>10s} | held out: {'prior':>10s} {'fitted':>10s} | repeatability")
    for name, (before_train, before_test) in result.before.items():
        after_train, after_test = result.after[name]
        floor = result.repeatability[name]
        print(
            f"  {name:14s} {before_train:10.4g} {after_train:10.4g} |           {before_test:10.4g} {after_test:10.4g} | "
            f"{floor.sigma:.3g} ({floor.origin})"
        )
    pairs = [(abs(result.correlation[i, j]), i, j) for i in range(len(result.fitted)) for j in range(i)]
    for size, i, j in sorted(pairs, reverse=True)[:3]:
        if size > 0.8:
            print(
                f"  {result.fitted[i].name} and {result.fitted[j].name} are correlated by {result.correlation[i, j]:.2f}: "
                "the data fix them together, not each"
            )
    if result.not_carried:
        say(f"{result.not_carried} points have no value: the fitted soil does not carry the wheel there")
    for file in (output, figure):
        if file is not None:
            say(f"wrote {file}")


def _meets(points, text: str):
    from rille.model import InputRefused
    from rille.model.bench import CONDITIONS

    found = re.fullmatch(r"\s*(\w+)\s*(<=|>=|<|>|=)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(deg)?\s*", text)
    if found is None or found[1] not in CONDITIONS:
        raise InputRefused(f"'{text}' is no condition; write slip_ratio>0.5, load<=50 or slip_angle<30deg")
    value = math.radians(float(found[3])) if found[4] else float(found[3])
    given = getattr(points, found[1])
    tests = {
        "<": given < value,
        ">": given > value,
        "<=": given <= value,
        ">=": given >= value,
        "=": abs(given - value) < 1e-6 + 1e-3 * abs(value),
    }
    return tests[found[2]]


def _figure(bench: Any, prior: Any, fitted: Any, points: Any, path: Path, plot: Any, title: str) -> None:
    """Curves at the loads that were measured, at the slip angle that most points have."""
    import numpy as np

    from rille.model import BenchPoints

    angles, counts = np.unique(np.round(points.slip_angle, 3), return_counts=True)
    angle = angles[np.argmax(counts)]
    shown = points.where(np.abs(points.slip_angle - angle) < 2e-3)
    spread = np.ptp(shown.load) / shown.load.mean()
    loads = np.unique(np.round(shown.load, 1)) if len(np.unique(np.round(shown.load, 1))) <= 6 else np.array([shown.load.mean()])
    if spread < 0.2:
        loads = np.array([shown.load.mean()])
    low, high = shown.slip_ratio.min(), shown.slip_ratio.max()
    slips = np.linspace(min(low, 0.0), high, 41)
    grid = np.array([(w, s) for w in loads for s in slips])
    conditions = BenchPoints.at(grid[:, 0], grid[:, 1], angle)
    curves = [("fitted", bench(fitted, conditions)), (f"prior {prior.name}", bench(prior, conditions))]
    label = title if abs(angle) < 1e-3 else f"{title}, slip angle {np.degrees(angle):.0f} deg"
    plot(curves, path, shown, label)


def _facts(result: Any) -> dict:
    fields = ("name", "prior", "value", "interval", "shrink", "offset", "on_bound")
    return {
        "soil": {k: getattr(result.soil, k) for k in UNITS},
        "fitted": [{f: getattr(p, f) for f in fields} for p in result.fitted],
        "held_at_prior": list(result.held_at_prior),
        "correlation": result.correlation.tolist(),
        "condition": result.condition,
        "rms_before": {k: {"train": v[0], "held_out": v[1]} for k, v in result.before.items()},
        "rms_after": {k: {"train": v[0], "held_out": v[1]} for k, v in result.after.items()},
        "repeatability": {k: {"sigma": v.sigma, "origin": v.origin} for k, v in result.repeatability.items()},
        "n_train": result.n_train,
        "n_held_out": result.n_held_out,
        "not_carried": result.not_carried,
    }
