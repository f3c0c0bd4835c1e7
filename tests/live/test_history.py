"""The run so far, in bounded memory: whole, in order, and of one run."""

import struct
from itertools import pairwise

from rille.live.history import MOST_FRAMES, SPACING, History

NUMBERS = struct.pack("<3f", 1.0, 2.0, 3.0)
LENGTH = 16 + len(NUMBERS)


def times(history):
    said = history.frames()
    return [struct.unpack_from("<IId", said, at)[2] for at in range(0, len(said), LENGTH)]


def test_a_long_run_is_kept_whole_in_bounded_memory():
    """A day at 60 frames a second: from its begin to its end, spaced evenly up to a factor of two (three where halves meet)."""
    history, step = History(), 1 / 60
    for k in range(0, 24 * 3600 * 60, 7):
        history.add(k * step, NUMBERS)
        assert k % 100_000 or len(times(history)) <= MOST_FRAMES
    found = times(history)
    assert MOST_FRAMES / 3 < len(found) <= MOST_FRAMES
    assert found[0] == 0.0
    gaps = [b - a for a, b in pairwise(found)]
    assert max(gaps) < 3 * min(gaps)
    assert 24 * 3600 - found[-1] < 2 * max(gaps)


def test_where_time_goes_back_what_came_after_is_forgotten():
    history = History()
    for k in range(100):
        history.add(k * SPACING, NUMBERS)
    history.add(50 * SPACING, NUMBERS)
    assert times(history)[-1] == 50 * SPACING
    assert len(times(history)) == 51


def test_another_run_begins_anew():
    history = History()
    history.belongs_to(1)
    for k in range(100):
        history.add(k * SPACING, NUMBERS)
    history.belongs_to(1)
    assert len(times(history)) == 100
    history.belongs_to(2)
    assert times(history) == []
    history.add(7.0, NUMBERS)  # of a loaded state
    assert times(history) == [7.0]
