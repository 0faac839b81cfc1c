"""Formulas over the columns of a table: arithmetic, comparisons, and, or, not. Nothing else.

A column name that is not a plain word stands in backquotes: "`elapsed time` > 0 and gas > 0.1".
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


def evaluate(text: str, columns: Mapping[str, Floats], rows: int, where: str) -> Floats:
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


def _value(node: ast.expr, columns: Mapping[str, Floats], quoted: dict[str, str], at: str) -> Any:
    """Return the value of one node: an array, or a number."""

    def values(*nodes: ast.expr) -> list[Any]:
        return [_value(part, columns, quoted, at) for part in nodes]

    match node:
        case ast.Constant(value=int() | float() as number):
            return _constant(number)
        case ast.Name(id=name):
            return _column(quoted.get(name, name), columns, at)
        case ast.UnaryOp(op=operation, operand=operand) if type(operation) in _UNARY:
            return _UNARY[type(operation)](*values(operand))
        case ast.BoolOp(op=logic, values=parts):
            join = np.logical_and if isinstance(logic, ast.And) else np.logical_or
            return _joined(join, values(*parts))
        case ast.BinOp(left=left, op=arithmetic, right=right) if type(arithmetic) in _BINARY:
            return _BINARY[type(arithmetic)](*values(left, right))
        case ast.Compare(left=left, ops=ops, comparators=others) if {*map(type, ops)} <= {*_BINARY}:
            sides = values(left, *others)
            pairs = zip(ops, sides, sides[1:], strict=False)
            return _joined(np.logical_and, [_BINARY[type(op)](a, b) for op, a, b in pairs])
    msg = f"{at}: {ast.unparse(node)!r} is not arithmetic, a comparison, and, or, not"
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


def _column(name: str, columns: Mapping[str, Floats], at: str) -> Floats:
    try:
        return columns[name]
    except RecordingError as cause:
        msg = f"{at}: {cause}"
        raise RecordingError(msg) from cause
