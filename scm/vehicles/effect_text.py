"""What the file of an effect says about it: first line, equation, and the lines with a heading."""

import inspect
from collections.abc import Callable
from typing import Any

from scm.vehicles.jit import plain

HEADINGS = ("Holds", "Shows in", "Source")


def _text(law: Callable[..., Any]) -> str:
    return inspect.getdoc(inspect.getmodule(plain(law))) or ""


def about(law: Callable[..., Any]) -> str:
    """Return the first line of the law's file: what the effect is."""
    return _text(law).partition("\n")[0]


def equation(law: Callable[..., Any]) -> str:
    """Return the indented lines of the file's docstring, joined."""
    lines = _text(law).splitlines()
    return "; ".join(line.strip() for line in lines if line.startswith("    "))


def after_heading(law: Callable[..., Any], heading: str) -> str:
    """Return what the file says after one of `HEADINGS`; empty when nothing."""
    after = _text(law).partition(f"{heading}:")[2]
    for stop in HEADINGS:
        after = after.partition(f"{stop}:")[0]
    return " ".join(after.split())
