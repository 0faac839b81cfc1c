"""A network that learned from five laps drives by its camera: does it stay in its lane?

It drives a Nigel from anywhere on the lane. Light (`daylight.intensity`, `daylight.azimuth`),
start, speed, way and the car may differ from those of the demonstration. Signals are dark, and
nobody stops at a line.

    python -m studies.cloning record demos/five     five laps by the built-in driver, in lockstep
    python -m studies.cloning record demos/five --looks studies/cloning_looks.toml    a look a lap
    vehicle-agent train demos/five --epochs 20
    scm study run studies/cloning.toml
    python -m studies.cloning label demos/more model.onnx    laps by it, for its next training

`--on 3` records or labels on a track of `tracks.py` instead; `--boxes 10` lets boxes stand about.
"""

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from scm.camera.optics import optics_of
from scm.camera.part import CameraPart
from scm.clock import NS_PER_S
from scm.geometry import Pose2, wrap_angle
from scm.maps.load import load_map
from scm.maps.polyline import advance, extent
from scm.maps.route import Path as LanePath
from scm.maps.route import roads_of
from scm.records.city_map import Box, CityMap, Lane, Segment
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Part
from scm.study.case import Case
from scm.study.loaded_study import load
from scm.vehicles.car import load_car, varied_cars
from scm.world.part import WorldPart
from scm.world.world import generator
from studies.kidnap import put
from studies.parking import HasPose, as_text, with_effect
from studies.tracks import track
from vehicle_agent.agent import AgentPart
from vehicle_agent.body import BodyKind
from vehicle_agent.cloning.driving import NetworkPart
from vehicle_agent.cloning.recording import RecordDemoPart

MAP, CAR, VEHICLE = "driving_school", "nigel", "n1"
LIMIT_MPS = 0.2  # of the lanes while laps are recorded: a fifth faster is possible
STEP_S, SLOWEST_MPS, STARTS_S = 0.1, 0.05, 5.0
LABELLED = 1.5  # times the room to either side: as far out as labels help
BOX_M, STEP_M = 0.1, 0.02  # of a side; between points of the lane
WIDTH_PX = 640  # of rendered frames: half of a Nigel's, in less than half the time

Put = Callable[[], HasPose]


def run(
    case: Case, model: str = "model.onnx", laps: int = 1, start_deg: float = 0.0,
    start_m: float = 0.0, speed: float = 1.0, concealed: str = "nothing", engine: str = "city",
    way: str = "there", on: int = 0, boxes: int = 0, width_px: int = WIDTH_PX,
) -> dict[str, float]:  # fmt: skip
    """Return how far the car drove before a wheel left its lane, and how near the middle.

    Args:
        case: The case.
        model: The trained network.
        laps: To drive.
        start_deg: How far the start may be off the lane's direction, evenly to either side.
        start_m: Likewise, off its middle.
        speed: Times the throttle of the demonstration.
        concealed: What the car has that the demonstration's had not: of `parking.CONCEALED`, or
            of `reality_body.CONCEALED` if an engine moves it.
        engine: What moves the car: the city, or an engine of `tests/reality`.
        way: Round the lane: `there`, as recorded, or `back`.
        on: Number of a track of `tracks.py`; 0: the study's map.
        boxes: How many stand about beside the lanes that did not while it was shown.
        width_px: Of rendered frames.
    """
    rng = case.generator("cloning")
    drawn = track(on) if on else case.map
    city_map = lanes_only(drawn, back=way == "back")
    lane = LanePath.circulation(roads_of(city_map), city_map.lanes[0].name)
    at_m = float(rng.uniform(0.0, lane.length_m))
    off_m, off_deg = rng.uniform(-1.0, 1.0, 2) * (start_m, start_deg)
    begin = lane.at(at_m) @ Pose2(0.0, float(off_m), math.radians(off_deg))
    among = with_boxes(city_map, boxes, rng)
    city_map, drawn = (replace(one, boxes=among) for one in (city_map, drawn))
    car = load_car(CAR) if engine != "city" else with_effect(load_car(CAR), concealed)
    seen = {"front": optics_of(car, "front").of_width(width_px)}
    with varied_cars({CAR: car}):
        world = WorldPart(city_map, case.seed)
        cameras = CameraPart(drawn, case.seed, case.daylight, cameras=lambda _: seen)
        driver = NetworkPart("network", VEHICLE, Path(model), speed=speed)
        parts: list[Part] = [world, cameras, driver]
        place: Put = partial(world.world.host, VEHICLE, CAR, begin, 0)
        if engine != "city":
            from studies.reality_body import concealing  # noqa: PLC0415  needs a clone

            body = concealing(engine, concealed, case.generator("reality"))
            remote = BodyKind("remote", lambda *_: body)
            parts = [world, AgentPart(VEHICLE, CAR, as_text(begin), body=remote), *parts[1:]]
            place = lambda: body  # noqa: E731
        with case.lockstep(parts) as city:
            room_m = 0.5 * (city_map.lanes[0].width_m - car.value("body.track_m"))
            return _drive(city, place(), begin, lane, at_m, laps, room_m)


