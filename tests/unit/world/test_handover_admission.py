"""What a city refuses from its neighbour: no message of another city may take its world down."""

import pytest
from msgspec.structs import replace

from bench.handover import half_loop
from scm.errors import MessageError
from scm.records.city_map import VehicleTag
from scm.v2x.exchange import Call, Incoming
from scm.v2x.message import Refused, decode, encode
from scm.v2x.messages.border_cars import BorderCar, BorderCars
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.handover_request import HandoverReply, HandoverRequest, NamedValues
from scm.vehicles.car import load_car
from scm.world.border import receive_cars
from scm.world.border_state import ArrivalRecord
from scm.world.handover import receive_reply, reply_to_handover
from scm.world.part import WorldPart
from tests.unit.world.test_handover import ENDLESS, asks, handed, two, until

DAY_MS = 24 * 3600 * 1000


HALF = half_loop("east")


@pytest.fixture
def east():
    return WorldPart(ENDLESS["east"], 0, room=2, city="east").world


def with_values(kind, name, *values):
    """Return a change of one variable or parameter of a car."""
    return lambda state: {
        kind: tuple(
            replace(one, values=values) if one.name == name else one for one in getattr(state, kind)
        )
    }


def with_both_yaws(state):
    """Return a change to yaws that are finite, and whose sum is not."""
    changed = with_values("variables", "yaw", 1.7e308)(state)
    return {**changed, "origin": (*state.origin[:2], 1.7e308)}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (with_both_yaws, "beyond every physical range"),
        (with_values("variables", "yaw", 1e300), "beyond every physical range"),
        (lambda state: {"origin": (*state.origin[:2], 8.0)}, "origin: got a yaw of 8 rad"),
        (with_values("parameters", "mass", -1.0), "body.mass_kg = -1: expected"),
        (with_values("parameters", "mass", 1e300), "body.mass_kg = 1e+300: expected"),
        (lambda _: {"drawn_as": -1.0}, "drawn_as: got -1, expected at least 0"),
        (lambda s: {"driver": replace(s.driver, speed_mps=-1.0)}, "speed_mps: got -1"),
    ],
)
def test_numbers_that_no_car_has_are_refused_and_leave_no_car(east, change, words):
    reply = reply_to_handover(east, handed(change), 0, [])
    assert words in reply.detail
    assert not east.cars.hosted
    assert not east.cars.arrays.used.any()


def test_what_fails_while_a_car_is_put_together_is_a_refusal(east, monkeypatch):
    def fail(*_):
        raise ValueError("math domain error")

    monkeypatch.setattr("scm.world.handover.put_state", fail)
    reply = reply_to_handover(east, handed(), 0, [])
    assert "math domain error" in reply.detail
    assert not east.cars.arrays.used.any()


def test_numbers_that_this_city_does_not_know_are_left_out(east):
    more = NamedValues(name="wings", values=(1.0, 2.0))
    request = handed(lambda state: {"variables": (*state.variables, more)})
    assert isinstance(reply_to_handover(east, request, 0, []), HandoverReply)


@pytest.fixture
def broken(tmp_path, monkeypatch):
    """Return the name of a car file that was saved half-finished while the city runs."""
    monkeypatch.setenv("SCM_CARS", str(tmp_path))
    (tmp_path / "mine.toml").write_text("[body]\nmass_kg = ")
    return "mine"


def at_the_border(car):
    pose = {"x_m": 1.65, "y_m": 0.0, "yaw_rad": 0.0}
    return BorderCar(vehicle=f"of_{car}", car=car, speed_mps=0.2, yaw_rate_radps=0.0, **pose)


def test_car_whose_file_is_broken_here_is_refused(east, broken):
    reply = asks(east, car=broken)
    assert reply.code == "unknown_car"
    assert reply.detail == "car file 'mine' cannot be read here"


def test_car_is_refused_while_the_folder_of_car_files_is_away(east, tmp_path, monkeypatch):
    monkeypatch.setenv("SCM_CARS", str(tmp_path / "nowhere"))
    assert asks(east, car="mine").code == "unknown_car"


def test_car_behind_the_border_whose_file_is_broken_here_is_ignored(east, broken):
    cars = (at_the_border(broken), at_the_border("nigel"))
    receive_cars(east, BorderCars(city="west", t_ns=0, cars=cars), 0)
    assert east.ignored == 1
    assert list(east.border.ghosts) == [("west", "of_nigel")]
    assert east.cars.arrays.used.sum() == 1


