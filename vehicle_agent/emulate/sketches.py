"""The two published sketches' handling of commands: a Float32 in, pin states out.

Neither limits its input, neither has a watchdog: the last value stays.
Source: AutoDRIVE repository, `Firmware.ino` of the two-wheel-drive Nigel and `Firmware2WS.ino` of
the four-wheel-drive one (which drives a TB6612 and computes the Ackermann angles itself).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from vehicle_agent.emulate.avr import float32, int16, int_of, plus, times

DEADBAND = 0.2
"""Duty below which a real Nigel's motor does not turn, approximately: its authors add as much."""
SHORTEST_US, LONGEST_US = 544, 2400
"""Pulses of Arduino's Servo for 0 and 180 degrees."""


@dataclass(frozen=True, slots=True)
class Outputs:
    """State of the pins.

    Attributes:
        servos_us: Pulse of each steering servo [us]: one, or front left and front right; none
            before the sketch runs.
        reverse: DIR: 0 forward, 1 reverse.
        brake: BRK: 1 shorts the motor.
        pwm: The timer's 8-bit compare value.
        duty: Share of the time that the motor is switched on.
    """

    servos_us: tuple[int, ...] = ()
    reverse: int = 0
    brake: int = 0
    pwm: int = 0
    duty: float = 0.0

    @property
    def servos_deg(self) -> tuple[float, ...]:
        """Angle of each servo's horn [deg]."""
        span = LONGEST_US - SHORTEST_US
        return tuple(180.0 * (us - SHORTEST_US) / span for us in self.servos_us)


@dataclass(frozen=True, slots=True)
class Sketch:
    """One firmware.

    Attributes:
        baud: Of its serial port.
        buffer: Of a message in either direction [bytes].
        topics: Names of its two subscribers, steering first.
        at_setup: The pins after setup.
        steer, drive: The pins after a message, of those before it.
    """

    baud: int
    buffer: int
    topics: tuple[str, str]
    at_setup: Outputs
    steer: Callable[[Outputs, float], Outputs]
    drive: Callable[[Outputs, float], Outputs]


def servo_pulse(value: int) -> int:
    """Return the pulse of Arduino's `Servo.write` for an int [us]: from 544 on it is no angle."""
    if value < SHORTEST_US:
        value = SHORTEST_US + max(value, 0) * (LONGEST_US - SHORTEST_US) // 180
    return min(value, LONGEST_US)


def analog_write(value: int) -> tuple[int, float]:
    """Return the timer's 8 bits, and the duty, of Arduino's `analogWrite` for an int.

    0 switches the pin off; of any other number the timer gets the low 8 bits.
    """
    if value == 0:
        return 0, 0.0
    return value % 256, (value % 256 + 1) / 256.0


def _steer_2wd(pins: Outputs, data: float) -> Outputs:
    return replace(pins, servos_us=(servo_pulse(int_of(plus(97, times(30, data)))),))


def _drive_2wd(pins: Outputs, data: float) -> Outputs:
    throttle = int_of(times(255, data))
    if data > 0:
        pwm, duty = analog_write(throttle)
        return replace(pins, reverse=0, brake=0, pwm=pwm, duty=duty)
    if data < 0:
        pwm, duty = analog_write(int16(-throttle))
        return replace(pins, reverse=1, brake=0, pwm=pwm, duty=duty)
    return replace(pins, brake=1, pwm=0, duty=0.0)


WHEELBASE_MM, TRACK_MM, RAD = 141.54, 153.0, math.radians(1.0)


def _steer_4wd(pins: Outputs, data: float) -> Outputs:
    angle = int_of(times(30, data))
    return replace(pins, servos_us=tuple(servo_pulse(90 - side) for side in ackermann(angle)))


def ackermann(angle_deg: int) -> tuple[int, int]:
    """Return the left and right wheel's angle as the sketch computes them [deg], + = left."""
    rise = float32(math.tan(float32(RAD * angle_deg)))
    ahead = 2.0 * WHEELBASE_MM
    turned = [
        float32(math.atan(float32(ahead * rise / (ahead + side * TRACK_MM * rise)))) / RAD
        for side in (-1.0, 1.0)
    ]
    return int_of(float32(turned[0])), int_of(float32(turned[1]))


def _drive_4wd(pins: Outputs, data: float) -> Outputs:
    speed = int_of(times(255, data))
    if data > 0:
        return _tb6612(pins, speed)
    if data < 0:
        return _tb6612(pins, int16(-int16(abs(speed))))
    return replace(pins, brake=1, pwm=0, duty=0.0)


def _tb6612(pins: Outputs, speed: int) -> Outputs:
    """Drive all motors; between pulses, and at speed 0, the chip shorts them."""
    pwm, duty = analog_write(speed if speed >= 0 else int16(-speed))
    return replace(pins, reverse=int(speed < 0), brake=int(speed == 0), pwm=pwm, duty=duty)


SKETCHES = {
    "2wd": Sketch(
        57600, 280, ("steer_cmd", "drive_cmd"),
        Outputs(servos_us=(servo_pulse(97),)), _steer_2wd, _drive_2wd,
    ),
    "4wd": Sketch(
        115200, 512,
        ("autodrive/nigel_1/steering_command", "autodrive/nigel_1/throttle_command"),
        Outputs(servos_us=(servo_pulse(90), servo_pulse(90))), _steer_4wd, _drive_4wd,
    ),
}  # fmt: skip
"""By the number of driven wheels."""
