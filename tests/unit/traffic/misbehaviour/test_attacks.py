"""Attacks: what each does to the CAMs of a car, told by a small city, and whether it is found."""

import math
import random
from functools import cache

import msgspec
import pytest
from numpy.testing import assert_allclose

from scm.clock import NS_PER_S
from scm.errors import RunError
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.misbehaviour.attack import Frame, Scene, attack_names, load_attack
from scm.traffic.signals.part import TrafficPart
from scm.v2x.etsi.convert import read_cam
from scm.v2x.messages.cam import CamTx
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.world.part import WorldPart
from tests.unit.traffic.misbehaviour.claims import MAP, RSU, START_NS, detector, ground, track

CARS = ("n1", "n2", "n3")
LIAR = "n2"
ALMOST_TRUE = {"feigned_braking", "acceleration_multiplication"}


@cache
def city_says():
    """Return the CAMs and the truth of half a minute of the driving school."""
    parts = [WorldPart(MAP, 3), TrafficPart(MAP)]
    with Lockstep(parts, start_ns=START_NS) as city:
        cams, truths = (
            city.subscribe(Subscription(CamTx)),
            city.subscribe(Subscription(WorldSnapshot)),
        )
        for name in CARS:
            city.call(SpawnRequest(vehicle=name))
            city.call(RouteRequest(request_id=name, vehicle=name))
        city.run_for(30.0)
        frames = [Frame(m.station, m.t_ns, m.body) for m in (i.message for i in cams.drain())]
        tracks = [
            msgspec.structs.replace(track(seen), t_ns=item.message.t_ns)
            for item in truths.drain()
            for seen in map(Seen, item.message.vehicles)
        ]
    return frames, tracks


class Seen:
    """A car of a snapshot, as `track` wants it."""

    def __init__(self, car):
        self.vehicle, self.t_ns = car.vehicle, 0
        self.x_m, self.y_m, self.yaw_rad, self.speed_mps = (
            car.x_m, car.y_m, car.yaw_rad, car.speed_mps,
        )  # fmt: skip


def lied(name, seed=1):
    """Return all frames in order, those of the liar replaced, and which of them lie."""
    scene = Scene(ground())
    send = load_attack(name).start(random.Random(seed), scene)
    air = []
    for frame in city_says()[0]:
        if frame.station == LIAR:
            air += send(frame)
        else:
            air.append((frame, False))
        scene.received.append(frame)
    return sorted(air, key=lambda sent: sent[0].t_ns)


def reported(air, with_eye=True):
    """Return who is reported."""
    judge, tracks = detector(), list(reversed(city_says()[1] if with_eye else []))
    found = set()
    for frame, _ in air:
        while tracks and tracks[-1].t_ns <= frame.t_ns:
            judge.see(tracks.pop())
        judged = judge.receive(frame.station, RSU, frame.t_ns, frame.body)
        if judged is not None and judged.is_reported:
            found.add(frame.station)
    return found


def of_liar(air):
    return [frame for frame, _ in air if frame.station == LIAR]


@pytest.mark.parametrize("with_eye", [True, False])
def test_an_honest_city_is_left_in_peace(with_eye):
    assert reported([(frame, False) for frame in city_says()[0]], with_eye) == set()


@pytest.mark.parametrize("name", sorted(set(attack_names()) - ALMOST_TRUE))
def test_an_attack_is_found_and_nobody_else_is_blamed(name):
    found = reported(lied(name))
    assert found
    assert all(station.startswith(LIAR) for station in found)


@pytest.mark.parametrize("name", sorted(ALMOST_TRUE))
def test_who_lies_about_acceleration_alone_gets_nobody_else_blamed(name):
    assert reported(lied(name)) <= {LIAR}
    assert any(lies for _, lies in lied(name))


@pytest.mark.parametrize("name", attack_names())
def test_the_same_seed_gives_the_same_lies(name):
    assert lied(name, 4) == lied(name, 4)


@pytest.mark.parametrize("name", attack_names())
def test_every_lie_is_a_message_that_can_be_written_and_read(name):
    for frame, _ in lied(name):
        assert msgspec.json.decode(msgspec.json.encode(frame.body), type=type(frame.body))


def honest():
    return [frame for frame in city_says()[0] if frame.station == LIAR]


def views(frames):
    return [read_cam(frame.body) for frame in frames]


def test_a_constant_offset_is_the_same_each_time_and_a_random_one_is_not():
    true = views(honest())
    for name, is_same in (("constant_position_offset", True), ("random_position_offset", False)):
        told = views(of_liar(lied(name)))
        offsets = [(a.x_m - b.x_m, a.y_m - b.y_m) for a, b in zip(told, true, strict=True)]
        assert all(1.4 < abs(d) < 5.01 for offset in offsets for d in offset)
        assert (max(offsets)[0] - min(offsets)[0] < 0.01) == is_same


def test_frozen_and_zero_speeds():
    assert {view.speed_mps for view in views(of_liar(lied("zero_speed")))} == {0.0}
    frozen = views(of_liar(lied("frozen_speed")))
    assert len({view.speed_mps for view in frozen[-20:]}) == 1


def test_a_car_that_stands_and_says_so_does_not_lie():
    sent = [one for one in lied("zero_speed") if one[0].station == LIAR]
    true = {frame.t_ns: read_cam(frame.body).speed_mps for frame in honest()}
    assert all(not lies for frame, lies in sent if abs(true[frame.t_ns]) < 0.05)
    assert any(lies for _, lies in sent)


def test_time_delay_tells_old_news_as_new():
    told, true = of_liar(lied("time_delay")), honest()
    late_s = (told[5].t_ns - true[5].t_ns) / NS_PER_S
    assert 2.0 <= late_s <= 4.0
    assert read_cam(told[5].body)[1:] == read_cam(true[5].body)[1:]
    assert told[5].body.generation_delta_time != true[5].body.generation_delta_time


def test_denial_of_service_tells_each_cam_several_times():
    assert len(honest()) * 3 <= len(of_liar(lied("denial_of_service"))) <= len(honest()) * 5


def test_ghosts_have_numbers_of_their_own():
    ghosts = {frame.body.station_id for frame, lies in lied("congestion_sybil") if lies}
    assert 4 <= len(ghosts) <= 6
    assert honest()[0].body.station_id not in ghosts


def test_replayed_cams_are_another_cars_under_ones_own_number():
    others = {
        (frame.body.position.latitude, frame.body.position.longitude)
        for frame in city_says()[0]
        if frame.station != LIAR
    }
    lies = [frame for frame, is_lie in lied("data_replay") if is_lie]
    assert lies
    for frame in lies:
        place = frame.body.position
        assert (place.latitude, place.longitude) in others
        assert frame.body.station_id == honest()[0].body.station_id


def test_a_mirrored_car_is_as_far_beyond_the_edge_as_it_was_before_it():
    known = ground()
    for told, true in zip(views(of_liar(lied("position_mirroring"))), views(honest()), strict=True):
        x, y, yaw, half = known.road_near(true.x_m, true.y_m)
        lateral = [(v.y_m - y) * math.cos(yaw) - (v.x_m - x) * math.sin(yaw) for v in (told, true)]
        assert_allclose(sum(lateral), 2.0 * half, atol=3e-3)


def test_an_unknown_attack_is_named():
    with pytest.raises(RunError, match="zero_spee"):
        load_attack("zero_spee")
