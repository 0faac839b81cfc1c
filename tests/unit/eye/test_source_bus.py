"""Frames over the bus: only the newest counts, damaged ones are counted, clocks are minded."""

import struct
import zlib

import cv2
import numpy as np
import pytest

from scm.clock import NS_PER_MS, NS_PER_S, StepClock
from scm.errors import MessageError
from scm.eye.source import Listener
from scm.eye.sources.bus import BusSource
from scm.v2x.bus_memory import MemoryNetwork
from scm.v2x.exchange import Incoming
from scm.v2x.mailbox import Mailbox
from scm.v2x.messages.eye_picture_in import EyePictureIn

NOW_NS = 1000 * NS_PER_S


def jpeg(number=0):
    image = np.random.default_rng(number).integers(40, 200, (48, 64, 3), dtype=np.uint8)
    return cv2.imencode(".jpg", image)[1].tobytes()


def png_of(width, height):
    """Return the beginning of a PNG that claims a size."""
    head = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    size, check = struct.pack(">I", 13), struct.pack(">I", zlib.crc32(head))
    data = bytes(4) + b"IDAT" + struct.pack(">I", zlib.crc32(b"IDAT"))
    return b"\x89PNG\r\n\x1a\n" + size + head + check + data


def arrive(source, arrival_ns, t_ns, payload=None, camera="roof", shares_clock=True):
    message = EyePictureIn(
        camera=camera,
        t_ns=t_ns,
        shares_clock=shares_clock,
        payload=jpeg(t_ns % 97) if payload is None else payload,
    )
    source.receive(Incoming(message, arrival_ns))


def test_a_picture_on_the_bus_is_heard_by_who_listens_for_its_camera():
    network = MemoryNetwork(StepClock(NOW_NS))
    source = BusSource("roof")
    assert isinstance(source, Listener)
    box = Mailbox(4)
    with network.bus("city", "eye") as ear, network.bus("city", "roof-pc") as mouth:
        for one in source.subscriptions:
            ear.subscribe(one.kind, one.where, box)
        for camera in ("door", "roof"):
            mouth.publish(EyePictureIn(camera=camera, t_ns=NOW_NS - 5, payload=jpeg()))
        items = box.drain()
    assert len(items) == 1
    source.receive(items[0])
    frame = source.read(NOW_NS, None)
    assert (frame.t_ns, frame.stamped, frame.image.shape) == (NOW_NS - 5, "exposed", (48, 64, 3))


def test_only_the_newest_counts_and_another_camera_is_not_ours():
    source = BusSource("roof")
    arrive(source, NOW_NS, NOW_NS - 30)
    arrive(source, NOW_NS, NOW_NS - 20)
    arrive(source, NOW_NS, NOW_NS - 10, camera="door")
    assert source.read(NOW_NS, None).t_ns == NOW_NS - 20
    assert source.read(NOW_NS, None) is None
    assert (source.tally.good, source.tally.passed_over) == (1, 1)


@pytest.mark.parametrize("payload", [b"", b"\xff\xd8\xff", jpeg()[:-30], png_of(60_000, 60_000)])
def test_a_damaged_picture_is_counted_and_said_and_the_next_one_is_good(payload):
    source = BusSource("roof")
    arrive(source, NOW_NS, NOW_NS, payload)
    assert source.read(NOW_NS, None) is None
    assert source.problem.startswith("bus:roof: a frame: expected a ")
    assert source.problem.endswith("(1 damaged so far)")
    arrive(source, NOW_NS + 1, NOW_NS + 1)
    assert source.read(NOW_NS + 1, None)


def test_a_sender_with_another_clock_is_mapped_to_ours():
    source = BusSource("roof")
    times = []
    for i in range(20):
        arrival_ns = NOW_NS + i * 50 * NS_PER_MS + (i % 5) * 4 * NS_PER_MS
        arrive(source, arrival_ns, NOW_NS + (50 * i - 900) * NS_PER_MS, shares_clock=False)
        times.append(source.read(arrival_ns, None).t_ns)
    assert times == [NOW_NS + i * 50 * NS_PER_MS for i in range(20)]


def test_a_clock_that_is_said_to_be_ours_and_is_ahead_is_not_believed():
    source = BusSource("roof")
    arrive(source, NOW_NS, NOW_NS + 3 * NS_PER_S)
    assert source.read(NOW_NS, None).t_ns == NOW_NS


def test_silence_is_said_and_a_closed_source_gives_nothing():
    source = BusSource("roof")
    source.read(NOW_NS, None)
    assert source.problem is None
    source.read(NOW_NS + 2 * NS_PER_S, None)
    assert source.problem == "bus:roof: no frame for 2.0 s"
    source.close()
    arrive(source, NOW_NS + 2 * NS_PER_S, NOW_NS)
    assert source.read(NOW_NS + 2 * NS_PER_S, None) is None


def test_a_name_that_cannot_stand_in_a_key_is_refused():
    with pytest.raises(MessageError, match="camera: got 'The Roof'"):
        BusSource("The Roof")
