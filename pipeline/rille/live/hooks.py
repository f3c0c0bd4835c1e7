"""Callbacks of a run: a Python file whose functions are called when something happens::

    from rille.live import at, every, on_event, when

    @on_event("stuck")  # any kind of event; without a kind: all
    def back_off(run, event):
        run.steer(-0.05)

    @at(5.0)  # [s]
    @every(0.5)  # [s]
    @when(lambda run: run.read("wheel.sinkage", "wheel_fl")[0] > 0.03, hold=0.1)  # once, each time it begins to hold
    def look(run): ...

Functions are called at whole steps of simulated time, in the order of the file: the same run calls them at the same steps. What they
command becomes part of the run's scenario. One that raises is reported with its line and not called again; the run goes on.
"""

import math
import runpy
import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from rille.live.driving import DrivenWheel, steer
from rille.live.stage import SteeredRun
from rille.model import Event, InputRefused, nearest_names

LOOK = 0.01  # [s] of simulated time between looks at conditions
EVENTS = (  # kinds that the solver tells, and ways in which physics or a watch ends a run
    *("contact_begin", "contact_end", "drive_saturated", "limit_reached", "stuck", "tip_over", "watch", "wheel_spinning"),
    *("settled", "not_settled", "stopped", "left_terrain", "wheel_buried", "diverged"),
)
Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True, slots=True)
class _Mark:
    kind: str  # event, at, every, when
    event: str = ""
    time: float = 0.0
    condition: Callable[[Any], Any] | None = None
    hold: float = 0.0


def _marked(mark: _Mark) -> Callable[[Function], Function]:
    def decorate(function: Function) -> Function:
        marks: list[_Mark] = getattr(function, "rille_marks", [])
        function.rille_marks = [*marks, mark]  # type: ignore[attr-defined]
        return function

    return decorate


def on_event(kind: str = "") -> Callable[[Function], Function]:
    """Call ``function(run, event)`` for every event of a kind (``stuck``, ``tip_over``, ``limit_reached`` ...), or for all.

    Raises
    ------
    InputRefused : for a kind that never happens.
    """
    if kind and kind not in EVENTS:
        raise InputRefused(f"there is no event '{kind}'; {nearest_names(kind, EVENTS)}")
    return _marked(_Mark("event", event=kind))


def at(time: float) -> Callable[[Function], Function]:
    """Call ``function(run)`` once, at a simulated time [s]."""
    return _marked(_Mark("at", time=_time(time, "at")))


def every(interval: float) -> Callable[[Function], Function]:
    """Call ``function(run)`` again and again, every so many [s] of simulated time, from the first interval on."""
    return _marked(_Mark("every", time=_time(interval, "every")))


def when(condition: Callable[["Steering"], Any], hold: float = 0.0) -> Callable[[Function], Function]:
    """Call ``function(run)`` once each time that a condition has begun to hold, and held for so long [s]; looked at every 0.01 s."""
    return _marked(_Mark("when", condition=condition, hold=_time(hold, "hold", zero=True)))


