"""Frames and news from the session's thread to all who watch. Whoever is slow misses frames; nobody waits for them."""

import asyncio
import contextlib
import itertools
import json
from collections import deque
from dataclasses import asdict, dataclass, field
from typing import Any

from rille.live.history import History, packed
from rille.live.session import Session, Status

MOST_NEWS = 256  # texts that wait for one viewer; older ones are dropped


@dataclass(slots=True, eq=False)
class Viewer:
    """One connection. sender : its name. texts wait in order, of frames only the newest."""

    sender: str
    woken: asyncio.Event = field(default_factory=asyncio.Event)
    texts: deque[str] = field(default_factory=lambda: deque(maxlen=MOST_NEWS))
    seen: int = 0  # number of the last frame that was sent


class Hub:
    """Made in the event loop of the server; the session's listeners lead here."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.viewers: set[Viewer] = set()
        self.frame, self.number, self.history = b"", 0, History()
        self.history.belongs_to(session.status().run_id)
        self._loop = asyncio.get_running_loop()
        self._numbers = itertools.count(1)
        self._waking = False
        session.bridge.connected = lambda: {viewer.sender for viewer in list(self.viewers)}
        session.listeners.frame = self._on_frame
        session.listeners.status = self._on_news
        session.listeners.event = lambda time, kind, subject, message: self._later(self._on_event, time, kind, subject, message)

    def join(self, sender: str) -> Viewer:
        """A new viewer, who is told at once how things stand."""
        viewer = Viewer(sender)
        self.viewers.add(viewer)
        self.tell_status()
        viewer.woken.set()
        return viewer

    def leave(self, viewer: Viewer) -> None:
        """The viewer is gone; if the commander has no other connection, the command is free."""
        self.viewers.discard(viewer)
        if not any(other.sender == viewer.sender for other in self.viewers):
            self.session.commander_left(viewer.sender)
        self.tell_status()

    def tell_status(self) -> None:
        """To all."""
        self._on_status(self.session.status())

    def status(self, status: Status) -> dict[str, Any]:
        """A status as the API tells it."""
        return {"kind": "status", **asdict(status), "viewers": len(self.viewers)}

    # from the session's thread

    def _on_frame(self, time: float, numbers: bytes) -> None:
        number = next(self._numbers)
        self.history.add(time, numbers)
        self.frame = packed(time, numbers, number)  # one assignment: readers see the old or the new one
        self.number = number
        if not self._waking:
            self._waking = True
            self._later(self._wake)

    def _on_news(self, status: Status) -> None:
        self.history.belongs_to(status.run_id)
        self._later(self._on_status, status)

    def _later(self, function: Any, *arguments: Any) -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed: the server has ended
            self._loop.call_soon_threadsafe(function, *arguments)

    # in the loop

    def _wake(self) -> None:
        self._waking = False
        for viewer in self.viewers:
            viewer.woken.set()

    def _on_status(self, status: Status) -> None:
        self._say(self.status(status))

    def _on_event(self, time: float, kind: str, subject: str, message: str) -> None:
        self._say({"kind": "event", "time": time, "event": kind, "subject": subject, "message": message})

    def _say(self, what: dict[str, Any]) -> None:
        text = json.dumps(what)
        for viewer in self.viewers:
            viewer.texts.append(text)
            viewer.woken.set()
