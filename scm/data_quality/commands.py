"""What drove the car: commands missing, constant, in another unit, or of another drive."""

import math
from collections.abc import Iterator

import numpy as np

from scm.arrays import Floats
from scm.data_quality.expected_motion import Steered, steered
from scm.data_quality.pose_track import (
    Grid,
    Series,
    Track,
    clean,
    grid,
    held,
    long_gaps,
    recorded_s,
)
from scm.data_quality.quality import DataProblem, Repair
from scm.data_quality.repairs import Repairs, forward_speed
from scm.recording.read import Recording
from scm.vehicles.car import Car
from scm.vehicles.drive_channel import COMMANDED_SPEEDS

LARGEST_RATIO, PERCENT = 1.5, 105.0
LARGEST_ANGLE = 1.2
FOLLOWS = 0.7
SURELY, LONG_S = 0.9, 20.0  # a few seconds of another drive may turn the other way by chance
NEAR = 0.35
DEGREE = math.radians(1.0)
MAX_RATIO = 1.05  # of a command, 1 with some rounding
MAX_ANGLE_RAD = 1.2  # that wheels steer
MIN_REACH = 0.02  # of a command that changes, as a share of its largest
WIDTH_S = 0.3
STEP_S = 0.05
MAX_DELAY_S = 1.5  # of motion behind its command
MIN_CORRELATION = 0.35  # of commands and motion of one drive
HARDLY = 0.2  # a driver who holds the speed against slopes and turns undoes most of it
VARIED = 0.5  # a speed held steady by its driver says nothing about the throttle
CLEARLY, CLOSELY = 0.8, 0.6
QUICK_S, APART_S = 4.0, 3.0
LONGEST_S, SHORT_S, SHORTEST_S = 20.0, 8.0, 5.0
RELATED_SHORT = 0.6  # a few seconds of two drives are alike by chance more often
WHEELBASE_M, TURNED_RAD, STARTS = 0.25, 0.25, 3
DRIVE = ("command.throttle", "command.speed", "command.acceleration", "motor.current")
RECORD = "Record what is sent to the car, throttle and steering, with the stamps of sending."


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
    repair, fault = Repair(channels=(name,), factor=factor), "sign" if factor == -1.0 else "unit"
    return now.repair(repair, fault, text, f"Multiplied by {factor:.4g}.")


def command_problems(
    recording: Recording, movement: Series | None, poses: Track | None, car: Car | None = None
) -> Iterator[DataProblem]:
    """Yield what is wrong with a repaired recording's commands and with what they do.

    `movement` and `poses` are None where the car stands or nothing shows that it moves.
    """
    yield from _missing(recording)
    for name in ("command.throttle", "command.steering", *COMMANDED_SPEEDS):
        if name in recording.channels and len(clean(recording.channels[name]).t):
            channel = clean(recording.channels[name])
            yield from _range(recording, name, channel)
            yield from _constant(name, channel)
    if movement is not None and poses is not None:
        apart = list(_apart(recording, poses))
        yield from apart
        if not apart:
            yield from _without_effect(recording, movement, poses)
            yield from _unmoved(recording, movement, poses, car)


def _missing(recording: Recording) -> Iterator[DataProblem]:
    have = {name for name, channel in recording.channels.items() if len(clean(channel).t) > 1}
    text = ""
    if not any(name in have for name in DRIVE):
        text = (
            "Nothing says what drove the car, so no simulator can drive it again: neither its "
            "drive nor its tyres can be judged."
        )
    elif "command.throttle" not in have:
        text = (
            "There is no throttle command; only a car whose file has a speed control can be "
            "driven again without one."
        )
    if text:
        yield _lacking("command.throttle", text)
    if "command.acceleration" in have and not have & {"command.throttle", "command.speed"}:
        yield DataProblem(
            channel="command.acceleration",
            name="assumed",
            text="The car is driven by its commanded acceleration: over more than 3 s its speed is "
            "the measured one, so one that drifts slowly from its command does not show.",
            corrected="Added up to a speed from the measured one.",
            record_instead="Record the speed that the car was asked for as well.",
        )
    if "command.steering" not in have:
        text = "There is no steering command, so no simulator can drive the same way again."
        yield _lacking("command.steering", text)
    missing = [name for name in ("pose.x", "pose.y", "pose.yaw") if name not in have]
    if missing:
        yield DataProblem(
            channel=", ".join(missing) if len(missing) < 3 else "pose.*",
            name="missing",
            text="Without a whole pose there is no measure of where the car went, and nothing that "
            "another sensor could be held against.",
            record_instead="Record x, y and yaw of the car by camera, motion capture or satellite.",
        )


