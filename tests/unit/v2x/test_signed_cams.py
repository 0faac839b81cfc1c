"""Signed CAMs: who signs for whom, and what a reader refuses."""

from datetime import UTC, datetime, timedelta

import msgspec
import pytest

from scm.clock import NS_PER_MS, NS_PER_S, StepClock
from scm.errors import AccessError, ScmError
from scm.v2x.credentials import read_credentials
from scm.v2x.etsi.convert import cam_of
from scm.v2x.fleet_file import Fleet, add, complete
from scm.v2x.message import decode, encode
from scm.v2x.messages.cam import CamRx, CamTx
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.reader import Reader
from scm.v2x.signed_cams import SignedCams
from scm.v2x.tickets import ticket_ends

NOW = datetime(2030, 1, 1, tzinfo=UTC)
NOW_NS = round(NOW.timestamp()) * NS_PER_S
STATIONS = {"n1": "vehicle", "n2": "vehicle", "world": "part", "misbehaviour": "part"}


def body_at(x_m=0.0):
    state = VehicleState(
        vehicle="n1", t_ns=NOW_NS, seq=1, x_m=x_m, y_m=0.0, yaw_rad=0.0, speed_mps=0.0,
        yaw_rate_radps=0.0, steering_rad=0.0, throttle=0.0, source="model",
    )  # fmt: skip
    return cam_of(state, length_m=0.3, width_m=0.175, front_m=0.23)


def cam(station="n1", x_m=0.0):
    return CamTx(station=station, t_ns=NOW_NS, body=body_at(x_m))


def carried(sent, receiver="n2"):
    """Return what the world makes of a frame, as it comes off the bus."""
    heard = CamRx(
        receiver=receiver, station=sent.station, t_ns=sent.t_ns, body=sent.body, signed=sent.signed
    )
    return decode(CamRx, *encode(heard))


@pytest.fixture(scope="module", params=["password", "mtls"])
def fleet(request, tmp_path_factory):
    fleet = Fleet(tmp_path_factory.mktemp("fleet") / "fleet.toml", request.param)
    for name, role in STATIONS.items():
        add(fleet, name, role, NOW)
    return fleet


@pytest.fixture
def air(fleet):
    return {name: SignedCams(read_credentials(fleet.credentials(name), name)) for name in STATIONS}


def refused(air, message, now_ns=NOW_NS):
    with pytest.raises(ScmError) as error:
        air["misbehaviour"].check(message, now_ns)
    return str(error.value)


def test_a_signed_cam_is_believed_wherever_the_air_carries_it(air):
    sent = air["n1"].signed(cam(), NOW_NS)
    air["world"].check(sent, NOW_NS)
    for receiver in ("n2", "rsu-crossing", "rsu-other"):
        air["misbehaviour"].check(carried(sent, receiver), NOW_NS)


def test_the_world_signs_for_the_cars_it_hosts_once_a_cam(air):
    sent = cam("n7")
    heard = [carried(sent, receiver) for receiver in ("n1", "n2")]
    heard = [msgspec.structs.replace(one, body=sent.body) for one in heard]
    signed = [air["world"].signed(one, NOW_NS) for one in (sent, *heard)]
    assert len({one.signed for one in signed}) == 1
    for one in signed:
        air["misbehaviour"].check(one, NOW_NS)


def test_what_is_not_signed_is_refused(air):
    assert "not signed" in refused(air, cam())


def test_what_a_car_signs_in_another_s_name_is_refused(air):
    assert "signed by n2" in refused(air, air["n2"].signed(cam("n1"), NOW_NS))


@pytest.mark.parametrize(
    "change", [{"body": body_at(1.0)}, {"t_ns": NOW_NS + 1}, {"station": "n2"}], ids=str
)
def test_what_was_changed_on_the_way_is_refused(air, change):
    sent = air["n1"].signed(cam(), NOW_NS)
    refused(air, msgspec.structs.replace(sent, **change))


@pytest.mark.parametrize("late_ns", [3 * NS_PER_S, -NS_PER_S])
def test_what_is_old_or_from_the_future_is_refused(air, late_ns):
    assert "old" in refused(air, air["n1"].signed(cam(), NOW_NS), NOW_NS + late_ns)


def test_a_repeated_message_is_refused(air):
    first = air["n1"].signed(cam(), NOW_NS)
    second = air["n1"].signed(cam(x_m=1.0), NOW_NS + 100 * NS_PER_MS)
    for sent in (first, second):
        air["misbehaviour"].check(carried(sent), NOW_NS + NS_PER_S)
    for sent in (first, second):
        assert "newer" in refused(air, carried(sent), NOW_NS + NS_PER_S)


@pytest.mark.parametrize("signed", ["x", "AAAA", "é", "A" * 100_000])
def test_nonsense_for_a_signature_is_refused_in_words(air, signed):
    refused(air, msgspec.structs.replace(cam(), signed=signed))


def test_a_ticket_of_another_fleet_is_refused(air, tmp_path):
    other = Fleet(tmp_path / "fleet.toml", "password")
    stranger = SignedCams(add(other, "n1", "vehicle", NOW))
    assert "not of our authority" in refused(air, stranger.signed(cam(), NOW_NS))


def test_the_reader_of_a_bus_drops_and_counts_what_is_refused(air):
    reader = Reader(StepClock(NOW_NS), air["misbehaviour"].check)
    key = "scm/@v1/city/v2x/tx/n1/cam"
    assert reader.read(CamTx, key, *encode(cam()), NOW_NS) is None
    assert reader.rejected == 1
    signed = air["n1"].signed(cam(), NOW_NS)
    assert reader.read(CamTx, key, *encode(signed), NOW_NS).message == signed


def test_without_a_fleet_a_cam_has_the_bytes_it_always_had():
    assert list(msgspec.json.decode(encode(cam())[0])) == ["station", "t_ns", "body"]


def test_only_senders_of_cams_get_a_ticket(fleet):
    held = {name: read_credentials(fleet.credentials(name)) for name in STATIONS}
    assert {name for name, one in held.items() if one.ticket} == {"n1", "n2", "world"}
    assert all(one.air_authority for one in held.values())


@pytest.mark.parametrize(("days", "renewed"), [(0, False), (330, False), (340, True)])
def test_the_city_s_own_tickets_are_renewed_before_they_end(tmp_path, days, renewed):
    fleet = Fleet(tmp_path / "fleet.toml", "password")

    def ticket(now):
        complete(fleet, {"world": "part"}, now)
        return read_credentials(fleet.credentials("world")).ticket

    before = ticket(NOW)
    assert (ticket(NOW + timedelta(days=days)) != before) is renewed


def test_credentials_without_tickets_are_renewed(tmp_path):
    fleet = Fleet(tmp_path / "fleet.toml", "password")
    complete(fleet, {"world": "part"}, NOW)
    path = fleet.credentials("world")
    lines = path.read_text().split("ticket = ")[0]
    path.write_text(lines)
    assert not read_credentials(path).ticket
    complete(fleet, {"world": "part"}, NOW)
    assert ticket_ends(read_credentials(path).ticket) > NOW + timedelta(days=300)


def test_a_broken_ticket_is_refused_when_it_is_read(fleet):
    held = read_credentials(fleet.credentials("n1"))
    for change in ({"ticket": "AAAA"}, {"ticket_key": "x"}, {"air_authority": "!"}):
        fields = {name: getattr(held, name) for name in type(held).__dataclass_fields__}
        with pytest.raises(AccessError):
            SignedCams(type(held)(**{**fields, **change}))
