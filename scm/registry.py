"""Plug-ins by file: one module in a folder is one plug-in, named after its file."""

import importlib
import pkgutil
import sys
from typing import TypeVar

from scm.errors import ScmError, TermError, nearest

T = TypeVar("T")


def names(package: str) -> list[str]:
    """Return the plug-in names of a package, sorted, without importing the plug-ins."""
    paths = importlib.import_module(package).__path__
    return sorted(module.name for module in pkgutil.iter_modules(paths))


def load(
    package: str, name: str, constant: str, kind: type[T], error: type[ScmError] = TermError
) -> T:
    """Import one plug-in module and return its constant.

    Raises:
        ScmError: (as `error`) when there is no such module or its constant is of another type.
    """
    module = sys.modules.get(f"{package}.{name}")
    if module is None:
        known = names(package)
        if name not in known:
            hint = nearest(name, known) or f"; there are {', '.join(known)}"
            msg = f"{package}: no {constant.lower()} named {name!r}{hint}"
            raise error(msg)
        module = importlib.import_module(f"{package}.{name}")
    plugin = getattr(module, constant, None)
    if not isinstance(plugin, kind):
        msg = f"{package}.{name}: expected {constant} = {kind.__name__}(...), got {plugin!r}"
        raise error(msg)
    return plugin
