"""A run with hooks: simulated in process, its commands kept as a scenario of its own."""

import time as clock
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from rille.cli.talk import say
from rille.simulate.run import RunResult

STRETCH = 0.1  # [s] of simulated time between looks at the clock
OUR_OUTCOMES = ("running", "done")


def hooked_run(
    database: Path,
    hooks: Path,
    *,
    scenario: str | None,
    step: float | None,
    duration: float | None,
    on_progress: Callable[[float, float], None],
) -> RunResult:
    """Simulate a scenario under the hooks of a file; the arguments are those of ``simulate.run``.

    The run has a scenario of its own, "NAME-hooks-1", that holds what the hooks commanded: run without hooks it gives the same results.

    Raises
    ------
    InputRefused : if the hooks cannot be read, or the solver refuses the model.
    """
    from rille import live, simulate, store

    base = store.read_scenario(database, scenario)
    base = replace(base, step=step if step is not None else base.step, duration=duration if duration is not None else base.duration)
    found = live.read_hooks(hooks, base.step, say)
    name = store.write_steered(database, base, f"{base.name}-hooks")
    try:
        run = simulate.steered_run(database, name)
    except Exception:
        store.remove_unused(database, name)
        raise
    rover = store.read_rover(database)
    steering = live.Steering(run=run, wheels=live.driven_wheels(rover), say=say)
    n_steps, stretch = max(1, round(base.duration / base.step)), max(1, round(STRETCH / base.step))
    began, told = clock.perf_counter(), clock.perf_counter()
    message = ""
    try:
        outcome = run.begin()
        while outcome == "running" and run.steps_taken < n_steps:
            outcome = found.advance(run, min(stretch, n_steps - run.steps_taken), steering)
            if clock.perf_counter() - told > 0.1:
                told = clock.perf_counter()
                on_progress(run.simulation.time, base.duration)
        message = found.stopped or ""
        run.finish("done" if outcome == "running" else outcome, message)
        status = outcome if outcome not in OUR_OUTCOMES else "stopped" if found.stopped is not None else "done"
    except KeyboardInterrupt:
        status, message = "interrupted", f"interrupted at t = {run.simulation.time:.3f} s; the results so far are readable"
        run.finish("done", message)
    wall = clock.perf_counter() - began
    for sentence in simulate.unheeded(rover, store.read_scenario(database, name)):
        say(f"warning: {sentence}")
    return RunResult(
        run_id=run.id,
        scenario=name,
        status=status,
        time_reached=run.simulation.time,
        steps=run.steps_taken,
        wall=wall,
        real_time_factor=run.simulation.time / wall,
        message=run.message or message,
    )
