"""Parse an effect's docstring: first line, equation, and the paragraphs with a heading."""

import inspect
from collections.abc import Callable
from typing import Any

from scm.vehicles.jit import plain

HEADINGS = ("Holds", "Shows in", "Source")


def _text(function: Callable[..., Any]) -> str:
    return inspect.getdoc(inspect.getmodule(plain(function))) or ""


def about(function: Callable[..., Any]) -> str:
    """Return what the effect is: the first line of its file."""
    return _text(function).partition("\n")[0]


def equation(function: Callable[..., Any]) -> str:
    """Return the indented lines of the file's docstring, joined."""
    lines = _text(function).splitlines()
    return "; ".join(line.strip() for line in lines if line.startswith("    "))


def after_heading(function: Callable[..., Any], heading: str) -> str:
    """Return the file's text after one of `HEADINGS`, or an empty string."""
    after = _text(function).partition(f"{heading}:")[2]
    for stop in HEADINGS:
        after = after.partition(f"{stop}:")[0]
    return " ".join(after.split())
