"""Who gets into a city and what it may do there, over real routers.

The control comes first: an allowed station does the same thing on the same key, and is heard.
"""

import threading
from contextlib import ExitStack
from datetime import UTC, datetime

import pytest
import zenoh

from scm.clock import WallClock, seconds
from scm.errors import AccessError, LinkError
from scm.v2x import zenoh_config
from scm.v2x.access import guard_of, is_local, own_stations, router_settings
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.certificates import Pair, issue_station, make_authority
from scm.v2x.credentials import Credentials, read_credentials
from scm.v2x.etsi.convert import cam_of
from scm.v2x.exchange import Answer
from scm.v2x.fleet_file import Fleet, add, name_hosts, remove
from scm.v2x.message import Refused, encode
from scm.v2x.messages.cam import CamTx
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.remove_request import RemoveReply, RemoveRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.request_retry import send_request
from scm.v2x.router import Router, free_endpoint

CLOCK = WallClock()
NEVER = threading.Event()
PATIENCE_S = 30.0
NOW = datetime.now(UTC)
STATIONS = {
    "n1": "vehicle", "n2": "vehicle", "world": "part", "traffic": "part", "monitor": "part",
    "api": "part", "operator": "operator", "viewer": "viewer", "driver": "driver",
}  # fmt: skip

pytestmark = pytest.mark.usefixtures("lasting_links")


def until(condition, also=lambda: None):
    began_ns = CLOCK.now_ns()
    while not condition():
        also()
        assert seconds(CLOCK.now_ns() - began_ns) < PATIENCE_S
        NEVER.wait(0.01)


def state(vehicle="n1", x_m=0.0):
    return VehicleState(
        vehicle=vehicle, t_ns=1, seq=1, x_m=x_m, y_m=0.0, yaw_rad=0.0, speed_mps=0.0,
        yaw_rate_radps=0.0, steering_rad=0.0, throttle=0.0, source="model",
    )  # fmt: skip


def command(vehicle, seq=1):
    return DriveCommand(vehicle=vehicle, t_ns=1, epoch=seq, seq=seq, throttle=0.0, steering=0.0)


def status(detail=""):
    return PartStatus(station="world", t_ns=1, detail=detail)


def trip(vehicle):
    return Trip(
        vehicle=vehicle, trip_id="a", t_ns=1, route=(), done_m=0.0, length_m=None, started_ns=1
    )


def stop(by=""):
    return CityStop(t_ns=1, engaged=bool(by), by=by)


def spat(seq=0):
    return Spat(junction="x1", t_ns=1, seq=seq, mode="plan", plan="calm", groups=())


def event_from(source, name="told"):
    return CityEvent(severity="info", source=source, t_ns=1, name=name, text="a sentence")


def entering(name, endpoint, credentials):
    return ZenohBus("city", name, endpoint, connect_timeout_s=PATIENCE_S, credentials=credentials)


class Guarded:
    """A router of its own kind, and stations with the credentials of its fleet."""

    def __init__(self, folder, auth):
        self.fleet = Fleet(folder / "fleet.toml", auth)
        for name, role in STATIONS.items():
            add(self.fleet, name, role, NOW)
        self.endpoint = free_endpoint()
        if auth == "mtls":
            self.endpoint = self.endpoint.replace("tcp/", "tls/")
        settings = router_settings(self.fleet, "city", self.endpoint)
        self.stack = ExitStack()
        self.router = self.stack.enter_context(Router(self.endpoint, settings))
        self.buses = {}

    def credentials(self, name):
        return read_credentials(self.fleet.credentials(name), name)

    def bus(self, name):
        if name not in self.buses:
            self.buses[name] = self.enter(self.credentials(name), name)
        return self.buses[name]

    def enter(self, credentials, name="n1"):
        return self.stack.enter_context(entering(name, self.endpoint, credentials))

    def mailbox_of(self, name, kind, **where):
        box = Mailbox(1000)
        self.bus(name).subscribe(kind, where, box)
        return box


@pytest.fixture(scope="module", params=["password", "mtls"])
def guarded(request, tmp_path_factory):
    guarded = Guarded(tmp_path_factory.mktemp(request.param), request.param)
    with guarded.stack:
        yield guarded


def messages(box):
    return [item.message for item in box.drain()]


def fenced(box, say, fence, is_fence):
    """Return what arrived before a fence that is sent until it does."""
    say()
    found = []

    def look():
        found.extend(messages(box))
        return any(map(is_fence, found))

    until(look, also=fence)
    return [message for message in found if not is_fence(message)]


