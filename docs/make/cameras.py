"""Makes docs/pictures/cameras.jpg: four pictures of cars' cameras, and what changes them.

Run with `python docs/make/cameras.py`; the same picture comes out every time.
"""

import dataclasses
from pathlib import Path

import cv2
import numpy as np

from scm.arrays import Image
from scm.camera.daylight import Daylight
from scm.camera.optics import Optics, optics_of
from scm.camera.studio import Studio
from scm.maps.load import load_map
from scm.maps.route import Path as Way
from scm.maps.route import Roads
from scm.v2x.messages.world_snapshot import SnapshotVehicle
from scm.vehicles.car import load_car

OUT = Path(__file__).parents[1] / "pictures" / "cameras.jpg"
CITY = load_map("driving_school")
WAY = Way.circulation(Roads(CITY), CITY.lanes[0].name)
SHOWN = {1: "green", 2: "red", 3: "red", 4: "green"}
CARS = (
    (0.05, ()),
    (0.75, ("brake", "tail", "left")),
    (1.35, ("tail",)),
    (3.45, ("head_low", "tail", "right")),
    (-0.55, ("head_low", "head_high", "tail")),
)


def cars() -> list[SnapshotVehicle]:
    """Return some cars on the figure of eight, the one that looks first."""
    found = []
    for number, (s_m, lights) in enumerate(CARS, 1):
        pose = WAY.at(s_m % WAY.length_m)
        found.append(
            SnapshotVehicle(
                vehicle=f"n{number}", kind="hosted", car="nigel", tag_id=number, x_m=pose.x,
                y_m=pose.y, yaw_rad=pose.yaw, speed_mps=0.2, steering_rad=0.2, lights=lights,
            )
        )  # fmt: skip
    return found


def main() -> None:
    """Take the pictures and put them side by side."""
    front, rear = (optics_of(load_car("nigel"), camera) for camera in ("front", "rear"))
    bent = dataclasses.replace(front, distortion=(-0.32, 0.1, 0.0, 0.0, 0.0))
    grainy = dataclasses.replace(front, exposure=0.9, gain=4.0, read_noise=2.0)
    day, dusk = Daylight(), Daylight(intensity=0.12, azimuth=0.3, elevation=0.35, ambient=0.4)

    def view(optics: Optics, daylight: Daylight, camera: str, label: str) -> Image:
        found = cars()
        image = Studio(CITY, daylight).picture(optics, found[0], found, SHOWN, camera, 0).copy()
        at, font = (28, 690), cv2.FONT_HERSHEY_SIMPLEX
        cv2.putText(image, label, at, font, 1.3, (0, 0, 0), 7, cv2.LINE_AA)
        cv2.putText(image, label, at, font, 1.3, (255, 255, 255), 3, cv2.LINE_AA)
        return image

    grid = np.vstack((
        np.hstack((view(front, day, "front", "front"), view(rear, day, "rear", "rear"))),
        np.hstack((
            view(bent, day, "front", "k1 = -0.32, k2 = 0.1"),
            view(grainy, dusk, "front", "light 0.12, gain 4"),
        )),
    ))  # fmt: skip
    small = cv2.resize(grid, None, fx=0.6, fy=0.6, interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(OUT), small, [cv2.IMWRITE_JPEG_QUALITY, 85])


if __name__ == "__main__":
    cv2.setNumThreads(1)
    main()
