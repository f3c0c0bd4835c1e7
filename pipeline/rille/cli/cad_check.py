"""``rille cad check`` and ``rille cad diff``."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rille.cli.places import require_place, require_png
from rille.cli.talk import Json, print_json, progress, say
from rille.model.severity import SEVERITIES

if TYPE_CHECKING:
    from rille.cad.checks import CheckReport, Finding
    from rille.model import Rover


def check(
    model: Annotated[Path, typer.Argument(help="Database with the model.")],
    samples: Annotated[int, typer.Option(help="Combinations of all joints to look for interference in; 0: each joint alone.")] = 256,
    interference: Annotated[bool, typer.Option(help="Look for bodies that run into each other.")] = True,
    mass: Annotated[str | None, typer.Option(help='Budget of the total mass, for example "140 kg".')] = None,
    mass_tolerance: Annotated[str, typer.Option(help='Of the budget: "1 %" or "500 g".')] = "1 %",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="PNG of the pose with the deepest interference.")] = None,
    seed: Annotated[int, typer.Option(help="Of the combinations.")] = 0,
    time_limit: Annotated[str, typer.Option(help="For the search of interference.")] = "2 min",
    codes: Annotated[bool, typer.Option("--codes", help="Also print what every code that was found means.")] = False,
    as_json: Json = False,
) -> None:
    """Check a model: mass, inertia, twins, joints, limits, loops, wheels, and interference over the joints' ranges.

    Exit code 3 where there are errors; warnings and notes leave it at 0.

    Example: rille cad check rover.db --mass "140 kg" --mass-tolerance "5 %" -o worst.png
    """
    from rille import store
    from rille.cad.checks import CODES, examine
    from rille.model import InputRefused
    from rille.model.quantity import to_si

    require_png(output)
    require_place(output)
    if samples < 0:
        raise InputRefused(f"--samples is {samples}; give 0 or more (--no-interference looks at none)")
    limit = to_si(time_limit, "time", "--time-limit")
    if limit <= 0:
        raise InputRefused(f"--time-limit is {limit:g} s; give a time above 0 (--no-interference looks at none)")
    budget = None if mass is None else to_si(mass, "mass", "--mass")
    if budget is not None and budget <= 0:
        raise InputRefused(f"--mass is {budget:g} kg; the budget must be above 0")
    tolerance = _tolerance(mass_tolerance, budget)
    rover = store.read_rover(model)
    with progress(f"checking {model.name}") as update:
        report = examine(
            rover,
            mass_budget=budget,
            mass_tolerance=tolerance,
            samples=samples if interference else -1,
            seed=seed,
            time_limit=limit,
            progress=update,
        )
    picture = None if output is None else _picture(rover, report, output)
    counts = {severity: sum(f.severity == severity for f in report.findings) for severity in SEVERITIES}
    if as_json:
        print_json(_plain(report, counts, picture))
    else:
        _table(list(report.findings))
        if codes:
            for code in sorted({finding.code for finding in report.findings}):
                print(f"{code:<24} {CODES[code]}")
        _summary(model, report, counts)
    if counts["error"]:
        raise typer.Exit(3)


def diff(
    before: Annotated[Path, typer.Argument(help="Database with the model before.")],
    after: Annotated[Path, typer.Argument(help="Database with the model after.")],
    tolerance: Annotated[float, typer.Option(help="Relative change of numbers that is none.")] = 1e-9,
    as_json: Json = False,
) -> None:
    """Say what differs between two models: bodies, masses, centres, inertias, joints, limits, drives, wheels, parts, collision shapes.

    Exit code 0, whether they differ or not.

    Example: rille cad diff rover_v1.db rover_v2.db
    """
    from rille import store
    from rille.cad.diff import diff as compare
    from rille.model import InputRefused

    if not 0 <= tolerance < 1:
        raise InputRefused(f"--tolerance is {tolerance:g}; give a relative change from 0 to below 1")
    changes = compare(store.read_rover(before), store.read_rover(after), tolerance=tolerance)
    if as_json:
        print_json({"before": str(before), "after": str(after), "differences": len(changes), "changes": [asdict(c) for c in changes]})
        return
    subject = ""
    for change in changes:
        heading = f"{change.table} {change.name}"
        if heading != subject:
            print(heading)
            subject = heading
        print(f"  {change.sentence}")
    count = len(changes)
    say(f"{before} and {after}: {'no difference' if count == 0 else f'{count} difference' + ('s' if count > 1 else '')}")


def _tolerance(text: str, budget: float | None) -> float:
    """Relative tolerance of "1 %", "0.01" or, with a budget, "500 g"."""
    from rille.model import InputRefused
    from rille.model.quantity import to_si

    number, percent, rest = text.partition("%")
    if percent and not rest.strip():
        value = to_si(f"{number.strip()}", "dimensionless", "--mass-tolerance") / 100
    elif budget is not None and text.strip()[-1:].isalpha():
        value = to_si(text, "mass", "--mass-tolerance") / budget
    else:
        value = to_si(text, "dimensionless", "--mass-tolerance")
    if value < 0:
        raise InputRefused(f'--mass-tolerance is "{text}"; give 0 or more, for example "1 %"')
    return value


def _picture(rover: "Rover", report: "CheckReport", path: Path) -> Path | None:
    from rille.cad.checks import describe
    from rille.view.check_pictures import draw_worst_pose

    if report.interference is None or not report.interference.found:
        say("nothing runs into anything, so there is no worst pose to draw")
        return None
    worst = report.interference.found[0]
    notes = draw_worst_pose(
        rover,
        worst.positions,
        worst.body_a,
        worst.body_b,
        worst.overlap,
        path,
        title=f"{worst.body_a} runs into {worst.body_b}: {worst.volume * 1e9:,.0f} mm³, {worst.depth * 1e3:.1f} mm deep on average",
        subtitle=describe(worst, {joint.name: joint.kind for joint in rover.joints}),
    )
    for note in notes:
        say(note)
    return None if notes else path


def _table(findings: list["Finding"]) -> None:
    import shutil
    import textwrap

    width = max(80, shutil.get_terminal_size((120, 40)).columns)
    for finding in findings:
        print(f"{finding.severity:<8} {finding.code:<24} {finding.subject}")
        print(textwrap.fill(finding.sentence, width, initial_indent=" " * 9, subsequent_indent=" " * 9))


def _summary(model: Path, report: "CheckReport", counts: dict[str, int]) -> None:
    found = ", ".join(f"{count} {name}{'' if count == 1 else 's'}" for name, count in counts.items() if count) or "nothing to report"
    say(f"{model}: {found}")
    if report.mobility is not None:
        m = report.mobility
        say(
            f"freedom: {m.degrees} in all, {m.inner} of them inside of the mechanism ({m.joints} of joints, {m.constraints} constraints, "
            f"{m.rank} independent)"
        )
    if report.interference is not None:
        i = report.interference
        left = f", {i.impossible} could not be taken" if i.impossible else ""
        say(f"interference: {len(i.found)} pairs of bodies in {i.poses} poses{left} ({i.seconds:.1f} s)")


def _plain(report: "CheckReport", counts: dict[str, int], picture: Path | None) -> dict:
    interference = report.interference
    return {
        "ok": counts["error"] == 0,
        "errors": counts["error"],
        "warnings": counts["warning"],
        "notes": counts["note"],
        "findings": [asdict(finding) for finding in report.findings],
        "mobility": None if report.mobility is None else asdict(report.mobility),
        "interference": None
        if interference is None
        else {
            "pairs": [
                {
                    "body_a": pair.body_a,
                    "body_b": pair.body_b,
                    "volume_mm3": pair.volume * 1e9,
                    "depth_mm": pair.depth * 1e3,
                    "rest_volume_mm3": pair.rest_volume * 1e9,
                    "positions": pair.positions,
                    "poses": pair.count,
                    "approximate": pair.approximate,
                }
                for pair in interference.found
            ],
            "reaches": [asdict(reach) for reach in interference.reaches],
            "poses": interference.poses,
            "impossible": interference.impossible,
            "complete": interference.complete,
            "seconds": interference.seconds,
        },
        "picture": None if picture is None else str(picture),
    }
