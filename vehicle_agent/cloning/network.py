"""The networks, as lists of layers: training and the ONNX file are both made from the same list."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Generic, TypeVar

import cv2
import numpy as np

from scm.arrays import Image
from scm.errors import LearningError, nearest

CHANNELS = 3  # red, green, blue
GAP_NS = 200_000_000  # between the frames of a stack: a Nigel drives 5 cm
SKY = 0.3  # of a frame's rows, above the horizon of a Nigel's camera: left out

Frame = TypeVar("Frame")


@dataclass(frozen=True, slots=True)
class Convolution:
    """A square kernel without padding, then a rectifier."""

    channels: int
    kernel_px: int
    step_px: int


@dataclass(frozen=True, slots=True)
class Dense:
    """All inputs to all units, then a rectifier, except in the last layer."""

    units: int


Layer = Convolution | Dense


@dataclass(frozen=True, slots=True)
class Network:
    """What a network looks at, and its layers; the last one has the outputs.

    Attributes:
        height_px, width_px: Of its input.
        layers: Without the last.
        stack: How many frames it sees at once, `GAP_NS` apart.
    """

    name: str
    height_px: int
    width_px: int
    layers: tuple[Layer, ...]
    stack: int = 1

    @property
    def channels(self) -> int:
        """Of its input."""
        return CHANNELS * self.stack

    def shapes(self, outputs: int) -> list[tuple[int, ...]]:
        """Return each layer's weights' shape: (kernel, kernel, in, out) or (in, out)."""
        height, width, channels = self.height_px, self.width_px, self.channels
        shapes: list[tuple[int, ...]] = []
        for layer in self.layers:
            if isinstance(layer, Convolution):
                shapes.append((layer.kernel_px, layer.kernel_px, channels, layer.channels))
                height, width = (
                    (size - layer.kernel_px) // layer.step_px + 1 for size in (height, width)
                )
                channels = layer.channels
        units = [layer.units for layer in self.layers if isinstance(layer, Dense)]
        shapes += pairwise((height * width * channels, *units, outputs))
        return shapes

    def parameters(self, outputs: int) -> int:
        """Return how many numbers are learned."""
        return sum(int(np.prod(shape)) + shape[-1] for shape in self.shapes(outputs))

    def view(self, frames: Sequence[Image]) -> Image:
        """Return frames (h, w, 3), blue first as OpenCV has it, newest first, as its input.

        Returns:
            (height_px, width_px, channels), red first; of the whole width, whatever its
            proportions.
        """
        size = self.width_px, self.height_px
        below = [frame[round(SKY * len(frame)) :] for frame in frames]
        smaller = [cv2.resize(one, size, interpolation=cv2.INTER_AREA)[:, :, ::-1] for one in below]
        return np.concatenate(smaller, axis=2)


class FrameStack(Generic[Frame]):
    """The newest frame and those before it that a network sees with it.

    Args:
        count: How many.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._past: deque[tuple[int, Frame]] = deque()

    def add(self, t_ns: int, frame: Frame) -> list[Frame]:
        """Take a frame; return it and those before it, newest first; the oldest one repeats."""
        past = self._past
        if past and t_ns <= past[-1][0]:
            past.clear()  # another clock
        past.append((t_ns, frame))
        while past[0][0] < t_ns - self._count * GAP_NS:
            past.popleft()
        return [self._nearest(t_ns - number * GAP_NS) for number in range(self._count)]

    def _nearest(self, t_ns: int) -> Frame:
        return min(self._past, key=lambda one: abs(one[0] - t_ns))[1]


NETWORKS = {
    network.name: network
    for network in (
        Network(
            "paper", 64, 64,
            (Convolution(8, 11, 5), Convolution(16, 5, 2), Convolution(32, 3, 2),
             Dense(64), Dense(16), Dense(8)),
        ),
        Network(
            "pilotnet", 66, 200,
            (Convolution(24, 5, 2), Convolution(36, 5, 2), Convolution(48, 5, 2),
             Convolution(64, 3, 1), Convolution(64, 3, 1), Dense(100), Dense(50), Dense(10)),
        ),
        Network(
            "linear", 120, 160,
            (Convolution(24, 5, 2), Convolution(32, 5, 2), Convolution(64, 5, 2),
             Convolution(64, 3, 1), Convolution(64, 3, 1), Dense(100), Dense(50)),
        ),
    )
}  # fmt: skip
"""The AutoDRIVE paper's (14 065 parameters with one output), NVIDIA's, and Donkey Car's."""


def network_named(name: str) -> Network:
    """Return a network.

    Raises:
        LearningError: when there is none of that name.
    """
    if name not in NETWORKS:
        known = ", ".join(NETWORKS)
        raise LearningError(
            f"model: expected one of {known}; got {name!r}{nearest(name, list(NETWORKS))}"
        )
    return NETWORKS[name]
