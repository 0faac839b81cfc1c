"""The networks, as lists of layers: training and the ONNX file are both made from the same list."""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from scm.arrays import Image
from scm.errors import LearningError, nearest

CHANNELS = 3  # red, green, blue
SKY = 0.3  # of a frame's rows, above the horizon of a Nigel's camera: left out


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
    """

    name: str
    height_px: int
    width_px: int
    layers: tuple[Layer, ...]

    def shapes(self, outputs: int) -> list[tuple[int, ...]]:
        """Return each layer's weights' shape: (kernel, kernel, in, out) or (in, out)."""
        height, width, channels = self.height_px, self.width_px, CHANNELS
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

    def view(self, frame: Image) -> Image:
        """Return a frame (h, w, 3), blue first as OpenCV has it, as the network's input.

        Returns:
            (height_px, width_px, 3), red first; of the whole width, whatever its proportions.
        """
        size = self.width_px, self.height_px
        below = frame[round(SKY * len(frame)) :]
        smaller = cv2.resize(below, size, interpolation=cv2.INTER_AREA)
        return np.ascontiguousarray(smaller[:, :, ::-1])


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
