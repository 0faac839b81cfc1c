"""Sphinx directives that write the reference pages from the code: commands and messages."""

import argparse
import importlib
import inspect
from typing import Any

import msgspec
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from scm.client import Client
from scm.registry import names
from scm.v2x.message import Message, Request

MESSAGES = "scm.v2x.messages"


class CommandHelp(SphinxDirective):
    """Writes `--help` of each command of a program: `{command-help} scm`."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return what stands in place of the directive."""
        program = importlib.import_module(f"{self.arguments[0]}.__main__").build_parser()
        choices = next(one.choices for one in program._actions if one.dest == "command")  # noqa: SLF001
        parsers = {program.prog: program, **choices}
        blocks = [f"```text\n{_help(parser)}```" for parser in parsers.values()]
        return self.parse_text_to_nodes("\n\n".join(blocks))


def _help(parser: argparse.ArgumentParser) -> str:
    formatter = parser.formatter_class
    parser.formatter_class = lambda prog: formatter(prog, max_help_position=28, width=92)
    return parser.format_help()


class Messages(SphinxDirective):
    """Writes each message on the bus with its key, delivery and fields."""

    def run(self) -> list[nodes.Node]:
        """Return what stands in place of the directive."""
        text = "\n\n".join(
            _message(kind) for kind in sorted(_kinds(), key=lambda one: one.__name__)
        )
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


def _kinds() -> set[type[Message]]:
    modules = (importlib.import_module(f"{MESSAGES}.{name}") for name in names(MESSAGES))
    return {
        kind
        for module in modules
        for kind in vars(module).values()
        if inspect.isclass(kind)
        and issubclass(kind, Message)
        and kind.__module__ == module.__name__
    }


def _message(kind: type[Message]) -> str:
    definitions = msgspec.json.schema(kind)["$defs"]
    schema = definitions[kind.__name__]
    about, _, attributes = (inspect.getdoc(kind) or "").partition("Attributes:")
    lines = [f"## {kind.__name__}", about.strip()]
    if kind.KEY:
        rate = f", {kind.RATE_HZ:g} Hz" if kind.RATE_HZ else ""
        lines.append(f"Key `{kind.KEY}`, delivery `{kind.DELIVERY.value}`{rate}.")
    if issubclass(kind, Request):
        lines.append(f"Reply: `{kind.REPLY.__name__}`.")
    rows = [
        f"| `{name}` | {_type(field)} | {'' if name in schema['required'] else 'optional'} |"
        for name, field in schema["properties"].items()
    ]
    if rows:
        lines.append("\n".join(("| field | type | |", "|---|---|---|", *rows)))
    if attributes.strip():
        lines.append(f"```text\n{inspect.cleandoc(attributes)}\n```")
    return "\n\n".join(lines)


def _type(field: dict[str, Any]) -> str:
    """Return a field's type in a few words."""
    if "anyOf" in field:
        return " or ".join(_type(one) for one in field["anyOf"])
    if "$ref" in field:
        return field["$ref"].rpartition("/")[2]
    if "enum" in field:
        return ", ".join(f"`{one}`" for one in field["enum"])
    if field.get("type") == "array":
        return f"list of {_type(field['items'])}" if field.get("items") else "list"
    return str(field.get("type", "any"))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("command-help", CommandHelp)
    app.add_directive("messages", Messages)
    app.add_directive("client-nouns", ClientNouns)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
