"""The tables of a TOML text and where they stand, so that one can be changed, added or taken out and the rest keeps every byte."""

import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rille.model import InputRefused

_TOKEN = re.compile(
    r'(?P<string>"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\')'
    r"|(?P<comment>\#[^\n]*)|(?P<open>[\[{])|(?P<close>[\]}])|(?P<line>\n[ \t]*)",
    re.DOTALL,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """An entry of an array of tables, such as [[landform]], with its sub-tables and the comment lines right above it: text[start:end]."""

    kind: str
    content: dict[str, Any]
    start: int
    end: int


def blocks(text: str) -> list[Block]:
    """Entries of all arrays of tables in the order of the text, which must be valid TOML."""
    heads = _heads(text)
    starts = [start for start, *_ in heads] + [len(text)]
    found = []
    for k, (start, path, is_entry) in enumerate(heads):
        if not is_entry or len(path) != 1:
            continue
        last = k + 1
        while last < len(heads) and len(heads[last][1]) > 1 and heads[last][1][0] == path[0]:
            last += 1
        content = tomllib.loads(text[start : starts[last]])[path[0]][0]
        found.append(Block(kind=path[0], content=content, start=start, end=starts[last]))
    return found


def changed(text: str, block: Block, change: Callable[[Any], None]) -> str:
    """The text after ``change`` was applied to the table of a block; comments, order and layout of the rest stay."""
    import tomlkit

    document = tomlkit.parse(text[block.start : block.end])
    change(document[block.kind][0])  # type: ignore[index]
    return text[: block.start] + _ending_like(text, tomlkit.dumps(document)) + text[block.end :]


def added(text: str, kind: str, entry: dict[str, Any]) -> str:
    """The text with one more entry: after the last of its kind, else at the end.

    Raises
    ------
    InputRefused : if entries of that kind are written as one array of inline tables.
    """
    import tomlkit

    table = tomlkit.table()
    for key, value in entry.items():
        if isinstance(value, dict):
            value = tomlkit.value("{ " + ", ".join(f"{k} = {tomlkit.item(v).as_string()}" for k, v in value.items()) + " }")
        table.add(key, value)
    array = tomlkit.aot()
    array.append(table)
    document = tomlkit.document()
    document.add(kind, array)
    newline = _newline(text)
    new = _ending_like(text, tomlkit.dumps(document).strip("\n") + "\n")
    same = [block for block in blocks(text) if block.kind == kind]
    if not same and tomllib.loads(text).get(kind):
        raise InputRefused(f"the {kind}s of the scene are written as one array; write each as a table that begins with [[{kind}]]")
    place = same[-1].end if same else len(text)
    before, after = text[:place].rstrip("\r\n \t"), text[place:]
    gap = newline * 2 if before else ""
    return before + gap + new + (newline + after if after else "")


def removed(text: str, block: Block) -> str:
    """The text without a block; comment lines right above it go with it."""
    before, after = text[: block.start], text[block.end :]
    if after:
        return before + after
    return before.rstrip("\r\n \t") + _newline(text)


def _newline(text: str) -> str:
    return "\r\n" if "\r\n" in text else "\n"


def _ending_like(text: str, part: str) -> str:
    """A part with the line ends of the text."""
    return part.replace("\r\n", "\n").replace("\n", _newline(text))


def _heads(text: str) -> list[tuple[int, tuple[str, ...], bool]]:
    """(start, path, True for [[ ]]) of the header lines; start: of the line, or of the comment lines right above it."""
    heads, depth, head, line, fresh = [], 0, -1, 0, True
    comments: list[int] = []  # starts of the lines of an unbroken run of comment lines
    position = 0
    for token in _TOKEN.finditer(text):
        if depth == 0 and text[position : token.start()].strip():  # a key or a bare value
            fresh, comments = False, []
        position = token.end()
        if token["line"] is not None:
            if depth == 0:
                if text[line : token.start()].strip() == "":
                    comments = []
                line, fresh = token.start() + 1, True
        elif token["comment"] is not None:
            if depth == 0 and fresh:
                comments.append(line)
        elif token["open"] is not None:
            if depth == 0 and fresh:
                head = token.start()
            fresh = False
            depth += 1
        elif token["close"] is not None:
            depth -= 1
            if depth == 0 and head >= 0:
                table = text[head : token.end()]
                heads.append((comments[0] if comments else line, _path(tomllib.loads(table)), table.startswith("[[")))
                head, comments = -1, []
        elif token["string"] is not None:
            fresh = False
            if depth == 0:
                comments = []
    return heads


def _path(content: Any) -> tuple[str, ...]:
    path: list[str] = []
    while content:
        content = content[0] if isinstance(content, list) else content
        if content:
            ((key, content),) = content.items()
            path.append(key)
    return tuple(path)
