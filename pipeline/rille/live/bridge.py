"""Who commands, and which of their requests are in order: one commander at a time, no request twice, none too late."""

import math
from collections import OrderedDict
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from time import monotonic

MOST_SENDERS = 1000  # whose last sequence numbers are remembered; the longest silent are forgotten first
ABSENT = 10.0  # [s] of real time: who has no connection and has asked nothing for so long is not here


@dataclass(slots=True)
class Bridge:
    """commander : who commands, or nobody. asked_by : who asked for the command last. connected : senders that have a connection. heard :
    real time [s] of each sender's last request.
    """

    commander: str | None = None
    asked_by: str | None = None
    connected: Callable[[], Collection[str]] = tuple
    last: OrderedDict[str, int] = field(default_factory=OrderedDict)
    heard: dict[str, float] = field(default_factory=dict)

    def is_here(self, sender: str) -> bool:
        """Whether somebody is there to command."""
        return sender in self.connected() or monotonic() - self.heard.get(sender, -math.inf) < ABSENT

    def out_of_order(self, sender: str, sequence: int) -> str:
        """Why this number is out of order, or nothing; then it is the sender's last."""
        last = self.last.get(sender)
        if last is not None and sequence == last:
            return f"request {sequence} of '{sender}' came before; give every request a number of its own"
        if last is not None and sequence < last:
            return f"request {sequence} of '{sender}' is late: number {last} was given already; numbers must rise"
        self.last[sender], self.heard[sender] = sequence, monotonic()
        self.last.move_to_end(sender)
        while len(self.last) > MOST_SENDERS:
            forgotten, _ = self.last.popitem(last=False)
            del self.heard[forgotten]
        return ""

    def take(self, sender: str) -> str:
        """Why the command cannot be taken, or nothing. A commander that is not here any more does not hold it."""
        if self.commander in (None, sender) or not self.is_here(self.commander):
            self.commander, self.asked_by = sender, None
            return ""
        self.asked_by = sender
        return f"'{self.commander}' commands; it was told that you asked, and can hand over or release"

    def release(self, sender: str) -> str:
        """Why the command cannot be given up, or nothing."""
        if refused := self.not_yours(sender):
            return refused
        self.commander = None
        return ""

    def hand_over(self, sender: str, to: str) -> str:
        """Why the command cannot be handed over, or nothing."""
        if refused := self.not_yours(sender):
            return refused
        if not self.is_here(to):
            return (
                f"'{to}' is not here; hand over to one of {', '.join(sorted({*self.connected()} - {sender})) or 'nobody yet'}, or release"
            )
        self.commander, self.asked_by = to, None
        return ""

    def not_yours(self, sender: str) -> str:
        """Why a sender may not command, or nothing."""
        if self.commander == sender:
            return ""
        if self.commander is None:
            return f"nobody commands; '{sender}' must take the command first"
        return f"'{self.commander}' commands, not '{sender}'; ask for the command with take"
