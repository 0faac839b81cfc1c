"""Write `scm/client` from the interface's own description: `python docs/make/client.py`.

A noun of the interface (the tag of its routes) becomes a class, an operation a method. Its answers
are the records of `scm.records` and of messages, the same that the routes return.
`tests/contract/test_client.py` fails when this has to be run again.
"""

import builtins
import importlib
import keyword
import re
import subprocess
import sys
import textwrap
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from scm.api.app import create_app
from scm.api.openapi import PUBLISHED
from scm.api.view import CityView
from scm.maps.load import load_map
from scm.registry import names
from scm.v2x.message import Refused

FOLDER = Path(__file__).parents[2] / "scm" / "client"
REFERENCE = "#/components/schemas/"
KEY = "Idempotency-Key"
WIDTH = 99
ON_THE_BUS = "a name on the bus"
SHARED = ("limit", "cursor", "if_match", "if_none_match")  # explained by scm.client.operation.Noun
BY = "Written by docs/make/client.py: do not change it here."
CLIENT = '''"""The client of a city, noun by noun.

{by}
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Self

from scm.client.connection import Connection
{imports}
from scm.client.teleop import Wheel, acquired
from scm.client.work import finished
from scm.records.operations import Operation


class Client:
    """A city over its web interface; close it, or use it in a `with`.

    Args:
        url: Where its dashboard is: `http://127.0.0.1:8000`.
        key: API key, where the city requires one; empty: of the file in `SCM_API_KEY_FILE`.
    """

    def __init__(self, url: str = "http://127.0.0.1:8000", key: str = "") -> None:
        self.connection = Connection(url, key)
{nouns}

    def wheel(self, vehicle: str, reason: str = "") -> AbstractContextManager[Wheel]:
        """Drive a car; with a reason, one that somebody else has. See `scm.client.teleop`."""
        return acquired(self.connection, vehicle, reason)

    def wait(
        self,
        work: Operation,
        on_progress: Callable[[Operation], object] | None = None,
        timeout_s: float = 600.0,
    ) -> Operation:
        """Return long work once it is done; `on_progress` gets each step; see `scm.client.work`."""
        return finished(self.connection, work, on_progress, timeout_s)

    def close(self) -> None:
        """End the connection."""
        self.connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
'''
Schema = dict[str, Any]


def description() -> Schema:
    """Return what the interface says of itself."""
    refused = Refused(code="offline", detail="nobody is there")
    app = create_app(CityView(), lambda _request, _timeout_s: refused, load_map("driving_school"))
    return app.openapi()


def files(document: Schema) -> dict[str, str]:
    """Return all files to write, by their path below `scm/client`, not yet formatted."""
    nouns: dict[str, list[tuple[str, str, Schema]]] = defaultdict(list)
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            nouns[operation["tags"][0]].append((method.upper(), path, operation))
    schemas = document["components"]["schemas"]
    made = {"client.py": _client(sorted(nouns))}
    made["nouns/__init__.py"] = f'"""One file a noun of the interface.\n\n{BY}\n"""\n'
    for noun, operations in nouns.items():
        made[f"nouns/{_file(noun)}.py"] = _noun(noun, operations, schemas)
    return made


def _is_record(schema: Schema) -> bool:
    """Say whether a schema has a name in the client: lists of words or of columns have none."""
    return schema.get("type") == "object"


