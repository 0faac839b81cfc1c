"""What the world is asked: spawn, join, remove, route, lease, stop; refusals say why."""

import math

import pytest

from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.scenery.bodies import car_body
from scm.v2x.exchange import Answer
from scm.v2x.message import Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.echo_request import EchoReply, EchoRequest
from scm.v2x.messages.join_request import JoinRequest
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.vehicles.car import load_car
from scm.world.requests import is_free, reply_to
from scm.world.vehicle_arrays import Numbers
from scm.world.world import World

MAP = load_map("driving_school")


@pytest.fixture(scope="module")
def room():
    return World(load_map("parking_school_obstacles"), capacity=2)


def test_the_first_step_tells_what_the_city_is(city):
    assert city.heard(WorldDefinition)[0].map == MAP


def test_who_asked_in_vain_for_what_the_city_is_hears_it_ten_seconds_later(city):
    first = city.heard(WorldDefinition)
    city.run_for(11.0)
    told = city.heard(WorldDefinition)
    assert len(told) == len(first) + 1
    assert told[-1] is told[0]


def test_a_spawned_car_stands_at_the_wished_place_with_the_lowest_free_tag(city):
    reply = city.ask(SpawnRequest(vehicle="n1", spawn="b"))
    wished = city.world.roads.spawn_pose("b")
    assert (reply.x_m, reply.y_m) == pytest.approx((wished.x, wished.y), abs=1e-3)
    assert reply.tag_id == MAP.first_vehicle_tag_id


@pytest.mark.parametrize("x_m", ["1.384", "-0.0"])
def test_a_car_can_be_put_to_coordinates(city, x_m):
    reply = city.ask(SpawnRequest(spawn=f"{x_m},0.655,315"))
    assert (reply.x_m, reply.y_m) == pytest.approx((float(x_m), 0.655), abs=1e-3)
    assert reply.yaw_rad == pytest.approx(-math.pi / 4)
    assert city.ask(SpawnRequest(spawn=f"{x_m},0.655,315")).code == "occupied"


@pytest.mark.parametrize(
    ("place", "has_room"),
    [("-0.7,0.3,0", True), ("0.86,0.31,0", False), ("0.5,0.31,0", False), ("0.5,0.05,0", True)],
)
def test_no_car_is_put_onto_a_box(room, place, has_room):
    reply = reply_to(room, SpawnRequest(spawn=place), 0)
    assert getattr(reply, "code", None) == (None if has_room else "occupied")
    if has_room:
        room.remove(reply.vehicle)
    else:
        assert "a wall or a box" in reply.detail


def test_a_tag_is_given_again_after_its_car_left(city):
    first, second = (city.ask(SpawnRequest()) for _ in range(2))
    city.ask(RemoveRequest(vehicle=first.vehicle))
    assert city.ask(SpawnRequest()).tag_id == first.tag_id != second.tag_id


def test_a_car_keeps_the_tag_that_is_glued_onto_its_roof(city):
    joined = city.ask(JoinRequest(vehicle="r1", session="s", kind="real", tag_id=2))
    others = [city.ask(SpawnRequest()).tag_id for _ in range(2)]
    assert (joined.tag_id, others) == (2, [1, 3])
    assert city.world.cars.remote["r1"].tag_id == 2
    city.ask(RemoveRequest(vehicle="r1"))
    assert city.ask(JoinRequest(vehicle="r2", session="s", tag_id=2)).tag_id == 2


def test_a_car_gets_the_tag_that_is_printed_for_its_name_whenever_it_comes(city):
    assert city.ask(SpawnRequest(vehicle="n3")).tag_id == 3
    assert city.ask(SpawnRequest(vehicle="blue")).tag_id == 1
    city.ask(RemoveRequest(vehicle="n3"))
    assert city.ask(JoinRequest(vehicle="n3", session="s")).tag_id == 3


def test_a_car_whose_tag_another_wears_gets_a_free_one_and_a_warning(city):
    city.ask(JoinRequest(vehicle="r1", session="s", tag_id=2))
    assert city.ask(SpawnRequest(vehicle="n2")).tag_id == 1
    (event,) = [one for one in city.heard(CityEvent) if one.name == "other_tag"]
    assert event.text == "n2 has tag 1: r1 wears tag 2, which is printed for it"


