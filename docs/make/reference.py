"""Sphinx directives that write the reference pages from the code."""

import argparse
import importlib
import inspect
import re
from collections.abc import Sequence
from typing import Any, TypeVar

import msgspec
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from scm.client import Client
from scm.registry import names
from scm.v2x.message import Message, Request

MESSAGES, RECORDS = "scm.v2x.messages", "scm.records"

S = TypeVar("S", bound=msgspec.Struct)


class CommandHelp(SphinxDirective):
    """Writes `--help` of each command of a program: `{command-help} scm`."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return what stands in place of the directive."""
        program = importlib.import_module(f"{self.arguments[0]}.__main__").build_parser()
        choices = next(one.choices for one in program._actions if one.dest == "command")  # noqa: SLF001
        parsers = [program, *choices.values()]
        blocks = [f"### {parser.prog}\n\n```text\n{_help(parser)}```" for parser in parsers]
        return self.parse_text_to_nodes("\n\n".join(blocks), allow_section_headings=True)


def _help(parser: argparse.ArgumentParser) -> str:
    formatter = parser.formatter_class
    parser.formatter_class = lambda prog: formatter(prog, max_help_position=28, width=92)
    return parser.format_help()


class Messages(SphinxDirective):
    """Writes each message on the bus with its key, delivery and fields."""

    def run(self) -> list[nodes.Node]:
        """Return what stands in place of the directive."""
        text = "\n\n".join(map(_message, _defined_in(MESSAGES, Message)))
        return self.parse_text_to_nodes(text, allow_section_headings=True)


class Records(SphinxDirective):
    """Writes each record of the web interface and the client with its fields."""

    def run(self) -> list[nodes.Node]:
        """Return what stands in place of the directive."""
        text = "\n\n".join(map(_struct, _defined_in(RECORDS, msgspec.Struct)))
        return self.parse_text_to_nodes(text, allow_section_headings=True)


class ClientNouns(SphinxDirective):
    """Writes the API of each noun of the Python client, under the name of its attribute."""

    def run(self) -> list[nodes.Node]:
        """Return what stands in place of the directive."""
        with Client() as client:
            nouns = {name: type(noun) for name, noun in vars(client).items()}
        text = "\n\n".join(
            f"### {name}\n\n```{{eval-rst}}\n.. autoclass:: {kind.__module__}.{kind.__name__}\n```"
            for name, kind in nouns.items()
            if kind.__name__.endswith("Noun")
        )
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def _defined_in(package: str, base: type[S]) -> list[type[S]]:
    """Return the classes of a kind that a package's modules define, by name."""
    modules = (importlib.import_module(f"{package}.{name}") for name in names(package))
    found = {
        kind
        for module in modules
        for kind in vars(module).values()
        if inspect.isclass(kind) and issubclass(kind, base) and kind.__module__ == module.__name__
    }
    return sorted(found, key=lambda kind: kind.__name__)


def _message(kind: type[Message]) -> str:
    rate = f", {kind.RATE_HZ:g} Hz" if kind.RATE_HZ else ""
    facts = [f"Key `{kind.KEY}`, delivery `{kind.DELIVERY.value}`{rate}."] if kind.KEY else []
    if issubclass(kind, Request):
        facts.append(f"Reply: `{kind.REPLY.__name__}`.")
    return _struct(kind, facts)


def _struct(kind: type[msgspec.Struct], facts: Sequence[str] = ()) -> str:
    """Return a section about a record: what it is, and a table of its fields."""
    about, _, attributes = (inspect.getdoc(kind) or "").partition("Attributes:")
    schema = msgspec.json.schema(kind)["$defs"][kind.__name__]
    meanings = _meanings(attributes)
    rows = [
        f"| `{name}` | {_type(field)} | {_cell(field.get('description', meanings.get(name, '')))} |"
        for name, field in schema.get("properties", {}).items()
    ]
    table = "\n".join(("| field | type | meaning |", "|---|---|---|", *rows)) if rows else ""
    return "\n\n".join((f"## {kind.__name__}", about.strip(), *facts, table))


def _meanings(attributes: str) -> dict[str, str]:
    """Return what a docstring's `Attributes:` says of each field."""
    found: dict[str, str] = {}
    for entry in re.split(r"\n(?=\w)", inspect.cleandoc(attributes)):
        names, _, meaning = entry.partition(":")
        found |= {name.strip(): " ".join(meaning.split()) for name in names.split(",")}
    return found


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _type(field: dict[str, Any]) -> str:
    """Return a field's type in a few words."""
    if "anyOf" in field:
        return " or ".join(_type(one) for one in field["anyOf"])
    if "$ref" in field:
        return f"{field['$ref'].rpartition('/')[2]}"
    if "enum" in field:
        return ", ".join(f"`{one}`" for one in field["enum"])
    if field.get("type") == "array":
        return f"list of {_type(field['items'])}" if field.get("items") else "list"
    return str(field.get("type", "any"))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("command-help", CommandHelp)
    app.add_directive("messages", Messages)
    app.add_directive("records", Records)
    app.add_directive("client-nouns", ClientNouns)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
