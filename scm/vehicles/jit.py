"""The only door to numba: laws and kernels are compiled here, and nowhere else.

Fast-math stays off: sums keep their order, so equal inputs give equal bits on every run.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache

Function = TypeVar("Function", bound=Callable[..., Any])

_ROWS = "(float64[:,::1],float64[:,::1],boolean[::1],int64[::1],int64,int64,int64,float64)"


def law(function: Function) -> Function:
    """Let a scalar function be called from compiled kernels; plain calls work as before."""
    return cast("Function", numba.njit(nogil=True, error_model="numpy")(function))


def array_kernel(function: Function) -> Function:
    """Compile a function over arrays at its first call, without the interpreter lock, cached.

    What it calls may stand in any file of its folder: when one of them changes it is compiled anew.
    """
    compiled = _cached(function)
    compiled._cache.stamp_folder(Path(function.__code__.co_filename).parent)  # noqa: SLF001
    return cast("Function", compiled)


def fleet_kernel(function: Function) -> Function:
    """Compile a kernel over fleet rows, without the interpreter lock, cached beside its file."""
    compiled = _cached(function)
    compiled.compile(_ROWS)
    return cast("Function", compiled)


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


def _cached(function: Callable[..., Any]) -> Any:
    compiled: Any = numba.njit(nogil=True, error_model="numpy")(function)
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