def test_car_file_is_read_once_however_often_a_city_asks(east, monkeypatch):
    asks(east)
    monkeypatch.setattr("scm.vehicles.car.car_files", lambda: pytest.fail("looked at the disk"))
    monkeypatch.setattr("scm.world.garage.load_car", lambda _: pytest.fail("read it again"))
    assert isinstance(asks(east), HandoverReply)
    receive_cars(east, BorderCars(city="west", t_ns=0, cars=(at_the_border("nigel"),)), 0)
    assert len(east.border.ghosts) == 1


def test_digest_is_that_of_the_file_that_the_cars_here_are_of(east, tmp_path, monkeypatch):
    text = load_car("nigel").path.read_text()
    monkeypatch.setenv("SCM_CARS", str(tmp_path))
    (tmp_path / "mine.toml").write_text(text)
    before = east.cars.garage.digest("mine")
    (tmp_path / "mine.toml").write_text(text + "\n[")
    assert east.cars.garage.digest("mine") == before
    assert isinstance(asks(east, car="mine", digest=before), HandoverReply)


@pytest.mark.parametrize(
    "changes",
    [
        {"vehicle": "w\0"},
        {"vehicle": "w" * 33},
        {"city": "north"},
        {"lane": "x" * 201},
        {"car": "x" * 201},
        {"digest": "x" * 201},
    ],
)
def test_nothing_is_stored_for_a_transfer_of_a_stranger(east, changes):
    out = []
    reply = reply_to_handover(east, replace(handed(), **changes), 0, out)
    assert reply.detail
    assert len(reply.detail) < 300
    assert not out
    assert not east.border.arrivals


@pytest.mark.parametrize("name", ["w\0", "W1", "w" * 33, ""])
def test_request_with_an_invalid_name_is_no_message(name):
    body, _ = encode(replace(handed(), vehicle=name))
    with pytest.raises(MessageError, match=r"vehicle"):
        decode(HandoverRequest, body)


def test_of_many_cars_of_a_city_the_ones_that_came_last_are_remembered(east, monkeypatch):
    monkeypatch.setattr("scm.world.border_state.MAX_ARRIVALS", 3)
    east.border.arrivals["north", "n1"] = ArrivalRecord(epoch=1)
    request, stored = replace(handed(), digest="0"), {}
    for name in ("w1", "w2", "w3", "w1", "w4"):
        one, out = replace(request, vehicle=name, epoch=request.epoch + len(stored)), []
        reply_to_handover(east, one, 0, out)
        stored |= {record.key: record.value for record in out}
    names = [key[1] for key in east.border.arrivals]
    assert names == ["n1", "w3", "w1", "w4"]
    assert stored["in/west/w2"] is None
    assert all(stored[f"in/west/{name}"] is not None for name in ("w1", "w3", "w4"))


@pytest.mark.parametrize("phase", ["reserve", "commit"])
@pytest.mark.parametrize("epoch", [-1, 0, 8 * DAY_MS, 2**62 - 1, 2**63 - 1])
def test_epoch_that_is_no_time_is_refused_and_leaves_those_of_newcomers_alone(east, epoch, phase):
    reply = reply_to_handover(east, replace(handed(), epoch=epoch, phase=phase), 0, [])
    assert "compare the clocks" in reply.detail
    assert east.identities.first_epoch(0) == 1


def test_epoch_of_a_city_whose_clock_is_days_ahead_is_taken(east):
    request = replace(handed(), epoch=1_000 + 6 * DAY_MS)
    assert isinstance(reply_to_handover(east, request, 1_000_000_000, []), HandoverReply)
    assert "w1" in east.cars.hosted


def test_lane_that_another_lane_leads_into_is_no_border():
    inner = next(lane for lane in HALF.lanes if lane.name == "east_out")
    world = WorldPart(HALF, 0, room=2, city="east").world
    reply = asks(world, lane=inner.name, border=(*inner.start,))
    assert reply.code == "invalid"
    assert "does not begin at a border" in reply.detail
    assert not world.border.reserved
    first = next(lane for lane in HALF.lanes if lane.name == "east_in")
    assert isinstance(asks(world, lane=first.name, border=(*first.start,)), HandoverReply)


