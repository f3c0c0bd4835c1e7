"""The run so far for whoever comes late: frames, fewer to the second the longer it lasts, in bounded memory."""

import struct

MAGIC = 0x52494C4C  # "RILL"
MOST_FRAMES, MOST_BYTES = 2000, 8_000_000
SPACING = 0.05  # [s] of simulated time between frames that are kept, at first


def packed(time: float, numbers: bytes, number: int = 0) -> bytes:
    """A frame as it is sent: magic word, its number, time [s], float32 numbers; little-endian."""
    return struct.pack("<IId", MAGIC, number & 0xFFFFFFFF, time) + numbers


class History:
    """Written by the session's thread, read by any: a frame is added or forgotten in one step."""

    def __init__(self) -> None:
        self._frames: list[tuple[float, bytes]] = []
        self._spacing = SPACING
        self._run: int | None = None

    def belongs_to(self, run: int | None) -> None:
        """What comes now is of this run; what was of another is forgotten."""
        if run != self._run:
            self._run, self._frames, self._spacing = run, [], SPACING

    def add(self, time: float, numbers: bytes) -> None:
        """A frame at ``time`` [s]. Where time goes back, what came after is forgotten."""
        frames = self._frames
        if frames and time <= frames[-1][0]:
            frames = self._frames = [frame for frame in frames if frame[0] < time]
        if frames and time - frames[-1][0] < 0.999 * self._spacing:  # steps add up to a little less
            return
        frames.append((time, packed(time, numbers)))
        if len(frames) > min(MOST_FRAMES, MOST_BYTES // len(frames[0][1])):
            self._frames = frames[::2]
            self._spacing *= 2

    def frames(self) -> bytes:
        """All that are kept, one after the other in the order of time."""
        return b"".join(frame for _, frame in list(self._frames))
