"""Delivery of pictures after exposure: some frames are lost, the others arrive late.

Whether a frame is lost is a function of seed, car, camera and frame number
(`scm/vehicles/noise.py`), so it depends neither on other cameras nor on earlier subscribers.
"""

import numpy as np

from scm.v2x.messages.camera_frame import CameraFrame
from scm.vehicles.noise import bases_of, key_of, uniforms


def is_lost(seed: int, vehicle: str, camera: str, number: int, drop_out: float) -> bool:
    """Return whether a frame is lost; `drop_out` is the share of those that do not."""
    if drop_out <= 0.0:
        return False
    keys = np.array([key_of(seed, vehicle, "camera", camera)], np.uint64)
    return bool(uniforms(bases_of(keys, np.array([number], np.int64)), 1)[0, 0] < drop_out)


class UnderWay:
    """Frames that were exposed and cannot be had yet."""

    def __init__(self) -> None:
        self._frames: list[tuple[int, CameraFrame]] = []

    def put(self, frame: CameraFrame, out_ns: int) -> None:
        """Hold a frame until a time of the caller's clock."""
        self._frames.append((out_ns, frame))

    def come_out(self, now_ns: int) -> list[CameraFrame]:
        """Return, once, the frames that can be had by now, first those that could be first."""
        due = sorted((held for held in self._frames if held[0] <= now_ns), key=lambda held: held[0])
        if due:
            self._frames = [held for held in self._frames if held[0] > now_ns]
        return [frame for _, frame in due]

    def clear(self) -> None:
        """Forget all of them."""
        self._frames.clear()