def test_numbers_are_given_once_however_they_come_back():
    numbers = Numbers(1, never={0, 3})
    assert [numbers.acquire(), numbers.acquire()] == [1, 2]
    numbers.release(1)
    assert (numbers.claim(1), numbers.is_free(1)) == (1, False)
    numbers.release(1)
    assert [numbers.acquire(), numbers.acquire(), numbers.acquire()] == [1, 4, 5]


def test_the_agent_that_asks_again_after_its_death_gets_its_tag_again(city):
    city.ask(JoinRequest(vehicle="r1", session="s1", tag_id=9))
    city.run(1, Presence(role="v", station="r1", session="s1", alive=False))
    assert city.ask(JoinRequest(vehicle="r1", session="s2", tag_id=9)).tag_id == 9


def test_nobody_joins_by_the_session_of_another_agent(city):
    city.run(1, Presence(role="v", station="n7", session="s7", alive=True))
    for before in (None, city.join("n7", "s7")):
        refused = city.ask(JoinRequest(vehicle="n9", session="s7"))
        assert isinstance(refused, Refused), before
        assert refused.code == "owned"
        assert refused.detail == "session 's7' is that of n7, expected that of n9's agent"
    assert city.join("n7", "s7").vehicle == "n7", "its own agent may ask again"
    city.run(1, Presence(role="v", station="n7", session="s7", alive=False))
    assert city.join("n9", "s7").vehicle == "n9", "nobody has it any more"


def test_a_car_of_ones_own_folder_comes_by_its_name(make_city, monkeypatch):
    monkeypatch.setenv("SCM_CARS", "examples/own_car")
    city = make_city()
    joined = city.ask(JoinRequest(vehicle="b1", session="s", kind="real", car="buggy"))
    assert joined.vehicle == "b1"
    assert city.world.cars.remote["b1"].car.value("body.mass_kg") == load_car("buggy").value(
        "body.mass_kg"
    )
    assert car_body("buggy") != car_body("nigel")


def test_a_car_that_cannot_follow_the_lanes_is_announced_once_a_file(make_city):
    city = make_city()
    for name in ("f1", "f2"):
        city.ask(SpawnRequest(vehicle=name, car="f1tenth"))
    city.ask(SpawnRequest(vehicle="n1"))
    (said,) = [event for event in city.heard(CityEvent) if event.name == "lanes_misfit"]
    assert (said.vehicle, said.severity) == ("f1", "warning")
    assert said.text.startswith("f1, a f1tenth: it is 0.27 m wide, wider than 4 lanes")


def test_cars_without_a_name_get_one_each(city):
    assert [city.ask(SpawnRequest()).vehicle for _ in range(3)] == ["n1", "n2", "n3"]


