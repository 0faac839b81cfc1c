"""What a picture of a car's camera costs, beside one full-frame warp of OpenCV.

720p, driving school, six cars within sight, front and rear. CPU milliseconds of one thread, median.
The warp is `cv2.warpPerspective` of the same floor picture onto 1280 x 720, linear, nothing else.
Run: `python -m bench.camera`.
"""

import dataclasses
import time

import cv2
import numpy as np

from scm.camera.daylight import Daylight
from scm.camera.optics import optics_of
from scm.camera.part import CameraPart
from scm.camera.studio import Studio
from scm.clock import NS_PER_MS
from scm.maps.load import load_map
from scm.maps.route import Path, Roads
from scm.v2x.exchange import Incoming
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot
from scm.vehicles.car import load_car

FRAMES = 25
CITY = load_map("driving_school")
PATH = Path.circulation(Roads(CITY), CITY.lanes[0].name)
BARREL = (-0.30, 0.09, 0.001, -0.0008, 0.0)


def cars_at(s_m):
    """Six cars in a row 0.6 m apart, all lamps on: the first one pictures the others."""
    cars = []
    for number in range(6):
        pose = PATH.at((s_m + 0.6 * number) % PATH.length_m)
        cars.append(
            SnapshotVehicle(
                vehicle=f"n{number + 1}", kind="hosted", car="nigel", tag_id=number + 1,
                x_m=pose.x, y_m=pose.y, yaw_rad=pose.yaw, speed_mps=0.2, steering_rad=0.1,
                lights=("head_low", "tail", "brake", "left", "right"),
            )
        )  # fmt: skip
    return tuple(cars)


def median_ms(work):
    """Return the CPU milliseconds of `work(i)`, median over the frames after one unmeasured."""
    work(0)
    spent = []
    for i in range(FRAMES):
        start = time.process_time()
        work(i)
        spent.append((time.process_time() - start) * 1e3)
    return float(np.median(spent))


def main() -> None:
    cv2.setNumThreads(1)
    studio = Studio(CITY, Daylight())
    rows = [cars_at(0.3 * i) for i in range(FRAMES)]
    shown = {light.light_id: "green" for light in CITY.lights}
    given = {name: optics_of(load_car("nigel"), name) for name in ("front", "rear")}
    quiet = dataclasses.replace(given["front"], read_noise=0.0, shot_noise=0.0)
    kinds = {
        "front": given["front"],
        "rear": given["rear"],
        "front, no noise": quiet,
        "front, distorted": dataclasses.replace(given["front"], distortion=BARREL),
    }
    flat = studio._floor.whole.levels[0]  # noqa: SLF001  the picture that the limit must warp as well
    tilt = np.array([[0.9, 0.4, 30.0], [-0.02, 1.6, 60.0], [0.0, 1.2e-3, 1.0]])
    size = (quiet.width_px, quiet.height_px)
    limit = median_ms(lambda _: cv2.warpPerspective(flat, tilt, size))
    print(f"{'one warp of the floor, 720p':30}{limit:7.2f} ms")
    for name, optics in kinds.items():
        camera = name[:5].strip(", ")
        spent = median_ms(
            lambda i, o=optics, c=camera: studio.picture(o, rows[i][0], rows[i], shown, c, i)
        )
        print(f"{name:30}{spent:7.2f} ms {spent / limit:6.2f} warps")
    frame = studio.picture(given["front"], rows[0][0], rows[0], shown, "front", 0).copy()
    jpeg = median_ms(lambda _: cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 80]))
    size_kb = len(cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 80])[1]) / 1e3
    print(f"{'JPEG, quality 80':30}{jpeg:7.2f} ms {jpeg / limit:6.2f} warps, {size_kb:.0f} kB")
    asleep = CameraPart(CITY)
    snapshot = WorldSnapshot(t_ns=0, tick=0, vehicles=rows[0])
    inbox = [Incoming(snapshot, 0)] if asleep.subscriptions else []
    idle = median_ms(
        lambda i: [asleep.step(20 * NS_PER_MS * (50 * i + k), inbox) for k in range(50)]
    )
    print(f"{'a second while nobody looks':30}{idle:7.3f} ms {idle / limit:6.3f} warps")


if __name__ == "__main__":
    main()
