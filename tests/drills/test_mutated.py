"""Files that went wrong on their way: whatever bytes a reader meets, it gives a value or a refusal in a sentence. Never another
exception, never a hang, in bounded memory.

Some hundred mutations of a good file for every reader, always the same; ``RILLE_DRILLS=long`` makes 10 000 of each
(``RILLE_DRILLS_COUNT`` another number, ``RILLE_KEEP`` a folder in which files stay that were our fault).
"""

import numpy as np
import pytest

from drills import mutating
from drills.readers import READERS, change_of


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    """What readers keep goes nowhere else."""
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache"))


@pytest.mark.parametrize("name", READERS)
def test_every_broken_file_is_read_or_refused(name, tmp_path, capsys):
    """The good file is read, so that the mutations reach all of the reader; some of them must be refused, or they are too tame."""
    good, read = READERS[name](tmp_path)
    read(good)
    tally = mutating.fuzz(good, read, seed=1, change=change_of(name))
    if mutating.LONG:
        with capsys.disabled():
            print(f"\n{name}: {sum(tally.outcomes.values())} files: {dict(tally.outcomes)}, longest {tally.worst:.1f} s")
    assert not tally.bugs, "\n".join([f"{len(tally.bugs)} faults", *tally.bugs.values()])
    assert tally.outcomes["refused"] > 0
    assert tally.outcomes["read"] > 0
    read(good)


@pytest.mark.parametrize("name", mutating.MUTATIONS)
def test_every_mutation_changes_something(name):
    text = b'a = "x y"\nb = 1.5\nc = "2 kg"\nd = "3 s"\n' * 3
    assert any(mutating.MUTATIONS[name](text, np.random.default_rng(k)) != text for k in range(9))


def test_a_reader_that_hangs_or_devours_is_caught(tmp_path, monkeypatch):
    """Controls: the drill sees an endless loop, a hunger for memory, a silent refusal, and an exception of another kind."""
    monkeypatch.setattr(mutating, "SLOWEST", 0.2)
    good = tmp_path / "good"
    good.write_bytes(b"123 456\n" * 9)

    def endless(path):
        while True:
            pass

    def silent(path):
        raise mutating.InputRefused(" ")

    for read, what in (
        (endless, "TooLong"),
        (lambda path: bytearray(10 * mutating.ROOM), "MemoryError"),
        (silent, "InputRefused"),
        (lambda path: {}["x"], "KeyError"),
    ):
        (bug,) = mutating.fuzz(good, read, seed=1, count=2).bugs
        assert what in bug
        assert good.read_bytes() == b"123 456\n" * 9
