"""Formulas over the columns of a table: arithmetic, comparisons, and, or, not. Nothing else.

A column name that is not a plain word stands in backquotes: "`elapsed time` > 0 and gas > 0.1".
"""

import ast
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError, nearest

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


def evaluate(text: str, columns: Mapping[str, Floats], where: str) -> Floats:
    """Return the value of an expression for every row.

    Args:
        text: The expression.
        columns: Arrays of shape `(rows,)` by column name.
        where: What to name in an error.

    Raises:
        RecordingError: for an unknown column or anything that is not arithmetic or logic.
    """
    quoted: dict[str, str] = {}

    def stand_in(match: re.Match[str]) -> str:
        name = f"_column_{len(quoted)}"
        quoted[name] = match.group(1)
        return name

    try:
        tree = ast.parse(re.sub(r"`([^`]*)`", stand_in, text), mode="eval")
    except SyntaxError as cause:
        msg = f"{where}: cannot read {text!r}: {cause.msg}"
        raise RecordingError(msg) from cause
    rows = len(next(iter(columns.values())))
    value = _value(tree.body, columns, quoted, f"{where}: {text!r}")
    return np.broadcast_to(np.asarray(value, dtype=np.float64), (rows,)).copy()


def _value(node: ast.expr, columns: Mapping[str, Floats], quoted: dict[str, str], at: str) -> Any:
    """Return the value of one node: an array, or a number."""
    match node:
        case ast.Constant(value=int() | float() as number):
            value: Any = float(number)
        case ast.Name(id=name):
            value = _column(quoted.get(name, name), columns, at)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            value = -_value(operand, columns, quoted, at)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            value = np.logical_not(_value(operand, columns, quoted, at))
        case ast.BoolOp(op=operation, values=parts):
            join = np.logical_and if isinstance(operation, ast.And) else np.logical_or
            value = join.reduce([_value(part, columns, quoted, at) for part in parts])
        case (
            ast.BinOp(left=left, op=operator_, right=right)
            | ast.Compare(left=left, ops=[operator_], comparators=[right])
        ) if type(operator_) in _BINARY:
            sides = (_value(side, columns, quoted, at) for side in (left, right))
            value = _BINARY[type(operator_)](*sides)
        case _:
            msg = f"{at}: {ast.unparse(node)!r} is not arithmetic, a comparison, and, or, not"
            raise RecordingError(msg)
    return value


def _column(name: str, columns: Mapping[str, Floats], at: str) -> Floats:
    if name not in columns:
        msg = f"{at}: no column {name!r}{nearest(name, list(columns))}"
        raise RecordingError(msg)
    return columns[name]
