"""Which fault of measurement would explain what two sensors say about each other."""

import math
from collections.abc import Iterator, Mapping, Sequence
from statistics import NormalDist

from scm.data_quality.distance import DistanceSensor
from scm.data_quality.quality import Measured, Relation, Repair, Suspicion

FALSE_ALARM = 0.002
CHECKS = 16
WHEEL_LIMIT = 3.0
# What no statistics of the rows shows: wheels that scrub, tyres that slip, bodies that lean.
FLOORS: Mapping[str, float] = {
    "gyro_bias": 5e-4, "gyro_scale": 1e-3, "delay": 0.002, "rate": 5e-5, "scale": 0.002,
    "heading": 0.006, "tilt": 0.002, "accel_bias": 0.01, "imu_angle": 0.008, "accel_scale": 0.01,
}  # fmt: skip
TILT_LEAK = 12.0  # far from the origin a tilt is much like a scale
LARGEST_LEAK = 6.0  # a drive with turns both ways and several speeds has 1 to 4
WILD_SCALE = 0.15
UNIT_SHARE, CLOCK_STD_S = 0.01, 0.005  # how well a unit and a far clock are known
SLIP_UNKNOWN = 0.5  # of the way that wheels seem to slip
SLIPS, WILD_SLIP = ("side_slip", "drive_slip", "turn_slip"), 0.08  # rad, or a share, per m/s^2
HALF, SURE = 1.6, 0.3
SPEED_FLOORS = {"delay": 0.01, "rate": 1e-3}  # wheels that slip under push seem early or late
SHARE_OF_STEP = 0.1  # of the time between rows, by which their stamps cannot be told apart
ANGLE_A_SECOND = 0.2
POINT_FLOOR = 0.02  # of the wheelbase: where a rear axle seems to be depends on how its tyres slip
DEFAULT_WHEELBASE_M = 0.25
LIMIT = NormalDist().inv_cdf(1.0 - 0.5 * FALSE_ALARM / CHECKS)
LIMIT_OF_TWO = math.sqrt(-2.0 * math.log(FALSE_ALARM / CHECKS))


def from_gyro(found: Relation) -> Iterator[Suspicion]:
    """Yield the gyro's faults from heading against gyro."""
    gyro = found.pair[1]
    bias = _wide(found.numbers["bias"], FLOORS["gyro_bias"])
    scale = _wide(found.numbers["scale"], FLOORS["gyro_scale"])
    text = f"{gyro} shows {bias.value:+.4f} rad/s while the pose does not turn."
    yield from _one("gyro_bias", (gyro,), "bias", bias, 0.0, found, text)
    text = f"{gyro} shows {scale.value:.3f} times the turn that the pose shows."
    yield from _one("gyro_scale", (gyro,), "scale", scale, 1.0, found, text)


def from_repairs(repairs: Sequence[Repair]) -> Iterator[Suspicion]:
    """Yield the faults of the library that were undone."""
    for repair in repairs:
        named = {
            "unit_error": ("factor", 1.0 / repair.factor, 1.0, UNIT_SHARE / abs(repair.factor)),
            "clock_offset": ("offset", -repair.shift_s, 0.0, CLOCK_STD_S),
            "pose_heading": ("offset", -repair.offset, 0.0, FLOORS["heading"]),
        }
        for name, (parameter, value, neutral, std) in named.items():
            if value != neutral:
                yield Suspicion(
                    name=name,
                    channels=repair.channels,
                    values={parameter: value},
                    std={parameter: std},
                    sigma=abs(value - neutral) / std,
                    shown_by=(repair.channels[0], repair.channels[-1]),
                    text="Undone before anything else was looked at.",
                    repaired=True,
                )


def from_clocks(found: Sequence[Relation]) -> Iterator[Suspicion]:
    """Yield latency and drift of the pose's clock; of another sensor's, where only it is off."""
    turning = [relation for relation in found if relation.pair[0] == "pose.yaw"]
    yield from _agreed(turning or found, "rate")  # heading tells a drift ten times as well as speed
    yield from _agreed(found, "delay")


def from_travel(
    found: Relation, way: DistanceSensor, wheelbase_m: float, push: Relation | None
) -> Iterator[Suspicion]:
    """Yield faults of scale, camera, marker and heading from positions against distance.

    The wheelbase is a yardstick for how far a marker may seem to be off; the accelerometer (`push`)
    knows a metre too.
    """
    if _slides(found):
        return
    yield from _scale(found, way, push)
    yield from _heading(found)
    yield from _point(found, ("ahead", "aside"), wheelbase_m)
    tilt = {n: _wide(found.numbers[n], FLOORS["tilt"], TILT_LEAK) for n in ("tilt_x", "tilt_y")}
    sigma = math.hypot(*(m.value / m.std for m in tilt.values()))
    if sigma > LIMIT_OF_TWO and all(math.isfinite(m.std) for m in tilt.values()):
        text = "The pose's metre changes over the floor, as under a camera that leans."
        yield _suspicion("camera_tilt", ("pose.x", "pose.y"), tilt, sigma, found, text)


