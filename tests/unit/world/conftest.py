"""A world without a bus: what it is told goes into its next step, what it says is kept."""

import pytest

from scm.clock import NS_PER_MS
from scm.maps.load import load_map
from scm.v2x.exchange import Answer, Incoming
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.join_request import JoinRequest
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.world.part import WorldPart

MAP = load_map("driving_school")
TICK = 20 * NS_PER_MS
SENSED = (LidarScan, VehicleSensors)


class City:
    """A world without a bus: what it is told goes into the next step, what it says is kept.

    Readings of the cars' sensors are simulated only where `sensed`: they take half of the time.
    """

    def __init__(self, *, sensed=False, **given):
        self.part = WorldPart(MAP, **given)
        if not sensed:
            self.part.attach(lambda kind, _where: kind not in SENSED)
        self.world = self.part.world
        self.now = 0
        self.said = []
        self.run(1)

    def run(self, ticks, *messages):
        for i in range(ticks):
            inbox = [Incoming(m, self.now) for m in messages] if i == 0 else []
            self.said += self.part.step(self.now, inbox)
            self.now += TICK

    def run_for(self, seconds, *messages):
        self.run(round(seconds * 50), *messages)

    def ask(self, request):
        before = len(self.said)
        self.run(1, request)
        answers = [out.reply for out in self.said[before:] if isinstance(out, Answer)]
        return answers[0] if answers else None

    def heard(self, kind):
        return [out for out in self.said if isinstance(out, kind)]

    def events(self):
        return [event.name for event in self.heard(CityEvent)]

    def shown(self, name):
        vehicles = self.heard(WorldSnapshot)[-1].vehicles
        return next((v for v in vehicles if v.vehicle == name), None)

    def report(self, name="n7", seq=1, x=1.0, y=0.6, **more):
        rest = {"yaw_rad": 0.0, "speed_mps": 0.0, "yaw_rate_radps": 0.0, **more}
        return VehicleState(
            vehicle=name, t_ns=self.now, seq=seq, x_m=x, y_m=y, steering_rad=0.0, throttle=0.0,
            source="simulated", **rest,
        )  # fmt: skip

    def lease(self, name="n1", **more):
        return self.ask(LeaseRequest(vehicle=name, owner="ann", verb="acquire", **more))

    def join(self, name="n7", session="s1"):
        return self.ask(JoinRequest(vehicle=name, session=session))

    def command(self, lease, seq, throttle=0.5, steering=0.0):
        return DriveCommand(
            vehicle=lease.vehicle, t_ns=0, epoch=lease.epoch, seq=seq, throttle=throttle,
            steering=steering,
        )  # fmt: skip


@pytest.fixture
def make_city():
    return City


@pytest.fixture
def city():
    return City()
