"""What the two published sketches do with a command: bytes of a Float32 in, states of pins out.

Neither clamps, neither has a watchdog: what was written last stays.
Source: AutoDRIVE repository, `Firmware.ino` of the two-wheel-drive Nigel and `Firmware2WS.ino` of
the four-wheel-drive one (which drives through a TB6612 and works out Ackermann's angles itself).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from vehicle_agent.emulate.avr import float32, int16, int_of, plus, times

SHORTEST_US, LONGEST_US = 544, 2400
"""Pulses that Arduino's Servo gives, for 0 and 180 degrees."""


@dataclass(frozen=True, slots=True)
class Outputs:
    """What the pins say.

    Attributes:
        servos_us: Pulse of each steering servo [us]: one, or front left and front right; none
            before the sketch runs.
        reverse: DIR: 0 forward, 1 reverse.
        brake: BRK: 1 shorts the motor.
        pwm: The 8 bits that the timer compares with.
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
        at_setup: The pins once it runs.
        steer, drive: The pins after a message, of those before it.
    """

    baud: int
    buffer: int
    topics: tuple[str, str]
    at_setup: Outputs
    steer: Callable[[Outputs, float], Outputs]
    drive: Callable[[Outputs, float], Outputs]


def servo_pulse(value: int) -> int:
    """Return what Arduino's `Servo.write` makes of an int [us]: from 544 on it is no angle."""
    if value < SHORTEST_US:
        value = SHORTEST_US + min(max(value, 0), 180) * (LONGEST_US - SHORTEST_US) // 180
    return min(value, LONGEST_US)


def analog_write(value: int) -> tuple[int, float]:
    """Return what Arduino's `analogWrite` makes of an int: the timer's 8 bits, and the duty.

    0 and 255 switch the pin; any other number, of whatever size, leaves 8 bits to the timer.
    """
    if value in (0, 255):
        return value, value / 255.0
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
    """Return the left and right wheel's angle as the sketch works them out [deg], + = left."""
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
    """Drive all motors; between its pulses the chip shorts them, at speed 0 for good."""
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
"""By what the car's wheels are driven."""
