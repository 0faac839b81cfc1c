"""Converts a run for Foxglove: frames, cars, roads, lights, pictures, scans, plans, maps, the log.

Foxglove can list the channels of the recorder's own file but not read their schemas.
"""

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import Any, TypeVar

import msgspec
import numpy as np
from mcap.writer import Writer

from scm.clock import NS_PER_S
from scm.errors import CarError, MessageError
from scm.geometry import Pose2
from scm.maps.route import Roads
from scm.recorder import foxglove_grids as grids
from scm.recorder import foxglove_messages as fox
from scm.recorder.mcap_file import Recorded, SchemaTable
from scm.recorder.run_index import RunIndex
from scm.records.city_map import CityMap, Light
from scm.v2x.message import Message
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot
from scm.vehicles.car import load_car

MAP = "map"
BLOCK_BYTES = 256 * 1024
CARS_EVERY_NS = NS_PER_S
NIGEL_M = -0.07, 0.23, 0.175
LEVELS = {"info": 2, "warning": 3, "error": 4}
FLOOR = fox.Colour(r=0.13, g=0.15, b=0.18)  # lanes are visible on Foxglove's light background too
FLOOR_THICK_M = 0.01
ROAD, LANE = fox.Colour(r=0.45, g=0.48, b=0.53), fox.Colour(r=0.93, g=0.93, b=0.88)
WHITE = fox.Colour(r=1.0, g=1.0, b=1.0)
KINDS = {
    "hosted": fox.Colour(r=0.3, g=0.55, b=0.94),
    "remote": fox.Colour(r=0.66, g=0.48, b=0.95),
    "real": fox.Colour(r=0.94, g=0.63, b=0.24),
}
GREY = fox.Colour(r=0.35, g=0.35, b=0.35)
LIGHTS = {
    "red": fox.Colour(r=1.0, g=0.2, b=0.2),
    "flashing_red": fox.Colour(r=1.0, g=0.2, b=0.2, a=0.6),
    "yellow": fox.Colour(r=1.0, g=0.76, b=0.2),
    "green": fox.Colour(r=0.2, g=0.82, b=0.55),
}
PATH, OBSTACLE = fox.Colour(r=0.35, g=0.82, b=1.0), fox.Colour(r=1.0, g=0.69, b=0.0)
PATH_THICK_M, TRAJECTORY_THICK_M, CANDIDATE_THICK_M, OBSTACLE_M = 0.006, 0.015, 0.003, 0.02
LETTERS = {"red": "R", "flashing_red": "F", "yellow": "Y", "green": "G"}
_WANTED = (
    WorldDefinition, WorldSnapshot, VehicleState, Spat, CityEvent, EyeFrame, CameraFrame, LidarScan,
    AutonomyPlan, OccupancyMap, Costmap,
)  # fmt: skip
M = TypeVar("M", bound=Message)


def write_foxglove(index: RunIndex) -> Iterator[bytes]:
    """Yield an MCAP file for Foxglove in blocks; damaged parts of the run are left out.

    Raises:
        RecordingError: when the run cannot be opened.
    """
    out = _Blocks()
    kinds: dict[str, type[Message]] = {}
    city = next(iter(index.topics.values()), "//city").split("/")
    table = SchemaTable(city[2] if len(city) > 2 else "city")  # scm/@v1/<city>/...
    for key in index.topics.values():
        kind = table.kind_of(key)
        if kind in _WANTED:
            kinds[key] = kind
    writing = _Writing(out)
    for one in index.read(0, index.end_ns, kinds.__contains__):
        message = _decoded(one, kinds[one.key])
        if message is not None:
            writing.write(one.t_ns, message)
        if out.held > BLOCK_BYTES:
            yield out.pop()
    writing.close()
    yield out.pop()


def _decoded(one: Recorded, kind: type[M]) -> M | None:
    try:
        return msgspec.json.decode(one.body, type=kind)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return None


