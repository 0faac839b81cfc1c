"""Formulas over the columns of a table: arithmetic, comparisons, and, or, not, some functions.

The functions are `abs`, `sqrt`, `sin`, `cos`, `tan`, `atan` and `atan2(y, x)`; angles are in rad.
A text column may be compared with a word: "source == 'pose'". A column name that is not a plain
word stands in backquotes: "`elapsed time` > 0 and gas > 0.1".
Where arithmetic has no answer (1 / 0) the value is not finite, and its row is left out.
"""

import ast
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError
from scm.recording.table import Columns

Table = Columns | Mapping[str, Floats]

LONGEST = 1000

_BINARY: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_UNARY: dict[type[ast.AST], Callable[[Any], Any]] = {
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Not: np.logical_not,
}

_FUNCTIONS: dict[str, tuple[int, Callable[..., Any]]] = {
    "abs": (1, np.abs),
    "sqrt": (1, np.sqrt),
    "sin": (1, np.sin),
    "cos": (1, np.cos),
    "tan": (1, np.tan),
    "atan": (1, np.arctan),
    "atan2": (2, np.arctan2),
}


def evaluate(text: str, columns: Table, rows: int, where: str) -> Floats:
    """Return the value of an expression for every row, shape `(rows,)`.

    Args:
        text: The expression.
        columns: Arrays of shape `(rows,)` by column name.
        rows: How many there are.
        where: What to name in an error.

    Raises:
        RecordingError: for an unknown column or anything that is not arithmetic or logic.
    """
    if len(text) > LONGEST:
        msg = f"{where}: an expression of {len(text)} characters, expected at most {LONGEST}"
        raise RecordingError(msg)
    quoted: dict[str, str] = {}

    def stand_in(match: re.Match[str]) -> str:
        name = f"_column_{len(quoted)}"
        quoted[name] = match.group(1)
        return name

    try:
        tree = ast.parse(re.sub(r"`([^`]*)`", stand_in, text.strip()), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError) as cause:
        msg = f"{where}: cannot read {text!r}: {getattr(cause, 'msg', None) or 'too deep'}"
        raise RecordingError(msg) from cause
    with np.errstate(all="ignore"):
        value = _value(tree.body, columns, quoted, f"{where}: {text!r}")
    return np.broadcast_to(np.asarray(value, dtype=np.float64), (rows,)).copy()


def _value(node: ast.expr, columns: Table, quoted: dict[str, str], at: str) -> Any:
    """Return the value of one node: an array, or a number."""

    def values(*nodes: ast.expr) -> list[Any]:
        return [_value(part, columns, quoted, at) for part in nodes]

    match node:
        case ast.Constant(value=int() | float()) | ast.Name():
            return _leaf(node, columns, quoted, at)
        case ast.Compare(left=ast.Name(id=name), ops=[ast.Eq() | ast.NotEq() as op]) if isinstance(
            word := getattr(node.comparators[0], "value", None), str
        ):
            return _compared_with(word, op, quoted.get(name, name), columns, at)
        case ast.BoolOp(op=logic, values=parts):
            join = np.logical_and if isinstance(logic, ast.And) else np.logical_or
            return _joined(join, values(*parts))
        case ast.BinOp(left=left, op=arithmetic, right=right) if type(arithmetic) in _BINARY:
            return _BINARY[type(arithmetic)](*values(left, right))
        case ast.Compare(left=left, ops=ops, comparators=others) if {*map(type, ops)} <= {*_BINARY}:
            sides = values(left, *others)
            pairs = zip(ops, sides, sides[1:], strict=False)
            return _joined(np.logical_and, [_BINARY[type(op)](a, b) for op, a, b in pairs])
    return _applied(node, values, at)


def _leaf(node: ast.Constant | ast.Name, columns: Table, quoted: dict[str, str], at: str) -> Any:
    """Return a number, or a column's numbers."""
    if isinstance(node, ast.Name):
        return _column(quoted.get(node.id, node.id), columns, at)
    return _constant(node.value)  # type: ignore[arg-type]


def _compared_with(word: str, op: ast.cmpop, name: str, columns: Table, at: str) -> Any:
    """Return where a text column holds a word, or where it does not."""
    if not isinstance(columns, Columns):
        msg = f"{at}: {name!r} holds numbers, not words"
        raise RecordingError(msg)
    try:
        words = columns.words(name)
    except RecordingError as cause:
        msg = f"{at}: {cause}"
        raise RecordingError(msg) from cause
    return _BINARY[type(op)](words, word)


def _applied(node: ast.expr, values: Callable[..., list[Any]], at: str) -> Any:
    """Return what a sign, `not` or a known function makes of its inputs; all else is refused."""
    match node:
        case ast.UnaryOp(op=operation, operand=operand) if type(operation) in _UNARY:
            return _UNARY[type(operation)](*values(operand))
        case ast.Call(func=ast.Name(id=name), args=inputs, keywords=[]) if name in _FUNCTIONS:
            count, function = _FUNCTIONS[name]
            if len(inputs) == count:
                return function(*values(*inputs))
    known = ", ".join(_FUNCTIONS)
    msg = f"{at}: {ast.unparse(node)!r} is not arithmetic, a comparison, and, or, not, {known}"
    raise RecordingError(msg)


def _constant(number: float) -> Any:
    try:
        return np.float64(number)
    except OverflowError:
        return np.float64(np.inf)


def _joined(join: Callable[[Any, Any], Any], values: list[Any]) -> Any:
    """Return all values joined by `and` or `or`; numbers and arrays may mix."""
    result = values[0]
    for value in values[1:]:
        result = join(result, value)
    return result


def _column(name: str, columns: Table, at: str) -> Floats:
    try:
        return columns[name]
    except RecordingError as cause:
        msg = f"{at}: {cause}"
        raise RecordingError(msg) from cause