def _drive(
    city: Lockstep, car: HasPose, begin: Pose2, lane: LanePath, at_m: float, laps: int,
    room_m: float,
) -> dict[str, float]:  # fmt: skip
    """Let the car drive until a wheel leaves the lane, it stands, or all laps are done."""
    beside, s, time_s = list[float](), at_m, 0.0
    while s - at_m < laps * lane.length_m:
        city.run_for(STEP_S)
        time_s = city.now_ns / NS_PER_S
        if time_s < STARTS_S and car.pose == Pose2(0.0, 0.0, 0.0) != begin:
            continue  # the city has not placed it yet
        s, off = lane.project(car.pose.x, car.pose.y, s)
        beside.append(off)
        is_gone = abs(off) > room_m or abs(wrap_angle(car.pose.yaw - lane.at(s).yaw)) > 1.0
        if is_gone or s - at_m < SLOWEST_MPS * (time_s - STARTS_S):
            break
    done = (s - at_m) / lane.length_m
    return {
        "stayed": float(done >= laps),
        "laps_done": done,
        "beside_m": float(np.mean(np.abs(beside))),
        "farthest_m": float(np.max(np.abs(beside))),
        "time_s": time_s,
    }


def lanes_only(city_map: CityMap, *, back: bool = False) -> CityMap:
    """Return a map whose crossings anybody may pass; `back`: its lanes lead the other way.

    Cameras look at the map itself, whose lines and signals remain.
    """
    lanes = tuple(map(partial(_turned, city_map.lanes), city_map.lanes)) if back else city_map.lanes
    return replace(city_map, lanes=lanes, junctions=(), stop_lines=(), lights=(), crosswalks=())


def _turned(lanes: Sequence[Lane], lane: Lane) -> Lane:
    end = Pose2(*lane.start)
    for segment in lane.segments:
        end = advance(end, *extent(segment))
    turned = [
        one if one.angle_rad is None else Segment(radius_m=one.radius_m, angle_rad=-one.angle_rad)
        for one in reversed(lane.segments)
    ]
    start = end.x, end.y, wrap_angle(end.yaw + math.pi)
    after = tuple(one.name for one in lanes if lane.name in one.next)
    return replace(lane, start=start, segments=tuple(turned), next=after)


def with_boxes(city_map: CityMap, count: int, rng: np.random.Generator) -> tuple[Box, ...]:
    """Return the boxes of a map and more, each beside the lanes that the car drives."""
    floor, boxes = city_map.floor, list[Box]()
    way = LanePath.circulation(roads_of(city_map), city_map.lanes[0].name)
    middle = np.array([way.at(s)[:2] for s in np.arange(0.0, way.length_m, STEP_M)])
    least_m = 0.5 * (city_map.lanes[0].width_m + math.sqrt(2.0) * BOX_M)
    while len(boxes) < count:
        x, y = rng.uniform(*floor.x_m), rng.uniform(*floor.y_m)
        if np.hypot(*(middle - (x, y)).T).min() > least_m:
            yaw = float(rng.uniform(-math.pi, math.pi))
            name = f"more_{len(boxes)}"
            boxes.append(Box(name=name, x_m=x, y_m=y, yaw_rad=yaw, length_m=BOX_M, width_m=BOX_M))
    return (*city_map.boxes, *boxes)


