"""What routes answer, for the description of the interface: give one of these as `responses=`.

    @routes.get("", summary="All cars", responses=answer(VehiclesTopic))
    @routes.get("", summary="Long work", responses=answer_page(Operation))
    @routes.post("/search", summary="Search", status_code=202, responses=answer(Operation, 202))
    @routes.get("/{name}.mcap", summary="Download", responses=answer_file("application/mcap"))

A record's docstring becomes its description and the lines below `Attributes:` those of its fields;
what they leave out stands in the field's type, as in `scm.records.fields`.
"""

from functools import cache
from typing import Any

import msgspec

from scm.errors import RunError
from scm.records.page import Page

Responses = dict[int | str, dict[str, Any]]

DEFINITIONS: dict[str, dict[str, Any]] = {}
"""The records of all answers by name: FastAPI copies what a route answers, they are added once."""

_CURSOR = {
    "Link": {
        "description": 'RFC 8288: the next page, `rel="next"`; absent on the last',
        "schema": {"type": "string", "examples": ['</api/v1/operations?cursor=x>; rel="next"']},
    }
}


@cache
def schema_of(kind: Any) -> dict[str, Any]:
    """Return a schema that refers to its records, for all routes: it is never changed."""
    schema = msgspec.json.schema(kind)
    for name, definition in _without_nulls(schema.pop("$defs", {})).items():
        if DEFINITIONS.setdefault(name, definition) != definition:
            msg = f"openapi: two records are named {name!r}; expected one, or another name"
            raise RunError(msg)
    return schema


def _without_nulls(node: Any) -> Any:
    """Leave out what is null, as FastAPI does with all that it copies: a field's default, say."""
    if isinstance(node, dict):
        return {key: _without_nulls(part) for key, part in node.items() if part is not None}
    return [_without_nulls(part) for part in node] if isinstance(node, list) else node


def answer(kind: Any, status: int = 200, about: str = "What was requested.") -> Responses:
    """Describe an answer in JSON.

    Args:
        kind: A record (`msgspec.Struct`), or any type that msgspec can describe.
        status: Of the answer: 200, 201 or 202.
        about: What it is, in a sentence.
    """
    content = {"application/json": {"schema": schema_of(kind)}}
    return {status: {"description": about, "content": content}}


def answer_page(kind: Any, about: str = "A page of the list.") -> Responses:
    """Describe a page of records, as `page_response` gives it."""
    described = answer(Page[kind], about=about)
    described[200]["headers"] = _CURSOR
    return described


def answer_file(media: str, about: str = "The file.", status: int = 200) -> Responses:
    """Describe an answer that is no JSON: a picture, a download, a stream."""
    schema = {"type": "string"}
    if not media.startswith("text/"):
        schema["contentMediaType"] = media
    return {status: {"description": about, "content": {media: {"schema": schema}}}}


def answer_nothing(about: str = "It is gone.") -> Responses:
    """Describe an answer without a body; its route has `status_code=204`."""
    return {204: {"description": about}}
