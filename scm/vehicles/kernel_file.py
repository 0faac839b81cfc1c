"""A kernel's text becomes a file in the cache folder, and that file a compiled function.

The file's name holds a hash of every source behind it, because numba's cache does not see
imported files change. Several processes may do this at the same time.
"""

import hashlib
import importlib.util
import inspect
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from scm.errors import RunError, TermError
from scm.vehicles import body14, jit, tyre_curve
from scm.vehicles.assemble import write_page
from scm.vehicles.term import Term

Advance = Callable[..., None]


def compile_kernel(car_name: str, terms: Sequence[Term]) -> Advance:
    """Return the compiled kernel of a list of terms, from the cache where nothing has changed."""
    text = write_page(car_name, terms)
    modules = {sys.modules[term.module] for term in terms} | {body14, jit, tyre_curve}
    sources = sorted(inspect.getsource(module) for module in modules)
    digest = hashlib.sha256("\0".join([text, *sources]).encode()).hexdigest()[:16]
    name = f"scm_kernel_{digest}"
    if name not in sys.modules:
        path = _keep(jit.cache_folder() / f"{name}.py", text)
        spec = importlib.util.spec_from_file_location(name, path)
        if spec is None or spec.loader is None:
            msg = f"{path}: cannot be read as a Python file"
            raise TermError(msg)
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module  # numba can only cache functions of a module that is known
        spec.loader.exec_module(module)
    advance: Advance = sys.modules[name].advance
    return advance


def _keep(path: Path, text: str) -> Path:
    """Write the file unless it is there; several processes may do so at once."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            _write(path, text)
    except OSError as error:
        msg = f"{path.parent}: compiled cars cannot be kept here ({error.strerror}); "
        raise RunError(msg + "set SCM_CACHE_DIR to a folder that can be written") from error
    return path


def _write(path: Path, text: str) -> None:
    with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".tmp", delete=False) as file:
        file.write(text)
    # numba asks the file for its time: the same one for every writer keeps the cache good
    os.utime(file.name, (0, 0))
    Path(file.name).replace(path)
