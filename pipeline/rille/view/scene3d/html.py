"""The page of replays and live sessions: one HTML file that works from a disk and offline."""

import html
import json
import re
import secrets
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from rille.model import InputRefused

THREE = "elements/scene/dist/index.js"  # three.js as nicegui's wheel brings it
LIVE = {"kind": "live"}


def page(source: dict[str, Any], title: str) -> str:
    """The page that shows a source; see ``view/web/page.html``.

    Raises
    ------
    InputRefused : if three.js is not installed.
    """
    values = {
        "nonce": secrets.token_urlsafe(16),
        "title": html.escape(title),
        "css": _text("page.css"),
        "three": three_js(),
        "script": script(),
        "source": json.dumps(source, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c").replace("\u2028", "\\u2028"),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: values[found[1]], _text("page.html"))


def live_page() -> str:
    """The page of a live session: it asks its server for everything."""
    return page(LIVE, "rille")


@cache
def three_js() -> str:
    """three.js as a module that leaves its names in ``globalThis.RILLE_THREE``; nicegui itself is not imported.

    Raises
    ------
    InputRefused : if it is not there.
    """
    spec = find_spec("nicegui")
    path = Path(spec.origin).parent / THREE if spec is not None and spec.origin is not None else None
    if path is None or not path.is_file():
        raise InputRefused("three.js was not found in the package nicegui; install rille again, with the versions that it names")
    found = re.fullmatch(r"(.*)export\{([^{}]*)\};?\s*(?://#[^\n]*)?\s*", path.read_text(encoding="utf-8"), re.S)
    if found is None or "</script" in found[1]:
        raise InputRefused(f"'{path}' is not the three.js that rille knows; install rille again, with the versions that it names")
    pairs = (pair.strip().split(" as ") for pair in found[2].split(","))
    return f"{found[1]}globalThis.RILLE_THREE={{{','.join(f'{pair[-1]}:{pair[0]}' for pair in pairs)}}};"


def _text(name: str) -> str:
    return files("rille.view").joinpath("web", name).read_text(encoding="utf-8")


def script() -> str:
    """Our modules as one: their names are unique, so that imports and exports between them can go."""
    text = "\n".join(_text(name) for name in _text("order.txt").split())
    return re.sub(r"(?m)^export ", "", re.sub(r"(?m)^import .*\n", "", text))
