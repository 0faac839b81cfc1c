"""Which parts of a frame a network steers by, for people who look at it on the vehicle page.

Occlusion: a cell of the network's input is blurred until lines are gone, and the change of the
steering command is that cell's saliency. It needs nothing but the network's file, has a unit and a
sign, and depends on all layers; pictures made of activations show edges whether or not the network
uses them. It takes one run of the network for each cell, so it is done a few cells at a time, in
steps in which no frame arrives: no command waits for it.
Source: Zeiler and Fergus, "Visualizing and understanding convolutional networks", 2014 (occlusion);
blurring instead of a grey patch, which would be an edge itself, as Fong and Vedaldi, 2017.
"""

import time
from collections.abc import Callable

import cv2
import numpy as np
from msgspec.structs import replace

from scm.arrays import Image
from scm.clock import NS_PER_MS, NS_PER_S
from scm.runtime.part import IsWanted
from scm.v2x.exchange import Outgoing
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.network_view import NetworkView
from vehicle_agent.autonomy.control import Command
from vehicle_agent.cloning.network import SKY

ROWS, COLUMNS = 5, 12  # cells about square on the picture: it is 16 : 9, without its upper 30 %
MARGIN = 0.5  # of a cell, on each side: neighbours overlap, so no line hides between two
BLUR = 0.25  # of the input's width and height
PERIOD_NS = 250 * NS_PER_MS
BUDGET_S = 0.008  # of a step of 20 ms

Run = Callable[[Image], tuple[float, ...]]
"""A network: its input to commands, steering first."""


class Occlusion:
    """The saliency of one input (height, width, channels), computed piece by piece.

    Attributes:
        changes: Of the steering command, of the cells so far, row by row.
    """

    def __init__(self, run: Run, view: Image) -> None:
        self._run, self._view = run, view
        height, width = view.shape[:2]
        size = max(3, round(BLUR * width)), max(3, round(BLUR * height))
        self._blurred = np.asarray(cv2.blur(view, size)).reshape(view.shape)
        self._steering = run(view)[0]
        self.changes: list[float] = []

    @property
    def is_complete(self) -> bool:
        """Whether all cells are done."""
        return len(self.changes) == ROWS * COLUMNS

    def advance(self, budget_s: float = BUDGET_S) -> None:
        """Do some more cells: at least one, and none after so long."""
        began_s = time.perf_counter()
        while not self.is_complete:
            row, column = divmod(len(self.changes), COLUMNS)
            occluded = self._view.copy()
            where = (*self._span(row, ROWS, 0), *self._span(column, COLUMNS, 1))
            top, bottom, left, right = where
            occluded[top:bottom, left:right] = self._blurred[top:bottom, left:right]
            self.changes.append(self._run(occluded)[0] - self._steering)
            if time.perf_counter() - began_s >= budget_s:
                return

    def _span(self, cell: int, cells: int, axis: int) -> tuple[int, int]:
        """Return the first pixel of a cell with its margin, and the first behind it."""
        size = self._view.shape[axis]
        first, last = (cell - MARGIN) / cells, (cell + 1 + MARGIN) / cells
        return max(0, round(first * size)), min(size, round(last * size))


class NetworkWatch:
    """Publishes now and then what a network makes of a frame, while somebody subscribes.

    Args:
        vehicle: The car that it drives.
        network: Name of its layers.
        file: Name of its file.
        run: It.
    """

    def __init__(self, vehicle: str, network: str, file: str, run: Run) -> None:
        self._vehicle, self._network, self._file, self._run = vehicle, network, file, run
        self._is_wanted: IsWanted = lambda kind, where: False
        self._begun_ns = -NS_PER_S
        self._draft: tuple[NetworkView, Image] | None = None
        self._occlusion: Occlusion | None = None

    def attach(self, is_wanted: IsWanted) -> None:
        """Receive what reports whether there are subscribers."""
        self._is_wanted = is_wanted

    def begin(
        self, frame: CameraFrame, view: Image, command: Command, now_ns: int, inference_s: float
    ) -> None:
        """Begin with a frame that the car was driven by, if one is due and wanted."""
        if self._draft is not None or now_ns - self._begun_ns < PERIOD_NS:
            return
        self._begun_ns = now_ns
        if not self._is_wanted(NetworkView, {"vehicle": self._vehicle}):
            return
        message = NetworkView(
            vehicle=self._vehicle, camera=frame.camera, t_ns=frame.t_ns, network=self._network,
            file=self._file, steering=round(command.steering, 4),
            throttle=round(command.throttle, 4),
            delay_s=round((now_ns - frame.t_ns) / NS_PER_S + inference_s, 5),
            inference_s=round(inference_s, 6), top=SKY, rows=ROWS, columns=COLUMNS, saliency=(),
        )  # fmt: skip
        self._draft = message, view

    def step(self, *, is_idle: bool) -> list[Outgoing]:
        """Go on in an idle step, one without a frame; return the message once it is complete."""
        if self._draft is None or not is_idle:
            return []
        message, view = self._draft
        if self._occlusion is None:
            self._occlusion = Occlusion(self._run, view)
        self._occlusion.advance()
        if not self._occlusion.is_complete:
            return []
        changes = tuple(round(change, 4) for change in self._occlusion.changes)
        self._draft = self._occlusion = None
        return [replace(message, saliency=changes)]
