"""The WebSocket of the wheel: who may, what is said on the bus, and how it ends."""

import json
import socket as sockets
import threading
from contextlib import ExitStack, contextmanager
from time import monotonic
from urllib.parse import urlsplit

import pytest
import websockets.sync.client
from websockets.exceptions import ConnectionClosed, InvalidStatus

from scm.api.app import create_app
from scm.api.city import Link
from scm.api.keys import KeyRing
from scm.api.server import _Impatient, serve
from scm.api.teleop import NOT_YOURS
from scm.client import Client, ProblemError, connection
from scm.client import teleop as client_side
from scm.client.teleop import WheelError
from scm.errors import LinkError
from scm.records.drive import PROTOCOL
from scm.store.memory import MemoryStore
from scm.v2x.message import Refused
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.echo_request import EchoReply, EchoRequest
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.trip import Trip

DRIVE = "/api/v1/vehicles/n1/drive"
PATIENCE_S = 60.0
TAKE = {"type": "take"}


class FakeWire:
    """Keeps what is said, and answers renewals."""

    def __init__(self):
        self.said = []
        self.asked = []
        self.answer = LeaseReply(vehicle="n1", owner="x", epoch=7, ttl_ms=1000)

    def publish(self, message):
        self.said.append(message)

    def request_once(self, request, timeout_s):
        assert timeout_s > 0.0
        self.asked.append(request)
        return self.answer

    @property
    def commands(self):
        return [message for message in self.said if isinstance(message, DriveCommand)]


@pytest.fixture
def wire():
    return FakeWire()


@pytest.fixture
def ring():
    return KeyRing(MemoryStore())


@pytest.fixture
def serving(view, fake_city, city_map, wire):
    """Serve a city whose n1 may be driven; returns its address."""
    fake_city.answers[LeaseRequest] = LeaseReply(vehicle="n1", owner="x", epoch=7, ttl_ms=1000)
    fake_city.answers[RouteRequest] = RouteReply(
        vehicle="n1", trip_id="t", route=("a",), length_m=None
    )

    with ExitStack() as stack:

        def serve_at(keys=None):
            app = create_app(view, fake_city.ask, city_map, keys=keys, link=Link(wire=wire))
            return stack.enter_context(served(app))

        yield serve_at


@pytest.fixture
def connect(serving):
    """Connect to the wheel of n1: a context manager with the socket."""

    def open_at(keys=None, protocols=(PROTOCOL,), host="", **options):
        address = urlsplit(serving(keys))
        return websockets.sync.client.connect(
            f"ws://{host or address.hostname}:{address.port}{DRIVE}",
            sock=sockets.create_connection((address.hostname, address.port)),
            subprotocols=list(protocols),
            open_timeout=PATIENCE_S,
            **options,
        )

    return open_at


@contextmanager
def served(app):
    """Serve on a free port; yields the address."""
    ready, stop, urls = threading.Event(), threading.Event(), []

    def note(url):
        urls.append(url)
        ready.set()

    thread = threading.Thread(
        target=serve, args=(app, "127.0.0.1", 0, stop), kwargs={"on_ready": note}
    )
    thread.start()
    try:
        assert ready.wait(PATIENCE_S)
        yield urls[0]
    finally:
        stop.set()
        thread.join(PATIENCE_S)


def say(socket, word):
    socket.send(json.dumps(word))


def drive(seq, **changed):
    wish = {"held": True, "throttle": 0.4, "steering": 0.1, "t_ms": 5.0} | changed
    return {"type": "drive", "seq": seq} | wish


def until(socket, kind, **wanted):
    """Return the first word of a kind that is as wanted."""
    for _ in range(200):
        word = json.loads(socket.recv(timeout=PATIENCE_S))
        if word["type"] == kind and all(word[name] == value for name, value in wanted.items()):
            return word
    raise AssertionError(kind)


def driven(socket):
    """Send packets until one is obeyed: on a busy machine one may come too late."""
    for seq in range(1, 200):
        say(socket, drive(seq))
        told = until(socket, "told", seq=seq)
        if told["why"] == "driving":
            return told
    raise AssertionError(told)


def test_a_packet_becomes_a_command_and_comes_back_with_its_time(connect, wire, fake_city):
    with connect() as socket:
        assert socket.subprotocol == PROTOCOL
        say(socket, TAKE)
        assert until(socket, "taken")["epoch"] == 7
        told = driven(socket)
        assert (told["t_ms"], told["throttle"], told["steering"]) == (5.0, 0.4, 0.1)
        assert 0.4 in {command.throttle for command in wire.commands}
        assert wire.commands[-1].epoch == 7
    assert fake_city.asked[0].verb == "acquire"


