"""Functions become lines: a call of a function is replaced by the lines of its source.

Such a function is straight-line text: assignments and one return, of arithmetic, comparisons,
selects (`a if c else b`), abs, min, max, math.sqrt, math.floor, math.copysign and other such
functions. So it means the same for one car as in every lane of a tile.
"""

import ast
import math
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import CodeType
from typing import Any, TypeVar, cast

from scm.errors import TermError, nearest
from scm.vehicles.jit import plain, source_of

Line = tuple[str, ast.expr]  # a name, and what it is
Functions = Mapping[str, Callable[..., Any]]
_Node = TypeVar("_Node", bound=ast.AST)

_OPERATORS = (
    ast.BinOp, ast.UnaryOp, ast.Compare, ast.IfExp, ast.Name, ast.Constant, ast.Call, ast.Attribute,
    ast.Add, ast.Sub, ast.Mult, ast.Div, ast.USub, ast.BitAnd, ast.BitOr, ast.Load, ast.Gt, ast.Lt,
    ast.GtE, ast.LtE, ast.Eq, ast.NotEq,
)  # fmt: skip
_BUILT_IN = {"abs": 1, "min": 2, "max": 2, "float": 1}
_MATH = {"sqrt": 1, "floor": 1, "copysign": 2}
_STRAIGHT = (
    "straight-line text, assignments and one return, of + - * /, one comparison at a time, "
    "`a if c else b`, abs, min and max of two, math.sqrt, math.floor, math.copysign, functions "
    "(see lane_math)"
)


def copied(node: _Node) -> _Node:
    """Return a copy of a tree; `copy.deepcopy` does the same at a fifth of the speed."""
    if not node._fields:
        return node  # an operator holds nothing
    new = type(node)()
    for name, part in vars(node).items():
        if isinstance(part, ast.AST):
            part = copied(part)  # noqa: PLW2901
        elif isinstance(part, list):
            part = [copied(one) if isinstance(one, ast.AST) else one for one in part]  # noqa: PLW2901
        setattr(new, name, part)
    return new


class Inliner:
    """Turns text into lines of built-in arithmetic; names of a function's variables stay unique."""

    def __init__(self, used: Iterable[str]) -> None:
        self._used = set(used)

    def lines(self, text: str, functions: Functions) -> Iterator[Line]:
        """Return the lines of some statements; `functions` are the functions they may call."""
        for statement in ast.parse(textwrap.dedent(text)).body:
            yield from _Body("the page", functions, {}, self, None).statement(statement)

    def call(self, function: Callable[..., Any], arguments: list[ast.expr]) -> list[Line]:
        """Return the lines of a function's body; the last ones are its results, all named ""."""
        source = plain(function)
        tree = copied(_tree(source))
        names = [argument.arg for argument in tree.args.args]
        if len(names) != len(arguments):
            msg = f"function {tree.name}: expected {len(names)} arguments, got {len(arguments)}"
            raise TermError(msg)
        lines: list[Line] = []
        given: dict[str, ast.expr] = {}
        for name, value in zip(names, arguments, strict=True):
            if isinstance(value, ast.Name | ast.Constant):
                given[name] = value
            else:
                lines.append((self.name(f"{tree.name}_{name}"), value))
                given[name] = ast.Name(lines[-1][0])
        body = _Body(tree.name, source.__globals__, given, self, source.__code__)
        for statement in tree.body:
            lines += body.statement(statement)
        return lines

    def name(self, wanted: str) -> str:
        """Return a name that no other line has."""
        name, k = wanted, 2
        while name in self._used:
            name, k = f"{wanted}{k}", k + 1
        self._used.add(name)
        return name


