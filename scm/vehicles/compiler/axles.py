"""Front and rear wheels get their own lines: what one axle makes plain falls away.

A rear wheel that does not steer needs no angle, no root and no turning of its forces. Nobody says
so: `front` is 1 or 0, and what follows from that number is worked out before a kernel is printed.
"""

import ast
import math
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from scm.vehicles.compiler.inline import Line, copied


class Axle(NamedTuple):
    """Two wheels: what `front` says of them, and which they are."""

    name: str
    front: float
    first: int
    stop: int


AXLES = (Axle("front", 1.0, 0, 2), Axle("rear", 0.0, 2, 4))


class Known:
    """What is a plain number for all wheels of one axle, found line by line.

    Only a name that one line of the program sets can be known; `stored` names keep their line.
    """

    def __init__(self, axle: Axle, counts: Counter[str], stored: set[str]) -> None:
        self.axle, self.counts, self.stored = axle, counts, stored
        self.numbers: dict[str, float] = {"front": axle.front}

    def fold(self, lines: Iterable[Line]) -> list[Line]:
        """Return the lines that are left of some lines for one wheel of this axle."""
        return list(self._fold(lines))

    def _fold(self, lines: Iterable[Line]) -> Iterator[Line]:
        for name, value in lines:
            left = _Fold(self.numbers).visit(copied(value))
            number = number_of(left)
            if number is not None and self.counts[name] <= 1:
                self.numbers[name] = number
                if name not in self.stored:
                    continue
            yield name, left

    def seen_from_the_body(self) -> dict[str, float]:
        """Return the numbers by the names that stages of the whole car use."""
        wheels = range(self.axle.first, self.axle.stop)
        return {f"{name}__{w}": number for name, number in self.numbers.items() for w in wheels}


def fold_body(lines: Iterable[Line], numbers: dict[str, float]) -> list[Line]:
    """Return lines of the whole car with what is known of its wheels put in."""
    return [(name, _Fold(numbers).visit(copied(value))) for name, value in lines]


def number_of(node: ast.expr) -> float | None:
    """Return a number that stands in the text, or None."""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, float) else None


class _Fold(ast.NodeTransformer):
    """Arithmetic with numbers that are known; 0 times anything is 0."""

    def __init__(self, numbers: dict[str, float]) -> None:
        self.numbers = numbers

    def visit_Name(self, node: ast.Name) -> ast.expr:
        number = self.numbers.get(node.id)
        return node if number is None else ast.Constant(number)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        self.generic_visit(node)
        number = number_of(node.operand)
        return node if number is None else ast.Constant(-number)

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        left, right = number_of(node.left), number_of(node.right)
        match node.op:
            case ast.Mult():
                return _product(node, left, right)
            case ast.Div() if left == 0.0:
                return ast.Constant(0.0)
            case ast.Div() if right == 1.0:
                return node.left
            case ast.Add() | ast.Sub():
                return _sum(node, left, right)
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        self.generic_visit(node)
        match node.test:
            case ast.Compare(
                left=ast.Constant(value=float() as left),
                ops=[ast.Gt()],
                comparators=[ast.Constant(value=float() as right)],
            ):
                return node.body if left > right else node.orelse
        return node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        number = number_of(node.args[0])
        if isinstance(node.func, ast.Name) and node.func.id == "sqrt" and number is not None:
            return ast.Constant(math.sqrt(number))
        return node


def _product(node: ast.BinOp, left: float | None, right: float | None) -> ast.expr:
    if left is not None and right is not None:
        return ast.Constant(left * right)
    if 0.0 in {left, right}:
        return ast.Constant(0.0)
    return node.right if left == 1.0 else node.left if right == 1.0 else node


def _sum(node: ast.BinOp, left: float | None, right: float | None) -> ast.expr:
    minus = isinstance(node.op, ast.Sub)
    if left is not None and right is not None:
        return ast.Constant(left - right if minus else left + right)
    if right == 0.0:
        return node.left
    if left == 0.0:
        return ast.UnaryOp(ast.USub(), node.right) if minus else node.right
    return node
