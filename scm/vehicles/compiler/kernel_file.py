"""A kernel's text becomes a file in the cache folder, and that file a compiled function.

The file holds all laws of the car; its name holds a hash of it and of the machine that reads it,
because numba's cache does not see imported files change. Several processes may do this at the same
time, also while files are being edited: what counts is the code that this process has loaded.
Damaged files are written anew.
"""

import hashlib
import importlib.util
import inspect
import os
import sys
import tempfile
from collections.abc import Hashable, Sequence
from pathlib import Path
from typing import Any

from scm.errors import RunError, TermError
from scm.vehicles import jit
from scm.vehicles.compiler import vector_code
from scm.vehicles.compiler.assemble import write_page
from scm.vehicles.term import Term

# what turns a kernel's text into code, as this process has loaded it
_MACHINE = "".join(inspect.getsource(module) for module in (jit, vector_code))


# Writing a page takes longer than most drives; the terms are kept so that their ids stay theirs.
_COMPILED: dict[tuple[Hashable, ...], tuple[Any, tuple[Term, ...]]] = {}


def compile_kernel(terms: Sequence[Term], *, plain: bool = False) -> Any:
    """Return a module with the compiled kernel of a list of terms: `advance` and `rollout`.

    It comes from the cache where nothing has changed. `plain` gives the reference that goes car by
    car, `advance` only.
    """
    key = (plain, jit.cache_folder(), *map(id, terms))
    if key not in _COMPILED:
        _COMPILED[key] = _compile(write_page(terms, plain=plain)), tuple(terms)
    return _COMPILED[key][0]


def _compile(text: str) -> Any:
    digest = hashlib.sha256("\0".join([text, _MACHINE]).encode()).hexdigest()[:16]
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
    return sys.modules[name]


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
