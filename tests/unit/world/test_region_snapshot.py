"""A region is lost; its standby goes on from the last snapshot, and nothing differs."""

import pytest

from scm.clock import NS_PER_MS
from scm.errors import MessageError
from scm.maps.load import load_map
from scm.world.hosted import ELSEWHERE
from scm.world.part import WorldPart
from scm.world.regions.cut import Cut, cut_map
from scm.world.regions.region import Region
from scm.world.regions.snapshot import resume_region, snapshot
from scm.world.regions.transfer import digest

MAP, CARS, SEED, TICK = load_map("grid:4x3:3"), 48, 2, 20 * NS_PER_MS
TAKEN, LOST, END = 60, 75, 160
HOSTED = tuple((f"n{i + 1}", "nigel") for i in range(CARS))


class Process:
    """A region, as its process would run it."""

    def __init__(self, cut, number):
        self.part = WorldPart(MAP, SEED, HOSTED, room=4)
        self.region = Region(self.part.world, cut, number)
        self.now = 0

    def advance(self):
        self.part.begin(self.now)
        return self.region.advance(self.now, [])[1]

    def report(self, messages):
        self.region.report(self.now, messages)
        self.now += TICK

    def digests(self):
        world, now = self.part.world, self.now - TICK
        cars = [car for car in world.cars.hosted.values() if car.row != ELSEWHERE]
        return {car.name: digest(world, car, now) for car in cars}


@pytest.fixture(scope="module")
def regions():
    """Two regions and a standby for the second: these, its snapshot, and what was sent since."""
    half = cut_map(MAP, 2)
    cut = Cut(3, half.frame, half.cells)  # the third has no place
    first, second, standby = (Process(cut, number) for number in range(3))
    body, stored = b"", []
    for tick in range(1, LOST + 1):
        sent, answered = first.advance(), second.advance()
        if tick <= TAKEN:
            standby.advance()
            standby.report([sent[2], answered[2]])
        else:
            stored.append(sent[1])
        first.report([answered[0]])
        second.report([sent[1]])
        if tick == TAKEN:
            body = snapshot(second.region, second.now - TICK)
    return first, second, standby, body, stored


def test_standby_goes_on_from_a_snapshot_bit_by_bit(regions):
    first, second, standby, body, stored = regions
    assert standby.digests() == {}
    with pytest.raises(MessageError, match="snapshot of a region"):
        resume_region(standby.region, body[:-1])
    with pytest.raises(MessageError, match=f"expected tick {LOST}, got {TAKEN}"):
        resume_region(second.region, body)
    resume_region(standby.region, body)
    for message in stored:  # the ticks since the snapshot, for the second time
        standby.advance()
        standby.report([message])
    assert standby.digests() == second.digests() != {}
    for _ in range(LOST, END):
        sent, answered = first.advance(), standby.advance()
        first.report([answered[0]])
        standby.report([sent[1]])
    assert first.region.ownership.moved > 0
    whole = WorldPart(MAP, SEED, HOSTED, room=4)
    for tick in range(END):
        whole.step(tick * TICK, [])
    expected = {
        car.name: digest(whole.world, car, (END - 1) * TICK)
        for car in whole.world.cars.hosted.values()
    }
    assert first.digests() | standby.digests() == expected
