"""Teleoperation: one person drives one car, over a WebSocket.

    take          the lease is requested; another owner's only with a reason
    drive         each packet goes to the car at once; without packets zeros go out every 50 ms
    give back     or the connection ends: the lease is released, and the car continues its trip

The car's guard stops it 300 ms after the last command, whatever becomes of this process; the
city-wide stop holds in the guard as well, so no packet passes it.
"""

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from scm.api.city import City
from scm.api.problem import RefusedError
from scm.api.trip_resume import RESUME_NS, RESUME_PAUSE_S, onward, trip_of
from scm.api.wheel import LEASE_MS, Wheel
from scm.api.wire import Wire
from scm.clock import Clock, seconds
from scm.errors import LinkError, StoreError
from scm.log import event
from scm.records.drive import (
    Acquired,
    AcquirePacket,
    DrivePacket,
    DriveStatus,
    GiveBackPacket,
    Over,
    Packet,
)
from scm.v2x.message import Message, Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.trip import Trip

PERIOD_S = 0.05
GAP_S = 0.01
FIRST_WORD_S = 5.0
RENEW_TIMEOUT_S = 0.7
NORMAL, GOING_AWAY, BAD_PACKET, NOT_YOURS = 1000, 1001, 1007, 4409

_log = logging.getLogger(__name__)


_packets: msgspec.json.Decoder[Packet] = msgspec.json.Decoder(Packet)


