"""The only module that decorates functions with numba: scalar functions and kernels over arrays.

Only numba's public interface is used. Fast-math stays off: sums keep their order, so equal inputs
give equal bits on every run.
"""

import functools
import hashlib
import inspect
import linecache
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.extending import typeof_impl

Function = TypeVar("Function", bound=Callable[..., Any])

_numba: Any = numba  # untyped
_SOURCES: dict[Callable[..., Any], list[str]] = {}
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
_UNWRAPPED = {**_OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_COMPILED_WITH = (Path(__file__), Path(__file__).with_name("array_struct.py"))
_UNUSED_FOR_S = 24 * 3600.0  # older compiled versions of a package are deleted after a day


class _KernelFunction:
    """A function that kernels call; called from Python, it is compiled once more, with a wrapper.

    The wrapper unpacks Python objects: for a tuple of arrays it takes longer to compile than the
    function itself, and a kernel needs none.
    """

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.in_kernels: Any = _numba.njit(**_UNWRAPPED, **options)(function)

    @functools.cached_property
    def _from_python(self) -> Callable[..., Any]:
        return cast("Callable[..., Any]", _numba.njit(**_OPTIONS)(self.py_func))

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return self._from_python(*arguments, **named)

    def __reduce__(self) -> str:
        return self.py_func.__qualname__


@typeof_impl.register(_KernelFunction)
def _type_in_kernels(value: _KernelFunction, _: object) -> Any:
    return _numba.typeof(value.in_kernels)


def kernel_function(function: Function) -> Function:
    """Let a function of scalars be called from compiled kernels; plain calls work as before.

    It may take arrays and look into them; it makes and returns none.
    """
    path = function.__code__.co_filename
    linecache.checkcache(path)
    _SOURCES[function] = linecache.getlines(path)
    return cast("Function", _KernelFunction(function))


law = kernel_function  # its name in car folders written for 0.1


def inlined(function: Function) -> Function:
    """As `kernel_function`, but always inlined into its caller."""
    return cast("Function", _KernelFunction(function, forceinline=True))


def source_of(function: Callable[..., Any]) -> str:
    """Return a function's source as it stood when the function was loaded."""
    lines = _SOURCES.get(function)
    if not lines:  # typed in by hand
        return inspect.getsource(function)
    return "".join(inspect.getblock(lines[function.__code__.co_firstlineno - 1 :]))


def plain(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the Python function behind a compiled one."""
    original: Callable[..., Any] = getattr(function, "py_func", function)
    return original


def array_kernel(function: Function) -> Function:
    """Compile a function over arrays at its first call, without the interpreter lock, cached.

    What it calls may stand in any file of its folder: a change in one of them compiles it anew.
    """
    return _cached(str(version_folder(Path(function.__code__.co_filename).parent)), function)


def typed_kernel(signature: str) -> Callable[[Function], Function]:
    """Compile a kernel of a generated file now, for one signature, cached beside that file."""

    def compiled(function: Function) -> Function:
        file = Path(function.__code__.co_filename)
        delete_damaged(file.parent / "__pycache__", f"{file.stem}.*")
        return _cached("", function, signature)

    return compiled


def _cached(folder: str, function: Function, *signature: str) -> Function:
    _numba.config.CACHE_DIR = folder  # read where a function is decorated; "": beside its file
    compiled: Function = _numba.njit(*signature, **_OPTIONS, cache=True)(function)
    return compiled


@functools.cache
def version_folder(package: Path) -> Path:
    """Return the cache folder of a package folder's files as they are now.

    numba does not see changes in imported files, so each version has a folder of its own. Versions
    that no process has loaded for a day are deleted.
    """
    base = Path(os.environ.get("NUMBA_CACHE_DIR") or cache_folder())
    versions = base / f"{package.name}-{_digest(package.resolve())}"
    files = [*sorted(package.glob("*.py")), *_COMPILED_WITH]
    stats = [(path.name, path.stat()) for path in files]
    own = versions / _digest([(name, stat.st_mtime_ns, stat.st_size) for name, stat in stats])
    try:
        own.mkdir(parents=True, exist_ok=True)
        os.utime(own)
        now = own.stat().st_mtime
        for other in versions.iterdir():
            if now - other.stat().st_mtime > _UNUSED_FOR_S:
                shutil.rmtree(other, ignore_errors=True)
        delete_damaged(own)
    except OSError:
        pass  # numba falls back to the folder of the source, or the user's
    return own


def delete_damaged(folder: Path, names: str = "*") -> None:
    """Delete compiled files that were cut off, of those names, so that they are written anew.

    numba's are pickles, which end with a full stop.
    """
    for path in folder.rglob(f"{names}.nb[ic]"):
        if not path.read_bytes().endswith(b"."):
            path.unlink(missing_ok=True)


def _digest(value: object) -> str:
    return hashlib.sha256(repr(value).encode()).hexdigest()[:16]


def cache_folder() -> Path:
    """Return where generated kernels live: SCM_CACHE_DIR, else the user's XDG cache."""
    chosen = os.environ.get("SCM_CACHE_DIR")
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "scm" / "kernels"
