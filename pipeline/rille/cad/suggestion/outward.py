"""Unsure joints of one body in an order in which they can be used one after the other: from what carries the body outwards."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass

from rille.cad.suggestion.joint_evidence import Candidate


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Link:
    """An unsure joint between two pieces of a body. up : the piece that carries, as far as the links before it separate pieces. down : the
    piece that it moves. below : that one, and all that hang on it."""

    candidate: Candidate
    up: int
    down: int
    below: frozenset[int]


def outward(
    root: int, pieces: Collection[int], joints: Sequence[tuple[Candidate, int, int]], volume: Callable[[int], float]
) -> tuple[list[Link], list[tuple[Candidate, int, int]]]:
    """Joints of a spanning tree of the pieces, each after the one that carries it and surer ones first (Prim 1957), and those left over.

    Parameters
    ----------
    root : the piece that stays. pieces : all; one that no joint reaches moves with the root. joints : with their two pieces, surest
    first. volume : of a piece; of what is not reached, the largest stands for the others.
    """
    stands_for = {root: root}
    above: dict[int, int] = {}
    steps: list[tuple[Candidate, int, int]] = []
    while True:
        step = next((j for j in joints if (j[1] in stands_for) != (j[2] in stands_for)), None)
        if step is None:
            loose = [piece for piece in pieces if piece not in stands_for]
            if not loose:
                break
            stands_for[max(loose, key=lambda piece: (volume(piece), -piece))] = root
            continue
        candidate, a, b = step
        up, down = (a, b) if a in stands_for else (b, a)
        stands_for[down] = down
        above[down] = stands_for[up]
        steps.append((candidate, stands_for[up], down))
    used = {candidate for candidate, _, _ in steps}
    links = [Link(candidate=c, up=up, down=down, below=_below(down, above)) for c, up, down in steps]
    return links, [(c, stands_for[a], stands_for[b]) for c, a, b in joints if c not in used]


def _below(piece: int, above: dict[int, int]) -> frozenset[int]:
    """A piece, and what hangs on it."""

    def carriers(at: int) -> Iterable[int]:
        while True:
            yield at
            if at not in above:
                return
            at = above[at]

    return frozenset(other for other in above if piece in carriers(other))
