"""Messages as bytes: JSON for everything, raw payloads beside a JSON header."""

import math

import pytest

from scm.errors import MessageError
from scm.v2x.message import Refused, decode, encode
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.trip import Trip


def scan():
    return LidarScan(
        vehicle="n1", t_ns=5, beams=1, range_min_m=0.15, range_max_m=12.0, payload=b"\x00\xffab"
    )


def test_a_message_is_plain_json():
    body, attachment = encode(Refused(code="owned", detail="by n2"))
    assert body == b'{"code":"owned","detail":"by n2"}'
    assert attachment is None


def test_a_payload_is_the_body_and_the_rest_is_the_attachment():
    body, attachment = encode(scan())
    assert body == b"\x00\xffab"
    assert attachment == (
        b'{"vehicle":"n1","t_ns":5,"beams":1,"range_min_m":0.15,"range_max_m":12.0}'
    )
    assert decode(LidarScan, body, attachment) == scan()


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
    ],
)
def test_bytes_that_are_no_such_message_are_refused_with_class_and_field(body, said):
    with pytest.raises(MessageError, match=said):
        decode(CityStop, body)


@pytest.mark.parametrize("attachment", [None, b"{", b"[1]", b'{"vehicle":"n1"}'])
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
