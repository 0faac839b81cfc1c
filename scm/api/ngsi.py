"""The city as NGSI-LD entities, for context brokers: Vehicle, RoadSegment, TrafficFlowObserved.

Attributes are those of the Smart Data Models (dataModel.Transportation), in their units: km/h, km,
degrees clockwise from north. As in our ETSI messages they speak of the city enlarged 14 times, a
full-scale one, placed at latitude and longitude 0 with map y to the north: GeoJSON knows no floor.
What was measured stands beside it, in the attributes that are ours: `floorPose`, `floorPath`,
`floorSpeed`, in metres of the map and metres a second, never enlarged.
"""

import math
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

from scm.api.city import City
from scm.api.picture import Picture
from scm.clock import NS_PER_S, nanoseconds
from scm.maps.route import LanePath
from scm.records.city_map import Lane
from scm.records.traffic import LaneCount
from scm.v2x.etsi.cam_spatem import SCALE
from scm.v2x.etsi.convert import latitude_of, longitude_of
from scm.v2x.messages.traffic_counts import TrafficCounts
from scm.v2x.messages.world_snapshot import SnapshotVehicle

TYPES = ("Vehicle", "RoadSegment", "TrafficFlowObserved")
CORE = "https://uri.etsi.org/ngsi-ld/v1/ngsi-ld-core-context-v1.8.jsonld"
MODELS = (
    "https://raw.githubusercontent.com/smart-data-models/"
    "dataModel.Transportation/master/context.jsonld"
)
OWN = {name: f"urn:scm:{name}" for name in ("floorPose", "floorPath", "floorSpeed", "tagId")}
CONTEXT = [OWN, MODELS, CORE]
POINT_EVERY_M = 0.1
STANDS_MPS = 0.005

Entity = dict[str, Any]


def entities(city: City, kind: str = "") -> Iterator[Entity]:
    """Yield the entities of a type, or of all; what is not known yet is left out."""
    picture = city.view.picture()
    if kind in ("", "Vehicle") and picture.snapshot is not None:
        seen_ns = picture.snapshot.arrived_ns
        for car in sorted(picture.snapshot.message.vehicles, key=lambda car: car.vehicle):
            yield _vehicle(city, car, seen_ns)
    if kind in ("", "RoadSegment"):
        for lane in city.city_map.lanes:
            yield _segment(city, lane)
    if kind in ("", "TrafficFlowObserved"):
        yield from _flows(city, picture)


def urn(city: City, kind: str, name: str) -> str:
    """Return the id of an entity."""
    return f"urn:ngsi-ld:{kind}:{city.name}:{name}"


def key_values(entity: Entity) -> Entity:
    """Return an entity in the short form: attributes are their values."""
    return {
        name: one.get("value", one.get("object")) if isinstance(one, dict) else one
        for name, one in entity.items()
    }


def _vehicle(city: City, car: SnapshotVehicle, seen_ns: int) -> Entity:
    stands = abs(car.speed_mps) < STANDS_MPS
    heading_deg = (90.0 - math.degrees(car.yaw_rad)) % 360.0
    at = _time(seen_ns - nanoseconds(car.age_ms / 1000.0))
    status = "broken" if not car.alive else "parked" if stands else "onRoute"
    pose = {"x_m": car.x_m, "y_m": car.y_m, "yaw_rad": car.yaw_rad}
    return {
        "id": urn(city, "Vehicle", car.vehicle),
        "type": "Vehicle",
        "name": _property(car.vehicle),
        "vehicleType": _property("car"),
        "category": _property(["tracked"]),
        "fleetVehicleId": _property(car.vehicle),
        "vehicleConfiguration": _property(car.car),
        "location": _place({"type": "Point", "coordinates": _point(car.x_m, car.y_m)}, at),
        "speed": _property(_kmh(abs(car.speed_mps)), at, "KMH"),
        "heading": _property(-1 if stands else round(heading_deg, 2) % 360.0, at, "DD"),
        "serviceStatus": _property(status, at),
        "tagId": _property(car.tag_id),
        "floorPose": _property({name: round(value, 4) for name, value in pose.items()}, at),
        "floorSpeed": _property(round(car.speed_mps, 4), at, "MTS"),
    }


