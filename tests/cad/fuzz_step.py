"""Broken STEP files by the thousand: seeds of our own, mutations, and one forked child per file that reads, weighs and tessellates it.

The child runs ``rille.cad.files.read_process.do``, as the tool's child process does, under the same limits; a fork of a process that
has imported OCCT costs milliseconds where the tool's own child costs a second. By hand, for the whole of it:

    RILLE_FUZZ_STEP=10000 pytest tests/cad/test_fuzz_step.py -s
"""

import faulthandler
import os
import re
import select
import signal
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

LIMIT = 10.0  # [s] of the issue

Random = np.random.Generator


def seeds(folder: Path) -> list[bytes]:
    """Small files that between them hold most of what STEP has: quadrics, splines, voids, nested assemblies, colours, names."""
    import cadquery as cq

    bracket = cq.Workplane().box(40, 30, 10).faces(">Z").workplane().cskHole(6, 10, 82).edges("|Z").fillet(4)
    knob = cq.Workplane("XZ").moveTo(0, 0).lineTo(10, 0).spline([(14, 8), (9, 16), (12, 25)], includeCurrent=True).lineTo(0, 25).close()
    knob = knob.revolve(360, (0, 0, 0), (0, 1, 0))
    loft = cq.Workplane().circle(10).workplane(offset=20).rect(15, 8).loft()
    hollow = cq.Workplane().box(20, 20, 20).cut(cq.Workplane().sphere(6))
    ring = cq.Workplane(cq.Solid.makeTorus(20, 5))
    twist = cq.Workplane().rect(6, 4).twistExtrude(15, 60)
    sheet = cq.Workplane(cq.Face.makePlane(10, 10))
    arm = cq.Assembly(name="arm").add(bracket, name="bracket", color=cq.Color("red")).add(knob, name="knob", loc=cq.Location((0, 0, 30)))
    rig = cq.Assembly(name="rig").add(arm, name="left").add(arm, name="right", loc=cq.Location((0, 99, 0), (0, 0, 1), 90))
    assemblies = [
        rig,
        cq.Assembly(loft, name="loft"),
        cq.Assembly(hollow, name="hollow").add(ring, name="ring").add(sheet, name="sheet"),
        cq.Assembly(twist, name="twist").add(cq.Workplane().box(1, 2, 3), name="box", loc=cq.Location((9, 9, 9))),
    ]
    found = []
    for index, assembly in enumerate(assemblies):
        file = folder / f"seed{index}.step"
        assembly.export(str(file))
        found.append(file.read_bytes())
    return found


def _lines(text: bytes) -> list[bytes]:
    return text.split(b";\n")


def _flip_bytes(text: bytes, rng: Random) -> bytes:
    data = bytearray(text)
    for _ in range(int(rng.integers(1, 30))):
        data[int(rng.integers(len(data)))] = int(rng.integers(256))
    return bytes(data)


def _truncate(text: bytes, rng: Random) -> bytes:
    return text[: int(rng.integers(100, len(text)))]


def _cut_out(text: bytes, rng: Random) -> bytes:
    start = int(rng.integers(len(text)))
    return text[:start] + text[start + int(rng.integers(1, 2000)) :]


def _delete_entities(text: bytes, rng: Random) -> bytes:
    lines = _lines(text)
    for _ in range(int(rng.integers(1, 6))):
        del lines[int(rng.integers(len(lines)))]
    return b";\n".join(lines)


def _duplicate_entities(text: bytes, rng: Random) -> bytes:
    lines = _lines(text)
    for _ in range(int(rng.integers(1, 6))):
        lines.insert(int(rng.integers(len(lines))), lines[int(rng.integers(len(lines)))])
    return b";\n".join(lines)


def _swap_entities(text: bytes, rng: Random) -> bytes:
    """Bodies of entities change places: right syntax, wrong types."""
    lines = _lines(text)
    for _ in range(int(rng.integers(1, 6))):
        i, j = (int(k) for k in rng.integers(len(lines), size=2))
        a, b = lines[i].partition(b"="), lines[j].partition(b"=")
        lines[i], lines[j] = a[0] + a[1] + b[2], b[0] + b[1] + a[2]
    return b";\n".join(lines)


def _replace_matches(pattern: bytes, make: Callable[[bytes, list[bytes], Random], bytes]) -> Callable[[bytes, Random], bytes]:
    expression = re.compile(pattern)

    def mutate(text: bytes, rng: Random) -> bytes:
        found = list(expression.finditer(text))
        if not found:
            return text
        every = [match.group(0) for match in found]
        chosen = sorted(rng.choice(len(found), size=min(int(rng.integers(1, 8)), len(found)), replace=False), reverse=True)
        for k in chosen:
            match = found[int(k)]
            text = text[: match.start()] + make(match.group(0), every, rng) + text[match.end() :]
        return text

    return mutate


EXTREMES = (
    b"1.E308",
    b"-1.E308",
    b"1.E-308",
    b"0.",
    b"-0.",
    b"NaN",
    b"INF",
    b"1.E999",
    b"1.E30",
    b"1.E15",
    b"-1.",
    b"1.E-20",
    b"$",
    b"*",
    b"''",
)
COUNTS = (b"0", b"-1", b"2147483647", b"-2147483648", b"99999999999999999999", b"100000", b"37")


def _nudged(old: bytes, every: list[bytes], rng: Random) -> bytes:
    return b"%.15E" % (float(old) * rng.normal(1, 0.3) + rng.normal(0, 1))


def _text(old: bytes, every: list[bytes], rng: Random) -> bytes:
    noise = bytes(rng.integers(256, size=9, dtype=np.uint8))
    return (b"'" + noise + b"'", b"'" + b"x" * 5000 + b"'", b"'", b"'\\X2\\D8'")[rng.integers(4)]


