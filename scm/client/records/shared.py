"""Records of shared.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec


class StationRow(msgspec.Struct, kw_only=True, frozen=True):
    """One run of one station.

    Attributes:
        role: What it is in the city, or what its holder may do.
        name: What it is called.
        session: Of this run of it: another after each start.
        alive: Whether it is there; false: it left or died.
        since_ns: When it was first seen here.
        lost_ns: When it left or died; None while it is there.
        age_s: Since its last status; None: it never sent one.
        detail: What it says of itself, or what was seen, in words.
        step_ms: Its slowest step of the last second [ms].
        late_steps: Steps that were due and left out, since its start.
        late_share: The same as a share of the steps due in the last minute; None: not known.
        dropped: Messages that its mailboxes had to drop, since its start.
        dropped_lately: The same within the last minute.
    """

    role: str
    name: str
    session: str
    alive: bool
    since_ns: int
    lost_ns: int | None = None
    age_s: float | None = None
    detail: str = ""
    step_ms: float = 0.0
    late_steps: int = 0
    late_share: float | None = None
    dropped: int = 0
    dropped_lately: int = 0


class Residual(msgspec.Struct, kw_only=True, frozen=True):
    """Measured minus true: distance on the floor, and yaw (+ = measured further left).

    Attributes:
        position_mm: Distance from the truth, on the floor [mm].
        x_mm: Along map x and y [mm].
        y_mm: Along map x and y [mm].
        yaw_deg: Measured further left than the truth [degree].
    """

    position_mm: float
    x_mm: float
    y_mm: float
    yaw_deg: float


class Operation(msgspec.Struct, kw_only=True, frozen=True):
    """One piece of long work.

    Attributes:
        id: Of this operation, below `/operations`.
        kind: What work it is: `mismatch`, `export`, ...
        what: Of which thing, in words.
        state: How far it is.
        progress: 0 to 1; None: nobody can tell.
        doing: The step it is at, in words.
        result: Address of what it made; empty until it is done.
        error: Why it failed; empty unless it did.
        owner: Who asked for it.
        asked_ns: When somebody asked for it [ns since 1970].
        began_ns: When it began [ns since 1970].
        ended_ns: When it was over [ns since 1970]; null: it is not.
    """

    id: str
    kind: str
    what: str
    state: Literal["cancelled", "done", "failed", "running", "waiting"]
    progress: float | None
    doing: str
    result: str
    error: str
    owner: str
    asked_ns: int
    began_ns: int | None
    ended_ns: int | None


class Light(msgspec.Struct, kw_only=True, frozen=True):
    """A three-lamp head on a pole; it shows its group's colour.

    Attributes:
        light_id: Number of the signal head.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Where the lamps look: towards the cars they are meant for.
        junction: Name of a junction.
        group: Name of a signal group: heads that always show the same.
    """

    light_id: int
    x_m: float
    y_m: float
    yaw_rad: float
    junction: str
    group: str


class Box(msgspec.Struct, kw_only=True, frozen=True):
    """A construction box on the floor.

    Attributes:
        name: What it is called.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        length_m: How long it is [m].
        width_m: How wide it is [m].
        height_m: Above the floor [m].
        mass_kg: Of one that cars can push; without it nobody moves the box.
        friction: Between the box and the floor.
    """

    name: str
    x_m: float
    y_m: float
    yaw_rad: float = 0.0
    length_m: float
    width_m: float
    height_m: float = 0.2
    mass_kg: float | None = None
    friction: float = 0.5


class Camera(msgspec.Struct, kw_only=True, frozen=True):
    """An overhead camera, looking down: a pinhole with OpenCV's distortion, or a fisheye.

    Attributes:
        name: What it is called.
        x_m: Optical centre in the map frame.
        y_m: Optical centre in the map frame.
        z_m: Optical centre in the map frame.
        yaw_rad: Direction of the image's right edge over the floor (x of the picture).
        tilt_x_rad: Small rotations about the picture's x and y away from straight down.
        tilt_y_rad: Small rotations about the picture's x and y away from straight down.
        width_px: Columns of the picture.
        height_px: Rows of the picture.
        fx_px: Focal length along a row [px].
        fy_px: Focal length along a column [px].
        cx_px: Principal point, column [px].
        cy_px: Principal point, row [px].
        lens: `fisheye` is OpenCV's model of wide lenses (angle, not tangent, over the picture).
        distortion: k1, k2, p1, p2, k3; of a fisheye k1, k2, k3, k4, 0.
        rate_hz: How often a second.
        noise_sigma: Standard deviation of a grey value.
        place_std: Standard deviations of x, y, z [m], yaw, tilt x, tilt y [rad], as `scm eye
            locate` found them; without, the Eye takes millimetres and half a milliradian.
        rolling_s: From the exposure of the first row to that of the last; 0: all at once.
    """

    name: str
    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float = 0.0
    tilt_x_rad: float = 0.0
    tilt_y_rad: float = 0.0
    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    lens: Literal["fisheye", "pinhole"] = "pinhole"
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    rate_hz: float = 10.0
    noise_sigma: float = 2.0
    place_std: tuple[float, float, float, float, float, float] | None = None
    rolling_s: float = 0.0


class SnapshotBox(msgspec.Struct, kw_only=True, frozen=True):
    """One construction box that cars can push; pose of its middle, map frame.

    Attributes:
        name: What it is called.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
    """

    name: str
    x_m: float
    y_m: float
    yaw_rad: float
