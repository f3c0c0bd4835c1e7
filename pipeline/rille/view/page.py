"""Frame of the HTML reports: one file that needs no network, with plotly.js inside once, tables that sort, light and dark, print."""

import base64
import html
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rille.model import InputRefused

Tone = Literal["", "good", "notice", "bad", "quiet"]
POLICY = (  # the browser itself refuses every request, so that a report can be opened beside secret data
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; font-src data:"
)


class Html(str):
    """Text that is HTML already; all other text is escaped."""

    __slots__ = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """Cell of a table. text : what is shown. value : by which the column sorts (None: by the text). tone : colour. hint : on hovering."""

    text: str
    value: float | None = None
    tone: Tone = ""
    hint: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """Head of a column. numeric : right-aligned, sorts large values first. hint : what the number means."""

    title: str
    numeric: bool = False
    hint: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """Part of the page. key : its anchor. title : in the contents and as heading. body : HTML. lead : sentence below the heading."""

    key: str
    title: str
    body: str
    lead: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """A report.

    title : what it is about. subtitle : line below it. verdict : the answer in one sentence; tone : its colour. facts : name -> value, in
    the head. sections : in their order. script : JavaScript of this kind of report, run after ``templates/page.js``. data : what it reads
    as ``rille.data``, plain JSON values and :func:`packed` arrays.
    """

    title: str
    subtitle: str = ""
    verdict: str = ""
    tone: Tone = ""
    facts: Mapping[str, str] = field(default_factory=dict)
    sections: Sequence[Section] = ()
    script: str = ""
    data: Mapping[str, object] = field(default_factory=dict)


def escaped(text: str) -> str:
    """Text as HTML; :class:`Html` passes."""
    return text if isinstance(text, Html) else html.escape(text)


def packed(values: ArrayLike, *, exact: bool = False) -> dict[str, object]:
    """An array as plotly.js reads it, 32-bit in base64 (``exact``: 64-bit, for time); NaN stays NaN and breaks a line."""
    array = np.ascontiguousarray(values, dtype="<f8" if exact else "<f4")
    packed: dict[str, object] = {"dtype": "f8" if exact else "f4", "bdata": base64.b64encode(array.tobytes()).decode()}
    return packed if array.ndim == 1 else packed | {"shape": ", ".join(str(size) for size in array.shape)}


def number(value: float, digits: int = 3) -> str:
    """A number for a reader: ``digits`` significant ones, powers of ten outside 0.001 to 100 000, a dash for what is not known."""
    if not math.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 1e5:
        places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        return f"{value:.{places}f}"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}·{power_of_ten(int(exponent))}"


def power_of_ten(exponent: int) -> str:
    """10 with a raised exponent."""
    return f"10{str(exponent).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def probability(p: float) -> str:
    """A probability for a reader; below 10^-12 it is only said to be below."""
    return f"< {power_of_ten(-12)}" if 0 <= p < 1e-12 else number(p, 2)


def script_text(value: object) -> str:
    """JSON that may stand inside a ``script`` element: no text in it can end the element; NaN becomes null."""

    def finite(item: object) -> object:
        if isinstance(item, Mapping):
            return {str(key): finite(entry) for key, entry in item.items()}
        if isinstance(item, np.ndarray):
            return finite(item.tolist())
        if isinstance(item, (list, tuple)):
            return [finite(entry) for entry in item]
        if isinstance(item, np.generic):
            return finite(item.item())
        return None if isinstance(item, float) and not math.isfinite(item) else item

    text = json.dumps(finite(value), separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def figure(key: str, traces: Iterable[Mapping[str, object]], layout: Mapping[str, object], *, caption: str, height: int = 360) -> str:
    """A plotly figure, drawn when it scrolls into view. Colours may be ``var(--measured)`` and other names of ``templates/page.css``.

    key : its id in the page. caption : says what is seen, also to a screen reader. height : [px].
    """
    return (
        f'<figure class="plot" id="{html.escape(key)}">'
        f'<div class="canvas" role="img" aria-label="{html.escape(caption)}" style="height:{height}px"></div>'
        f"<figcaption>{escaped(caption)}</figcaption>"
        f'<script type="application/json">{script_text({"data": list(traces), "layout": dict(layout)})}</script></figure>'
    )


def empty_figure(key: str, *, caption: str, height: int = 360) -> str:
    """Place for a figure that the page's own script draws with ``rille.show``."""
    return (
        f'<figure class="plot" id="{html.escape(key)}"><div class="canvas" role="img" aria-label="{html.escape(caption)}" '
        f'style="height:{height}px"></div><figcaption>{escaped(caption)}</figcaption></figure>'
    )


def picture_source(path: Path) -> str:
    """A PNG file as the ``src`` of an image."""
    return f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}"