class DriveSession:
    """One connection of one person to one car.

    Args:
        city: Where the car is.
        wire: Publishes its commands.
        clock: Of this process.
        socket: Accepted already.
        vehicle: The car.
        owner: The name of the lease: unique to this connection.
        is_closed: Returns whether the server ends.
        may_drive: Returns whether the person's key is still valid; called whenever it is renewed,
            which it is not where that raises a StoreError.
    """

    def __init__(
        self,
        city: City,
        wire: Wire,
        clock: Clock,
        socket: WebSocket,
        vehicle: str,
        owner: str,
        *,
        is_closed: Callable[[], bool],
        may_drive: Callable[[], Awaitable[bool]],
    ) -> None:
        self._city, self._wire, self._clock, self._socket = city, wire, clock, socket
        self._vehicle, self._owner = vehicle, owner
        self._is_closed, self._may_drive = is_closed, may_drive
        self._news = asyncio.Event()
        self._over: Over | None = None
        self._renewing: asyncio.Task[None] | None = None

    async def run(self) -> None:
        """Take the wheel, drive, give it back; returns when all of it is over."""
        first = await self._first_word()
        if first is None:
            return
        trip = trip_of(self._city.view, self._vehicle)
        try:
            lease = await asyncio.to_thread(self._acquire, first.reason)
        except RefusedError as refusal:
            await self._end(Over(code=refusal.refused.code, detail=str(refusal)), NOT_YOURS)
            return
        wheel = Wheel(self._vehicle, self._owner, lease.epoch, self._clock.now_ns())
        reading: asyncio.Task[None] | None = None
        try:
            await self._send(Acquired(vehicle=self._vehicle, owner=self._owner, epoch=lease.epoch))
            reading = asyncio.create_task(self._read(wheel))
            await self._drive(wheel)
        except (WebSocketDisconnect, RuntimeError):
            pass  # the page has gone: what follows is all that there is to do
        finally:
            if reading is not None:
                reading.cancel()
            await asyncio.shield(self._leave(wheel, trip))

    async def _first_word(self) -> AcquirePacket | None:
        try:
            word = await asyncio.wait_for(self._socket.receive_text(), FIRST_WORD_S)
            packet = _packets.decode(word)
            if isinstance(packet, AcquirePacket):
                return packet
            detail = f"the first packet: got a {type(packet).__name__}, expected a take"
            await self._end(Over(code="invalid", detail=detail), BAD_PACKET)
        except (TimeoutError, msgspec.MsgspecError, KeyError) as cause:
            detail = f"the first packet: {cause or 'none'}; expected a take"
            await self._end(Over(code="invalid", detail=detail), BAD_PACKET)
        except WebSocketDisconnect:
            pass
        return None

    def _acquire(self, reason: str) -> LeaseReply:
        request = LeaseRequest(
            vehicle=self._vehicle,
            owner=self._owner,
            verb="steal" if reason.strip() else "acquire",
            ttl_ms=LEASE_MS,
            reason=reason,
        )
        lease = self._city.call(request, LeaseReply)
        self._log_event("wheel_taken", f"{self._owner} drives {self._vehicle} by hand")
        return lease

    async def _read(self, wheel: Wheel) -> None:
        """Receive packets until one of the two ends it."""
        try:
            while self._over is None:
                packet = _packets.decode(await self._socket.receive_text())
                if isinstance(packet, GiveBackPacket):
                    self._over = Over(code="given_back", detail="")
                elif isinstance(packet, DrivePacket):
                    wheel.receive(packet, self._clock.now_ns())
                self._news.set()
        except (msgspec.MsgspecError, KeyError) as cause:
            self._over = Over(code="invalid", detail=f"packet: {cause}")
        except (WebSocketDisconnect, RuntimeError):
            self._over = Over(code="ended", detail="the connection ended")
        self._news.set()

    async def _drive(self, wheel: Wheel) -> None:
        while self._over is None:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), PERIOD_S)
            self._news.clear()
            now_ns = self._clock.now_ns()
            if self._over is None:
                await self._pass_on(wheel, now_ns)
            if self._is_closed():
                self._over = Over(code="ended", detail="the server ends")
            elif wheel.is_abandoned(now_ns):
                self._over = Over(code="abandoned", detail="no packet came for 5 s")
            else:
                await asyncio.sleep(GAP_S)  # however fast a page speaks

    async def _pass_on(self, wheel: Wheel, now_ns: int) -> None:
        command = wheel.command(now_ns)
        try:
            self._wire.publish(command)
        except LinkError as closed:
            self._over = Over(code="offline", detail=str(closed))
            return
        if self._renewing is None or self._renewing.done():
            request = wheel.renewal(now_ns)
            if request is not None:
                self._renewing = asyncio.create_task(self._renew(request))
        snapshot = self._city.view.snapshot
        cars = () if snapshot is None else snapshot.message.vehicles
        car = next((car for car in cars if car.vehicle == self._vehicle), None)
        newest = wheel.newest
        status = DriveStatus(
            seq=None if newest is None else newest.seq,
            t_ms=None if newest is None else newest.t_ms,
            why=wheel.why(now_ns),
            throttle=command.throttle,
            steering=command.steering,
            mode="lost" if car is None else car.mode,
            speed_mps=None if car is None else round(car.speed_mps, 4),
        )
        await self._send(status)

    async def _renew(self, request: LeaseRequest) -> None:
        try:
            may_drive = await self._may_drive()
        except StoreError as silent:  # the next try may know; else the lease runs out
            event(_log, "keys_not_read", level=logging.ERROR, reason=repr(str(silent)))
            return
        if not may_drive:
            self._over = self._over or Over(code="ended", detail="your API key has ended")
            self._news.set()
            return
        try:
            reply = await asyncio.to_thread(self._wire.request_once, request, RENEW_TIMEOUT_S)
        except LinkError as closed:
            reply = Refused(code="offline", detail=str(closed))
        if isinstance(reply, Refused) and reply.code not in ("timeout", "offline"):
            self._over = self._over or Over(code="lost", detail=reply.detail)
            self._news.set()

    async def _leave(self, wheel: Wheel, trip: Trip | None) -> None:
        over = self._over or Over(code="ended", detail="the connection ended")
        if over.code != "lost":
            status = await self._give_back(wheel, trip)
            over = Over(code=over.code, detail=f"{over.detail}; {status}".removeprefix("; "))
        self._log_event("wheel_left", f"{self._owner} released {self._vehicle}: {over.detail}")
        codes = {"given_back": NORMAL, "invalid": BAD_PACKET, "lost": NOT_YOURS}
        await self._end(over, codes.get(over.code, GOING_AWAY))

    async def _give_back(self, wheel: Wheel, trip: Trip | None) -> str:
        """Release the lease, send the car on to its destination, and report the result."""
        request = LeaseRequest(
            vehicle=self._vehicle, owner=self._owner, verb="release", epoch=wheel.epoch
        )
        try:
            await asyncio.to_thread(self._city.call, request, LeaseReply)
        except RefusedError as refusal:
            return f"the lease was not given back: {refusal}"
        return f"{self._vehicle} stands" if trip is None else await self._resume(trip)

    async def _resume(self, trip: Trip) -> str:
        """Send the car on; an agent first waits to be sure that it is no longer driven."""
        until_ns = self._clock.now_ns() + RESUME_NS
        request = onward(self._city.view, trip)
        while True:
            answer = await asyncio.to_thread(self._request_route, request)
            if not isinstance(answer, Refused):
                return f"{self._vehicle} goes on by itself"
            if answer.code != "owned" or self._clock.now_ns() >= until_ns:
                return f"{self._vehicle} stands: {answer.detail.removeprefix(f'{self._vehicle}: ')}"
            await asyncio.sleep(RESUME_PAUSE_S)

    def _request_route(self, request: RouteRequest) -> Message:
        try:
            return self._city.call(request, RouteReply)
        except RefusedError as refusal:
            return refusal.refused

    def _log_event(self, name: str, text: str) -> None:
        now_ns = self._clock.now_ns()
        event(_log, name, vehicle=self._vehicle, owner=repr(self._owner), t_s=seconds(now_ns))
        with contextlib.suppress(LinkError):
            self._wire.publish(
                CityEvent(
                    severity="info",
                    source=self._city.view.name,
                    t_ns=now_ns,
                    name=name,
                    text=text,
                    vehicle=self._vehicle,
                )
            )

    async def _send(self, word: Acquired | DriveStatus | Over) -> None:
        await self._socket.send_text(msgspec.json.encode(word).decode())

    async def _end(self, over: Over, status: int) -> None:
        if self._socket.client_state is not WebSocketState.CONNECTED:
            return
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await self._send(over)
            await self._socket.close(status)
