"""The page's modules can be joined to one script, in the order of ``order.txt``."""

import re
from collections import Counter

import pytest

from web.assembled import NAMES, WEB, script, three

TOP = re.compile(r"(?m)^(?:export )?(?:async )?(?:const|let|class|function)\s+(?:\{([^}]*)\}|(\w+))")


def names_of(text: str) -> list[str]:
    return [name.strip() for found in TOP.finditer(text) for name in (found[1] or found[2]).split(",")]


def test_the_order_holds_every_module_after_those_it_imports():
    assert sorted(NAMES) == sorted(path.name for path in WEB.glob("*.js"))
    for at, name in enumerate(NAMES):
        text = (WEB / name).read_text()
        lines = re.findall(r"(?m)^import .*", text)
        assert all(re.fullmatch(r'import \{ [\w, ]+ \} from "\./(\w+\.js)";', line) for line in lines), name
        for line in lines:
            other = re.search(r'"\./(.+)"', line)
            assert other is not None
            assert other[1] in NAMES[:at], f"{name} imports {other[1]}, which comes later"
            exported = re.findall(r"(?m)^export (?:async )?(?:const|function|class) (?:\{ ([^}]*) \}|(\w+))", (WEB / other[1]).read_text())
            offered = {n.strip() for pair in exported for n in (pair[0] or pair[1]).split(",")}
            wanted = re.search(r"\{ (.*) \}", line)
            assert wanted is not None
            assert {n.strip() for n in wanted[1].split(",")} <= offered, f"{name} wants of {other[1]} what it does not export"


def test_top_level_names_are_unique_over_all_modules():
    counts = Counter(name for file in NAMES for name in names_of((WEB / file).read_text()))
    assert [name for name, count in counts.items() if count > 1] == []


@pytest.mark.parametrize("name", NAMES)
def test_a_module_is_short_and_puts_no_text_in_as_html(name: str):
    text = (WEB / name).read_text()
    assert text.count("\n") < 300
    assert text.startswith("// ")
    assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function", text)


def test_joined_scripts_can_stand_in_a_page():
    assert not re.search(r"(?m)^(import|export) ", script())
    for text in (script(), three()):
        assert "</script" not in text
        assert "<!--" not in text
    assert "http://" not in script()
    assert "https://" not in script()
