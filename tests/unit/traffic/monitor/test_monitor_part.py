"""The monitor part beside the traffic part: quiet in health, loud and stubborn in a fault."""

import msgspec
import pytest

from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart, Subscription
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.message import Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.monitor_reset import MonitorReset
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanRequest
from scm.v2x.messages.spat import Spat

MAP = load_map("driving_school")


class Tampered(BasePart):
    """A traffic part whose wires can be cut or crossed between controller and lamps."""

    def __init__(self):
        self._real = TrafficPart(MAP, "brisk")
        self.name, self.role, self.period_ns = "traffic", "part", self._real.period_ns
        self.subscriptions, self.services = self._real.subscriptions, self._real.services
        self.wires = lambda spat: spat

    def step(self, now_ns, inbox):
        outbox = [self._through(item) for item in self._real.step(now_ns, inbox)]
        return [item for item in outbox if item is not None]

    def _through(self, item):
        return self.wires(item) if isinstance(item, Spat) else item

    def finish(self, now_ns):
        return self._real.finish(now_ns)


def all_green(spat):
    groups = (msgspec.structs.replace(group, colour="green") for group in spat.groups)
    return msgspec.structs.replace(spat, groups=tuple(groups))


def reset(city, **fields):
    return city.call(
        MonitorReset(**{"junction": "crossing", "by": "ann", "reason": "ok", **fields})
    )


def test_a_fault_outlives_the_monitor_and_ends_by_reset_alone():
    with Lockstep([TrafficPart(MAP), MonitorPart(MAP, {"crossing": "stale"})]) as city:
        statuses = city.subscribe(Subscription(MonitorStatus))
        city.run_for(3.0)
        assert {item.message.fault for item in statuses.drain()} == {"stale"}
        assert reset(city).fault is None


@pytest.fixture
def traffic():
    return Tampered()


@pytest.fixture
def city(traffic):
    with Lockstep([traffic, MonitorPart(MAP)]) as running:
        yield running


def messages(box):
    return [item.message for item in box.drain()]


def test_it_finds_no_fault_in_ten_minutes_of_both_plans_and_a_flash(city):
    box = city.subscribe(Subscription(MonitorStatus))
    for plan in ("calm", "brisk", "flash", "calm"):
        city.run_for(150.0)
        city.call(PlanRequest(junction="crossing", plan=plan, by="test"))
    city.run_for(60.0)
    heard = messages(box)
    assert {status.fault for status in heard} == {None}
    assert len(heard) == pytest.approx(2 * 660, abs=5)
    assert heard[0].detail.startswith("card ")


def test_crossed_wires_are_latched_flashed_and_told_within_400_ms(city, traffic):
    city.run_for(12.0)
    spats, events, statuses = (
        city.subscribe(Subscription(k)) for k in (Spat, CityEvent, MonitorStatus)
    )
    traffic.wires = lambda spat: all_green(spat) if spat.mode != "flash" else spat
    city.run_for(0.4)
    assert messages(spats)[-1].mode == "flash"
    fault = [event for event in messages(events) if event.name == "monitor_fault"]
    assert len(fault) == 1
    assert fault[0].severity == "error"
    assert messages(statuses)[-1].fault in ("conflict", "short_clearance")


def test_a_frozen_controller_is_stale_within_a_second(city, traffic):
    city.run_for(12.0)
    box = city.subscribe(Subscription(MonitorStatus))
    traffic.wires = lambda _spat: None
    city.run_for(0.7)
    assert messages(box)[-1].fault == "stale"


def test_a_fault_stays_when_the_signals_are_well_again_until_a_person_resets_it(city, traffic):
    city.run_for(12.0)
    traffic.wires = lambda _spat: None
    city.run_for(1.0)
    traffic.wires = lambda spat: spat
    box, spats, events = (city.subscribe(Subscription(k)) for k in (MonitorStatus, Spat, CityEvent))
    city.run_for(30.0)
    assert {status.fault for status in messages(box)} == {"stale"}
    assert messages(spats)[-1].mode == "flash"
    city.call(PlanRequest(junction="crossing", plan="brisk", by="travel_times.py"))
    assert reset(city, reason="cable fixed").fault is None
    city.run_for(0.2)
    assert messages(spats)[-1].mode == "start"
    told = messages(events)
    names = [event.name for event in told]
    assert names[-3:] == ["monitor_reset", "monitor_clear", "signals_restart"]
    said = "junction crossing restarts all red (the monitor reports no fault any more)"
    assert told[-1].text == said, "and not whoever asked for a plan meanwhile"
    city.run_for(60.0)
    assert messages(box)[-1].fault is None
    assert "plan" in {spat.mode for spat in messages(spats)}


def test_a_controller_that_is_still_silent_after_a_reset_is_stale_within_a_second(city, traffic):
    city.run_for(12.0)
    traffic.wires = lambda _spat: None
    city.run_for(1.0)
    assert reset(city).fault is None
    box = city.subscribe(Subscription(MonitorStatus))
    city.run_for(0.7)
    assert messages(box)[-1].fault == "stale"


def test_a_reset_of_no_fault_says_so_and_forgets_nothing_of_what_was_seen(city):
    city.run_for(12.0)
    events = city.subscribe(Subscription(CityEvent))
    began_ns = reset(city).since_ns
    assert began_ns < city.now_ns
    city.run_for(0.2)
    assert messages(events) == []


@pytest.mark.parametrize("missing", ["by", "reason"])
def test_a_reset_without_a_person_or_a_reason_is_refused(city, missing):
    reply = reset(city, **{missing: " "})
    assert isinstance(reply, Refused)
    assert reply.code == "invalid"


def test_a_reset_of_an_unknown_junction_is_refused_with_the_nearest_name(city):
    reply = reset(city, junction="crosing")
    assert isinstance(reply, Refused)
    assert "did you mean 'crossing'" in reply.detail


def test_signals_of_another_map_are_ignored(city, traffic):
    box = city.subscribe(Subscription(MonitorStatus))
    city.publish(Spat(junction="elsewhere", t_ns=0, seq=0, mode="plan", plan="p", groups=()))
    city.run_for(1.0)
    assert {status.fault for status in messages(box)} == {None}


def test_a_monitor_alone_says_stale_after_five_seconds_and_believes_the_first_signals():
    with Lockstep([MonitorPart(MAP)]) as city:
        box = city.subscribe(Subscription(MonitorStatus))
        city.run_for(5.0)
        assert {status.fault for status in messages(box)} == {None}
        city.run_for(0.2)
        assert messages(box)[-1].fault == "stale"
        city.add(TrafficPart(MAP))
        city.run_for(1.0)
        assert messages(box)[-1].fault is None
