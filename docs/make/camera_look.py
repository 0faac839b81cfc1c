"""Tries `scm camera calibrate-look` on concealed looks, and makes docs/pictures/camera_look.jpg.

Run with `python docs/make/camera_look.py [FIRST LAST]`, seeds (11 20): a line for each, and the
errors that docs/cameras.md states. Some 15 s a seed.
"""

import dataclasses
import math
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

from scm.arrays import Floats
from scm.camera.calibrate.counterparts import Counterparts
from scm.camera.calibrate.fit import Fitted, fit
from scm.camera.calibrate.real_frames import read_frames
from scm.camera.daylight import Daylight
from scm.camera.optics import Optics, optics_of
from scm.camera.studio import Studio
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import Path as Way
from scm.maps.route import roads_of
from scm.v2x.messages.world_snapshot import SnapshotVehicle
from scm.vehicles.car import load_car

OUT = Path(__file__).parents[1] / "pictures" / "camera_look.jpg"
SHOWN = 18
FRAMES = 32
CITY = load_map("driving_school")
WAY = Way.circulation(roads_of(CITY), CITY.lanes[0].name)
NIGEL = optics_of(load_car("nigel"), "front")
NAMES = ("exposure", "red", "blue", "gamma", "vignetting", "blur", "read", "shot", "jpeg")


def concealed(rng: np.random.Generator) -> Optics:
    """Return a camera with a look of its own."""

    def factor(low: float, high: float) -> float:
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    return dataclasses.replace(
        NIGEL, exposure=factor(0.4, 1.8),
        white_balance=(factor(0.75, 1.35), 1.0, factor(0.7, 1.35)), gamma=factor(0.7, 1.4),
        vignetting=float(rng.uniform(0.0, 0.5)), blur_px=float(rng.uniform(0.0, 2.0)),
        read_noise=float(rng.uniform(0.5, 4.0)), shot_noise=float(rng.uniform(0.0, 8.0)),
        jpeg_quality=float(rng.integers(70, 98)),
    )  # fmt: skip


def take(optics: Optics, rng: np.random.Generator, seed: int, folder: Path) -> None:
    """Take frames along the figure of eight."""
    studio = Studio(CITY, Daylight(), seed + 777)
    start = float(rng.uniform(0.0, WAY.length_m))
    for number in range(FRAMES):
        beside, turned = rng.standard_normal(2) * (0.012, 0.04)
        s_m = start + number * WAY.length_m / FRAMES + float(rng.uniform(0.0, 0.2))
        at = WAY.at(s_m % WAY.length_m) @ Pose2(0.0, float(beside), float(turned))
        car = SnapshotVehicle(
            vehicle="n1", kind="hosted", car="nigel", tag_id=1, x_m=at.x, y_m=at.y,
            yaw_rad=at.yaw, speed_mps=0.0, steering_rad=0.0,
        )  # fmt: skip
        image = studio.picture(optics, car, (car,), {}, "front", number * 66_666_666)
        quality = [cv2.IMWRITE_JPEG_QUALITY, round(optics.jpeg_quality)]
        cv2.imwrite(str(folder / f"{number:04}.jpg"), image, quality)


def tried(seed: int) -> tuple[Floats, Floats, Fitted]:
    """Return the numbers of a concealed look, those found, and all that was found."""
    rng = np.random.default_rng([seed, 99])
    optics = concealed(rng)
    with tempfile.TemporaryDirectory() as folder:
        take(optics, rng, seed, Path(folder))
        real = read_frames(Path(folder), (NIGEL.width_px, NIGEL.height_px))
    found = fit(real, Counterparts(CITY, NIGEL, "front", 0), NIGEL, lambda _: None)
    return numbers(optics), numbers(found.optics), found


def numbers(optics: Optics) -> Floats:
    """Return a look in the order of `NAMES`."""
    red, _, blue = optics.white_balance
    return np.array([
        optics.exposure, red, blue, optics.gamma, optics.vignetting, optics.blur_px,
        optics.read_noise, optics.shot_noise, optics.jpeg_quality,
    ])  # fmt: skip


def main() -> None:
    """Try some seeds, and print what they show."""
    cv2.setNumThreads(1)
    first, last = map(int, sys.argv[1:] or (11, 20))
    off, colours = [], []
    for seed in range(first, last + 1):
        true, found, all_found = tried(seed)
        off.append(np.abs(found - true) / np.where(np.arange(len(true)) < 4, true, 1.0))
        colours.append((all_found.before.colour, all_found.after.colour))
        sys.stdout.write(f"{seed}: {true.round(2)}\n    {found.round(2)} {colours[-1]}\n")
        if seed == SHOWN:
            cv2.imwrite(str(OUT), all_found.sheet, [cv2.IMWRITE_JPEG_QUALITY, 85])
    for name, column in zip(NAMES, np.array(off).T, strict=True):
        sys.stdout.write(f"{name:12}{np.median(column):8.3f}{column.max():8.3f}\n")
    before, after = np.median(colours, axis=0)
    sys.stdout.write(f"colours {before:.1f} before, {after:.1f} after\n")


if __name__ == "__main__":
    main()
