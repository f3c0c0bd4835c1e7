"""What requests do to the run of a session."""

import contextlib
import json
import time as clock
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rille.live.driving import steer
from rille.live.hooks import Hooks, Steering
from rille.live.request import (
    Drive,
    HandOver,
    Load,
    Malformed,
    Pause,
    Place,
    Release,
    Request,
    Reset,
    Save,
    Set,
    Speed,
    Start,
    Steer,
    Step,
    Stop,
    Take,
)
from rille.live.stage import Opened, Stage, SteeredRun
from rille.model import InputRefused

if TYPE_CHECKING:
    from rille.live.session import Session

STRETCH = 0.004  # [s] of real time that one stretch of simulation stands for, at least
MOST_SAVES = 1000  # of a database


class Acting:
    """The present run, and what is done to it; lives in the thread of its session."""

    run: SteeredRun

    def __init__(self, stage: Stage, session: "Session") -> None:
        self._stage, self._session = stage, session
        self._place: tuple[float, float, float] | None = None
        self._shown = 0.0  # real time at which the next frame is due
        self._rate = 1000.0  # steps per second of real time, as measured
        self._lapses: tuple[float, str] | None = None  # real time at which steering ends, and who steers
        self.scenario, self.run_id, self.time = "", 0, 0.0
        self._beyond: set[str] = set()  # drives whose last command asked for more than they can
        self.saves: tuple[str, ...] = tuple(stage.saves())
        self.set_values: tuple[float, ...] = ()  # of the drives, as last noted: other threads ask for them
        self.is_open = False

    # ------------------------------------------------------------------ runs

    def open(self, opened: Opened) -> None:
        """Go on with this run."""
        self.run, self.scenario, self.run_id = opened.run, opened.scenario, opened.run.id
        self._lapses = None
        self._beyond.clear()
        self.is_open = True
        session = self._session
        session.state, session.message, session.outcome = "ready", "", "running"
        if session.hooks is not None:
            session.hooks.begin(self.run.simulation.time)
        outcome = self.run.begin()
        self.time = self.run.simulation.time
        if session.hooks is None or outcome != "running":
            self._hear()  # else hooks hear of it first
        if outcome != "running":
            self._end(outcome)
        elif self.time > 0:
            session.state = "paused"

    def close(self) -> None:
        """End the run; one that was never run is forgotten."""
        if not self.is_open:
            return
        self.is_open = False
        unused = self.run.steps_taken == 0 and self._session.state != "ended"
        self.run.finish("done")
        del self.run
        if unused:
            self._stage.discard(self.scenario)

    def give_up(self) -> None:
        """Leave the run, complete if it can be."""
        with contextlib.suppress(Exception):
            self.close()

    def flush(self) -> None:
        """Let others write into the database while nothing goes on."""
        if self.is_open:
            self.run.flush()

    def _end(self, outcome: str) -> None:
        session = self._session
        session.forget_later()
        self.run.finish(outcome, self._hooks_sentence())
        session.state, session.outcome, session.message = "ended", outcome, self.run.message
        session.news()
        session.show()

    def _hooks_sentence(self) -> str:
        return (self._session.hooks.stopped or "") if self._session.hooks is not None else ""

    def _change(self, open_other: Callable[[], Opened], log: Callable[[], None] = lambda: None) -> None:
        """End this run and go on with another, if that can be opened; else raise InputRefused, and nothing has happened. log : writes into
        the run that ends.
        """
        self.flush()
        opened = open_other()
        log()
        self._session.forget_later()
        self.close()
        self.open(opened)

    # ------------------------------------------------------------------ requests

    def do(self, request: Request, log: Callable[[], None]) -> str:
        """Do what is asked, and return why it was refused, or nothing. log : writes it into the log, before the run that it ends."""
        try:
            return self._done(request, log)
        except InputRefused as refusal:
            return str(refusal)

    def _done(self, request: Request, log: Callable[[], None]) -> str:
        session = self._session
        match request:
            case Reset():
                self._change(lambda: self._stage.fresh(self._place), log)
            case Load(name=name):
                if name not in self.saves:
                    return f"no state was saved as '{name}' on this ground, with this gravity and step"
                self._change(lambda: self._stage.loaded(name), log)
            case Speed(factor=factor):
                session.speed = factor
                session.anchor()
            case Take() | Release() | HandOver():
                pass  # the bridge has done it
            case _ if session.state == "ended":
                return f"the run has ended ({session.outcome}); reset or load a state to begin another"
            case Place():
                return self._placed(request)
            case Start():
                session.run_on()
            case Pause():
                session.state = "paused" if self.time > 0 else "ready"
            case Step(count=count):
                session.run_on(count)
            case Stop():
                log()
                self._end("done")
            case Drive(drive=drive, value=value):
                self.run.command(drive, value)
                self._tell_of_reach(drive, value)
            case Steer(forward=forward, turn=turn, lasts=lasts):
                steer(self.run.command, self._stage.wheels, forward, turn)
                self._lapses = None if lasts is None or not (forward or turn) else (clock.perf_counter() + lasts, request.sender)
            case Set(quantity=quantity, target=target, values=values):
                self.run.change(quantity, target, values)
            case Save(name=name):
                if len(self.saves) >= MOST_SAVES and name not in self.saves:
                    return f"the database holds {MOST_SAVES} saved states; save under a name that is there, or use another database"
                self.run.save(name)
                self.saved(name)
        return ""

    def _placed(self, request: Place) -> str:
        if self.time > 0:
            return f"the rover can be placed before the first step only, and it is t = {self.time:.3f} s; reset first"
        if not self._stage.on_ground:
            return "this scenario does not set the model on the ground; give it a terrain and a start on it"
        before = self._place
        heading = request.heading if request.heading is not None else before[2] if before is not None else float("nan")
        place = request.x, request.y, heading
        self._change(lambda: self._stage.fresh(place))
        if self._session.state == "ended":  # it does not come to rest there
            why = f"the rover cannot stand at x = {request.x:.3f} m, y = {request.y:.3f} m: {self._session.message}"
            self._change(lambda: self._stage.fresh(before))
            return why
        self._place = place
        return ""

    def _tell_of_reach(self, drive: str, value: float) -> None:
        """Tell that a drive cannot follow its command: once, until it has had one that it can."""
        sentence = self._stage.beyond_reach(drive, value, self.time)
        if sentence is None:
            self._beyond.discard(drive)
        elif drive not in self._beyond:
            self._beyond.add(drive)
            self._session.tell("beyond_reach", drive, sentence)

    def saved(self, name: str) -> None:
        """A state was kept."""
        self.saves = tuple(sorted({*self.saves, name}))

    def asked(self, question: Callable[[Any], Any]) -> Any:
        """The answer of the simulation. Raises InputRefused where there is none any more."""
        if not self.is_open:
            raise InputRefused("the session has no run any more")
        return question(self.run.simulation)

    def lapsed(self) -> str | None:
        """Who has steered and not said for too long that it should go on."""
        if self._lapses is None or clock.perf_counter() < self._lapses[0]:
            return None
        return self._lapses[1]

    def halt(self) -> None:
        """Set every driven wheel to zero."""
        self._lapses = None
        if self._session.state != "ended":
            for wheel in self._stage.wheels:
                self.run.command(wheel.drive, 0.0)

    def log(self, received: str, request: Request | Malformed, refused: str, text: Any) -> None:
        """A line of the run's log."""
        if not self.is_open or self._session.state == "ended":
            return
        if isinstance(request, Request):
            self.run.log(received, request.sender, request.sequence, request.model_dump_json(), refused)
            return
        said = text if isinstance(text, str) else bytes(text).decode(errors="replace")
        self.run.log(received, "", request.sequence, json.dumps(said[:1000]), refused)

    # ------------------------------------------------------------------ time

    def pace_in(self, anchor: tuple[float, float], speed: float) -> float:
        """[s] of real time until the next stretch is due; 0: now."""
        wall, began = anchor
        due = wall + (self.time + max(self._stage.step, STRETCH * speed) - began) / speed
        return max(0.0, min(due - clock.perf_counter(), 1.0))

    def steps_due(self, anchor: tuple[float, float], speed: float, longest: float) -> int:
        """Steps that the pace asks for now, at most what takes about ``longest`` [s] of real time."""
        wall, began = anchor
        behind = began + (clock.perf_counter() - wall) * speed - self.time
        due = int(behind / self._stage.step + 1e-9)
        most = max(1, int(self._rate * longest))
        if due > 20 * most:
            self._session.anchor()  # cannot keep up
        return max(1, min(due, most))

    def advance(self, count: int, hooks: Hooks | None) -> int:
        """Take at most so many steps; end the run where it ends. Returns the steps taken."""
        before, began = self.run.steps_taken, clock.perf_counter()
        outcome = self.run.advance(count) if hooks is None else hooks.advance(self.run, count, self.steering())
        taken = self.run.steps_taken - before
        spent = clock.perf_counter() - began
        if taken and spent > 0:
            self._rate += 0.1 * (taken / spent - self._rate)
        self.time = self.run.simulation.time
        self._hear()
        if outcome != "running":
            self._end(outcome)
        return taken

    def steering(self) -> Steering:
        """What hooks are given."""
        return Steering(
            run=self.run,
            wheels=self._stage.wheels,
            say=lambda sentence: self._session.tell("hook", "", sentence),
            heard=self._session.listeners.event,
            saved=self.saved,
        )

    def _hear(self) -> None:
        for time, kind, subject, message in self.run.events():
            self._session.listeners.event(time, kind, subject, message)

    def note(self) -> None:
        """Keep what other threads may ask for."""
        if self.is_open:
            self.set_values = tuple(self.run.simulation.set_values())

    # ------------------------------------------------------------------ pictures

    def picture(self) -> bytes:
        """The present frame: float32, little endian."""
        return self.run.simulation.view(self._stage.origin).tobytes()

    def show_in_time(self, interval: float) -> None:
        """Hand out a frame if one is due, every so many [s] of real time."""
        now = clock.perf_counter()
        if now >= self._shown:
            self._shown = max(self._shown + interval, now)
            self.note()
            self._session.show()
