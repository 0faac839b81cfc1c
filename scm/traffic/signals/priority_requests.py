"""Vehicles' requests for priority at one junction, between the air and a policy.

    SREM heard at the roadside  ->  PriorityCall  ->  policy  ->  status  ->  SSEM

A request lapses when it is cancelled, `AFTER_NS` after the car should have come and gone, or, where
it says no time, `QUIET_NS` after it was last repeated; never later than `LONGEST_NS`. A station may
ask for itself alone: an SREM in another's name is dropped and counted. That a car may call itself
an ambulance at all is for signatures to settle, not for signals.
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

AFTER_NS = 10 * NS_PER_S
QUIET_NS = 5 * NS_PER_S
LONGEST_NS = 120 * NS_PER_S
TELL_EVERY_NS = NS_PER_S
MOST = 32

EMERGENCY = ("roadRescue", "emergency", "police", "fire", "ambulance")
TRANSIT = ("publicTransport", "specialTransport", "transit", "tram")

Key = tuple[int, int]


class PriorityDesk:
    """Keeps the requests of one junction.

    Attributes:
        ignored: SREMs in another's name, and requests beyond the `MOST` that are kept.
    """

    def __init__(self, junction: Junction, roads: Roads) -> None:
        self._junction = junction
        self._groups = topology_of(roads, junction).group_in
        self._wishes: dict[Key, tuple[PriorityRequest, int]] = {}
        self._told: dict[Key, Status] = {}
        self._told_ns = 0
        self._sequence = 0
        self.ignored = 0

    def hear(self, heard: SremRx, now_ns: int) -> None:
        """Take the requests of an SREM that are for this junction."""
        for wish in requests_of(heard.body, now_ns):
            if wish.junction != self._junction.number:
                continue
            key = (wish.station_id, wish.number)
            if wish.station_id != station_id(heard.station):
                self.ignored += 1
            elif wish.verb == "cancel":
                self._wishes.pop(key, None)
            elif key in self._wishes or len(self._wishes) < MOST:
                self._wishes[key] = (wish, _until_ns(wish, now_ns))
            else:
                self.ignored += 1

    def calls(self, now_ns: int) -> tuple[PriorityCall, ...]:
        """Return the requests in force, in the order in which they came."""
        self._wishes = {k: held for k, held in self._wishes.items() if now_ns < held[1]}
        return tuple(
            PriorityCall(key, self._group_of(wish), wish.arrives_ns, _role_of(wish), until_ns)
            for key, (wish, until_ns) in self._wishes.items()
        )

    def tell(self, status: Mapping[Key, Status], now_ns: int) -> list[SsemTx]:
        """Return the SSEM that is due: at once when a status changes, and once a second."""
        now = {key: status.get(key, "requested") for key in self._wishes}
        is_new = now != self._told
        if not now or not (is_new or now_ns - self._told_ns >= TELL_EVERY_NS):
            self._told = now
            return []
        self._told, self._told_ns = now, now_ns
        self._sequence += is_new
        answers = [PriorityAnswer(self._wishes[key][0], what) for key, what in now.items()]
        body = ssem_of(self._junction, answers, self._sequence, now_ns)
        return [SsemTx(station=roadside_station(self._junction.name), t_ns=now_ns, body=body)]

    def _group_of(self, wish: PriorityRequest) -> str:
        known = wish.lane_in is not None and wish.lane_in <= len(self._groups)
        return self._groups[wish.lane_in - 1] if known and wish.lane_in else ""


def _role_of(wish: PriorityRequest) -> str:
    if wish.role in EMERGENCY:
        return "emergency"
    return "transit" if wish.role in TRANSIT else wish.role


def _until_ns(wish: PriorityRequest, now_ns: int) -> int:
    if wish.arrives_ns is None:
        return now_ns + QUIET_NS
    lasts_ns = round((wish.lasts_s or 0.0) * NS_PER_S)
    return min(now_ns + LONGEST_NS, max(now_ns, wish.arrives_ns) + lasts_ns + AFTER_NS)
