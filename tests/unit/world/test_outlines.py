"""What LIDARs see of cars and boxes runs counter-clockwise, four faces a body: `Scene` says so."""

import numpy as np
import pytest

from scm.maps.load import load_map
from scm.vehicles.car import load_car
from scm.world.contacts import Contacts
from scm.world.solids import outline


def turns_left(faces):
    """Return for each body whether all its corners turn to the left and its faces close."""
    bodies = faces.reshape(-1, 4, 4)
    along = bodies[:, :, 2:] - bodies[:, :, :2]
    onwards = np.roll(along, -1, axis=1)
    closes = np.allclose(bodies[:, :, 2:], np.roll(bodies[:, :, :2], -1, axis=1))
    return (
        along[..., 0] * onwards[..., 1] - along[..., 1] * onwards[..., 0] > 0.0
    ).all() and closes


@pytest.mark.parametrize("car", ["nigel", "f1tenth"])
def test_the_outline_of_a_car_is_counter_clockwise(car):
    assert turns_left(outline(load_car(car), np.array([[0.0, 0.0, 0.4], [2.0, -1.0, -2.5]])))


def test_the_outlines_of_movable_boxes_are_counter_clockwise():
    faces = Contacts(load_map("proving_ground")).boxes.outline()
    assert len(faces) > 0
    assert turns_left(faces)
