"""Roads over the border: what drivers see of the lane that goes on in the next city.

A lane that leads out goes on beyond the border as a straight lane of the same width and limit: so a
driver neither brakes for the end of its lane nor loses sight of cars just behind the border. Border
roads are therefore straight for about two metres on either side.
"""

from typing import NamedTuple

from msgspec.structs import replace

from scm.geometry import Pose2
from scm.maps.once_per_map import once_per_map
from scm.maps.polyline import advance, extent
from scm.records.city_map import CityMap, Lane, Segment

BEYOND = ">"
BEYOND_M = 4.0  # more than a driver looks ahead; see `drivers.cars_ahead.REACH`


class Exit(NamedTuple):
    """A road that leads out of this city.

    Attributes:
        city: Where it leads.
        lane: The last lane on this side; `to` the one that it goes on in.
        end: The end of that lane, in this map.
        origin: Origin of the other map in this one.
        length_m: Of the lane.
    """

    city: str
    lane: str
    to: str
    end: Pose2
    origin: Pose2
    length_m: float

    @property
    def border(self) -> Pose2:
        """The end of the lane, in the map of the other city."""
        return self.origin.inverse() @ self.end


@once_per_map
def exits_of(city_map: CityMap) -> tuple[Exit, ...]:
    """Return the roads that lead out of a city."""
    lanes = {lane.name: lane for lane in city_map.lanes}
    return tuple(
        Exit(
            neighbour.city,
            road.out,
            road.to,
            end_of(lanes[road.out]),
            Pose2(*neighbour.origin),
            sum(extent(segment)[0] for segment in lanes[road.out].segments),
        )
        for neighbour in city_map.neighbours
        for road in neighbour.roads
    )


def end_of(lane: Lane) -> Pose2:
    """Return the pose at the end of a lane."""
    pose = Pose2(*lane.start)
    for segment in lane.segments:
        pose = advance(pose, *extent(segment))
    return pose


def beyond(lane: str) -> str:
    """Return the name of what lies beyond the border at the end of a lane."""
    return f"{lane}{BEYOND}"


@once_per_map
def with_roads_beyond(city_map: CityMap) -> CityMap:
    """Return the map that drivers use: with a straight lane beyond each border.

    That lane follows itself, as a car never comes to its end: it is in the next city before.
    """
    ends = {road.lane: road.end for road in exits_of(city_map)}
    if not ends:
        return city_map
    lanes = [
        replace(lane, next=(beyond(lane.name),)) if lane.name in ends else lane
        for lane in city_map.lanes
    ]
    lanes += [
        replace(
            lane,
            name=beyond(lane.name),
            start=tuple(ends[lane.name]),
            segments=(Segment(length_m=BEYOND_M),),
            next=(beyond(lane.name),),
        )
        for lane in city_map.lanes
        if lane.name in ends
    ]
    return replace(city_map, lanes=tuple(lanes))
