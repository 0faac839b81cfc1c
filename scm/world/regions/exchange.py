"""What the regions of a city tell each other once a tick, and its encoding."""

from collections.abc import Sequence
from dataclasses import fields
from operator import attrgetter

import msgspec
import numpy as np

from scm.errors import MessageError
from scm.v2x.messages.denm import DenmTx
from scm.world.radio import RadioCounts
from scm.world.regions.transfer import CarTransfer

MOTION = ("x", "y", "yaw", "speed", "yaw_rate")
"""What all regions know of every car: names of `VehicleArrays`."""
counts_of = attrgetter(*(field.name for field in fields(RadioCounts)))
"""Returns the counts of a radio as a tuple."""
NO_COUNTS: tuple[int, ...] = counts_of(RadioCounts())
_INDEX, _NUMBER = np.dtype("<i4"), np.dtype("<f8")


class RegionNews(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """What a region tells all others.

    Attributes:
        region: Its number.
        tick: Of the city.
        indices: (n,) int32, the cars that it has just moved.
        motion: (5, n) float64, theirs: `MOTION`.
        denms: What its cars warn of now.
        counts: Of its radio, as in `RadioCounts`.
        waiting: How many of its frames arrive later.
    """

    region: int
    tick: int
    indices: bytes
    motion: bytes
    denms: tuple[DenmTx, ...] = ()
    counts: tuple[int, ...] = NO_COUNTS
    waiting: int = 0


class RegionMessage(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """What a region tells another one: `RegionNews` for all, and the cars that this one gets."""

    news: msgspec.Raw
    transfers: tuple[CarTransfer, ...] = ()


_encode = msgspec.msgpack.Encoder().encode
_news = msgspec.msgpack.Decoder(RegionNews)
_message = msgspec.msgpack.Decoder(RegionMessage)


def encode(news: RegionNews, transfers: Sequence[Sequence[CarTransfer]]) -> list[bytes]:
    """Return the messages to all regions, by number; `transfers` are the cars for each."""
    for_all = msgspec.Raw(_encode(news))
    nobody = _encode(RegionMessage(news=for_all))
    return [
        _encode(RegionMessage(news=for_all, transfers=tuple(cars))) if cars else nobody
        for cars in transfers
    ]


def decode(body: bytes, tick: int, capacity: int) -> tuple[RegionNews, tuple[CarTransfer, ...]]:
    """Return what a region sent in a tick.

    Args:
        body: As `encode` made it.
        tick: That it must be of.
        capacity: Of vehicle indices.

    Raises:
        MessageError: when it cannot be read, is of another tick, or speaks of impossible cars.
    """
    try:
        message = _message.decode(body)
        news = _news.decode(message.news)
    except msgspec.MsgspecError as cause:
        raise MessageError(f"message of a region: {cause}") from cause
    where = f"message of region {news.region}"
    if news.tick != tick:
        raise MessageError(f"{where}: expected tick {tick}, got {news.tick}")
    count, rest = divmod(len(news.indices), _INDEX.itemsize)
    if rest or len(news.motion) != len(MOTION) * count * _NUMBER.itemsize:
        msg = f"{where}: {len(news.indices)} bytes of indices and {len(news.motion)} of motion"
        raise MessageError(f"{msg}: expected 4 and {len(MOTION)} * 8 a car")
    indices = np.frombuffer(news.indices, _INDEX)
    if len(indices) and not (indices.min() >= 0 and indices.max() < capacity):
        raise MessageError(f"{where}: expected vehicle indices from 0 to {capacity - 1}")
    return news, message.transfers
