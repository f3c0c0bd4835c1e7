"""A sheet of paper: a map in a frame with axes, a title, a side panel, text and smooth lines. numpy and Pillow only.

matplotlib is not imported, as its start alone takes longer than a picture may; only its fonts are used.
"""

import importlib.util
import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]

INK = "#1d232b"
SOFT = "#5d6873"
RULE = "#c9ced4"
PAPER = "#ffffff"
SMOOTH = 3  # lines are drawn so many times larger and reduced


@lru_cache
def font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """DejaVu Sans as shipped with matplotlib, else Pillow's own font."""
    found = importlib.util.find_spec("matplotlib")
    if found is not None and found.origin is not None:
        path = Path(found.origin).parent / "mpl-data/fonts/ttf" / ("DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf")
        if path.is_file():
            return ImageFont.truetype(str(path), size)
    return ImageFont.load_default(size)


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round values within limits, at most about ``most``."""
    step = (high - low) / max(most, 1)
    power = 10.0 ** math.floor(math.log10(step))
    step = next(m * power for m in (1, 2, 2.5, 5, 10) if m * power >= step * (1 - 1e-9))
    first = math.ceil(low / step - 1e-9)
    return [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]


def number(value: float, step: float) -> str:
    """A tick's label with the digits that its step needs."""
    digits = max(0, -math.floor(math.log10(step) + 1e-9)) if step > 0 else 0
    digits += 1 if step > 0 and abs(step * 10**digits - round(step * 10**digits)) > 1e-6 else 0
    text = f"{value:.{digits}f}"
    return text.replace("-", "\u2212") if float(text) else text.replace("-", "")


