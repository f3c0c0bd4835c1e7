"""``rille record check``: the data gate over stored recordings."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated

import typer

from rille.cli.talk import Json, print_json, progress, say


def check(
    database: Annotated[Path, typer.Argument(help="Database with recordings.")],
    names: Annotated[
        list[str] | None, typer.Argument(help="Recordings; default: all. A name without '/' stands for all its parts.")
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="HTML page with pictures.")] = None,
    as_json: Json = False,
) -> int:
    """Check recordings again: clocks, missing and stuck values, saturation, units, signs, delays, bad channels; stores what it finds.

    Nothing is changed in the data. Parts of one import (acrobot/1, acrobot/2 ...) are checked together.

    Example: rille record check rover.db drive -o gate.html
    """
    from rille import store
    from rille.recording.gate import gate

    chosen = _chosen(store.recording_names(database), names, database)

    def load(recording: str, channel: str, span: tuple[float, float] | None):
        return store.read_recording(database, recording, channels=[channel], span=span).channel(channel)

    recordings = [store.read_recording(database, name, samples=False) for name in chosen]
    groups: dict[tuple[str, str], list[int]] = {}
    for k, recording in enumerate(recordings):
        groups.setdefault((recording.digest or recording.name, recording.manifest), []).append(k)
    with progress("data gate") as update:
        for j, of in enumerate(groups.values()):
            shares = gate([recordings[k] for k in of], lambda what, done, j=j: update(what, (j + done) / len(groups)), load=load)
            for k, findings in zip(of, shares, strict=True):
                recordings[k] = replace(recordings[k], findings=findings)
                store.write_findings(database, recordings[k].name, findings)
    if output is not None:
        from rille.view.gate_report import write_gate_report

        write_gate_report(output, recordings, source=f"{database}: {', '.join(chosen[:5])}{' ...' if len(chosen) > 5 else ''}", load=load)
        say(f"wrote {output}")
    if as_json:
        print_json({recording.name: [asdict(finding) for finding in recording.findings] for recording in recordings})
        return 0
    seen: dict[str, int] = {}
    for recording in recordings:
        for finding in recording.findings:
            line = f"{finding.severity}: {finding.message}"
            seen[line] = seen.get(line, 0) + 1
    for line, count in sorted(seen.items(), key=lambda item: ("error", "warning", "note").index(item[0].split(":")[0])):
        print(line if len(recordings) == 1 else f"{line} [{count} of {len(recordings)} recordings]")
    errors = sum(line.startswith("error") for line in seen)
    warnings = sum(line.startswith("warning") for line in seen)
    say(
        f"{len(recordings)} recording{'s' if len(recordings) > 1 else ''}: {errors} errors, {warnings} warnings, "
        f"{len(seen) - errors - warnings} notes"
    )
    return 0


def _chosen(known: tuple[str, ...], names: list[str] | None, database: Path) -> list[str]:
    from rille.model import InputRefused, nearest_names

    if not known:
        raise InputRefused(f"'{database}' holds no recording; bring one in with `rille import MANIFEST -o {database}`")
    if not names:
        return list(known)
    chosen: list[str] = []
    for name in names:
        fits = [candidate for candidate in known if candidate == name or candidate.startswith(f"{name}/")]
        if not fits:
            raise InputRefused(f"'{database}' has no recording '{name}'; {nearest_names(name, known)}")
        chosen += [candidate for candidate in fits if candidate not in chosen]
    return chosen
