"""Sends invalid messages: python -m scm.selftest.fuzz ENDPOINT CITY COUNT HZ MOST_S SEED.

Half of them are random bytes, half are real ones of the city with something broken; they go to
every key on which the city talks, and to keys of every message class besides.
"""

import random
import re
import sys
import threading
from collections.abc import Iterator

import msgspec
import zenoh  # noqa: TID251  no bus sends what cannot be read

from scm.clock import NS_PER_S, WallClock
from scm.v2x import zenoh_config
from scm.v2x.bus import RawMailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.exchange import RawSample
from scm.v2x.key import prefix, variables
from scm.v2x.messages import message_classes

LISTENED_S = 3.0
AT_ONCE = 50
WRONG = (b"null", b"-1", b"1e999", b"9223372036854775808", b'"x"', b"[]", b"{}", b"NaN", b"true")
_VALUE = re.compile(rb'(?<=:)(-?[0-9.e+-]+|"[^"]*"|null|true|false)')


def main(endpoint: str, city: str, count: int, rate_hz: float, most_s: float, seed: int) -> None:
    """Send so many broken messages, evenly in time, for no longer than that; print how many."""
    samples = _listen(endpoint, city)
    session = zenoh.open(zenoh.Config.from_json5(zenoh_config.client(endpoint, 5.0)))
    clock, never = WallClock(), threading.Event()
    began_ns, sent = clock.now_ns(), 0
    for key, body, attachment in broken(samples, city, count, seed):
        if sent % AT_ONCE == 0:
            if clock.now_ns() - began_ns > most_s * NS_PER_S:
                break
            clock.wait_until(began_ns + round(sent / rate_hz * NS_PER_S), never)
        session.put(key, body, attachment=attachment)
        sent += 1
    session.close()  # type: ignore[no-untyped-call]
    sys.stdout.write(f"{sent}\n")


def broken(
    samples: list[RawSample], city: str, count: int, seed: int
) -> Iterator[tuple[str, bytes, bytes | None]]:
    """Yield so many (key, body, attachment)."""
    rng = random.Random(seed)
    keys = sorted({sample.key for sample in samples} | set(_own_keys(city)))
    places = {id(one): [place.span() for place in _VALUE.finditer(one.body)] for one in samples}
    for _ in range(count):
        if rng.random() < 0.5 or not samples:
            body = rng.randbytes(rng.choice((0, 1, 20, 300, 4000)))
            yield rng.choice(keys), body, rng.choice((None, None, rng.randbytes(30)))
        else:
            sample = rng.choice(samples)
            key = sample.key if rng.random() < 0.8 else rng.choice(keys)
            yield key, _break(sample.body, places[id(sample)], rng), sample.attachment


def _break(body: bytes, places: list[tuple[int, int]], rng: random.Random) -> bytes:
    """Return a body that is cut, hit, doubled, or has another value at one of its places."""
    match rng.randrange(4):
        case 0:
            return body[: rng.randrange(len(body) + 1)]
        case 1 if body:
            at = rng.randrange(len(body))
            return body[:at] + rng.randbytes(1) + body[at + 1 :]
        case 2:
            return body + body
    if not places:
        return b"[" * 10_000
    begin, end = rng.choice(places)
    return body[:begin] + rng.choice(WRONG) + body[end:]


def _own_keys(city: str) -> Iterator[str]:
    """Yield one key of every message class that is published."""
    for kind in message_classes():
        yield prefix(city) + kind.KEY.format(**dict.fromkeys(variables(kind), "n1"))


def _listen(endpoint: str, city: str) -> list[RawSample]:
    box, clock = RawMailbox(4096), WallClock()
    with ZenohBus(city, "fuzz", endpoint) as bus:
        bus.subscribe_raw(box)
        clock.wait_until(clock.now_ns() + round(LISTENED_S * NS_PER_S), threading.Event())
        samples = [item for item in box.drain() if isinstance(item, RawSample)]
    return [s for s in samples if len(s.body) < 20_000 and _is_json(s.body)]


def _is_json(body: bytes) -> bool:
    try:
        msgspec.json.decode(body, type=msgspec.Raw)
    except msgspec.MsgspecError:
        return False
    return True


if __name__ == "__main__":
    count, rate_hz, most_s = int(sys.argv[3]), float(sys.argv[4]), float(sys.argv[5])
    main(sys.argv[1], sys.argv[2], count, rate_hz, most_s, int(sys.argv[6]))
