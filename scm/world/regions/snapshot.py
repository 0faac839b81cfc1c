"""A region's own state, from which a standby goes on in its place, bit by bit.

A standby is a region without a place: it handles the same requests and gets the same news as all
others, so it knows all that regions know alike, and lacks only what the owner of cars knows. It
follows as far as the last snapshot of the region that it stands by for, and stores what comes after
that. When the region is lost, it takes the snapshot and makes the stored ticks faster than they
came; the other regions wait for its next message at their borders.
"""

from collections.abc import Sequence

import msgspec
import numpy as np

from scm.errors import MessageError
from scm.v2x.message import decode, encode
from scm.world.radio import RadioCounts
from scm.world.regions.exchange import counts_of
from scm.world.regions.region import Region
from scm.world.regions.transfer import CarTransfer, accept, read
from scm.world.transmission import RECEIVED

_KINDS = {kind.__name__: kind for kind in RECEIVED.values()}


class LateFrame(msgspec.Struct, frozen=True, array_like=True):
    """A radio frame that arrives later."""

    due_ns: int
    kind: str
    body: bytes


class RegionSnapshot(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """All that a region alone knows at the end of a tick.

    Attributes:
        region: Its number.
        tick: Of the city.
        cars: Those that it owns.
        counts: Of its radio, as in `RadioCounts`.
        published: The city's counts at the last `RadioStatus`.
        late: Frames of its cars and receivers that arrive later, in order.
        ignored: Messages without effect.
    """

    region: int
    tick: int
    cars: tuple[CarTransfer, ...]
    counts: tuple[int, ...]
    published: tuple[int, ...]
    late: tuple[LateFrame, ...]
    ignored: int


_encode = msgspec.msgpack.Encoder().encode
_decode = msgspec.msgpack.Decoder(RegionSnapshot).decode


def snapshot(region: Region, now_ns: int) -> bytes:
    """Return a region's own state at the end of a tick."""
    world, radio = region.world, region.world.radio
    own = np.flatnonzero(world.cars.arrays.hosted & ~world.cars.arrays.elsewhere)
    names = world.cars.arrays.names
    cars = [read(world, world.cars.hosted[names[index]], now_ns) for index in own.tolist()]
    return _encode(
        RegionSnapshot(
            region=region.ownership.number,
            tick=world.tick,
            cars=tuple(cars),
            counts=counts_of(radio.link.counts),
            published=counts_of(radio.published),
            late=tuple(
                LateFrame(due_ns, type(frame).__name__, encode(frame)[0])
                for due_ns, frame in radio.in_flight.waiting()
            ),
            ignored=world.ignored,
        )
    )


def resume_region(standby: Region, body: bytes) -> None:
    """Let a standby go on as the region that a snapshot is of, from the tick that it is of.

    Raises:
        MessageError: when the snapshot cannot be read, or is of another tick than the standby.
    """
    try:
        state = _decode(body)
    except msgspec.MsgspecError as cause:
        raise MessageError(f"snapshot of a region: {cause}") from cause
    world = standby.world
    if state.tick != world.tick:
        msg = f"snapshot of region {state.region}: expected tick {world.tick}, got {state.tick}"
        raise MessageError(msg)
    _check_cars(standby, state.region, state.cars)
    standby.ownership.become(state.region)
    for car in state.cars:
        accept(world, car)
    world.radio.link.counts = RadioCounts(*state.counts)
    world.radio.published = RadioCounts(*state.published)
    for frame in state.late:
        world.radio.in_flight.put(frame.due_ns, decode(_KINDS[frame.kind], frame.body))
    world.ignored = state.ignored
    standby.look()


def _check_cars(standby: Region, number: int, cars: Sequence[CarTransfer]) -> None:
    own = np.flatnonzero(standby.ownership.owner == number).tolist()
    if sorted(car.index for car in cars) != own:
        msg = f"snapshot of region {number}: expected the cars {own}, got those of {len(cars)} cars"
        raise MessageError(msg)