def test_silence_sends_zeros_while_the_connection_lasts(connect, wire):
    with connect() as socket:
        say(socket, TAKE)
        driven(socket)
        told = until(socket, "told", why="silent")
        assert told["throttle"] == wire.commands[-1].throttle == 0.0
        assert told["steering"] == 0.1


def test_the_limit_for_requests_does_not_end_a_drive(connect, monkeypatch):
    monkeypatch.setattr(_Impatient, "patience_s", 0.2)
    with connect() as socket:
        say(socket, TAKE)
        until(socket, "taken")
        began_s, seq = monotonic(), 0
        while monotonic() < began_s + 0.6:
            seq += 1
            say(socket, drive(seq))
            until(socket, "told", seq=seq)


def test_giving_back_returns_the_lease_and_says_so(connect, fake_city):
    with connect() as socket:
        say(socket, TAKE)
        until(socket, "taken")
        say(socket, {"type": "give_back"})
        over = until(socket, "over")
    assert (over["code"], over["detail"]) == ("given_back", "n1 stands")
    release = fake_city.asked[-1]
    assert (release.verb, release.epoch) == ("release", 7)
    assert release.owner == fake_city.asked[0].owner


@pytest.mark.parametrize(
    "trip",
    [
        Trip(vehicle="n1", trip_id="t1", t_ns=1, route=("a",), done_m=0.1, length_m=None,
             started_ns=0, speed_mps=0.1),
        Trip(vehicle="n1", trip_id="t1", t_ns=1, route=("a", "b", "a", "b"), done_m=0.1,
             length_m=3.0, started_ns=0, via=("b", "b"), then="circulate"),
    ],
)  # fmt: skip
def test_the_car_goes_on_where_it_was_going(connect, fake_city, hear, snapshot, trip):
    hear(1.0, snapshot(n1=(0.0, 0.0, 0.0)), trip)
    with connect() as socket:
        say(socket, TAKE)
        until(socket, "taken")
        say(socket, {"type": "give_back"})
        assert until(socket, "over")["detail"] == "n1 goes on by itself"
    assert fake_city.asked[-1] == RouteRequest(
        vehicle="n1", via=trip.via, speed_mps=trip.speed_mps, then=trip.then
    )


def test_a_car_that_cannot_go_on_stands_and_the_person_reads_why(
    connect, fake_city, hear, snapshot
):
    trip = Trip(vehicle="n1", trip_id="t1", t_ns=1, route=("a",), done_m=0.1, length_m=None,
                started_ns=0)  # fmt: skip
    fake_city.answers[RouteRequest] = Refused(code="invalid", detail="n1: a wall is ahead")
    hear(1.0, snapshot(n1=(0.0, 0.0, 0.0)), trip)
    with connect() as socket:
        say(socket, TAKE)
        until(socket, "taken")
        say(socket, {"type": "give_back"})
        assert until(socket, "over")["detail"] == "n1 stands: a wall is ahead"


def test_it_goes_on_from_where_it_was_taken_and_not_from_what_was_last_told_before(
    connect, fake_city, hear, snapshot
):
    told = {"vehicle": "n1", "trip_id": "t1", "route": ("a", "b"), "started_ns": 0, "length_m": 2.0}
    trip = Trip(t_ns=1, done_m=0.4, via=("a", "b"), **told)
    hear(1.0, snapshot(n1=(0.0, 0.0, 0.0)), trip)
    with connect() as socket:
        say(socket, TAKE)
        until(socket, "taken")
        hear(1.1, Trip(t_ns=2, done_m=0.6, via=("b",), **told))
        say(socket, {"type": "give_back"})
        until(socket, "over")
    assert fake_city.asked[-1].via == ("b",)


def test_a_page_that_goes_away_gives_the_car_back(connect, fake_city):
    with connect() as socket:
        say(socket, TAKE)
        until(socket, "taken")
    fake_city.wait_for(2)
    assert [request.verb for request in fake_city.asked] == ["acquire", "release"]


def test_a_car_in_other_hands_is_refused_in_words(connect, fake_city):
    fake_city.answers[LeaseRequest] = Refused(code="owned", detail="n1: the car is leased to 'bo'")
    with connect() as socket:
        say(socket, TAKE)
        over = until(socket, "over")
        assert (over["code"], over["detail"]) == ("owned", "n1: the car is leased to 'bo'")
        with pytest.raises(ConnectionClosed) as ended:
            socket.recv(timeout=PATIENCE_S)
    assert ended.value.rcvd.code == NOT_YOURS


def test_a_reason_as_long_as_a_book_is_refused(connect, fake_city):
    with connect() as socket:
        say(socket, {"type": "take", "reason": "r" * 501})
        over = until(socket, "over")
    assert over["code"] == "invalid"
    assert "500" in over["detail"]
    assert fake_city.asked == []


