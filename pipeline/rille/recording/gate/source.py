"""Where the gate takes its samples from: recordings in memory, or read piece by piece."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, Recording

Array = NDArray[np.float64]
Span = tuple[float, float]
Load = Callable[[str, str, Span | None], Channel]


class Source:
    """Channels of recordings. ``load(recording, channel, span)`` reads one that is not in memory; span None: all of it."""

    def __init__(self, recordings: Sequence[Recording], load: Load | None = None) -> None:
        self.recordings = tuple(recordings)
        self._load = load

    def channel(self, k: int, name: str, span: Span | None = None) -> Channel:
        """A channel of recording k with its samples, of all times or those within ``span`` [s]."""
        recording = self.recordings[k]
        channel = recording.channel(name)
        if not len(channel.time) and self._load is not None:
            return self._load(recording.name, name, span)
        return channel

    def samples(self, k: int, name: str, span: Span | None = None) -> tuple[Array, Array]:
        """(n,) times [s] and values of a channel within a span."""
        channel = self.channel(k, name, span)
        if span is None or not len(channel.time):
            return channel.time, channel.value
        time = channel.time
        if time[-1] - time[0] > 0 and len(time) > 64 and bool(np.all(time[1:] >= time[:-1])):
            first, last = np.searchsorted(time, span[0]), np.searchsorted(time, span[1], side="right")
            return time[first:last], channel.value[first:last]
        chosen = (time >= span[0]) & (time <= span[1])
        return time[chosen], channel.value[chosen]
