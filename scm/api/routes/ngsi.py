"""NGSI-LD, for reading: the city's entities as a context broker would give them."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, Path, Query, Request, Response
from msgspec import Meta

from scm.api.city import City, not_found
from scm.api.encoding import encode
from scm.api.ngsi import CONTEXT, CORE, TYPES, Entity, entities, key_values
from scm.api.problem import RefusedError
from scm.api.roles import VIEWER
from scm.api.schemas import Responses, schema_of
from scm.errors import nearest

JSON_LD, JSON = "application/ld+json", "application/json"
_TYPE = "http://www.w3.org/ns/json-ld#context"
_EXAMPLE: dict[str, object] = {
    "id": "urn:ngsi-ld:Vehicle:city:n1",
    "type": "Vehicle",
    "speed": {"type": "Property", "value": 10.58, "unitCode": "KMH"},
}

Attributes = Annotated[
    dict[str, Any],
    Meta(description="`id`, `type` and attributes of the entity's model", examples=[_EXAMPLE]),
]
Short = Annotated[
    Literal["", "normalized", "keyValues", "simplified"],
    Query(description="`keyValues`, `simplified`: attributes are their values", examples=[""]),
]
_HEEDED = frozenset({"type", "limit", "offset", "count", "options", "local"})

PREFIX = ""


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/ngsi-ld/v1", tags=["ngsi"], dependencies=[VIEWER])

    @routes.get(
        "/entities",
        summary="NGSI-LD entities of the city",
        responses=_answer(list[Attributes], "Entities, in the order of their types and names."),
    )
    def all_entities(
        request: Request,
        kind: Annotated[
            str,
            Query(
                alias="type",
                max_length=100,
                description=f"comma between: {', '.join(TYPES)}; none: all",
                examples=["Vehicle"],
            ),
        ] = "",
        limit: Annotated[int, Query(ge=0, le=1000, description="at most", examples=[20])] = 20,
        offset: Annotated[int, Query(ge=0, le=10**6, description="to skip", examples=[0])] = 0,
        count: Annotated[
            bool, Query(description="return how many there are in all", examples=[True])
        ] = False,
        options: Short = "",
    ) -> Response:
        _check_heeded(request)
        wanted = _types(kind)
        found = [one for name in wanted for one in entities(city, name)]
        page = found[offset : offset + limit]
        headers = {"NGSILD-Results-Count": str(len(found))} if count else {}
        links = _neighbours(request, offset, limit, len(found))
        return _response(request, [_shaped(one, options) for one in page], headers, links)

    @routes.get(
        "/entities/{entity}",
        summary="One NGSI-LD entity",
        responses=_answer(Attributes, "The entity."),
    )
    def one_entity(
        request: Request,
        entity: Annotated[
            str,
            Path(
                max_length=200,
                description="its urn",
                examples=["urn:ngsi-ld:Vehicle:city:n1"],
            ),
        ],
        options: Short = "",
    ) -> Response:
        kind = [*entity.split(":"), "", "", ""][2]
        for one in entities(city, kind) if kind in TYPES else ():
            if one["id"] == entity:
                return _response(request, _shaped(one, options))
        raise not_found("entity", entity)

    return routes


def _answer(kind: Any, about: str) -> Responses:
    return {200: {"description": about, "content": {JSON: {"schema": schema_of(kind)}}}}


def _types(kind: str) -> list[str]:
    wanted = [name.strip() for name in kind.split(",") if name.strip()] or list(TYPES)
    for name in wanted:
        if name not in TYPES:
            detail = f"type: got {name!r}, expected some of {TYPES}{nearest(name, TYPES)}"
            raise RefusedError.of("invalid", detail)
    return wanted


def _check_heeded(request: Request) -> None:
    """Refuse what would choose or shape entities and is not offered: to leave it out would lie."""
    for name in request.query_params:
        if name not in _HEEDED:
            detail = f"{name}: there are no such queries; expected some of {sorted(_HEEDED)}"
            raise RefusedError.of("invalid", detail)


def _neighbours(request: Request, offset: int, limit: int, count: int) -> list[str]:
    """Return links to the pages after and before, as in NGSI-LD (6.3.10) and RFC 8288."""
    there = {}
    if limit and offset + limit < count:
        there["next"] = offset + limit
    if limit and offset:
        there["prev"] = max(0, offset - limit)
    links = []
    for rel, to in there.items():
        query = urlencode({**request.query_params, "offset": to, "limit": limit})
        links.append(f'<{request.url.path}?{query}>; rel="{rel}"')
    return links


def _shaped(entity: Entity, options: str) -> Entity:
    return key_values(entity) if options in ("keyValues", "simplified") else entity


def _response(
    request: Request,
    body: Entity | list[Entity],
    headers: dict[str, str] | None = None,
    links: Sequence[str] = (),
) -> Response:
    """Return entities with their context inside as JSON-LD, or named in `Link` as JSON."""
    own = {"Cache-Control": "no-store", **(headers or {})}
    links_ = list(links)
    if JSON_LD not in request.headers.get("accept", ""):
        links_.insert(0, f'<{CORE}>; rel="{_TYPE}"; type="{JSON_LD}"')
    if links_:
        own["Link"] = ", ".join(links_)
    if JSON_LD in request.headers.get("accept", ""):
        inside = (
            [{"@context": CONTEXT, **one} for one in body]
            if isinstance(body, list)
            else {"@context": CONTEXT, **body}
        )
        return Response(encode(inside), headers=own, media_type=JSON_LD)
    return Response(encode(body), headers=own, media_type=JSON)