def test_a_reason_takes_it_all_the_same(connect, fake_city):
    with connect() as socket:
        say(socket, {"type": "take", "reason": "it blocks the crossing"})
        until(socket, "taken")
    assert fake_city.asked[0].verb == "steal"
    assert fake_city.asked[0].reason == "it blocks the crossing"


def test_a_lease_that_is_lost_ends_it_and_is_not_given_back(connect, fake_city, wire):
    wire.answer = Refused(code="owned", detail="'bo' holds it under epoch 8")
    with connect() as socket:
        say(socket, TAKE)
        over = until(socket, "over")
    assert over["code"] == "lost"
    assert "bo" in over["detail"]
    assert [request.verb for request in fake_city.asked] == ["acquire"]


def test_an_answer_that_does_not_come_in_time_ends_nothing_yet(connect, wire):
    wire.answer = Refused(code="timeout", detail="no answer")
    with connect() as socket:
        say(socket, TAKE)
        until(socket, "taken")
        while len(wire.asked) < 2:
            until(socket, "told")


@pytest.mark.parametrize("first", ["{", "{}", '{"type":"drive","seq":1}', '{"type":"take","x":1}'])
def test_a_first_word_that_is_no_take_ends_it(connect, fake_city, first):
    with connect() as socket:
        socket.send(first)
        assert until(socket, "over")["code"] == "invalid"
    assert fake_city.asked == []


@pytest.mark.parametrize("wrong", [{"type": "drive", "seq": "one"}, drive(2**70)])
def test_a_bad_packet_gives_the_car_back(connect, fake_city, wrong):
    with connect() as socket:
        say(socket, TAKE)
        until(socket, "taken")
        say(socket, wrong)
        assert until(socket, "over")["code"] == "invalid"
    assert fake_city.asked[-1].verb == "release"


def refusal_of(connect, **options):
    with pytest.raises(InvalidStatus) as denied:
        connect(**options)
    answer = denied.value.response
    assert answer.headers["x-content-type-options"] == "nosniff"
    return answer.status_code, json.loads(answer.body)["code"]


class TestWhoMay:
    @pytest.mark.parametrize("role", ["operator", "admin"])
    def test_an_operator_s_key_comes_as_a_subprotocol(self, connect, ring, fake_city, role):
        key = f"scm.key.{ring.add('anna', role, 1)}"
        with connect(keys=ring, protocols=[PROTOCOL, key]) as socket:
            assert socket.subprotocol == PROTOCOL
            say(socket, TAKE)
            until(socket, "taken")
        assert fake_city.asked[0].owner.startswith("anna #")

    def test_who_loses_the_key_loses_the_wheel(self, connect, ring, fake_city):
        secret = ring.add("anna", "operator", 1)
        with connect(keys=ring, protocols=[PROTOCOL, f"scm.key.{secret}"]) as socket:
            say(socket, TAKE)
            until(socket, "taken")
            ring.revoke(secret.split("_")[1])
            over = until(socket, "over")
        assert (over["code"], "key has ended" in over["detail"]) == ("ended", True)
        assert fake_city.asked[-1].verb == "release"

    def test_a_viewer_does_not_drive(self, connect, ring, fake_city):
        key = f"scm.key.{ring.add('vera', 'viewer', 1)}"
        assert refusal_of(connect, keys=ring, protocols=[PROTOCOL, key]) == (403, "forbidden")
        assert fake_city.asked == []

    @pytest.mark.parametrize("protocols", [[PROTOCOL], [PROTOCOL, "scm.key.wrong"]])
    def test_nobody_drives_without_a_key(self, connect, ring, protocols):
        assert refusal_of(connect, keys=ring, protocols=protocols) == (401, "unauthorised")

    def test_the_cookie_is_for_reading(self, connect, ring):
        cookie = {"Cookie": f"scm_key={ring.add('anna', 'operator', 1)}"}
        assert refusal_of(connect, keys=ring, additional_headers=cookie) == (401, "unauthorised")

    def test_a_page_of_another_site_does_not_drive(self, connect):
        assert refusal_of(connect, origin="http://evil.example") == (403, "origin")

    def test_a_host_that_renamed_itself_does_not_drive(self, connect):
        assert refusal_of(connect, host="evil.example") == (403, "host")

    def test_another_protocol_is_not_spoken(self, connect):
        assert refusal_of(connect, protocols=["chat"]) == (422, "invalid")


