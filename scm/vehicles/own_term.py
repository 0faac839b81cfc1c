"""An effect of one's own: a Python file beside the car file that lists it.

`terms = [..., "carpet_nap.py"]` in a car file runs that file of the same folder, as an import
would: load only car files whose folder you trust. Inside it looks as any file of `terms/`.
"""

import hashlib
import importlib.util
import sys
from pathlib import Path

from scm.errors import ScmError, TermError, nearest, reading
from scm.vehicles.compiler.inline import function_problems
from scm.vehicles.term import Term, flat

SUFFIX = ".py"


def load_own_term(folder: Path, name: str) -> Term:
    """Return the effect of a file such as `carpet_nap.py` in this folder.

    Raises:
        TermError: when it is elsewhere, is not there, does not run, holds no effect of its name, or
            functions that cannot be inlined into a kernel.
    """
    path = (folder / name).resolve()
    if Path(name).name != name:
        msg = f"{name}: expected a file beside the car file, got a path"
        raise TermError(msg)
    if not path.is_file():
        there = [file.name for file in folder.glob(f"*{SUFFIX}")]
        msg = f"{name}: no such file in {folder.resolve()}{nearest(name, there)}"
        raise TermError(msg)
    term = getattr(_module(path), "TERM", None)
    if not isinstance(term, Term):
        msg = f"{name}: expected TERM = Term(...), got {term!r}"
        raise TermError(msg)
    if term.name != path.stem:
        msg = f"{name}: expected a function named {path.stem!r} like its file, got {term.name!r}"
        raise TermError(msg)
    pairs = ((part.function, part.damping) for part in flat([term]))
    functions = [function for pair in pairs for function in pair if function is not None]
    if problems := list(dict.fromkeys(function_problems(functions))):
        raise TermError("; ".join(problems))
    return term


def _module(path: Path) -> object:
    """Run the file once for each version; compiled functions stay with the version they are of."""
    with reading(path, "a Python file", TermError):
        state = hashlib.sha256(f"{path}\0{path.read_text(encoding='utf-8')}".encode()).hexdigest()
    name = f"scm_own_{path.stem}_{state[:12]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        msg = f"{path.name}: cannot be read as a Python file"
        raise TermError(msg)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except ScmError:
        del sys.modules[name]
        raise
    except Exception as error:  # the file is its author's: whatever it raises, say where
        del sys.modules[name]
        msg = f"{path.name}: does not run: {type(error).__name__}: {error}"
        raise TermError(msg) from error
    return module
