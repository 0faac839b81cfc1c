"""What a network that drives a car made of one frame, and which parts of it it steered by."""

from typing import Annotated, ClassVar

from msgspec import Meta

from scm.records.fields import TNs, VehicleName
from scm.v2x.message import Message

MAX_CELLS = 4096

Saliency = Annotated[
    tuple[float, ...],
    Meta(
        max_length=MAX_CELLS,
        description="For each cell, row by row from the upper left: by how much the steering "
        "command changes when it is blurred, + = more to the left.",
        examples=[[0.0, 0.01, -0.08, 0.02]],
    ),
]


class NetworkView(Message, kw_only=True, frozen=True):
    """One frame, the commands by it, and its saliency; sent only while somebody subscribes.

    Recordings do not have it: no subscription to everything (`**`) matches its key.

    Attributes:
        camera: Which of the car's cameras took the frame.
        t_ns: When the frame was exposed, as in its `CameraFrame`.
        network: Name of the layers.
        file: Name of the model's file.
        steering, throttle: Commanded by this frame, -1 to 1, + = left and forward.
        delay_s: From exposure to command.
        inference_s: Of these, what the frame's decoding and the network took.
        top: Share of the frame's height above what the network sees; the grid of cells covers the
            rest, in its whole width.
        rows, columns: Of cells.
    """

    KEY: ClassVar[str] = "v/{vehicle}/@network"
    RATE_HZ: ClassVar[float | None] = 4.0

    vehicle: VehicleName
    camera: str
    t_ns: TNs
    network: str
    file: str
    steering: float
    throttle: float
    delay_s: float
    inference_s: float
    top: float
    rows: int
    columns: int
    saliency: Saliency


MESSAGE = NetworkView
