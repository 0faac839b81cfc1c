"""Vehicles' requests for priority at one junction, between the air and a policy.

    SREM received at the roadside  ->  PriorityCall  ->  policy  ->  status  ->  SSEM

A request expires when it is cancelled, `AFTER_ARRIVAL_NS` after the car should have come and gone,
or without a time `REPEAT_TIMEOUT_NS` after it was last repeated; never later than `MAX_REQUEST_NS`.
A station can request for itself alone: an SREM in another's name is dropped and counted. Whether a
car may call itself an ambulance is a matter of signatures, not of signals.
"""

from collections.abc import Mapping

from scm.clock import NS_PER_S
from scm.maps.route import Roads
from scm.records.city_map import Junction
from scm.traffic.signals.policy import PriorityCall, Status
from scm.v2x.etsi.convert import roadside_station, station_id
from scm.v2x.etsi.priority_requests import PriorityAnswer, PriorityRequest, requests_of, ssem_of
from scm.v2x.etsi.topology import topology_of
from scm.v2x.messages.srem import SremRx
from scm.v2x.messages.ssem import SsemTx

AFTER_ARRIVAL_NS = 10 * NS_PER_S  # a car may be late
REPEAT_TIMEOUT_NS = 5 * NS_PER_S  # of a request without a time of arrival
MAX_REQUEST_NS = 120 * NS_PER_S  # whatever it claims
SSEM_EVERY_NS = NS_PER_S
MAX_REQUESTS = 32  # more than cars fit before a junction: a flood must not fill the memory

EMERGENCY = ("roadRescue", "emergency", "police", "fire", "ambulance")
TRANSIT = ("publicTransport", "specialTransport", "transit", "tram")

Key = tuple[int, int]


class PriorityRequests:
    """The requests of one junction.

    Attributes:
        ignored: SREMs in another's name, and requests beyond `MAX_REQUESTS`.
    """

    def __init__(self, junction: Junction, roads: Roads) -> None:
        self._junction = junction
        self._groups = topology_of(roads, junction).group_in
        self._requests: dict[Key, tuple[PriorityRequest, int]] = {}
        self._published: dict[Key, Status] = {}
        self._published_ns = 0
        self._sequence = 0
        self.ignored = 0

    def receive(self, message: SremRx, now_ns: int) -> None:
        """Add the requests of an SREM that are for this junction."""
        for request in requests_of(message.body, now_ns):
            if request.junction != self._junction.number:
                continue
            key = (request.station_id, request.number)
            if request.station_id != station_id(message.station):
                self.ignored += 1
            elif request.verb == "cancel":
                self._requests.pop(key, None)
            elif key in self._requests or len(self._requests) < MAX_REQUESTS:
                self._requests[key] = (request, _until_ns(request, now_ns))
            else:
                self.ignored += 1

    def calls(self, now_ns: int) -> tuple[PriorityCall, ...]:
        """Return the requests in force, in the order in which they came."""
        self._requests = {k: held for k, held in self._requests.items() if now_ns < held[1]}
        return tuple(
            PriorityCall(
                key, self._group_of(request), request.arrives_ns, _role_of(request), until_ns
            )
            for key, (request, until_ns) in self._requests.items()
        )

    def due_ssem(self, status: Mapping[Key, Status], now_ns: int) -> list[SsemTx]:
        """Return the SSEM that is due: at once when a status changes, and once a second."""
        now = {key: status.get(key, "requested") for key in self._requests}
        is_new = now != self._published
        if not now or not (is_new or now_ns - self._published_ns >= SSEM_EVERY_NS):
            self._published = now
            return []
        self._published, self._published_ns = now, now_ns
        self._sequence += is_new
        answers = [PriorityAnswer(self._requests[key][0], what) for key, what in now.items()]
        body = ssem_of(self._junction, answers, self._sequence, now_ns)
        return [SsemTx(station=roadside_station(self._junction.name), t_ns=now_ns, body=body)]

    def _group_of(self, request: PriorityRequest) -> str:
        known = request.lane_in is not None and request.lane_in <= len(self._groups)
        return self._groups[request.lane_in - 1] if known and request.lane_in else ""


def _role_of(request: PriorityRequest) -> str:
    if request.role in EMERGENCY:
        return "emergency"
    return "transit" if request.role in TRANSIT else request.role


def _until_ns(request: PriorityRequest, now_ns: int) -> int:
    if request.arrives_ns is None:
        return now_ns + REPEAT_TIMEOUT_NS
    lasts_ns = round((request.lasts_s or 0.0) * NS_PER_S)
    return min(
        now_ns + MAX_REQUEST_NS, max(now_ns, request.arrives_ns) + lasts_ns + AFTER_ARRIVAL_NS
    )