def _lacking(channel: str, text: str) -> DataProblem:
    return DataProblem(channel=channel, name="missing", text=text, record_instead=RECORD)


def _range(recording: Recording, name: str, channel: Series) -> Iterator[DataProblem]:
    angle = recording.channels[name].dimension == "angle"
    limit = MAX_ANGLE_RAD if angle else MAX_RATIO
    largest = float(np.abs(channel.values).max())
    if name in COMMANDED_SPEEDS or largest <= limit:
        return
    beyond = float((np.abs(channel.values) > limit).mean())
    yield DataProblem(
        channel=name,
        name="range",
        text=f"Reaches {largest:.3g}; {100.0 * beyond:.1f} % of the rows are beyond {limit:g}.",
        record_instead="Record the command that the car obeys, after its limits.",
    )


def _constant(name: str, channel: Series) -> Iterator[DataProblem]:
    if not _excited(channel):
        other = "steering" if name.endswith("steering") else "drive"
        yield DataProblem(
            channel=name,
            name="constant",
            text=f"Stays at {float(np.median(channel.values)):.3g}: delays, lags and play of the "
            f"{other} cannot show, only its steady state.",
            record_instead="Drive with steps and sines of this command.",
        )


def _apart(recording: Recording, poses: Track) -> Iterator[DataProblem]:
    """Yield commands that share no time with the poses: they were stamped by another clock."""
    for name in (*DRIVE, "command.steering"):
        t = clean(recording.channels[name]).t if name in recording.channels else np.empty(0)
        if len(t) and (t[-1] < poses.t[0] or t[0] > poses.t[-1]):
            yield DataProblem(
                channel=name,
                name="clock",
                text=f"Is stamped from {t[0]:.1f} s to {t[-1]:.1f} s, the poses from "
                f"{poses.t[0]:.1f} s to {poses.t[-1]:.1f} s: they share no time, as of two clocks.",
                record_instead="Stamp every table by one clock, or give the `offset` of the time "
                "column in the recording's description.",
            )


def _without_effect(recording: Recording, movement: Series, poses: Track) -> Iterator[DataProblem]:
    """Yield commands whose motion never follows them: those of another drive, or another clock."""
    yaw = Series(poses.t, poses.yaw)
    on = grid(poses.t[0], poses.t[-1], STEP_S, WIDTH_S, long_gaps(poses.t))
    if len(on.t) < SHORT_S / STEP_S:
        return
    short = len(on.t) < LONGEST_S / STEP_S
    related = RELATED_SHORT if short else MIN_CORRELATION
    speed, rate = on.smooth(movement), on.smooth(yaw, 1)
    steering, throttle = (_command(recording, n) for n in ("command.steering", "command.throttle"))
    if steering is not None:
        expected = on.smooth_even(held(steering, on.t) * speed)
        if not _follows(rate, expected, on, related):
            yield _unrelated("command.steering", "The car's turning does not follow its steering")
    if throttle is not None and _varied(speed) and not short:
        expected = on.smooth_even(held(throttle, on.t))
        lagged = _lagged(expected, 0.5, STEP_S)
        slope = on.smooth_even(speed, 1)
        answers = ((speed, lagged), (slope, expected), (speed, expected))
        if not any(_belongs(motion, signal, on) for motion, signal in answers):
            yield _unrelated("command.throttle", "The car's speed does not follow its throttle")


