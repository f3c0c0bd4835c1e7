"""``rille bench``: the single-wheel bench."""

from pathlib import Path
from typing import Annotated, Any

import typer

from rille.cli.talk import Json, print_json, say

Columns = Annotated[list[str] | None, typer.Option("--column", help="QUANTITY=COLUMN of the CSV: sinkage=-Z_mm, load=64.7:N; repeatable.")]
Where = Annotated[list[str] | None, typer.Option("--where", help="COLUMN=TEXT that rows of the CSV must have; repeatable.")]


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
    from rille.model.quantity import to_si
    from rille.simulate.scenario_file import GRAVITY

    g = GRAVITY[gravity] if gravity in GRAVITY else to_si(gravity if not _number(gravity) else float(gravity), "acceleration", "gravity")
    shape, rows = _wheel(database, wheel, radius, width, grousers)
    soils = _soils(database, soil)
    slips = _slips(slip)
    loads = [_load(text, g) for text in (load or ["30 N"])]
    effects = [_effect(text) for text in (effect or [])]
    if effects:
        rows = [*rows, *simulate.effect_rows(effects, store.effect_kinds())]
    angle = to_si(slip_angle if not _number(slip_angle) else float(slip_angle), "angle", "slip angle")
    method: Any = "dynamic" if dynamic else "quasi_static"
    grid = np.array([(w, s) for w in loads for s in slips])
    series = []
    for earth in soils:
        for name in law or ["bekker_wong"]:
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
                speed=to_si(speed if not _number(speed) else float(speed), "speed", "speed"),
            )
            series.append((earth.name, name, result))
    if save is not None:
        if database is None:
            raise InputRefused("--save needs a database to keep the points in; name one")
        store.drop_bench(database, save)
        for earth_name, name, result in series:
            store.write_bench(database, save, method, earth_name, name, shape, result.points, result.status)
    points = None if measured is None else read_points(measured, column, where)
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
        print_json({"method": method, "series": [_facts(e, n, r) for e, n, r in series], "figure": figure, "csv": csv})
    else:
        for earth_name, name, result in series:
            _print_table(f"{name} on {earth_name}, {method.replace('_', '-')}", result)
    failed = sum(word != "done" for _, _, r in series for word in r.status)
    for file in (figure, csv):
        if file is not None:
            say(f"wrote {file}")
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


def _number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _load(text: str, gravity: float) -> float:
    from rille.model import InputRefused
    from rille.model.quantity import to_si

    if _number(text):
        return float(text)
    try:
        return to_si(text, "mass", "load") * gravity
    except InputRefused:
        return to_si(text, "force", "load")


def _slips(text: str) -> list[float]:
    import numpy as np

    from rille.model import InputRefused

    try:
        if ":" in text:
            first, last, step = map(float, text.split(":"))
            count = round((last - first) / step)
            if not (step > 0 and 0 <= count <= 10000):
                raise ValueError
            return [float(v) for v in np.round(first + step * np.arange(count + 1), 12)]
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputRefused(f"'{text}' is no list of slips; write 0:0.8:0.1 or 0,0.2,0.5") from None


def _wheel(database: Path | None, name: str | None, radius: str | None, width: str | None, grousers: str | None):
    from rille import simulate, store
    from rille.model import BenchWheel, Effect, InputRefused, nearest_names
    from rille.model.quantity import to_si

    rows: list[tuple] = []
    if database is not None:
        wheels = {wheel.name: wheel for wheel in store.read_rover(database).wheels}
        if not wheels and (radius is None or width is None):
            raise InputRefused(f"'{database}' has no wheel; build a rover into it, or give --radius and --width")
        if name is not None and name not in wheels:
            raise InputRefused(f"'{database}' has no wheel '{name}'; {nearest_names(name, wheels)}")
        if wheels and radius is None:
            made = wheels[name] if name is not None else next(iter(wheels.values()))
            acting = [e for e in store.read_effects(database) if e.target in ("*", made.name)]
            kinds = {k.name: k for k in store.effect_kinds()}
            on_wheel = [Effect(kind=e.kind, parameters=e.parameters) for e in acting if kinds[e.kind].target == "wheel"]
            rows = simulate.effect_rows(on_wheel, store.effect_kinds())
            count, height = (made.grouser.count, made.grouser.height) if made.grouser is not None else (0, 0.0)
            return BenchWheel(radius=made.radius, width=made.width, grouser_count=count, grouser_height=height), rows
    if radius is None or width is None:
        raise InputRefused('the bench needs a wheel: a database, or --radius "150 mm" --width "165 mm"')
    count, height = 0, 0.0
    if grousers is not None:
        number, cross, size = grousers.partition("x")
        if not cross or not number.strip().isdigit():
            raise InputRefused(f"'{grousers}' says no grousers; write \"24 x 10 mm\"")
        count, height = int(number), to_si(size.strip(), "length", "height of the grousers")
    lengths = [to_si(float(v) if _number(v) else v, "length", what) for v, what in ((radius, "radius"), (width, "width"))]
    return BenchWheel(radius=lengths[0], width=lengths[1], grouser_count=count, grouser_height=height), rows


def _soils(database: Path | None, names: list[str] | None):
    from rille import store, terrain
    from rille.model import InputRefused, nearest_names

    known = dict(terrain.soils())
    if database is not None:
        known |= {soil.name: soil for soil in store.read_soils(database)}
        names = names or [soil.name for soil in store.read_soils(database)]
    names = names or ["lunar_sourcebook"]
    for name in names:
        if name not in known:
            raise InputRefused(f"there is no soil '{name}'; {nearest_names(name, known)}")
    return [known[name] for name in names]


def _effect(text: str):
    from rille import store
    from rille.cli.effects import parse_values
    from rille.model import Effect

    name, _, rest = text.partition(":")
    effect = Effect(kind=name, parameters=parse_values([part for part in rest.split(",") if part]))
    store.check_effect(effect)
    return effect


def read_points(path: Path, column: list[str] | None, where: list[str] | None):
    """Measured points of a CSV with the options of the command line."""
    from rille import simulate
    from rille.model import InputRefused

    pairs = []
    for texts in (column or [], where or []):
        found = {}
        for text in texts:
            key, equals, value = text.partition("=")
            if not equals:
                raise InputRefused(f"'{text}' is no NAME=VALUE, for example --column sinkage=-Z_mm")
            found[key] = value
        pairs.append(found)
    return simulate.read_bench_csv(path, *pairs)


def _facts(soil: str, law: str, result) -> dict:
    p = result.points
    columns = ("load", "slip_ratio", "slip_angle", "sinkage", "drawbar_pull", "side_force", "drive_torque")
    numbers = {c: [None if v != v else float(v) for v in getattr(p, c)] for c in columns}
    return {"soil": soil, "response": law, "status": list(result.status), **numbers}
