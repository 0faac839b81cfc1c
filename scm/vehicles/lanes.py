"""Row arithmetic becomes vector instructions: one line for eight cars at once.

A stage of a generated kernel is a function of two buffers, `car[ROW]` and `wheel[w, ROW]`, of
straight-line text. As it stands NumPy can run it; here each of its operations becomes one LLVM
vector operation. So nothing depends on whether a compiler finds out that a loop may be vectorised,
and the result of a lane does not depend on its neighbours.
"""

import ast
from collections.abc import Mapping
from typing import Any, cast

from llvmlite import ir
from numba.core import cgutils

from scm.errors import TermError

LANES = 16  # cars of a tile, the length of a row
WIDTH = 8  # cars of one vector: a register of 512 bits, or two of 256

_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_ARITHMETIC = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
_COMPARES = {
    ast.Lt: "<", ast.Gt: ">", ast.LtE: "<=", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
_INTRINSICS = {"sqrt": "llvm.sqrt", "floor": "llvm.floor", "abs": "llvm.fabs",
               "copysign": "llvm.copysign"}  # fmt: skip


class Rows:
    """Writes a stage's lines for the lanes that begin at `first`, into an LLVM function."""

    def __init__(
        self, builder: Any, bases: Mapping[str, Any], rows: Mapping[str, int],
        strides: Mapping[str, Any], scalars: Mapping[str, Any],
    ) -> None:  # fmt: skip
        self.builder, self.bases, self.rows, self.strides = builder, bases, rows, strides
        self.flags: tuple[str, ...] = ()
        self.names: dict[str, Any] = {name: self._splat(v) for name, v in scalars.items()}

    def line(self, line: ast.stmt) -> None:
        """Write one line: a name gets a value, or a row is stored."""
        match line:
            case ast.Expr(value=ast.Constant(value=mode)):
                self.flags = ("contract",) if mode == "skeleton" else ()
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                self.names[name] = self.value(value)
            case ast.Assign(targets=[ast.Subscript() as place], value=value):
                self.builder.store(self.value(value), self._address(place), align=64)
            case _:
                msg = f"{ast.unparse(line)!r} is not row arithmetic"
                raise TermError(msg)

    def value(self, node: ast.expr) -> Any:  # noqa: PLR0911 one for each kind of expression
        """Write an expression; return its vector."""
        match node:
            case ast.Name(id=name):
                return self.names[name]
            case ast.Constant(value=float() as number):
                return ir.Constant(_VECTOR, [number] * WIDTH)
            case ast.Subscript():
                return self.builder.load(self._address(node), align=64)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self.builder.fneg(self.value(operand))
            case ast.BinOp(left=left, op=ast.BitAnd(), right=right):
                return self.builder.and_(self.value(left), self.value(right))
            case ast.BinOp(left=left, op=ast.BitOr(), right=right):
                return self.builder.or_(self.value(left), self.value(right))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _ARITHMETIC:
                write = getattr(self.builder, _ARITHMETIC[type(op)])
                return write(self.value(left), self.value(right), flags=self.flags)
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                return self._compare(_COMPARES[type(op)], self.value(left), self.value(right))
            case ast.Call(func=function, args=arguments):
                name = ast.unparse(function).rpartition(".")[2]
                return self._call(name, [self.value(argument) for argument in arguments])
        msg = f"{ast.unparse(node)!r} is not row arithmetic"
        raise TermError(msg)

    def _call(self, name: str, values: list[Any]) -> Any:
        match name, values:
            case "where", [condition, yes, no]:
                return self.builder.select(condition, yes, no)
            case "minimum", [a, b]:
                return self.builder.select(self._compare("<", b, a), b, a)
            case "maximum", [a, b]:
                return self.builder.select(self._compare(">", b, a), b, a)
            case _ if name in _INTRINSICS:
                kind = ir.FunctionType(_VECTOR, [_VECTOR] * len(values))
                full = f"{_INTRINSICS[name]}.v{WIDTH}f64"
                module: Any = self.builder.module
                function = cast("Any", cgutils).insert_pure_function(module, kind, full)
                return self.builder.call(function, values)
        msg = f"{name} is not row arithmetic"
        raise TermError(msg)

    def _compare(self, how: str, left: Any, right: Any) -> Any:
        compare = self.builder.fcmp_unordered if how == "!=" else self.builder.fcmp_ordered
        return compare(how, left, right)

    def _address(self, place: ast.Subscript) -> Any:
        base, lanes = self.bases[ast.unparse(place.value)], ir.IntType(64)
        match place.slice:
            case ast.Name(id=row):
                offset = ir.Constant(lanes, LANES * self.rows[row])
            case ast.Tuple(elts=[ast.Constant(value=int() as wheel), ast.Name(id=row)]):
                offset = ir.Constant(
                    lanes, LANES * (wheel * self.rows["WHEEL_ROWS"] + self.rows[row])
                )
            case ast.Tuple(elts=[ast.Name(id="w"), ast.Name(id=row)]):
                own = ir.Constant(lanes, LANES * self.rows[row])
                offset = self.builder.add(own, self.strides["w"])
            case _:
                msg = f"{ast.unparse(place)!r} is not a row"
                raise TermError(msg)
        return _pointer(self.builder, base, [offset])

    def _splat(self, scalar: Any) -> Any:
        one = self.builder.insert_element(
            ir.Constant(_VECTOR, ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0)
        )
        mask = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
        return self.builder.shuffle_vector(one, ir.Constant(_VECTOR, ir.Undefined), mask)


def copy_lanes(builder: Any, target: Any, source: Any) -> None:
    """Copy one row of lanes between two places."""
    for k in range(LANES // WIDTH):
        at = [ir.Constant(ir.IntType(64), k * WIDTH)]
        vector = builder.load(_pointer(builder, source, at), align=8)
        builder.store(vector, _pointer(builder, target, at), align=8)


def _pointer(builder: Any, base: Any, at: list[Any]) -> Any:
    return builder.bitcast(builder.gep(base, at), _VECTOR.as_pointer())
