"""The page from its template, as ``/tmp/w/page_assembly.md`` tells."""

import html
import json
import re
from importlib.util import find_spec
from pathlib import Path

WEB = Path(__file__).resolve().parents[2] / "pipeline" / "rille" / "view" / "web"
NAMES = (WEB / "order.txt").read_text().split()


def three() -> str:
    found = find_spec("nicegui")
    assert found is not None
    assert found.origin is not None
    text = (Path(found.origin).parent / "elements/scene/dist/index.js").read_text()
    body, names = re.fullmatch(r"(.*)export\{([^{}]*)\};?\s*(?://#[^\n]*)?\s*", text, re.S).groups()
    pairs = (pair.strip().split(" as ") for pair in names.split(","))
    return f"{body}globalThis.RILLE_THREE={{{','.join(f'{pair[-1]}:{pair[0]}' for pair in pairs)}}};"


def script() -> str:
    text = "\n".join((WEB / name).read_text() for name in NAMES)
    return re.sub(r"(?m)^export ", "", re.sub(r"(?m)^import .*\n", "", text))


def page(source: dict, title: str = "rille") -> str:
    values = {
        "nonce": "test", "title": html.escape(title), "css": (WEB / "page.css").read_text(), "three": three(), "script": script(),
        "source": json.dumps(source).replace("<", "\\u003c"),
    }  # fmt: skip
    return re.sub(r"\{\{(\w+)\}\}", lambda found: values[found[1]], (WEB / "page.html").read_text())
