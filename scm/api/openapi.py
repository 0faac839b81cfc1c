"""The description of the interface (OpenAPI 3.1): records by name, and words on every field.

Routes declare their answers by `scm.api.schemas`. Here the records move below `components`, so that
each is described once and may hold others of its own kind; what `Attributes:` of a record's
docstring states goes to its fields, before what their types say (`scm.records.fields`). Examples of
lists and records are put together from those of their parts.
"""

import inspect
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import msgspec
from fastapi import APIRouter, FastAPI
from fastapi.openapi.utils import get_openapi
from fastapi.routing import APIRoute

from scm.api.inputs import JsonInput, QueryInput
from scm.api.roles import ROLES, SCHEME
from scm.api.schemas import DEFINITIONS
from scm.errors import RunError

PUBLISHED = {
    "AcquireBody": "TakeBody",
    "ForecastScore": "PromiseScore",
    "OverrideBody": "WishBody",
    "SignalOverride": "SignalWish",
    "StageInterval": "SignalSlot",
}
"""Names of records that programs generated from the description already know."""

UNITS: dict[str, float | int] = {
    "m": 1.25, "s": 2.5, "ms": 12.5, "ns": 120_000_000_000, "mps": 0.3, "mps2": 0.5, "rad": 0.1,
    "radps": 0.2, "deg": 0.4, "mm": 1.8, "px": 640, "hz": 20.0, "nm": 0.01, "v": 7.4,
}  # fmt: skip
"""An example for a number that ends in this unit, where its type names none."""

_DEFS, _COMPONENTS = "#/$defs/", "#/components/schemas/"
_ENTRY = re.compile(r"^ {4}(\w+(?:, \w+)*): ")
_DEPTH = 6
Schema = dict[str, Any]
Nouns = Mapping[str, Sequence[APIRouter]]


def install(app: FastAPI, nouns: Nouns) -> None:
    """Let an application describe itself so, once, on the first request.

    Args:
        app: The application.
        nouns: Its routers, by the prefix of their addresses.
    """

    def openapi() -> Schema:
        if app.openapi_schema is None:
            document = get_openapi(
                title=app.title,
                version=app.version,
                routes=app.routes,
                servers=app.servers or None,
            )
            document["$defs"] = msgspec.to_builtins(DEFINITIONS)  # copies
            _add_inputs(document, nouns)
            app.openapi_schema = described(document)
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]


def _add_inputs(document: Schema, nouns: Nouns) -> None:
    """Add the bodies and queries that routes read as records."""
    routes = [
        (document["paths"][prefix + route.path_format], route)
        for prefix, routers in nouns.items()
        for router in routers
        for route in router.routes
        if isinstance(route, APIRoute)
    ]
    for path, route in routes:
        for read in (dependency.call for dependency in route.dependant.dependencies):
            if isinstance(read, JsonInput | QueryInput):
                for method in route.methods or ():
                    read.describe(path[method.lower()])


def operation_id(route: APIRoute) -> str:
    """Return how an operation is called: its noun and its function, `vehicles_spawn`."""
    noun = str(route.tags[0]) if route.tags else "page"
    return re.sub(r"\W", "_", f"{noun}_{route.name}")


def described(document: Schema) -> Schema:
    """Return a description with records below `components`, and words on every field.

    Raises:
        RunError: when two records of one name differ.
    """
    schemas: Schema = document.setdefault("components", {}).setdefault("schemas", {})
    for holder in list(_records(document)):
        for record, schema in holder.pop("$defs").items():
            name = _published(record)
            if schemas.setdefault(name, schema) != schema:
                msg = f"openapi: two records are named {name!r}; expected one, or another name"
                raise RunError(msg)
    _point(document)
    for schema in schemas.values():
        _describe_fields(schema)
    fields = [item for schema in schemas.values() for item in schema.get("properties", {}).items()]
    for name, field in fields:
        _describe_by_record(field, schemas)
        _add_example(name, field, schemas)
    for operation in operations(document):
        for parameter in operation.get("parameters", ()):
            _lift_words(parameter["schema"])
            if "description" in parameter["schema"]:
                parameter["description"] = parameter["schema"].pop("description")
            _add_example(parameter["name"], parameter["schema"], schemas)
        if "security" in operation:
            operation["security"] = [_least_role(operation["security"])]
    return document


def _least_role(given: list[Schema]) -> Schema:
    """Return the highest of the roles that a noun and its route require."""
    named = {role for one in given for role in one[SCHEME]}
    return {SCHEME: [max(named, key=ROLES.index)]}


def operations(document: Schema) -> Iterator[Schema]:
    """Yield every operation of a description."""
    for path in document["paths"].values():
        yield from path.values()


def _records(node: Any) -> Iterator[Schema]:
    """Yield all schemas that bring records along."""
    if isinstance(node, dict):
        if "$defs" in node:
            yield node
        for child in node.values():
            yield from _records(child)
    elif isinstance(node, list):
        for child in node:
            yield from _records(child)


