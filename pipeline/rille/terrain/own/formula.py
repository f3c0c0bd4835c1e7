"""Formulas that a designer writes: arithmetic, comparisons and a few functions over named numbers; nothing else is run."""

import ast
import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rille.model import InputRefused, nearest_names
from rille.terrain.landform import smooth_step

LONGEST = 2000  # characters
DEEPEST = 60  # parentheses and calls inside one another

FUNCTIONS: dict[str, tuple[Callable[..., Any], int]] = {  # with the number of arguments, -1: two or more
    "abs": (np.abs, 1),
    "sqrt": (np.sqrt, 1),
    "exp": (np.exp, 1),
    "log": (np.log, 1),
    "log10": (np.log10, 1),
    "sin": (np.sin, 1),
    "cos": (np.cos, 1),
    "tan": (np.tan, 1),
    "asin": (np.arcsin, 1),
    "acos": (np.arccos, 1),
    "atan": (np.arctan, 1),
    "atan2": (np.arctan2, 2),
    "sinh": (np.sinh, 1),
    "cosh": (np.cosh, 1),
    "tanh": (np.tanh, 1),
    "floor": (np.floor, 1),
    "sign": (np.sign, 1),
    "hypot": (np.hypot, 2),
    "smooth_step": (smooth_step, 1),
    "clip": (np.clip, 3),
    "where": (np.where, 3),
    "min": (lambda *values: _fold(np.minimum, values), -1),
    "max": (lambda *values: _fold(np.maximum, values), -1),
}
CONSTANTS = {"pi": np.pi}
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.Mod: np.mod,
}
_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}


def _fold(function: Callable[[Any, Any], Any], values: tuple[Any, ...]) -> Any:
    result = values[0]
    for value in values[1:]:
        result = function(result, value)
    return result


@dataclass(frozen=True, slots=True)
class Formula:
    """A checked formula. text : as written. names : the values that it needs."""

    text: str
    names: frozenset[str]
    _tree: ast.expr

    def __call__(self, values: Mapping[str, Any]) -> Any:
        """Its value [SI] for numbers or arrays by name; what is undefined (a root of a negative number) is NaN."""
        with np.errstate(all="ignore"):
            return _value(self._tree, values)


def is_formula(text: str) -> bool:
    """True for ``"0.2 * diameter"``, false for a quantity such as ``"12 cm"``."""
    try:
        ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return True


def parse_formula(text: str, known: Iterable[str], what: str) -> Formula:
    """Check a formula; numbers in it are SI and radians.

    Parameters
    ----------
    text : arithmetic (+ - * / ** %), comparisons, the functions of ``FUNCTIONS``, ``pi``, and the names in ``known``.
    what : subject of the error sentence ("height of landform 'bowl'").

    Raises
    ------
    InputRefused : for what cannot be parsed, an unknown name or function (with the nearest ones), or anything that is no arithmetic.
    """
    if len(text) > LONGEST:
        raise InputRefused(f"{what} is {len(text)} characters long, more than {LONGEST}; break it into drivers with links")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        at = f" at '{text.strip()[max((error.offset or 1) - 1, 0) :][:20]}'" if isinstance(error, SyntaxError) else ""
        raise InputRefused(f'{what} is "{text}", which is no formula{at}; write for example "0.2 * diameter"') from None
    names: set[str] = set()
    _check(tree, frozenset(known), f'{what}, "{text}",', names, 0)
    return Formula(text.strip(), frozenset(names), tree)


def _check(node: ast.expr, known: frozenset[str], what: str, names: set[str], depth: int) -> None:
    """Refuse whatever the evaluation below does not know; collect names."""
    if depth > DEEPEST:
        raise InputRefused(f"{what} is nested more than {DEEPEST} deep; break it into drivers with links")

    def inside(*nodes: ast.expr) -> None:
        for child in nodes:
            _check(child, known, what, names, depth + 1)

    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        return
    if isinstance(node, ast.Name):
        if node.id in CONSTANTS:
            return
        if node.id in FUNCTIONS:
            raise InputRefused(f"{what} uses the function '{node.id}' as a number; write {node.id}(...)")
        if node.id not in known:
            raise InputRefused(f"{what} uses '{node.id}', which it does not know; {nearest_names(node.id, [*known, *CONSTANTS])}")
        names.add(node.id)
    elif isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        inside(node.left, node.right)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        inside(node.operand)
    elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARE:
        inside(node.left, node.comparators[0])
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        name = node.func.id
        if name not in FUNCTIONS:
            raise InputRefused(f"{what} calls '{name}', which is no function of formulas; {nearest_names(name, FUNCTIONS)}")
        wanted = FUNCTIONS[name][1]
        if len(node.args) != wanted if wanted >= 0 else len(node.args) < 2:
            asked = f"{wanted}" if wanted >= 0 else "two or more"
            raise InputRefused(f"{what} gives {name} {len(node.args)} values; it takes {asked}")
        inside(*node.args)
    else:
        raise InputRefused(
            f"{what} holds '{ast.unparse(node)[:40]}', which is no arithmetic; use numbers, drivers, + - * / **, comparisons inside "
            "where(condition, yes, no), and functions such as sqrt or min"
        )


def _value(node: ast.expr, values: Mapping[str, Any]) -> Any:
    if isinstance(node, ast.Constant):
        return np.float64(node.value)  # type: ignore[arg-type]
    if isinstance(node, ast.Name):
        return CONSTANTS[node.id] if node.id in CONSTANTS else values[node.id]
    if isinstance(node, ast.BinOp):
        return _BINARY[type(node.op)](_value(node.left, values), _value(node.right, values))
    if isinstance(node, ast.UnaryOp):
        inner = _value(node.operand, values)
        return -inner if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.Compare):
        return _COMPARE[type(node.ops[0])](_value(node.left, values), _value(node.comparators[0], values))
    assert isinstance(node, ast.Call)
    assert isinstance(node.func, ast.Name)
    return FUNCTIONS[node.func.id][0](*(_value(argument, values) for argument in node.args))