def test_place_that_was_reserved_once_takes_no_room():
    lanes = [lane for lane in HALF.lanes if lane.name in ("east_in", "east_side")]
    world = WorldPart(HALF, 0, room=1, city="east").world
    first, second = ({"lane": lane.name, "border": (*lane.start,)} for lane in lanes)
    assert isinstance(asks(world, **first), HandoverReply)
    assert asks(world, vehicle="w2", **second).code == "full"
    request = HandoverRequest(
        city="west",
        phase="reserve",
        vehicle="w2",
        epoch=5,
        car="nigel",
        digest=world.cars.garage.digest("nigel"),
        **second,
    )
    assert isinstance(reply_to_handover(world, request, 4_000_000_000, []), HandoverReply)
    assert list(world.border.reserved) == ["east_side"]


@pytest.fixture
def leaver():
    """Return a world whose car w1 is on its way to a city that does not answer."""
    cities = two()
    west = cities.worlds["west"].world
    until(cities, lambda: west.border.approaching and west.border.approaching["w1"].until_ns)
    until(cities, lambda: west.cars.hosted["w1"].pose.x > 1.59)
    cities.cut()
    until(cities, lambda: west.border.leaving)
    return west


def answered(world, reply, now_ns=60_000_000_000):
    """Return what a world does about an answer to its transfer of w1."""
    away = world.border.leaving["w1"]
    call = away.tries.due(now_ns) or Call(away.request, 0.5)
    return receive_reply(world, Incoming(reply, now_ns, call), now_ns)


def decision(world, **changes):
    request = world.border.leaving["w1"].request
    reply = HandoverReply(city="west", vehicle="w1", epoch=request.epoch)
    return replace(reply, **changes)


@pytest.mark.parametrize("code", ["invalid", "owned", "stale", "timeout", "offline", "forbidden"])
def test_refusal_that_is_none_of_the_next_city_leaves_the_car_on_its_way(leaver, code):
    assert not answered(leaver, Refused(code=code, detail="the reply: not JSON"))
    away = leaver.border.leaving["w1"]
    assert "w1" not in leaver.cars.hosted
    assert away.tries.next_ns is not None
    assert away.tries.due(away.tries.next_ns).request == away.request


@pytest.mark.parametrize(
    "changes", [{"city": "north"}, {"vehicle": "w2"}, {"epoch": 1}, {"epoch": 1, "refused": "full"}]
)
def test_decision_about_another_transfer_leaves_the_car_on_its_way(leaver, changes):
    assert not answered(leaver, decision(leaver, **changes))
    assert leaver.border.leaving["w1"].tries.next_ns is not None
    assert "w1" not in leaver.cars.hosted


def test_refused_transfer_brings_the_car_back_and_an_accepted_one_forgets_it(leaver):
    away = leaver.border.leaving["w1"]
    answered(leaver, decision(leaver, refused="full", detail="east is full"))
    assert "w1" in leaver.cars.hosted
    leaver.remove("w1")
    leaver.border.leaving["w1"] = away
    away.tries.reply = None
    (stored,) = answered(leaver, decision(leaver))
    assert (stored.key, stored.value) == ("out/w1", None)
    assert not leaver.border.leaving


def test_car_whose_transfer_is_stale_stays_in_the_store_for_a_person(leaver):
    (event,) = answered(leaver, decision(leaver, refused="stale", detail="epoch: got 3"))
    assert isinstance(event, CityEvent)
    assert (event.name, event.severity) == ("handover_stale", "error")
    assert "w1" in leaver.border.leaving
    assert "w1" not in leaver.cars.hosted
    assert leaver.border.leaving["w1"].tries.due(2**62) is None


@pytest.mark.parametrize(("owner", "keeps"), [("w1", True), ("e9", False)])
def test_tag_that_the_map_gives_to_another_car_is_replaced(owner, keeps):
    bound = VehicleTag(vehicle=owner, tag_id=40)
    world = WorldPart(replace(ENDLESS["east"], vehicle_tags=(bound,)), 0, room=2, city="east").world
    assert isinstance(reply_to_handover(world, tagged(40), 0, []), HandoverReply)
    assert (world.cars.hosted["w1"].tag_id == 40) == keeps


def test_tag_of_the_floor_is_replaced(east):
    floor = east.city_map.tag.tag_id
    assert isinstance(reply_to_handover(east, tagged(floor), 0, []), HandoverReply)
    assert east.cars.hosted["w1"].tag_id != floor


def tagged(tag_id):
    return handed(lambda _: {"tag_id": tag_id})
