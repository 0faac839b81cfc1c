"""What somebody drove, as files: frames of the front camera, and the commands in force with each.

    demos/mine/demonstration.json      which car drove where, its camera, how late frames came
    demos/mine/samples.parquet         a row for each frame
    demos/mine/frames/000000.jpg       the frames, made smaller

The command of a row was in force when its frame arrived, not when it was exposed: a network that
drives sees the frame no earlier.
"""

from pathlib import Path

import cv2
import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from scm.arrays import Floats, Image
from scm.errors import LearningError, reading

FRAMES, SAMPLES, ABOUT = "frames", "samples.parquet", "demonstration.json"


class Sample(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """One frame and what was done.

    Attributes:
        frame: File name of the picture, in `frames`.
        t_ns: When it was exposed; `arrived_ns`: when it could be had; both by the city's clock.
        steering, throttle: In force then, -1 to 1, + = left and forward.
        speed_mps: Along the car.
        lap: From 0.
    """

    frame: str
    t_ns: int
    arrived_ns: int
    steering: float
    throttle: float
    speed_mps: float
    lap: int


class About(msgspec.Struct, kw_only=True, frozen=True):
    """What a demonstration is.

    Attributes:
        demonstration: Version of the format.
        car: Name of the car file.
        width_px, height_px: Of the frames as they were taken; stored ones are smaller.
        delay_s: From exposure to arrival, the median.
        laps: Driven to their end.
    """

    demonstration: int
    vehicle: str
    car: str
    map: str
    width_px: int
    height_px: int
    delay_s: float
    laps: int


class Demonstration:
    """A demonstration that was read.

    Args:
        path: Its folder.

    Attributes:
        about: What it is.
        samples: In order of time.

    Raises:
        LearningError: naming the file that is missing or damaged.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if not (path / ABOUT).is_file():
            msg = (
                f"{path / ABOUT}: there is no such file; expected one by vehicle-agent record-demo"
            )
            raise LearningError(msg)
        with reading(path / ABOUT, "the description of a demonstration", LearningError):
            self.about = msgspec.json.decode((path / ABOUT).read_bytes(), type=About)
        with reading(path / SAMPLES, "the samples of a demonstration", LearningError):
            rows = pq.read_table(path / SAMPLES).to_pylist()
            self.samples = msgspec.convert(rows, list[Sample])
        if not self.samples:
            raise LearningError(f"{path}: expected frames, got none: did the car drive?")

    def frame(self, sample: Sample) -> Image:
        """Return a sample's frame (h, w, 3), blue first.

        Raises:
            LearningError: when it is missing or is no picture.
        """
        path = self.path / FRAMES / sample.frame
        image = cv2.imread(str(path)) if path.is_file() else None
        if image is None:
            found = "what is no picture" if path.is_file() else "no such file"
            raise LearningError(f"{path}: expected a frame, got {found}")
        return np.asarray(image, dtype=np.uint8)

    def column(self, name: str) -> Floats:
        """Return one number of all samples, (n,)."""
        return np.array([getattr(sample, name) for sample in self.samples], dtype=np.float64)


def write(path: Path, about: About, samples: list[Sample]) -> None:
    """Write a demonstration's description and samples; its frames are there already."""
    table = pa.Table.from_pylist([msgspec.to_builtins(sample) for sample in samples])
    temporary = path / f"{SAMPLES}.new"
    pq.write_table(table, temporary)
    temporary.replace(path / SAMPLES)
    (path / ABOUT).write_bytes(msgspec.json.format(msgspec.json.encode(about)) + b"\n")