def heard_of(guarded, by, kind, forged, honest, honest_by):
    """Return what of a forgery anybody hears; the honest one on the same key is the fence."""
    box = guarded.mailbox_of("api", kind)
    sender = guarded.bus(by)
    guarded.bus(honest_by)

    def forge():
        for _ in range(20):
            sender.publish(forged)

    return fenced(box, forge, lambda: guarded.bus(honest_by).publish(honest), lambda m: m == honest)


def test_a_car_stays_connected_after_the_router_has_sent_the_subscriptions(guarded):
    box, bus = guarded.mailbox_of("api", VehicleState), guarded.bus("n1")
    until(lambda: bool(messages(box)), also=lambda: bus.publish(state()))
    for i in range(1000):
        bus.publish(state(x_m=float(i)))
        if i % 50 == 0:
            NEVER.wait(0.01)
    # Of a stream that comes too fast any may be lost, also the last.
    until(
        lambda: any(message.x_m == 1000.0 for message in messages(box)),
        also=lambda: bus.publish(state(x_m=1000.0)),
    )


@pytest.mark.parametrize(
    ("kind", "forged", "honest", "honest_by"),
    [
        (VehicleState, state("n2", 66.0), state("n2", 1.0), "n2"),
        (DriveCommand, command("n2", 9), command("n2"), "driver"),
        (Spat, spat(666), spat(1), "traffic"),
        (CityStop, stop("n1"), stop(), "world"),
        (CityEvent, event_from("traffic", "forged"), event_from("traffic"), "traffic"),
        (PartStatus, status("forged"), status(), "world"),
    ],
    ids=["state", "command", "spat", "stop", "event", "status"],
)
def test_a_car_cannot_publish_in_the_name_of_others(guarded, kind, forged, honest, honest_by):
    assert heard_of(guarded, "n1", kind, forged, honest, honest_by) == []


def raw(guarded, name, **more):
    """Return a bare session with a station's credentials: it is bound to none of our habits."""
    settings = guarded.credentials(name).client_settings()
    config = zenoh.Config.from_json5(zenoh_config.client(guarded.endpoint, PATIENCE_S, settings))
    for key, value in more.items():
        config.insert_json5(key, value)
    return guarded.stack.enter_context(zenoh.open(config))


@pytest.mark.parametrize(
    "key",
    [
        "v2x/tx/n1/spatem", "v2x/tx/rsu-x1/spatem", "v2x/rx/n2/n1/cam", "v2x/tx/n2/cam",
        "v/n1/cmd/drive", "v/n1/contact", "v/*/state", "**", "world/snapshot", "eye/pose/n1",
        "world/stop",
    ],
)  # fmt: skip
def test_a_raw_put_of_a_car_on_a_key_of_another_station_is_dropped(guarded, key):
    received = []
    ears = raw(guarded, "viewer")
    # Both sessions are new: the first answer of the fence shows that all are connected.
    subscriber = ears.declare_subscriber(
        "scm/@v1/city/**", zenoh.handlers.Callback(received.append, indirect=False)
    )
    mouth = raw(guarded, "n1")
    fence = "scm/@v1/city/v/n1/state"
    heard_fence = lambda: any(bytes(s.payload) == b"fence" for s in list(received))  # noqa: E731
    until(heard_fence, also=lambda: mouth.put(fence, b"fence"))
    mouth.put(f"scm/@v1/city/{key}", b"forged")
    mouth.delete(f"scm/@v1/city/{key}")
    del received[:]
    until(heard_fence, also=lambda: mouth.put(fence, b"fence"))
    assert {bytes(s.payload) for s in received} == {b"fence"}
    subscriber.undeclare()


def test_a_cam_that_its_own_car_did_not_sign_is_dropped_and_counted(guarded):
    box, world = guarded.mailbox_of("world", CamTx), guarded.bus("world")
    mouth, honest = raw(guarded, "n1"), guarded.bus("n1")
    plain = CamTx(station="n1", t_ns=1, body=cam_of(state(), length_m=0.3, width_m=0.2, front_m=0))
    before = world.rejected

    def forge():
        mouth.put("scm/@v1/city/v2x/tx/n1/cam", encode(plain)[0])
        honest.publish(plain)

    until(lambda: bool(messages(box)) and world.rejected > before, also=forge)
    forge()
    assert all(message.signed for message in messages(box))


