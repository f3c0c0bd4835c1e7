"""Broken files by the thousand: a good file, mutations, and what the reader makes of each: a value, a sentence, or a fault of ours.

The form is that of ``cad/fuzz_step.py``. Readers run in this process, each file under limits of time and of memory.
"""

import os
import re
import resource
import signal
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rille.model import InputRefused

LONG = os.environ.get("RILLE_DRILLS") == "long"
COUNT = int(os.environ.get("RILLE_DRILLS_COUNT", "10000" if LONG else "300"))
BUDGET = float("inf") if LONG else 8.0  # [s] for a reader
SLOWEST = 5.0  # [s] of processor time that one file may take
PATIENCE = 60.0  # [s] of real time: nothing waits for ever, and the machine may be busy
ROOM = 1_500_000_000  # bytes of addresses that a reader may ask for beyond what the process has

Random = np.random.Generator
Read = Callable[[Path], object]

NUMBERS = (b"nan", b"inf", b"-inf", b"1e999", b"-1", b"0", b"-0.0", b"1e308", b"-1e308", b"1e-308", b"1e30", b"1e9", b"1000000", b"0.5", b"7")
NUMBERS += (b"2147483648", b"9223372036854775808", b"99999999999999999999", b"0x10", b"1_000", b"1,5", b"", b"9" * 5000)
WORDS = (b"", b"\x00", b"\xff\xfe", b'"', b"'", b"[", b"]]", b"{", b"}", b"=", b"\n", b"\r", b",", b";", b"true", b"x", b"[" * 3000, b"../..")
WORDS += (b"/", b"*", b"<a>", b"&x;", b"\xed\xa0\x80", "é°Ω".encode(), b"x" * 5000, b"#", b".")
ENDS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 2**62, 2**63 - 1, 2**63, 2**64 - 1, 10**6, 37)


def _flip(data: bytes, chance: Random) -> bytes:
    changed = bytearray(data)
    for place in chance.integers(len(changed), size=int(chance.integers(1, 10))):
        changed[place] ^= 1 << int(chance.integers(8))
    return bytes(changed)


def _overwrite(data: bytes, chance: Random) -> bytes:
    changed = bytearray(data)
    for place in chance.integers(len(changed), size=int(chance.integers(1, 30))):
        changed[place] = int(chance.integers(256))
    return bytes(changed)


def _truncate(data: bytes, chance: Random) -> bytes:
    return data[: int(chance.integers(len(data)))]


def _span(data: bytes, chance: Random, most: int = 200) -> tuple[int, int]:
    start = int(chance.integers(len(data)))
    return start, min(len(data), start + int(chance.integers(1, most)))


def _cut_out(data: bytes, chance: Random) -> bytes:
    start, stop = _span(data, chance)
    return data[:start] + data[stop:]


def _double(data: bytes, chance: Random) -> bytes:
    start, stop = _span(data, chance)
    return data[:stop] + data[start:stop] * int(chance.integers(1, 4)) + data[stop:]


def _splice(data: bytes, chance: Random) -> bytes:
    start, stop = _span(data, chance)
    other = int(chance.integers(len(data)))
    return data[:start] + data[other : other + stop - start] + data[stop:]


def _integer(data: bytes, chance: Random) -> bytes:
    """A length, a count or an offset of a binary file becomes an extreme one."""
    size = (1, 2, 4, 8)[int(chance.integers(4))]
    place = int(chance.integers(len(data)))
    number = ENDS[int(chance.integers(len(ENDS)))] % 2 ** (8 * size)
    return data[:place] + number.to_bytes(size, "little" if chance.random() < 0.8 else "big") + data[place + size :]


def _real(data: bytes, chance: Random) -> bytes:
    place = int(chance.integers(len(data)))
    number = (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-308, -1.0, 0.0)[int(chance.integers(8))]
    kind = "<f8" if chance.random() < 0.5 else "<f4"
    with np.errstate(over="ignore"):
        written = np.array(number).astype(kind).tobytes()
    return data[:place] + written + data[place + len(written) :]


def _word(data: bytes, chance: Random) -> bytes:
    start, stop = _span(data, chance, 30)
    return data[:start] + WORDS[int(chance.integers(len(WORDS)))] + data[stop:]


def _matches(pattern: bytes, make: Callable[[bytes, list[bytes], Random], bytes]) -> Callable[[bytes, Random], bytes]:
    expression = re.compile(pattern)

    def mutate(data: bytes, chance: Random) -> bytes:
        found = list(expression.finditer(data))
        if not found:
            return data
        every = [match.group(0) for match in found]
        chosen = chance.choice(len(found), size=min(int(chance.integers(1, 4)), len(found)), replace=False)
        for k in sorted(chosen.tolist(), reverse=True):
            data = data[: found[k].start()] + make(every[k], every, chance) + data[found[k].end() :]
        return data

    return mutate


def _lines(change: Callable[[list[bytes], int, int], object]) -> Callable[[bytes, Random], bytes]:
    def mutate(data: bytes, chance: Random) -> bytes:
        lines = data.split(b"\n")
        for _ in range(int(chance.integers(1, 4))):
            if len(lines) > 1:
                change(lines, int(chance.integers(len(lines))), int(chance.integers(len(lines))))
        return b"\n".join(lines)

    return mutate


def _swap(lines: list[bytes], i: int, j: int) -> None:
    lines[i], lines[j] = lines[j], lines[i]


_NUMBER = rb"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?"
_TEXT = rb'"[^"\n]*"'

