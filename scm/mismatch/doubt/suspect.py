"""Which fault of measurement would explain what two sensors say about each other."""

import math
from collections.abc import Iterator, Mapping, Sequence
from statistics import NormalDist

from scm.mismatch.doubt.suspicion import Measured, Relation, Suspicion
from scm.mismatch.doubt.way import Way

FALSE_ALARM = 0.01
POSE = ("pose.x", "pose.y", "pose.yaw")
WHEEL_LIMIT = 3.0
# Below these a car that rolls and slips, or a file that rounds, looks the same as a fault.
FLOORS: Mapping[str, float] = {
    "gyro_bias": 0.002, "gyro_scale": 0.003, "delay": 0.003, "rate": 1e-4, "scale": 0.002,
    "heading": 0.006, "tilt": 0.001, "accel_bias": 0.02, "imu_angle": 0.02,
}  # fmt: skip
POINT_FLOOR = 0.02  # of the wheelbase: where a rear axle seems to be depends on how its tyres slip
DEFAULT_WHEELBASE_M = 0.25


def limit(checks: int) -> float:
    """Return how many standard deviations one of so many checks may be off by chance."""
    return NormalDist().inv_cdf(1.0 - 0.5 * FALSE_ALARM / max(1, checks))


def from_gyro(found: Relation, checks: int) -> Iterator[Suspicion]:
    """Yield gyro and clock faults from heading against gyro."""
    gyro = ("imu.gyro_z",) if found.pair[1].startswith("imu.") else (found.pair[1],)
    bias, scale = found.numbers["bias"], found.numbers["scale"]
    yield from _one(
        "gyro_bias",
        gyro,
        "bias",
        bias,
        0.0,
        FLOORS["gyro_bias"],
        found,
        checks,
        f"The gyro shows {bias.value:+.4f} rad/s while the pose does not turn.",
    )
    yield from _one("gyro_scale", gyro, "scale", scale, 1.0, FLOORS["gyro_scale"], found, checks,
                    f"The gyro shows {scale.value:.3f} times the turn that the pose shows.")  # fmt: skip


def from_clocks(found: Sequence[Relation], checks: int) -> Iterator[Suspicion]:
    """Yield latency and drift of the pose's clock, as all relations that know it agree on."""
    for name, floor in (("delay", FLOORS["delay"]), ("rate", FLOORS["rate"])):
        known = [(r, r.numbers[name]) for r in found if name in r.numbers]
        if not known:
            continue
        best, _ = min(known, key=lambda item: item[1].std)
        both = _mean([measured for _, measured in known])
        if name == "rate":
            yield from _one("clock_drift", ("pose.*",), "rate", both, 0.0, floor, best, checks,
                            f"The clock of the poses gains {1e3 * both.value:+.2f} ms a second.")  # fmt: skip
        elif both.value > 0.0:
            said = f"Poses are stamped {1e3 * both.value:.0f} ms after the moment they show."
            yield from _one("pose_latency", ("pose.*",), "delay", both, 0.0, floor, best, checks,
                            said, ("clock_offset",))  # fmt: skip
        else:
            said = f"Poses are stamped {-1e3 * both.value:.0f} ms before the moment they show."
            yield from _one(
                "clock_offset", ("pose.*",), "offset", both, 0.0, floor, best, checks, said
            )


def from_travel(found: Relation, way: Way, wheelbase_m: float, checks: int) -> Iterator[Suspicion]:
    """Yield faults of scale, camera, marker and heading from positions against distance."""
    yield from _scale(found, way)
    yield from _heading(found, checks)
    yield from _point(found, ("ahead", "aside"), wheelbase_m, checks)
    tilt = {axis: found.numbers[f"tilt_{axis}"] for axis in "xy"}
    wide = {axis: math.hypot(m.std, FLOORS["tilt"]) for axis, m in tilt.items()}
    sigma = math.hypot(*(tilt[axis].value / wide[axis] for axis in "xy"))
    if sigma > limit(checks) + 0.5:
        yield Suspicion(
            name="camera_tilt",
            channels=("pose.x", "pose.y"),
            values={f"tilt_{axis}": m.value for axis, m in tilt.items()},
            std={f"tilt_{axis}": m.std for axis, m in tilt.items()},
            sigma=sigma,
            shown_by=found.pair,
            said="The pose's metre changes over the floor, as under a camera that leans.",
        )


def from_sideways(found: Relation, wheelbase_m: float, checks: int) -> Iterator[Suspicion]:
    """Yield faults of heading and marker from the pose alone."""
    yield from _heading(found, checks)
    yield from _point(found, ("ahead",), wheelbase_m, checks)