@pytest.mark.parametrize(
    ("request_", "code", "words"),
    [
        (SpawnRequest(vehicle="n1"), "owned", "n1"),
        (SpawnRequest(vehicle="N 2"), "invalid", "N 2"),
        (SpawnRequest(car="nigle"), "invalid", "did you mean 'nigel'"),
        (SpawnRequest(car="/etc/passwd.toml"), "invalid", "expected one of"),
        (SpawnRequest(spawn="zz"), "invalid", "zz"),
        (SpawnRequest(spawn="a"), "occupied", "'a'"),
        (SpawnRequest(spawn="1,2"), "invalid", "expected X,Y,DEG"),
        (SpawnRequest(spawn="1,nan,0"), "invalid", "finite"),
        (SpawnRequest(spawn="1.4,9.5,0"), "invalid", "expected -0.095 to 1.405"),
        (SpawnRequest(spawn="2.86,0.65,0"), "occupied", "floor's edge"),
        (
            JoinRequest(vehicle="n9", session="s", spawn="2.86,0.65,0"),
            "occupied",
            "a wall or a box",
        ),
        (JoinRequest(vehicle="n1", session="s"), "owned", "n1"),
        (JoinRequest(vehicle="world", session="s"), "owned", "world"),
        (JoinRequest(vehicle="n9", session="s", kind="ghost"), "invalid", "ghost"),
        (JoinRequest(vehicle="n9", session="s", tag_id=1), "owned", "n1 has tag 1"),
        (JoinRequest(vehicle="n9", session="s", tag_id=0), "invalid", "the map's own"),
        (JoinRequest(vehicle="n9", session="s", tag_id=587), "invalid", "expected 0 to 586"),
        (JoinRequest(vehicle="n9", session="s", tag_id=-1), "invalid", "expected 0 to 586"),
        (RemoveRequest(vehicle="n8"), "not_found", "n8"),
        (RouteRequest(vehicle="n1", via=("nowhere",)), "invalid", "nowhere"),
        (RouteRequest(vehicle="n1", speed_mps=-1.0), "invalid", "-1.0"),
        (RouteRequest(vehicle="n1", via=("east_loop",), laps=0), "invalid", "laps"),
        (LeaseRequest(vehicle="n8", owner="ann", verb="acquire"), "not_found", "n8"),
        (LeaseRequest(vehicle="n1", owner="", verb="acquire"), "invalid", "owner"),
        (LeaseRequest(vehicle="n1", owner="ann", verb="renew", epoch=3), "owned", "n1"),
        (LeaseRequest(vehicle="n1", owner="ann", verb="steal"), "owned", "reason"),
    ],
)
def test_what_cannot_be_done_is_refused_in_words(city, request_, code, words):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    reply = city.ask(request_)
    assert isinstance(reply, Refused)
    assert reply.code == code
    assert words in reply.detail


def test_a_full_city_says_so(city):
    for _ in MAP.spawns:
        city.ask(SpawnRequest())
    assert city.ask(SpawnRequest()).code == "full"


def test_a_route_for_a_car_that_is_not_hosted_is_left_to_its_agent(city):
    city.join()
    assert city.ask(RouteRequest(vehicle="n7")).code == "not_found"


