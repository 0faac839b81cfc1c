"""A car that the world itself simulates: its row of a fleet, its owner, and what it knows.

Its dynamics live in the `Garage`; who may drive it is its lease; what it believes of signals and of
other cars comes over the radio like everybody's.
"""

from dataclasses import dataclass, field

from scm.geometry import Pose2
from scm.v2x.cam_trigger import CamTrigger
from scm.vehicles.car import Car
from scm.vehicles.drivers.heard import HeardCars
from scm.vehicles.drivers.trips import Trips
from scm.vehicles.fleet import Fleet, VehicleStatus
from scm.vehicles.guard import Guard
from scm.vehicles.lights import OFF, Switches
from scm.vehicles.sensor import Reading, Sampler
from scm.vehicles.signal_view import SignalView
from scm.world.lease import Lease


@dataclass(slots=True)
class HostedCar:
    """One hosted car.

    Attributes:
        slot: Its number in the contact space.
        others: The cars it has heard of.
        trips: Where it was sent, and the driver that takes it there; None before the first trip.
        is_sent: Whether its own driver drives it; else it stands until it is sent or leased.
        mode: As in `VehicleState`.
        hazard: Whether its hazard lights flash: its commander was lost.
        switches: How its headlights and indicators are switched.
    """

    name: str
    car: Car
    car_file: str
    tag_id: int
    slot: int
    fleet: Fleet
    row: int
    lease: Lease
    signals: SignalView
    guard: Guard
    others: HeardCars = field(default_factory=HeardCars)
    trips: Trips | None = None
    is_sent: bool = False
    mode: str = "idle"
    hazard: bool = False
    switches: Switches = OFF
    seq: int = 0
    diverged: bool = False
    cam_trigger: CamTrigger = field(default_factory=CamTrigger)
    samplers: dict[str, Sampler] = field(default_factory=dict)
    readings: dict[str, Reading] = field(default_factory=dict)

    kind = "hosted"

    @property
    def pose(self) -> Pose2:
        """Of the rear axle, map frame."""
        return self.fleet.pose(self.row)

    @property
    def speed(self) -> float:
        """Along the body [m/s]."""
        return float(self.fleet.speed[self.row])

    @property
    def has_diverged(self) -> bool:
        """Whether its numbers left every physical range: it is frozen."""
        return bool(self.fleet.status[self.row] != VehicleStatus.OK)

    def command(self, throttle: float, steering: float) -> None:
        """Tell motor and servo, both -1 to 1."""
        self.fleet.throttle[self.row] = throttle
        self.fleet.steering[self.row] = steering
