"""``rille import``: recordings into the database."""

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from rille.cli.places import require_place
from rille.cli.recording_names import gravity_of
from rille.cli.talk import Json, print_json, progress, say
from rille.model.severity import SEVERITIES

if TYPE_CHECKING:
    from rille.model.recording import GateFinding, Recording
    from rille.recording.importing import Gate, Imported, Load
    from rille.recording.manifest import Manifest
    from rille.store import RecordingWriter


def import_recording(
    manifest: Annotated[list[Path], typer.Argument(help="Manifests (TOML): which file, which clock, what each column means.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Database with the model; a new one is made without a model.")],
    report: Annotated[Path | None, typer.Option(help="HTML page with what the data gate found.")] = None,
    as_json: Json = False,
) -> None:
    """Import recordings: CSV, Parquet, MCAP, ROS 1 and 2 bags. The data gate looks at them first; nothing is corrected in silence.

    An import that was interrupted goes on when the same command is given again.

    Example: rille import examples/double_pendulum/acrobot.toml -o pendulum.db --report gate.html
    """
    from rille import store
    from rille.model import InputRefused
    from rille.recording.gate import gate
    from rille.recording.manifest import read_manifest

    sheets = [read_manifest(path) for path in manifest]
    require_place(report, reads=manifest)
    made = not output.exists()
    if made:
        store.create(output)
    done: list[Imported] = []
    try:
        with store.held_open(output):
            for sheet in sheets:
                done += _import(sheet, output, gate, report)
    except InputRefused:
        if made and not done:
            store.remove_database(output)
        raise
    except KeyboardInterrupt:
        say("the import was interrupted; give the same command again to go on")
        raise
    if report is not None:
        _write_report(report, [entry.recording for entry in done], output)
    if as_json:
        print_json({"database": str(output), "recordings": [_facts(entry) for entry in done], "report": report})
        return
    for entry in done[:20]:
        print(_line(entry))
    if len(done) > 20:
        print(f"... and {len(done) - 20} more recordings (`rille record list {quote(str(output))}`)")
    _tell_findings([entry.recording for entry in done])


def _import(manifest: "Manifest", output: Path, gate: "Gate", report: Path | None) -> "tuple[Imported, ...]":
    from rille import recording, store

    def refused(recordings: "Sequence[Recording]", load: "Load") -> None:
        _tell_findings(recordings)
        if report is not None:
            _write_report(report, recordings, manifest.path, load)

    rover = store.read_rover(output)
    scenario = _scenario(manifest, output)
    with progress(f"importing {manifest.sheet.name}") as update:
        return recording.import_recording(
            manifest,
            _Shelf(output, split=bool(manifest.sheet.split)),
            output.parent,
            scenario=scenario,
            gravity=gravity_of(output, scenario),
            targets=recording.targets_of(rover),
            gate=gate,
            on_progress=update,
            on_refused=refused,
        )


def _scenario(manifest: "Manifest", output: Path) -> str | None:
    """Name of the manifest's scenario in the database; a file is stored there."""
    if not isinstance(manifest.scenario, Path):
        return manifest.scenario
    from rille import simulate, store

    scenario = simulate.read_scenario_file(manifest.scenario, store.read_rover(output))
    store.write_scenario(output, scenario)
    return scenario.name


class _Shelf:
    """Recordings of one database."""

    def __init__(self, database: Path, *, split: bool) -> None:
        self._database, self._split = database, split

    def open(self, recording: "Recording") -> "RecordingWriter | None":
        """Begin a recording, or go on with one that was interrupted; None if the same import has completed it before."""
        from rille import store

        if self._split and recording.name in store.recording_names(self._database):
            old = store.read_recording(self._database, recording.name, samples=False)
            if (old.digest, old.manifest) == (recording.digest, recording.manifest):
                return None
        return store.RecordingWriter(self._database, recording)

    def remove(self, name: str) -> None:
        """Forget a recording."""
        from rille import store

        store.remove_recording(self._database, name)


def _write_report(report: Path, recordings: "Sequence[Recording]", source: Path, load: "Load | None" = None) -> None:
    from rille import store
    from rille.view.gate_report import write_gate_report

    write_gate_report(report, recordings, source=str(source), load=load or partial(store.read_channel, source))
    say(f"wrote {report}")


def _line(entry: "Imported") -> str:
    recording = entry.recording
    counts = {role: len(recording.with_role(role)) for role in ("observed", "command", "ignore")}
    channels = ", ".join(f"{count} {role}" for role, count in counts.items() if count)
    kept = f", {entry.kept} samples were there from before" if entry.kept else ""
    span = f"{entry.end - entry.start + 1:.0f} points" if recording.kind == "points" else f"{entry.start:.6g} to {entry.end:.6g} s"
    return f"{recording.name}: {entry.samples} samples of {channels}, {span}{kept}"


def _tell_findings(recordings: "Sequence[Recording]") -> None:
    """Findings on stderr; those of one kind about one channel in the words of the first recording, with the number of others."""
    told: dict[tuple[str, str, str], list[tuple[str, GateFinding]]] = {}
    for recording in recordings:
        for finding in recording.findings:
            told.setdefault((finding.severity, finding.code, finding.channel), []).append((recording.name, finding))
    for (severity, _, _), found in sorted(told.items(), key=lambda item: SEVERITIES.index(item[0][0])):
        name = found[0][0]
        others = len({other for other, _ in found} - {name})
        more = f" (and in {others} more recording{'s' if others > 1 else ''})" if others else ""
        for message in dict.fromkeys(finding.message for other, finding in found if other == name):
            say(f"{severity}: {name}: {message}{more}")


def _facts(entry: "Imported") -> dict[str, object]:
    recording = entry.recording
    shown = ("name", "quantity", "component", "target", "unit", "role", "frame", "clock", "noise", "slow_noise", "delay", "resolution")
    return {
        "name": recording.name,
        "kind": recording.kind,
        "scenario": recording.scenario,
        "source": recording.source,
        "samples": entry.samples,
        "kept": entry.kept,
        "start": entry.start,
        "end": entry.end,
        "channels": [{key: getattr(channel, key) for key in shown} for channel in recording.channels],
        "corrections": [asdict(correction) for correction in recording.corrections],
        "findings": [asdict(finding) for finding in recording.findings],
    }