class TestTheClient:
    """`scm.client` at the wheel."""

    @pytest.fixture(autouse=True)
    def _patient(self, monkeypatch):
        def connect(*words, **options):
            options["open_timeout"] = PATIENCE_S
            return websockets.sync.client.connect(*words, **options)

        monkeypatch.setattr(connection, "connect", connect)
        for name in ("SILENT_S", "ANSWER_S"):
            monkeypatch.setattr(client_side, name, PATIENCE_S)

    def driven(self, wheel):
        """Drive until the car was told so: on a busy machine a packet may come too late."""
        until_s = monotonic() + PATIENCE_S
        while monotonic() < until_s:
            told = wheel.drive(0.4, -0.2)
            if told.why == "driving":
                return told
        raise AssertionError(wheel.status)

    def test_it_drives_at_a_beat_and_gives_the_car_back(self, serving, wire, fake_city):
        with Client(serving()) as city, city.wheel("n1") as wheel:
            began_s = monotonic()
            told = wheel.drive(0.4, -0.2, for_s=0.3)
            assert monotonic() - began_s >= 0.3
            assert told.seq is None or told.seq <= 8  # a packet each 50 ms
            told = self.driven(wheel)
            assert (told.throttle, told.steering) == (0.4, -0.2)
            assert 0.4 in {command.throttle for command in wire.commands}
        assert (wheel.over.code, wheel.over.detail) == ("given_back", "n1 stands")
        assert [request.verb for request in fake_city.asked] == ["acquire", "release"]

    def test_a_program_that_hangs_drives_nothing(self, serving, wire):
        """Nothing is sent behind its back: the city lets go of the throttle."""
        with Client(serving()) as city, city.wheel("n1", reason="it is in the way") as wheel:
            assert self.driven(wheel).throttle == 0.4
            until_s = monotonic() + PATIENCE_S
            while wire.commands[-1].throttle and monotonic() < until_s:
                threading.Event().wait(0.01)
            assert (wire.commands[-1].throttle, wire.commands[-1].steering) == (0.0, -0.2)
            assert self.driven(wheel).throttle == 0.4

    def test_an_error_in_the_program_lets_go(self, serving, fake_city):
        with (
            Client(serving()) as city,
            pytest.raises(ZeroDivisionError),
            city.wheel("n1") as wheel,
        ):
            wheel.drive(1 / 0, 0.0)
        assert wheel.over.code == "given_back"
        assert [request.verb for request in fake_city.asked] == ["acquire", "release"]

    def test_a_wheel_that_is_lost_says_to_whom(self, serving, wire):
        wire.answer = Refused(code="owned", detail="'bo' holds it under epoch 8")
        with Client(serving()) as city, city.wheel("n1") as wheel:
            with pytest.raises(WheelError, match="n1: lost: 'bo' holds it"):
                wheel.drive(0.1, 0.0, for_s=30.0)
            with pytest.raises(WheelError, match="lost"):
                wheel.drive(0.1, 0.0)
        assert wheel.over.code == "lost"

    def test_a_car_in_other_hands_is_refused(self, serving, fake_city):
        fake_city.answers[LeaseRequest] = Refused(code="owned", detail="leased to 'bo'")
        with (
            Client(serving()) as city,
            pytest.raises(WheelError, match="n1: owned: leased to"),
            city.wheel("n1"),
        ):
            pass

    def test_its_key_has_to_be_an_operator_s(self, serving, ring, fake_city):
        url, vera = serving(ring), ring.add("vera", "viewer", 1)
        with (
            Client(url, vera) as city,
            pytest.raises(ProblemError, match="403 forbidden"),
            city.wheel("n1"),
        ):
            pass
        with Client(url, ring.add("anna", "operator", 1)) as city, city.wheel("n1"):
            assert fake_city.asked[0].owner.startswith("anna #")

    def test_where_no_city_is_there_is_no_wheel(self):
        with (
            Client("http://127.0.0.1:9") as city,
            pytest.raises(LinkError, match="scm up"),
            city.wheel("n1"),
        ):
            pass


def test_the_way_to_a_car_is_measured_by_an_echo(
    view, fake_city, city_map, wire, client_of, hear, snapshot
):
    hear(1.0, snapshot(n1=(0.0, 0.0, 0.0)))
    wire.answer = EchoReply(vehicle="n1", t_ns=1)
    client = client_of(create_app(view, fake_city.ask, city_map, link=Link(wire=wire)))
    row = client("GET", "/api/v1/vehicles/n1/link").json()
    assert row["answered_by"] == "world"
    assert row["round_trip_ms"] >= 0.0
    assert wire.asked == [EchoRequest(vehicle="n1")]
    wire.answer = Refused(code="timeout", detail="no answer")
    assert client("GET", "/api/v1/vehicles/n1/link").status_code == 504
    assert client("GET", "/api/v1/vehicles/n9/link").status_code == 404
