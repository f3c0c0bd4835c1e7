"""``rille record run``: a simulated run as a recording, as instruments would have made it."""

import hashlib
import json
import math
import shutil
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rille.cli.talk import Json, print_json, progress, say

if TYPE_CHECKING:
    from rille.model import Rover
    from rille.model.recording import Recording
    from rille.recording.instrument import Instruments
    from rille.simulate.recorder import Taken

MOST_SAMPLES = 200_000_000  # true and sensed values together 3.2 GB of memory


def run(
    database: Annotated[Path, typer.Argument(help="Database with model and scenario.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="File: .csv, .parquet, .mcap, .bag (ROS 1); without an ending: folder of a ROS 2 bag.")
    ],
    sensors: Annotated[Path | None, typer.Option(help="Sheet of instruments (TOML); default: the model's own sensors.")] = None,
    scenario: Annotated[str | None, typer.Option(help="Scenario file (TOML), or the name of a scenario in the database.")] = None,
    manifest: Annotated[
        Path | None, typer.Option(help="Manifest that imports it; default: beside the file, with the ending .toml.")
    ] = None,
    name: Annotated[str | None, typer.Option(help="Name of the recording; default: that of the sheet, else of the file.")] = None,
    seed: Annotated[int | None, typer.Option(help="Of the random numbers, instead of the sheet's.", min=0)] = None,
    step: Annotated[float | None, typer.Option(help="Time step [s] instead of the scenario's.")] = None,
    duration: Annotated[float | None, typer.Option(help="Simulated time [s] instead of the scenario's.")] = None,
    hide: Annotated[
        str,
        typer.Option(
            help="What the manifest shall not tell, with commas: noise, delay, resolution, saturation, stuck, dropout, gaps, scenario, all."
        ),
    ] = "",
    truth: Annotated[Path | None, typer.Option(help="JSON file for what is true: instruments, effects, seed.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that exist, and a scenario of the same name.")] = False,
    as_json: Json = False,
) -> int:
    """Simulate a scenario and record it with sensors, noise, delays and gaps; writes the manifest that imports it again.

    Example: rille record run rover.db --sensors examples/recording/sensors.toml -o drive.csv
    Example: rille record rover.db --scenario traverse --sensors sensors.toml -o drive.mcap --hide noise,delay --truth truth.json
    """
    from rille import store
    from rille.model import PhysicsFailed
    from rille.recording.instruments import own_instruments, read_instruments
    from rille.recording.writing import find_format, manifest_text, write_recording_file

    hidden = _hidden(hide)
    kind = find_format(output)
    sheet_file = manifest or output.with_name(output.name + ".toml" if not output.suffix else output.stem + ".toml")
    _require_free([output, sheet_file, *([truth] if truth else [])], [database, sensors, Path(scenario or "")], force)
    rover = store.read_rover(database)
    scenario_name = _stored_scenario(database, scenario, rover, force)
    if sensors is not None:
        instruments = read_instruments(sensors, rover)
    else:
        instruments = own_instruments(rover.sensors, rover.effects or store.read_effects(database), rover)
    if seed is not None:
        instruments = replace(instruments, seed=seed)
    title = name or instruments.name or output.stem
    with progress("recording") as update:
        recording, taken = simulated_recording(
            database,
            instruments,
            scenario=scenario_name,
            step=step,
            duration=duration,
            name=title,
            on_progress=lambda time, total: update(f"t = {time:.1f} s of {total:g} s", time / total),
        )
    if not any(len(channel.time) for channel in recording.channels):
        raise PhysicsFailed(f"the run ended at {taken.reached:g} s, before any sensor was read: {taken.message or taken.status}")
    if output.is_dir():
        shutil.rmtree(output)
    else:
        output.unlink(missing_ok=True)
    units = {column: (s.written_unit, s.factor) for s in instruments.sensors for column in s.columns if s.factor != 1.0}
    addresses = write_recording_file(output, recording, units)
    gaps = any(clock.gaps is not None for clock in instruments.clocks.values())
    text = manifest_text(
        recording, _seen_from(output, sheet_file), kind, addresses, gaps=gaps, accepted=_known_faults(instruments), hidden=hidden
    )
    sheet_file.write_text(text, encoding="utf-8")
    if truth is not None:
        truth.write_text(json.dumps(_truth(database, instruments, taken, recording.scenario), indent=2) + "\n", encoding="utf-8")
    _report(recording, taken, database, output, sheet_file, truth, as_json)
    if taken.status in ("done", "stopped"):
        return 0
    say(f"rille: {taken.message or 'interrupted'}; what was simulated until t = {taken.reached:g} s is in {output}")
    return 130 if taken.status == "interrupted" else 4


def _known_faults(instruments: "Instruments") -> dict[str, tuple[str, ...]]:
    """What the data gate will find of channels because their instruments are made so: at the end of its range one repeats its value."""
    faults = {}
    for sensor in instruments.sensors:
        ends = math.isfinite(sensor.lower) or math.isfinite(sensor.upper)
        codes = ("saturation", "stuck") if ends else ("stuck",) if sensor.stuck else ()
        faults |= {column: codes for column in sensor.columns if codes}
    return faults


def simulated_recording(
    database: Path,
    instruments: "Instruments",
    *,
    scenario: str | None = None,
    step: float | None = None,
    duration: float | None = None,
    name: str = "recording",
    on_progress: Callable[[float, float], None] | None = None,
) -> "tuple[Recording, Taken]":
    """Simulate a scenario of the database and see it as the instruments do: the recording, and what the simulation showed.

    Raises
    ------
    InputRefused : if the solver refuses the model or a sensor, or the samples would not fit into memory.
    """
    from rille import store
    from rille.model import InputRefused
    from rille.recording.sensing import instants, recording_of
    from rille.simulate.recorder import Wanted, record

    plan = store.read_scenario(database, scenario)
    length = plan.duration if duration is None else duration
    samples = length * sum(instruments.clocks[sensor.clock].rate * len(sensor.columns) for sensor in instruments.sensors)
    if not length > 0 or samples > MOST_SAMPLES:
        raise InputRefused(
            f"{length:g} s with these sensors are {samples:.3g} samples; a recording holds 1 to {MOST_SAMPLES:.0g}; "
            "change the duration or the rates"
        )
    when = instants(instruments, length)
    wanted = [
        Wanted(
            quantity=sensor.quantity,
            target=sensor.target,
            components=sensor.components,
            frame=sensor.frame,
            times=when[sensor.clock].true - sensor.delay,
        )
        for sensor in instruments.sensors
    ]
    taken = record(database, plan, store.read_rover(database), wanted, step=step, duration=duration, on_progress=on_progress)
    recording = recording_of(instruments, when, taken.values, taken.commands, name=name, scenario=plan.name, reached=taken.reached)
    return recording, taken


def _hidden(text: str) -> frozenset[str]:
    from rille.model import InputRefused, nearest_names
    from rille.recording.writing import HIDEABLE

    words = {word.strip() for word in text.split(",") if word.strip()}
    for word in words - {*HIDEABLE, "all"}:
        raise InputRefused(f"--hide names '{word}', which cannot be hidden; {nearest_names(word, [*HIDEABLE, 'all'])}")
    return frozenset(HIDEABLE) if "all" in words else frozenset(words)


def _require_free(files: list[Path], read: list[Path | None], force: bool) -> None:
    from rille.model import InputRefused

    sources = {file.resolve() for file in read if file is not None}
    for file in files:
        if file.resolve() in sources:
            raise InputRefused(
                f"'{file}' is read for this recording and would be overwritten; choose another name for -o, --manifest or --truth"
            )
        if files.count(file) > 1:
            raise InputRefused(f"'{file}' would be written twice; give recording, manifest and truth different names")
        if not file.parent.is_dir():
            raise InputRefused(f"the folder '{file.parent}' of '{file.name}' does not exist; create it first")
        if file.exists() and not force:
            raise InputRefused(f"'{file}' exists already; choose another name, or replace it with --force")
        if file.is_dir() and not (file / "metadata.yaml").is_file():
            raise InputRefused(f"'{file}' is a folder that is no ROS 2 bag; choose another name")


def _stored_scenario(database: Path, scenario: str | None, rover: "Rover", force: bool) -> str | None:
    """Name of the scenario in the database; a file is stored first, unless the same is there already."""
    from rille import simulate, store
    from rille.model import InputRefused

    if scenario is None or not scenario.endswith(".toml"):
        return scenario
    sheet = simulate.read_scenario_file(Path(scenario), rover)
    try:
        same = store.read_scenario(database, sheet.name) == replace(sheet, sources=())
    except InputRefused:
        same = False
    if not same:
        store.write_scenario(database, sheet, replace=force)
    return sheet.name


def _seen_from(file: Path, manifest: Path) -> str:
    """The file as the manifest names it: relative to it where it lies below."""
    try:
        return str(file.resolve().relative_to(manifest.resolve().parent))
    except ValueError:
        return str(file.resolve())


def _truth(database: Path, instruments: "Instruments", taken: "Taken", scenario: str | None) -> dict[str, Any]:
    from rille import store

    plain = json.loads(json.dumps(asdict(instruments), default=str).replace("-Infinity", "null").replace("Infinity", "null"))
    effects = [effect.as_dict() for effect in store.read_effects(database)]
    digest = hashlib.sha256(database.read_bytes()).hexdigest()
    facts = {"database": str(database), "database_sha256": digest, "scenario": scenario, "status": taken.status, "reached": taken.reached}
    return {**facts, "effects": effects, "instruments": plain}


def _report(
    recording: "Recording", taken: "Taken", database: Path, output: Path, manifest: Path, truth: Path | None, as_json: bool
) -> None:
    import numpy as np

    rows = []
    for channel in recording.channels:
        there = np.isfinite(channel.value)
        facts: dict[str, Any] = {"name": channel.name, "of": channel.of, "unit": channel.unit, "role": channel.role, "clock": channel.clock}
        facts |= {"samples": len(channel.value), "missing": int((~there).sum())}
        facts |= {"least": float(channel.value[there].min()), "largest": float(channel.value[there].max())} if there.any() else {}
        rows.append(facts)
    if as_json:
        facts = {"recording": recording.name, "scenario": recording.scenario, "status": taken.status, "reached": taken.reached}
        print_json({**facts, "file": output, "manifest": manifest, "truth": truth, "channels": rows})
        return
    width = max(len(row["name"]) for row in rows)
    print(f"{'channel':{width}s}  {'samples':>8s} {'missing':>8s} {'least':>12s} {'largest':>12s}  unit")
    for row in rows:
        ends = f"{row['least']:12.5g} {row['largest']:12.5g}" if "least" in row else f"{'':12s} {'':12s}"
        print(f"{row['name']:{width}s}  {row['samples']:8d} {row['missing']:8d} {ends}  {row['unit']}")
    bring = f"rille import {quote(str(manifest))} -o {quote(str(database))}"
    say(f"{taken.reached:g} s of scenario '{recording.scenario}' are in {output}; import them: {bring}")