def test_a_car_receives_its_own_commands_and_not_those_of_others(guarded):
    own = guarded.mailbox_of("n1", DriveCommand, vehicle="n1")
    others = guarded.mailbox_of("n1", DriveCommand, vehicle="n2")
    everybody = guarded.mailbox_of("n1", DriveCommand)
    driver = guarded.bus("driver")

    until(
        lambda: bool(messages(own)),
        also=lambda: [driver.publish(command(name)) for name in ("n2", "n1")],
    )
    assert messages(others) == []
    assert {message.vehicle for message in messages(everybody)} <= {"n1"}  # its own session's


def serve(guarded, name, kind, **where):
    box = Mailbox(100)
    guarded.bus(name).serve(kind, where, box)
    return box


def answer_all(bus, box, reply):
    for item in box.drain():
        bus.answer(Answer(item, reply(item.message)))


def asked(guarded, by, request, deadline_s=PATIENCE_S):
    return send_request(guarded.bus(by), request, deadline_s)


@pytest.fixture(scope="module")
def asked_of_world(guarded):
    """The world answers every request to remove a car, and to stop."""
    seen, end = [], threading.Event()
    boxes = [serve(guarded, "world", kind) for kind in (RemoveRequest, StopRequest)]

    def reply(request):
        seen.append(request)
        if isinstance(request, StopRequest):
            return CityStop(t_ns=1, engaged=request.engaged)
        return RemoveReply(vehicle=request.vehicle)

    def work():
        while not end.wait(0.005):
            for box in boxes:
                answer_all(guarded.bus("world"), box, reply)

    worker = threading.Thread(target=work)
    worker.start()
    yield seen
    end.set()
    worker.join()


def test_a_car_may_remove_itself_and_no_other(guarded, asked_of_world):
    assert asked(guarded, "n1", RemoveRequest(vehicle="n1")) == RemoveReply(vehicle="n1")
    del asked_of_world[:]
    assert isinstance(asked(guarded, "n1", RemoveRequest(vehicle="n2"), 1.0), Refused)
    assert asked_of_world == []


def test_an_operator_may_stop_the_city_and_cars_and_viewers_may_not(guarded, asked_of_world):
    request = StopRequest(engaged=True, by="me")
    assert isinstance(asked(guarded, "operator", request), CityStop)
    del asked_of_world[:]
    for name in ("n1", "viewer"):
        assert isinstance(asked(guarded, name, request, 1.0), Refused)
    assert asked_of_world == []


def test_a_car_cannot_answer_for_the_world(guarded, asked_of_world):
    stolen = serve(guarded, "n2", LeaseRequest)
    assert isinstance(asked(guarded, "n1", RemoveRequest(vehicle="n1")), RemoveReply)
    request = LeaseRequest(vehicle="n1", owner="n1", verb="acquire")
    assert isinstance(asked(guarded, "n1", request, 0.3), Refused)
    assert messages(stolen) == []


def test_a_car_is_present_under_its_own_name_alone(guarded):
    box = guarded.mailbox_of("viewer", Presence)
    forger = raw(guarded, "n1")
    tokens = [
        forger.liveliness().declare_token(f"scm/@v1/city/{key}/{forger.zid()}")
        for key in ("v/n2/alive", "part/world/alive", "v/n1/alive")
    ]
    seen = set()

    def look():
        seen.update((m.role, m.station) for m in messages(box) if m.session == str(forger.zid()))
        return ("v", "n1") in seen

    until(look)
    guarded.bus("n2").announce("v")
    until(lambda: any(m.station == "n2" for m in messages(box)))
    assert seen == {("v", "n1")}
    for token in tokens:
        token.undeclare()


def test_earlier_events_reach_late_joiners_that_may_subscribe_to_them(guarded):
    guarded.bus("n2").publish(trip("n2"))
    guarded.bus("world").publish(CityStop(t_ns=77, engaged=False))
    late = guarded.enter(guarded.credentials("n1"))
    stops, trips, seen = Mailbox(10), Mailbox(10), Mailbox(10)
    late.subscribe(Trip, {}, trips)
    late.subscribe(CityStop, {}, stops)
    guarded.enter(guarded.credentials("viewer")).subscribe(Trip, {}, seen)
    until(lambda: any(m.t_ns == 77 for m in messages(stops)))
    until(lambda: bool(messages(seen)))
    assert messages(trips) == []