class _Blocks:
    """A stream for the writer; its bytes are removed as they are sent."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._popped = 0
        self.held = 0

    def write(self, data: bytes) -> int:
        """Store bytes until they are sent."""
        self._parts.append(bytes(data))
        self.held += len(data)
        return len(data)

    def tell(self) -> int:
        """Return how many bytes were written in total."""
        return self._popped + self.held

    def flush(self) -> None:
        """Do nothing: the reader of the bytes sends them."""

    def pop(self) -> bytes:
        """Return and remove the stored bytes."""
        block = b"".join(self._parts)
        self._popped += self.held
        self._parts, self.held = [], 0
        return block


class _Writing:
    """Writes the messages of a run to the file."""

    def __init__(self, stream: Any) -> None:
        self._writer = Writer(stream)
        self._writer.start(profile="", library="scm")
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._cars: dict[str, tuple[str, str, bool]] = {}
        self._cars_due_ns = 0
        self._colours: dict[tuple[str, str], str] = {}
        self._lights: tuple[Light, ...] = ()
        self._has_map = False
        self._poses: dict[str, Pose2] = {}
        self._writers: dict[type[Message], Callable[[int, Any], None]] = {
            WorldDefinition: self._definition,
            WorldSnapshot: self._snapshot,
            VehicleState: self._state,
            Spat: self._spat,
            CityEvent: self._event,
            EyeFrame: self._eye,
            CameraFrame: self._camera,
            LidarScan: self._scan,
            AutonomyPlan: self._plan,
            OccupancyMap: self._room_map,
            Costmap: self._costmap,
        }

    def write(self, t_ns: int, message: Message) -> None:
        """Write the conversion of a message; one with a damaged payload is left out."""
        with contextlib.suppress(MessageError):
            self._writers[type(message)](t_ns, message)

    def close(self) -> None:
        """End the file with its index."""
        self._writer.finish()

    def _add(self, topic: str, t_ns: int, body: msgspec.Struct) -> None:
        if topic not in self._channels:
            name = f"foxglove.{type(body).__name__}"
            name = "scm.CarState" if isinstance(body, fox.CarState) else name
            if name not in self._schemas:
                schema = msgspec.json.encode(fox.schema_of(type(body)))
                self._schemas[name] = self._writer.register_schema(name, "jsonschema", schema)
            self._channels[topic] = self._writer.register_channel(
                topic=topic, message_encoding="json", schema_id=self._schemas[name]
            )
        self._writer.add_message(
            channel_id=self._channels[topic],
            log_time=t_ns,
            publish_time=t_ns,
            data=msgspec.json.encode(body),
        )

    def _definition(self, t_ns: int, message: WorldDefinition) -> None:
        if self._has_map:  # it is sent again every 10 s
            return
        self._has_map, self._lights = True, message.map.lights
        entity = fox.Entity(
            timestamp=_time(t_ns),
            frame_id=MAP,
            id="roads",
            cubes=(_floor(message.map),),
            lines=_road_lines(message.map),
        )
        self._add("/map", t_ns, fox.SceneUpdate(entities=(entity,)))

    def _snapshot(self, t_ns: int, message: WorldSnapshot) -> None:
        at = _time(t_ns)
        frames = tuple(_frame(at, car) for car in message.vehicles)
        self._add("/tf", t_ns, fox.FrameTransforms(transforms=frames))
        self._poses = {
            car.vehicle: Pose2(car.x_m, car.y_m, car.yaw_rad) for car in message.vehicles
        }
        cars = {car.vehicle: (car.car, car.kind, car.alive) for car in message.vehicles}
        if cars == self._cars and t_ns < self._cars_due_ns:
            return
        # All of them every second: after a seek Foxglove has one message per topic.
        self._cars_due_ns = t_ns + CARS_EVERY_NS
        gone = tuple(
            fox.Deletion(timestamp=at, type=0, id=name) for name in self._cars if name not in cars
        )
        self._cars = cars
        entities = tuple(_car(at, car) for car in message.vehicles)
        self._add("/cars", t_ns, fox.SceneUpdate(deletions=gone, entities=entities))

    def _state(self, t_ns: int, message: VehicleState) -> None:
        state = fox.CarState(
            timestamp=_time(message.t_ns),
            x_m=message.x_m,
            y_m=message.y_m,
            yaw_rad=message.yaw_rad,
            speed_mps=message.speed_mps,
            lateral_speed_mps=message.lateral_speed_mps,
            yaw_rate_radps=message.yaw_rate_radps,
            accel_mps2=message.accel_mps2,
            throttle=message.throttle,
            steering=message.steering or 0.0,
            steering_rad=message.steering_rad,
            mode=message.mode,
            owner_epoch=message.epoch,
        )
        self._add(f"/{message.vehicle}/state", t_ns, state)

    def _spat(self, t_ns: int, message: Spat) -> None:
        colours = {(message.junction, group.group): group.colour for group in message.groups}
        if all(self._colours.get(group) == colour for group, colour in colours.items()):
            return
        self._colours |= colours
        entities = tuple(
            _light(_time(t_ns), light, self._colours.get((light.junction, light.group), "dark"))
            for light in self._lights
        )
        self._add("/signals", t_ns, fox.SceneUpdate(entities=entities))

    def _event(self, t_ns: int, message: CityEvent) -> None:
        log = fox.Log(
            timestamp=_time(t_ns),
            level=LEVELS[message.severity],
            message=message.text,
            name=f"{message.source}: {message.name}",
        )
        self._add("/events", t_ns, log)

    def _eye(self, t_ns: int, message: EyeFrame) -> None:
        self._picture(f"/eye/{message.camera}", t_ns, message.camera, message.payload)

    def _camera(self, t_ns: int, message: CameraFrame) -> None:
        topic = f"/{message.vehicle}/camera/{message.camera}"
        self._picture(topic, t_ns, message.vehicle, message.payload)

    def _picture(self, topic: str, t_ns: int, frame: str, payload: bytes) -> None:
        picture = fox.CompressedImage(timestamp=_time(t_ns), frame_id=frame, data=payload)
        self._add(topic, t_ns, picture)

    def _scan(self, t_ns: int, message: LidarScan) -> None:
        cloud = fox.PointCloud(
            timestamp=_time(message.t_ns),
            frame_id=message.vehicle,
            pose=fox.Pose(position=_scanner(self._cars.get(message.vehicle, ("nigel",))[0])),
            point_stride=12,
            fields=tuple(fox.PackedField(name=axis, offset=4 * i) for i, axis in enumerate("xyz")),
            data=_points(message),
        )
        self._add(f"/{message.vehicle}/scan", t_ns, cloud)

    def _plan(self, t_ns: int, message: AutonomyPlan) -> None:
        at = _time(message.t_ns)
        entity = fox.Entity(
            timestamp=at,
            frame_id=MAP,
            id=f"plan {message.vehicle}",
            lines=(
                _planned(message.path, PATH_THICK_M),
                _planned(message.trajectory, TRAJECTORY_THICK_M),
                *(_planned(one, CANDIDATE_THICK_M, WHITE) for one in message.candidates),
            ),
            cubes=tuple(_obstacle(x, y) for x, y in message.obstacles),
        )
        self._add(f"/{message.vehicle}/plan", t_ns, fox.SceneUpdate(entities=(entity,)))
        name = message.vehicle
        self._add(f"/{name}/path", t_ns, grids.poses(at, MAP, message.path))
        self._add(f"/{name}/particles", t_ns, grids.poses(at, MAP, message.particles))

    def _room_map(self, t_ns: int, message: OccupancyMap) -> None:
        name, at = message.vehicle, _time(message.t_ns)
        self._add(f"/{name}/map", t_ns, grids.map_grid(message, at))
        frame = grids.map_frame(name)
        self._add(f"/{name}/path", t_ns, grids.poses(at, frame, message.path))
        if name in self._poses:
            origin = grids.origin_of(message, self._poses[name])
            self._add("/tf", t_ns, fox.FrameTransforms(transforms=(_placed(at, frame, origin),)))

    def _costmap(self, t_ns: int, message: Costmap) -> None:
        grid = grids.costmap_grid(message, _time(message.t_ns), MAP)
        self._add(f"/{message.vehicle}/costmap", t_ns, grid)


def _time(t_ns: int) -> fox.Time:
    return fox.Time(sec=t_ns // NS_PER_S, nsec=t_ns % NS_PER_S)


def _frame(at: fox.Time, car: SnapshotVehicle) -> fox.Transform:
    return _placed(at, car.vehicle, Pose2(car.x_m, car.y_m, car.yaw_rad))


def _placed(at: fox.Time, frame: str, pose: Pose2) -> fox.Transform:
    return fox.Transform(
        timestamp=at,
        parent_frame_id=MAP,
        child_frame_id=frame,
        translation=fox.Vector(x=pose.x, y=pose.y),
        rotation=fox.turned(pose.yaw),
    )


def _planned(
    poses: Sequence[tuple[float, float, float]], thick_m: float, colour: fox.Colour = PATH
) -> fox.Line:
    points = tuple(fox.Vector(x=x, y=y, z=0.01) for x, y, _ in poses)
    return fox.Line(thickness=thick_m, points=points, color=colour)


def _obstacle(x_m: float, y_m: float) -> fox.Cube:
    pose = fox.Pose(position=fox.Vector(x=x_m, y=y_m, z=0.5 * OBSTACLE_M))
    size = fox.Vector(x=OBSTACLE_M, y=OBSTACLE_M, z=OBSTACLE_M)
    return fox.Cube(pose=pose, size=size, color=OBSTACLE)


def _car(at: fox.Time, car: SnapshotVehicle) -> fox.Entity:
    rear, front, width = _outline(car.car)
    length, height, middle = front - rear, 0.4 * width, 0.5 * (front + rear)
    colour = KINDS.get(car.kind, GREY) if car.alive else GREY
    body = fox.Pose(position=fox.Vector(x=middle, y=0.0, z=0.5 * height + 0.02))
    cabin = fox.Pose(position=fox.Vector(x=middle - 0.06 * length, y=0.0, z=1.3 * height + 0.02))
    return fox.Entity(
        timestamp=at,
        frame_id=car.vehicle,
        id=car.vehicle,
        cubes=(
            fox.Cube(pose=body, size=fox.Vector(x=length, y=width, z=height), color=colour),
            fox.Cube(
                pose=cabin,
                size=fox.Vector(x=0.5 * length, y=0.8 * width, z=0.6 * height),
                color=GREY,
            ),
        ),
        texts=(
            fox.Label(
                pose=fox.Pose(position=fox.Vector(x=middle, y=0.0, z=3.0 * height)),
                color=WHITE,
                text=car.vehicle,
            ),
        ),
    )


def _light(at: fox.Time, light: Light, colour: str) -> fox.Entity:
    pose = fox.Pose(position=fox.Vector(x=light.x_m, y=light.y_m, z=0.2))
    size = fox.Vector(x=0.08, y=0.08, z=0.08)
    lamp = fox.Cube(pose=pose, size=size, color=LIGHTS.get(colour, GREY))
    letter = fox.Label(  # for colour-blind people
        pose=fox.Pose(position=fox.Vector(x=light.x_m, y=light.y_m, z=0.3)),
        color=WHITE,
        text=LETTERS.get(colour, "D"),
    )
    return fox.Entity(
        timestamp=at, frame_id=MAP, id=f"light {light.light_id}", spheres=(lamp,), texts=(letter,)
    )


def _floor(city_map: CityMap) -> fox.Cube:
    (x0, x1), (y0, y1) = city_map.floor.x_m, city_map.floor.y_m
    middle = fox.Vector(x=0.5 * (x0 + x1), y=0.5 * (y0 + y1), z=-FLOOR_THICK_M)
    size = fox.Vector(x=x1 - x0, y=y1 - y0, z=FLOOR_THICK_M)
    return fox.Cube(pose=fox.Pose(position=middle), size=size, color=FLOOR)


def _road_lines(city_map: CityMap) -> tuple[fox.Line, ...]:
    """Return the edge of the floor and the centre line of each lane."""
    roads = Roads(city_map)
    (x0, x1), (y0, y1) = city_map.floor.x_m, city_map.floor.y_m
    corners = ((x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0))
    edge = fox.Line(thickness=0.02, points=_places(corners), color=ROAD)
    lanes = (roads.lane(lane.name) for lane in city_map.lanes)
    middles = (fox.Line(thickness=0.012, points=_places(lane.points), color=LANE) for lane in lanes)
    return (edge, *middles)


def _places(points: Any) -> tuple[fox.Vector, ...]:
    return tuple(fox.Vector(x=float(x), y=float(y)) for x, y in points)


def _points(scan: LidarScan) -> bytes:
    """Return the points of a scan in the scanner's frame, three float32 each."""
    payload = scan.payload[: len(scan.payload) // 4 * 4]
    ranges = np.frombuffer(payload, "<f4")[: scan.beams]
    step = scan.bearing_step_rad or math.tau / max(1, scan.beams)
    bearing = scan.bearing_first_rad + step * np.arange(len(ranges))
    hit = np.isfinite(ranges) & (ranges > 0.0)
    x, y = ranges[hit] * np.cos(bearing[hit]), ranges[hit] * np.sin(bearing[hit])
    return np.column_stack((x, y, np.zeros(len(x)))).astype("<f4").tobytes()


@lru_cache(maxsize=64)
def _outline(car: str) -> tuple[float, float, float]:
    """Return rear end, front end and width of a car's body [m]; Nigel's for unknown cars."""
    try:
        known = load_car(car, trusted=False)
    except CarError:
        return NIGEL_M
    if not known.has("body.footprint_x_m"):
        return NIGEL_M
    rear, front = known.vector("body.footprint_x_m")
    right, left = known.vector("body.footprint_y_m")
    return rear, front, left - right


@lru_cache(maxsize=64)
def _scanner(car: str) -> fox.Vector:
    """Return the position of a car's scanner; the car's origin if its file has none."""
    try:
        known = load_car(car, trusted=False)
    except CarError:
        return fox.Vector(x=0.0, y=0.0)
    if not known.has("lidar.position_m"):
        return fox.Vector(x=0.0, y=0.0)
    x, y, z = known.vector("lidar.position_m")
    return fox.Vector(x=x, y=y, z=z)
