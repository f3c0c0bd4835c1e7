"""Who commands, and which of their requests are in order: one commander at a time, no request twice, none too late."""

from collections import OrderedDict
from dataclasses import dataclass, field

MOST_SENDERS = 1000  # whose last sequence numbers are remembered; the longest silent are forgotten first


@dataclass(slots=True)
class Bridge:
    """commander : who commands, or nobody. asked_by : who asked for the command last."""

    commander: str | None = None
    asked_by: str | None = None
    last: OrderedDict[str, int] = field(default_factory=OrderedDict)

    def out_of_order(self, sender: str, sequence: int) -> str:
        """Why this number is out of order, or nothing; then it is the sender's last."""
        last = self.last.get(sender)
        if last is not None and sequence == last:
            return f"request {sequence} of '{sender}' came before; give every request a number of its own"
        if last is not None and sequence < last:
            return f"request {sequence} of '{sender}' is late: number {last} was given already; numbers must rise"
        self.last[sender] = sequence
        self.last.move_to_end(sender)
        while len(self.last) > MOST_SENDERS:
            self.last.popitem(last=False)
        return ""

    def take(self, sender: str) -> str:
        """Why the command cannot be taken, or nothing."""
        if self.commander in (None, sender):
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
        self.commander, self.asked_by = to, None
        return ""

    def not_yours(self, sender: str) -> str:
        """Why a sender may not command, or nothing."""
        if self.commander == sender:
            return ""
        if self.commander is None:
            return f"nobody commands; '{sender}' must take the command first"
        return f"'{self.commander}' commands, not '{sender}'; ask for the command with take"
