"""``rille record new``, ``list`` and ``remove``: draft a manifest, and what recordings a database holds."""

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from rille.cli.places import require_place
from rille.cli.recording_names import chosen_recordings
from rille.cli.talk import Json, print_json, say
from rille.model.severity import SEVERITIES

Database = Annotated[Path, typer.Argument(help="Database.")]


def new(
    file: Annotated[Path, typer.Argument(help="Recording: CSV, Parquet, MCAP, ROS 1 bag, or the folder of a ROS 2 bag.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Manifest to write; default: the file's name with .toml.")] = None,
    model: Annotated[Path | None, typer.Option(help="Database with the model, whose names the targets are.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over an existing manifest.")] = False,
    as_json: Json = False,
) -> None:
    """Draft the manifest of a recording from its columns or topics: every guess says why, what is unknown is ignored.

    Example: rille record new drive.csv -o drive.toml --model rover.db
    """
    from rille import recording, store
    from rille.model import InputRefused
    from rille.recording.draft import draft_manifest

    manifest = output or file.with_suffix(".toml")
    if manifest.exists() and not force:
        raise InputRefused(f"the manifest '{manifest}' exists; give another name with -o, or --force to write over it")
    require_place(manifest, reads=[file])
    targets = None if model is None else recording.targets_of(store.read_rover(model))
    draft = draft_manifest(file, manifest, targets)
    try:
        manifest.write_text(draft.text, encoding="utf-8")
    except OSError as error:
        raise InputRefused(f"'{manifest}' cannot be written: {error.strerror}") from None
    if as_json:
        print_json({"manifest": str(manifest), "guessed": draft.guessed, "unknown": draft.unknown})
        return
    say(f"wrote {manifest}: {len(draft.guessed)} guessed, {len(draft.unknown)} ignored because unknown; read it, then `rille import`")


def list_recordings(database: Database, as_json: Json = False) -> None:
    """Say which recordings a database holds: channels, samples, span, and what the data gate found.

    Example: rille record list rover.db
    """
    from rille import store
    from rille.model.recording import Recording

    rows, names = [], store.recording_names(database)
    for name in names:
        recording: Recording = store.read_recording(database, name, samples=False)
        clocks = store.recording_clocks(database, name)
        counts = {severity: sum(f.severity == severity for f in recording.findings) for severity in SEVERITIES}
        rows.append(
            {
                "name": name,
                "kind": recording.kind,
                "scenario": recording.scenario,
                "source": recording.source,
                "channels": len(recording.channels),
                "clocks": [{"name": c, "samples": n, "start": first, "end": last} for c, (n, first, last) in clocks.items()],
                "corrections": len(recording.corrections),
                "findings": counts,
            }
        )
    if as_json:
        print_json({"database": str(database), "recordings": rows})
        return
    cut = [name for name in store.recording_names(database, unfinished=True) if name not in names]
    if cut:
        say(f"interrupted while it was imported (import again to go on, or remove): {', '.join(cut[:5])}")
    if not rows and not cut:
        say(f"'{database}' holds no recordings; import one: `rille import manifest.toml -o {quote(str(database))}`")
    width = max((len(str(row["name"])) for row in rows), default=0)
    for row in rows:
        spans = [clock for clock in row["clocks"] if clock["samples"]]
        start, end = min((c["start"] for c in spans), default=0.0), max((c["end"] for c in spans), default=0.0)
        span = f"{sum(c['samples'] for c in spans)} points" if row["kind"] == "points" else f"{start:.6g} to {end:.6g} s"
        found = ", ".join(f"{count} {severity}s" for severity, count in row["findings"].items() if count) or "no findings"
        print(f"{row['name']:{width}s}  {row['channels']} channels, {span}, {found}, from {row['source']}")


def remove(
    database: Database,
    name: Annotated[list[str], typer.Argument(help="Names of recordings; 'acrobot', like 'acrobot/*', stands for all parts of a split.")],
    as_json: Json = False,
) -> None:
    """Delete recordings with their samples and findings.

    Example: rille record remove rover.db drive_1
    """
    from rille import store

    chosen = chosen_recordings(store.recording_names(database, unfinished=True), name, database)
    for one in chosen:
        store.remove_recording(database, one)
    if as_json:
        print_json({"database": str(database), "removed": chosen})
    else:
        say(f"removed {', '.join(chosen[:5])}{f' and {len(chosen) - 5} more' if len(chosen) > 5 else ''} from {database}")
