"""Names and memory of a fleet's arrays, and checks of its arguments."""

import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np

from scm.arrays import Floats
from scm.errors import RunError
from scm.vehicles.compiler.vector_code import LANES

# arrays that others write, and that they read: by name, with the block's name where it differs
WRITTEN = {
    "throttle": "throttle_command", "steering": "steering_command",
    **{name: name for name in (
        "battery", "air_x", "air_y", "floor_height", "floor_slope_x", "floor_slope_y",
        "floor_grip", "floor_rolling", "time", "wheel_angle",
    )},
}  # fmt: skip
READ = (
    "x", "y", "z", "roll", "pitch", "yaw", "speed", "lateral_speed", "yaw_rate",
    "roll_rate", "pitch_rate", "accel_x", "accel_y", "accel_z", "roll_accel", "pitch_accel",
    "yaw_accel", "steer_angle", "wheel_speed", "wheel_steer", "wheel_load", "wheel_x", "wheel_y",
)  # fmt: skip
WHEELS = ("fl", "fr", "rl", "rr")
VARIABLE_OF = {"wheel_x": "ground_x", "wheel_y": "ground_y"}
COG = ("x_cog", "y_cog", "yaw", "vx_world", "vy_world", "yaw_rate")
COG_CHANGED = ("vx_world", "vy_world", "yaw_rate", "x_cog", "y_cog", "yaw")


def offsets_of_variables(offsets: Mapping[str, tuple[int, int]]) -> dict[str, int]:
    """Return the offset of each variable of a car; a wheel's is named like `wheel_angle.rl`."""
    found = dict[str, int]()
    for name in (*READ, *WRITTEN):
        first, width = offsets[WRITTEN.get(name, VARIABLE_OF.get(name, name))]
        wheels = {f"{name}.{wheel}": first + w for w, wheel in enumerate(WHEELS)}
        found |= {name: first} if width == 1 else wheels
    return found


def whole_steps(duration: float, substep: float) -> int:
    """Return the number of substeps in a duration [s].

    Raises:
        RunError: when one of them is negative or no number.
    """
    if not (0.0 <= duration < math.inf and 0.0 < substep < math.inf):
        msg = f"{duration} s in substeps of {substep} s: expected a duration, and a substep above 0"
        raise RunError(msg)
    return round(duration / substep)


def steps_of(step_s: float, substep: float) -> int:
    """Return the number of substeps in a recording's step [s].

    Raises:
        RunError: when they are invalid, or the step is not a whole number of substeps.
    """
    steps = whole_steps(step_s, substep)
    if not math.isclose(steps * substep, step_s, rel_tol=1e-6):
        fitting = [n for n in (int(step_s / substep), int(step_s / substep) + 1) if n]
        whole = " or ".join(f"{n * substep:.6g} s" for n in fitting)
        parts = " or ".join(f"{step_s / n:.6g} s" for n in fitting)
        msg = (
            f"steps of {step_s:g} s are no whole number of substeps of {substep:g} s: take steps "
            f"of {whole}, or substeps of {parts}"
        )
        raise RunError(msg)
    return steps


def columns_of_command(command: Floats, capacity: int) -> Floats:
    """Return a recording's command for whole tiles; one tile wide if it is the same for all cars.

    Raises:
        RunError: when it has another shape.
    """
    values = np.asarray(command, dtype=np.float64)
    if values.ndim == 1:
        return np.repeat(values[:, None], LANES, axis=1)
    if values.ndim != 2 or values.shape[1] != capacity:
        msg = f"commands of shape {values.shape}: expected (T,) or (T, {capacity})"
        raise RunError(msg)
    if capacity % LANES:
        values = np.pad(values, ((0, 0), (0, -capacity % LANES)), mode="edge")
    return np.ascontiguousarray(values)


def aligned(shape: tuple[int, int]) -> Floats:
    """Return zeros aligned to a cache line."""
    size = shape[0] * shape[1]
    room = np.zeros(size + 8)
    begin = -room.ctypes.data % 64 // 8
    return room[begin : begin + size].reshape(shape)


@cache
def pool(threads: int) -> ThreadPoolExecutor:
    """Return the thread pool that all fleets share."""
    return ThreadPoolExecutor(threads, thread_name_prefix="fleet")
