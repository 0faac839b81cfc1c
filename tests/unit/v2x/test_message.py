"""Messages as bytes: JSON for everything, raw payloads beside a JSON header."""

import gc
import math
from typing import Any

import msgspec
import pytest

from scm.errors import MessageError
from scm.v2x.etsi.convert import cam_of
from scm.v2x.message import Message, Refused, decode, encode
from scm.v2x.messages.cam import CamTx
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.spawn_request import SpawnReply
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

A_TRIP = {
    "vehicle": "n1", "trip_id": "t", "t_ns": 0, "route": (), "done_m": 0.0, "length_m": None,
    "started_ns": 0,
}  # fmt: skip


class Lamp(msgspec.Struct, kw_only=True, frozen=True):
    number: int


class LightsOfMany(Message, kw_only=True, frozen=True):
    lights: tuple[dict[str, int], ...] = ()
    either: Lamp | str = ""
    pair: tuple[str, int] = ("", 0)
    anything: Any = None


def seen(tag_id):
    return SnapshotVehicle(
        vehicle="n1", kind="hosted", car="nigel", tag_id=tag_id, x_m=0.0, y_m=0.0, yaw_rad=0.0,
        speed_mps=0.0, steering_rad=0.0,
    )  # fmt: skip


def scan():
    return LidarScan(
        vehicle="n1", t_ns=5, beams=1, range_min_m=0.15, range_max_m=12.0, payload=b"\x00\xffab"
    )


def test_a_message_is_plain_json():
    body, attachment = encode(Refused(code="owned", detail="by n2"))
    assert body == b'{"code":"owned","detail":"by n2","asked":""}'
    assert attachment is None


def test_a_payload_is_the_body_and_the_rest_is_the_attachment():
    body, attachment = encode(scan())
    assert body == b"\x00\xffab"
    assert attachment == (
        b'{"vehicle":"n1","t_ns":5,"beams":1,"range_min_m":0.15,"range_max_m":12.0,'
        b'"bearing_first_rad":0.0,"bearing_step_rad":null,"sweep_ns":null,"period_ns":null,'
        b'"clockwise":false}'
    )
    assert decode(LidarScan, body, attachment) == scan()


def test_a_scan_without_the_sweep_s_times_is_still_read():
    old = b'{"vehicle":"n1","t_ns":5,"beams":1,"range_min_m":0.15,"range_max_m":12.0}'
    assert decode(LidarScan, b"\x00\xffab", old) == scan()


def test_the_collector_of_cycles_does_not_walk_over_messages():
    lit = tuple(sorted(["tail", "left"]))  # a constant would not be tracked
    assert gc.is_tracked(lit)
    told = msgspec.structs.replace(state(), lights=lit)
    body = cam_of(told, length_m=0.5, width_m=0.2, front_m=0.4)
    for one in (told, msgspec.structs.replace(seen(1), lights=lit), body, body.motion):
        assert not gc.is_tracked(one)


def test_unknown_fields_are_ignored():
    body = b'{"t_ns":1,"engaged":true,"colour":"red"}'
    assert decode(CityStop, body) == CityStop(t_ns=1, engaged=True)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (b'{"t_ns":"soon","engaged":true}', r"CityStop: Expected `int`.*\$\.t_ns"),
        (b'{"engaged":true}', "CityStop: .*missing required field `t_ns`"),
        (b"", "CityStop: "),
        (b"\xff\xfe", "CityStop: "),
        (b'{"t_ns":1', "CityStop: "),
        (b'{"t_ns":1,"engaged":true,"deep":' + b"[" * 100_000, "CityStop: .*recursion"),
        (b'{"t_ns":9223372036854775808,"engaged":true}', "CityStop: .*64 bits"),
        (b'{"t_ns":-1' + b"0" * 300 + b',"engaged":true}', "CityStop: .*64 bits"),
    ],
)
def test_bytes_that_are_no_such_message_are_refused_with_class_and_field(body, said):
    with pytest.raises(MessageError, match=said):
        decode(CityStop, body)


def with_a_number(of):
    return of(10**20), of(2**63 - 1)


@pytest.mark.parametrize(
    ("bad", "good"),
    [
        with_a_number(lambda n: Trip(**A_TRIP | {"arrived_ns": n})),
        with_a_number(lambda n: WorldSnapshot(t_ns=0, tick=1, vehicles=(seen(1), seen(n)))),
        with_a_number(lambda n: LightsOfMany(lights=({"a": n},))),
        with_a_number(lambda n: LightsOfMany(either=Lamp(number=n))),
        with_a_number(lambda n: LightsOfMany(pair=("left", n))),
        with_a_number(lambda n: LightsOfMany(anything=[{"deep": n}])),
    ],
)
def test_long_integers_are_refused_wherever_they_stand(bad, good):
    with pytest.raises(MessageError, match=f"{type(bad).__name__}: .*64 bits"):
        decode(type(bad), encode(bad)[0])
    assert decode(type(good), encode(good)[0]) == good


def test_long_digits_are_fine_where_they_are_no_integers():
    body = b'{"t_ns":-9223372036854775808,"engaged":true,"reason":"%s"}' % (b"9" * 30)
    assert decode(CityStop, body).reason == "9" * 30


def test_long_fractions_are_fine():
    seen = SpawnReply(vehicle="n1", x_m=0.00012345678901234567, y_m=1 / 3, yaw_rad=0.0, tag_id=1)
    body, _ = encode(seen)
    assert decode(SpawnReply, body) == seen


@pytest.mark.parametrize("attachment", [None, b"{", b"[1]", b'{"vehicle":"n1"}', b"[" * 100_000])
def test_a_bulk_message_with_a_bad_header_is_refused(attachment):
    with pytest.raises(MessageError, match="LidarScan: "):
        decode(LidarScan, b"1234", attachment)


def test_not_a_number_is_refused_by_the_receiver():
    body, _ = encode(
        Trip(
            vehicle="n1",
            trip_id="t",
            t_ns=0,
            route=(),
            done_m=math.nan,
            length_m=None,
            started_ns=0,
        )
    )
    with pytest.raises(MessageError, match=r"Trip: Expected `float`, got `null`.*done_m"):
        decode(Trip, body)


def test_what_no_standard_allows_on_the_air_is_refused_with_its_field():
    body = cam_of(state(), length_m=0.5, width_m=0.2, front_m=0.4)
    good, _ = encode(CamTx(station="n1", t_ns=1, body=body))
    assert decode(CamTx, good).body == body
    bad = good.replace(b'"heading":{"value":900', b'"heading":{"value":99999')
    with pytest.raises(MessageError, match=r"\$\.body.*\.heading\.value"):
        decode(CamTx, bad)


def state():
    return VehicleState(
        vehicle="n1",
        t_ns=0,
        seq=1,
        x_m=0.0,
        y_m=0.0,
        yaw_rad=0.0,
        speed_mps=0.1,
        yaw_rate_radps=0.0,
        steering_rad=0.0,
        throttle=0.0,
        source="simulated",
    )
