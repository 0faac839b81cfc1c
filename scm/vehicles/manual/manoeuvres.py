"""Manoeuvres that make an effect visible: commands over time, initial state, floor."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from scm.vehicles.fleet import Fleet

Command = Callable[[float], float]


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """One drive.

    Attributes:
        about: Description.
        seconds: Duration.
        throttle, steering: Commands in [-1, 1] over time [s].
        speed: At the start [m/s].
        sideways: Lateral speed at the start [m/s].
        numbers: Overrides of the car file, by `section.key`, for all cars.
        floor: Sets the floor, called once before the start.
    """

    about: str
    seconds: float
    throttle: Command
    steering: Command
    speed: float = 0.0
    sideways: float = 0.0
    numbers: Mapping[str, float] = field(default_factory=dict)
    floor: Callable[[Fleet], None] | None = None


def _hold(value: float) -> Command:
    return lambda t: value


def _step(at: float, value: float, before: float = 0.0) -> Command:
    return lambda t: value if t >= at else before


def _ramp(seconds: float, value: float) -> Command:
    return lambda t: value * min(t / seconds, 1.0)


def _sine(size: float, hertz: float, start: float = 0.0) -> Command:
    return lambda t: size * math.sin(2.0 * math.pi * hertz * max(t - start, 0.0))


def _once(size: float, hertz: float, start: float) -> Command:
    wave = _sine(size, hertz, start)
    return lambda t: wave(t) if t < start + 1.0 / hertz else 0.0


def _square(size: float, period: float) -> Command:
    return lambda t: size if (t % period) < 0.5 * period else -size


def _bump(fleet: Fleet) -> None:
    fleet.floor_height[0, :] = (-0.004, -0.004, 0.0, 0.0)


def _drop(fleet: Fleet) -> None:
    fleet.floor_height[0, :] = -0.03


_FREE = {"drive.stall_torque_nm": 0.0, "drive.hold_torque_nm": 0.0}
_OFF, _STRAIGHT = _hold(0.0), _hold(0.0)

MANOEUVRES: dict[str, Manoeuvre] = {
    "throttle_step": Manoeuvre("throttle 0 to 0.8 at 0.2 s", 1.2, _step(0.2, 0.8), _STRAIGHT),
    "throttle_ramp": Manoeuvre("throttle 0 to 0.5 in 4 s", 4.0, _ramp(4.0, 0.5), _STRAIGHT),
    "throttle_off": Manoeuvre("throttle 0.8, off at 1 s", 1.4, _step(1.0, 0.0, 0.8), _STRAIGHT),
    "launch": Manoeuvre("full throttle from rest", 0.6, _hold(1.0), _STRAIGHT),
    "top_speed": Manoeuvre("full throttle", 2.0, _hold(1.0), _STRAIGHT),
    "long_drive": Manoeuvre("throttle 0.8 for a minute", 60.0, _hold(0.8), _STRAIGHT),
    "straight": Manoeuvre("throttle 0.8, steering 0", 6.0, _hold(0.8), _STRAIGHT),
    "coast_down": Manoeuvre(
        "rolling free from 3 m/s", 4.0, _hold(0.02), _STRAIGHT, speed=3.0, numbers=_FREE
    ),
    "slide": Manoeuvre(
        "pushed sideways at 1 m/s", 0.3, _hold(0.02), _STRAIGHT, sideways=1.0, numbers=_FREE
    ),
    "roll_from_rest": Manoeuvre("released at rest", 2.0, _hold(0.02), _STRAIGHT, numbers=_FREE),
    "stand": Manoeuvre("standing at throttle 0", 3.0, _OFF, _STRAIGHT),
    "hard_braking": Manoeuvre(
        "from 3 m/s, throttle off at 0.3 s", 0.9, _step(0.3, 0.0, 0.45), _STRAIGHT, speed=3.0,
        numbers={"drive.hold_torque_nm": 0.35},
    ),
    "steering_step": Manoeuvre(
        "steering 0 to 0.3 at 0.2 s, at 2.5 m/s", 1.2, _hold(0.38), _step(0.2, 0.3), speed=2.5
    ),
    "slow_steering_step": Manoeuvre(
        "steering 0 to 0.8 at 0.2 s", 1.8, _hold(0.8), _step(0.2, 0.8), speed=0.2
    ),
    "slow_circle": Manoeuvre("throttle 0.8, steering 0.5", 9.0, _hold(0.8), _hold(0.5), 0.2),
    "slow_slalom": Manoeuvre("steering swings by 0.3 at 0.4 Hz", 6.0, _hold(0.8), _sine(0.3, 0.4)),
    "tight_circle": Manoeuvre("throttle 0.8, steering full left", 6.0, _hold(0.8), _hold(1.0), 0.2),
    "both_locks": Manoeuvre(
        "full left for 4 s, then full right", 8.0, _hold(0.8), _step(4.0, -1.0, 1.0), 0.2
    ),
    "fast_circle": Manoeuvre("at 2.5 m/s, steering 0.35", 4.0, _hold(0.42), _hold(0.35), 2.5),
    "lane_change": Manoeuvre(
        "one swing of steering by 0.35 at 2.5 m/s", 1.6, _hold(0.38), _once(0.35, 1.25, 0.3), 2.5
    ),
    "brake_in_turn": Manoeuvre(
        "circle at 2.5 m/s, throttle off at 0.6 s", 1.6, _step(0.6, 0.0, 0.4), _hold(0.35), 2.5,
        numbers={"drive.hold_torque_nm": 0.35},
    ),
    "shuttle": Manoeuvre("throttle 0.8 to and fro", 6.0, _square(0.8, 4.0), _STRAIGHT),
    "bump": Manoeuvre("front wheels drop by 4 mm", 0.5, _OFF, _STRAIGHT, floor=_bump),
    "landing": Manoeuvre("dropped from 3 cm", 0.5, _OFF, _STRAIGHT, floor=_drop),
}  # fmt: skip