def record(
    path: Path, laps: int = 5, seed: int = 1, limit_mps: float = LIMIT_MPS,
    looks: Path | None = None, on: int = 0, boxes: int = 0,
) -> int:  # fmt: skip
    """Let the built-in driver drive some laps, and record them; return the number of frames.

    Args:
        path: Folder of the demonstration.
        laps: To drive.
        seed: Of the city.
        limit_mps: Of all lanes.
        looks: Study whose cases vary the car's camera: each lap is seen through that of the next.
        on: Number of a track of `tracks.py`; 0: Driving School.
        boxes: How many stand about beside the lanes.
    """
    drawn = track(on) if on else load_map(MAP)
    lanes = tuple(replace(lane, speed_limit_mps=limit_mps) for lane in drawn.lanes)
    among = with_boxes(lanes_only(drawn), boxes, generator(seed, "boxes"))
    drawn = replace(drawn, lanes=lanes, boxes=among)
    cars = [load_car(CAR)]
    if looks is not None:
        study = load(looks, path.name)  # by this name it draws others than the study itself
        cars = [study.case(i % len(study.design)).setting.car(CAR) for i in range(laps)]
    cameras = [{"front": optics_of(car, "front")} for car in cars]
    part = RecordDemoPart(
        "demo", VEHICLE, path, laps, on_lap=lambda _: cameras.append(cameras.pop(0))
    )
    world = WorldPart(lanes_only(drawn), seed, ((VEHICLE, CAR),))
    camera_part = CameraPart(drawn, seed, cameras=lambda _: cameras[0])
    with Lockstep([world, camera_part, part]) as city:
        while not part.is_over:
            city.run_for(1.0)
    return len(part.samples)


def label(
    path: Path, model: Path, laps: int = 5, seed: int = 1, start_deg: float = 5.0,
    start_m: float = 0.02, on: int = 0,
) -> int:  # fmt: skip
    """Let a network drive, and record what the built-in driver would do (DAgger).

    Each lap begins somewhere on the lane and beside its middle, and ends early beyond the lane.
    """
    rng = generator(seed, "label")
    drawn = track(on) if on else load_map(MAP)
    city_map = lanes_only(drawn)
    lane = LanePath.circulation(roads_of(city_map), city_map.lanes[0].name)
    room_m = 0.5 * (city_map.lanes[0].width_m - load_car(CAR).value("body.track_m"))
    world = WorldPart(city_map, seed)
    driver = NetworkPart("network", VEHICLE, model)
    part = RecordDemoPart("demo", VEHICLE, path, laps, dagger=True)
    with Lockstep([world, CameraPart(drawn, seed), driver, part]) as city:
        car, done_m = None, 0.0
        while done_m < laps * lane.length_m:
            at_m = float(rng.uniform(0.0, lane.length_m))
            off_m, off_deg = rng.standard_normal(2) * (start_m, start_deg)
            begin = lane.at(at_m) @ Pose2(0.0, float(off_m), math.radians(off_deg))
            if car is None:
                car = world.world.host(VEHICLE, CAR, begin, 0)
            put(car, begin)
            s, off = at_m, 0.0
            while abs(off) < LABELLED * room_m and s - at_m < lane.length_m:
                city.run_for(STEP_S)
                s, off = lane.project(car.pose.x, car.pose.y, s)
            done_m += s - at_m
    return len(part.samples)


def _main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("record", "label"))
    parser.add_argument("path", type=Path, metavar="DIR")
    parser.add_argument("model", type=Path, nargs="?", help="the network that drives, to label")
    parser.add_argument("--laps", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--looks", type=Path, metavar="STUDY", help="vary the camera by lap")
    parser.add_argument("--on", type=int, default=0, help="a track; default: Driving School")
    parser.add_argument("--boxes", type=int, default=0, help="that stand about beside the lanes")
    given = parser.parse_args()
    if given.what == "record":
        count = record(
            given.path, given.laps, given.seed, looks=given.looks, on=given.on, boxes=given.boxes
        )
    elif given.model is None:
        parser.error("label: expected the network that drives")
    else:
        count = label(given.path, given.model, given.laps, given.seed, on=given.on)
    sys.stdout.write(f"{count} frames in {given.path}\n")


if __name__ == "__main__":
    _main()
