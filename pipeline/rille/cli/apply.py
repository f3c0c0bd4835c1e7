"""``rille apply``: the improved model of a diagnosis, as a new database."""

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from rille.cli.talk import Json, print_json, say


def apply(
    database: Annotated[Path, typer.Argument(help="Database with the model, its recordings and findings.")],
    finding: Annotated[str | None, typer.Argument(help="Name of the finding; default: the newest.")] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="The improved model, a new database.")] = Path("improved.db"),
    as_json: Json = False,
) -> None:
    """Write the improved model that a diagnosis proposes as a new database: its effects added, its numbers changed.

    Recordings go along, so that `rille compare` on the new database shows the fit that was promised; runs of the old model stay behind.
    Changed rows say that they were calibrated, and by which finding.

    Example: rille apply rover.db diagnosis-1 -o improved.db
    """
    from rille import __version__, store
    from rille.cli.proposal import makes_no_better, proposal
    from rille.diagnosis.answer.diagnosis_json import TITLES, plain, setting_of
    from rille.model import InputRefused

    found = store.find_finding(database, finding)
    setting = setting_of(found.setting)
    gap = (found.detail.get("proof") or {}).get("gap_closed")
    if makes_no_better(found.verdict, gap):
        raise InputRefused(
            f"finding '{found.name}' ({TITLES['unknown']}) makes the model no better: of the gap of what was held out it closes {gap:.0%}; "
            "nothing is applied"
        )
    proposed = proposal(database, setting, str(found.detail.get("scenario") or ""))
    if not proposed.changes:
        raise InputRefused(
            f"finding '{found.name}' ({TITLES[found.verdict]}) proposes no change of the model: {found.sentence}"  # type: ignore[index]
        )
    store.improve(
        database,
        output,
        proposed.effects,
        proposed.parameters,
        why=found.name,
        tool=f"rille {__version__} apply",
        scenario=proposed.scenario,
        soils=proposed.soils,
    )
    faults = [term.hypothesis.title for term in setting if term.hypothesis.cause == "sensor"]
    if as_json:
        print_json({"finding": found.name, "database": str(output), "changes": plain(proposed.changes), "not_applied": faults})
        return
    for change in proposed.changes:
        before = "new" if change.before is None else f"{change.before:.6g} ->"
        unit = "" if change.unit in ("1", "-") else f" {change.unit}"
        print(f"{change.table:9s} {change.row:32s} {change.column:24s} {before} {change.after:.6g}{unit}")
    if found.verdict == "unknown":
        say("this has no name: what was applied behaves like it in these recordings, and may do so in no others")
    if faults:
        say(f"faults of sensors are no part of the model and stay in the recordings: {', '.join(faults)}; the fit is as promised once the "
            "manifest corrects them and the recordings are imported again")  # fmt: skip
    shown = " ".join(map(quote, (str(output), *(found.held_out or found.recordings)[:1])))
    say(f"wrote {output}, the model of {database} with {found.name}; see its fit: `rille compare {shown}`")