def _segment(city: City, lane: Lane) -> Entity:
    path = LanePath(lane)
    count = max(2, math.ceil(path.length_m / POINT_EVERY_M) + 1)
    poses = [path.at(path.length_m * number / (count - 1)) for number in range(count)]
    line = [_point(pose.x, pose.y) for pose in poses]
    floor = [[round(pose.x, 4), round(pose.y, 4)] for pose in poses]
    return {
        "id": urn(city, "RoadSegment", lane.name),
        "type": "RoadSegment",
        "name": _property(lane.name),
        "refRoad": {"type": "Relationship", "object": urn(city, "Road", city.city_map.name)},
        "location": _place({"type": "LineString", "coordinates": line}),
        "startPoint": _place({"type": "Point", "coordinates": line[0]}),
        "endPoint": _place({"type": "Point", "coordinates": line[-1]}),
        "length": _property(round(path.length_m * SCALE / 1000.0, 5), unit="KMT"),
        "width": _property(round(lane.width_m * SCALE, 3), unit="MTR"),
        "totalLaneNumber": _property(1),
        "laneUsage": _property(["forward"]),
        "category": _property(["oneway"]),
        "allowedVehicleType": _property(["car"]),
        "maximumAllowedSpeed": _property(_kmh(lane.speed_limit_mps), unit="KMH"),
        "status": _property("open"),
        "floorPath": _property(floor, unit="MTR"),
    }


def _flows(city: City, picture: Picture) -> Iterator[Entity]:
    if picture.traffic is None:
        return
    counts = picture.traffic.message
    lanes = {lane.name: lane for lane in city.city_map.lanes}
    for count in counts.lanes:
        if count.lane in lanes:
            yield _flow(city, lanes[count.lane], count, counts)


def _flow(city: City, lane: Lane, count: LaneCount, counts: TrafficCounts) -> Entity:
    path = LanePath(lane)
    middle = path.at(path.length_m / 2.0)
    since_ns = counts.t_ns - nanoseconds(counts.window_s)
    at = _time(counts.t_ns)
    entity = {
        "id": urn(city, "TrafficFlowObserved", lane.name),
        "type": "TrafficFlowObserved",
        "name": _property(lane.name),
        "location": _place({"type": "Point", "coordinates": _point(middle.x, middle.y)}),
        "refRoadSegment": {"type": "Relationship", "object": urn(city, "RoadSegment", lane.name)},
        "dateObserved": _property(f"{_time(since_ns)}/{at}"),
        "dateObservedFrom": _date(since_ns),
        "dateObservedTo": _date(counts.t_ns),
        "laneId": _property(1),
        "laneDirection": _property("forward"),
        "vehicleType": _property("car"),
        "intensity": _property(count.passed, at),
    }
    if count.speed_mps is not None:
        entity["averageVehicleSpeed"] = _property(_kmh(count.speed_mps), at, "KMH")
        entity["floorSpeed"] = _property(round(count.speed_mps, 4), at, "MTS")
    if count.headway_s is not None:
        entity["averageHeadwayTime"] = _property(round(count.headway_s, 2), at, "SEC")
    return entity


def _property(value: object, at: str = "", unit: str = "") -> Entity:
    counts: Entity = {"type": "Property", "value": value}
    if at:
        counts["observedAt"] = at
    if unit:
        counts["unitCode"] = unit
    return counts


def _place(geometry: Entity, at: str = "") -> Entity:
    return {"type": "GeoProperty", "value": geometry, **({"observedAt": at} if at else {})}


def _date(t_ns: int) -> Entity:
    return _property({"@type": "DateTime", "@value": _time(t_ns)})


def _point(x_m: float, y_m: float) -> list[float]:
    return [longitude_of(x_m) / 1e7, latitude_of(y_m) / 1e7]


def _kmh(speed_mps: float) -> float:
    return round(speed_mps * SCALE * 3.6, 3)


def _time(t_ns: int) -> str:
    moment = datetime.fromtimestamp(t_ns // NS_PER_S, UTC)
    return f"{moment:%Y-%m-%dT%H:%M:%S}.{t_ns % NS_PER_S // 1_000_000:03d}Z"
