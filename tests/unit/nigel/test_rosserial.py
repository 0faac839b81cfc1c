"""rosserial's frames: known bytes, and streams with anything in them."""

import random

import pytest

from scm.clock import NS_PER_MS
from scm.errors import MessageError
from vehicle_agent.nigel.rosserial import (
    FLOAT32,
    FLOAT32_MD5,
    FRAME_TIMEOUT_NS,
    MAX_PAYLOAD_BYTES,
    REQUEST_TOPICS,
    STOP_SENDING,
    TIME,
    Decoder,
    Frame,
    TopicInfo,
    pack,
    pack_float,
    pack_time,
    pack_topic_info,
    unpack_float,
    unpack_topic_info,
)

STEER = Frame(100, pack_float(0.5))


@pytest.mark.parametrize(
    ("frame", "known"),
    [
        (REQUEST_TOPICS, "ff fe 00 00 ff 00 00 ff"),
        (STOP_SENDING, "ff fe 00 00 ff 0b 00 f4"),
        (STEER, "ff fe 04 00 fb 64 00 00 00 00 3f 5c"),
        (Frame(101, pack_float(0.4)), "ff fe 04 00 fb 65 00 cd cc cc 3e f7"),
        (Frame(TIME, pack_time(1_000_000_002)), "ff fe 08 00 f7 0a 00 01 00 00 00 02 00 00 00 f2"),
    ],
)
def test_frames_have_the_bytes_of_rosserial(frame, known):
    assert pack(frame) == bytes.fromhex(known)
    assert Decoder().feed(bytes.fromhex(known), 0) == [frame]


def test_the_longest_frame_comes_back():
    longest = Frame(7, bytes(MAX_PAYLOAD_BYTES))
    assert Decoder().feed(pack(longest), 0) == [longest]


def test_what_is_too_long_is_not_packed():
    with pytest.raises(MessageError, match=f"got topic 7 with {MAX_PAYLOAD_BYTES + 1} bytes"):
        pack(Frame(7, bytes(MAX_PAYLOAD_BYTES + 1)))


def test_a_topic_info_comes_back_and_cut_or_long_ones_are_refused():
    info = TopicInfo(100, "steer_cmd", FLOAT32, FLOAT32_MD5, 280)
    payload = pack_topic_info(info)
    assert unpack_topic_info(payload) == info
    for bad in (payload[:-1], payload + b"\0", b"", payload[:9]):
        with pytest.raises(MessageError, match="topic info"):
            unpack_topic_info(bad)


def test_a_float_of_other_length_is_refused():
    assert unpack_float(pack_float(-0.25)) == -0.25
    with pytest.raises(MessageError, match="got 3 bytes, expected 4"):
        unpack_float(b"abc")


def test_frames_are_found_whatever_lies_between_them_and_however_they_are_cut():
    draw = random.Random(3)
    decoder, found, sent = Decoder(), [], 400
    stream = bytearray()
    for n in range(sent):
        stream += draw.randbytes(draw.randrange(12)) + pack(Frame(125, pack_float(n)))
    now_ns = 0
    while stream:
        cut = draw.randrange(1, 40)
        found += decoder.feed(bytes(stream[:cut]), now_ns)
        del stream[:cut]
        now_ns += NS_PER_MS
    found += decoder.feed(b"", now_ns + FRAME_TIMEOUT_NS)
    ours = [unpack_float(frame.payload) for frame in found if frame.topic == 125]
    assert ours == list(range(sent))


def test_a_frame_within_one_that_fails_its_check_is_found():
    broken = pack(Frame(101, pack(STEER) + b"xy"))[:-1] + b"\0"
    assert Decoder().feed(broken, 0) == [STEER]


def test_a_length_that_is_never_filled_holds_nothing_up_for_longer_than_its_patience():
    decoder, endless = Decoder(), bytes.fromhex("fffe 0003 fc")
    assert decoder.feed(endless + endless + pack(STEER), 0) == []
    assert decoder.feed(pack(STEER), FRAME_TIMEOUT_NS) == [STEER, STEER]
    assert decoder.skipped == 2 * len(endless)


def test_absurd_lengths_are_not_waited_for():
    assert Decoder().feed(bytes.fromhex("fffe ffff 01") + pack(STEER), 0) == [STEER]
