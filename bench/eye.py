"""What one frame of the eye costs and how exact it is, beside OpenCV's own tag detector.

Both detectors see the same rendered 720p frames of the driving school with 6 cars. Poses come from
the same estimator with the camera's place known, so only the corners differ. CPU milliseconds of
one thread, median over the frames. Run: `python -m bench.eye`.
"""

import math
import time
from collections.abc import Callable

import cv2
import numpy as np

from scm.eye.anchor import Anchor
from scm.eye.camera import camera_model
from scm.eye.detect import Settings, detect_tags
from scm.eye.pose import car_pose
from scm.eye.render.car import tag_on_roof
from scm.eye.source import Frame
from scm.eye.sources.synthetic import SyntheticSource
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.scenery.bodies import NIGEL
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

CARS = 6
FRAMES = 20
CITY = load_map("driving_school")
CAMERA = camera_model(CITY.cameras[0])


def cars_on_lanes(rng):
    """Six cars on the lanes, a little off the middle, none touching another."""
    paths = list(Roads(CITY).lanes.values())
    cars = []
    while len(cars) < CARS:
        path = paths[rng.integers(len(paths))]
        pose = path.at(rng.uniform(0.0, path.length_m))
        x, y = pose.apply(0.0, rng.normal(0.0, 0.02))
        if any(math.hypot(x - other.x_m, y - other.y_m) < 0.4 for other in cars):
            continue
        cars.append(
            SnapshotVehicle(
                vehicle=f"n{len(cars) + 1}", kind="hosted", car="nigel", tag_id=len(cars) + 1,
                x_m=x, y_m=y, yaw_rad=pose.yaw + rng.normal(0.0, 0.1), speed_mps=0.2,
                steering_rad=0.2,
            )
        )  # fmt: skip
    return tuple(cars)


def timed(work: Callable, *arguments):
    """Return what work returns, and the CPU milliseconds it took."""
    start = time.process_time()
    result = work(*arguments)
    return result, (time.process_time() - start) * 1e3


def ours(settings: Settings):
    def find(grey):
        return {tag.tag_id: np.array(tag.corners_px) for tag in detect_tags(grey, settings)}

    return find


def aruco(refinement: int):
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = refinement
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    detector = cv2.aruco.ArucoDetector(family, parameters)

    def find(grey):
        corners, ids, _ = detector.detectMarkers(grey)
        if ids is None:
            return {}
        # OpenCV's upright is half a turn from ours, and it goes clockwise from its upper left.
        turned = [quad[0][[1, 0, 3, 2]].astype(np.float64) for quad in corners]
        return {int(i): quad for i, quad in zip(ids.ravel(), turned, strict=True)}

    return find


def corner_errors(cars, tags: dict) -> list:
    """Return how far found corners are from where the lens truly puts them [px]."""
    seen = [car for car in cars if car.tag_id in tags]
    return [tags[car.tag_id] - CAMERA.project(tag_on_roof(car)) for car in seen]


def judge(find: Callable, shots: list) -> dict[str, float]:
    """Return costs and errors of a detector over all shots."""
    found = [timed(find, grey) for _, grey in shots]
    off = [error for (cars, _), (tags, _) in zip(shots, found, strict=True)
           for error in corner_errors(cars, tags)]  # fmt: skip
    corner = float(np.sqrt(np.mean(np.square(off))))
    known, anchor = Anchor(CAMERA, CITY.tag), Anchor(CAMERA, CITY.tag)
    posing, place, turn = [], [], []
    for tick, ((cars, _), (tags, _)) in enumerate(zip(shots, found, strict=True)):
        start = time.process_time()
        anchor.see(tags.get(CITY.tag.tag_id), tick)
        ours = [car for car in cars if car.tag_id in tags]
        seen = [(car, car_pose(known, NIGEL, tags[car.tag_id]).pose) for car in ours]
        posing.append((time.process_time() - start) * 1e3)
        for car, pose in seen:
            place.append(math.hypot(pose.x - car.x_m, pose.y - car.y_m) * 1e3)
            turn.append(math.degrees(math.remainder(pose.yaw - car.yaw_rad, math.tau)))
    return {
        "detect ms": float(np.median([spent for _, spent in found])),
        "pose ms": float(np.median(posing)),
        "found %": 100.0 * len(off) / (len(shots) * CARS),
        "corner px": corner,
        "pos mm": float(np.sqrt(np.mean(np.square(place)))),
        "yaw deg": float(np.sqrt(np.mean(np.square(turn)))),
    }


def main() -> None:
    cv2.setNumThreads(1)
    rng = np.random.default_rng(1)
    source = SyntheticSource(CITY, CAMERA, rng)
    shots, costs = [], []
    for tick in range(FRAMES):
        cars = cars_on_lanes(rng)
        snapshot = WorldSnapshot(t_ns=tick, tick=tick, vehicles=cars)
        image, spent = timed(source.render, snapshot)
        costs.append(spent)
        shots.append((cars, Frame(tick, image).grey().copy()))
    _, jpeg = timed(cv2.imencode, ".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 80])
    drawn = f"render {np.median(costs):.1f} ms, jpeg {jpeg:.1f} ms"
    print(f"{FRAMES} frames 1280 x 720, {CARS} cars: {drawn}")
    rows = {
        "scm, sought at 1/2": judge(ours(Settings()), shots),
        "scm, 1/2, blurred": judge(ours(Settings(quad_sigma=0.8)), shots),
        "scm, full size": judge(ours(Settings(quad_decimate=1.0)), shots),
        "cv2.aruco, plain": judge(aruco(cv2.aruco.CORNER_REFINE_NONE), shots),
        "cv2.aruco, subpix": judge(aruco(cv2.aruco.CORNER_REFINE_SUBPIX), shots),
        "cv2.aruco, contour": judge(aruco(cv2.aruco.CORNER_REFINE_CONTOUR), shots),
    }
    heads = list(next(iter(rows.values())))
    print(f"{'':22}" + "".join(f"{head:>11}" for head in heads))
    for name, row in rows.items():
        print(f"{name:22}" + "".join(f"{row[head]:11.3f}" for head in heads))
    mine, peer = rows["scm, sought at 1/2"], rows["cv2.aruco, subpix"]
    ratios = [
        f"{head} {mine[head] / peer[head]:.2f}" for head in ("detect ms", "pos mm", "yaw deg")
    ]
    print(f"scm over cv2.aruco subpix: {', '.join(ratios)}")


if __name__ == "__main__":
    main()
