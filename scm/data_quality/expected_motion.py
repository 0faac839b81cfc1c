"""What a car file leads to expect: limits of motion, and whether another car was driven."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats
from scm.data_quality.pose_track import Series, Track, clean, grid, held, long_gaps
from scm.data_quality.quality import DataProblem, Relation
from scm.geometry import Pose2
from scm.recording.read import Recording
from scm.recording.units import G
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet

GENEROUS = 3.0  # times what the file says: a car is pushed, rolls downhill, spins, or is tuned
FULL_SPEED = "drive.full_speed_m_s"
WIDEST_LOCK_RAD = 0.7  # of a car whose file does not say how far its wheels turn
GRIP = 1.0  # of a tyre whose file does not say what force it passes on, over its load
OTHER_CAR = "the car file is another car's"
ANOTHER = "Nothing: give the file of the car that was driven."
MAX_SPEED_RATIO = 1.4  # of the speed driven to the file's; beyond, it is another car
MIN_SPEED_RATIO = 0.3  # likewise
TURN_RATIO = (0.55, 1.8)  # of curvature driven to the file's, lowest and highest of the same car
IMPOSSIBLE = (0.15, 4.0)  # in between, play, slow servos and weak steering may be to blame alone
# No play, and no give of a steering, is so wide [rad]; a floor that is slippery follows worse.
DOUBTFUL, MORE_THAN_PLAY, CLOSELY = (0.53, 1.9), 0.1, 0.9
ROLL_RATIO = (0.7, 1.4)  # of distance that wheels count to the poses', likewise
MIN_CORRELATION = 0.7  # of turning with steering that shows a ratio
THROTTLES: Floats = np.linspace(0.0, 1.0, 11)
STEERINGS: Floats = np.linspace(-1.0, 1.0, 21)
STEADY_S, STEERED_S = 8.0, 3.0
THROTTLE_MARGIN = 0.1  # by which a motor's dead zone may be wider than the file says
LEAST_SHARE_OF_TOP = 0.05  # of the top speed
WIDTH_S = 0.3
STEP_S = 0.05
MAX_LATERAL_MPS2 = 1.5  # beyond, tyres slip
SERVO_DELAY_S = 0.15  # usual, of steering
SHORTEST_S = 5.0
MIN_YAW_STD_RAD_S = 0.02  # of a drive that turns
MIN_SWING = 0.2  # of steering, as a share of its largest


@dataclass(frozen=True, slots=True)
class Limits:
    """What a car's motion stays below, `GENEROUS` times what its file says.

    Attributes:
        speed: [m/s]; `acceleration`: in any direction [m/s^2]; `turning`: of its heading [rad/s].
        wheels: Angular speed of its wheels [rad/s].
        counts: Of its encoders a second; `turn`: a turn; None where the file does not say it.
        length: Its wheelbase [m].
    """

    speed: float
    acceleration: float
    turning: float
    wheels: float
    counts: float | None
    turn: float | None
    length: float


def limits_of(car: Car) -> Limits:
    """Return what a car's motion stays below."""
    steady = steady_speed(car)
    top = car.value(FULL_SPEED) if steady is None else steady.top
    lock = _value(car, "steering.limit_rad", WIDEST_LOCK_RAD)
    grip = G * max(
        _value(car, key, GRIP) for key in ("tyre.force_extremum", "tyre.lateral_force_extremum")
    )
    length = car.value("body.wheelbase_m")
    curvature = math.tan(min(lock, 1.5)) / length
    turning = min(top * curvature, math.sqrt(grip * curvature))  # its tyres slip beyond
    wheels = top / car.value("wheel.radius_m")
    key = "encoder.counts_per_revolution"
    turn = car.value(key) if car.has(key) else None
    return Limits(
        speed=GENEROUS * top,
        acceleration=GENEROUS * grip,
        turning=GENEROUS * turning,
        wheels=GENEROUS * wheels,
        counts=None if turn is None else GENEROUS * wheels * turn / math.tau,
        turn=turn,
        length=length,
    )


def _value(car: Car, key: str, default: float) -> float:
    return car.value(key) if car.has(key) else default


@dataclass(frozen=True, slots=True)
class Steered:
    """How turning follows steering.

    Attributes:
        correlation: Correlation, negative where the car turns the other way.
        gain: Curvature driven over that of an angle of one unit of the command, times the
            wheelbase [rad a unit]; a small-angle figure.
        swing: From right to left of the command where this was seen, its outermost twentieths left
            out.
    """

    correlation: float
    gain: float
    swing: float


