"""What makes a measurement void: said with how long it lasted, and over when it is over."""

import pytest

from scm.clock import NS_PER_S
from scm.disturbances import Disturbances
from scm.errors import VoidError
from scm.fleet import City, LockstepLink
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.exchange import Incoming
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.spat import Spat
from scm.world.part import WorldPart


def ns(time_s):
    return round(time_s * NS_PER_S)


def spat(time_s, mode="plan"):
    return Spat(junction="crossing", t_ns=ns(time_s), seq=0, mode=mode, plan="calm", groups=())


def world(time_s, lost_s):
    return PartStatus(station="world", t_ns=ns(time_s), cars=6, lost_s=lost_s)


def heard(*messages, look_s=None):
    watch = Disturbances()
    for message, time_s in messages:
        watch.receive(Incoming(message, ns(time_s)))
    if look_s is not None:
        watch.check_silence(ns(look_s))
    return watch


def spats(first_s, last_s, mode="plan"):
    steps = range(round(first_s * 10), round(last_s * 10))
    return [(spat(step / 10, mode), step / 10) for step in steps]


def texts(watch):
    return [one.text for one in watch.now()]


def test_a_quiet_city_disturbs_nobody():
    watch = heard(*spats(0, 20), (world(1, 0.0), 1), (world(20, 0.001), 20), look_s=20.5)
    assert watch.now() == ()
    assert watch.void_reasons(ns(2), ns(19)) == ()


def test_a_flash_voids_what_it_overlaps_and_nothing_else():
    watch = heard(*spats(0, 10), *spats(10, 160, "flash"), *spats(160, 200))
    assert watch.now() == ()
    (why,) = watch.void_reasons(ns(2), ns(165))
    assert why == "the signals of crossing flash for 150.0 of 163.0 s"
    assert watch.void_reasons(ns(161), ns(190)) == ()
    assert watch.void_reasons(ns(1), ns(9)) == ()


def test_flashes_of_one_trip_are_added_up():
    watch = heard(*spats(0, 2, "flash"), *spats(2, 8), *spats(8, 10, "flash"), *spats(10, 11))
    assert watch.void_reasons(0, ns(10)) == ("the signals of crossing flash for 4.0 of 10.0 s",)


def test_a_latched_monitor_is_named_until_it_is_reset():
    status = {"junction": "crossing", "since_ns": ns(3)}
    latched = MonitorStatus(
        t_ns=ns(3), fault="stale", detail="no signal phase for 536 ms", **status
    )
    watch = heard((latched, 3))
    said = "the monitor of crossing reports stale: no signal phase for 536 ms"
    assert texts(watch) == [said]
    assert watch.void_reasons(0, ns(10)) == (f"{said} for 7.0 of 10.0 s",)
    watch.receive(Incoming(MonitorStatus(t_ns=ns(5), fault=None, **status), ns(5)))
    assert texts(watch) == []
    assert watch.void_reasons(0, ns(10)) == (f"{said} for 2.0 of 10.0 s",)


def test_signals_that_fall_silent_are_noticed_though_nobody_looked_meanwhile():
    watch = heard(*spats(0, 5), *spats(9, 12))
    assert watch.void_reasons(0, ns(12)) == (
        "the signals of crossing are silent for 4.1 of 12.0 s",
    )
    assert texts(heard(*spats(0, 5), look_s=7)) == ["the signals of crossing are silent"]


def test_a_lost_part_is_lost_until_one_of_its_name_is_there():
    def presence(session, *, alive, station="traffic", role="part"):
        return Presence(role=role, station=station, session=session, alive=alive)

    gone = (presence("a", alive=False), 3)
    watch = heard((presence("a", alive=True), 0), gone)
    assert texts(watch) == ["the part traffic is gone"]
    watch.receive(Incoming(presence("b", alive=True), ns(5)))
    assert texts(watch) == []
    assert watch.void_reasons(ns(1), ns(4)) == ("the part traffic is gone for 1.0 of 3.0 s",)
    both = heard((presence("a", alive=True), 0), (presence("b", alive=True), 1), gone)
    assert texts(both) == []  # its successor was there already
    others = [("n7", "v"), ("script", "client"), ("record", "part")]
    for station, role in others:
        one = presence("a", alive=False, station=station, role=role)
        assert texts(heard((one, 3))) == []


