"""A trained network as an ONNX file, with metadata: what it was trained on, and how well it fits.

    input   frame      uint8 (1, height, width, 3 a frame), newest frame first, red first
    output  commands   float32 (1, n): steering, and throttle if the metadata say so, -1 to 1

Scaling is part of the file, so any program with an ONNX runtime can use it. It is written with
`onnx` and read with `onnxruntime`, which alone is needed to drive.
"""

from pathlib import Path

import msgspec
import numpy as np
import onnxruntime

from scm.arrays import Image
from scm.errors import LearningError
from vehicle_agent.cloning.network import CHANNELS
from vehicle_agent.network_file import session_of

KEY = "scm"
INPUT, OUTPUT = "frame", "commands"
OUTPUTS = ("steering", "throttle")
TRIED = 4  # random frames whose commands must be numbers


class Metadata(msgspec.Struct, kw_only=True, frozen=True):
    """What a network is.

    Attributes:
        model: Version of this form.
        network: Name of its layers.
        outputs: `steering`, or `steering` and `throttle`.
        car: File of the car that was driven.
        map: Where.
        throttle: Median of the demonstration's while it moved.
        delay_s: From exposure to arrival of the demonstration's frames.
        frames, laps: Learned from, after balancing.
        error, held_out_error: Root mean squares, on changed and on held-out frames; None: none was
            held out.
        data_sha256: Of the demonstrations' samples.
        stack: How many frames it sees at once.
        steering_delay_s, steering_gain: Of the car that it was trained for.
    """

    model: int
    network: str
    outputs: tuple[str, ...]
    car: str
    map: str
    throttle: float
    delay_s: float
    frames: int
    laps: int
    epochs: int
    seed: int
    error: float
    held_out_error: float | None
    data_sha256: str
    scm: str
    stack: int = 1
    steering_delay_s: float = 0.0
    steering_gain: float = 1.0


class Model:
    """A network that was read, ready to drive.

    Args:
        path: Of the file.

    Attributes:
        metadata: What it is.
        size_px: Width and height of its input.
        channels: Of its input: three for each frame.

    Raises:
        LearningError: naming the file, what was expected and what was found.
    """

    def __init__(self, path: Path) -> None:
        self._session = session_of(path)
        self.metadata = _metadata_of(path, self._session.get_modelmeta().custom_metadata_map)
        self.channels = CHANNELS * self.metadata.stack
        self.size_px = _size_of(path, self._session, self.channels)
        self._check(path)

    def __call__(self, view: Image) -> tuple[float, ...]:
        """Return the commands for an input (height, width, channels), red first; each -1 to 1."""
        (commands,) = self._session.run([OUTPUT], {INPUT: view[None]})
        return tuple(np.clip(commands[0], -1.0, 1.0).tolist())

    def _check(self, path: Path) -> None:
        """Run it once on noise.

        Raises:
            LearningError: when its commands are no numbers, or not as many as the metadata say.
        """
        width, height = self.size_px
        rng = np.random.default_rng(0)
        for _ in range(TRIED):
            view = rng.integers(0, 256, (height, width, self.channels)).astype(np.uint8)
            commands = self(view)
            if len(commands) != len(self.metadata.outputs):
                expected = " and ".join(self.metadata.outputs)
                msg = f"{path}: expected {expected}, got {len(commands)} outputs"
                raise LearningError(msg)
            if not np.isfinite(commands).all():
                msg = (
                    f"{path}: expected commands from -1 to 1, got {commands}: are its weights NaN?"
                )
                raise LearningError(msg)


def _metadata_of(path: Path, entries: dict[str, str]) -> Metadata:
    if KEY not in entries:
        msg = f"{path}: expected a network by vehicle-agent train, got one without metadata ({KEY})"
        raise LearningError(msg)
    try:
        metadata = msgspec.json.decode(entries[KEY], type=Metadata)
    except msgspec.MsgspecError as cause:
        raise LearningError(f"{path}: its metadata: {cause}") from cause
    if metadata.model != 1 or metadata.outputs not in (OUTPUTS[:1], OUTPUTS):
        msg = f"{path}: its metadata: expected model 1 and outputs {OUTPUTS}"
        raise LearningError(f"{msg}, got {metadata.model} and {metadata.outputs}")
    return metadata


def _size_of(path: Path, session: onnxruntime.InferenceSession, channels: int) -> tuple[int, int]:
    """Return width and height of the input.

    Raises:
        LearningError: when it is not one picture of so many channels.
    """
    inputs = session.get_inputs()
    names, shape = [one.name for one in inputs], list(inputs[0].shape)
    is_picture = len(shape) == 4 and shape[0] == 1 and shape[3] == channels
    if names != [INPUT] or inputs[0].type != "tensor(uint8)" or not is_picture:
        got = f"{names} of {inputs[0].type} {shape}"
        raise LearningError(
            f"{path}: expected {INPUT} of uint8 (1, height, width, {channels}), got {got}"
        )
    return int(shape[2]), int(shape[1])
