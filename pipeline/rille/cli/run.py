"""``rille run``: simulate."""

import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from rille.cli.hooked import hooked_run
from rille.cli.places import require_place
from rille.cli.talk import Force, Json, print_json, progress, say

EFFECTS_SHOWN = 6


def run(
    database: Annotated[Path, typer.Argument(help="Database with the model.")],
    scenario: Annotated[str | None, typer.Option(help="Scenario file (TOML), or the name of a scenario in the database.")] = None,
    step: Annotated[float | None, typer.Option(help="Time step [s] instead of the scenario's.")] = None,
    duration: Annotated[float | None, typer.Option(help="Simulated time [s] instead of the scenario's.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run that was interrupted, as if it had not been.")] = False,
    checkpoint: Annotated[float | None, typer.Option(help="Real time between checkpoints [s]; 0: only on Ctrl-C.")] = None,
    out: Annotated[Path | None, typer.Option(help="Copy the model to this new file and write the results there.")] = None,
    hooks: Annotated[
        Path | None,
        typer.Option(help="Python file of hooks; what they command becomes a scenario of its own."),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> int:
    """Simulate a scenario; results go into the database while it runs. Ctrl-C keeps what was computed.

    Example: rille run rover.db --scenario examples/first_drive/traverse.toml

    Example: rille run rover.db --resume

    Example: rille run rover.db --hooks examples/live/ease_off.py
    """
    from rille import simulate, store, view
    from rille.model import InputRefused

    if checkpoint is not None and not 0 <= checkpoint < math.inf:
        raise InputRefused(f"checkpoint is {checkpoint:g} s; it must be 0 (only on Ctrl-C) or more, and finite")
    if hooks is not None and (resume or checkpoint is not None):
        raise InputRefused("what hooks remember is not kept, so --hooks goes neither with --checkpoint nor with --resume; leave one out")
    if out is not None:
        database = _copied(database, out)
    if resume and scenario is None:
        scenario = _to_resume(database)
    name, rover, new = scenario, store.read_rover(database), False
    if scenario is not None and scenario.endswith(".toml"):
        sheet = simulate.read_scenario_file(Path(scenario), rover)
        new = sheet.name not in store.scenario_names(database)
        store.write_scenario(database, sheet, replace=force)
        name = sheet.name
    if hooks is None and not resume:  # of hooks, what they command is known when they have run
        asked = store.read_scenario(database, name)
        asked = replace(asked, step=asked.step if step is None else step, duration=asked.duration if duration is None else duration)
        for sentence in simulate.unheeded(rover, asked):
            say(f"warning: {sentence}")
    try:
        with progress("simulating") as update:

            def tell(time: float, total: float) -> None:
                update(f"t = {time:.1f} s of {total:g} s", time / total)

            if hooks is not None:
                result = hooked_run(database, hooks, scenario=name, step=step, duration=duration, on_progress=tell)
            else:
                result = simulate.run(
                    database, scenario=name, step=step, duration=duration, resume=resume, checkpoint=checkpoint, on_progress=tell
                )
    except InputRefused:
        if new and name is not None:
            store.remove_scenario(database, name)  # what cannot be run is no scenario of the model
        raise
    trace = store.read_trace(database, result.run_id)
    summary, effects = view.summary(trace, rover), store.read_effects(database)
    if as_json:
        facts = {field: getattr(result, field) for field in result.__dataclass_fields__}
        print_json({"database": str(database), **facts, "effects": [effect.as_dict() for effect in effects], "summary": summary.as_dict()})
    else:
        for line in summary.lines():
            print(line)
        print(f"real-time factor {_figures(result.real_time_factor)} ({result.steps} steps of {trace.step:g} s in {result.wall:.2f} s)")
        shown = [event for event in trace.events if event.kind != result.status]
        for event in shown[:10]:
            say(f"event at {event.time:.3f} s: {event.message}")
        if len(shown) > 10:
            say(f"and {len(shown) - 10} more events (table event)")
        if effects:
            names = list(dict.fromkeys(f"{e.kind} on {e.target}" for e in effects))
            more = f" and {len(names) - EFFECTS_SHOWN} more (`rille effects list {database}`)" if len(names) > EFFECTS_SHOWN else ""
            say(f"beyond the base model: {', '.join(names[:EFFECTS_SHOWN])}{more}")
        say(f"run {result.run_id} of scenario '{result.scenario}' is in {database}")
    if len(trace.time) and result.time_reached > trace.time[-1] + 0.5 * trace.step:
        last, end = trace.time[-1], result.time_reached
        say(f"the numbers end with the last stored state, at {last:g} s of {end:g} s; shorten output_interval to have them to the end")
    if result.status == "done":
        return 0
    say(f"rille: {result.message}")
    if result.status == "stopped":
        return 0
    return 130 if result.status == "interrupted" else 4


def _to_resume(database: Path) -> str | None:
    """The scenario whose run was interrupted, if that is one."""
    from rille import store
    from rille.model import InputRefused

    waiting = store.resumable_scenarios(database)
    if len(waiting) > 1:
        raise InputRefused(f"runs of the scenarios {', '.join(map(repr, waiting))} were interrupted; name one with --scenario")
    return waiting[0] if waiting else None


def _figures(value: float) -> str:
    """Two significant digits, without an exponent."""
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def _copied(database: Path, out: Path) -> Path:
    """A copy of the model in a new file; the original is only read."""
    from rille import store
    from rille.model import InputRefused

    store.info(database)  # refuses what is no database of rille before anything is made
    if out.exists():
        raise InputRefused(f"'{out}' exists already; choose another name for --out or remove it")
    require_place(out)
    try:
        shutil.copyfile(database, out)
    except OSError as error:
        raise InputRefused(f"'{out}' of --out cannot be written: {error.strerror or error}; choose another place") from error
    return out