def steered(recording: Recording, car: Car, movement: Series, poses: Track) -> Steered | None:
    """Return how turning follows steering; None where the drive does not show it."""
    if "command.steering" not in recording.channels or not car.has("body.wheelbase_m"):
        return None
    steering = clean(recording.channels["command.steering"])
    if len(steering.t) < 20:
        return None
    on = grid(poses.t[0], poses.t[-1], STEP_S, WIDTH_S, long_gaps(poses.t))
    if len(on.t) < SHORTEST_S / STEP_S:
        return None
    speed, rate = on.smooth(movement), on.smooth(Series(poses.t, poses.yaw), 1)
    wheels = on.smooth_even(held(steering, on.t - SERVO_DELAY_S))
    expected = speed * wheels / car.value("body.wheelbase_m")
    fast = np.percentile(np.abs(speed), 90)
    rows = (np.abs(speed) > 0.3 * fast) & (np.abs(speed * rate) < MAX_LATERAL_MPS2)
    if rows.sum() < SHORTEST_S / STEP_S or rate[rows].std() < MIN_YAW_STD_RAD_S:
        return None
    a, b = expected[rows] - expected[rows].mean(), rate[rows] - rate[rows].mean()
    both, own = float((a * b).sum()), float((a * a).sum())
    swing = float(np.ptp(np.percentile(steering.values, (5, 95))))
    if own <= 0.0 or swing < MIN_SWING * float(np.abs(steering.values).max()):
        return None
    seen = float(np.ptp(np.percentile(wheels[rows], (5, 95))))
    return Steered(both / math.sqrt(own * float((b * b).sum())), both / own, seen)


@dataclass(frozen=True, slots=True)
class SteadySpeed:
    """Which speed throttles ask for in the end.

    Attributes:
        throttle: Rising, (n,); `speed`: reached with each [m/s].
    """

    throttle: Floats
    speed: Floats

    @property
    def bent(self) -> bool:
        """Return whether a little throttle may mean a lot of speed, or none."""
        return len(self.throttle) > 2

    @property
    def top(self) -> float:
        """With all of it [m/s]."""
        return float(self.speed[-1])

    def at(self, throttle: Floats) -> Floats:
        """Return the speeds of throttles of any sign, as sizes [m/s]."""
        return np.interp(np.abs(throttle), self.throttle, self.speed)


def other_car(
    recording: Recording, car: Car, movement: Series, poses: Track, relations: Iterable[Relation]
) -> Iterator[DataProblem]:
    """Yield the problem that the car file is another car's, with all that says so."""
    reasons = [_speed(recording, car, movement), *(_wheels(relation) for relation in relations)]
    reasons = [reason for reason in reasons if reason]
    gain, lost_rad = _turning(recording, car, movement, poses)
    wide = lost_rad > MORE_THAN_PLAY and gain is not None and not DOUBTFUL[0] < gain < DOUBTFUL[1]
    length = car.value("body.wheelbase_m")
    if gain is not None and (reasons or not IMPOSSIBLE[0] < gain < IMPOSSIBLE[1] or wide):
        reasons.append(
            f"it turns {gain:.2f} times as tightly as it is steered, as a wheelbase of "
            f"{length / gain:.2f} m would instead of {length:.2f} m"
        )
    if reasons:
        yield DataProblem(
            channel="*",
            name="other_car",
            text=f"The car file {car.name!r} does not fit this recording: {'; '.join(reasons)}. "
            "Effects found with it would make up for the wrong car.",
            record_instead=ANOTHER,
        )


def top_speed(car: Car) -> float | None:
    """Return the speed at full throttle without any loss [m/s]."""
    keys = ("drive.no_load_speed_rad_s", "wheel.radius_m")
    return car.value(keys[0]) * car.value(keys[1]) if all(car.has(k) for k in keys) else None


def steady_speed(car: Car) -> SteadySpeed | None:
    """Return the speed that throttles lead to on a level floor, without loss if the file says so.

    None where a car is not driven by its throttle.
    """
    if any(term.name == "speed_control" for term in car.terms):
        return None
    top = top_speed(car)
    if top is not None:
        return SteadySpeed(np.array([0.0, 1.0]), np.array([0.0, top]))
    throttles = np.tile(THROTTLES, (round(STEADY_S / STEP_S), 1))
    reached = _reached(car, throttles, np.zeros_like(throttles), "speed")
    return SteadySpeed(THROTTLES, np.maximum.accumulate(reached))