def picture(path: Path, *, caption: str) -> str:
    """A PNG file inside the page."""
    return (
        f'<figure class="picture"><img alt="{html.escape(caption)}" src="{picture_source(path)}">'
        f"<figcaption>{escaped(caption)}</figcaption></figure>"
    )


def badge(text: str, tone: Tone) -> Html:
    """A coloured word; the word itself says it all."""
    return Html(f'<span class="badge {tone}">{escaped(text)}</span>')


def table(
    columns: Sequence[Column],
    rows: Iterable[Sequence[str | Cell]],
    *,
    key: str,
    caption: str = "",
    row_keys: Sequence[str] | None = None,
    shown: int | None = None,
) -> str:
    """A table that sorts by a click on a head.

    row_keys : one per row ('' for none); such rows can be chosen with mouse and keyboard, and the page's script hears of it by
    ``rille.onChoose``. shown : so many rows at first, the rest behind a button.
    """
    head = "".join(
        f'<th scope="col" class="{"number" if column.numeric else ""}" title="{html.escape(column.hint)}">'
        f'<button type="button">{escaped(column.title)}</button></th>'
        for column in columns
    )
    lines = []
    for index, row in enumerate(rows):
        chosen_by = row_keys[index] if row_keys is not None else ""
        attributes = f' data-key="{html.escape(chosen_by)}" tabindex="0"' if chosen_by else ""
        late = ' class="late"' if shown is not None and index >= shown else ""
        lines.append(f"<tr{attributes}{late}>" + "".join(map(_cell, row, columns)) + "</tr>")
    more = ""
    if shown is not None and len(lines) > shown:
        more = f'<button type="button" class="more" data-for="{html.escape(key)}">all {len(lines)} rows</button>'
    title = f"<caption>{escaped(caption)}</caption>" if caption else ""
    inside = f"{title}<thead><tr>{head}</tr></thead><tbody>{''.join(lines)}</tbody>"
    return f'<div class="table"><table id="{html.escape(key)}">{inside}</table></div>{more}'


def _cell(cell: str | Cell, column: Column) -> str:
    kind = "number" if column.numeric else ""
    if isinstance(cell, str):
        return f'<td class="{kind}">{escaped(cell)}</td>'
    order = f' data-value="{cell.value!r}"' if cell.value is not None and math.isfinite(cell.value) else ""
    hint = f' title="{html.escape(cell.hint)}"' if cell.hint else ""
    text = badge(cell.text, cell.tone) if cell.tone and not column.numeric else escaped(cell.text)
    return f'<td class="{kind} {cell.tone}"{order}{hint}>{text}</td>'


def write_page(path: str | Path, page: Page) -> Path:
    """Write the report as one HTML file; an older file stays until the new one is whole.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    path = Path(path)
    unfinished = path.with_name(path.name + ".part")
    try:
        with unfinished.open("w", encoding="utf-8") as file:
            file.writelines(_pieces(page))
        unfinished.replace(path)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        why = error.strerror or str(error)
        raise InputRefused(f"the report '{path}' cannot be written: {why}; name a file in a folder that exists") from None
    return path


def _pieces(page: Page) -> Iterable[str]:
    yield (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}"><meta name="generator" content="rille">'
        f'<link rel="icon" href="data:,"><title>{escaped(page.title)}</title><style>{template("page.css")}</style></head><body>'
    )
    links = "".join(f'<a href="#{html.escape(section.key)}">{escaped(section.title)}</a>' for section in page.sections)
    yield (
        f'<nav aria-label="Contents"><span class="brand">rille</span>{links}'
        '<button type="button" id="theme" title="switch between light and dark">light / dark</button></nav>'
    )
    yield f'<main><header><h1>{escaped(page.title)}</h1><p class="subtitle">{escaped(page.subtitle)}</p>'
    if page.verdict:
        yield f'<p class="verdict {page.tone}" id="verdict">{escaped(page.verdict)}</p>'
    if page.facts:
        pairs = "".join(f"<div><dt>{escaped(name)}</dt><dd>{escaped(value)}</dd></div>" for name, value in page.facts.items())
        yield f'<dl class="facts">{pairs}</dl>'
    yield "</header>"
    for section in page.sections:
        lead = f'<p class="lead">{escaped(section.lead)}</p>' if section.lead else ""
        yield f'<section id="{html.escape(section.key)}"><h2>{escaped(section.title)}</h2>{lead}{section.body}</section>'
    yield f'</main><script type="application/json" id="rille-data">{script_text(page.data)}</script>'
    yield f"<script>{_plotly_script()}</script><script>{template('page.js')}</script>"
    if page.script:
        yield f"<script>{page.script}</script>"
    yield "</body></html>\n"


@cache
def template(name: str) -> str:
    """Text of a file in ``view/templates``."""
    return files("rille.view").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def _plotly_script() -> str:
    from plotly.offline import get_plotlyjs

    return get_plotlyjs().replace("</script", "<\\/script")
