"""Drive a car by hand: a WebSocket, the only one of the interface.

The first packet acquires the lease, the others drive; see `scm.api.teleop`.
"""

import secrets

from fastapi import APIRouter, WebSocket

from scm.api.city import City, Name
from scm.api.known_keys import KnownKeys
from scm.api.problem import RefusedError
from scm.api.roles import OPERATOR
from scm.api.stream import Stream
from scm.api.teleop import DriveSession
from scm.clock import WallClock
from scm.records.drive import PROTOCOL


def router(city: City, stream: Stream, known_keys: KnownKeys | None) -> APIRouter:
    """Return the route."""
    routes = APIRouter(prefix="/vehicles", tags=["vehicles"], dependencies=[OPERATOR])

    @routes.websocket("/{name}/drive")
    async def drive(socket: WebSocket, name: Name) -> None:
        if city.wire is None:
            raise RefusedError.of("offline", "this interface has no bus to publish commands on")
        if PROTOCOL not in socket.scope["subprotocols"]:
            detail = f"Sec-WebSocket-Protocol: expected {PROTOCOL} among those offered"
            raise RefusedError.of("invalid", detail)
        await socket.accept(subprotocol=PROTOCOL)
        owner = f"{socket.scope['scm_owner']} #{secrets.token_hex(2)}"
        key = str(socket.scope["scm_key"])

        async def may_drive() -> bool:
            return known_keys is None or await known_keys.find(key) is not None

        await DriveSession(
            city,
            city.wire,
            WallClock(),
            socket,
            name,
            owner,
            is_closed=lambda: stream.is_closed,
            may_drive=may_drive,
        ).run()

    return routes
