"""All kinds of frames go through the air of a world: to whom, when, and who may send them."""

import itertools
import math
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import MapError
from scm.maps.load import load_map
from scm.maps.radio import with_radio
from scm.maps.radio_check import radio_problems
from scm.records.city_map import RadioChannel
from scm.v2x.etsi.convert import cam_of
from scm.v2x.etsi.events import ACCIDENT, DenmSender, Event
from scm.v2x.messages.cam import CamRx, CamTx
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.cpm import CpmTx
from scm.v2x.messages.denm import DenmTx
from scm.v2x.messages.mapem import MapemTx
from scm.v2x.messages.radio_status import RadioStatus
from scm.v2x.messages.srem import SremTx
from scm.v2x.messages.ssem import SsemTx
from scm.v2x.messages.stop_request import StopRequest
from scm.vehicles.drivers.channel import channel_of, has_arrived
from scm.world.channel_load import ChannelLoad
from scm.world.remote import missed_between
from scm.world.transmission import OF_ROADSIDE, RECEIVED, status, transmit
from scm.world.world import World

MAP = load_map("driving_school")
RSU = "rsu-" + MAP.junctions[0].name


class Air:
    """A world in which frames are put on the air by hand, at times of one's own."""

    def __init__(self, **radio):
        city_map = msgspec.structs.replace(MAP, radio=RadioChannel(**radio))
        self.world = World(city_map, capacity=4)
        self.remote("n7", 1.0, 0.6)

    def remote(self, name, x, y):
        pose = SimpleNamespace(x=x, y=y)
        self.world.cars.remote[name] = SimpleNamespace(name=name, pose=pose, index=0, missed_ns=0)

    def send(self, kind, station, now_ns=0):
        body = warning(station, now_ns) if kind is DenmTx else None
        sent = kind(station=station, t_ns=now_ns, body=body)
        out = transmit(self.world, sent, now_ns)
        heard = [one for one in out if not isinstance(one, CityEvent)]
        return [(type(one), one.receiver) for one in heard]


def warning(station, now_ns):
    sender = DenmSender(station)
    sender.trigger(Event(cause=ACCIDENT, x_m=0.0, y_m=0.0), now_ns)
    return sender.due(now_ns)[0]


@pytest.fixture(scope="module")
def air():
    return Air()


@pytest.mark.parametrize("kind", [CpmTx, DenmTx, SremTx])
def test_every_kind_that_cars_say_reaches_the_roadside_unit(air, kind):
    assert air.send(kind, "n7") == [(RECEIVED[kind], RSU)]


@pytest.mark.parametrize("kind", [MapemTx, SsemTx])
def test_every_kind_that_roadside_units_say_reaches_the_car(air, kind):
    assert air.send(kind, RSU) == [(RECEIVED[kind], "n7")]


@pytest.mark.parametrize("kind", OF_ROADSIDE)
def test_a_car_cannot_say_what_roadside_units_say(air, kind):
    before = air.world.ignored
    assert air.send(kind, "n7") == []
    assert air.world.ignored == before + 1


def test_a_frame_of_nobody_is_counted_and_dropped(air):
    before = air.world.radio.link.counts.unknown
    assert air.send(DenmTx, "ghost") == []
    assert air.world.radio.link.counts.unknown == before + 1


def test_a_late_frame_waits_for_its_time():
    air = Air(delay_ms=70.0)
    assert air.send(DenmTx, "n7") == []
    assert air.world.radio.in_flight.arrived(70 * NS_PER_MS - 1) == []
    assert [out.receiver for out in air.world.radio.in_flight.arrived(70 * NS_PER_MS)] == [RSU]