class Paper:
    """An image to draw on; pixels from the upper left corner."""

    def __init__(self, width: int, height: int) -> None:
        """Make a white sheet."""
        self.image = Image.new("RGB", (width, height), PAPER)
        self.pen = ImageDraw.Draw(self.image)

    def text(
        self,
        at: tuple[float, float],
        text: str,
        *,
        size: int = 13,
        bold: bool = False,
        color: str = INK,
        anchor: str = "la",
        halo: int = 0,
        ground: str = PAPER,
    ) -> None:
        """Text at its anchor (Pillow's two letters), with a halo of so many pixels in the colour of the ground."""
        style = {"stroke_width": halo, "stroke_fill": ground} if halo else {}
        self.pen.text(at, printable(text), fill=color, font=font(size, bold), anchor=anchor, **style)

    def extent(self, text: str, *, size: int = 13, bold: bool = False) -> tuple[float, float]:
        """Width and height of a line of text [pixels]."""
        left, top, right, bottom = font(size, bold).getbbox(printable(text))
        return right - left, bottom - top

    def wrapped(self, at: tuple[float, float], text: str, width: float, *, size: int = 12, color: str = SOFT, bold: bool = False) -> float:
        """Text in lines of at most ``width`` pixels; returns where the next line would begin."""
        x, y = at
        for line in wrap(text, width, size, bold):
            self.text((x, y), line, size=size, color=color, bold=bold)
            y += size * 1.4
        return y

    def turned(self, at: tuple[float, float], text: str, angle: float, *, size: int = 11, color: str = INK, halo: str = "") -> None:
        """Text centred at a pixel and turned by ``angle`` [deg, counter-clockwise], on a soft halo of a colour."""
        face, text = font(size), printable(text)
        left, top, right, bottom = face.getbbox(text, anchor="mm", stroke_width=3)
        reach = math.ceil(math.hypot(right - left, bottom - top)) + 2
        for stroke, tone, opacity in ((3, halo, 0.75), (0, color, 1.0)):
            if tone:
                stencil = Image.new("L", (reach, reach), 0)
                fill = round(255 * opacity)
                ImageDraw.Draw(stencil).text(
                    (reach / 2, reach / 2), text, fill=fill, font=face, anchor="mm", stroke_width=stroke, stroke_fill=fill
                )
                stencil = stencil.rotate(angle, resample=Image.Resampling.BICUBIC)
                self.image.paste(tone, (round(at[0] - reach / 2), round(at[1] - reach / 2)), stencil)

    def lines(
        self, paths: Iterable[Array], color: str, width: float, *, within: Box | None = None, dash: tuple[float, float] | None = None
    ) -> None:
        """Smooth lines through points (n, 2) [pixels], cut off outside a box."""
        self._smooth([("line", p) for p in paths], color, width, within, dash)

    def areas(self, polygons: Iterable[Array], color: str, *, within: Box | None = None, opacity: float = 1.0) -> None:
        """Filled polygons (n, 2) [pixels], cut off outside a box."""
        self._smooth([("area", p) for p in polygons], color, 0.0, within, None, opacity)

    def dots(self, centers: Array, radius: float, color: str, *, rim: str = "", within: Box | None = None) -> None:
        """Discs at pixels (n, 2), with a rim."""
        around = np.linspace(0, 2 * np.pi, 20, endpoint=False)
        for size, tone in ((radius + 1.2, rim), (radius, color)):
            if tone:
                ring = size * np.column_stack([np.cos(around), np.sin(around)])
                self.areas([center + ring for center in centers], tone, within=within)

    def _smooth(
        self, shapes: Sequence[tuple[str, Array]], color: str, width: float, within: Box | None, dash: tuple | None, opacity: float = 1.0
    ) -> None:
        shapes = [(kind, np.asarray(points, float)) for kind, points in shapes if len(points) > 1]
        if not shapes:
            return
        everything = np.concatenate([points for _, points in shapes])
        edge = within or (0, 0, *self.image.size)
        low = np.floor(np.maximum(everything.min(axis=0) - width - 2, edge[:2])).astype(int)
        high = np.ceil(np.minimum(everything.max(axis=0) + width + 2, edge[2:])).astype(int)
        if np.any(high <= low):
            return
        stencil = Image.new("L", tuple(SMOOTH * (high - low)), 0)
        pen = ImageDraw.Draw(stencil)
        fill = round(255 * opacity)
        for kind, points in shapes:
            corners = SMOOTH * (points - low)
            if kind == "area":
                pen.polygon([tuple(c) for c in corners], fill=fill)
            else:
                for piece in dashes(corners, dash) if dash else [corners]:
                    pen.line([tuple(c) for c in piece], fill=fill, width=max(1, round(SMOOTH * width)), joint="curve")
        self.image.paste(color, tuple(low), stencil.reduce(SMOOTH))

    def arrow(self, tail: Array, tip: Array, color: str, width: float) -> None:
        """A line with a filled head."""
        along = (tip - tail) / max(np.linalg.norm(tip - tail), 1e-9)
        side = np.array([-along[1], along[0]])
        head = 4.2 * width
        self.lines([np.array([tail, tip - head * along])], color, width)
        self.areas([np.array([tip, tip - head * along + 0.5 * head * side, tip - head * along - 0.5 * head * side])], color)

    def save(self, path: Path) -> None:
        """Write a PNG; quickly rather than small."""
        self.image.save(path, format="PNG", compress_level=1)


def printable(text: str) -> str:
    """A text in one line: what cannot be drawn (line ends, tabs, other control characters) is a blank."""
    return "".join(letter if letter.isprintable() else " " for letter in text)


def wrap(text: str, width: float, size: int, bold: bool = False) -> list[str]:
    """Break a text at blanks into lines of at most ``width`` pixels."""
    face = font(size, bold)
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and face.getlength(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def dashes(points: Array, dash: tuple[float, float]) -> list[Array]:
    """Cut a line into dashes of (drawn, left out) pixels of the picture."""
    on, off = SMOOTH * dash[0], SMOOTH * dash[1]
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    pieces = []
    start = 0.0
    while start < run[-1] and len(pieces) < 4000:
        end = min(start + on, run[-1])
        inner = (run > start) & (run < end)
        at = np.concatenate([[start], run[inner], [end]])
        pieces.append(np.column_stack([np.interp(at, run, points[:, k]) for k in range(2)]))
        start += on + off
    return pieces
