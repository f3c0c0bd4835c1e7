"""XML of unknown origin: read without entities, and with the line of every element for sentences."""

import math
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from rille.model import InputRefused

LARGEST = 64 * 2**20  # [bytes] the models of whole factories have a few


class Node(ET.Element):
    """Element that knows its file and line."""

    file: str = ""
    line: int = 0

    def refuse(self, sentence: str) -> NoReturn:
        """Refuse the file with a sentence about this element."""
        raise InputRefused(f"'{self.file}', line {self.line}: {sentence}")

    def child(self, tag: str) -> "Node | None":
        """The first child of that tag."""
        found = self.find(tag)
        return found if isinstance(found, Node) else None

    def children(self, tag: str) -> "list[Node]":
        """All children of that tag."""
        return [node for node in self.findall(tag) if isinstance(node, Node)]

    def text_of(self, attribute: str, what: str) -> str:
        """An attribute that must be there and not be empty."""
        text = self.get(attribute, "").strip()
        if not text:
            self.refuse(f"{what} has no {attribute}; give <{self.tag} {attribute}=...>")
        return text

    def real(self, attribute: str, what: str, default: float | None = None, *, infinite: bool = False) -> float:
        """An attribute as a number; ``default`` if it is absent (None: it must be there)."""
        if default is not None and attribute not in self.attrib:
            return default
        return self._number(self.text_of(attribute, what), attribute, what, infinite)

    def triple(self, attribute: str, what: str, default: tuple[float, float, float] | None = None) -> tuple[float, float, float]:
        """An attribute as three numbers; ``default`` if it is absent (None: it must be there)."""
        if default is not None and attribute not in self.attrib:
            return default
        words = self.text_of(attribute, what).split()
        if len(words) != 3:
            self.refuse(f"{attribute} of {what} is '{_short(self.get(attribute, ''))}'; give three numbers")
        x, y, z = (self._number(word, attribute, what, False) for word in words)
        return x, y, z

    def _number(self, text: str, attribute: str, what: str, infinite: bool) -> float:
        try:
            value = float(text)
        except ValueError:
            self.refuse(f"{attribute} of {what} is '{_short(text)}', which is no number")
        if math.isnan(value) or (math.isinf(value) and not infinite):
            self.refuse(f"{attribute} of {what} is {value}; give a finite number")
        return value


def read_xml(path: Path) -> Node:
    """Root element of an XML file. Prefixes of namespaces stay in the tags.

    Raises
    ------
    InputRefused : if the file cannot be read, is larger than 64 MiB or not well-formed, or declares an entity: expanding those can take all
        memory (Bunke 2003, "billion laughs") or read other files, and no robot description needs them.
    """
    try:
        size = path.stat().st_size
        if size > LARGEST:
            raise InputRefused(f"'{path}' has {size / 2**20:.0f} MiB; XML of at most {LARGEST // 2**20} MiB is read")
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        if isinstance(error, InputRefused):
            raise
        reason = error.strerror if isinstance(error, OSError) else None
        raise InputRefused(f"'{path}' cannot be read: {reason or error}") from None
    parser = expat.ParserCreate()
    builder = ET.TreeBuilder(element_factory=Node)

    def start(tag: str, attributes: dict[str, str]) -> None:
        node = builder.start(tag, attributes)
        assert isinstance(node, Node)
        node.file, node.line = path.name, parser.CurrentLineNumber

    def entity(name: str, *_: object) -> None:
        where = f"'{path.name}', line {parser.CurrentLineNumber}"
        raise InputRefused(f"{where}: the entity '{_short(name)}' is declared; entities are not read, write its text out")

    parser.StartElementHandler = start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(content, True)
        root = builder.close()
    except (expat.ExpatError, ValueError, LookupError) as error:
        if isinstance(error, InputRefused):
            raise
        raise InputRefused(f"'{path}' is not well-formed XML: {error}") from None
    assert isinstance(root, Node)
    return root


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."
