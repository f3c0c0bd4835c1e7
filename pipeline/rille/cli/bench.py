"""``rille bench``: the single-wheel bench."""

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from rille.cli.places import require_place, require_png
from rille.cli.rig import Columns, Where, find_effect, find_load, find_soils, find_wheel, read_points, tell_columns, tell_idle
from rille.cli.talk import Json, print_json, say

MOST_SLIPS = 10_000  # of a list


def bench(
    database: Annotated[Path | None, typer.Argument(help="Database with wheels and soils; else give --radius and --width.")] = None,
    wheel: Annotated[str | None, typer.Option(help="Name of the wheel in the database; default: the first.")] = None,
    radius: Annotated[str | None, typer.Option(help='Radius of the rim, "150 mm".')] = None,
    width: Annotated[str | None, typer.Option(help='Width of the rim, "165 mm".')] = None,
    grousers: Annotated[str | None, typer.Option(help='Number and height of grousers, "24 x 10 mm".')] = None,
    soil: Annotated[list[str] | None, typer.Option(help="Soil of the database or the library, repeatable.")] = None,
    law: Annotated[list[str] | None, typer.Option(help="bekker, bekker_wong or reece, repeatable.")] = None,
    load: Annotated[list[str] | None, typer.Option(help='Vertical load, "30 N" or "5 kg" (times gravity), repeatable.')] = None,
    slip: Annotated[str, typer.Option(help="Slip ratios: FIRST:LAST:STEP or numbers with commas.")] = "-0.2:0.8:0.05",
    slip_angle: Annotated[str, typer.Option(help='Slip angle, "8 deg".')] = "0 deg",
    gravity: Annotated[str, typer.Option(help="moon, mars, earth, or m/s^2: of loads in kg and of the soil's weight.")] = "earth",
    speed: Annotated[str, typer.Option(help="Speed of the carriage.")] = "0.05 m/s",
    dynamic: Annotated[
        bool, typer.Option("--dynamic", help="Simulate the rig until it has settled, instead of solving the integrals.")
    ] = False,
    effect: Annotated[list[str] | None, typer.Option(help='Effect on the wheel, "slip_sinkage:slip_gain=0.5", repeatable.')] = None,
    measured: Annotated[Path | None, typer.Option(help="CSV of measured points to lay over.")] = None,
    column: Columns = None,
    where: Where = None,
    figure: Annotated[Path | None, typer.Option(help="PNG: drawbar-pull coefficient, torque and sinkage against slip.")] = None,
    csv: Annotated[Path | None, typer.Option(help="CSV of the points.")] = None,
    save: Annotated[str | None, typer.Option(help="Keep the points in table bench_point of the database under this name.")] = None,
    as_json: Json = False,
) -> int:
    """Drawbar pull, torque, side force and sinkage of one wheel: sweeps over slip, load, law and soil.

    Example: rille bench --radius "150 mm" --width "165 mm" --soil lunar_sourcebook --load "5 kg" --load "20 kg" --figure bench.png
    Example: rille bench rover.db --law bekker_wong --law reece --load "30 N" --slip 0:0.8:0.1 --dynamic
    """
    import numpy as np

    from rille import simulate, store
    from rille.model import InputRefused
    from rille.model.quantity import angle_with_unit, to_si

    require_png(figure)
    require_place(figure, csv, reads=[database, measured])
    if save is not None and database is None:
        raise InputRefused("--save needs a database to keep the points in; name one")
    g = simulate.surface_gravity(gravity)
    shape, rows = find_wheel(database, wheel, radius, width, grousers)
    soils = find_soils(database, soil)
    slips = _slips(slip)
    loads = [find_load(text, g) for text in (load or ["30 N"])]
    rows += simulate.effect_rows([find_effect(text) for text in (effect or [])], store.effect_kinds())
    angle = angle_with_unit(slip_angle, "slip angle")
    points = None if measured is None else read_points(measured, column, where, shape)
    method: Any = "dynamic" if dynamic else "quasi_static"
    grid = np.array([(w, s) for w in loads for s in slips])
    laws = law or ["bekker_wong"]
    series = []
    for earth in soils:
        for name in laws:
            result = simulate.bench(
                name,
                earth,
                shape,
                load=grid[:, 0],
                slip_ratio=grid[:, 1],
                slip_angle=angle,
                method=method,
                effects=rows,
                gravity=g,
                speed=to_si(speed, "speed", "speed"),
            )
            series.append((earth.name, name, result))
    if save is not None and database is not None:
        store.write_bench(database, save, method, shape, [(e, n, r.points, r.status) for e, n, r in series])
    if figure is not None:
        from rille.view.bench_plots import plot_bench

        curves = [(f"{n}, {e}" if len(soils) > 1 else n, r.points) for e, n, r in series]
        title = f"r = {1e3 * shape.radius:.4g} mm, b = {1e3 * shape.width:.4g} mm, {', '.join(e.name for e in soils)}"
        plot_bench(curves, figure, points, title)
    if csv is not None:
        lines: list[str] = []
        for earth_name, name, result in series:
            some = simulate.bench_csv_lines(result.points, {"method": method, "soil": earth_name, "response": name})
            lines += some[1 if lines else 0 :]
        csv.write_text("\n".join(lines) + "\n")
    if as_json:
        answer = {"method": method, "effects": effect or [], "series": [_facts(e, n, r) for e, n, r in series]}
        print_json(answer | {"figure": figure, "csv": csv})
    else:
        for earth_name, name, result in series:
            _print_table(", ".join([f"{name} on {earth_name}", method.replace("_", "-"), *(effect or [])]), result)
    tell_idle(shape, rows, laws, soils)
    if measured is not None:
        tell_columns(measured, column)
    failed = sum(word != "done" for _, _, r in series for word in r.status)
    for file in (figure, csv):
        if file is not None:
            say(f"wrote {file}")
    if save is not None:
        say(f"the points are kept as '{save}' in {database} (table bench_point)")
    if failed:
        say(f"rille: {failed} points have no value: the soil did not carry the wheel, or the rig did not settle (column status in --json)")
        return 4
    return 0


