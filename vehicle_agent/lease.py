"""The lease of one car on behalf of a program that drives it, and its commands under it.

    the program commands      the lease is requested, then renewed five times in its life
    a new command             goes to the car at the next step
    it is slow                the newest command is repeated every 50 ms, for a second
    silent for a second       zero throttle, steering held
    the connection is gone    the lease is released: the car stops

A car that somebody else takes over is not requested again before the program begins anew. A lease
that only lapsed is requested again at once.
"""

import logging
from typing import Protocol

from scm.clock import NS_PER_MS, NS_PER_S
from scm.log import event
from scm.v2x.exchange import Call, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.vehicles.lights import Headlights, Indicators

COMMAND_TIMEOUT_NS = NS_PER_S
REPEAT_NS = 50 * NS_PER_MS
LEASE_MS = 1000
RENEW_NS = LEASE_MS * NS_PER_MS // 5  # on a busy computer four may be late
RETRY_NS = NS_PER_S
REQUEST_TIMEOUT_S = 0.5

_log = logging.getLogger(__name__)


class Commanded(Protocol):
    """What a program commands: see `DriveCommand`."""

    @property
    def throttle(self) -> float:
        """-1 to 1, + forward."""
        ...

    @property
    def steering(self) -> float:
        """-1 to 1, + = left."""
        ...

    @property
    def headlights(self) -> Headlights | None:
        """How they are switched from now on; None: as they were."""
        ...

    @property
    def indicators(self) -> Indicators | None:
        """Likewise."""
        ...


class CarLease:
    """One car's lease and commands.

    Args:
        vehicle: The car.
        owner: Owner of the lease: the program's station.
    """

    def __init__(self, vehicle: str, owner: str) -> None:
        self._vehicle = vehicle
        self._owner = owner
        self._epoch: int | None = None
        self._requested_ns: int | None = None
        self._obeyed_ns: int | None = None
        self._repeat_ns = 0
        self._seq = 0
        self._lapsed = self._lost = False
        self._last_refusal = ""

    @property
    def detail(self) -> str:
        """State of the lease, in words."""
        if self._lost:
            return f"{self._vehicle} was taken over"
        return f"{self._vehicle} {'drives' if self._epoch is not None else 'is requested'}"

    def step(self, now_ns: int, command: Commanded, commanded_ns: int) -> list[Outgoing]:
        """Return what is due while the program drives.

        Args:
            now_ns: Now.
            command: Its newest.
            commanded_ns: When it came.
        """
        pause_ns = RETRY_NS if self._epoch is None else RENEW_NS
        due = self._requested_ns is None or now_ns - self._requested_ns >= pause_ns
        if due and not self._lost:
            self._requested_ns = now_ns
            return [self._request("acquire" if self._epoch is None else "renew")]
        is_new = commanded_ns != self._obeyed_ns
        if self._epoch is None or not (is_new or now_ns >= self._repeat_ns):
            return []
        self._obeyed_ns, self._repeat_ns = commanded_ns, now_ns + REPEAT_NS
        self._seq += 1
        drive_command = DriveCommand(
            vehicle=self._vehicle,
            t_ns=now_ns,
            epoch=self._epoch,
            seq=self._seq,
            throttle=command.throttle if now_ns - commanded_ns < COMMAND_TIMEOUT_NS else 0.0,
            steering=command.steering,
            headlights=command.headlights,
            indicators=command.indicators,
        )
        return [drive_command]

    def release(self) -> list[Outgoing]:
        """Return the release of the lease, if it is held; the next program starts anew."""
        out: list[Outgoing] = [] if self._epoch is None else [self._request("release")]
        self.forget()
        return out

    def forget(self) -> None:
        """Reset: the car or the program was replaced."""
        self._epoch = self._requested_ns = None
        self._lapsed = self._lost = False

    def replied(self, request: LeaseRequest, reply: Message) -> None:
        """Process the reply to a lease request."""
        if isinstance(reply, LeaseReply) and request.verb == "acquire":
            if reply.owner == self._owner:
                self._epoch, self._seq, self._lapsed, self._last_refusal = reply.epoch, 0, False, ""
        elif isinstance(reply, Refused) and request.verb != "release":
            self._refused(request, reply)

    def _refused(self, request: LeaseRequest, refused: Refused) -> None:
        if refused.detail != self._last_refusal:
            self._last_refusal = refused.detail
            event(_log, "car_lease", level=logging.WARNING, why=repr(refused.detail))
        if refused.code in ("timeout", "offline") or request.epoch != (self._epoch or 0):
            return
        if request.verb == "renew":
            self._epoch, self._requested_ns, self._lapsed = None, None, True
        elif self._lapsed and refused.code == "owned":
            self._lost = True

    def _request(self, verb: str) -> Call:
        request = LeaseRequest(
            vehicle=self._vehicle,
            owner=self._owner,
            verb=verb,  # type: ignore[arg-type]
            epoch=self._epoch or 0,
            ttl_ms=LEASE_MS,
        )
        return Call(request, REQUEST_TIMEOUT_S)
