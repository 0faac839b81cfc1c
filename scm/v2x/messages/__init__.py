"""One message a file: `MESSAGE` is its class, named as the file; `MESSAGES` if it is sent by radio.

A radio message has two classes, as a station sends it and as another receives it.
"""

import importlib

from scm.registry import names
from scm.v2x.message import Message


def message_classes(package: str = __name__) -> list[type[Message]]:
    """Return the class of every message, in the order of their files."""
    modules = [importlib.import_module(f"{package}.{name}") for name in names(package)]
    return [
        kind
        for module in modules
        for kind in getattr(module, "MESSAGES", None) or (module.MESSAGE,)
    ]
