"""API keys: who has one, and the end of one; new ones are made where the store is (`scm key`)."""

from typing import Annotated

from fastapi import APIRouter, Path, Response

from scm.api.city import IdempotencyKey, json_response, not_found
from scm.api.keys import KeyRecord, KeyRing
from scm.api.roles import ADMIN
from scm.api.schemas import answer
from scm.errors import AccessError
from scm.records.keys import AllKeys, KeyRow


def router(keys: KeyRing | None) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/keys", tags=["keys"], dependencies=[ADMIN])

    @routes.get("", summary="All API keys, without their secrets", responses=answer(AllKeys))
    def all_keys() -> Response:
        found = () if keys is None else keys.records()
        return json_response(AllKeys(keys=tuple(_row(one) for one in found)))

    @routes.delete("/{key_id}", summary="End an API key at once", responses=answer(KeyRow))
    def revoke(
        key_id: Annotated[
            str, Path(max_length=64, description="public part of the key", examples=["1f0c9a2e"])
        ],
        key: IdempotencyKey = "",
    ) -> Response:
        del key  # stored by the server: a second end would find no such key
        if keys is None:
            raise not_found("key", key_id)
        try:
            ended = keys.revoke(key_id)
        except AccessError as cause:
            raise not_found("key", key_id) from cause
        return json_response(_row(ended))

    return routes


def _row(one: KeyRecord) -> KeyRow:
    return KeyRow(id=one.key_id, owner=one.owner, role=one.role, made_s=one.made_s)
