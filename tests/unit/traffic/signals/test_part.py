"""The traffic part in a city on a stepped clock: what it tells, serves and does for the monitor."""

from itertools import pairwise

import msgspec
import pytest

from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.etsi.convert import colours_of
from scm.v2x.message import Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.signal_request import SignalRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spatem import SpatemTx

MAP = load_map("driving_school")
GROUPS = {"south_east": 1, "south_west": 2}


def messages(box):
    return [item.message for item in box.drain()]


def colours(spat):
    return {group.group: group.colour for group in spat.groups}


class Told:
    """Everything a city tells of its signals."""

    def __init__(self, city):
        self._boxes = [city.subscribe(Subscription(kind)) for kind in (Spat, SpatemTx, CityEvent)]

    def read(self):
        return tuple(messages(box) for box in self._boxes)


@pytest.fixture
def city():
    with Lockstep([TrafficPart(MAP, "brisk")]) as running:
        yield running


def ask(city, plan, **fields):
    return city.call(
        PlanRequest(junction=fields.pop("junction", "crossing"), plan=plan, by="test", **fields)
    )


def status(city, fault):
    return MonitorStatus(junction="crossing", t_ns=city.now_ns, fault=fault, since_ns=city.now_ns)


def test_spat_goes_out_ten_times_a_second_and_spatem_twice_and_on_change(city):
    told = Told(city)
    city.run_for(20.0)
    spats, spatems, _ = told.read()
    assert len(spats) == 201
    changes = [now.t_ns for before, now in pairwise(spats) if colours(before) != colours(now)]
    sent = [spatem.t_ns for spatem in spatems]
    assert len(changes) >= 4
    assert set(changes) <= set(sent)
    assert max(b - a for a, b in pairwise(sent)) == 500_000_000
    assert {spatem.station for spatem in spatems} == {"rsu-crossing"}


def test_the_air_tells_the_same_as_the_native_message(city):
    told = Told(city)
    city.run_for(20.0)
    spats, spatems, _ = told.read()
    by_time = {spat.t_ns: spat for spat in spats}
    for spatem in spatems:
        spat, heard = by_time[spatem.t_ns], colours_of(spatem.body)
        assert {name: heard[number].colour for name, number in GROUPS.items()} == colours(spat)


def test_both_groups_get_their_green_and_never_together(city):
    told = Told(city)
    city.run_for(60.0)
    shown = [tuple(colours(spat).values()) for spat in told.read()[0]]
    assert ("green", "red") in shown
    assert ("red", "green") in shown
    assert all("red" in pair for pair in shown)
    assert shown[0] == ("red", "red")


def test_the_plan_of_the_map_is_used_when_none_is_given():
    with Lockstep([TrafficPart(MAP)]) as city:
        told = Told(city)
        city.run_for(0.1)
        assert told.read()[0][0].plan == MAP.junctions[0].plan


def test_a_plan_that_is_asked_for_comes_with_the_next_cycle_and_is_told(city):
    told = Told(city)
    city.run_for(10.0)
    reply = ask(city, "calm", reason="rush hour")
    assert reply == PlanReply(junction="crossing", plan="brisk", pending="calm")
    city.run_for(20.0)
    event = next(event for event in told.read()[2] if event.name == "plan_changed")
    assert "runs plan calm, before brisk (test asked: rush hour)" in event.text
    assert ask(city, "calm") == PlanReply(junction="crossing", plan="calm")


def test_a_wish_that_no_plan_can_grant_is_named_as_the_cause_of_the_policy(city):
    told = Told(city)
    city.call(SignalRequest(junction="crossing", verb="hold", groups=("south_east",), by="ada"))
    city.run_for(40.0)
    event = next(event for event in told.read()[2] if event.name == "plan_changed")
    assert "runs policy actuated, before brisk (hold of ada)" in event.text


