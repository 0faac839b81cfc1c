"""The only door to numba: laws and kernels are compiled here, and nowhere else.

Fast-math stays off: sums keep their order, so equal inputs give equal bits on every run.
"""

import ast
import inspect
import linecache
import os
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numba.extending
from llvmlite import ir
from numba.core import cgutils
from numba.core.caching import FunctionCache
from numba.core.registry import cpu_target
from numba.np import linalg

from scm.vehicles.asked_once import remember_answers
from scm.vehicles.lanes import LANES, WIDTH, Rows, copy_lanes
from scm.vehicles.nested import KernelCompiler, NestedDispatcher, nest_builtins

remember_answers()
nest_builtins()
_SOURCES: dict[Callable[..., Any], list[str]] = {}
_Matrices: Any = linalg
Function = TypeVar("Function", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
_BORROWING = {**_OPTIONS, "_nrt": False}  # arrays are the caller's: numba need not count who holds
_ROWS = "(float64[:,::1],float64[:,::1],boolean[::1],int64[::1],int64,int64,int64,float64)"
_COMMANDED_ROWS = _ROWS[:-1] + ",float64[:,::1],float64[:,::1],int64[::1],float64[:,:,::1])"


def _refuse_blas() -> None:
    """Stand for numba's search for products of matrices: no kernel has one, scipy loads slowly."""
    raise ImportError


_Matrices.ensure_blas = _refuse_blas


def law(function: Function) -> Function:
    """Let a scalar function be called from compiled kernels; plain calls work as before.

    It may take arrays and look into them; it makes and returns none.
    """
    path = function.__code__.co_filename
    linecache.checkcache(path)
    _SOURCES[function] = linecache.getlines(path)
    return cast("Function", NestedDispatcher(function, _BORROWING))


def inlined(function: Function) -> Function:
    """As `law`, but laid into its caller always."""
    return cast("Function", NestedDispatcher(function, {**_BORROWING, "forceinline": True}))


def source_of(function: Callable[..., Any]) -> str:
    """Return a law's source as it stood when the law was loaded."""
    lines = _SOURCES.get(function)
    if not lines:  # typed in by hand
        return inspect.getsource(function)
    return "".join(inspect.getblock(lines[function.__code__.co_firstlineno - 1 :]))


def array_kernel(function: Function) -> Function:
    """Compile a function over arrays at its first call, without the interpreter lock, cached.

    What it calls may stand in any file of its folder: when one of them changes it is compiled anew.
    It works on arrays that it is given; one that makes some itself is an `allocating_kernel`.
    """
    return cast("Function", _stamped(function, _BORROWING))


def allocating_kernel(function: Function) -> Function:
    """As `array_kernel`, for one that makes arrays; counting those is slow to compile."""
    return cast("Function", _stamped(function, _OPTIONS))


def _stamped(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    compiled = _cached(function, options)
    compiled._cache.stamp_folder(Path(function.__code__.co_filename).parent)  # noqa: SLF001
    return compiled


def is_kept(kernel: Callable[..., Any]) -> bool:
    """Return whether an array kernel lies compiled in the cache, from the files as they are now."""
    cache: Any = getattr(kernel, "_cache")  # noqa: B009 numba's, and no function has it
    try:
        return bool(cache._cache_file._load_index())  # noqa: SLF001
    except Exception:  # noqa: BLE001 a damaged file may raise anything
        return False


def load_compiler() -> None:
    """Load now what a first compilation would load before it begins."""
    cpu_target.typing_context.refresh()
    cpu_target.target_context.refresh()


def fleet_kernel(function: Function) -> Function:
    """Compile a kernel over fleet rows, without the interpreter lock, cached beside its file."""
    compiled = _cached(function, _OPTIONS)
    compiled.compile(_ROWS)
    return cast("Function", compiled)


def rollout_kernel(function: Function) -> Function:
    """As `fleet_kernel`, for one that is given commands, and slots to keep."""
    compiled = _cached(function, _OPTIONS)
    compiled.compile(_COMMANDED_ROWS)
    return cast("Function", compiled)


def stage(function: Function) -> Function:
    """Compile a stage of row arithmetic, `(car, wheel, w, dt, vectors)`, for use in a fleet kernel.

    Both buffers begin on a cache line; `wheel` holds four wheels of WHEEL_ROWS rows each. Of each
    row only the first `vectors` registers full are worked on.
    """
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
    lines = cast("ast.FunctionDef", tree).body
    rows = {name: v for name, v in function.__globals__.items() if isinstance(v, int)}

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        car, wheel = (
            context.make_array(kind)(context, builder, value=value).data
            for kind, value in zip(signature.args[:2], arguments, strict=False)
        )
        size = ir.Constant(arguments[2].type, LANES * rows["WHEEL_ROWS"])
        at = builder.mul(arguments[2], size)
        with cgutils.for_range(builder, arguments[4]) as loop:
            first = builder.mul(loop.index, ir.Constant(arguments[2].type, WIDTH))
            bases = {"car": builder.gep(car, [first]), "wheel": builder.gep(wheel, [first])}
            write = Rows(builder, bases, rows, {"w": at}, {"dt": arguments[3]})
            for line in lines:
                write.line(line)
        return context.get_dummy_value()

    @numba.extending.intrinsic
    def compiled(_: object, car: Any, wheel: Any, w: Any, dt: Any, vectors: Any) -> Any:
        return numba.void(car, wheel, numba.int64, numba.float64, numba.int64), code

    return cast("Function", compiled)


@numba.extending.intrinsic
def fetch(
    _: object, rows: Any, row: Any, block: Any, slot: Any, start: Any, count: Any, step: Any
) -> Any:
    """Copy the lanes from `start` of some slots of the block into rows of a buffer.

    There are `count` rows, one below the other, and `step` slots from each to the next.
    """
    return _copying(rows, block, into_block=False)


@numba.extending.intrinsic
def put(
    _: object, rows: Any, row: Any, block: Any, slot: Any, start: Any, count: Any, step: Any
) -> Any:
    """Copy rows of a buffer into the lanes from `start` of slots of the block, as `fetch` does."""
    return _copying(rows, block, into_block=True)


@numba.extending.intrinsic
def put_lane(
    _: object, rows: Any, row: Any, block: Any, slot: Any, start: Any, count: Any, step: Any,
    lane: Any,
) -> Any:  # fmt: skip
    """As `put`, of one lane alone: its neighbours in the block are left as they are."""
    return _copying(rows, block, into_block=True, one=True)


def _copying(rows: Any, block: Any, *, into_block: bool, one: bool = False) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        near, far = (
            context.make_array(signature.args[i])(context, builder, value=arguments[i])
            for i in (0, 2)
        )
        _, row, _, slot, start, count, step, *lane = arguments
        *_, width = cast("Any", cgutils).unpack_tuple(builder, far.shape)
        lanes = ir.Constant(row.type, LANES)
        with cgutils.for_range(builder, count) as loop:
            own = builder.mul(builder.add(row, loop.index), lanes)
            there = builder.add(slot, builder.mul(loop.index, step))
            other = builder.add(builder.mul(there, width), start)
            if one:
                own, other = builder.add(own, *lane), builder.add(other, *lane)
            ends = builder.gep(near.data, [own]), builder.gep(far.data, [other])
            target, source = reversed(ends) if into_block else ends
            if one:
                builder.store(builder.load(source), target)
            else:
                copy_lanes(builder, target, source)
        return context.get_dummy_value()

    places = (numba.int64,) * (4 if one else 3)
    return numba.void(rows, numba.int64, block, numba.int64, *places), code


_Cache: Any = FunctionCache


class _ForgivingCache(_Cache):  # type: ignore[misc]
    """Numba's cache; files in it that are damaged are forgotten, so that they are written anew."""

    def stamp_folder(self, folder: Path) -> None:
        """Count what was compiled from other versions of any file in a folder as out of date."""
        files = [(path.name, path.stat()) for path in sorted(folder.glob("*.py"))]
        stamp = tuple((name, stat.st_mtime, stat.st_size) for name, stat in files)
        self._cache_file._source_stamp = stamp  # noqa: SLF001 numba's own knows one file only

    def load_overload(self, sig: object, target_context: object) -> object:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # noqa: BLE001 a damaged pickle may raise anything
            self.flush()
            return None


def _cached(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    compile_later: Any = numba.njit
    options = {**options, "no_cfunc_wrapper": True, "pipeline_class": KernelCompiler}
    compiled = compile_later(**options)(function)
    compiled._cache = _ForgivingCache(function)  # noqa: SLF001 as its own enable_caching does
    return compiled


def plain(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the Python function behind a compiled one."""
    original: Callable[..., Any] = getattr(function, "py_func", function)
    return original


def cache_folder() -> Path:
    """Return where generated kernels live: SCM_CACHE_DIR, else the user's XDG cache."""
    chosen = os.environ.get("SCM_CACHE_DIR")
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "scm" / "kernels"