def test_a_world_that_is_late_voids_by_how_much_of_the_trip_was_lost():
    watch = heard(*[(world(t, max(0.0, 0.2 * (t - 10))), t) for t in range(1, 13)])
    assert watch.now() == ()  # two seconds are no news, but count
    (why,) = watch.void_reasons(ns(2), ns(12))
    assert why == "this computer did not simulate 0.4 of 10.0 s"
    assert watch.void_reasons(ns(2), ns(10)) == ()
    assert watch.void_reasons(ns(2), ns(52)) == ()  # 0.8 % of it
    watch.receive(Incoming(world(13, 0.6), ns(13)))
    assert texts(watch) == [
        "this computer is too slow for 6 cars: it simulates 0.80 s of each second"
    ]
    advice = watch.now()[0].advice
    assert "with at most 4 cars (`--hosted`, `--agents`)" in advice
    assert "`scm up --without eye,camera,record`" in advice
    assert watch.now()[0].start_ns == ns(10)
    for t in range(14, 18):
        watch.receive(Incoming(world(t, 0.6), ns(t)))
    assert len(watch.now()) == 1
    watch.receive(Incoming(world(18, 0.6), ns(18)))
    assert watch.now() == ()
    assert watch.recent(ns(12))[0].end_ns == ns(13)
    assert watch.recent(ns(14)) == ()


def test_another_world_counts_what_it_lost_from_nought():
    watch = heard((world(1, 5.0), 1), (world(2, 0.0), 2), (world(3, 0.0), 3))
    assert watch.void_reasons(0, ns(3)) == ()


def test_news_are_each_beginning_and_each_end_once():
    watch = heard(*spats(0, 1, "flash"), *spats(1, 2))
    begun, over = watch.news()
    assert (begun.kind, begun.end_ns) == ("flash", None)
    assert (over.kind, over.end_ns) == ("flash", ns(1))
    assert watch.news() == []


@pytest.fixture
def lockstep():
    city_map = load_map("driving_school")
    traffic = TrafficPart(city_map)
    with Lockstep([WorldPart(city_map), traffic, MonitorPart(city_map)]) as lockstep:
        lockstep.traffic = traffic
        yield lockstep


def test_a_script_cannot_read_a_travel_time_of_flashing_signals_by_mistake(lockstep):
    city = City(LockstepLink(lockstep))
    car = city.spawn()
    counts = car.drive("east_loop")
    city.wait([counts])
    assert counts.void == ()
    assert counts.travel_time_s == counts.duration_s
    spoilt = car.drive("west_loop", "east_loop")
    city.use_plan("flash", reason="a test")
    assert city.wait_for_disturbance(5.0).kind == "flash"
    city.wait([spoilt], timeout_s=300.0)
    with pytest.raises(VoidError, match=r"trip of \w+ is void: the signals of crossing flash for"):
        _ = spoilt.travel_time_s
    assert spoilt.duration_s > 1.0
    city.use_plan("calm")
    city.wait_until_undisturbed(30.0)
    assert city.disturbances == ()
    again = car.drive("west_loop", "east_loop")
    city.wait([again])
    assert again.travel_time_s > 1.0


def test_a_part_that_dies_during_a_trip_makes_it_void(lockstep):
    city = City(LockstepLink(lockstep))
    journey = city.spawn().drive("east_loop")
    assert city.wait_for_disturbance(1.0) is None
    lockstep.kill(lockstep.traffic)
    city.wait([journey], timeout_s=300.0)
    said = [one.text for one in city.disturbances]
    assert "the part traffic is gone" in said
    assert "the signals of crossing are silent" in said
    assert any("the part traffic is gone for" in why for why in journey.void)
