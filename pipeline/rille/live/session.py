"""A live session: one run at a time, stepped in a thread of its own, steered by requests, seen through frames.

Only that thread touches the run. Requests wait in a queue and are answered through futures; frames and news are handed to listeners, which
must not wait: whoever is slow misses frames, never holds up the simulation.
"""

import heapq
import itertools
import queue
import threading
import time as clock
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, Literal

from rille.live.acting import Acting
from rille.live.bridge import Bridge
from rille.live.hooks import Hooks
from rille.live.request import Answer, HandOver, Malformed, Release, Request, Take, read_request
from rille.live.stage import Stage

State = Literal["ready", "running", "paused", "ended"]
FRAME = 1 / 60  # [s] of real time between frames
LONGEST_CHUNK = 0.005  # [s] of real time between looks at the queue, about
MOST_AT_ONCE = 64  # requests between two looks at the time: a flood of them does not hold it up
MOST_REFUSALS_LOGGED = 1000  # of one session: a flood of nonsense must not fill the disk


@dataclass(frozen=True, slots=True, kw_only=True)
class Status:
    """How the session stands. time [s] simulated; speed: simulated per real time; outcome: as of a run, ``running`` before its end.
    set_values: of the drives [rad/s, rad or N m].
    """

    state: State
    time: float
    speed: float
    commander: str | None
    asked_by: str | None
    scenario: str
    run_id: int
    outcome: str
    message: str
    saves: tuple[str, ...]
    set_values: tuple[float, ...]


@dataclass(slots=True)
class Listeners:
    """What is told to the outside, from the session's thread: frames (time [s], float32 bytes), status, events."""

    frame: Callable[[float, bytes], None] = lambda time, numbers: None
    status: Callable[[Status], None] = lambda status: None
    event: Callable[[float, str, str, str], None] = lambda time, kind, subject, message: None


@dataclass(slots=True)
class _Asked:
    """sender : whose connection it came by; None: by none that is known."""

    text: str | bytes | Request
    received: str
    sender: str | None
    answer: "Future[Answer]" = field(default_factory=Future)

    def read(self) -> Request | Malformed:
        """The request, or what is wrong with it."""
        return self.text if isinstance(self.text, Request) else read_request(self.text)


