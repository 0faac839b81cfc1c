"""LIDAR scans of cars: the next one, or all of them for as long as somebody watches."""

import asyncio
from collections.abc import AsyncIterator

from fastapi import APIRouter, Response
from fastapi.responses import StreamingResponse

from scm.api.city import City, Name, json_response, not_found
from scm.api.encoding import encode
from scm.api.problem import RefusedError
from scm.api.roles import VIEWER
from scm.api.scan_watch import scan_row, scanner_of
from scm.api.schemas import answer, answer_file
from scm.api.stream import Stream
from scm.records.scans import ScanRow

LOOK_S = 0.02
PATIENCE_S = 3.0
HEARTBEAT_LOOKS = 50  # silent for a second: a comment, so that a lost page is noticed


def router(city: City, stream: Stream) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/vehicles", tags=["scans"], dependencies=[VIEWER])

    @routes.get("/{name}/scan", summary="The next turn of a car's LIDAR", responses=answer(ScanRow))
    async def one(name: Name) -> Response:
        scanner = _scanner(city, name)
        if scanner is None:
            raise RefusedError.of("not_found", f"{name} has no LIDAR: its car file names none")
        with city.view.watching_scan(name):
            for _ in range(round(PATIENCE_S / LOOK_S)):
                row = _newest(city, name, scanner)
                if row is not None:
                    return json_response(row)
                await asyncio.sleep(LOOK_S)
        raise not_found("car with a scan", name)

    @routes.get(
        "/{name}/scan/stream",
        summary="Every turn, as server-sent events",
        responses=answer_file("text/event-stream", "Events `scan`: a `ScanRow`; null: no LIDAR."),
        response_class=Response,
    )
    async def every(name: Name) -> Response:
        scanner = _scanner(city, name)
        return StreamingResponse(
            _turns(city, stream, name, scanner),
            media_type="text/event-stream",
            headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"},
        )

    return routes


async def _turns(
    city: City, stream: Stream, name: str, scanner: tuple[float, float] | None
) -> AsyncIterator[bytes]:
    """Yield every new scan until the page goes away or the server ends."""
    turns, silent = Turns(city, name, scanner), 0
    with city.view.watching_scan(name):
        yield b"retry: 1000\n\n"
        while not stream.is_closed:
            news = turns.news()
            silent = 0 if news else silent + 1
            if news or silent % HEARTBEAT_LOOKS == 0:
                yield news or b": silent\n\n"
            await asyncio.sleep(LOOK_S)


class Turns:
    """A watched car's turns as server-sent events, each once; for a car without a LIDAR null."""

    def __init__(self, city: City, name: str, scanner: tuple[float, float] | None) -> None:
        self._city, self._name, self._scanner = city, name, scanner
        self._shown_ns: int | None = None
        self._is_sent = False

    def news(self) -> bytes:
        """Return the newest turn as an event; empty: it was sent."""
        row = None if self._scanner is None else _newest(self._city, self._name, self._scanner)
        if self._scanner is None and not self._is_sent:
            self._is_sent = True
        elif row is None or row.t_ns == self._shown_ns:
            return b""
        else:
            self._shown_ns = row.t_ns
        return b"event: scan\ndata: " + encode(row) + b"\n\n"


def _newest(city: City, name: str, scanner: tuple[float, float]) -> ScanRow | None:
    found = city.view.scan(name)
    return None if found is None else scan_row(*found, scanner, city.view.now_ns)


def _scanner(city: City, name: str) -> tuple[float, float] | None:
    """Return where the car's scanner sits, None: it has none; refuse a car that is not there."""
    held = city.view.snapshot
    cars = () if held is None else held.message.vehicles
    car = next((car for car in cars if car.vehicle == name), None)
    if car is None:
        raise not_found("car", name)
    return scanner_of(car.car)
