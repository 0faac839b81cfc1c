"""The agent's tie to the city: joining, the heartbeat, and whether the car is its own to drive.

    outside    -- JoinReply -->                               own
    own        -- another's command, renewal refused -->      foreign
    own        -- no answer for 1 s, own process stalled -->  regaining
    foreign    -- a new order: RouteRequest -->               regaining
    regaining  -- LeaseReply with a newer epoch -->           own
    any        -- car unknown to the city, new world -->      outside

The heartbeat asks the city to renew the lease; any answer of the city shows that the link is
alive. Whoever lost the link or the car needs a newer epoch from the city to drive on.
"""

import logging
from typing import Literal

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RunError
from scm.geometry import Pose2
from scm.log import event
from scm.v2x.exchange import Call, Incoming
from scm.v2x.message import Refused
from scm.v2x.messages.join_request import JoinReply, JoinRequest
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.remove_request import RemoveRequest

JOIN_EVERY_NS = NS_PER_S
BEAT_EVERY_NS = 200 * NS_PER_MS
LINK_LOST_NS = NS_PER_S
NAME_TAKEN_NS = 10 * NS_PER_S  # a car that died leaves its name within a few seconds
UNREACHABLE = ("timeout", "offline")

Standing = Literal["outside", "own", "foreign", "regaining"]

_log = logging.getLogger(__name__)


class Link:
    """One car's standing in the city.

    Attributes:
        standing: See the module.
        epoch: Of the newest lease the city gave this agent.
        start: Where the city placed the car at the last joining.
        reason: Why the car is outside, in words.
        session: Of the agent's bus; no joining before it is known.
    """

    def __init__(
        self,
        vehicle: str,
        car: str,
        kind: str,
        spawn: str,
        session: str,
        tag_id: int | None = None,
    ) -> None:
        self._vehicle, self._car, self._kind, self._spawn = vehicle, car, kind, spawn
        self._tag_id = tag_id
        self.session = session
        self.standing: Standing = "outside"
        self.epoch = 0
        self.start = Pose2(0.0, 0.0, 0.0)
        self.reason = "has not asked yet"
        self._attempt = 0
        self._asked_ns: int | None = None
        self._answered_ns = 0
        self._was_inside = False
        self._may_be_in = False
        self._taken_ns: int | None = None

    @property
    def is_inside(self) -> bool:
        """Whether the car is in the city."""
        return self.standing != "outside"

    def is_alive(self, now_ns: int) -> bool:
        """Whether the city answered within the last second."""
        return now_ns - self._answered_ns <= LINK_LOST_NS

    def due(self, now_ns: int) -> list[Call]:
        """Return what is to be asked of the city now, if anything."""
        every_ns = BEAT_EVERY_NS if self.is_inside else JOIN_EVERY_NS
        if not self.session or (self._asked_ns is not None and now_ns - self._asked_ns < every_ns):
            return []
        self._asked_ns = now_ns
        if not self.is_inside:
            self._may_be_in = True
            return [Call(self._join(), timeout_s=1.0)]
        return [Call(self._beat(), timeout_s=1.0)]

    def take(self, reply: Incoming) -> bool:
        """Take a reply of the city; return whether the car has just come in.

        Raises:
            RunError: when the city will never take the car as it is: no such car, no such place.
        """
        message = reply.message
        if isinstance(message, Refused):
            self._refused(message, reply)
            return False
        self._answered_ns = max(self._answered_ns, reply.t_ns)
        if isinstance(message, JoinReply) and not self.is_inside:
            self.standing, self.epoch, self._was_inside = "own", message.epoch, True
            self.start = Pose2(message.x_m, message.y_m, message.yaw_rad)
            event(_log, "joined", vehicle=self._vehicle, tag_id=message.tag_id, epoch=self.epoch)
            return True
        if isinstance(message, LeaseReply):
            self._leased(message)
        return False

    def leave(self, reason: str) -> None:
        """Be outside from now on, and ask to join again."""
        if self.is_inside:
            event(_log, "left", vehicle=self._vehicle, reason=reason)
        self.standing, self.reason = "outside", reason
        self._attempt += 1

    def give_way(self) -> None:
        """Note that somebody else drives the car now."""
        if self.standing in ("own", "regaining"):
            self.standing = "foreign"

    def regain(self) -> None:
        """Ask the city for a newer lease: after a loss, or because of a new order."""
        if self.standing in ("own", "foreign"):
            self.standing = "regaining"
            self._attempt += 1

    def goodbye(self) -> list[Call]:
        """Return the last words of a car that leaves.

        Whoever asked to join and has no answer yet says them too: the city may have let it in.
        """
        if not (self.is_inside or self._may_be_in):
            return []
        reason = "its agent leaves"
        return [Call(RemoveRequest(vehicle=self._vehicle, reason=reason, session=self.session))]

    def _beat(self) -> LeaseRequest:
        """Return a renewal, or the one request for a newer lease, the same however often asked."""
        if self.standing == "regaining":
            return LeaseRequest(
                request_id=self._request_id(),
                vehicle=self._vehicle,
                owner=self._vehicle,
                verb="acquire",
            )
        return LeaseRequest(
            vehicle=self._vehicle, owner=self._vehicle, verb="renew", epoch=self.epoch
        )

    def _request_id(self) -> str:
        return f"{self.session}-{self._vehicle}-{self._attempt}"

    def _join(self) -> JoinRequest:
        return JoinRequest(
            request_id=self._request_id(),
            vehicle=self._vehicle,
            session=self.session,
            kind=self._kind,
            car=self._car,
            spawn=self._spawn,
            tag_id=self._tag_id,
        )

    def _leased(self, lease: LeaseReply) -> None:
        if lease.owner != self._vehicle:
            self.give_way()
        elif self.standing == "regaining" and lease.epoch > self.epoch:
            self.standing, self.epoch = "own", lease.epoch

    def _refused(self, refused: Refused, reply: Incoming) -> None:
        if refused.code in UNREACHABLE:
            self.reason = refused.detail
            return
        self._answered_ns = max(self._answered_ns, reply.t_ns)
        asked = reply.call.request if reply.call is not None else None
        if isinstance(asked, JoinRequest):
            self._may_be_in = False
            if refused.code == "invalid" or self._is_taken_for_good(refused, reply.t_ns):
                raise RunError(refused.detail)
            self._attempt += 1
            if refused.detail != self.reason:
                event(_log, "not_joined", level=logging.WARNING, reason=refused.detail)
            self.reason = refused.detail
        elif isinstance(asked, LeaseRequest) and self.is_inside:
            if refused.code == "not_found":
                self.leave("the city does not know the car any more")
            elif asked == self._beat():  # an answer to an older question says nothing new
                self.give_way()

    def _is_taken_for_good(self, refused: Refused, t_ns: int) -> bool:
        """Return whether a newcomer's name has been somebody else's for too long to wait on."""
        if refused.code != "owned" or self._was_inside:
            return False
        self._taken_ns = t_ns if self._taken_ns is None else self._taken_ns
        return t_ns - self._taken_ns >= NAME_TAKEN_NS