def _references(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        if "$ref" in node:
            yield node["$ref"].removeprefix(REFERENCE)
        for child in node.values():
            yield from _references(child)
    elif isinstance(node, list):
        for child in node:
            yield from _references(child)


def _sent(operation: Schema, schemas: Schema) -> Iterator[str]:
    """Return the records that the fields of an operation's body hold."""
    content = operation.get("requestBody", {}).get("content", {})
    for name in _references(content.get("application/json", {}).get("schema", {})):
        yield from _references(schemas[name].get("properties", {}))


def _success(operation: Schema) -> tuple[str, Schema]:
    """Return the media type and the schema of an operation's answer."""
    for status, answer in sorted(operation["responses"].items()):
        if status.startswith("2"):
            for media, content in answer.get("content", {}).items():
                return media, content.get("schema", {})
    return "", {}


def _typing(body: str) -> list[str]:
    """Return the imports of the standard library that a file needs."""
    lines = ["from collections.abc import Iterator"] if "Iterator[" in body else []
    names = [name for name in ("Any", "Literal") if re.search(rf"\b{name}\b", body)]
    return [*lines, f"from typing import {', '.join(names)}"] if names else lines


def _modules() -> dict[str, str]:
    """Return the module of each record, by its name; of messages where `scm.records` has none."""
    found: dict[str, str] = {}
    for package in ("scm.records", "scm.v2x.messages"):
        for name in names(package):
            module = f"{package}.{name}"
            for kind in vars(importlib.import_module(module)).values():
                if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
                    found.setdefault(kind.__name__, kind.__module__)
    return found


def _imports(used: set[str], schemas: Schema) -> list[str]:
    """Return the imports of records."""
    by_module, modules = defaultdict(set), _modules()
    for record in used:
        if _is_record(schemas[record]):
            for name in re.findall(r"\w+", _kind(record)):
                by_module[modules[name]].add(name)
    return [f"from {module} import {', '.join(sorted(by_module[module]))}" for module in by_module]


def _kind(record: str) -> str:
    """Return a described record as a type of Python: `Page_EventRow_` is `Page[EventRow]`."""
    own = {published: name for name, published in PUBLISHED.items()}
    record = re.sub(r"[^_]+", lambda found: own.get(found[0], found[0]), record)
    return re.sub(r"^Page_(\w+)_$", r"Page[\1]", record)


def _default(schema: Schema) -> str:
    value = schema.get("default")
    if isinstance(value, dict):
        return "None"
    return repr(_frozen(value))


def _frozen(value: Any) -> Any:
    return tuple(_frozen(one) for one in value) if isinstance(value, list) else value


def _type(schema: Schema, schemas: Schema) -> str:
    """Return a schema as a type of Python."""
    if "$ref" in schema:
        name = schema["$ref"].removeprefix(REFERENCE)
        target = schemas[name]
        return _kind(name) if _is_record(target) else _type(target, schemas)
    choices = schema.get("anyOf") or schema.get("oneOf")
    if choices:
        kinds = list(dict.fromkeys(_type(one, schemas) for one in choices))
        return " | ".join(sorted(kinds, key=lambda kind: kind == "None"))
    if "enum" in schema or "const" in schema:
        values = schema.get("enum", [schema.get("const")])
        shown = ", ".join(repr(value) for value in values if value is not None)
        return f"Literal[{shown}]" + (" | None" if None in values else "")
    return _plain(schema, schemas)


def _plain(schema: Schema, schemas: Schema) -> str:
    kind = schema.get("type")
    if kind == "array":
        if "prefixItems" in schema:
            return f"tuple[{', '.join(_type(one, schemas) for one in schema['prefixItems'])}]"
        inner = _type(schema.get("items") or {}, schemas)
        return f"tuple[{inner}, ...]"
    if kind == "object":
        more = schema.get("additionalProperties")
        inner = _type(more, schemas) if isinstance(more, dict) else "Any"
        return f"dict[str, {inner}]"
    if kind == "string" and schema.get("contentEncoding") == "base64":
        return "bytes"
    kinds = {"string": "str", "integer": "int", "number": "float", "boolean": "bool"}
    return {**kinds, "null": "None"}.get(str(kind), "Any")


class _Method:
    """One operation as a method."""

    def __init__(self, method: str, path: str, operation: Schema, schemas: Schema) -> None:
        self._method, self._path, self._operation = method, path, operation
        self._schemas = schemas
        noun, own = operation["tags"][0], operation["operationId"]
        self.name = _name(own.removeprefix(re.sub(r"\W", "_", noun) + "_"))
        self._given: list[str] = []
        self._about: list[str] = []
        self._has_key = False
        for parameter in operation.get("parameters", ()):
            self._add_parameter(parameter)
        self._add_body()
        if self._has_key:
            self._given.append('idempotency_key: str = ""')

    def _add(self, key: str, schema: Schema, required: bool) -> None:
        own = _name(key)
        while hasattr(builtins, own) or own in {_name_of(one) for one in self._given}:
            own += "_"
        kind = _type(schema, self._schemas)
        default = "" if required else _default(schema)
        if default == "None" and "None" not in kind:
            kind += " | None"
        self._given.append(f"{own}: {kind}" + (f" = {default}" if default else ""))
        about = schema.get("description") or key
        if own not in SHARED and about != ON_THE_BUS:
            self._about.append(f"{own}: {about}")

    def _add_parameter(self, parameter: Schema) -> None:
        if parameter["name"] == KEY:
            self._has_key = True
            return
        if parameter["name"] == "Last-Event-ID":
            return
        schema = {"description": parameter.get("description"), **parameter["schema"]}
        self._add(parameter["name"], schema, parameter.get("required", False))
        if parameter["in"] == "path" and "*" not in self._given:
            return
        if "*" not in self._given:
            self._given.insert(len(self._given) - 1, "*")

    def _add_body(self) -> None:
        content = self._operation.get("requestBody", {}).get("content", {})
        if not content:
            return
        if "*" not in self._given:
            self._given.append("*")
        schema = content.get("application/json", {}).get("schema")
        if schema is None:
            self._given.append("content: bytes")
            self._about.append("content: What to send.")
            return
        target = self._schemas[schema["$ref"].removeprefix(REFERENCE)] if "$ref" in schema else {}
        required = set(target.get("required", ()))
        for key, one in target.get("properties", {}).items():
            self._add(key, one, key in required)

    def source(self) -> str:
        """Return the method."""
        if self._given[-1:] == ["*"]:
            self._given.pop()
        if self._has_key and "*" not in self._given:
            self._given.insert(len(self._given) - 1, "*")
        given = ", ".join(["self", *self._given])
        lines = [f'    @operation("{self._method}", "{self._path}")']
        lines += [f"    def {self.name}({given}) -> {self._answer()}:"]
        lines += _docstring(self._operation["summary"], "Args", self._about, 8)
        return "\n".join(lines)

    def _answer(self) -> str:
        """Return the type of what the method answers."""
        media, schema = _success(self._operation)
        if not media:
            return "None"
        if media == "application/json" or media.endswith("+json"):
            return _type(schema, self._schemas)
        if media == "text/event-stream":
            return "Iterator[LiveEvent]"
        return "bytes" if media.startswith(("image/", "text/")) else "Iterator[bytes]"


def _name_of(given: str) -> str:
    return given.partition(":")[0]


def _noun(noun: str, operations: list[tuple[str, str, Schema]], schemas: Schema) -> str:
    methods = [_Method(*one, schemas) for one in operations]
    head = [f"class {_class(noun)}Noun(Noun):", f'    """Operations on {noun}."""', ""]
    body = "\n".join([*head, *(method.source() for method in methods)])
    used = {name for one in operations for name in _references(_success(one[2])[1])}
    used |= {name for one in operations for name in _sent(one[2], schemas)}
    lines = [f'"""Operations on {noun} of a city.', "", f'{BY}\n"""', ""]
    lines += [*_typing(body), *_imports(used, schemas)]
    lines.append("from scm.client.operation import Noun, operation")
    lines += ["from scm.client.stream import LiveEvent"] if "[LiveEvent]" in body else []
    return "\n".join([*lines, "", "", body])


def _client(nouns: list[str]) -> str:
    imports = [f"from scm.client.nouns.{_file(noun)} import {_class(noun)}Noun" for noun in nouns]
    own = [f"        self.{_file(noun)} = {_class(noun)}Noun(self.connection)" for noun in nouns]
    return CLIENT.format(by=BY, imports="\n".join(imports), nouns="\n".join(own))


def _docstring(about: str, title: str, entries: list[str], indent: int) -> list[str]:
    room, pad = WIDTH - indent, " " * indent
    first, _, rest = " ".join(about.split()).partition(". ")
    first = textwrap.shorten(first.rstrip("."), room - 8, placeholder=" ...") + "."
    if not rest and not entries:
        return [f'{pad}"""{first}"""', ""]
    lines = [f'{pad}"""{first}', ""]
    if rest:
        lines += [*textwrap.wrap(rest, WIDTH, initial_indent=pad, subsequent_indent=pad), ""]
    if entries:
        lines.append(f"{pad}{title}:")
        inner, more = pad + " " * 4, pad + " " * 8
        for entry in entries:
            text = " ".join(entry.split())
            lines += textwrap.wrap(text, WIDTH, initial_indent=inner, subsequent_indent=more)
        lines.append("")
    return [*lines[:-1], f'{pad}"""', ""]


def _name(text: str) -> str:
    """Return a name of Python, with a line behind it where it means something else already."""
    name = re.sub(r"\W", "_", text).strip("_").lower()
    acquired = keyword.iskeyword(name) or (hasattr(builtins, name) and name not in ("id", "type"))
    return f"{name}_" if acquired else name


def _file(noun: str) -> str:
    """Return a noun as the name of a module and of the client's attribute."""
    return re.sub(r"\W", "_", noun).lower()


def _class(text: str) -> str:
    words = [word for word in re.split(r"[\W_]+", text) if word]
    return "".join(word[0].upper() + word[1:] for word in words)


def formatted(sources: dict[str, str], folder: Path) -> dict[str, str]:
    """Write the files below a folder, and return them in the form of this project."""
    for path, text in sources.items():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, "utf-8")
    paths = [str(folder / path) for path in sources]
    settings = ["--config", str(FOLDER.parents[1] / "pyproject.toml"), "--quiet"]
    ruff = [sys.executable, "-m", "ruff"]
    subprocess.run([*ruff, "check", *settings, "--fix-only", "--select", "I", *paths], check=True)
    subprocess.run([*ruff, "format", *settings, *paths], check=True)
    return {path: (folder / path).read_text("utf-8") for path in sources}


if __name__ == "__main__":
    written = formatted(files(description()), FOLDER)
    for old in FOLDER.glob("nouns/*.py"):
        if str(old.relative_to(FOLDER)) not in written:
            old.unlink()