@pytest.mark.parametrize(
    ("plan", "junction", "said"),
    [
        ("brisc", "crossing", "did you mean 'brisk'"),
        ("calm", "crosing", "did you mean 'crossing'"),
    ],
)
def test_an_unknown_name_is_refused_with_the_nearest_one(city, plan, junction, said):
    reply = ask(city, plan, junction=junction)
    assert isinstance(reply, Refused)
    assert reply.code == "not_found"
    assert said in reply.detail


def test_a_person_may_flash_the_junction_and_end_it_with_a_plan(city):
    city.run_for(10.0)
    told = Told(city)
    assert ask(city, "flash", reason="works").plan == "flash"
    city.run_for(0.2)
    spats, spatems, events = told.read()
    assert set(colours(spats[-1]).values()) == {"flashing_red"}
    assert "failureFlash" in spatems[-1].body.status
    assert [event.name for event in events] == ["signals_flash"]
    assert "works" in events[0].text
    assert ask(city, "brisk").plan == "brisk"
    city.run_for(4.0)
    spats, _, events = told.read()
    assert set(colours(spats[-1]).values()) == {"red"}
    assert [event.name for event in events] == ["signals_restart"]


def test_the_end_of_flash_changes_nothing_of_what_was_wanted(city):
    hold = SignalRequest(junction="crossing", verb="hold", groups=("south_east",), by="ada")
    city.run_for(10.0)
    ask(city, "calm")
    city.call(msgspec.structs.replace(hold, expires_s=20.0))
    told = Told(city)
    ask(city, "flash")
    city.run_for(1.0)
    ended = ask(city, "", reason="works are over")
    assert (ended.plan, ended.pending) == ("brisk", "actuated")
    city.run_for(60.0)  # meanwhile the hold has lapsed
    spats, _, events = told.read()
    assert (spats[-1].mode, spats[-1].plan) == ("plan", "calm")
    said = next(event.text for event in events if event.name == "signals_restart")
    assert said == "junction crossing restarts all red (test asked: works are over)"


def test_a_policy_that_flashes_ends_as_any_flash():
    with Lockstep([TrafficPart(MAP, "brisk", policy="flashing")]) as city:
        city.run_for(5.0)
        assert ask(city, "").plan == "brisk"


@pytest.mark.parametrize("plan", ["calm", "flash", ""])
def test_nobody_changes_what_runs_without_a_name(city, plan):
    reply = city.call(PlanRequest(junction="crossing", plan=plan, by=" "))
    assert (reply.code, "by: got nothing" in reply.detail) == ("invalid", True)


def test_a_fault_of_the_monitor_makes_it_flash_until_the_monitor_is_clear(city):
    city.run_for(10.0)
    told = Told(city)
    city.publish(status(city, "conflict"))
    city.run_for(0.1)
    assert set(colours(told.read()[0][-1]).values()) == {"flashing_red"}
    assert ask(city, "calm").plan == "flash"
    city.run_for(1.0)
    assert told.read()[0][-1].mode == "flash"
    city.publish(status(city, None))
    city.run_for(0.2)
    spat = told.read()[0][-1]
    assert spat.mode == "start"
    assert set(colours(spat).values()) == {"red"}


def test_a_monitor_that_falls_silent_counts_as_a_fault(city):
    city.publish(status(city, None))
    told = Told(city)
    city.run_for(3.0)
    assert told.read()[0][-1].mode != "flash"
    city.run_for(0.2)
    spats, _, events = told.read()
    assert spats[-1].mode == "flash"
    assert "fell silent" in events[-1].text
    city.publish(status(city, None))
    city.run_for(0.2)
    assert told.read()[0][-1].mode == "start"


def test_a_monitor_of_another_city_is_ignored(city):
    told = Told(city)
    strange = MonitorStatus(junction="elsewhere", t_ns=0, fault="conflict", since_ns=0)
    city.publish(strange)
    city.run_for(1.0)
    assert told.read()[0][-1].mode == "start"


def test_a_map_without_junctions_needs_no_signals():
    bare = msgspec.structs.replace(MAP, junctions=())
    with Lockstep([TrafficPart(bare), MonitorPart(bare)]) as city:
        told = Told(city)
        city.run_for(1.0)
        assert told.read() == ([], [], [])