MUTATIONS: dict[str, Callable[[bytes, Random], bytes]] = {
    "bytes": _flip_bytes,
    "truncated": _truncate,
    "cut out": _cut_out,
    "entities deleted": _delete_entities,
    "entities twice": _duplicate_entities,
    "entities swapped": _swap_entities,
    "references": _replace_matches(rb"#\d+(?!\d*\s*=)", lambda old, every, rng: every[int(rng.integers(len(every)))]),
    "to itself": _replace_matches(rb"#\d+ = [A-Z_]+\([^;]*#\d+", lambda old, every, rng: re.sub(rb"#\d+$", old.split()[0], old)),
    "dangling": _replace_matches(rb"#\d+(?!\d*\s*=)", lambda old, every, rng: b"#%d" % rng.integers(10**9)),
    "numbers": _replace_matches(rb"-?\d+\.\d*(?:E[-+]?\d+)?", lambda old, every, rng: EXTREMES[int(rng.integers(len(EXTREMES)))]),
    "numbers nudged": _replace_matches(rb"-?\d+\.\d*(?:E[-+]?\d+)?", _nudged),
    "counts": _replace_matches(rb"(?<=[,(])\d+(?=[,)])", lambda old, every, rng: COUNTS[int(rng.integers(len(COUNTS)))]),
    "types": _replace_matches(rb"[A-Z][A-Z_]{3,}(?=\()", lambda old, every, rng: every[int(rng.integers(len(every)))]),
    "flags": _replace_matches(rb"\.[A-Z]+\.", lambda old, every, rng: every[int(rng.integers(len(every)))]),
    "lists": _replace_matches(rb"\([^()]*\)", lambda old, every, rng: (b"()", old + old, old[:-1], b"(" + old + b")")[rng.integers(4)]),
    "texts": _replace_matches(rb"'[^']*'", _text),
}  # fmt: skip


@dataclass
class Tally:
    """What became of the files. outcomes : read, refused, crashed, over time, our bug. worst : longest time [s]."""

    outcomes: Counter = field(default_factory=Counter)
    by_mutation: Counter = field(default_factory=Counter)
    bugs: list[str] = field(default_factory=list)
    worst: float = 0.0


def fuzz(count: int, folder: Path, *, seed: int = 0, budget: float = float("inf"), keep: Path | None = None) -> Tally:
    """Mutate, read, and count; ``keep``: files that crashed or hung the child stay in this folder."""
    import OCP  # noqa: F401  # before the first fork

    import rille.cad.files.read_process
    import rille.cad.files.step_reader  # noqa: F401

    originals, tally, end = seeds(folder), Tally(), time.monotonic() + budget
    for index in range(count):
        if time.monotonic() > end:
            break
        rng = np.random.default_rng([seed, index])
        text = originals[int(rng.integers(len(originals)))]
        names = list(rng.choice(list(MUTATIONS), size=int(rng.integers(1, 3)), replace=False))
        for name in names:
            text = MUTATIONS[name](text, rng)
        path = folder / f"mutated{index}.step"
        path.write_bytes(text)
        start = time.monotonic()
        outcome = read_in_fork(path)
        tally.worst = max(tally.worst, time.monotonic() - start)
        tally.outcomes[outcome] += 1
        tally.by_mutation["+".join(sorted(names)), outcome] += 1
        if outcome == "our bug":
            tally.bugs.append(path.with_suffix(".bug").read_text())
        if keep is not None and outcome in ("crashed", "over time", "our bug"):
            keep.mkdir(exist_ok=True, parents=True)
            (keep / f"{outcome.replace(' ', '_')}_{index}.step").write_bytes(text)
        path.unlink()
    return tally


def read_in_fork(path: Path) -> str:
    """Read, weigh and tessellate a file in a forked child; what became of it."""
    watch, tied = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(watch)
        code = 1
        try:
            code = _child(path)
        except BaseException:  # a child must never come back into the test that forked it
            path.with_suffix(".bug").write_text(traceback.format_exc())
        finally:
            os._exit(code)
    os.close(tied)
    ready, _, _ = select.select([watch], [], [], LIMIT)  # the pipe closes when the child ends
    os.close(watch)
    if not ready:
        os.kill(child, signal.SIGKILL)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if not ready or code == -signal.SIGXCPU:
        return _explained(path, "over time")
    return {0: "read", 3: "refused"}.get(code) or ("our bug" if code == 1 else _explained(path, "crashed"))


def _explained(path: Path, outcome: str) -> str:
    """The tool says what is wrong with the text of such a file; that must not fail, either."""
    from rille.cad.files.step_text import what_is_wrong

    what_is_wrong(path)
    return outcome


def _child(path: Path) -> int:
    """Exit code: 0 read, 3 refused, 1 our bug. Whatever OCCT prints goes nowhere."""
    from rille.cad.files import read_process, saved

    faulthandler.disable()  # pytest's would write a page for every crash
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    read_process.guard()

    def say(**message: object) -> None:
        pass

    answer = read_process.do(
        {"do": "read", "path": str(path), "bytes": path.stat().st_size, "face_names": True, "subject": f"'{path}'"}, say
    )
    if "done" in answer:
        parts = [{"name": p["name"], "digest": p["digest"], "bytes": saved.brep_size(p["digest"])} for p in answer["done"]["prototypes"]]
        answer = read_process.do({"do": "mesh", "parts": parts, "tolerance": 5e-4, "subject": f"'{path}'"}, say)
    if "done" in answer:
        return 0
    if "refused" in answer and answer["refused"].strip() and "\n" not in answer["refused"]:
        return 3
    path.with_suffix(".bug").write_text(str(answer))
    return 1