def test_a_sent_car_drives_and_reports_its_trip(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    reply = city.ask(RouteRequest(vehicle="n1", via=("east_loop",), request_id="t-1"))
    city.run_for(12.0)
    trip = city.heard(Trip)[-1]
    assert (reply.trip_id, trip.trip_id) == ("t-1", "t-1")
    assert trip.arrived_ns is not None
    assert trip.done_m == pytest.approx(reply.length_m, abs=0.05)
    assert abs(city.shown("n1").speed_mps) < 0.01


def test_hosted_cars_of_the_start_circulate_and_stop_before_a_signal_nobody_sends(make_city):
    city = make_city(hosted=(("n1", "nigel"),))
    city.run_for(20.0)
    assert city.shown("n1").speed_mps == pytest.approx(0.0, abs=1e-3)
    assert city.heard(Trip)[-1].waiting_for == "signal"


def test_a_leased_car_obeys_its_leaseholder(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    lease = city.lease()
    for seq in range(25):
        city.run(1, city.command(lease, seq))
    assert city.shown("n1").speed_mps > 0.1
    assert city.shown("n1").owner == "ann"


def test_a_command_under_another_epoch_moves_nothing(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    lease = city.lease()
    for step in (-1, 1):
        for seq in range(10):
            wrong = DriveCommand(
                vehicle="n1", t_ns=0, epoch=lease.epoch + step, seq=seq, throttle=1.0, steering=0.0
            )
            city.run(1, wrong)
    assert city.shown("n1").speed_mps == pytest.approx(0.0, abs=1e-6)


def test_silence_stops_a_leased_car_and_drops_the_lease_after_a_second(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    lease = city.lease(ttl_ms=60_000)
    for seq in range(25):
        city.run(1, city.command(lease, seq))
    city.run_for(1.1)
    shown = city.shown("n1")
    assert (shown.owner, shown.mode) == ("world", "stop")
    assert shown.epoch > lease.epoch
    assert shown.speed_mps == pytest.approx(0.0, abs=1e-3)
    assert "lease_lost" in city.events()


def test_after_a_lost_lease_the_old_holders_commands_move_nothing(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    lease = city.lease()
    city.run_for(1.2)
    for seq in range(100, 125):
        city.run(1, city.command(lease, seq))
    assert city.shown("n1").speed_mps == pytest.approx(0.0, abs=1e-6)


def test_a_car_given_back_stands_until_it_is_sent_again(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    city.ask(RouteRequest(vehicle="n1"))
    lease = city.lease()
    city.ask(LeaseRequest(vehicle="n1", owner="ann", verb="release", epoch=lease.epoch))
    city.run_for(2.0)
    stood = city.shown("n1").speed_mps
    city.ask(RouteRequest(vehicle="n1"))
    city.run_for(2.0)
    assert stood == pytest.approx(0.0, abs=1e-6)
    assert city.shown("n1").speed_mps > 0.1


def test_a_leased_car_cannot_be_sent_by_somebody_else(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    city.lease()
    assert city.ask(RouteRequest(vehicle="n1")).code == "owned"


def test_a_car_that_was_driven_or_sent_since_refuses_to_replace_it(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    city.ask(RouteRequest(vehicle="n1", via=("west_loop",), request_id="t"))
    wrong = city.ask(RouteRequest(vehicle="n1", replaces="n1-1"))
    assert (wrong.code, wrong.detail) == ("owned", "n1: it is on trip 't', expected 'n1-1'")
    lease = city.lease()
    city.ask(LeaseRequest(vehicle="n1", owner="ann", verb="release", epoch=lease.epoch))
    assert city.ask(RouteRequest(vehicle="n1", replaces="t")).code == "owned"
    assert city.ask(RouteRequest(vehicle="n1", request_id="u")).trip_id == "u"
    assert city.ask(RouteRequest(vehicle="n1", replaces="u")).trip_id


def test_a_theft_is_told_with_its_reason(city):
    city.ask(SpawnRequest(vehicle="n1"))
    city.lease()
    request = LeaseRequest(vehicle="n1", owner="bob", verb="steal", reason="ann left the room")
    assert city.ask(request).owner == "bob"
    told = next(e for e in city.heard(CityEvent) if e.name == "lease_stolen")
    assert "ann left the room" in told.text


def test_a_retried_acquisition_keeps_its_epoch(city):
    city.ask(SpawnRequest(vehicle="n1"))
    assert city.lease().epoch == city.lease().epoch


def test_the_red_button_stops_cars_and_releasing_it_lets_them_drive(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    city.ask(RouteRequest(vehicle="n1"))
    city.run_for(2.0)
    stop = city.ask(StopRequest(engaged=True, by="ann"))
    city.run_for(1.5)
    stopped = city.shown("n1")
    city.ask(StopRequest(engaged=False, by="ann"))
    city.run_for(1.5)
    assert isinstance(stop, CityStop)
    assert (stopped.mode, stopped.speed_mps) == ("stop", pytest.approx(0.0, abs=1e-3))
    assert city.shown("n1").speed_mps > 0.1


def test_the_red_button_is_repeated_every_second_while_engaged(city):
    city.ask(StopRequest(engaged=True, by="ann"))
    city.run_for(3.0)
    assert 3 <= len(city.heard(CityStop)) <= 5


def test_a_joined_car_is_shown_where_its_agent_says(city):
    city.join()
    city.run(3, city.report(x=0.7, y=0.9, speed_mps=0.2))
    shown = city.shown("n7")
    assert (shown.kind, shown.owner, shown.x_m, shown.alive) == ("remote", "n7", 0.7, True)


def test_joining_twice_in_one_session_gets_the_same_welcome(city):
    assert city.join().epoch == city.join().epoch
    assert city.events().count("vehicle_joined") == 1


def test_a_name_in_use_by_another_session_is_refused(city):
    city.join()
    assert city.join(session="s2").code == "owned"


def test_a_lost_session_is_shown_at_once_and_leaves_the_map_after_three_seconds(city):
    city.join()
    city.run(3, city.report())
    city.run(3, Presence(role="v", station="n7", session="s1", alive=False))
    assert city.shown("n7").alive is False
    assert "vehicle_lost" in city.events()
    city.run_for(3.1)
    assert city.shown("n7") is None


def test_a_session_that_was_only_asleep_is_back_with_its_next_report(city):
    city.join()
    city.run(1, city.report(seq=1))
    city.run(3, Presence(role="v", station="n7", session="s1", alive=False))
    city.run(3, city.report(seq=2, x=1.1))
    asleep = city.shown("n7")
    city.run(3, Presence(role="v", station="n7", session="s1", alive=True))
    city.run(3, city.report(seq=3, x=1.2))
    awake = city.shown("n7")
    assert (asleep.alive, awake.alive) == (False, True)
    assert awake.x_m == pytest.approx(1.2, abs=0.01)


def test_the_end_of_another_session_changes_nothing(city):
    city.join()
    city.run(3, city.report())
    city.run(3, Presence(role="v", station="n7", session="s0", alive=False))
    assert city.shown("n7").alive is True


def test_a_silent_agent_is_shown_as_lost_within_one_and_a_half_seconds(city):
    city.join()
    city.run(1, city.report())
    city.run_for(1.2)
    assert city.shown("n7").alive is False


def test_a_car_that_reports_again_in_time_is_back(city):
    city.join()
    city.run(1, city.report())
    city.run_for(1.2)
    city.run(5, city.report(seq=2))
    assert city.shown("n7").alive is True
    assert city.events()[-1] == "vehicle_back"


def test_a_car_whose_session_ended_does_not_come_back_by_a_late_report(city):
    city.join()
    city.run(1, city.report())
    city.run(1, Presence(role="v", station="n7", session="s1", alive=False))
    city.run(3, city.report(seq=2))
    assert city.shown("n7").alive is False


def test_a_new_session_takes_over_the_name_of_a_lost_car(city):
    first = city.join()
    city.run(1, Presence(role="v", station="n7", session="s1", alive=False))
    again = city.join(session="s2")
    assert again.epoch > first.epoch


def test_a_clean_leave_takes_the_car_off_at_once(city):
    city.join()
    city.ask(RemoveRequest(vehicle="n7", reason="done"))
    city.run(3)
    assert city.shown("n7") is None
    assert city.events()[-1] == "vehicle_left"


def test_a_session_takes_its_own_car_off_and_no_other_of_that_name(city):
    city.ask(SpawnRequest(vehicle="n1"))
    city.join(session="s1")
    for name, session in (("n7", "s2"), ("n1", "s1")):
        assert city.ask(RemoveRequest(vehicle=name, session=session)).code == "owned"
    city.ask(RemoveRequest(vehicle="n7", session="s1"))
    city.run(3)
    assert city.shown("n7") is None
    assert city.shown("n1") is not None


def test_a_remote_car_that_drives_into_a_standing_one_is_told_of_the_contact(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    city.join()
    behind = city.world.cars.hosted["n1"].pose @ Pose2(-0.295, 0.0, 0.0)
    ahead = city.report(x=behind.x, y=behind.y, yaw_rad=behind.yaw, speed_mps=0.2)
    city.run(2, ahead)
    told = next(contact for contact in city.heard(Contact) if contact.vehicle == "n7")
    assert "n1" in told.against
    assert (told.dvx_mps, told.dvy_mps) != (0.0, 0.0)
    assert "contact" in city.events()


def test_a_remote_car_that_says_nothing_is_not_pushed_faster_than_who_pushes_it(make_city):
    city = make_city(hosted=(("n1", "nigel"),))
    city.run_for(2.0)  # n1 drives
    city.join()
    ahead = city.world.cars.hosted["n1"].pose @ Pose2(0.32, 0.0, 0.0)
    city.run(2, city.report(x=ahead.x, y=ahead.y, yaw_rad=ahead.yaw))
    city.run_for(0.9)
    told = [contact for contact in city.heard(Contact) if "n1" in contact.against]
    gained = math.hypot(sum(c.dvx_mps for c in told), sum(c.dvy_mps for c in told))
    assert 0.02 < gained < 0.3


def test_nobody_is_put_before_a_car_that_comes(make_city):
    city = make_city(hosted=(("n1", "nigel"),))
    city.run_for(1.5)
    car = city.world.cars.hosted["n1"]
    x, y, yaw = car.pose
    near = Pose2(x + 0.6 * math.cos(yaw), y + 0.6 * math.sin(yaw), yaw)
    assert car.speed > 0.2
    assert not is_free(city.world, near)
    assert is_free(city.world, Pose2(x - 0.6 * math.cos(yaw), y - 0.6 * math.sin(yaw), yaw))


def test_the_same_seed_gives_the_same_run_bit_for_bit(make_city):
    def run():
        city = make_city(sensed=True, seed=4, hosted=(("n1", "nigel"), ("n2", "nigel")))
        city.run_for(3.0)
        return [out for out in city.said if not isinstance(out, Answer)]

    assert run() == run()


def test_another_seed_gives_other_noise(make_city):
    def scans(seed):
        city = make_city(sensed=True, seed=seed, hosted=(("n1", "nigel"),))
        city.run_for(0.5)
        return [out for out in city.said if type(out).__name__ == "LidarScan"]

    assert scans(1) != scans(2)


@pytest.mark.parametrize("absurd", [{"x": 1e300}, {"y": float("nan")}, {"speed_mps": float("inf")}])
def test_an_absurd_report_is_dropped_and_counted(city, absurd):
    city.join()
    city.run(3, city.report(seq=1, x=1.0))
    city.run(3, city.report(seq=2, **{"x": 2.0, **absurd}))
    assert city.shown("n7").x_m == 1.0
    assert city.world.ignored == 1


def test_the_world_echoes_for_hosted_cars_and_leaves_the_others_to_their_agents(city):
    city.ask(SpawnRequest(vehicle="n1"))
    city.ask(JoinRequest(vehicle="n7", session="s"))
    assert isinstance(city.ask(EchoRequest(vehicle="n1")), EchoReply)
    assert city.ask(EchoRequest(vehicle="n7")).code == "not_found"


def test_the_snapshot_tells_how_long_a_lease_lives_on_and_the_voltage_of_the_battery(city):
    city.ask(SpawnRequest(vehicle="n1"))
    city.run_for(0.2)
    (at_home,) = city.heard(WorldSnapshot)[-1].vehicles
    assert at_home.lease_left_ms is None
    assert (at_home.command_age_ms, at_home.battery_v) == (None, pytest.approx(12.576, abs=1e-3))
    assert 0.9999 < at_home.battery_charge < 1.0
    city.ask(LeaseRequest(vehicle="n1", owner="desk", verb="acquire", ttl_ms=900))
    city.run_for(0.2)
    (leased,) = city.heard(WorldSnapshot)[-1].vehicles
    assert 500.0 < leased.lease_left_ms < 900.0


def test_a_trip_taken_away_is_told_a_last_time_with_what_is_left_of_it(city):
    city.ask(SpawnRequest(vehicle="n1"))
    city.ask(RouteRequest(vehicle="n1", via=("west_loop",), laps=2, speed_mps=0.1))
    city.run(2)
    before = len(city.heard(Trip))
    city.lease()
    (last,) = city.heard(Trip)[before:]
    assert (last.via, last.speed_mps) == (("west_loop", "west_loop"), 0.1)


@pytest.mark.parametrize(("x_m", "y_m", "yaw_rad"), [(0.328, 1.134, 1.152), (2.568, 0.539, 0.562)])
def test_a_car_given_back_before_a_wall_stands_and_says_why(city, x_m, y_m, yaw_rad):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    lease, car = city.lease(), city.world.cars.hosted["n1"]
    car.fleet.place(car.row, Pose2(x_m, y_m, yaw_rad), 0.0)
    city.ask(LeaseRequest(vehicle="n1", owner="ann", verb="release", epoch=lease.epoch))
    reply = city.ask(RouteRequest(vehicle="n1"))
    city.run_for(2.0)
    assert "contact" not in city.events()
    assert car.speed == pytest.approx(0.0, abs=1e-3)
    assert (reply.code, "wall" in reply.detail, "by hand" in reply.detail) == (
        "invalid",
        True,
        True,
    )


def test_a_car_given_back_beside_its_lane_drives_there_where_no_wall_is(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    car, start = city.world.cars.hosted["n1"], city.world.roads.spawn_pose("a")
    beside = Pose2(*start.apply(0.0, 0.1), start.yaw + 0.5)
    car.fleet.place(car.row, beside, 0.0)
    city.world.cars.locate(city.world.sensors.external)
    city.ask(RouteRequest(vehicle="n1"))
    city.run_for(8.0)
    assert "contact" not in city.events()
    assert abs(city.world.drivers.cross_track[car.index]) < 0.02