def _unmoved(
    recording: Recording, movement: Series, poses: Track, car: Car | None
) -> Iterator[DataProblem]:
    """Yield commands that stay as they are while the car does what they would have to ask for."""
    on = grid(poses.t[0], poses.t[-1], STEP_S, WIDTH_S, long_gaps(poses.t))
    if len(on.t) < SHORTEST_S / STEP_S:
        return
    speed, rate = on.smooth(movement), on.smooth(Series(poses.t, poses.yaw), 1)
    fast = float(np.percentile(np.abs(speed), 90))
    going = np.abs(speed) > 0.3 * fast
    length = car.value("body.wheelbase_m") if car else WHEELBASE_M
    right, left = np.percentile(np.arctan(length * rate[going] / speed[going]), (5, 95))
    if _stays(recording, "command.steering") and left - right > TURNED_RAD:
        text = f"The steering stays as it is, and the wheels turned by {left - right:.2f} rad"
        yield _unrelated("command.steering", text)
    slow_or_fast = np.where(speed > 0.8 * fast, 1, np.where(speed < 0.2 * fast, -1, 0))
    starts = int((np.diff(slow_or_fast[slow_or_fast != 0]) > 0).sum())
    if _stays(recording, "command.throttle") and starts >= STARTS:
        text = f"The throttle stays as it is, and the car started {starts} times"
        yield _unrelated("command.throttle", text)


def _stays(recording: Recording, name: str) -> bool:
    channel = clean(recording.channels[name]) if name in recording.channels else None
    return channel is not None and len(channel.t) > 1 and not _excited(channel)


def _excited(channel: Series) -> bool:
    reach = float(np.percentile(channel.values, 99) - np.percentile(channel.values, 1))
    return reach >= MIN_REACH * max(0.1, float(np.abs(channel.values).max()))


def _varied(speed: Floats) -> bool:
    low, middle, high = np.percentile(np.abs(speed), (10, 50, 90))
    return bool(high - low > VARIED * middle)


def _command(recording: Recording, name: str) -> Series | None:
    if name not in recording.channels:
        return None
    channel = clean(recording.channels[name])
    varied = len(channel.t) > 20 and np.ptp(channel.values) > MIN_REACH
    return channel if varied else None


def _lagged(values: Floats, time_s: float, step_s: float) -> Floats:
    """Return values behind a first-order lag."""
    kernel = np.exp(-np.arange(0.0, 6.0 * time_s, step_s) / time_s)
    padded = np.concatenate((np.full(len(kernel) - 1, values[0]), values))
    return np.convolve(padded, kernel / kernel.sum(), mode="valid")


def _follows(motion: Floats, expected: Floats, on: Grid, related: float) -> bool:
    """Return whether the motion follows within a second or two, better than at any other delay."""
    if motion.std() < 1e-6 or expected.std() < 1e-6:
        return True
    return best_correlation(motion, expected, on, MAX_DELAY_S) > related


def _belongs(motion: Floats, expected: Floats, on: Grid) -> bool:
    """Return whether the motion follows clearly, or barely and best at this drive's quick changes.

    Two drives of one car, on like routes, are alike in what is slow.
    """
    if min(motion.std(), expected.std()) < 1e-6 or _follows(motion, expected, on, CLEARLY):
        return True
    if not _follows(motion, expected, on, HARDLY):
        return False
    motion, expected = (_quick(values, on.step_s) for values in (motion, expected))
    near, apart = best_correlation(motion, expected, on, MAX_DELAY_S), round(APART_S / on.step_s)
    others = range(apart, len(expected) - apart, 4)
    far = [abs(float(np.corrcoef(motion, np.roll(expected, d))[0, 1])) for d in others]
    return near > CLOSELY or near > max(far, default=0.0)


def _quick(values: Floats, step_s: float) -> Floats:
    """Return values without what changes slower than `QUICK_S`."""
    width = 2 * round(0.5 * QUICK_S / step_s) + 1
    padded = np.pad(values, width // 2, mode="edge")
    return np.asarray(values - np.convolve(padded, np.full(width, 1.0 / width), mode="valid"))


def best_correlation(motion: Floats, expected: Floats, on: Grid, latest_s: float) -> float:
    """Return the best correlation with delays of 0 to `latest_s`."""
    delays = range(0, round(latest_s / on.step_s) + 1, 2)
    return max(
        abs(float(np.corrcoef(motion[d:], expected[: len(expected) - d])[0, 1])) for d in delays
    )


def _unrelated(name: str, text: str) -> DataProblem:
    return DataProblem(
        channel=name,
        name="without_effect",
        text=f"{text}: these commands belong to another drive, another car or another clock. No "
        "effect of this command can be concluded.",
        record_instead=RECORD,
    )
