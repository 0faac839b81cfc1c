"""Input of a route as a record of `scm.records`: a body in JSON, or the query.

    def spawn(body: Json[SpawnBody], key: IdempotencyKey = "") -> Response: ...
    def preview(figures: FromQuery[NewCarBody]) -> Response: ...

msgspec decodes it. Each wrong field is named in the problem that the caller gets.
"""

import json
import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Generic, TypeVar, get_args

import msgspec
from fastapi import Depends, Request
from msgspec.inspect import StrType, type_info
from starlette.exceptions import HTTPException

from scm.api.problem import InvalidError

T = TypeVar("T", bound=msgspec.Struct)
Schema = dict[str, Any]

_JSON = re.compile(r"application/([\w.-]+\+)?json\s*(;|$)", re.IGNORECASE)
_PLACE = re.compile(r"^(.*?)(?: - at `\$(.*)`)?$", re.DOTALL)
_BOUND = re.compile(r"Expected `(\w+)[^`]*` (of length )?([<>]=?) (\S+)$")
_PATTERN = re.compile(r"Expected `str` matching regex (.*)$", re.DOTALL)
_TYPE = re.compile(r"Expected `(\w+)[^`]*`, got `(\w+)`$")
_FIELD = re.compile(r"Object (missing required|contains unknown) field `(.*)`$", re.DOTALL)
_BOUNDS = {">=": "greater than or equal to", ">": "greater than", "<=": "less than or equal to",
           "<": "less than"}  # fmt: skip
_TYPES = {"int": "integer", "float": "number", "str": "string", "bool": "boolean", "array": "list",
          "object": "dictionary"}  # fmt: skip
_MISSING, _UNKNOWN = "Field required", "Extra inputs are not permitted"


class JsonInput(Generic[T]):
    """A dependency that reads the body of a request."""

    def __init__(self, kind: type[T]) -> None:
        self._kind = kind

    async def __call__(self, request: Request) -> T:
        """Return the body.

        Raises:
            InvalidError: when it is none of that kind.
        """
        content = await request.body()
        media = request.headers.get("content-type", "")
        if content and not _JSON.match(media):
            raise HTTPException(415, f"Content-Type: got {media!r}, expected application/json")
        given = _parsed(content) if content else None
        if not isinstance(given, dict):
            raise InvalidError.at("body", _MISSING if given is None else "a JSON object")
        return validated(self._kind, given, "body")

    def describe(self, operation: Schema) -> None:
        """Add the body to the description of an operation."""
        schema = msgspec.json.schema(self._kind)
        content = {"application/json": {"schema": schema}}
        operation["requestBody"] = {"content": content, "required": True}


class QueryInput(Generic[T]):
    """A dependency that reads the query of a request."""

    def __init__(self, kind: type[T]) -> None:
        self._kind = kind

    async def __call__(self, request: Request) -> T:
        """Return the query; raises as `JsonInput`."""
        return validated(self._kind, dict(request.query_params), "query")

    def describe(self, operation: Schema) -> None:
        """Add the query to the description of an operation."""
        (record,) = msgspec.json.schema(self._kind)["$defs"].values()
        operation.setdefault("parameters", []).extend(
            {
                "name": name,
                "in": "query",
                "required": name in record["required"],
                "schema": schema,
            }
            for name, schema in record["properties"].items()
        )


if TYPE_CHECKING:
    Json = Annotated[T, "body"]
    FromQuery = Annotated[T, "query"]
else:

    class Json:
        """`Json[Record]`: the body."""

        @classmethod
        @cache
        def __class_getitem__(cls, kind: type[T]) -> Any:
            return Annotated[kind, Depends(JsonInput(kind))]

    class FromQuery:
        """`FromQuery[Record]`: the query."""

        @classmethod
        @cache
        def __class_getitem__(cls, kind: type[T]) -> Any:
            return Annotated[kind, Depends(QueryInput(kind))]


def _parsed(content: bytes) -> object:
    try:
        return msgspec.json.decode(content)
    except RecursionError as error:
        raise HTTPException(400, "There was an error parsing the body") from error
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InvalidError.at("body", f"JSON: {_why_malformed(content, error)}") from error


