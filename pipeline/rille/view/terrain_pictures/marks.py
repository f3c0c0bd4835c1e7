"""What is pointed at in a map: placed landforms with their names, headings and outlines."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.view.terrain_pictures.paper import INK, PAPER, Box, Paper

Array = NDArray[np.float64]

OUTLINE = "#b3261e"
MOST_LABELS = 60
_SIDES = ((1, 0), (-1, 0), (0, -1), (0, 1), (1, -1), (1, 1), (-1, -1), (-1, 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """A placed landform. x, y [m] in W; heading [rad]; outline : corners (n, 2) [m] in W of its footprint, None if unknown."""

    name: str
    x: float
    y: float
    heading: float = 0.0
    outline: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """A name that found a place: box in pixels, and the pixel that it belongs to."""

    text: str
    box: Box
    point: tuple[float, float]
    far: bool


def overlap(a: Box, b: Box) -> bool:
    """True if two boxes have something in common."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def place_labels(
    paper: Paper, points: Sequence[tuple[str, tuple[float, float]]], within: Box, *, size: int = 12
) -> tuple[list[Label], list[str]]:
    """Find a place beside its point for every name, so that names cover neither each other nor the points; the nearest free one is taken.

    Returns
    -------
    The labels, and the names that found no place.
    """
    taken: list[Box] = []
    spots = [(p[0] - 4, p[1] - 4, p[0] + 4, p[1] + 4) for _, p in points]
    placed, lost = [], []
    for text, point in points:
        width, _ = paper.extent(text, size=size)
        half = (width / 2 + 3, size * 0.72)
        found = None
        for distance in (9, 20, 36, 58, 84, 120):
            for sx, sy in _SIDES:
                cx = point[0] + sx * (distance + half[0]) if sx else point[0]
                cy = point[1] + sy * (distance * (0.75 if sx else 1) + half[1]) if sy else point[1]
                box = (cx - half[0], cy - half[1], cx + half[0], cy + half[1])
                inside = box[0] > within[0] + 2 and box[1] > within[1] + 2 and box[2] < within[2] - 2 and box[3] < within[3] - 2
                if inside and not any(overlap(box, other) for other in taken) and not any(overlap(box, spot) for spot in spots):
                    found = Label(text=text, box=box, point=point, far=distance > 20)
                    break
            if found:
                break
        if found is None:
            lost.append(text)
        else:
            taken.append(found.box)
            placed.append(found)
    return placed, lost


def draw_labels(paper: Paper, labels: Sequence[Label], *, size: int = 12, color: str = INK) -> None:
    """Names on a soft halo; those far from their point get a line to it."""
    leaders = []
    for label in labels:
        if label.far:
            end = np.clip(label.point, label.box[:2], label.box[2:])
            leaders.append(np.array([label.point, end]))
    paper.lines(leaders, PAPER, 2.4)
    paper.lines(leaders, color, 0.9)
    for label in labels:
        middle = (label.box[0] + label.box[2]) / 2, (label.box[1] + label.box[3]) / 2
        paper.text(middle, label.text, size=size, color=color, anchor="mm", halo=2)
