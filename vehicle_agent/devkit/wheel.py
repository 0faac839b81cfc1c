"""The lease of one car on behalf of a script, and its commands under it.

    the script speaks         the lease is asked for, then renewed five times in its life
    it spoke anew             its command goes to the car at the bridge's next step
    it is slow                the newest one is repeated every 50 ms, for a second
    silent for a second       zero throttle, steering held
    the connection is gone    the lease is given back: the car stands

Who takes the car from the script keeps it: it is not asked for again before the script connects
anew. A lease that only lapsed is asked for at once.
"""

import logging

from scm.clock import NS_PER_MS, NS_PER_S
from scm.log import event
from scm.v2x.exchange import Call, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from vehicle_agent.devkit.commands import CarWish

FRESH_NS = NS_PER_S
REPEAT_NS = 50 * NS_PER_MS
LEASE_MS = 1000
RENEW_NS = LEASE_MS * NS_PER_MS // 5  # of a busy computer four may come late
ASK_AGAIN_NS = NS_PER_S
ASK_S = 0.5

_log = logging.getLogger(__name__)


class Wheel:
    """One car's lease and commands.

    Args:
        vehicle: The car.
        owner: Whose lease it will be: the bridge's station.
    """

    def __init__(self, vehicle: str, owner: str) -> None:
        self._vehicle = vehicle
        self._owner = owner
        self._epoch: int | None = None
        self._asked_ns: int | None = None
        self._obeyed_ns: int | None = None
        self._repeat_ns = 0
        self._seq = 0
        self._lapsed = self._lost = False
        self._why = ""

    @property
    def detail(self) -> str:
        """How it stands with the car, in words."""
        if self._lost:
            return f"{self._vehicle} was taken over"
        return f"{self._vehicle} {'drives' if self._epoch is not None else 'is asked for'}"

    def step(self, now_ns: int, wish: CarWish, said_ns: int) -> list[Outgoing]:
        """Return what is due while the script is there.

        Args:
            now_ns: Now.
            wish: The script's newest.
            said_ns: When it said so.
        """
        pause_ns = ASK_AGAIN_NS if self._epoch is None else RENEW_NS
        due = self._asked_ns is None or now_ns - self._asked_ns >= pause_ns
        if due and not self._lost:
            self._asked_ns = now_ns
            return [self._ask("acquire" if self._epoch is None else "renew")]
        is_new = said_ns != self._obeyed_ns
        if self._epoch is None or not (is_new or now_ns >= self._repeat_ns):
            return []
        self._obeyed_ns, self._repeat_ns = said_ns, now_ns + REPEAT_NS
        self._seq += 1
        command = DriveCommand(
            vehicle=self._vehicle,
            t_ns=now_ns,
            epoch=self._epoch,
            seq=self._seq,
            throttle=wish.throttle if now_ns - said_ns < FRESH_NS else 0.0,
            steering=wish.steering,
            headlights=wish.headlights,
            indicators=wish.indicators,
        )
        return [command]

    def release(self) -> list[Outgoing]:
        """Return what gives the lease back, if it is held; the next script begins anew."""
        out: list[Outgoing] = [] if self._epoch is None else [self._ask("release")]
        self.forget()
        return out

    def forget(self) -> None:
        """Begin anew: the car is another one, or the script is."""
        self._epoch = self._asked_ns = None
        self._lapsed = self._lost = False

    def replied(self, request: LeaseRequest, reply: Message) -> None:
        """Hear what became of a request for the lease."""
        if isinstance(reply, LeaseReply) and request.verb == "acquire":
            if reply.owner == self._owner:
                self._epoch, self._seq, self._lapsed, self._why = reply.epoch, 0, False, ""
        elif isinstance(reply, Refused) and request.verb != "release":
            self._refused(request, reply)

    def _refused(self, request: LeaseRequest, refused: Refused) -> None:
        if refused.detail != self._why:
            self._why = refused.detail
            event(_log, "devkit_lease", level=logging.WARNING, why=repr(refused.detail))
        if refused.code in ("timeout", "offline") or request.epoch != (self._epoch or 0):
            return
        if request.verb == "renew":
            self._epoch, self._asked_ns, self._lapsed = None, None, True
        elif self._lapsed and refused.code == "owned":
            self._lost = True

    def _ask(self, verb: str) -> Call:
        request = LeaseRequest(
            vehicle=self._vehicle,
            owner=self._owner,
            verb=verb,  # type: ignore[arg-type]
            epoch=self._epoch or 0,
            ttl_ms=LEASE_MS,
        )
        return Call(request, ASK_S)