def _print_table(title: str, result: Any) -> None:
    print(f"{title}\n   load [N]  slip ratio  sinkage [mm]  drawbar pull [N]   per load  side force [N]  drive torque [N m]")
    p = result.points
    for k, status in enumerate(result.status):
        row = f"{p.load[k]:11.4g} {p.slip_ratio[k]:11.3g} "
        if status == "done":
            row += f"{1e3 * p.sinkage[k]:13.3f} {p.drawbar_pull[k]:17.3f} {p.drawbar_pull[k] / p.load[k]:10.4f} "
            row += f"{p.side_force[k]:15.3f} {p.drive_torque[k]:19.4f}"
        else:
            row += f"{status:>13s}"
        print(row)


def _slips(text: str) -> list[float]:
    import numpy as np

    from rille.model import InputRefused

    refusal = InputRefused(f"'{text}' is no list of slips; write 0:0.8:0.1 or 0,0.2,0.5")
    try:
        numbers = [float(part) for part in text.split(":" if ":" in text else ",")]
    except ValueError:
        raise refusal from None
    if ":" not in text:
        return numbers
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)) or numbers[2] <= 0 or numbers[1] < numbers[0]:
        raise refusal
    first, last, step = numbers
    if (last - first) / step > MOST_SLIPS:
        raise InputRefused(f"'{text}' is a list of {(last - first) / step:.3g} slips; {MOST_SLIPS} are the most: take a larger step")
    count = math.floor((last - first) / step * (1 + 1e-9)) + 1  # LAST itself where the steps reach it but for rounding, never more
    return [float(v) for v in np.round(first + step * np.arange(count), 12)]


def _facts(soil: str, law: str, result) -> dict:
    p = result.points
    numbers = {c: [None if v != v else float(v) for v in getattr(p, c)] for c in p.__dataclass_fields__}
    return {"soil": soil, "response": law, "status": list(result.status), **numbers}