class Session:
    """Steers runs by requests."""

    def __init__(self, stage: Stage, hooks: Hooks | None = None) -> None:
        self.stage, self.listeners, self.bridge = stage, Listeners(), Bridge()
        self.hooks = hooks
        if hooks is not None:
            hooks.told = lambda sentence: self.tell("hook_failed", "", sentence)
        self._asked: queue.SimpleQueue[_Asked | Callable[[], None] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._work, name="rille-live", daemon=True)
        self._later: list[tuple[float, int, _Asked, Request]] = []  # by simulated time
        self._numbers = itertools.count()
        self._refusals_logged = 0
        self._failed: BaseException | None = None
        self.state: State = "ready"
        self.speed = 1.0
        self.outcome, self.message = "running", ""
        self._steps_left: int | None = None  # of a request to step
        self._acting = Acting(stage, self)
        self._anchor = (0.0, 0.0)  # real and simulated time from which the pace counts

    def begin(self) -> None:
        """Open the first run, come to rest, and start to listen. Raises what opening raises."""
        self._acting.open(self.stage.fresh(None))
        self._thread.start()

    def refresh(self) -> None:
        """Tell and show once more how things stand: somebody new listens."""

        def again() -> None:
            self.news()
            self.show()

        self._asked.put(again)

    def ask(self, request: str | bytes | Request, sender: str | None = None) -> "Future[Answer]":
        """Put a request, as JSON or as a value; the answer comes when it was done, kept for later, or refused. sender : whose connection it
        came by, which cannot speak for others.
        """
        asked = _Asked(request, _now(), sender)
        self._asked.put(asked)
        return asked.answer

    def call(self, question: Callable[[Any], Any]) -> "Future[Any]":
        """Ask the run something, between two steps: ``question(run.simulation)``."""
        answer: Future[Any] = Future()

        def put() -> None:
            if not answer.set_running_or_notify_cancel():
                return
            try:
                answer.set_result(self._acting.asked(question))
            except Exception as error:
                answer.set_exception(error)

        self._asked.put(put)
        return answer

    def status(self) -> Status:
        """How the session stands."""
        return Status(
            state=self.state,
            time=self._acting.time,
            speed=self.speed,
            commander=self.bridge.commander,
            asked_by=self.bridge.asked_by,
            scenario=self._acting.scenario,
            run_id=self._acting.run_id,
            outcome=self.outcome,
            message=self.message,
            saves=self._acting.saves,
            set_values=self._acting.set_values,
        )

    def commander_left(self, sender: str) -> None:
        """The connection of a sender is gone: if it commanded, the rover is stopped and the command is free."""

        def let_go() -> None:
            if self.bridge.asked_by == sender:
                self.bridge.asked_by = None
                self.news()
            if self.bridge.commander != sender:
                return
            self.bridge.commander = None
            self._acting.halt()
            self.tell("commander_left", sender, f"'{sender}' is gone; the rover was told to stand, and anybody can take the command")
            self.news()

        self._asked.put(let_go)

    def close(self) -> None:
        """End the run and the thread; what was recorded is complete. Once more does nothing."""
        self._asked.put(None)
        if self._thread.is_alive():
            self._thread.join()
        if self._failed is not None:
            raise self._failed

    # ------------------------------------------------------------------ in the thread

    def _work(self) -> None:
        try:
            self.news()
            self.show()
            while self._listen():
                if self.state == "running" and self._acting.pace_in(self._anchor, self.speed) <= 0:
                    self._go_on()
            self._acting.close()
        except BaseException as error:
            self._failed = error
            self.state, self.outcome, self.message = "ended", "failed", f"the session failed: {error}"
            self._acting.give_up()
            self.news()
            self._refuse_all()

    def _refuse_all(self) -> None:
        """Answer that the session has failed, until it is closed: nobody waits for ever."""
        while (asked := self._asked.get()) is not None:
            if not isinstance(asked, _Asked):
                asked()
                continue
            self._reply(asked, asked.read(), self.message, self._acting.time)

    def _listen(self) -> bool:
        """Do what was asked; without anything to simulate wait for it. False: the end."""
        wait = self._acting.pace_in(self._anchor, self.speed) if self.state == "running" else None
        if wait is None and self._asked.empty():
            self._acting.flush()
        try:
            asked = self._asked.get(timeout=wait) if wait is None or wait > 0 else self._asked.get_nowait()
        except queue.Empty:
            return True
        for left in reversed(range(MOST_AT_ONCE)):
            if asked is None:
                return False
            self._answer(asked) if isinstance(asked, _Asked) else asked()
            if not left or self._asked.empty():
                break
            asked = self._asked.get()
        return True

    def _answer(self, asked: _Asked) -> None:
        request = asked.read()
        refused = request.sentence if isinstance(request, Malformed) else self._judge(request, asked.sender)
        if not refused and isinstance(request, Request):
            if request.time is not None and request.time > self._acting.time + 0.5 * self.stage.step:
                heapq.heappush(self._later, (request.time, next(self._numbers), asked, request))
                self._reply(asked, request, "", request.time)
                return
            refused = self._do(asked, request)
        else:
            self._log(asked, request, refused)
        self._reply(asked, request, refused, self._acting.time)

    def _judge(self, request: Request, sender: str | None) -> str:
        if sender not in (None, request.sender):
            return f"this connection is '{sender}', not '{request.sender}'; speak in your own name"
        if sender is None and request.sender in self.bridge.connected():
            return f"'{request.sender}' has a connection of its own; ask by it, or under another name"
        if refused := self.bridge.out_of_order(request.sender, request.sequence):
            return refused
        now = self._acting.time
        if request.time is not None and request.time < now - 0.5 * self.stage.step:
            return (
                f"request {request.sequence} of '{request.sender}' is for t = {request.time:.3f} s, and it is {now:.3f} s already: too late"
            )
        if isinstance(request, Take | Release | HandOver) and request.time is not None:
            return f"'{request.kind}' acts at once; leave out its time"
        if isinstance(request, Take):
            return self.bridge.take(request.sender)
        if isinstance(request, Release):
            return self.bridge.release(request.sender)
        if isinstance(request, HandOver):
            return self.bridge.hand_over(request.sender, request.to)
        return self.bridge.not_yours(request.sender)

    def _do(self, asked: _Asked, request: Request) -> str:
        """Do it and log it, before the run that it ends. Returns why not, or nothing."""
        line = [request]

        def log(refused: str = "") -> None:
            if line:
                self._log(asked, line.pop(), refused)

        refused = self._acting.do(request, log)
        log(refused)
        self.news()
        if self.state != "running":
            self.show()
        return refused

    def _reply(self, asked: _Asked, request: Request | Malformed, refused: str, time: float) -> None:
        if asked.answer.set_running_or_notify_cancel():  # who asked may be gone
            asked.answer.set_result(Answer(sequence=request.sequence, accepted=not refused, time=time, sentence=refused))
        if refused:
            self.news()

    def _log(self, asked: _Asked, request: Request | Malformed, refused: str) -> None:
        if refused:
            self._refusals_logged += 1
            if self._refusals_logged > MOST_REFUSALS_LOGGED:
                return
        self._acting.log(asked.received, request, refused, asked.text)

    def _go_on(self) -> None:
        """A stretch of simulation: as far as the pace allows, the next request that waits for its time, or the end of what was asked."""
        now = self._acting.time
        while self._later and self._later[0][0] <= now + 0.5 * self.stage.step:
            _, _, asked, request = heapq.heappop(self._later)
            refused = self.bridge.not_yours(request.sender)
            if refused:
                self._log(asked, request, refused)
            else:
                refused = self._do(asked, request)
            if refused:
                self.tell("request_refused", request.sender, refused)
        if self.state != "running":
            return
        if lapsed := self._acting.lapsed():
            self._acting.halt()
            self.tell("steering_lapsed", lapsed, f"'{lapsed}' steered and then said nothing more; the rover was told to stand")
            self.news()
        due = self._acting.steps_due(self._anchor, self.speed, LONGEST_CHUNK)
        if self._later:
            due = min(due, max(1, round((self._later[0][0] - now) / self.stage.step)))
        if self._steps_left is not None:
            due = min(due, self._steps_left)
        taken = self._acting.advance(due, self.hooks)
        if self._steps_left is not None:
            self._steps_left -= taken
            if self._steps_left <= 0:
                self.hold()
        self._acting.show_in_time(FRAME)

    # ------------------------------------------------------------------ for what acts

    def run_on(self, steps: int | None = None) -> None:
        """Time passes from now on; steps: for so many."""
        self.state, self._steps_left = "running", steps
        self._anchor = (clock.perf_counter(), self._acting.time)

    def anchor(self) -> None:
        """What was not kept up with is not caught up."""
        self._anchor = (clock.perf_counter(), self._acting.time)

    def hold(self) -> None:
        """Time stands."""
        self.state, self._steps_left = "paused", None
        self.news()
        self.show()

    def forget_later(self) -> None:
        """Requests for a later time are of a run that ends."""
        for _, _, asked, request in sorted(self._later):
            refused = f"the run ended before t = {request.time:.3f} s"
            self._log(asked, request, refused)
            self.tell("request_refused", request.sender, refused)
        self._later.clear()

    def news(self) -> None:
        """Tell how the session stands."""
        self._acting.note()
        self.listeners.status(self.status())

    def tell(self, kind: str, subject: str, message: str) -> None:
        """Tell of something that happened."""
        self.listeners.event(self._acting.time, kind, subject, message)

    def show(self) -> None:
        """Hand out a frame."""
        if not self._acting.is_open:
            return
        self.listeners.frame(self._acting.time, self._acting.picture())


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")