def test_the_radio_tells_once_a_second_what_became_of_frames(make_city):
    city = make_city(hosted=(("n1", "nigel"),))
    city.run_for(3.0)
    told = city.heard(RadioStatus)
    assert [one.t_ns // NS_PER_S for one in told] == [0, 1, 2, 3]
    heard = [out for out in city.heard(CamRx) if out.t_ns < told[-1].t_ns]
    assert sum(one.delivered for one in told) == len(heard) >= 2


def test_the_cams_of_a_car_tell_how_much_time_passed_without_it(make_city):
    city = make_city(hosted=(("n1", "nigel"),))
    city.run_for(2.0)
    city.now += 480 * NS_PER_MS
    late_ns = city.now
    city.run_for(2.0)
    told = {out.t_ns: out.lost_ns for out in city.heard(CamRx)}
    before, after = (
        {lost for at, lost in told.items() if at < late_ns},
        {lost for at, lost in told.items() if at >= late_ns},
    )
    assert before == {0}
    assert after == {400 * NS_PER_MS}


def test_the_cams_of_an_agents_car_tell_how_long_its_reports_were_too_late(make_city):
    city = make_city()
    city.join("n7")
    for seq in range(1, 6):
        city.run(1, city.report(seq=seq))
    city.run_for(0.5)
    city.run(1, city.report(seq=6))
    body = cam_of(city.report(seq=6), length_m=0.3, width_m=0.175, front_m=0.23)
    city.run(1, CamTx(station="n7", t_ns=city.now, body=body))
    (heard,) = city.heard(CamRx)
    assert heard.lost_ns == 420 * NS_PER_MS


@pytest.mark.parametrize(
    ("after_ms", "steps", "changes", "missed_ms"),
    [
        (20, 1, {}, 0),
        (100, 1, {}, 0),
        (400, 1, {}, 300),
        (400, 4, {}, 0),
        (-50, 1, {}, 0),
        (10_000, 1, {}, 3_000),
        (400, 1, {"source": "odometry"}, 0),
    ],
)
def test_a_car_misses_what_its_reports_leave_out_unless_they_were_lost(
    make_city, after_ms, steps, changes, missed_ms
):
    first = msgspec.structs.replace(make_city().report(seq=5), t_ns=NS_PER_S)
    now_ns = NS_PER_S + after_ms * NS_PER_MS
    second = msgspec.structs.replace(first, seq=5 + steps, t_ns=now_ns, **changes)
    assert missed_between(first, second) == missed_ms * NS_PER_MS


def test_the_channel_is_as_busy_as_the_frames_in_range_make_it():
    lost = np.zeros(2)
    busy = ChannelLoad(RadioChannel(data_rate_mbps=6.0, hidden_share=0.5), 5.0, lost)
    x, hosted = np.array([0.0, 20.0]), np.ones(2, np.bool_)
    for window in range(1, 4):
        busy.note("cam", np.zeros(100), np.zeros(100))
        busy.measure(window * 100 * NS_PER_MS, x, np.zeros(2), hosted, {"rsu-a": (4.0, 0.0)})
    wanted = 100 * 352e-6 / 0.1
    assert busy.ratio == pytest.approx([wanted, 0.0])
    assert busy.ratio_of("rsu-a") == pytest.approx(wanted)
    assert lost[0] == pytest.approx(1.0 - math.exp(-wanted))


def test_a_map_is_told_what_is_wrong_with_its_radio():
    wrong = msgspec.structs.replace(MAP, radio=RadioChannel(loss=1.5, hidden_share=0.1))
    assert [problem.split(":")[0] for problem in radio_problems(wrong)] == [
        "radio.loss", "radio.data_rate_mbps",
    ]  # fmt: skip


def test_settings_of_a_command_replace_those_of_the_map():
    radio = with_radio(MAP, ["loss=0.3", "congestion_control=true", "data_rate_mbps=6"]).radio
    assert radio == RadioChannel(loss=0.3, data_rate_mbps=6.0, congestion_control=True)
    with pytest.raises(MapError, match="expected one of"):
        with_radio(MAP, ["los=0.3"])


def known_at(ms, frames=500, distance_m=3.0, **radio):
    """Return which frames of a sender a driver has heard, so long after they were sent."""
    air = channel_of(RadioChannel(**radio), 5.0, 1, np.zeros((0, 4)))
    age_ns = ms * NS_PER_MS
    return [has_arrived(air, 1, 2, 0, n, distance_m, 0.0, age_ns) for n in range(frames)]


def test_a_driver_never_reads_a_frame_before_its_time():
    radio = {"delay_ms": 100.0, "jitter_ms": 50.0}
    assert not any(known_at(99, **radio))
    assert 0.4 < np.mean(known_at(125, **radio)) < 0.6
    assert all(known_at(150, **radio))


def test_what_a_driver_has_read_it_never_unreads():
    radio = {"delay_ms": 20.0, "jitter_ms": 200.0, "loss": 0.3, "fading_db": 6.0}
    seen = [known_at(ms, **radio) for ms in range(20, 240, 20)]
    assert all(not a or b for one, next_one in itertools.pairwise(seen)
               for a, b in zip(one, next_one, strict=True))  # fmt: skip


def test_drivers_lose_frames_by_distance_as_the_formula_says():
    margin_db = 20.0 * math.log10(5.0 / 8.0)
    wanted = 1.0 - 0.5 * math.erfc(margin_db / (6.0 * math.sqrt(2.0)))
    got = np.mean(known_at(0, 8000, 8.0, fading_db=6.0))
    assert got == pytest.approx(wanted, abs=0.02)


def test_the_cams_tell_what_the_city_knows_of_their_sender(make_city):
    """Car file, lease and stop come from the world: no sender can write them."""
    city = make_city(hosted=(("n1", "nigel"),))
    city.run_for(1.5)
    city.lease("n1", ttl_ms=60_000)
    held_ns = city.now
    city.run_for(1.5)
    city.ask(StopRequest(engaged=True, by="ann"))
    stopped_ns = city.now
    city.run_for(1.5)
    cams = city.heard(CamRx)
    assert {out.stopped for out in cams if out.t_ns >= stopped_ns} == {True}
    assert {out.stopped for out in cams if out.t_ns < stopped_ns} == {False}
    assert {out.by_hand for out in cams if out.t_ns < held_ns} == {False}
    assert next(out for out in cams if out.t_ns >= held_ns).by_hand
    assert {out.car for out in city.heard(CamRx)} == {"nigel"}
    bid = CamTx(station="n1", t_ns=0, body=city.heard(CamRx)[0].body)
    assert not {"car", "by_hand", "stopped", "touches"} & set(bid.__struct_fields__)


def test_a_cam_tells_that_its_sender_touches_something(make_city):
    city = make_city(hosted=(("n1", "nigel"),))
    city.run_for(1.0)
    assert not any(out.touches for out in city.heard(CamRx))
    city.world.impulses.touched_ns["n1"] = city.now
    touched_ns = city.now
    city.run_for(2.0)
    lately = [out.touches for out in city.heard(CamRx) if touched_ns <= out.t_ns]
    assert lately[0]
    assert not lately[-1], "half a second later it touches nothing any more"


def test_hosted_car_that_a_program_drives_receives_frames_while_it_is_leased(make_city):
    city = make_city(hosted=(("n1", "nigel"), ("n2", "nigel")))

    def receivers():
        before = len(city.heard(CamRx))
        city.run_for(2.0)
        return {out.receiver for out in city.heard(CamRx)[before:]}

    assert receivers() == {RSU}
    city.lease("n1")
    load = city.world.radio.load
    load.ratio[:2], load._others = (0.6, 0.3), {"n1": (0.6, 0.6)}
    now = status(city.world, city.now)
    assert now.stations == ("n1", RSU)
    assert now.busy_mean == pytest.approx(0.3), "n1 counts once"
    assert receivers() == {RSU, "n1"}
    assert receivers() == {RSU}, "the lease is lost: it was not renewed"
