"""API keys: who has one, and the end of one; new ones are made where the store is (`scm key`)."""

from fastapi import APIRouter, Response

from scm.api.city import json_response, not_found
from scm.api.keys import KeyRing
from scm.api.roles import ADMIN
from scm.errors import AccessError


def router(keys: KeyRing | None) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/keys", tags=["keys"], dependencies=[ADMIN])

    @routes.get("", summary="All API keys, without their secrets")
    def all_keys() -> Response:
        found = () if keys is None else keys.records()
        rows = [
            {"id": one.key_id, "owner": one.owner, "role": one.role, "made_s": one.made_s}
            for one in found
        ]
        return json_response({"keys": rows})

    @routes.delete("/{key_id}", summary="End an API key at once")
    def revoke(key_id: str) -> Response:
        if keys is None:
            raise not_found("key", key_id)
        try:
            ended = keys.revoke(key_id)
        except AccessError as cause:
            raise not_found("key", key_id) from cause
        return json_response({"id": ended.key_id, "owner": ended.owner, "role": ended.role})

    return routes
