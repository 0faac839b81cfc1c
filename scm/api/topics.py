"""Topics of the live stream: what each contains, and how often it is computed.

A page receives those it names. A topic is one part of the city as a whole, computed from the
picture; it is sent when its bytes changed. A new one is a line here.
"""

from collections.abc import Callable
from typing import NamedTuple

import msgspec

from scm.api.acknowledgements import Acknowledgements
from scm.api.city import City
from scm.api.eye_rows import camera_rows
from scm.api.picture import Picture
from scm.api.room_maps import room_maps_of
from scm.api.routes.autonomy import autonomy_of
from scm.api.routes.boxes import boxes_of
from scm.api.routes.stop import stop_of
from scm.api.signal_rows import junction_rows, status_rows
from scm.api.twin_rows import twin_rows
from scm.api.vehicle_rows import vehicles_topic
from scm.records.disturbances import Disturbance

EVENTS = "events"
"""The one topic that is no state: its entries come one by one, and never twice."""

ACKNOWLEDGED_SHOWN = 500
LOST_S = 2.0
STANDS_MPS = 0.02  # slower than that is how a real car that stands is measured


class Topic(NamedTuple):
    """A part of the page: how to make it, and every how many frames of 50 ms that is due."""

    make: Callable[[Picture], object]
    every: int


class Pulse(msgspec.Struct, kw_only=True, frozen=True):
    """How alive the world is; `t_ns` and `tick` are None until it has reported.

    Attributes:
        moving: How many of its vehicles move: after a stop, those that do not stand yet.
        silent_signals: Junctions whose controller has reported, but not for `LOST_S`, by name.
        disturbances: What makes measurements void at this moment.
    """

    t_ns: int | None
    tick: int | None
    real_time_factor: float
    late_ticks: int
    vehicles: int
    moving: int
    silent_signals: tuple[str, ...]
    disturbances: tuple[Disturbance, ...]


def pulse_of(picture: Picture) -> Pulse:
    """Return the world's time, tick and count of vehicles, and whose signals are silent."""
    silent = tuple(
        sorted(name for name, spat in picture.spats.items() if spat.age_s(picture.now_ns) > LOST_S)
    )
    disturbances = picture.disturbances.now()
    if picture.snapshot is None:
        return Pulse(
            t_ns=None, tick=None, real_time_factor=0.0, late_ticks=0, vehicles=0, moving=0,
            silent_signals=silent, disturbances=disturbances,
        )  # fmt: skip
    snapshot = picture.snapshot.message
    return Pulse(
        t_ns=snapshot.t_ns,
        tick=snapshot.tick,
        real_time_factor=round(snapshot.real_time_factor, 3),
        late_ticks=snapshot.late_ticks,
        vehicles=len(snapshot.vehicles),
        moving=sum(abs(car.speed_mps) > STANDS_MPS for car in snapshot.vehicles),
        silent_signals=silent,
        disturbances=disturbances,
    )


def topics_of(city: City, seen: Acknowledgements) -> dict[str, Topic]:
    """Return every topic but `events`, by name."""
    floor = {city.city_map.tag.tag_id: city.city_map.tag}
    return {
        "pulse": Topic(pulse_of, 4),
        "stop": Topic(stop_of, 2),
        "vehicles": Topic(vehicles_topic, 1),
        "signals": Topic(
            lambda picture: junction_rows(picture, city.city_map.junctions, city.plans), 2
        ),
        "signal_status": Topic(status_rows, 4),
        "autonomy": Topic(autonomy_of, 4),
        "room_maps": Topic(room_maps_of, 4),
        "boxes": Topic(boxes_of, 2),
        "twins": Topic(twin_rows, 10),
        "acknowledgements": Topic(lambda _: seen.newest(ACKNOWLEDGED_SHOWN), 4),
        "eye": Topic(lambda picture: camera_rows(picture, floor), 2),
        "stations": Topic(lambda picture: picture.stations, 10),
    }
