"""Commands in percent, in degrees, or turned round, told by their size and by what the car does."""

import math
from collections.abc import Iterator

import numpy as np

from scm.data_quality.other_car import Steered, steered
from scm.data_quality.pose_track import clean, held, recorded_s
from scm.data_quality.problem import DataProblem
from scm.data_quality.quality import Repair
from scm.data_quality.repairs import DESCRIBE, Repairs, forward_speed
from scm.vehicles.car import Car

LARGEST_RATIO, PERCENT = 1.5, 105.0
LARGEST_ANGLE = 1.2
FOLLOWS = 0.7
SURELY, LONG_S = 0.9, 20.0  # a few seconds of another drive may turn the other way by chance
NEAR = 0.35
DEGREE = math.radians(1.0)


def repair_command_units(now: Repairs, car: Car | None) -> Iterator[DataProblem]:
    """Repair throttle in percent, and steering in another unit or with its sign turned."""
    if "command.throttle" in now.recording.channels:
        largest = _largest(now, "command.throttle")
        if LARGEST_RATIO < largest <= PERCENT and _often(now, "command.throttle"):
            yield _rescaled(now, "command.throttle", 0.01, f"Reaches {largest:.3g}: percent.")
        if _pulls_back(now):
            yield _rescaled(now, "command.throttle", -1.0, "It drives back at positive throttle.")
    if "command.steering" not in now.recording.channels:
        return
    found = _steered(now, car)
    yield from _unit(now, car, found)
    turned = FOLLOWS if _is_long(now) else SURELY
    if found is not None and found.correlation < -turned:
        yield _rescaled(now, "command.steering", -1.0, "The car turns to the other side.")


def _is_long(now: Repairs) -> bool:
    return now.poses is not None and recorded_s(now.poses.t) > LONG_S


def _pulls_back(now: Repairs) -> bool:
    """Return whether the car drives the other way than its throttle asks."""
    movement = forward_speed(now.poses)
    throttle = clean(now.recording.channels["command.throttle"])
    if movement is None or len(throttle.t) < 2:
        return False
    sent = held(throttle, movement.t)
    both = float(np.mean(sent * movement.values))
    size = float(np.sqrt(np.mean(sent**2) * np.mean(movement.values**2)))
    return size > 0.0 and both < -FOLLOWS * size


def _steered(now: Repairs, car: Car | None) -> Steered | None:
    poses, movement = now.poses, forward_speed(now.poses)
    if car is None or poses is None or movement is None:
        return None
    return steered(now.recording, car, movement, poses)


def _unit(now: Repairs, car: Car | None, found: Steered | None) -> Iterator[DataProblem]:
    angle = now.recording.channels["command.steering"].dimension == "angle"
    largest = _largest(now, "command.steering")
    limit = car.value("steering.limit_rad") if car and car.has("steering.limit_rad") else None
    if angle:
        too_small = found is not None and _near(abs(found.gain), 1.0 / DEGREE) and largest < 0.1
        if largest > LARGEST_ANGLE:
            yield _rescaled(now, "command.steering", DEGREE, f"Reaches {largest:.3g} rad: degrees.")
        elif too_small and found is not None and abs(found.correlation) > FOLLOWS:
            text = f"Reaches only {largest:.2g} rad, but the car turns: radians taken for degrees."
            yield _rescaled(now, "command.steering", 1.0 / DEGREE, text)
        return
    if largest <= LARGEST_RATIO or not _often(now, "command.steering"):
        return
    known = {"percent": 0.01}
    if limit is not None:
        known["degrees"] = DEGREE / limit
    unit = "percent"
    if found is not None and limit is not None and abs(found.correlation) > FOLLOWS:
        gain = abs(found.gain) / limit
        unit = min(known, key=lambda name: abs(math.log(max(gain, 1e-9) / known[name])))
        if not _near(gain, known[unit], 0.5):
            return
    if largest * known[unit] < LARGEST_RATIO:
        text = f"Reaches {largest:.3g}, not 1: it is in {unit}."
        yield _rescaled(now, "command.steering", known[unit], text)


def _near(value: float, expected: float, within: float = NEAR) -> bool:
    return value > 0.0 and abs(math.log(value / expected)) < within


def _largest(now: Repairs, name: str) -> float:
    values = clean(now.recording.channels[name]).values
    return float(np.abs(values).max()) if len(values) else 0.0


def _often(now: Repairs, name: str) -> bool:
    """Return whether a command is beyond 1 in more than a few rows, as a glitch would be."""
    return float((np.abs(clean(now.recording.channels[name]).values) > LARGEST_RATIO).mean()) > 0.05


def _rescaled(now: Repairs, name: str, factor: float, text: str) -> DataProblem:
    now.repair(Repair(channels=(name,), factor=factor))
    return DataProblem(
        channel=name,
        name="sign" if factor == -1.0 else "unit",
        text=text,
        corrected=f"Multiplied by {factor:.4g}.",
        record_instead=DESCRIBE,
    )