def _why_malformed(content: bytes, error: Exception) -> str:
    try:
        json.loads(content)
    except json.JSONDecodeError as found:
        return f"{found.msg} at character {found.pos}"
    except UnicodeDecodeError:
        return "not in UTF-8"
    return str(error)  # only Python's own reader accepts it: NaN, half of a surrogate pair


def validated(kind: type[T], given: Mapping[str, Any], where: str) -> T:
    """Return given values as a record.

    Raises:
        InvalidError: with all faults of its fields.
    """
    faults: list[dict[str, str]] = []
    values: dict[str, Any] = {}
    fields = {field.encode_name: field for field in msgspec.structs.fields(kind)}
    for name, field in fields.items():
        if name in given:
            try:
                values[field.name] = msgspec.convert(given[name], field.type, strict=False)
                _check_ends(given[name], field.type)
            except msgspec.ValidationError as error:
                faults.append(_fault(str(error), f"{where}.{name}", given[name], field.type))
        elif field.required:
            faults.append({"where": f"{where}.{name}", "expected": _MISSING})
    faults += [
        {"where": f"{where}.{name}", "expected": _UNKNOWN} for name in given if name not in fields
    ]
    if faults:
        raise InvalidError(tuple(faults))
    try:
        return kind(**values)
    except ValueError as error:
        raise InvalidError.at(where, str(error)) from error


def _check_ends(value: object, kind: Any) -> None:
    r"""Refuse a newline after what a pattern allows: Python's `$` lets it pass."""
    info = type_info(kind)
    for one in (info, getattr(info, "item_type", None), *getattr(info, "types", ())):
        if isinstance(one, StrType) and one.pattern is not None:
            whole = re.compile(one.pattern.removesuffix("$") + r"\Z")
            for text in (value,) if isinstance(value, str) else value or ():  # type: ignore[attr-defined]
                if not whole.search(text):
                    msg = f"Expected `str` matching regex {one.pattern!r}"
                    raise msgspec.ValidationError(msg)


def _fault(message: str, where: str, given: Any, kind: Any) -> dict[str, str]:
    """Return a fault that msgspec found, in the words of the interface."""
    found = _PLACE.match(message)
    what, place = (found[1], found[2] or "") if found else (message, "")
    steps = [step for step in re.findall(r"[^\[\].]+|\.\.\.", place) if step != "..."]
    for step in steps:
        given = given[int(step)] if isinstance(given, list) else given.get(step)
    field = _FIELD.match(what)
    if field:
        steps.append(field[2])
        what = _MISSING if field[1].startswith("missing") else _UNKNOWN
    return {"where": ".".join((where, *steps)), "expected": _expected(what, given, kind)}


def _expected(what: str, given: Any, kind: Any) -> str:
    if bound := _BOUND.match(what):
        if bound[2]:
            return _length(bound[1], bound[3], int(bound[4]), given)
        return f"Input should be {_BOUNDS[bound[3]]} {float(bound[4]):.12g}"
    if pattern := _PATTERN.match(what):
        return f"String should match pattern {pattern[1]}"
    if of := _TYPE.match(what):
        why = "" if of[1] == "str" or not isinstance(given, str) else ", got text"
        why = ", got a number with a fractional part" if of[2] == "float" else why
        return f"Input should be a valid {_TYPES.get(of[1], of[1])}{why}"
    if what.startswith("Invalid enum value"):
        *first, last = [repr(word) for word in _choices(kind)]
        return f"Input should be {', '.join(first)} or {last}"
    return what


def _length(of: str, sign: str, bound: int, given: Any) -> str:
    most = "at most" if sign == "<=" else "at least"
    if of == "str":
        return f"String should have {most} {bound} character{'' if bound == 1 else 's'}"
    items = f"{bound} item{'' if bound == 1 else 's'}"
    return f"List should have {most} {items} after validation, not {len(given)}"


def _choices(kind: Any) -> Iterator[str]:
    """Yield the words that a type allows."""
    for one in get_args(kind):
        if isinstance(one, str):
            yield one
        else:
            yield from _choices(one)