def from_push(found: Relation, checks: int) -> Iterator[Suspicion]:
    """Yield accelerometer faults from the pose's acceleration."""
    x, y = found.numbers["bias_x"], found.numbers["bias_y"]
    wide = [math.hypot(m.std, FLOORS["accel_bias"]) for m in (x, y)]
    sigma = math.hypot(x.value / wide[0], y.value / wide[1])
    if sigma > limit(checks) + 0.5:
        yield Suspicion(
            name="accel_bias",
            channels=("imu.accel_x", "imu.accel_y"),
            values={"along": x.value, "across": y.value},
            std={"along": x.std, "across": y.std},
            sigma=sigma,
            shown_by=found.pair,
            twins=("grade",),
            said=f"The accelerometer shows ({x.value:+.2f}, {y.value:+.2f}) m/s^2 more than the pose.",
        )
    angle = found.numbers["angle"]
    yield from _one("imu_misalignment", ("imu.accel_x", "imu.accel_y"), "angle", angle, 0.0,
                    FLOORS["imu_angle"], found, checks,
                    f"The accelerometer is turned by {math.degrees(angle.value):+.1f} deg.")  # fmt: skip


def _scale(found: Relation, way: Way) -> Iterator[Suspicion]:
    scale = found.numbers["scale"]
    std = math.hypot(scale.std, FLOORS["scale"], way.scale_std)
    sigma = (scale.value - 1.0) / std
    if abs(sigma) < WHEEL_LIMIT:
        return
    said = f"The pose goes {scale.value:.3f} m for every metre of {way.name}."
    lost = 1.0 - 1.0 / scale.value
    faults = [("pose_scale", ("pose.x", "pose.y"), "scale", scale.value, scale.std)]
    if way.wheels:
        faults.append(("wheel_radius", way.channels, "scale", scale.value, scale.std))
    if way.name == "encoder.*" and lost > 0.0:
        faults.append(("encoder_loss", way.channels, "fraction", lost, scale.std / scale.value**2))
    if not way.wheels:
        faults.append(
            ("unit_error", way.channels, "factor", 1.0 / scale.value, scale.std / scale.value**2)
        )
    for name, channels, parameter, value, spread in reversed(faults):
        twins = tuple(other[0] for other in faults if other[0] != name)
        yield Suspicion(
            name=name, channels=channels, values={parameter: value}, std={parameter: spread},
            sigma=abs(sigma), shown_by=found.pair, twins=twins, said=said,
        )  # fmt: skip


def _heading(found: Relation, checks: int) -> Iterator[Suspicion]:
    heading = found.numbers["heading"]
    yield from _one("pose_heading", ("pose.yaw",), "offset", heading, 0.0, FLOORS["heading"], found,
                    checks, "Driving straight, the car moves slantwise to its heading by "
                    f"{math.degrees(heading.value):+.1f} deg.")  # fmt: skip


def _point(
    found: Relation, names: tuple[str, ...], wheelbase_m: float, checks: int
) -> Iterator[Suspicion]:
    floor = POINT_FLOOR * wheelbase_m
    numbers = {name: found.numbers[name] for name in names}
    sigma = math.hypot(*(m.value / math.hypot(m.std, floor) for m in numbers.values()))
    if sigma < limit(checks) + 0.5 * (len(names) - 1):
        return
    where = ", ".join(f"{1e3 * m.value:+.0f} mm {name}" for name, m in numbers.items())
    yield Suspicion(
        name="pose_point",
        channels=("pose.x", "pose.y"),
        values={name: m.value for name, m in numbers.items()},
        std={name: m.std for name, m in numbers.items()},
        sigma=sigma,
        shown_by=found.pair,
        twins=("com_shift",),
        said=f"The car turns about a point that says the marker is {where} of where it should be.",
    )


def _one(
    name: str, channels: tuple[str, ...], parameter: str, measured: Measured, neutral: float,
    floor: float, found: Relation, checks: int, said: str, twins: tuple[str, ...] = (),
) -> Iterator[Suspicion]:  # fmt: skip
    sigma = abs(measured.value - neutral) / math.hypot(measured.std, floor)
    if sigma > limit(checks):
        yield Suspicion(
            name=name, channels=channels, values={parameter: measured.value},
            std={parameter: measured.std}, sigma=sigma, shown_by=found.pair, twins=twins, said=said,
        )  # fmt: skip


def _mean(known: Sequence[Measured]) -> Measured:
    """Return the mean weighed by certainty."""
    weights = [m.std**-2 for m in known]
    value = sum(w * m.value for w, m in zip(weights, known, strict=True)) / sum(weights)
    return Measured(value, sum(weights) ** -0.5)
