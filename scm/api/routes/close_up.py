"""One car from near: everything it reports, at full rate, and how long the way to it is."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import ExitStack
from typing import Annotated

import msgspec
from fastapi import APIRouter, Query, Response
from fastapi.responses import StreamingResponse

from scm.api.city import City, Name, json_response, not_found
from scm.api.close_up import Sample, sample_of
from scm.api.encoding import encode
from scm.api.problem import RefusedError
from scm.api.roles import VIEWER
from scm.api.routes.scan import Turns
from scm.api.scan_watch import scanner_of
from scm.api.schemas import answer, answer_file
from scm.api.stream import Stream
from scm.clock import NS_PER_MS, WallClock
from scm.records.vehicles import LinkRow
from scm.v2x.message import Refused
from scm.v2x.messages.echo_request import EchoReply, EchoRequest
from scm.v2x.messages.network_view import NetworkView
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import SnapshotVehicle

PERIOD_S = 0.05
SILENT_PERIODS = 20  # a comment each second, so that a lost page is noticed
ECHO_TIMEOUT_S = 1.0


class CloseUpFrame(msgspec.Struct, kw_only=True, frozen=True):
    """What a car reported since the frame before.

    Attributes:
        samples: As rows of `Sample`, in order of time.
        source: Where its newest pose comes from: `simulated`, `eye`, `odometry`.
        seq: Of its newest report; a jump means lost ones.
    """

    vehicle: str
    samples: tuple[Sample, ...]
    source: str
    seq: int


def router(city: City, stream: Stream) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/vehicles", tags=["vehicles"], dependencies=[VIEWER])

    @routes.get(
        "/{name}/reports",
        summary="All that a car reports, as server-sent events `reports`",
        responses=answer_file("text/event-stream"),
        response_class=Response,
    )
    async def reports(
        name: Name,
        scan: Annotated[
            bool,
            Query(
                description="each turn of its LIDAR too, as `scan`; null: it has none",
                examples=[True],
            ),
        ] = False,
        network: Annotated[
            bool,
            Query(
                description="what a network that drives it makes of a frame too, as `network`",
                examples=[True],
            ),
        ] = False,
    ) -> Response:
        scanner = scanner_of(_find(city, name).car)
        turns = Turns(city, name, scanner) if scan else None
        return StreamingResponse(
            _reports(city, stream, name, turns, with_network=network),
            media_type="text/event-stream",
            headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"},
        )

    @routes.get(
        "/{name}/link",
        summary="How long the way to a car and back is now",
        responses=answer(LinkRow),
    )
    def link(name: Name) -> Response:
        return json_response(_measured(city, _find(city, name)))

    return routes


async def _reports(
    city: City, stream: Stream, name: str, turns: Turns | None = None, *, with_network: bool = False
) -> AsyncIterator[bytes]:
    """Yield what a car reports until the page goes away or the server ends."""
    number = quiet = 0
    shown: NetworkView | None = None
    with ExitStack() as watches:
        watches.enter_context(city.view.watching_closely(name))
        if turns is not None:
            watches.enter_context(city.view.watching_scan(name))
        if with_network:
            watches.enter_context(city.view.watching_network(name))
        yield b"retry: 1000\n\n"
        while not stream.is_closed:
            number, states = city.view.reports_after(name, number)
            quiet = 0 if states else quiet + 1
            if states:
                yield _event("reports", _frame_of(name, states))
            elif quiet % SILENT_PERIODS == 0:
                yield b": silent\n\n"
            if turns is not None and (turn := turns.news()):
                yield turn
            view = city.view.network(name) if with_network else None
            if view is not None and view is not shown:
                shown = view
                yield _event("network", view)
            await asyncio.sleep(PERIOD_S)


def _frame_of(name: str, states: Sequence[VehicleState]) -> CloseUpFrame:
    return CloseUpFrame(
        vehicle=name,
        samples=tuple(map(sample_of, states)),
        source=states[-1].source,
        seq=states[-1].seq,
    )


def _event(name: str, body: msgspec.Struct) -> bytes:
    return f"event: {name}\ndata: ".encode() + encode(body) + b"\n\n"


def _measured(city: City, car: SnapshotVehicle) -> LinkRow:
    if city.wire is None:
        raise RefusedError.of("offline", "this interface has no wire to measure")
    clock = WallClock()
    sent_ns = clock.now_ns()
    reply = city.wire.request_once(EchoRequest(vehicle=car.vehicle), ECHO_TIMEOUT_S)
    back_ns = clock.now_ns()
    if not isinstance(reply, EchoReply):
        kind = type(reply).__name__
        odd = Refused(code="invalid_reply", detail=f"got a {kind} as the answer")
        raise RefusedError(reply if isinstance(reply, Refused) else odd)
    return LinkRow(
        vehicle=car.vehicle,
        answered_by="world" if car.kind == "hosted" else "agent",
        round_trip_ms=round((back_ns - sent_ns) / NS_PER_MS, 2),
        clock_ahead_ms=round((reply.t_ns - (sent_ns + back_ns) / 2) / NS_PER_MS, 2),
    )


def _find(city: City, name: str) -> SnapshotVehicle:
    snapshot = city.view.snapshot
    cars = () if snapshot is None else snapshot.message.vehicles
    found = next((car for car in cars if car.vehicle == name), None)
    if found is None:
        raise not_found("vehicle", name)
    return found
