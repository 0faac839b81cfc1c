"""Cars to look at, and cameras to look with."""

import dataclasses

import pytest

from scm.camera.daylight import Daylight
from scm.camera.optics import optics_of
from scm.camera.studio import Studio
from scm.maps.load import load_map
from scm.v2x.messages.world_snapshot import SnapshotVehicle
from scm.vehicles.car import load_car


@pytest.fixture(scope="session")
def city_map():
    return load_map("driving_school")


@pytest.fixture(scope="session")
def studio(city_map):
    return Studio(city_map, Daylight())


@pytest.fixture(scope="session")
def optics():
    """Return a quiet Nigel camera with some facts changed."""

    def build(camera="front", **facts):
        given = optics_of(load_car("nigel"), camera)
        return dataclasses.replace(given, **{"read_noise": 0.0, "shot_noise": 0.0, **facts})

    return build


@pytest.fixture(scope="session")
def car():
    def build(x_m, y_m, yaw_rad=0.0, name="n1", tag_id=1, **more):
        rest = {"speed_mps": 0.0, "steering_rad": 0.0, **more}
        return SnapshotVehicle(
            vehicle=name, kind="hosted", car="nigel", tag_id=tag_id, x_m=x_m, y_m=y_m,
            yaw_rad=yaw_rad, **rest,
        )  # fmt: skip

    return build
