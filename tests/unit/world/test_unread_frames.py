"""Frames that only their receivers read: the world brings them over the radio undecoded."""

import pytest

from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.signals.part import TrafficPart
from scm.v2x.exchange import RawSample
from scm.v2x.key import prefix
from scm.v2x.messages.mapem import MapemRx, MapemTx
from scm.world.part import WorldPart
from tests.unit.world.conftest import TICK

TOWN = load_map("grid:3x3:12")
RSU = f"rsu-{TOWN.junctions[0].name}"


def mapem(station, body):
    return RawSample(f"{prefix('city')}v2x/tx/{station}/mapem", body, None, 0)


def step(part, sample):
    """Step a world once more, with what arrived; return what it sends."""
    return part.step(part.world.tick * TICK, [sample])


@pytest.fixture
def part():
    """The world of a town whose roadside units are in range of each other, opened."""
    world = WorldPart(TOWN)
    world.step(0, [])
    return world


def test_a_mapem_reaches_who_listens_with_the_body_that_was_sent():
    with Lockstep([WorldPart(TOWN), TrafficPart(TOWN)]) as city:
        sent, received = (city.subscribe(Subscription(one)) for one in (MapemTx, MapemRx))
        city.run_for(1.5)
        bodies = {item.message.station: item.message.body for item in sent.drain()}
        reached = [item.message for item in received.drain()]
    assert len(reached) > len(bodies) > 1
    for message in reached:
        assert message.receiver != message.station
        assert message.body.intersections == bodies[message.station].intersections


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b'{"station":"rsu-j1_0"}', b"\xff"])
def test_a_body_that_cannot_be_read_is_counted_and_dropped(part, body):
    before = part.world.ignored
    assert not any(isinstance(out, MapemRx) for out in step(part, mapem(RSU, body)))
    assert part.world.ignored == before + 1


@pytest.mark.parametrize("station", ["rsu-nowhere", "*", "N 1", "n1/x"])
def test_a_frame_of_nobody_is_dropped(part, station):
    before = part.world.ignored
    assert not any(isinstance(out, MapemRx) for out in step(part, mapem(station, b"{}")))
    assert part.world.ignored == before + 1


def test_what_nobody_listens_to_is_not_read(part):
    counts, before = part.world.radio.link.counts, part.world.ignored
    sent = counts.sent
    part.attach(lambda *_: False)
    step(part, mapem(RSU, b"not a MAPEM"))
    assert part.world.ignored == before
    assert counts.sent == sent + 1
