"""The dead-man of every driven car, hosted or with an agent: commands over the bus, then silence.

Ages count from the arrival of the last command to the state report that first shows the effect;
both take a step of 20 ms at most.
"""

import pytest

from scm.clock import NS_PER_MS
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart

STEP_MS = 20
BLINK_MS = 500  # for half of each second the hazard lights are dark
COMMAND_EVERY_S = 0.05
STEERING = 0.2


class Driver:
    """Somebody far away who leases one car, and watches what it reports."""

    def __init__(self, city, vehicle):
        self.city, self.vehicle = city, vehicle
        self._box = city.subscribe(Subscription(VehicleState, {"vehicle": vehicle}))
        self._events = city.subscribe(Subscription(CityEvent))
        self._seq = 0
        self.epoch = 0
        self.states = []

    def lease(self):
        reply = self.city.call(
            LeaseRequest(vehicle=self.vehicle, owner="ann", verb="acquire", ttl_ms=60_000)
        )
        assert isinstance(reply, LeaseReply)
        self.epoch = reply.epoch

    def command(self, throttle=0.4):
        self._seq += 1
        command = DriveCommand(
            vehicle=self.vehicle,
            t_ns=self.city.now_ns,
            epoch=self.epoch,
            seq=self._seq,
            throttle=throttle,
            steering=STEERING,
        )
        self.city.publish(command)

    def drive(self, times):
        for _ in range(times):
            self.command()
            self.city.run_for(COMMAND_EVERY_S)

    def watch(self, span_s):
        """Let time pass; return (age of each report since now in ms, report)."""
        began_ns = self.city.now_ns
        self._box.drain()
        self.city.run_for(span_s)
        self.states = [item.message for item in self._box.drain()]
        return [((s.t_ns - began_ns) / NS_PER_MS, s) for s in self.states]

    def newest(self):
        return self.watch(0.02)[-1][1]

    def events(self):
        return [item.message.name for item in self._events.drain()]


@pytest.fixture(params=["hosted", "agent"])
def driver(request):
    hosted = (("n1", "nigel"),) if request.param == "hosted" else ()
    city_map = load_map("driving_school")
    with Lockstep([WorldPart(city_map, hosted=hosted)]) as city:
        if not hosted:
            city.add(AgentPart("n1"))
        driver = Driver(city, "n1")
        city.run_for(1.5)
        driver.lease()
        driver.drive(20)
        yield driver


def first(reports, condition):
    return next(age_ms for age_ms, state in reports if condition(state))


def test_a_leaseholder_drives_the_car(driver):
    state = driver.newest()
    assert (state.mode, state.epoch) == ("drive", driver.epoch)
    assert state.speed_mps > 0.08


def test_silence_holds_then_stops_then_loses_the_car(driver):
    driver.command()
    reports = driver.watch(1.5)
    assert 150 <= first(reports, lambda s: s.mode == "hold") <= 150 + 2 * STEP_MS
    assert 300 <= first(reports, lambda s: s.mode == "stop") <= 300 + 2 * STEP_MS
    hazards = first(reports, lambda s: {"left", "right"} <= set(s.lights))
    assert 1000 <= hazards <= 1000 + BLINK_MS + 2 * STEP_MS
    assert all(s.throttle == 0.0 for age_ms, s in reports if age_ms >= 150 + 2 * STEP_MS)
    assert reports[-1][1].speed_mps == pytest.approx(0.0, abs=1e-3)


def test_the_steering_is_held_while_the_car_stops(driver):
    driver.command()
    held = driver.newest().steering_rad
    reports = driver.watch(0.6)
    assert held > 0.05
    assert [s.steering_rad for _, s in reports] == pytest.approx([held] * len(reports), abs=2e-3)


def test_commands_faster_than_the_dead_man_never_wake_it(driver):
    modes = set()
    for _ in range(20):
        driver.command()
        modes |= {state.mode for _, state in driver.watch(0.14)}
    assert modes == {"drive"}


def test_a_car_that_was_lost_does_not_go_on_when_its_commander_is_back(driver):
    driver.watch(1.2)
    driver.drive(20)
    assert driver.newest().speed_mps == pytest.approx(0.0, abs=1e-3)


def test_repeated_and_older_commands_are_silence(driver):
    driver.command()
    driver._seq -= 10
    for _ in range(8):
        driver.command()
        driver.city.run_for(COMMAND_EVERY_S)
    assert driver.newest().mode == "stop"
