"""Words on frames: what is shown, when, and what colours mean."""

from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from rille.view.scene3d.ruts import slip_color

Array = NDArray[Any]
BACK = (10, 13, 18, 190)
BRIGHT, FAINT = (240, 243, 247), (150, 160, 172)
LINE = 1.45  # height of a line in sizes of its letters
LEAST, SHARE = 10, 0.024  # size of letters: pixels, and of the frame's height
Words = list[tuple[str, tuple[int, int, int]]]


def letters(height: int) -> int:
    """Size of letters [px] on frames of a height [px]."""
    return max(LEAST, round(SHARE * height))


@cache
def _font(size: int) -> Any:
    """DejaVu Sans, which comes with matplotlib: names may be in any script; Pillow's own font has no letter beyond ASCII."""
    folder = Path(str(files("matplotlib"))) / "mpl-data" / "fonts" / "ttf"
    return ImageFont.truetype(str(folder / "DejaVuSans.ttf"), size)


def panel(lines: list[Words], size: int) -> Image.Image:
    """A dark translucent panel of coloured words, one line below the other."""
    font, pad = _font(size), round(0.7 * size)
    gap = 0.8 * size
    wide = max(sum(font.getlength(text) + gap for text, _ in words) - gap for words in lines)
    picture = _plate(int(wide) + 2 * pad, int(LINE * size * len(lines)) + 2 * pad - int(0.3 * size))
    pen = ImageDraw.Draw(picture)
    for row, words in enumerate(lines):
        x = float(pad)
        for text, color in words:
            pen.text((x, pad + LINE * size * row), text, font=font, fill=(*color, 255))
            x += font.getlength(text) + gap
    return picture


def slip_legend(size: int) -> Image.Image:
    """The colours of slip as a bar with its ends named."""
    font, pad, wide = _font(size), round(0.7 * size), 8 * size
    left, right = "slip: skids -1", "+1 spins"
    start = pad + int(font.getlength(left)) + size // 2
    picture = _plate(start + wide + size // 2 + int(font.getlength(right)) + pad, int(LINE * size) + 2 * pad - int(0.3 * size))
    pen = ImageDraw.Draw(picture)
    pen.text((pad, pad), left, font=font, fill=(*FAINT, 255))
    pen.text((start + wide + size // 2, pad), right, font=font, fill=(*FAINT, 255))
    for k, color in enumerate(slip_color(np.linspace(-1, 1, wide))):
        pen.line([(start + k, pad + 0.4 * size), (start + k, pad + 0.9 * size)], fill=(*map(int, color), 255))
    return picture


def stamp(frame: Array, plate: Image.Image, x: int, y: int) -> None:
    """Lay a panel over a frame (rows, columns, 3) uint8, its corner at column x and row y; what lies outside is cut off."""
    rows, columns = min(plate.height, frame.shape[0] - y), min(plate.width, frame.shape[1] - x)
    if rows <= 0 or columns <= 0:
        return
    over = np.asarray(plate)[:rows, :columns].astype(np.uint16)
    under = frame[y : y + rows, x : x + columns]
    share = over[..., 3:]
    under[:] = ((over[..., :3] * share + under * (255 - share)) // 255).astype(np.uint8)


def _plate(width: int, height: int) -> Image.Image:
    picture = Image.new("RGBA", (width, height), (0, 0, 0, 0))
    ImageDraw.Draw(picture).rounded_rectangle((0, 0, width - 1, height - 1), radius=min(6, height // 4), fill=BACK)
    return picture
