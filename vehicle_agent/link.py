"""The agent's link to the city: joining, heartbeat, and whether the agent may drive the car.

    outside    -- JoinReply -->                               own
    own        -- another's command, renewal refused -->      foreign
    own        -- no answer for 1 s, own process stalled -->  regaining
    foreign    -- a new order: RouteRequest -->               regaining
    regaining  -- LeaseReply with a newer epoch -->           own
    any        -- car unknown to the city, new world -->      outside

The heartbeat renews the lease; any answer of the city shows that the link is alive. An agent that
lost the link or the car needs a newer epoch from the city to drive on.
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
HEARTBEAT_NS = 200 * NS_PER_MS
LINK_LOST_NS = NS_PER_S
NAME_IN_USE_NS = 10 * NS_PER_S  # the name of a crashed car is free within a few seconds
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
        session: Of the agent's bus; the agent joins only once it is known.
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
        self.reason = "has not requested to join yet"
        self._attempt = 0
        self._requested_ns: int | None = None
        self._answered_ns = 0
        self._was_inside = False
        self._may_be_in = False
        self._in_use_since_ns: int | None = None

    @property
    def is_inside(self) -> bool:
        """Whether the car is in the city."""
        return self.standing != "outside"

    def is_alive(self, now_ns: int) -> bool:
        """Whether the city answered within the last second."""
        return now_ns - self._answered_ns <= LINK_LOST_NS

    def due(self, now_ns: int) -> list[Call]:
        """Return the requests that are due now."""
        every_ns = HEARTBEAT_NS if self.is_inside else JOIN_EVERY_NS
        if not self.session or (
            self._requested_ns is not None and now_ns - self._requested_ns < every_ns
        ):
            return []
        self._requested_ns = now_ns
        if not self.is_inside:
            self._may_be_in = True
            return [Call(self._join(), timeout_s=1.0)]
        return [Call(self._heartbeat(), timeout_s=1.0)]

    def accept_reply(self, reply: Incoming) -> bool:
        """Process a reply of the city; return whether the car has just joined.

        Raises:
            RunError: when the city can never accept the car: no such car, no such place.
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
        """Leave the city and request to join again."""
        if self.is_inside:
            event(_log, "left", vehicle=self._vehicle, reason=reason)
        self.standing, self.reason = "outside", reason
        self._attempt += 1

    def give_way(self) -> None:
        """Note that somebody else drives the car now."""
        if self.standing in ("own", "regaining"):
            self.standing = "foreign"

    def regain(self) -> None:
        """Request a newer lease: after a loss, or because of a new route request."""
        if self.standing in ("own", "foreign"):
            self.standing = "regaining"
            self._attempt += 1

    def goodbye(self) -> list[Call]:
        """Return the goodbye of a car that leaves.

        It is also sent while a join request is unanswered: the city may have accepted it.
        """
        if not (self.is_inside or self._may_be_in):
            return []
        reason = "its agent leaves"
        return [Call(RemoveRequest(vehicle=self._vehicle, reason=reason, session=self.session))]

    def _heartbeat(self) -> LeaseRequest:
        """Return a renewal, or the request for a newer lease, identical at each repetition."""
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
        request = reply.call.request if reply.call is not None else None
        if isinstance(request, JoinRequest):
            self._may_be_in = False
            if refused.code == "invalid" or self._is_name_in_use(refused, reply.t_ns):
                raise RunError(refused.detail)
            self._attempt += 1
            if refused.detail != self.reason:
                event(_log, "not_joined", level=logging.WARNING, reason=refused.detail)
            self.reason = refused.detail
        elif isinstance(request, LeaseRequest) and self.is_inside:
            if refused.code == "not_found":
                self.leave("the city does not know the car any more")
            elif request == self._heartbeat():  # an answer to an older request is irrelevant
                self.give_way()

    def _is_name_in_use(self, refused: Refused, t_ns: int) -> bool:
        """Return whether the name of a new car has been in use by another for too long."""
        if refused.code != "owned" or self._was_inside:
            return False
        self._in_use_since_ns = t_ns if self._in_use_since_ns is None else self._in_use_since_ns
        return t_ns - self._in_use_since_ns >= NAME_IN_USE_NS
