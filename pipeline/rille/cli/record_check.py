"""``rille record check``: the data gate over stored recordings."""

from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from rille.cli.recording_names import MEANT, chosen_recordings, gravity_of
from rille.cli.talk import Json, print_json, progress, say
from rille.model.severity import SEVERITIES


def check(
    database: Annotated[Path, typer.Argument(help="Database with recordings.")],
    names: Annotated[list[str] | None, typer.Argument(help=f"Names of recordings; {MEANT}")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="HTML page with pictures.")] = None,
    as_json: Json = False,
) -> int:
    """Check recordings again: clocks, missing and stuck values, saturation, units, signs, delays, bad channels; stores what it finds.

    Nothing is changed in the data. Parts of one import (acrobot/1, acrobot/2 ...) are checked together.

    Example: rille record check rover.db drive -o gate.html
    """
    from rille import store
    from rille.recording.acceptance import acceptance_in
    from rille.recording.gate import gate

    chosen = chosen_recordings(store.recording_names(database), names, database)
    load = partial(store.read_channel, database)
    recordings = [store.read_recording(database, name, samples=False) for name in chosen]
    groups: dict[tuple[str, str], list[int]] = {}
    for k, recording in enumerate(recordings):
        groups.setdefault((recording.digest or recording.name, recording.manifest), []).append(k)
    with progress("data gate") as update:
        for j, of in enumerate(groups.values()):
            shares = gate(
                [recordings[k] for k in of],
                lambda what, done, j=j: update(what, (j + done) / len(groups)),
                load=load,
                gravity=gravity_of(database, recordings[of[0]].scenario),
            )
            accepted = acceptance_in(recordings[of[0]].manifest)
            for k, findings in zip(of, shares, strict=True):
                told = accepted.told(findings)
                recordings[k] = replace(recordings[k], findings=told)
                store.write_findings(database, recordings[k].name, told)
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
    for line, count in sorted(seen.items(), key=lambda item: SEVERITIES.index(item[0].split(":")[0])):
        print(line if len(recordings) == 1 else f"{line} [{count} of {len(recordings)} recordings]")
    errors = sum(line.startswith("error") for line in seen)
    warnings = sum(line.startswith("warning") for line in seen)
    counts = [(len(recordings), "recording"), (errors, "error"), (warnings, "warning"), (len(seen) - errors - warnings, "note")]
    first, *others = [f"{n} {word}{'' if n == 1 else 's'}" for n, word in counts]
    say(f"{first}: {', '.join(others)}")
    return 0