def from_sideways(found: Relation, wheelbase_m: float) -> Iterator[Suspicion]:
    """Yield faults of heading and marker from the pose alone."""
    yield from _heading(found)
    yield from _point(found, ("ahead",), wheelbase_m)


def follows(push: Relation) -> bool:
    """Return whether the accelerometer feels both ways what the pose does, give or take a half."""
    both = [push.numbers[name] for name in ("along", "across")]
    return all(1.0 / HALF < m.value < HALF and m.std < SURE * m.value for m in both)


def from_push(found: Relation, heading_rad: float = 0.0) -> Iterator[Suspicion]:
    """Yield accelerometer faults from the pose's acceleration.

    Where the pose's yaw is known to be turned by `heading_rad`, the sensor seems turned back.
    """
    if not follows(found):
        return
    channels = ("imu.accel_x", "imu.accel_y")
    x, y = (_wide(found.numbers[f"bias_{axis}"], FLOORS["accel_bias"]) for axis in "xy")
    sigma = math.hypot(x.value / x.std, y.value / y.std)
    if sigma > LIMIT_OF_TWO and math.isfinite(x.std + y.std):
        text = (
            f"The accelerometer shows {x.value:+.2f} m/s^2 ahead and {y.value:+.2f} m/s^2 left "
            "beyond what the pose does: a bias, or a mount that is not level."
        )
        yield _suspicion("accel_bias", channels, {"along": x, "across": y}, sigma, found, text)
    seen = _wide(found.numbers["angle"], FLOORS["imu_angle"] + ANGLE_A_SECOND * found.step_s)
    angle = Measured(seen.value + heading_rad, seen.std, seen.leak)
    text = f"The accelerometer is turned by {math.degrees(angle.value):+.1f} deg on the car."
    yield from _one("imu_misalignment", channels, "angle", angle, 0.0, found, text)


def _agreed(found: Sequence[Relation], name: str) -> Iterator[Suspicion]:
    timed = [(r, _timed(r, name)) for r in found if name in r.numbers]
    known = [(relation, late) for relation, late in timed if math.isfinite(late.std)]
    if not known:
        return
    mean = _mean([measured for _, measured in known])
    apart = max(abs(m.value - mean.value) / m.std for _, m in known)
    if apart < LIMIT:
        yield from _late(name, mean, min(known, key=lambda item: item[1].std)[0])
        return
    for relation, measured in known:
        own = Measured(-measured.value, measured.std)
        kind, parameter = ("clock_drift", "rate") if name == "rate" else ("clock_offset", "offset")
        text = f"The clock of {relation.pair[1]} disagrees with those of the other sensors."
        yield from _one(kind, (relation.pair[1],), parameter, own, 0.0, relation, text)


def _timed(found: Relation, name: str) -> Measured:
    """Return a number of the clock with the error added that stamps between rows have."""
    between = SHARE_OF_STEP * found.step_s if name == "delay" else 0.0
    slip = SPEED_FLOORS[name] if found.pair[0] == "pose.x" else 0.0
    return _wide(found.numbers[name], math.hypot(FLOORS[name], between, slip))


def _late(name: str, late: Measured, found: Relation) -> Iterator[Suspicion]:
    ms, pose = 1e3 * late.value, ("pose.*",)
    if name == "rate":
        text = f"The clock of the poses gains {ms:+.2f} ms a second."
        yield from _one("clock_drift", pose, "rate", late, 0.0, found, text)
    elif ms > 0.0:
        text = f"Poses are stamped {ms:.0f} ms after the moment they show."
        yield from _one("pose_latency", pose, "delay", late, 0.0, found, text, ("clock_offset",))
    else:
        text = f"Poses are stamped {-ms:.0f} ms before the moment they show."
        yield from _one("clock_offset", pose, "offset", late, 0.0, found, text)


def _slides(found: Relation) -> bool:
    """Return whether only an implausible slip or scale makes the two agree."""
    wild = any(abs(found.numbers[name].value) > WILD_SLIP for name in SLIPS)
    apart = abs(found.numbers["scale"].value - found.numbers["chord"].value)
    return wild or not apart < WILD_SCALE


