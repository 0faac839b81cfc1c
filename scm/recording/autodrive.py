"""The files of AutoDRIVE's data recorder: columns, stamps and number format.

One `V1 Log.csv` per car and one `TL1 Log.csv` per light, without a header; the number of cells
tells the type of a row. Poses are those of the rear axle's centre, at the height of the axle, in
the frame of the map tag; x forward, y left, z up; angles in [0, 2 pi), steering + = left, in rad.

Source: `Assets/Scripts/DataRecorder.cs`, `IMU.cs` of Tinker-Twins/AutoDRIVE, and the Nigel data
set of the same authors.
"""

import math
from datetime import UTC, datetime, timedelta

from scm.errors import RecordingError

STAMP, SCAN = "timestamp", "lidar"
PICTURES = ("cam0", "cam1")
POSITION = ("posX", "posY", "posZ")
EULER = ("roll", "pitch", "yaw")
RATES, ACCELERATION = ("angX", "angY", "angZ"), ("accX", "accY", "accZ")
MOTION = (*POSITION, *EULER, "speed", *RATES, *ACCELERATION)
CAR = (STAMP, "throttle", "steering", "leftTicks", "rightTicks", *MOTION)
LIGHT = (STAMP, "state")
OFF, RED, YELLOW, GREEN = range(4)

_MOUNTS = tuple(
    tuple(f"{camera}{what}{axis}" for what in ("Pos", "Rot") for axis in "XYZ")
    for camera in PICTURES
)
_BRAKED = (STAMP, "throttle", "brake", "handBrake", *CAR[2:])
CAR_LAYOUTS = {
    len(layout): layout
    for layout in (
        CAR,
        (*CAR, PICTURES[0], SCAN),
        (*CAR, *PICTURES, SCAN),
        (*_BRAKED, *_MOUNTS[0], PICTURES[0], *_MOUNTS[1], PICTURES[1], SCAN),
    )
}
LIGHT_LAYOUTS = {len(LIGHT): LIGHT}

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
STAMP_FORM = "yyyy_MM_dd_HH_mm_ss_fff"


def log_name(kind: str, number: int) -> str:
    """Return what the log of a car (`V`) or a light (`TL`) is called."""
    return f"{kind}{number} Log.csv"


def picture_name(number: int, camera: int, stamp: str) -> str:
    """Return where the recorder puts a picture of a car's camera, relative to its logs."""
    return f"V{number} Camera Frames/Camera{camera}_Frame_{stamp}.jpg"


def stamp_ms(text: str) -> int:
    """Return a stamp in milliseconds since 1970; stamps are local times that name no zone.

    Raises:
        RecordingError: when it is no stamp, or no such day or time is.
    """
    try:
        at = datetime.strptime(text.strip(), "%Y_%m_%d_%H_%M_%S_%f").replace(tzinfo=UTC)
    except ValueError as cause:
        msg = f"got {text[:40]!r}, expected a time {STAMP_FORM}"
        raise RecordingError(msg) from cause
    return (at - _EPOCH) // timedelta(milliseconds=1)


def stamp_of(ms: int) -> str:
    """Return the stamp of a time in milliseconds since 1970."""
    at = _EPOCH + timedelta(milliseconds=ms)
    return f"{at:%Y_%m_%d_%H_%M_%S}_{ms % 1000:03d}"


def cell_of(value: float) -> str:
    """Return a number as the recorder writes it, with seven digits; nothing for NaN."""
    return "" if math.isnan(value) else f"{value:.7G}"
