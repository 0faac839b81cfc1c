"""The part that maps the room about one car, driving it round or watching while somebody drives."""

import logging
from collections.abc import Callable, Sequence

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import ScmError
from scm.log import event
from scm.runtime.part import BasePart, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.grid_payload import packed
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import load_car
from vehicle_agent.autonomy.exploration import Exploration
from vehicle_agent.autonomy.parking import Report
from vehicle_agent.autonomy.shown import shown
from vehicle_agent.lease import CarLease

MAP_NS, STATUS_NS = NS_PER_S, 200 * NS_PER_MS

_log = logging.getLogger(__name__)


class MapPart(BasePart):
    """Maps with one car.

    Args:
        name: Its station, which owns the lease.
        vehicle: The car.
        car: Its file.
        drives: Whether it drives the car; else somebody else does, and it never ends by itself.
        on_report: Called when state or reason change.

    Attributes:
        exploration: The map and the drive.

    Raises:
        CarError: when the car file lacks what is needed.
    """

    role = "client"
    period_ns = 20 * NS_PER_MS

    def __init__(
        self,
        name: str,
        vehicle: str,
        car: str = "nigel",
        *,
        drives: bool = True,
        on_report: Callable[[Report], None] | None = None,
    ) -> None:
        self.name, self._vehicle, self._drives = name, vehicle, drives
        self.exploration = Exploration(load_car(car))
        self._lease = CarLease(vehicle, name)
        self._on_report = on_report
        self._last_report: Report | None = None
        self._map_ns, self._status_ns = -MAP_NS, -STATUS_NS
        own = {"vehicle": vehicle}
        self.subscriptions: Sequence[Subscription] = (
            Subscription(VehicleSensors, own),
            Subscription(LidarScan, own),
        )

    @property
    def is_over(self) -> bool:
        """Whether all that can be reached is mapped, or the agent gave up."""
        return self._drives and self.exploration.report.state in ("idle", "failed")

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Take what was measured; drive on to see more."""
        for item in inbox:
            self._receive(item, now_ns)
        out: list[Outgoing] = []
        if self._drives:
            command = self.exploration.step(now_ns)
            over = self.is_over and command.throttle == 0.0
            out += self._lease.release() if over else self._lease.step(now_ns, command, now_ns)
        else:
            self.exploration.check_scans(now_ns)
        out += self._status(now_ns)
        if now_ns - self._map_ns >= MAP_NS:
            self._map_ns = now_ns
            out += self._map(now_ns)
        return out

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Release the lease: the car stands."""
        del now_ns
        return self._lease.release()

    def _receive(self, item: Incoming, now_ns: int) -> None:
        message = item.message
        if item.call is not None:
            if isinstance(item.call.request, LeaseRequest):
                self._lease.replied(item.call.request, message)
            return
        try:
            if isinstance(message, VehicleSensors):
                self.exploration.sensors(message)
            elif isinstance(message, LidarScan):
                self.exploration.scan(message, now_ns)
        except ScmError as cause:
            event(_log, "map_message", level=logging.WARNING, why=repr(str(cause)))

    def _status(self, now_ns: int) -> list[Outgoing]:
        """Return the status if it is due; its pose is not known on the city's map."""
        report, is_new = self.exploration.report, self.exploration.report != self._last_report
        if is_new:
            self._last_report = report
            if self._on_report is not None:
                self._on_report(report)
        if not is_new and now_ns - self._status_ns < STATUS_NS:
            return []
        self._status_ns = now_ns
        status = AutonomyStatus(
            vehicle=self._vehicle, t_ns=now_ns, state=report.state, reason=report.reason
        )
        return [status]

    def _map(self, now_ns: int) -> list[Outgoing]:
        report, here = self.exploration.report, self.exploration.here()
        detail = f"{self._vehicle} {report.state}: {report.reason}"
        status = PartStatus(station=self.name, t_ns=now_ns, detail=detail)
        grid = self.exploration.grid
        if grid is None or here is None:
            return [status]
        navigator = self.exploration.navigator
        ahead = None if navigator.path is None or navigator.is_done else navigator.path.poses
        rows, columns = grid.cells.shape
        message = OccupancyMap(
            vehicle=self._vehicle,
            t_ns=now_ns,
            rows=rows,
            columns=columns,
            cell_m=grid.cell_m,
            x_m=grid.x_m,
            y_m=grid.y_m,
            car_x_m=here.pose.x,
            car_y_m=here.pose.y,
            car_yaw_rad=here.pose.yaw,
            state=report.state,
            reason=report.reason,
            path=shown(ahead),
            compression="zlib",
            payload=packed(grid.cells.tobytes()),
        )
        return [status, message]
