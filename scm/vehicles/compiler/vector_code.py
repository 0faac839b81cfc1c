"""Row arithmetic becomes vector instructions: one line for eight cars at once.

A stage of a generated kernel is a function of two buffers, `car[ROW]` and `wheel[w, ROW]`, of
straight-line text. As it stands NumPy can run it; here each of its operations becomes one LLVM
vector operation. So nothing depends on whether a compiler finds out that a loop may be vectorised,
and the result of a lane does not depend on its neighbours.

Buffers are passed by address (`array.ctypes.data`), so that only LLVM's own types are needed here.
"""

import ast
import inspect
import textwrap
from collections.abc import Callable, Mapping
from typing import Any, TypeVar, cast

import numba
from llvmlite import ir
from numba.extending import intrinsic

from scm.errors import TermError

LANES = 16  # cars of a tile, the length of a row
WIDTH = 8  # cars of one vector: a register of 512 bits, or two of 256

Function = TypeVar("Function", bound=Callable[..., Any])

_DOUBLE, _INTEGER = ir.DoubleType(), ir.IntType(64)
_VECTOR = ir.VectorType(_DOUBLE, WIDTH)
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
        offsets: Mapping[str, Any], scalars: Mapping[str, Any],
    ) -> None:  # fmt: skip
        self.builder, self.bases, self.rows, self.offsets = builder, bases, rows, offsets
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
                function = module.globals.get(full) or ir.Function(module, kind, full)
                return self.builder.call(function, values)
        msg = f"{name} is not row arithmetic"
        raise TermError(msg)

    def _compare(self, how: str, left: Any, right: Any) -> Any:
        compare = self.builder.fcmp_unordered if how == "!=" else self.builder.fcmp_ordered
        return compare(how, left, right)

    def _address(self, place: ast.Subscript) -> Any:
        base = self.bases[ast.unparse(place.value)]
        match place.slice:
            case ast.Name(id=row):
                offset = _number(LANES * self.rows[row])
            case ast.Tuple(elts=[ast.Constant(value=int() as wheel), ast.Name(id=row)]):
                offset = _number(LANES * (wheel * self.rows["WHEEL_ROWS"] + self.rows[row]))
            case ast.Tuple(elts=[ast.Name(id="w"), ast.Name(id=row)]):
                own = _number(LANES * self.rows[row])
                offset = self.builder.add(own, self.offsets["w"])
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


def stage(function: Function) -> Function:
    """Compile a stage of row arithmetic, `(car, wheel, w, dt, vectors)`, for use in a fleet kernel.

    Kernels pass the addresses of both buffers, which begin on a cache line; `wheel` holds four
    wheels of WHEEL_ROWS rows each. Of each row only the first `vectors` registers are worked on.
    """
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
    lines = cast("ast.FunctionDef", tree).body
    rows = {name: v for name, v in function.__globals__.items() if isinstance(v, int)}

    def code(_context: object, builder: Any, _signature: object, arguments: Any) -> Any:
        car_at, wheel_at, w, dt, vectors = arguments
        car, wheel = (builder.inttoptr(at, _DOUBLE.as_pointer()) for at in (car_at, wheel_at))
        at = builder.mul(w, _number(LANES * rows["WHEEL_ROWS"]))

        def one_vector(index: Any) -> None:
            first = builder.mul(index, _number(WIDTH))
            bases = {"car": builder.gep(car, [first]), "wheel": builder.gep(wheel, [first])}
            write = Rows(builder, bases, rows, {"w": at}, {"dt": dt})
            for line in lines:
                write.line(line)

        _loop(builder, vectors, one_vector)
        return _number(0)

    @intrinsic
    def compiled(_: object, car: Any, wheel: Any, w: Any, dt: Any, vectors: Any) -> Any:
        return numba.int64(numba.uintp, numba.uintp, numba.int64, numba.float64, numba.int64), code

    return cast("Function", compiled)


@intrinsic
def fetch(
    _: object, rows: Any, row: Any, block: Any, width: Any, index: Any, start: Any, count: Any,
    step: Any,
) -> Any:  # fmt: skip
    """Copy the lanes from `start` of some rows of the block into rows of a buffer.

    Both are given by address; a row of the block is `width` long. There are `count` rows, from
    `row` on, and `step` rows of the block, from `index` on, from each to the next.
    """
    return _copying(into_block=False)


@intrinsic
def put(
    _: object, rows: Any, row: Any, block: Any, width: Any, index: Any, start: Any, count: Any,
    step: Any,
) -> Any:  # fmt: skip
    """Copy rows of a buffer into the lanes from `start` of rows of the block, as `fetch` does."""
    return _copying(into_block=True)


@intrinsic
def put_lane(
    _: object, rows: Any, row: Any, block: Any, width: Any, index: Any, start: Any, count: Any,
    step: Any, lane: Any,
) -> Any:  # fmt: skip
    """As `put`, of one lane alone: its neighbours in the block are left as they are."""
    return _copying(into_block=True, one=True)


def _copying(*, into_block: bool, one: bool = False) -> Any:
    def code(_context: object, builder: Any, _signature: object, arguments: Any) -> Any:
        rows_at, row, block_at, width, index, start, count, step, *lane = arguments
        rows, block = (builder.inttoptr(at, _DOUBLE.as_pointer()) for at in (rows_at, block_at))

        def one_row(k: Any) -> None:
            own = builder.mul(builder.add(row, k), _number(LANES))
            there = builder.add(index, builder.mul(k, step))
            other = builder.add(builder.mul(there, width), start)
            if one:
                own, other = builder.add(own, *lane), builder.add(other, *lane)
            ends = builder.gep(rows, [own]), builder.gep(block, [other])
            target, source = reversed(ends) if into_block else ends
            if one:
                builder.store(builder.load(source), target)
                return
            for at in ([_number(k)] for k in range(0, LANES, WIDTH)):
                vector = builder.load(_pointer(builder, source, at), align=8)
                builder.store(vector, _pointer(builder, target, at), align=8)

        _loop(builder, count, one_row)
        return _number(0)

    places = (numba.int64,) * (6 if one else 5)
    return numba.int64(numba.uintp, numba.int64, numba.uintp, numba.int64, *places), code


def _loop(builder: Any, count: Any, write: Callable[[Any], None]) -> None:
    """Write a loop: `write` gets the index, from 0 to count - 1."""
    before = builder.block
    head, inside, after = (builder.append_basic_block(name) for name in ("head", "in", "after"))
    builder.branch(head)
    builder.position_at_end(head)
    index = builder.phi(_INTEGER)
    index.add_incoming(_number(0), before)
    builder.cbranch(builder.icmp_signed("<", index, count), inside, after)
    builder.position_at_end(inside)
    write(index)
    index.add_incoming(builder.add(index, _number(1)), builder.block)
    builder.branch(head)
    builder.position_at_end(after)


def _number(value: int) -> Any:
    return ir.Constant(_INTEGER, value)


def _pointer(builder: Any, base: Any, at: list[Any]) -> Any:
    return builder.bitcast(builder.gep(base, at), _VECTOR.as_pointer())
