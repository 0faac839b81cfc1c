"""A network that learned from five laps drives by its camera: does it stay in its lane?

It drives a Nigel from anywhere on the lane. Light (`daylight.intensity`, `daylight.azimuth`),
start, speed and the car may differ from those of the demonstration. Signals are off: it knows none.

    python -m studies.cloning demos/five        five laps by the built-in driver, in lockstep
    vehicle-agent train demos/five --epochs 20
    scm study run studies/cloning.toml
"""

import math
import sys
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from scm.camera.part import CameraPart
from scm.clock import NS_PER_S
from scm.geometry import Pose2, wrap_angle
from scm.maps.load import load_map
from scm.maps.route import Path as LanePath
from scm.maps.route import roads_of
from scm.records.city_map import CityMap
from scm.runtime.lockstep import Lockstep
from scm.study.case import Case
from scm.vehicles.car import load_car, varied_cars
from scm.world.part import WorldPart
from studies.parking import with_effect
from vehicle_agent.cloning.driving import NetworkPart
from vehicle_agent.cloning.recording import RecordDemoPart

MAP, CAR, VEHICLE = "driving_school", "nigel", "n1"
STEP_S, SLOWEST_MPS, STARTS_S = 0.1, 0.05, 5.0


def run(
    case: Case, model: str = "model.onnx", laps: int = 5, start_deg: float = 0.0,
    start_m: float = 0.0, speed: float = 1.0, concealed: str = "nothing",
) -> dict[str, float]:  # fmt: skip
    """Return how far the car drove before a wheel left its lane, and how near the middle.

    Args:
        case: The case.
        model: The trained network.
        laps: To drive.
        start_deg: Standard deviation of the start, off the lane's direction.
        start_m: Likewise, off its middle.
        speed: Times the throttle of the demonstration.
        concealed: What the car has that the demonstration's had not: of `parking.CONCEALED`.
    """
    rng = case.generator("cloning")
    city_map = without_signals(case.map)
    lane = LanePath.circulation(roads_of(city_map), city_map.lanes[0].name)
    at_m = float(rng.uniform(0.0, lane.length_m))
    off_m, off_deg = rng.standard_normal(2) * (start_m, start_deg)
    begin = lane.at(at_m) @ Pose2(0.0, float(off_m), math.radians(off_deg))
    car = with_effect(load_car(CAR), concealed)
    with varied_cars({CAR: car}):
        world = WorldPart(city_map, case.seed)
        driver = NetworkPart("network", VEHICLE, Path(model), speed=speed)
        cameras = CameraPart(city_map, case.seed, case.daylight)
        room_m = 0.5 * (city_map.lanes[0].width_m - car.value("body.track_m"))
        beside, s = list[float](), at_m
        with case.lockstep([world, cameras, driver]) as city:
            hosted = world.world.host(VEHICLE, CAR, begin, 0)
            while s - at_m < laps * lane.length_m:
                city.run_for(STEP_S)
                pose = hosted.pose
                s, off = lane.project(pose.x, pose.y, s)
                beside.append(off)
                is_gone = abs(off) > room_m or abs(wrap_angle(pose.yaw - lane.at(s).yaw)) > 1.0
                time_s = city.now_ns / NS_PER_S
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


def without_signals(city_map: CityMap) -> CityMap:
    """Return a map whose crossings anybody may pass."""
    return replace(city_map, junctions=(), stop_lines=(), lights=())


def record(path: Path, laps: int = 5, seed: int = 1) -> int:
    """Let the built-in driver drive some laps, and record them; return the number of frames."""
    city_map = without_signals(load_map(MAP))
    part = RecordDemoPart("demo", VEHICLE, path, laps)
    world = WorldPart(city_map, seed, ((VEHICLE, CAR),))
    with Lockstep([world, CameraPart(city_map, seed), part]) as city:
        while not part.is_over:
            city.run_for(1.0)
    return len(part.samples)


if __name__ == "__main__":
    sys.stdout.write(f"{record(Path(sys.argv[1]))} frames in {sys.argv[1]}\n")
