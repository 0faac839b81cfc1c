"""A host whose device sends anything at all: bytes, flipped bits, frames cut short."""

import random
from dataclasses import dataclass

from scm.clock import NS_PER_MS
from tests.unit.nigel.fake_device import BATTERY, OURS, Device, announced, asking_time
from vehicle_agent.nigel.host import Host, NigelCommand
from vehicle_agent.nigel.rosserial import (
    REQUEST_TOPICS,
    STOP_SENDING,
    TIME,
    Decoder,
    Frame,
    pack,
    pack_float,
)

TURN_NS = 10 * NS_PER_MS
RECOVERY_NS = 100 * NS_PER_MS
CALM_TURNS = 40
WISH = NigelCommand(0.25, -0.5, 5)
RIGHT = {100: pack_float(-0.5), 101: pack_float(0.25), 102: pack_float(5.0)}


@dataclass
class Found:
    """What the fuzzing saw.

    Attributes:
        wrong: Frames that never should have gone out.
        slowest_ns: From the first clean byte to an answer, the longest.
    """

    sent: int = 0
    rounds: int = 0
    wrong: int = 0
    slowest_ns: int = 0


def fuzz(total, seed):
    """Send about `total` bytes of rubbish to one host; return what happened."""
    rng, found = random.Random(seed), Found()
    host, device = Host(), Device(OURS)
    now_ns = 10**18
    host.open(now_ns)
    now_ns += 2_100 * NS_PER_MS
    reader, back = Decoder(), b""
    while found.sent < total:
        for _ in range(rng.randrange(1, 20)):
            rubbish = _rubbish(rng)
            found.sent += len(rubbish)
            now_ns += TURN_NS
            _check(
                host.receive(rubbish, now_ns) + host.frames_due(WISH, now_ns), reader, found, now_ns
            )
        found.rounds += 1
        clean_ns, answered_ns = now_ns, None
        for turn in range(CALM_TURNS):
            now_ns += TURN_NS
            if answered_ns is None and turn % 2 == 0:
                back += asking_time()
            answers = host.receive(back, now_ns)
            if answers and answered_ns is None:
                answered_ns = now_ns
            frames = answers + host.frames_due(WISH, now_ns)
            _check(frames, reader, found, now_ns)
            back = device.hear(b"".join(frames), now_ns)
        late_ns = (answered_ns or clean_ns + CALM_TURNS * TURN_NS) - clean_ns
        found.slowest_ns = max(found.slowest_ns, late_ns)
        found.wrong += host.phase != "ready"
    return found


def _check(frames, reader, found, now_ns):
    for frame in reader.feed(b"".join(frames), now_ns):
        harmless = frame in (REQUEST_TOPICS, STOP_SENDING) or frame.topic == TIME
        found.wrong += not (harmless or RIGHT.get(frame.topic) == frame.payload)
    found.wrong += reader.skipped


def _rubbish(rng):
    kind = rng.randrange(5)
    if kind == 0:
        return rng.randbytes(rng.randrange(400))
    if kind == 1:
        return b"\xff\xfe" * rng.randrange(60) + rng.randbytes(rng.randrange(9))
    info = rng.choice([*map(announced, OURS), pack(Frame(BATTERY.number, rng.randbytes(4)))])
    damaged = bytearray(info * rng.randrange(1, 4))
    if kind == 2:
        return bytes(damaged[rng.randrange(len(damaged)) :])
    if kind == 3:
        length = rng.randrange(1024)
        head = length.to_bytes(2, "little")
        return b"\xff\xfe" + head + bytes([255 - sum(head) % 256]) + bytes(damaged)
    for _ in range(rng.randrange(1, 5)):
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    return bytes(damaged)