def _scale(found: Relation, way: DistanceSensor, push: Relation | None) -> Iterator[Suspicion]:
    """Yield what makes the pose's way longer or shorter than the one counted, likeliest first."""
    slip = SLIP_UNKNOWN * found.numbers["slip"].value
    chord = SLIP_UNKNOWN * (found.numbers["scale"].value - found.numbers["chord"].value)
    scale = _wide(found.numbers["scale"], math.hypot(FLOORS["scale"], slip, chord))
    sigma = (scale.value - 1.0) / math.hypot(scale.std, way.scale_std)
    if abs(sigma) < WHEEL_LIMIT:
        return
    share = Measured(1.0 / scale.value, scale.std / scale.value**2)
    faults: dict[str, tuple[tuple[str, ...], str, Measured]] = {}
    if way.name == "encoder.*" and scale.value > 1.0:
        faults["encoder_loss"] = (way.channels, "fraction", Measured(1.0 - share.value, share.std))
    if way.wheels:
        faults["wheel_radius"] = (way.channels, "scale", scale)
    else:
        faults["unit_error"] = (way.channels, "factor", share)
    faults["pose_scale"] = (("pose.x", "pose.y"), "scale", scale)
    for name in _ruled_out(push, share.value):
        faults.pop(name, None)
    text = f"The pose goes {scale.value:.3f} m for every metre of {way.name}."
    for name, (channels, parameter, measured) in faults.items():
        others = tuple(other for other in faults if other != name)
        yield _suspicion(name, channels, {parameter: measured}, abs(sigma), found, text, others)


def _ruled_out(push: Relation | None, share: float) -> tuple[str, ...]:
    """Return the faults of scale that the accelerometer rules out: it sees the pose's metre too."""
    if push is None or not follows(push):
        return ()
    both = [_wide(push.numbers[name], FLOORS["accel_scale"]) for name in ("along", "across")]
    seen = _mean(both)
    if not math.isfinite(seen.std):
        return ()
    as_pose, as_wheels = (abs(seen.value - x) / seen.std for x in (share, 1.0))
    if min(as_pose, as_wheels) > LIMIT or abs(as_pose - as_wheels) < LIMIT:
        return ()
    return (
        ("pose_scale",) if as_wheels < as_pose else ("encoder_loss", "wheel_radius", "unit_error")
    )


def _heading(found: Relation) -> Iterator[Suspicion]:
    turn = _wide(found.numbers["heading"], FLOORS["heading"])
    text = f"Driving straight, the car moves {-math.degrees(turn.value):+.1f} deg off its heading."
    yield from _one("pose_heading", ("pose.yaw",), "offset", turn, 0.0, found, text)


def _point(found: Relation, names: tuple[str, ...], wheelbase_m: float) -> Iterator[Suspicion]:
    floor = POINT_FLOOR * wheelbase_m
    widened = {name: _wide(found.numbers[name], floor) for name in names}
    numbers = {name: m for name, m in widened.items() if math.isfinite(m.std)}
    sigma = math.hypot(*(m.value / m.std for m in numbers.values()))
    if not numbers or sigma < (LIMIT if len(numbers) == 1 else LIMIT_OF_TWO):
        return
    where = ", ".join(f"{1e3 * m.value:+.0f} mm {name}" for name, m in numbers.items())
    text = f"The car turns as if the tracked point were off ({where})."
    others = ("com_shift",)
    yield _suspicion("pose_point", ("pose.x", "pose.y"), numbers, sigma, found, text, others)


def _one(
    name: str, channels: tuple[str, ...], parameter: str, measured: Measured, neutral: float,
    found: Relation, text: str, indistinguishable: tuple[str, ...] = (),
) -> Iterator[Suspicion]:  # fmt: skip
    sigma = abs(measured.value - neutral) / measured.std
    if sigma > LIMIT:
        numbers = {parameter: measured}
        yield _suspicion(name, channels, numbers, sigma, found, text, indistinguishable)


def _suspicion(
    name: str, channels: tuple[str, ...], numbers: Mapping[str, Measured], sigma: float,
    found: Relation, text: str, indistinguishable: tuple[str, ...] = (),
) -> Suspicion:  # fmt: skip
    values, std = ({n: getattr(m, what) for n, m in numbers.items()} for what in ("value", "std"))
    return Suspicion(
        name=name, channels=channels, values=values, std=std, sigma=sigma, shown_by=found.pair,
        indistinguishable=indistinguishable, text=text,
    )  # fmt: skip


def _wide(measured: Measured, floor: float, most: float = LARGEST_LEAK) -> Measured:
    """Return a number with the error added that no statistics of its rows shows.

    What the drive hardly tells from the rest is as good as unknown.
    """
    if measured.leak > most:
        return Measured(measured.value, math.inf, measured.leak)
    return Measured(measured.value, math.hypot(measured.std, floor), measured.leak)


def _mean(known: Sequence[Measured]) -> Measured:
    """Return the mean weighed by certainty."""
    known = [m for m in known if math.isfinite(m.std)]
    if not known:
        return Measured(1.0, math.inf)
    weights = [m.std**-2 for m in known]
    value = sum(w * m.value for w, m in zip(weights, known, strict=True)) / sum(weights)
    return Measured(value, sum(weights) ** -0.5)