def _published(record: str) -> str:
    """Return what a record, or a page of it, is called in the description."""
    return re.sub(r"[^_]+", lambda found: PUBLISHED.get(found[0], found[0]), record)


def _point(node: Any) -> None:
    """Make all references name records below `components`."""
    if isinstance(node, dict):
        if str(node.get("$ref", "")).startswith(_DEFS):
            node["$ref"] = _COMPONENTS + _published(node["$ref"].removeprefix(_DEFS))
        for child in node.values():
            _point(child)
    elif isinstance(node, list):
        for child in node:
            _point(child)


def _describe_fields(schema: Schema) -> None:
    fields: Schema = schema.get("properties", {})
    about, described_fields = _attributes(schema.get("description", ""))
    if about:
        schema["description"] = about
    for name, field in fields.items():
        _lift_words(field)
        if name in described_fields:
            field["description"] = described_fields[name]
        field.pop("title", None)


def _lift_words(field: Schema) -> None:
    """Give a field that may be null the words of what it is otherwise."""
    for choice in field.get("anyOf", ()):
        for key in ("description", "examples"):
            if key in choice:
                field.setdefault(key, choice.pop(key))


def _describe_by_record(field: Schema, schemas: Schema) -> None:
    """Give a field that holds records the description of these, if it has none of its own."""
    inner = [field, field.get("items") or {}, *field.get("anyOf", ())]
    for one in inner:
        if "$ref" in one and "description" not in field:
            record = schemas[one["$ref"].removeprefix(_COMPONENTS)]
            field["description"] = record.get("description", "")


def _attributes(docstring: str) -> tuple[str, dict[str, str]]:
    """Return a record's own description, and its docstring's descriptions of fields."""
    about, _, entries = inspect.cleandoc(docstring).partition("Attributes:\n")
    described_fields: dict[str, str] = {}
    names: list[str] = []
    for line in entries.splitlines():
        entry = _ENTRY.match(line)
        if entry is not None:
            names = entry[1].split(", ")
            described_fields.update(dict.fromkeys(names, line[entry.end() :].strip()))
        elif line.strip():
            described_fields.update(
                {name: f"{described_fields[name]} {line.strip()}" for name in names}
            )
    return " ".join(about.split()), described_fields


def _add_example(name: str, field: Schema, schemas: Schema) -> None:
    if "examples" in field or "example" in field:
        return
    found = _example(name, field, schemas, 0)
    if found is not None:
        field["examples"] = [found]


def _example(name: str, field: Schema, schemas: Schema, depth: int) -> Any:
    """Return a value that a field may have; None: there is no example."""
    if "examples" in field:
        return field["examples"][0]
    if "$ref" in field:
        return _record(schemas[field["$ref"].removeprefix(_COMPONENTS)], schemas, depth + 1)
    for choices in ("anyOf", "oneOf"):
        values = [_example(name, one, schemas, depth) for one in field.get(choices, ())]
        if choices in field:
            return next((value for value in values if value is not None), None)
    if "enum" in field:
        return next((value for value in field["enum"] if value is not None), None)
    if "const" in field:
        return field["const"]
    return _of_type(name, field, schemas, depth)


def _of_type(name: str, field: Schema, schemas: Schema, depth: int) -> Any:
    kind = field.get("type")
    if kind == "array":
        parts = field.get("prefixItems") or [field.get("items") or {}]
        return [_example(name, part, schemas, depth) for part in parts] if depth < _DEPTH else []
    if kind == "object":
        return _record(field, schemas, depth + 1)
    if kind == "boolean":
        return True
    numbers = (UNITS.get(name.rpartition("_")[2]), field.get("minimum"), 1)
    for value in (field.get("default"), *numbers):
        if _is_a(str(kind), value) and value != "" and _is_within(field, value):
            return value
    return None


def _is_within(field: Schema, value: Any) -> bool:
    if isinstance(value, str):
        return len(value) <= int(field.get("maxLength", len(value)))
    return bool(field.get("minimum", value) <= value <= field.get("maximum", value))


def _record(schema: Schema, schemas: Schema, depth: int) -> Any:
    if "properties" not in schema:
        return _example("", schema, schemas, depth) if "enum" in schema else {}
    if depth > _DEPTH:
        return {}
    fields = schema["properties"].items()
    return {name: _example(name, field, schemas, depth) for name, field in fields}


def _is_a(kind: str, value: object) -> bool:
    """Return whether a value is of a type of JSON."""
    if isinstance(value, bool):
        return kind == "boolean"
    if isinstance(value, int) and kind == "number":
        return True
    types: dict[str, Any] = {
        "string": str, "integer": int, "number": float, "array": list, "object": dict,
    }  # fmt: skip
    return kind in types and isinstance(value, types[kind])
