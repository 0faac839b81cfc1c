"""Drivers who have heard a warning come near its place with caution."""

import math

import numpy as np
import pytest

from scm.clock import NS_PER_S
from scm.records.city_map import RadioChannel
from scm.v2x.etsi.events import ACCIDENT, DenmSender, Event
from scm.vehicles.drivers.channel import channel_of
from scm.vehicles.drivers.hazards import CAUTIOUS_SHARE, MAX_HAZARDS, HazardTable, speed_share

NOW = NS_PER_S
EVENT = Event(cause=ACCIDENT, x_m=2.0, y_m=1.0, valid_s=10)
NO_WALLS = np.zeros((0, 4))


def air(cars=1, **radio):
    channel = channel_of(RadioChannel(**radio), 20.0, cars, NO_WALLS)
    return channel, HazardTable(channel)


def told(hazards, event=EVENT, now_ns=NOW, name="n9"):
    sender = DenmSender(name)
    action = sender.trigger(event, now_ns)
    for body in sender.due(now_ns):
        hazards.receive(body, now_ns)
    return sender, action


@pytest.mark.parametrize(
    ("x", "y", "yaw", "share"),
    [
        (1.0, 1.0, 0.0, CAUTIOUS_SHARE),
        (2.0, 0.2, math.pi / 2, CAUTIOUS_SHARE),
        (3.0, 1.0, 0.0, 1.0),
        (1.0, 1.0, math.pi, 1.0),
        (0.4, 1.0, 0.0, 1.0),
        (2.0, 1.0, 0.0, 1.0),
        (1.0, 1.0, math.pi / 2, 1.0),
    ],
)
def test_caution_holds_for_who_has_the_place_close_ahead(x, y, yaw, share):
    _, hazards = air()
    assert speed_share(hazards.hazards, 0, x, y, yaw, NOW, 0) == 1.0
    told(hazards)
    assert speed_share(hazards.hazards, 0, x, y, yaw, NOW, 0) == share


def test_caution_ends_with_the_event():
    _, hazards = air()
    sender, action = told(hazards)
    here = hazards.hazards, 0, 1.0, 1.0, 0.0
    assert speed_share(*here, NOW + 9 * NS_PER_S, 0) == CAUTIOUS_SHARE
    assert speed_share(*here, NOW + 11 * NS_PER_S, 0) == 1.0
    sender.cancel(action, NOW + NS_PER_S)
    for body in sender.due(NOW + NS_PER_S):
        hazards.receive(body, NOW + NS_PER_S)
    assert speed_share(*here, NOW + 2 * NS_PER_S, 0) == 1.0


def test_who_gets_no_frame_of_it_drives_on_until_a_repetition_arrives():
    cars = 400
    channel, hazards = air(cars, loss=0.5)
    channel.poses[:, :2] = 1.0, 1.0
    sender, _ = told(hazards)
    know = [
        np.mean(
            [speed_share(hazards.hazards, car, 1.0, 1.0, 0.0, NOW, 3) < 1.0 for car in range(cars)]
        )
    ]
    for second in (1, 2):
        for body in sender.due(NOW + second * NS_PER_S):
            hazards.receive(body, NOW + second * NS_PER_S)
        now = NOW + second * NS_PER_S
        aware = [
            speed_share(hazards.hazards, car, 1.0, 1.0, 0.0, now, 3) < 1.0 for car in range(cars)
        ]
        know.append(np.mean(aware))
    assert know == pytest.approx([0.5, 0.75, 0.875], abs=0.07)


def test_more_places_than_there_is_room_for_drop_the_one_that_ends_first():
    _, hazards = air()
    for number in range(MAX_HAZARDS + 1):
        told(hazards, EVENT._replace(x_m=3.0 * number, valid_s=20 + number), NOW, f"n{number}")
    assert speed_share(hazards.hazards, 0, -1.0, 1.0, 0.0, NOW, 0) == 1.0
    assert (
        speed_share(hazards.hazards, 0, 3.0 * MAX_HAZARDS - 1.0, 1.0, 0.0, NOW, 0) == CAUTIOUS_SHARE
    )