MUTATIONS: dict[str, Callable[[bytes, Random], bytes]] = {
    "bits": _flip,
    "bytes": _overwrite,
    "truncated": _truncate,
    "cut out": _cut_out,
    "doubled": _double,
    "spliced": _splice,
    "integers": _integer,
    "reals": _real,
    "words": _word,
    "numbers": _matches(_NUMBER, lambda old, every, chance: NUMBERS[int(chance.integers(len(NUMBERS)))]),
    "numbers nudged": _matches(_NUMBER, lambda old, every, chance: b"%.17g" % (float(old) * chance.normal(1, 2))),
    "numbers swapped": _matches(_NUMBER, lambda old, every, chance: every[int(chance.integers(len(every)))]),
    "texts": _matches(_TEXT, lambda old, every, chance: (b'"' + WORDS[int(chance.integers(len(WORDS)))] + b'"', b"7", b"[]", b"{}")[int(chance.integers(4))]),
    "texts swapped": _matches(_TEXT, lambda old, every, chance: every[int(chance.integers(len(every)))]),
    "units": _matches(rb' [a-zA-Z/^0-9]+"', lambda old, every, chance: (every[int(chance.integers(len(every)))], b' furlong"', b'"')[int(chance.integers(3))]),
    "lines deleted": _lines(lambda lines, i, j: lines.pop(i)),
    "lines twice": _lines(lambda lines, i, j: lines.insert(j, lines[i])),
    "lines swapped": _lines(_swap),
}  # fmt: skip


GENTLE = [name for name in MUTATIONS if name.split()[0] in ("numbers", "texts", "units", "lines")]  # what they leave is often well-formed


def mutated(data: bytes, chance: Random) -> tuple[str, bytes]:
    """One to three mutations, one upon the other, and their names; of a text most are such that its grammar survives."""
    among = GENTLE if b"\0" not in data[:1000] and chance.random() < 0.7 else list(MUTATIONS)
    names = chance.choice(among, size=int(chance.integers(1, 4)), replace=False).tolist()
    for name in names:
        data = MUTATIONS[name](data, chance) if len(data) > 1 else data
    return "+".join(names), data


class TooLong(BaseException):
    """A reader that hangs. Not an ``Exception``: no reader may take it for a damaged file."""


@dataclass
class Tally:
    """What became of the files. outcomes : read, refused, bug. bugs : where it happened -> the first of that kind. worst : [s]."""

    outcomes: Counter = field(default_factory=Counter)
    bugs: dict[str, str] = field(default_factory=dict)
    sentences: set[str] = field(default_factory=set)
    worst: float = 0.0


@contextmanager
def limited() -> Iterator[None]:
    """No hang, and no hunger: time and memory of what is inside are bounded."""

    def stop(number: int, frame: object) -> None:
        raise TooLong(f"more than {SLOWEST:g} s of processor time or {PATIENCE:g} s in all")

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE") if Path("/proc/self/statm").exists() else None
    before = {number: signal.signal(number, stop) for number in (signal.SIGPROF, signal.SIGALRM)}
    if used is not None:
        resource.setrlimit(resource.RLIMIT_AS, (used + ROOM, hard))
    signal.setitimer(signal.ITIMER_PROF, SLOWEST)
    signal.setitimer(signal.ITIMER_REAL, PATIENCE)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
        for number, handler in before.items():
            signal.signal(number, handler)


def fuzz(good: Path, read: Read, *, seed: int, count: int = COUNT, budget: float = BUDGET, change: Callable[[bytes, Random], tuple[str, bytes]] = mutated) -> Tally:
    """Mutate the file in its place, read, and count; in the end the good file is there again.

    RILLE_KEEP : a folder in which files stay that were our fault.
    """
    data, tally, end = good.read_bytes(), Tally(), time.monotonic() + budget
    try:
        for number in range(count):
            if time.monotonic() > end:
                break
            names, content = change(data, np.random.default_rng([seed, number]))
            good.write_bytes(content)
            began = time.monotonic()
            outcome, error = _outcome(read, good, tally)
            tally.worst = max(tally.worst, time.monotonic() - began)
            tally.outcomes[outcome] += 1
            if error is not None:
                place = _place(error)
                if place not in tally.bugs:
                    tally.bugs[place] = f"mutation {number} ({names}) of seed {seed}: {place}\n" + "".join(traceback.format_exception(error)[-6:])
                    _keep(good, f"{type(error).__name__}-{number}{good.suffix}")
    finally:
        good.write_bytes(data)
    return tally


def _outcome(read: Read, path: Path, tally: Tally) -> tuple[str, BaseException | None]:
    try:
        with warnings.catch_warnings(), limited():
            warnings.simplefilter("ignore")
            read(path)
        return "read", None
    except InputRefused as refusal:
        sentence = str(refusal)
        tally.sentences.add(sentence)
        return ("refused", None) if sentence.strip() else ("bug", refusal)
    except (Exception, TooLong) as error:
        return "bug", error


def _place(error: BaseException) -> str:
    """Type and place of an error, by which those of one cause are one."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if "/rille/" in f.filename] or frames
    return f"{type(error).__name__} at {Path(ours[-1].filename).name}:{ours[-1].lineno}: {str(error)[:200]!r}" if isinstance(error, InputRefused | TooLong) else f"{type(error).__name__} at {Path(ours[-1].filename).name}:{ours[-1].lineno}"


def _keep(path: Path, name: str) -> None:
    folder = os.environ.get("RILLE_KEEP")
    if folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        (Path(folder) / name).write_bytes(path.read_bytes())
