"""The solver as a process: its progress, its result, its ways to end."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rille.model import InputRefused


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """How a run ended.

    status : done, stopped (by a watch), interrupted, left_terrain, wheel_buried or diverged. time_reached : [s] simulated. wall : [s] real.
    real_time_factor : simulated per real time [-]. message : the outcome in a sentence, empty when done.
    """

    run_id: int
    scenario: str
    status: str
    time_reached: float
    steps: int
    wall: float
    real_time_factor: float
    message: str


def find_solver() -> str:
    """Path of the program ``rille-solver``: ``RILLE_SOLVER``, else beside this Python, else on the PATH.

    Raises
    ------
    InputRefused : if it is nowhere.
    """
    stated = os.environ.get("RILLE_SOLVER")
    beside = Path(sys.executable).parent / "rille-solver"
    found = stated or (str(beside) if beside.is_file() else shutil.which("rille-solver"))
    if not found:
        raise InputRefused("the program rille-solver was not found; build it with `make build`, or set RILLE_SOLVER to its path")
    return found


def run(
    path: Path,
    *,
    scenario: str | None = None,
    step: float | None = None,
    duration: float | None = None,
    resume: bool = False,
    checkpoint: float | None = None,
    on_progress: Callable[[float, float], None] | None = None,
) -> RunResult:
    """Simulate a scenario of the database; results are written into it while the solver runs.

    Parameters
    ----------
    path : database with model and scenario.
    scenario : its name; None: the only one.
    step, duration : override the scenario's [s].
    resume : go on with the scenario's run that was interrupted, bit by bit as if it had not been.
    checkpoint : real time between checkpoints [s]; 0: only when interrupted; None: the solver's choice.
    on_progress : called with simulated time and duration [s].

    Returns
    -------
    The outcome, also when physics ended the run early or Ctrl-C did: what was computed is in the database.

    Raises
    ------
    InputRefused : with the solver's sentence, if it refused the model.
    RuntimeError : if the solver failed in a way that is our bug.
    """
    command = [find_solver(), "run", str(path), "--progress"]
    if scenario is not None:
        command += ["--scenario", scenario]
    if step is not None:
        command += ["--step", repr(step)]
    if duration is not None:
        command += ["--duration", repr(duration)]
    if resume:
        command.append("--resume")
    if checkpoint is not None:
        command += ["--checkpoint", repr(checkpoint)]
    try:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputRefused(f"the solver '{command[0]}' could not be started: {error}") from error
    assert process.stdout is not None
    assert process.stderr is not None
    sentences = _listen(process, on_progress)
    output = process.stdout.read()
    code = process.wait()
    if code == 3 or (code == 2 and not output):
        raise InputRefused(" ".join(sentences) or f"the solver refused '{path}'")
    if code not in (0, 4, 130):
        raise RuntimeError(f"rille-solver ended with code {code}: {' '.join(sentences) or 'no word'}")
    values = json.loads(output)
    values["wall"] = values.pop("wall_s")
    return RunResult(**values)


def _listen(process: subprocess.Popen, on_progress: Callable[[float, float], None] | None) -> list[str]:
    """Read the solver's talk until it ends. Ctrl-C on a terminal reaches the solver by itself, a signal to this process alone does not."""
    sentences: list[str] = []
    assert process.stderr is not None
    while True:
        try:
            for line in process.stderr:
                word, _, rest = line.strip().partition(" ")
                if word == "progress":
                    if on_progress is not None:
                        time, duration = map(float, rest.split())
                        on_progress(time, duration)
                elif line.strip():
                    sentences.append(line.strip())
            return sentences
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)  # a second one changes nothing
