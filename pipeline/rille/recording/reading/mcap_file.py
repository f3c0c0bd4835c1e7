"""MCAP files with messages of ROS 1, ROS 2 or JSON."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from mcap.decoder import DecoderFactory

from rille.model.errors import InputRefused
from rille.recording.reading.messages import MessageSource


class _JsonDecoder(DecoderFactory):
    """Messages in JSON are dictionaries."""

    def decoder_for(self, message_encoding: str, schema: Any) -> Any:
        """Decoder of one encoding, None if it is another."""
        return json.loads if message_encoding == "json" else None


class McapSource(MessageSource):
    """An MCAP file."""

    def __init__(self, path: Path) -> None:
        """Read the summary.

        Raises
        ------
        InputRefused : if the file is damaged or was not closed, or has no messages.
        """
        self.path = path
        with path.open("rb") as file:
            try:
                summary = self._reader(file).get_summary()
            except Exception as error:  # the library lets struct errors and others through
                raise InputRefused(self._damaged(error)) from None
        if summary is None or summary.statistics is None:
            raise InputRefused(f"'{path}' has no summary: it was not closed; repair it with `mcap recover`")
        self._count = max(1, summary.statistics.message_count)
        self.topics = {}
        for channel in summary.channels.values():
            schema = summary.schemas.get(channel.schema_id)
            self.topics[channel.topic] = schema.name if schema is not None else channel.message_encoding
        self._encodings = {channel.topic: channel.message_encoding for channel in summary.channels.values()}
        if not summary.statistics.message_count:
            raise InputRefused(f"'{path}' has no messages")

    def messages(self, topics: Sequence[str]) -> Iterator[tuple[str, int, Any, float]]:
        """Messages in the order of the log."""
        from mcap.exceptions import DecoderNotFoundError

        with self.path.open("rb") as file:
            stream = self._reader(file).iter_decoded_messages(topics=list(topics))
            count = 0
            while True:
                try:
                    entry = next(stream, None)
                except DecoderNotFoundError:
                    encodings = ", ".join(sorted({self._encodings[topic] for topic in topics}))
                    raise InputRefused(
                        f"'{self.path}' holds messages encoded as {encodings}; rille reads ros1, cdr (ROS 2) and json"
                    ) from None
                except Exception as error:  # a damaged chunk shows in the decompressor, the parser or the decoder
                    raise InputRefused(self._damaged(error)) from None
                if entry is None:
                    return
                count += 1
                yield entry.channel.topic, entry.message.log_time, entry.decoded_message, count / self._count

    def _reader(self, file: Any) -> Any:
        from mcap.reader import make_reader
        from mcap_ros1.decoder import DecoderFactory as Ros1
        from mcap_ros2.decoder import DecoderFactory as Ros2

        return make_reader(file, decoder_factories=[Ros1(), Ros2(), _JsonDecoder()])

    def _damaged(self, error: Exception) -> str:
        reason = str(error) or type(error).__name__
        return f"'{self.path}' is damaged or was not closed ({reason}); repair it with `mcap recover` or copy it again"
