"""A radio that loses nothing changes nothing: the same run, bit for bit, as with none told of."""

import hashlib

import pytest
from msgspec.structs import replace

from scm.maps.load import load_map
from scm.maps.radio import with_radio
from scm.records.city_map import RadioChannel
from scm.runtime.lockstep import Lockstep
from scm.traffic.signals.part import TrafficPart
from scm.world.part import WorldPart

CARS = tuple((f"n{n}", "nigel") for n in range(1, 5))
PERFECT = {
    "said so": ["loss=0", "delay_ms=0"],
    "measured, not full": ["data_rate_mbps=6", "path_loss_exponent=3.5"],
    "far enough": ["range_m=100"],
}


def driven(city_map):
    """Return a hash of where four cars were, tick by tick, for 8 s at the lights."""
    part, digest = WorldPart(city_map, 3, CARS, room=0), hashlib.blake2b(digest_size=16)
    slots = part.world.cars.arrays
    with Lockstep([part, TrafficPart(city_map)]) as city:
        for _ in range(80):
            city.run_for(0.1)
            for column in (slots.x, slots.y, slots.yaw, slots.speed, slots.throttle):
                digest.update(column.tobytes())
    return digest.hexdigest()


@pytest.fixture(scope="module")
def school():
    return load_map("driving_school")


@pytest.fixture(scope="module")
def untold(school):
    assert school.radio == RadioChannel(), "the map says nothing of its radio"
    return driven(school)


@pytest.mark.parametrize("settings", PERFECT.values(), ids=PERFECT)
def test_a_perfect_radio_is_no_radio(school, untold, settings):
    assert driven(with_radio(school, settings)) == untold


def test_a_radio_that_loses_frames_is_one(school, untold):
    assert driven(replace(school, radio=RadioChannel(loss=0.7))) != untold
