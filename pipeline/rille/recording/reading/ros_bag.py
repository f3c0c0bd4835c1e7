"""ROS 1 bags (files) and ROS 2 bags (folders)."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from rille.model.errors import InputRefused
from rille.recording.reading.messages import MessageSource


class RosBagSource(MessageSource):
    """A bag of ROS 1 or ROS 2."""

    def __init__(self, path: Path) -> None:
        """Read the index.

        Raises
        ------
        InputRefused : if the bag is damaged or has no messages.
        """
        if path.suffix == ".db3":
            raise InputRefused(f"'{path}' is part of a ROS 2 bag; name its folder, '{path.parent}', which holds metadata.yaml")
        self.path = path
        try:
            with self._reader() as reader:
                self.topics = {connection.topic: connection.msgtype for connection in reader.connections}
                self._count = reader.message_count
        except Exception as error:  # the library lets errors of its parsers through
            raise InputRefused(self._damaged(error)) from None
        if not self._count:
            raise InputRefused(f"'{path}' has no messages")

    def messages(self, topics: Sequence[str]) -> Iterator[tuple[str, int, Any, float]]:
        """Messages in the order of the log."""
        count = 0
        try:
            with self._reader() as reader:
                chosen = [connection for connection in reader.connections if connection.topic in topics]
                for connection, stamp, raw in reader.messages(connections=chosen) if chosen else ():
                    count += 1
                    yield connection.topic, stamp, reader.deserialize(raw, connection.msgtype), count / self._count
        except InputRefused:
            raise
        except Exception as error:  # a damaged chunk shows in the decompressor, the parser or the decoder
            raise InputRefused(self._damaged(error)) from None

    def _reader(self) -> Any:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        store = get_typestore(Stores.ROS2_HUMBLE) if self.path.is_dir() else None
        return AnyReader([self.path], default_typestore=store)

    def _damaged(self, error: Exception) -> str:
        reason = " ".join((str(error) or type(error).__name__).split())
        return f"the bag '{self.path}' cannot be read ({reason}); index or reindex it, or copy it again"