def test_who_has_no_or_wrong_credentials_does_not_get_in(guarded, tmp_path):
    good = guarded.credentials("n1")
    guarded.enter(good).close()
    wrong = [None]
    if good.password:
        wrong.append(Credentials(station="n1", role="vehicle", user=good.user, password="guess"))
        wrong.append(Credentials(station="n9", role="vehicle", user="n9.1", password=good.password))
        wrong.append(guarded_by_certificate(tmp_path))
    else:
        other = make_authority("another", NOW)
        forged = issue_station(other, "n1.1", NOW)
        wrong.append(certified(forged, good.authority))  # of an authority the router does not know
        own = Pair(good.certificate, good.private_key)
        wrong.append(certified(own, other.certificate))  # that does not trust the router
        wrong.append(Credentials(station="n1", role="vehicle", user="n1.1", password="guess"))
    for credentials in wrong:
        with pytest.raises(LinkError, match="no city at"):
            ZenohBus("city", "n1", guarded.endpoint, connect_timeout_s=0.3, credentials=credentials)
    if not good.password:  # plain TCP to the port that speaks TLS
        plain = guarded.endpoint.replace("tls/", "tcp/")
        with pytest.raises(LinkError):
            ZenohBus("city", "n1", plain, connect_timeout_s=0.3, credentials=good)


def certified(pair, authority):
    return Credentials(
        station="n1", role="vehicle", certificate=pair.certificate,
        private_key=pair.private_key, authority=authority,
    )  # fmt: skip


def guarded_by_certificate(folder):
    """Return credentials that show a certificate where a password is asked for."""
    fleet = Fleet(folder / "other.toml", "mtls")
    return add(fleet, "n1", "vehicle", NOW)


def test_a_name_without_rights_gets_in_and_nothing_comes_of_it(tmp_path):
    """Removed from the fleet, but its certificate has not ended yet."""
    fleet = Fleet(tmp_path / "fleet.toml", "mtls")
    gone = add(fleet, "n1", "vehicle", NOW)
    add(fleet, "n2", "vehicle", NOW)
    add(fleet, "viewer", "viewer", NOW)
    add(fleet, "world", "part", NOW)
    remove(fleet, "n1")
    again = add(fleet, "n1", "vehicle", NOW)  # the same name with a new certificate
    endpoint = free_endpoint().replace("tcp/", "tls/")
    with ExitStack() as stack:
        stack.enter_context(Router(endpoint, router_settings(fleet, "city", endpoint)))

        def enter(credentials):
            config = zenoh.Config.from_json5(
                zenoh_config.client(endpoint, PATIENCE_S, credentials.client_settings())
            )
            return stack.enter_context(zenoh.open(config))

        viewer = enter(read_credentials(fleet.credentials("viewer")))
        world = enter(read_credentials(fleet.credentials("world")))
        old, new = enter(gone), enter(again)
        received, leaked, key = [], [], "scm/@v1/city/v/n1/state"
        viewer.declare_subscriber("scm/@v1/city/**", lambda s: received.append(bytes(s.payload)))
        # A session hears itself, whatever the router says.
        old.declare_subscriber("scm/@v1/city/v/n1/state", lambda s: leaked.append(bytes(s.payload)))
        world.declare_queryable("scm/@v1/city/v/*/lease", lambda q: q.reply(q.key_expr, b"yours"))
        until(lambda: bool(list(new.get("scm/@v1/city/v/n1/lease", timeout=0.5))))
        tokens = [  # one that nobody holds is taken back
            session.liveliness().declare_token(f"scm/@v1/city/v/n1/alive/{name}")
            for session, name in ((old, "old"), (new, "new"))
        ]
        old.put(key, b"old")
        until(lambda: b"new" in received, also=lambda: new.put(key, b"new"))
        alive = {str(r.ok.key_expr) for r in viewer.liveliness().get("scm/@v1/city/v/*/alive/*")}
        assert alive == {"scm/@v1/city/v/n1/alive/new"}
        leaked += old.liveliness().get("scm/@v1/city/v/n1/alive/new")
        assert list(old.get("scm/@v1/city/v/n1/lease", timeout=0.5)) == []
        admin = [str(r.ok.key_expr) for r in old.get("@/**", timeout=0.5)]
        assert [key for key in admin if not key.startswith(f"@/{old.zid()}/")] == []
        assert (b"old" in received, set(leaked)) == (False, {b"old"})
        for token in tokens:
            token.undeclare()


