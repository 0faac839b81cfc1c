"""Cars at the driving school: every policy lets them go on, and actuated beats fixed time."""

from functools import cache

import pytest

from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.message import Refused
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.trip import Trip
from scm.world.part import WorldPart

MAP = load_map("driving_school")
PLATOON = ("a", "c", "e")  # one behind the other on one loop: all come from one side at a time
SPAN_S = 45.0


@cache
def driven(policy, plan):
    """Return each car's way [m], the longest wait at a signal [s], and the monitor's verdicts."""
    parts = [WorldPart(MAP, 1), TrafficPart(MAP, plan, policy=policy), MonitorPart(MAP)]
    ways, waits, worst = {}, {}, 0.0
    with Lockstep(parts) as city:
        trips, verdicts = (
            city.subscribe(Subscription(Trip)),
            city.subscribe(Subscription(MonitorStatus)),
        )
        for place in PLATOON:
            assert not isinstance(city.call(SpawnRequest(vehicle=place, spawn=place)), Refused)
            assert not isinstance(city.call(RouteRequest(vehicle=place)), Refused)
        city.run_for(SPAN_S)
        for item in trips.drain():
            trip = item.message
            ways[trip.vehicle] = trip.done_m
            is_held = trip.waiting_for == "signal"
            waits[trip.vehicle] = waits.get(trip.vehicle, 0.0) + 0.5 if is_held else 0.0
            worst = max(worst, waits[trip.vehicle])
        faults = {item.message.fault for item in verdicts.drain()}
    return ways, worst, faults


CASES = [
    ("fixed", "calm"),
    ("fixed", "brisk"),
    ("actuated", None),
    ("max_pressure", None),
    ("priority", None),
]


@pytest.mark.parametrize(("policy", "plan"), CASES)
def test_cars_go_on_under_a_policy_and_the_monitor_is_content(policy, plan):
    ways, worst_s, faults = driven(policy, plan)
    assert len(ways) == len(PLATOON)
    assert min(ways.values()) > 5.0
    assert worst_s < 40.0
    assert faults == {None}


def test_actuated_beats_fixed_time_where_all_come_from_one_side():
    means = {case: sum(driven(*case)[0].values()) / SPAN_S / len(PLATOON) for case in CASES}
    fixed = max(means["fixed", "calm"], means["fixed", "brisk"])
    assert means["actuated", None] > 1.08 * fixed
