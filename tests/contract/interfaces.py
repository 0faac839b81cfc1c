"""What programs of other people rely on, as data: REST, messages, commands, without any prose.

`python -m tests.contract.interfaces` writes `tests/contract/interfaces/*.json` anew, after a change
that is meant; the diff then shows what it does to those who use it.
"""

import argparse
import importlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from scm.__main__ import build_parser as scm_parser
from scm.api.app import create_app
from scm.api.view import CityView
from scm.maps.load import load_map
from scm.registry import names
from scm.v2x.message import Message, Request
from vehicle_agent.__main__ import build_parser as agent_parser

FOLDER = Path(__file__).with_suffix("")
PROSE = frozenset({"description", "summary", "title", "examples", "example", "externalDocs"})


def rest() -> Any:
    """Return the OpenAPI document without prose; of problems, which are all alike, the status."""
    app = create_app(CityView(), lambda _request, _timeout_s: None, load_map("driving_school"))
    document = _bare(app.openapi())
    for operations in document["paths"].values():
        for operation in operations.values():
            answers = operation["responses"]
            problems = sorted(status for status in answers if status >= "400")
            operation["responses"] = {
                "problems": problems,
                **{status: answers[status] for status in answers if status < "400"},
            }
    return document


def messages() -> Any:
    """Return each message by name: its key, how it is delivered, its reply, its fields."""
    found = {}
    for name in names("scm.v2x.messages"):
        module = importlib.import_module(f"scm.v2x.messages.{name}")
        for kind in vars(module).values():
            if (
                isinstance(kind, type)
                and issubclass(kind, Message)
                and not getattr(kind, "__parameters__", ())
            ):
                found[kind.__name__] = _message(kind)
    return found


def _message(kind: type[Message]) -> Any:
    is_request = issubclass(kind, Request)
    schema = msgspec.json.schema(kind)
    definitions = schema["$defs"]
    fields = definitions[kind.__name__]["properties"]
    return {
        "key": kind.KEY,
        "delivery": kind.DELIVERY.value,
        "rate_hz": kind.RATE_HZ,
        "keep": kind.HISTORY_DEPTH,
        "reply": kind.REPLY.__name__ if is_request else None,
        "has_effect": kind.HAS_EFFECT if is_request else None,
        "required": definitions[kind.__name__]["required"],
        "fields": {name: _inlined(_bare(field), definitions) for name, field in fields.items()},
    }


def _inlined(node: Any, definitions: dict[str, Any]) -> Any:
    """Return a schema with its records in place: their names are not on the wire."""
    if isinstance(node, list):
        return [_inlined(one, definitions) for one in node]
    if not isinstance(node, dict):
        return node
    if "$ref" in node:
        return _inlined(_bare(definitions[node["$ref"].rpartition("/")[2]]), definitions)
    return {key: _inlined(one, definitions) for key, one in node.items()}


def commands() -> Any:
    """Return each command by name: its arguments, their choices and whether they must be given."""
    return {
        f"{program} {name}": dict(_arguments(parser))
        for program, whole in (("scm", scm_parser()), ("vehicle-agent", agent_parser()))
        for action in whole._actions
        if isinstance(action, argparse._SubParsersAction)
        for name, parser in action.choices.items()
    }


def _arguments(parser: argparse.ArgumentParser) -> Iterator[tuple[str, Any]]:
    for action in parser._actions:
        if not isinstance(action, argparse._HelpAction):
            yield (
                "/".join(action.option_strings) or action.dest,
                {
                    "nargs": action.nargs,
                    "choices": sorted(map(str, action.choices)) if action.choices else None,
                    "required": action.required,
                    "default": str(action.default),
                },
            )


def _bare(node: Any) -> Any:
    """Return a schema without prose; a property may be called as prose is."""
    if isinstance(node, list):
        return [_bare(one) for one in node]
    if not isinstance(node, dict):
        return node
    return {
        key: {name: _bare(one) for name, one in value.items()}
        if key == "properties"
        else _bare(value)
        for key, value in node.items()
        if key not in PROSE
    }


def meaning(node: Any) -> Any:
    """Return what a schema means: the order of an `enum` and its `type` add nothing."""
    if isinstance(node, list):
        return [meaning(one) for one in node]
    if not isinstance(node, dict):
        return node
    same = {key: meaning(value) for key, value in node.items() if value or key != "required"}
    if same.get("default", "") in (None, []):
        del same["default"]
    if isinstance(same.get("enum"), list):
        same.pop("type", None)
        same["enum"] = sorted(same["enum"])
    return same


PARTS = {"rest": rest, "messages": messages, "commands": commands}


def text_of(part: str) -> str:
    """Return a part as it stands in its file."""
    return _written(PARTS[part](), 2 if part == "commands" else 3) + "\n"


def _written(node: Any, depth: int) -> str:
    """Return JSON with a line for each entry down to a depth: a change is a few lines of a diff."""
    if depth == 0 or not isinstance(node, dict) or not node:
        return json.dumps(node, sort_keys=True, ensure_ascii=False)
    lines = (f"{json.dumps(key)}: {_written(node[key], depth - 1)}" for key in sorted(node))
    return "{\n" + ",\n".join(lines) + "\n}"


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for part in PARTS:
        (FOLDER / f"{part}.json").write_text(text_of(part), encoding="utf-8")
