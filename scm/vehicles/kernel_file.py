"""A kernel's text becomes a file in the cache folder, and that file a compiled function.

The file's name holds a hash of all code behind it, because numba's cache does not see imported
files change. Several processes may do this at the same time, also while files are being edited:
what counts is the code that this process has loaded. Damaged files are written anew.
"""

import hashlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

from scm.errors import RunError, TermError
from scm.vehicles import body14, jit
from scm.vehicles.assemble import write_page
from scm.vehicles.term import Term

Advance = Callable[..., None]


def compile_kernel(car_name: str, terms: Sequence[Term]) -> Advance:
    """Return the compiled kernel of a list of terms, from the cache where nothing has changed."""
    text = write_page(car_name, terms)
    laws = [law for term in terms for law in (term.law, term.damping) if law]
    seen: set[FunctionType] = set()
    parts = [part for f in (*laws, *_functions(body14, jit)) for part in _loaded(f, seen)]
    digest = hashlib.sha256("\0".join([text, *sorted(parts)]).encode()).hexdigest()[:16]
    name = f"scm_kernel_{digest}"
    if name not in sys.modules:
        path = _keep(jit.cache_folder() / f"{name}.py", text)
        spec = importlib.util.spec_from_file_location(name, path)
        if spec is None or spec.loader is None:
            msg = f"{path}: cannot be read as a Python file"
            raise TermError(msg)
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module  # numba can only cache functions of a module that is known
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise
    advance: Advance = sys.modules[name].advance
    return advance


def _functions(*modules: object) -> Iterator[Callable[..., object]]:
    for module in modules:
        for value in vars(module).values():
            if isinstance(jit.plain(value), FunctionType):
                yield value


def _loaded(function: Callable[..., object], seen: set[FunctionType]) -> Iterator[str]:
    """Describe what a function compiles to: its code, the constants it names, whom it calls."""
    known = jit.plain(function)
    if not isinstance(known, FunctionType) or known in seen:
        return
    seen.add(known)
    code = known.__code__
    constants = [c.co_code if isinstance(c, CodeType) else c for c in code.co_consts]
    yield repr((known.__module__, known.__qualname__, code.co_code, code.co_varnames,
                code.co_names, constants))  # fmt: skip
    for name in code.co_names:
        value: Any = known.__globals__.get(name)
        if isinstance(value, int | float):
            yield f"{known.__module__}.{name} = {value!r}"
        elif value is not function and hasattr(value, "py_func"):
            yield from _loaded(value, seen)


def _keep(path: Path, text: str) -> Path:
    """Write the file unless it is there and whole; several processes may do so at once."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_bytes() != text.encode():
            _write(path, text)
    except OSError as error:
        msg = f"{path.parent}: compiled cars cannot be kept here ({error.strerror}); "
        raise RunError(msg + "set SCM_CACHE_DIR to a folder that can be written") from error
    return path


def _write(path: Path, text: str) -> None:
    with tempfile.NamedTemporaryFile(
        "w", dir=path.parent, suffix=".tmp", delete=False, encoding="utf-8"
    ) as file:
        file.write(text)
    # numba asks the file for its time: the same one for every writer keeps the cache good
    os.utime(file.name, (0, 0))
    Path(file.name).replace(path)
