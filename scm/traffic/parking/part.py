"""The parking manager as a part of the city: answers requests for bays, publishes who may drive.

It subscribes to what parking agents report, and to where cars are, so that bays with cars of no
agent count as occupied.
"""

from collections.abc import Sequence

from msgspec.structs import replace

from scm.clock import NS_PER_MS
from scm.records.city_map import CityMap
from scm.runtime.part import BasePart, Service, Subscription
from scm.traffic.parking.lot import Lot
from scm.v2x.exchange import Answer, Incoming, Outgoing
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.bay_request import BayRequest
from scm.v2x.messages.parking_status import ParkingStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_state import VehicleState

STATUS_NS = 500 * NS_PER_MS


class ParkingPart(BasePart):
    """Gives bays to cars that request one, and lets them drive in turn.

    Args:
        city_map: Whose bays.
    """

    name, role = "parking", "part"
    period_ns = 100 * NS_PER_MS
    subscriptions: Sequence[Subscription] = (
        Subscription(AutonomyStatus),
        Subscription(VehicleState),
    )
    services: Sequence[Service] = (Service(BayRequest),)

    def __init__(self, city_map: CityMap) -> None:
        self._map = city_map
        self._lot: Lot | None = None
        self._last: ParkingStatus | None = None

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Take reports, answer requests, publish the status at 2 Hz and on change."""
        if self._lot is None:
            self._lot = Lot(self._map, now_ns)
        lot, out = self._lot, list[Outgoing]()
        for item in inbox:
            message = item.message
            if isinstance(message, AutonomyStatus):
                lot.receive_status(message, now_ns)
            elif isinstance(message, VehicleState):
                lot.receive_state(message, now_ns)
            elif isinstance(message, BayRequest):
                out.append(Answer(item, lot.reserve(message, now_ns)))
        lot.step(now_ns)
        status, last = lot.report(now_ns), self._last
        is_due = last is None or now_ns - last.t_ns >= STATUS_NS
        if is_due or last is None or replace(status, t_ns=last.t_ns) != last:
            self._last = status
            out += [status, PartStatus(station=self.name, t_ns=now_ns, detail=_detail(status))]
        return out


def _detail(status: ParkingStatus) -> str:
    occupied = sum(row.state != "free" for row in status.bays)
    drives = f"{status.driver} drives" if status.driver else "nobody drives"
    return f"{occupied} of {len(status.bays)} bays in use, {drives}, {len(status.waiting)} wait"
