"""Messages of topics -> pieces: what MCAP files and ROS bags have in common."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rille.model.errors import InputRefused, nearest_names
from rille.recording.reading.address import Address, getter, number_fields, parse_address
from rille.recording.reading.piece import Piece, Wanted

BATCH = 4096  # messages of a topic in a piece
LATEST = 2**63 - 1  # [ns] that a stamp may show: the year 2262
UNREADABLE = (AttributeError, KeyError, TypeError, ValueError, OverflowError)  # what a field that is no number may raise


@dataclass(slots=True)
class _Batch:
    """Messages of one topic that wait."""

    getters: tuple[Callable[[Any], float], ...]
    row: int = 0
    stamps: list[int] = field(default_factory=list)
    rows: list[tuple[float, ...]] = field(default_factory=list)


class MessageSource:
    """A file of messages. ``topics`` : name -> type of its messages."""

    table = False
    path: Path
    topics: dict[str, str]

    def messages(self, topics: Sequence[str]) -> Iterator[tuple[str, int, Any, float]]:
        """Messages of some topics in the order of the log: topic, stamp of the log [ns], message, part of the file that was read."""
        raise NotImplementedError

    def example(self, topic: str) -> Any:
        """The first message of a topic; None if there is none."""
        for _, _, message, _ in self.messages([topic]):
            return message
        return None

    def check(self, columns: Sequence[str]) -> None:
        """Refuse topics and fields that are not there."""
        examples: dict[str, Any] = {}
        for column in columns:
            address = parse_address(column, self.topics, str(self.path))
            if address.topic not in examples:
                examples[address.topic] = self.example(address.topic)
            message = examples[address.topic]
            if message is None:
                raise InputRefused(f"'{self.path}' has no message on the topic '{address.topic}'")
            try:
                getter(address)(message)
            except UNREADABLE:
                known = [name for name, _ in number_fields(message)]
                raise InputRefused(
                    f"messages on '{address.topic}' have no number '{address.field}'; {nearest_names(address.field, known)}"
                ) from None

    def topic(self, column: str) -> str:
        """The topic of a column."""
        return parse_address(column, self.topics, str(self.path)).topic

    def pieces(self, wanted: Wanted) -> Iterator[Piece]:
        """All samples; the stamps are int64 [ns]."""
        addresses = {topic: [parse_address(c, self.topics, str(self.path)) for c in columns] for topic, columns in wanted.clocks.items()}
        batches = {topic: _Batch(getters=tuple(getter(a) for a in some)) for topic, some in addresses.items()}
        begin = None
        done = 0.0
        for topic, stamp, message, done in self.messages(list(batches)):
            batch = batches[topic]
            if wanted.header:
                stamp = header_stamp(message, topic)
            if abs(stamp) > LATEST:
                where = f"message {batch.row + len(batch.rows) + 1} on '{topic}' of '{self.path}'"
                raise InputRefused(f"{where} is stamped {stamp:.4g} ns, later than any clock shows ({LATEST:.4g} ns); the file is damaged")
            begin = stamp if begin is None else begin
            try:
                batch.rows.append(tuple(read(message) for read in batch.getters))
            except UNREADABLE as error:
                bad = _unreadable(addresses[topic], message)
                raise InputRefused(
                    f"message {batch.row + len(batch.rows) + 1} on '{topic}' of '{self.path}' has no number '{bad}' ({error})"
                ) from None
            batch.stamps.append(stamp)
            if len(batch.rows) >= BATCH:
                yield _piece(topic, wanted.clocks[topic], batch, begin, done)
        for topic, batch in batches.items():
            if batch.rows:
                yield _piece(topic, wanted.clocks[topic], batch, begin, 1.0)


def _unreadable(addresses: Sequence[Address], message: Any) -> str:
    for address in addresses:
        try:
            getter(address)(message)
        except UNREADABLE:
            return address.field
    return addresses[0].field


def _piece(topic: str, columns: Sequence[str], batch: _Batch, begin: int | None, done: float) -> Piece:
    table = np.array(batch.rows, dtype=np.float64)
    values = {column: np.ascontiguousarray(table[:, k]) for k, column in enumerate(columns)}
    piece = Piece(clock=topic, row=batch.row, time=np.array(batch.stamps, dtype=np.int64), values=values, tick=1e-9, begin=begin, done=done)
    batch.row += len(batch.rows)
    batch.rows, batch.stamps = [], []
    return piece


def header_stamp(message: Any, topic: str) -> int:
    """Stamp of a message's header [ns], in the words of ROS 1 or ROS 2.

    Raises
    ------
    InputRefused : if the message has no header.
    """
    header = message.get("header") if isinstance(message, dict) else getattr(message, "header", None)
    stamp = header.get("stamp") if isinstance(header, dict) else getattr(header, "stamp", None)
    for seconds, parts in (("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec")):
        with suppress(*UNREADABLE):
            if isinstance(stamp, dict):
                return int(stamp[seconds]) * 10**9 + int(stamp[parts])
            return int(getattr(stamp, seconds)) * 10**9 + int(getattr(stamp, parts))
    raise InputRefused(f"messages on '{topic}' have no header with a stamp; say source = \"log\" in [time]")
