"""A small client of ``rille serve``, for control platforms and tests."""

import contextlib
import itertools
import json
import queue
import struct
import threading
import time as clock
import urllib.error
import urllib.parse
import urllib.request
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from rille.live.history import MAGIC
from rille.model import InputRefused

PATIENCE = 10.0  # [s] for an answer


class Client:
    """A connection to a live session::

        with Client("http://127.0.0.1:8765", sender="console") as rover:
            rover.take()
            rover.start()
            rover.steer(0.05)
            print(rover.time, rover.read("part.position", "chassis"))

    Each method that asks for something waits for the answer and raises InputRefused with the server's sentence if it is refused. ``time``
    in any of them: simulated time [s] at which it is to act.
    """

    def __init__(
        self, address: str, sender: str, token: str | None = None, on_event: Callable[[dict[str, Any]], None] | None = None
    ) -> None:
        """Raises InputRefused if nobody answers or the token is wrong."""
        self._address, self._token, self.sender = address.split("#")[0].rstrip("/"), token, sender
        self._numbers = itertools.count(clock.time_ns() // 1_000_000)  # above those of an earlier client of this name
        self._answers: dict[int, dict[str, Any]] = {}
        self._came = threading.Condition()
        self._closed: str | None = None
        self._tells = on_event is not None
        self._happened: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()  # for on_event, which may ask in turn
        self.status: dict[str, Any] = {}
        self.events: deque[dict[str, Any]] = deque(maxlen=1000)
        self.time = 0.0  # [s] of the newest frame
        self.frame: NDArray[np.float32] = np.empty(0, dtype=np.float32)  # in the order of layout()
        self.frames = 0  # that came
        url = "ws" + self._address.removeprefix("http") + "/api/stream"
        self._open = contextlib.ExitStack()
        try:
            self._socket = self._open.enter_context(connect(url, open_timeout=PATIENCE, max_size=None))
        except Exception as error:  # of the network, of TLS, of the handshake: all mean the same here
            raise InputRefused(f"no session answers at '{address}': {error}") from None
        self._socket.send(json.dumps({"kind": "hello", "sender": sender, "token": token}))
        self._listener = threading.Thread(target=self._listen, name="rille-client", daemon=True)
        self._listener.start()
        if on_event is not None:
            threading.Thread(target=self._tell, args=(on_event,), name="rille-client-events", daemon=True).start()
        with self._came:
            self._came.wait_for(lambda: self.status or self._closed is not None, PATIENCE)
        if self._closed is not None or not self.status:
            self.close()
            raise InputRefused(f"'{address}' does not let '{sender}' in: {self._closed or 'no answer'}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave; if this client commanded, the rover is told to stand."""
        with contextlib.suppress(Exception):
            self._open.close()
        self._listener.join(PATIENCE)

    def _listen(self) -> None:
        why = "the connection broke"
        try:
            for message in self._socket:
                self._hear(message)
            why = self._socket.close_reason or "the connection was closed"
        except ConnectionClosed as closed:
            why = closed.rcvd.reason if closed.rcvd is not None else why
        finally:
            with self._came:
                self._closed = why
                self._came.notify_all()
            self._happened.put(None)

    def _tell(self, on_event: Callable[[dict[str, Any]], None]) -> None:
        while (event := self._happened.get()) is not None:
            on_event(event)

    def _hear(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            magic, _, time = struct.unpack_from("<IId", message)
            if magic == MAGIC:
                self.frame, self.time, self.frames = np.frombuffer(message, "<f4", offset=16), time, self.frames + 1
            return
        told = json.loads(message)
        with self._came:
            if told["kind"] == "status":
                self.status = told
            elif told["kind"] == "event":
                self.events.append(told)
            elif told["kind"] == "answer" and told["sequence"] is not None:
                self._answers[told["sequence"]] = told
            self._came.notify_all()
        if told["kind"] == "event" and self._tells:
            self._happened.put(told)

    # ------------------------------------------------------------------ to ask

    def ask(self, kind: str, *, time: float | None = None, **values: Any) -> dict[str, Any]:
        """Ask for something, and return the answer. Raises InputRefused with the sentence of a refusal, or if no answer comes."""
        number = next(self._numbers)
        request = {"kind": kind, "sender": self.sender, "sequence": number, "time": time, **values}
        try:
            self._socket.send(json.dumps(request))
        except ConnectionClosed:
            raise InputRefused(f"the session at '{self._address}' is gone") from None
        with self._came:
            self._came.wait_for(lambda: number in self._answers or self._closed is not None, PATIENCE)
            answer = self._answers.pop(number, None)
        if answer is None:
            raise InputRefused(f"request {number} ('{kind}') got no answer: {self._closed or f'not within {PATIENCE:g} s'}")
        if not answer["accepted"]:
            raise InputRefused(answer["sentence"])
        return answer

    def take(self) -> None:
        """Take the command."""
        self.ask("take")

    def release(self) -> None:
        """Give up the command."""
        self.ask("release")

    def hand_over(self, to: str) -> None:
        """Hand the command over."""
        self.ask("hand_over", to=to)

    def start(self) -> None:
        """Let time pass."""
        self.ask("start")

    def pause(self) -> None:
        """Hold time."""
        self.ask("pause")

    def step(self, count: int = 1) -> None:
        """Take so many steps, and wait until they are taken, or the run has ended. Raises InputRefused if the session goes meanwhile."""
        before = self.ask("step", count=count)["time"]

        def over() -> bool:
            state = self.status["state"]
            return self._closed is not None or state == "ended" or (state != "running" and self.status["time"] > before)

        with self._came:
            self._came.wait_for(over)
        if self._closed is not None:
            raise InputRefused(f"the session at '{self._address}' is gone: {self._closed}")

    def reset(self) -> None:
        """End this run and begin another."""
        self.ask("reset")

    def stop(self) -> None:
        """End this run."""
        self.ask("stop")

    def speed(self, factor: float) -> None:
        """Simulated time per real time."""
        self.ask("speed", factor=factor)

    def place(self, x: float, y: float, heading: float | None = None) -> None:
        """Begin elsewhere [m, rad], before the first step."""
        self.ask("place", x=x, y=y, heading=heading)

    def drive(self, drive: str, value: float, time: float | None = None) -> None:
        """Set value of a drive [rad/s, rad or N m]."""
        self.ask("drive", time=time, drive=drive, value=value)

    def steer(self, forward: float, turn: float = 0.0, time: float | None = None, lasts: float | None = None) -> None:
        """Forward speed [m/s] and turn rate [rad/s, to the left]; the rover stands ``lasts`` [s of real time] later unless it is steered
        again (None: it drives on).
        """
        self.ask("steer", time=time, forward=forward, turn=turn, lasts=lasts)

    def set(self, quantity: str, target: str, values: Sequence[float], time: float | None = None) -> None:
        """Put a joint or the root elsewhere [SI, in W]."""
        self.ask("set", time=time, quantity=quantity, target=target, values=list(values))

    def save(self, name: str) -> None:
        """Keep the present state under a name."""
        self.ask("save", name=name)

    def load(self, name: str) -> None:
        """Go on from a saved state."""
        self.ask("load", name=name)

    # ------------------------------------------------------------------ to read

    def read(self, quantity: str, target: str) -> list[float]:
        """Numbers of a quantity as of now [SI, in W]."""
        return self._get(f"/api/objects/{urllib.parse.quote(quantity, safe='')}/{urllib.parse.quote(target, safe='')}")["values"]

    def objects(self) -> list[dict[str, Any]]:
        """Everything that can be read or set."""
        return self._get("/api/objects")

    def layout(self) -> dict[str, Any]:
        """Names and order of the numbers in a frame."""
        return self._get("/api/layout")

    def _get(self, path: str) -> Any:
        request = urllib.request.Request(self._address + path)
        if self._token is not None:
            request.add_header("Authorization", f"Bearer {self._token}")
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE) as response:
                return json.load(response)
        except urllib.error.HTTPError as error:
            said = error.read()
            try:
                raise InputRefused(json.loads(said)["sentence"]) from None
            except (ValueError, KeyError):
                raise InputRefused(f"'{self._address}{path}' was refused ({error.code})") from None
        except OSError as error:
            raise InputRefused(f"the session at '{self._address}' does not answer: {error}") from None