def _time(value: float, what: str, zero: bool = False) -> float:
    if not (isinstance(value, int | float) and math.isfinite(value) and (value > 0 or (zero and value == 0))):
        raise InputRefused(f"{what} is {value!r} s; it must be {'0 or ' if zero else ''}above 0")
    return float(value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Steering:
    """The run as hooks see it."""

    run: SteeredRun
    wheels: Sequence[DrivenWheel]
    say: Callable[[str], None]
    heard: Callable[[float, str, str, str], None] = lambda time, kind, subject, message: None
    saved: Callable[[str], None] = lambda name: None

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.run.simulation.time

    def read(self, quantity: str, target: str) -> list[float]:
        """All numbers of a quantity as of now [SI, in W]. Raises InputRefused for a name that does not exist."""
        return self.run.simulation.read(quantity, target)

    def drive(self, drive: str, value: float) -> None:
        """Set value of a drive from the next step on [rad/s, rad or N m]."""
        self.run.command(drive, value)

    def steer(self, forward: float, turn: float = 0.0) -> None:
        """Forward speed [m/s] and turn rate [rad/s, to the left] of the rover. Raises InputRefused if it has no driven wheels."""
        steer(self.run.command, self.wheels, forward, turn)

    def set(self, quantity: str, target: str, values: Sequence[float]) -> None:
        """Put a joint or the root elsewhere [SI, in W]."""
        self.run.change(quantity, target, list(values))

    def save(self, name: str) -> None:
        """Keep the present state under a name."""
        self.run.save(name)
        self.saved(name)

    def stop(self, sentence: str = "") -> None:
        """End the run here."""
        raise _StopRun(sentence)


class _StopRun(Exception):
    pass


@dataclass(slots=True)
class _Hook:
    name: str
    line: int
    function: Callable[..., Any]
    mark: _Mark
    calls: int = 0
    held: int = 0  # looks for which the condition has held
    fired: bool = False
    off: bool = False


@dataclass(slots=True)
class Hooks:
    """The hooks of a file, and what became of those that failed."""

    path: Path
    step: float
    report: Callable[[str], None]
    told: Callable[[str], None] = lambda sentence: None  # of those that fail, besides
    hooks: list[_Hook] = field(default_factory=list)
    stopped: str | None = None  # the sentence of a hook that ended the run

    def advance(self, run: SteeredRun, count: int, steering: Steering) -> str:
        """Take at most so many steps of a run, calling hooks on the way. Returns the outcome, as ``advance`` of the run."""
        left = count
        while left > 0:
            now = round(run.simulation.time / self.step)
            before = run.steps_taken
            outcome = run.advance(min(left, self._next(now) - now), to_event=True)
            left -= max(1, run.steps_taken - before)
            self._call_due(run, steering)
            if self.stopped is not None:
                return "done" if outcome == "running" else outcome
            if outcome != "running":
                return outcome
        return "running"

    def begin(self, time: float = 0.0) -> None:
        """Another run begins, at a time [s]: what was due up to then has been called in the run that it goes on from."""
        self.stopped = None
        now = round(time / self.step)
        for hook in self.hooks:
            done = hook.mark.kind == "at" and now > 0 and round(hook.mark.time / self.step) <= now
            hook.calls, hook.held, hook.fired = int(done), 0, False

    def _next(self, now: int) -> int:
        """The next step at which something may be due."""
        following = [now + 1_000_000]
        for hook in self.hooks:
            mark = hook.mark
            if hook.off:
                continue
            if mark.kind == "at" and not hook.calls:
                following.append(max(now + 1, round(mark.time / self.step)))
            if mark.kind in ("every", "when"):
                stride = max(1, round((mark.time if mark.kind == "every" else LOOK) / self.step))
                following.append((now // stride + 1) * stride)
        return min(following)

    def _call_due(self, run: SteeredRun, steering: Steering) -> None:
        events = run.events()
        now = round(run.simulation.time / self.step)
        for event in events:
            steering.heard(*event)
        for hook in self.hooks:
            for arguments in self._due(hook, now, events, steering):
                if not hook.off and self.stopped is None:
                    self._call(hook, run, steering, *arguments)

    def _due(self, hook: _Hook, now: int, events: Sequence[tuple[float, str, str, str]], steering: Steering) -> list[tuple[Any, ...]]:
        mark = hook.mark
        if hook.off:
            return []
        if mark.kind == "event":
            made = [Event(time=t, kind=k, subject=s, message=m) for t, k, s, m in events]
            return [(event,) for event in made if not mark.event or event.kind == mark.event]
        if mark.kind == "at":
            return [()] if not hook.calls and now >= round(mark.time / self.step) else []
        stride = max(1, round((mark.time if mark.kind == "every" else LOOK) / self.step))
        if now % stride:
            return []
        if mark.kind == "every":
            return [()]
        assert mark.condition is not None
        try:
            holds = bool(mark.condition(steering))
        except (Exception, SystemExit) as error:
            self._failed(hook, error)
            return []
        hook.held = hook.held + 1 if holds else 0
        hook.fired = hook.fired and holds
        if holds and not hook.fired and (hook.held - 1) * stride * self.step >= mark.hold - 1e-9:
            hook.fired = True
            return [()]
        return []

    def _call(self, hook: _Hook, run: SteeredRun, steering: Steering, *arguments: Any) -> None:
        hook.calls += 1
        try:
            hook.function(steering, *arguments)
        except _StopRun as stop:
            self.stopped = str(stop) or f"hook '{hook.name}' ended the run at t = {run.simulation.time:.3f} s"
        except (Exception, SystemExit) as error:  # also a hook that would end the program does not lose the run
            self._failed(hook, error)

    def _failed(self, hook: _Hook, error: BaseException) -> None:
        hook.off = True
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(self.path)]
        line = lines[-1] if lines else hook.line
        sentence = f"hook '{hook.name}' failed in line {line} of '{self.path}': {type(error).__name__}: {error}; it is not called again"
        self.report(sentence)
        self.told(sentence)


def read_hooks(path: Path, step: float, report: Callable[[str], None]) -> Hooks:
    """Run a Python file and gather its hooks. ``step`` [s] of the run; ``report`` is told of those that fail.

    Raises
    ------
    InputRefused : if the file does not exist, cannot be run (with the line), or has no hooks.
    """
    path = Path(path)
    if not path.is_file():
        raise InputRefused(f"there is no file '{path}' with hooks")
    folder = str(path.resolve().parent)
    sys.path.insert(0, folder)  # so that it can import what lies beside it
    try:
        names = runpy.run_path(str(path))
    except InputRefused:
        raise
    except SyntaxError as error:
        raise InputRefused(f"'{path}' is no Python in line {error.lineno}: {error.msg}") from None
    except (Exception, SystemExit) as error:
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
        raise InputRefused(f"'{path}' failed in line {lines[-1] if lines else '?'}: {type(error).__name__}: {error}") from None
    finally:
        sys.path.remove(folder)
    hooks = Hooks(path=path, step=step, report=report)
    functions = [(name, function) for name, function in names.items() if getattr(function, "rille_marks", None)]
    for name, function in sorted(functions, key=lambda item: item[1].__code__.co_firstlineno):
        for mark in reversed(function.rille_marks):
            hooks.hooks.append(_Hook(name, function.__code__.co_firstlineno, function, mark))
    if not hooks.hooks:
        raise InputRefused(f"'{path}' has no hooks; mark functions with @on_event, @at, @every or @when of rille.live")
    return hooks
