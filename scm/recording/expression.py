"""Formulas over the columns of a table: arithmetic, comparisons, and, or, not, some functions.

The functions are `abs`, `sqrt`, `sin`, `cos`, `tan`, `atan`, `atan2(y, x)`, `min(a, b)` and
`max(a, b)`; angles are in rad. `row` counts the rows of the file from 0.
A text column can be compared with a word: "source == 'pose'". A column name that is not a plain
word is written in backquotes: "`elapsed time` > 0 and gas > 0.1"; fields of messages need none:
"2 * pose.position.x + axes[1]".
Undefined results (1 / 0) are not finite, and such rows are left out.
"""

import ast
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError
from scm.recording.columns import Columns

Table = Columns | Mapping[str, Floats]

LONGEST = 1000
SHOWN = 40  # characters of an expression that is refused for its size
DEEPEST = 100  # levels: each costs Python some of its stack

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
    "min": (2, np.minimum),
    "max": (2, np.maximum),
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
    tree, quoted = _parsed(text, where)
    with np.errstate(all="ignore"):
        value = _value(tree, columns, quoted, f"{where}: {text!r}")
    return np.broadcast_to(np.asarray(value, dtype=np.float64), (rows,)).copy()


def columns_of(text: str, where: str) -> set[str]:
    """Return the names of the columns that an expression asks for.

    Raises:
        RecordingError: when it is no expression.
    """
    tree, quoted = _parsed(text, where)
    nodes, found = [tree], set[str]()
    while nodes:
        node = nodes.pop()
        name = _name(node, quoted)
        if name is not None:
            found.add(name)
            continue
        parts = node.args if isinstance(node, ast.Call) else ast.iter_child_nodes(node)
        nodes += [part for part in parts if isinstance(part, ast.expr)]
    return found


def _parsed(text: str, where: str) -> tuple[ast.expr, dict[str, str]]:
    """Return an expression's tree, and what its stand-ins for names in backquotes stand for."""
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
    if _is_deeper(tree.body, DEEPEST):
        start = text if len(text) <= SHOWN else f"{text[:SHOWN]}..."
        msg = (
            f"{where}: {start!r} is nested more than {DEEPEST} levels deep (signs, brackets, terms "
            f"of a sum); expected at most {DEEPEST}: split it over columns of the table"
        )
        raise RecordingError(msg)
    return tree.body, quoted


def _is_deeper(tree: ast.expr, most: int) -> bool:
    """Return whether a tree has more levels; level by level, so that no depth can break it."""
    level: list[ast.AST] = [tree]
    for _ in range(most):
        parts = (part for node in level for part in ast.iter_child_nodes(node))
        level = [part for part in parts if isinstance(part, ast.expr)]
        if not level:
            return False
    return True


def _name(node: ast.AST, quoted: dict[str, str]) -> str | None:
    """Return the name of the column that a node is: `a`, `a.b` or `a[0].b`; else None."""
    match node:
        case ast.Name(id=name):
            return quoted.get(name, name)
        case ast.Attribute(value=whole, attr=field):
            start, end = _name(whole, quoted), f".{field}"
        case ast.Subscript(value=whole, slice=ast.Constant(value=int() as number)):
            start, end = _name(whole, quoted), f"[{number}]"
        case _:
            return None
    return None if start is None else start + end


def _value(node: ast.expr, columns: Table, quoted: dict[str, str], at: str) -> Any:
    """Return the value of one node: an array, or a number."""

    def values(*nodes: ast.expr) -> list[Any]:
        return [_value(part, columns, quoted, at) for part in nodes]

    match node:
        case ast.Constant(value=int() | float()) | ast.Name() | ast.Attribute() | ast.Subscript():
            return _leaf(node, columns, quoted, at)
        case ast.Compare(left=left, ops=[ast.Eq() | ast.NotEq() as op]) if isinstance(
            word := getattr(node.comparators[0], "value", None), str
        ) and (name := _name(left, quoted)):
            return _compared_with(word, op, name, columns, at)
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


def _leaf(node: ast.expr, columns: Table, quoted: dict[str, str], at: str) -> Any:
    """Return a number, or a column's numbers; an attribute of anything else is refused."""
    if isinstance(node, ast.Constant):
        return _constant(node.value)  # type: ignore[arg-type]
    name = _name(node, quoted)
    if name is None:
        raise _refusal(node, at)
    return _column(name, columns, at)


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
    raise _refusal(node, at)


def _refusal(node: ast.expr, at: str) -> RecordingError:
    known = ", ".join(_FUNCTIONS)
    msg = f"{at}: {ast.unparse(node)!r} is not arithmetic, a comparison, and, or, not, {known}"
    return RecordingError(msg)


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