def test_two_hundred_cars_do_not_keep_the_router_waiting(tmp_path):
    fleet = Fleet(tmp_path / "fleet.toml", "password")
    for i in range(3):
        add(fleet, f"n{i}", "vehicle", NOW)
    member = fleet.members["n0"]
    for i in range(3, 200):
        fleet.members[f"n{i}"] = type(member)(f"n{i}", "vehicle", 1)
    endpoint = free_endpoint()
    began_ns = CLOCK.now_ns()
    with Router(endpoint, router_settings(fleet, "city", endpoint)):
        assert seconds(CLOCK.now_ns() - began_ns) < PATIENCE_S


@pytest.mark.parametrize(
    ("auth", "endpoint"),
    [
        ("password", "tcp/0.0.0.0:7447"),
        ("password", "tcp/192.168.1.4:7447"),
        ("password", "tls/127.0.0.1:7447"),
        ("mtls", "tcp/127.0.0.1:7447"),
    ],
)
def test_an_endpoint_where_secrets_would_be_open_is_refused(tmp_path, auth, endpoint):
    fleet = Fleet(tmp_path / "fleet.toml", auth)
    with pytest.raises(AccessError, match=f"got '{endpoint}'"):
        router_settings(fleet, "city", endpoint)


def test_a_router_for_everybody_is_for_this_machine_only():
    with pytest.raises(AccessError, match=r"got 'tcp/0.0.0.0:7447' without a fleet file"):
        Router("tcp/0.0.0.0:7447")


@pytest.mark.parametrize(
    ("endpoint", "local"),
    [
        ("tcp/127.0.0.1:7447", True), ("tcp/[::1]:7447", True), ("tls/localhost:1", True),
        ("unixsock-stream//tmp/x", True), ("tcp/[::]:7447", False), ("tcp/0.0.0.0:1", False),
        ("tcp/127.0.0.1.evil.example:1", False), ("nonsense", False),
    ],
)  # fmt: skip
def test_an_endpoint_is_of_this_machine_or_not(endpoint, local):
    assert is_local(endpoint) is local


def test_a_router_is_reached_at_the_addresses_of_its_certificate_alone(tmp_path):
    fleet = Fleet(tmp_path / "fleet.toml", "mtls", hosts=("localhost",))
    n1 = add(fleet, "n1", "vehicle", NOW)
    endpoint = free_endpoint().replace("tcp/", "tls/")
    settings = router_settings(fleet, "city", endpoint)
    with Router(endpoint, settings), pytest.raises(LinkError):
        ZenohBus("city", "n1", endpoint, connect_timeout_s=0.3, credentials=n1)
    name_hosts(fleet, ("127.0.0.1",), NOW)
    with (
        Router(endpoint, settings),
        entering("n1", endpoint, n1) as bus,
    ):
        assert bus.connected
    assert encode(state())[0]


def test_a_city_without_a_fleet_file_is_open_to_this_machine(tmp_path):
    guard = guard_of(None, "city", "tcp/127.0.0.1:7447", {"up": "part"}, NOW)
    assert (guard.connect, guard.settings) == ("tcp/127.0.0.1:7447", None)
    assert (guard.arguments("up"), guard.credentials("up")) == ((), None)


def test_a_city_with_a_fleet_file_brings_its_own_stations_along(tmp_path):
    add(Fleet(tmp_path / "fleet.toml", "mtls"), "n9", "vehicle", NOW)
    stations = own_stations(("eye", "eye-north"), ("n5",))
    guard = guard_of(tmp_path / "fleet.toml", "city", "tls/0.0.0.0:7447", stations, NOW)
    assert guard.connect == "tls/127.0.0.1:7447"
    assert guard.credentials("eye-north").station == "eye-north"
    assert guard.arguments("n5")[0] == "--credentials"
    known = {subject["id"] for subject in guard.settings["access_control"]["subjects"]}
    assert known == {"n9", *stations}
    assert guard.credentials("script").role == "operator"  # not all that the server may do


def test_a_fleet_that_does_not_suit_the_endpoint_is_left_as_it_was(tmp_path):
    path = tmp_path / "fleet.toml"
    add(Fleet(path, "password"), "n9", "vehicle", NOW)
    before = path.read_text()
    with pytest.raises(AccessError, match="expected tcp/127"):
        guard_of(path, "city", "tcp/0.0.0.0:7447", {"up": "part"}, NOW)
    assert path.read_text() == before