class _Body(ast.NodeTransformer):
    """One function at work: `known` says what each of its names means outside.

    Text without a `code` is the skeleton's own: its names stay as they are.
    """

    def __init__(
        self, where: str, scope: Mapping[str, Any], known: dict[str, ast.expr], inliner: Inliner,
        code: CodeType | None,
    ) -> None:  # fmt: skip
        self.where, self.scope, self.known, self.inliner = where, scope, known, inliner
        self.code, self.line = code, 1
        self.before: list[Line] = []

    def statement(self, node: ast.stmt) -> list[Line]:
        self.before, self.line = [], node.lineno
        match node:
            case ast.Expr(value=ast.Constant()):
                return []
            case ast.Return(value=ast.Tuple(elts=values)):
                results = [self.visit(value) for value in values]
                return [*self.before, *(("", result) for result in results)]
            case ast.Return(value=ast.expr() as value):
                result = self.visit(value)
                return [*self.before, ("", result)]
            case ast.AugAssign(target=ast.Name(id=name), op=op, value=value):
                targets, values = [name], [ast.BinOp(ast.Name(name), op, value)]
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                targets, values = [name], [value]
            case ast.Assign(targets=[ast.Tuple(elts=left)], value=ast.Tuple(elts=values)):
                targets = [ast.unparse(target) for target in left]
            case ast.Assign(targets=[ast.Tuple(elts=left)], value=ast.Call() as value):
                targets = [ast.unparse(target) for target in left]
                return self._named(targets, self._results(value))
            case _:
                raise self._refuse(node)
        return self._named(targets, [self.visit(value) for value in values])

    def _named(self, targets: list[str], values: list[ast.expr]) -> list[Line]:
        names = targets
        if self.code is not None:
            names = [self.inliner.name(f"{self.where}_{target}") for target in targets]
            self.known.update({t: ast.Name(n) for t, n in zip(targets, names, strict=True)})
        return [*self.before, *zip(names, values, strict=True)]

    def _results(self, node: ast.Call) -> list[ast.expr]:
        function = self.scope.get(node.func.id) if isinstance(node.func, ast.Name) else None
        if function is None or not hasattr(function, "py_func") or node.keywords:
            raise self._refuse(node)
        wanted = len(_tree(plain(function)).args.args)
        if len(node.args) != wanted:
            raise self._refuse(node, f"{wanted} arguments")
        lines = self.inliner.call(function, [self.visit(argument) for argument in node.args])
        self.before += [line for line in lines if line[0]]
        return [value for name, value in lines if not name]

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id in self.known:
            return self.known[node.id]
        value = self.scope.get(node.id)
        if isinstance(value, int | float):
            return ast.Constant(float(value))
        if self.code is not None:
            hint = nearest(node.id, list(self.known))
            raise self._refuse(node, f"an argument or a name given before{hint}")
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        if isinstance(node.value, int | float) and not isinstance(node.value, bool):
            return ast.Constant(float(node.value))
        raise self._refuse(node, "a number")

    def visit_Call(self, node: ast.Call) -> ast.expr:
        match node.func:
            case ast.Name(id="float"):
                return cast("ast.expr", self.visit(node.args[0]))
            case ast.Name(id=name) if name in _BUILT_IN:
                wanted = _BUILT_IN[name]
            case ast.Attribute(value=ast.Name(id="math"), attr=name) if name in _MATH:
                wanted = _MATH[name]
            case _:
                results = self._results(node)
                if len(results) != 1:
                    raise self._refuse(node, f"{len(results)} names to take its results")
                return results[0]
        if len(node.args) != wanted or node.keywords:
            raise self._refuse(node)
        return ast.Call(ast.Name(name), [self.visit(argument) for argument in node.args], [])

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        match ast.unparse(node).split("."):
            case ["math", name] if isinstance(number := getattr(math, name, None), float):
                return ast.Constant(number)
        raise self._refuse(node)

    def generic_visit(self, node: ast.AST) -> ast.AST:
        if (
            not isinstance(node, _OPERATORS)
            or (isinstance(node, ast.Compare) and len(node.ops) > 1)
            or (isinstance(node, ast.BinOp | ast.UnaryOp) and not isinstance(node.op, _OPERATORS))
        ):
            raise self._refuse(node)
        return super().generic_visit(node)

    def _refuse(self, node: ast.AST, expected: str = _STRAIGHT) -> TermError:
        got = (ast.unparse(node) or type(node).__name__).splitlines()[0]
        at = (
            f"{self.code.co_filename}:{self.code.co_firstlineno + self.line - 1}: "
            if self.code
            else ""
        )
        return TermError(f"{at}function {self.where}: expected {expected}, got {got!r}")


def function_problems(functions: Iterable[Callable[..., Any]]) -> Iterator[str]:
    """Yield what keeps functions from being inlined into a kernel, the first problem of each."""
    for function in functions:
        arguments = [ast.Name(argument.arg) for argument in _tree(plain(function)).args.args]
        try:
            Inliner(()).call(function, list[ast.expr](arguments))
        except TermError as error:
            yield str(error)


_trees: dict[Callable[..., Any], ast.FunctionDef] = {}


def _tree(function: Callable[..., Any]) -> ast.FunctionDef:
    if function not in _trees:
        node = ast.parse(textwrap.dedent(source_of(function))).body[0]
        if not isinstance(node, ast.FunctionDef):
            msg = f"{function.__name__}: expected the source of a function"
            raise TermError(msg)
        _trees[function] = node
    return _trees[function]