def _reached(car: Car, throttle: Floats, steering: Floats, what: str) -> Floats:
    """Return what cars reach that stand and then get these commands, (steps, cars) each."""
    fleet = Fleet(car, throttle.shape[1])
    for _ in range(throttle.shape[1]):
        fleet.add(Pose2(0.0, 0.0, 0.0))
    return np.asarray(fleet.rollout(throttle, steering, STEP_S, (what,))[what][-1])


def _speed(recording: Recording, car: Car, movement: Series) -> str:
    steady = steady_speed(car)
    if steady is None:
        return ""
    top = steady.top
    fast = float(np.percentile(np.abs(movement.values), 98))
    if fast > MAX_SPEED_RATIO * top:
        metres = ", or its positions are not in metres" if fast > 20.0 * top else ""
        return f"it drives {fast:.2f} m/s, the car file's car at most {top:.2f} m/s{metres}"
    share = share_of_expected_speed(recording, movement, steady)
    if share is None or share > MIN_SPEED_RATIO:
        return ""
    return f"it drives {100.0 * share:.0f} % of the speed that the throttle asks of the file's car"


def share_of_expected_speed(
    recording: Recording, movement: Series, wanted: SteadySpeed
) -> float | None:
    """Return steady speed over the one that the throttle asks for; None where nothing is steady."""
    throttle = recording.channels.get("command.throttle")
    if throttle is None or len(clean(throttle).t) < 2:
        return None
    on = grid(movement.t[0], movement.t[-1], STEP_S, WIDTH_S, long_gaps(movement.t))
    throttles = np.abs(on.smooth_even(held(clean(throttle), on.t)))
    speed, push = np.abs(on.smooth(movement)), np.abs(on.smooth(movement, 1))
    fast = float(np.percentile(speed, 98))
    steady = (throttles > 0.3) & (push < 0.1 * fast) & (speed > 0.3 * fast)
    full = wanted.at(np.maximum(throttles - THROTTLE_MARGIN, 0.0) if wanted.bent else throttles)
    steady &= full > LEAST_SHARE_OF_TOP * wanted.top
    return float(np.median(speed[steady] / full[steady])) if steady.sum() * STEP_S > 3.0 else None


def _turning(
    recording: Recording, car: Car, movement: Series, poses: Track
) -> tuple[float | None, float]:
    """Return how tightly it turns against what is steered, and how many rad of steering that is.

    None where nothing is odd about it, and no rad where it follows its steering badly.
    """
    found = steered_in_wheel_angles(recording, car, movement, poses)
    if found is None:
        return None, 0.0
    odd = found.correlation >= MIN_CORRELATION and not TURN_RATIO[0] < found.gain < TURN_RATIO[1]
    lost_rad = found.swing * abs(1.0 - found.gain) if found.correlation > CLOSELY else 0.0
    return (found.gain if odd else None), lost_rad


def steered_in_wheel_angles(
    recording: Recording, car: Car, movement: Series, poses: Track
) -> Steered | None:
    """Return how turning follows the angle of the wheels; None where the drive does not show it."""
    if "command.steering" not in recording.channels:
        return None
    recording, unit = _in_wheel_angles(recording, car)
    found = steered(recording, car, movement, poses)
    if found is None:
        return None
    return Steered(found.correlation, found.gain / unit, found.swing * unit)


def _in_wheel_angles(recording: Recording, car: Car) -> tuple[Recording, float]:
    """Return the recording and what one unit of its steering means [rad].

    Where the car file has no such number its own steering tells, tried at rest.
    """
    steering = recording.channels["command.steering"]
    if steering.dimension == "angle":
        return recording, 1.0
    if car.has("steering.limit_rad"):
        return recording, car.value("steering.limit_rad")
    steerings = np.tile(STEERINGS, (round(STEERED_S / STEP_S), 1))
    turned = _reached(car, np.zeros_like(steerings), steerings, "steer_angle")
    values = np.interp(steering.values, STEERINGS, turned)
    changed = replace(steering, values=values, dimension="angle")
    return replace(recording, channels={**recording.channels, "command.steering": changed}), 1.0


def _wheels(found: Relation) -> str:
    scale = found.numbers.get("scale")
    wheels = found.pair[1].startswith(("encoder", "wheel_speed")) and found.pair[0] == "pose.x"
    if not wheels or scale is None or ROLL_RATIO[0] < scale.value < ROLL_RATIO[1]:
        return ""
    return f"the way driven is {scale.value:.2f} times what its wheels count"
