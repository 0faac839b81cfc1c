"""A car that the world simulates, for requests; no stage of a tick loops over these.

Its dynamics live in the `Garage`, its present state in the `VehicleArrays`, its driver in the
`DriverBatch`.
"""

from dataclasses import dataclass, field

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.v2x.etsi.path import LowFrequencySender
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet
from scm.vehicles.guard import Guard
from scm.vehicles.lights import OFF, Switches
from scm.vehicles.vehicle_status import VehicleStatus
from scm.world.lease import Lease
from scm.world.vehicle_arrays import MODES, VehicleArrays

ELSEWHERE = -1


@dataclass(slots=True, eq=False)
class HostedCar:
    """One hosted car.

    Attributes:
        index: Its vehicle index, in all arrays of the city.
        row: Its place in its fleet; `ELSEWHERE` while another process simulates it.
        guard: Of its commands, while somebody else holds its lease.
        switches: How its headlights and indicators are switched.
        circulates: Whether it drives on by itself after a restart: it came from another city.
        slow_news: Sends the low-frequency container of its CAMs.
    """

    name: str
    car: Car
    car_file: str
    tag_id: int
    index: int
    vehicles: VehicleArrays
    fleet: Fleet
    row: int
    lease: Lease
    guard: Guard | None = None
    switches: Switches = OFF
    circulates: bool = False
    slow_news: LowFrequencySender = field(default_factory=LowFrequencySender)

    kind = "hosted"

    @property
    def pose(self) -> Pose2:
        """Of the rear axle, map frame."""
        if self.row == ELSEWHERE:
            of = self.index
            return Pose2(
                float(self.vehicles.x[of]), float(self.vehicles.y[of]), float(self.vehicles.yaw[of])
            )
        return self.fleet.pose(self.row)

    @property
    def speed(self) -> float:
        """Along the body [m/s]."""
        if self.row == ELSEWHERE:
            return float(self.vehicles.speed[self.index])
        return float(self.fleet.speed[self.row])

    @property
    def mode(self) -> str:
        """As in `VehicleState`."""
        return MODES[self.vehicles.mode[self.index]]

    @property
    def hazard(self) -> bool:
        """Whether its hazard lights flash: its commander was lost."""
        return bool(self.vehicles.hazard[self.index])

    def command_age_ms(self, now_ns: int) -> float | None:
        """Return the age of its leaseholder's newest command; None: there is none."""
        age_ns = None if self.guard is None else self.guard.command_age_ns(now_ns)
        return None if age_ns is None else age_ns / NS_PER_MS

    @property
    def is_sent(self) -> bool:
        """Whether its own driver drives it; else it stands until it is sent or leased."""
        return bool(self.vehicles.driven[self.index])

    @property
    def has_diverged(self) -> bool:
        """Whether its numbers left every physical range: it is frozen."""
        return self.row != ELSEWHERE and bool(self.fleet.status[self.row] != VehicleStatus.OK)
