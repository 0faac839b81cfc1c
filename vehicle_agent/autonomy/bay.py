"""A car's side of the parking manager: requests a bay, and waits for the permission to drive.

A request without an answer is repeated every second. A car that has a bay waits until the manager's
status names it, and drives until that permission ends; each status renews it. A bay that the
manager does not know of any more is requested again.
"""

from scm.clock import NS_PER_MS, NS_PER_S
from scm.records.city_map import ANY_BAY, CityMap
from scm.v2x.exchange import Call, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.bay_request import BayReply, BayRequest
from scm.v2x.messages.parking_status import ParkingStatus

RETRY_NS = NS_PER_S
REQUEST_TIMEOUT_S = 0.9
TRANSIENT = ("offline", "timeout")


def is_bay(city_map: CityMap, goal: str) -> bool:
    """Return whether a goal is a bay, which the parking manager gives."""
    return goal == ANY_BAY or goal in (bay.name for bay in city_map.bays)


class BayClient:
    """One car's bay and turn.

    Args:
        vehicle: The car.
        station: Its agent; a prefix of request ids.
        session: Of its bus.

    Attributes:
        goal: The bay's name or `ANY_BAY`, as requested; empty: the car needs no bay.
    """

    def __init__(self, vehicle: str, station: str, session: str) -> None:
        self.goal = ""
        self._vehicle, self._prefix = vehicle, f"{station}-bay-{session}"
        self._count = 0
        self._bay = ""
        self._requested_ns: int | None = None
        self._since_ns = 0
        self._why = ""
        self._status: ParkingStatus | None = None
        self._until_ns = 0

    def begin(self, goal: str) -> None:
        """Request a bay from now on; empty: drive without one."""
        self.goal, self._bay, self._requested_ns = goal, "", None
        self._count += 1
        self._why = "requests a bay"

    def end(self) -> None:
        """Need the bay no longer: the car has parked, or given up."""
        if self._bay:
            self.goal = self._bay = ""

    def step(self, now_ns: int) -> list[Outgoing]:
        """Return what is due."""
        if self._is_lost(now_ns):
            self.begin(self.goal)
        is_due = self._requested_ns is None or now_ns - self._requested_ns >= RETRY_NS
        if not self.goal or self._bay or not is_due:
            return []
        self._requested_ns = now_ns
        request = BayRequest(
            request_id=f"{self._prefix}-{self._count}", vehicle=self._vehicle,
            bay="" if self.goal == ANY_BAY else self.goal,
        )  # fmt: skip
        return [Call(request, REQUEST_TIMEOUT_S)]

    def replied(self, request: BayRequest, reply: Message, now_ns: int) -> Message | None:
        """Return the reply to the present request; None: it is to be requested again."""
        if request.request_id != f"{self._prefix}-{self._count}" or self._bay or not self.goal:
            return None
        if isinstance(reply, Refused) and reply.code in TRANSIENT:
            self._why = reply.detail
            return None
        if isinstance(reply, BayReply):
            self._bay, self._since_ns = reply.bay, now_ns
        else:
            self.goal = ""
        return reply

    def receive(self, status: ParkingStatus, now_ns: int) -> None:
        """Take who may drive."""
        self._status, self._until_ns = status, now_ns + status.permission_ms * NS_PER_MS

    def waits(self, now_ns: int) -> str:
        """Return why the car may not drive; empty: it may."""
        if not self.goal:
            return ""
        if not self._bay:
            return self._why
        status = self._status
        if status is None or now_ns > self._until_ns:
            return "the parking manager is silent"
        if status.driver == self._vehicle:
            return ""
        who = f"{status.driver} drives" if status.driver else status.reason
        return "waits for its turn" + (f": {who}" if who else "")

    def _is_lost(self, now_ns: int) -> bool:
        """Return whether the manager does not know of the car's bay any more."""
        status = self._status
        if not self._bay or status is None or now_ns > self._until_ns:
            return False
        is_known = self._vehicle == status.driver or self._vehicle in status.waiting
        return not is_known and now_ns - self._since_ns > 2 * RETRY_NS
