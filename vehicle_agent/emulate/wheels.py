"""From the pins to the floor: how servo and motor respond to the pins, simulated by the kernel.

    throttle = duty - clip(duty, 0, deadband), with the sign of DIR
    steering = mean road-wheel angle / greatest one

The dead-band is that of the effect `drive_deadband`. The 120:1 gears are self-locking, so a motor
that is off holds the car, as the paper says, with BRK (which comes with PWM 0) and without.
"""

import math

from scm.clock import NS_PER_MS, NS_PER_S
from scm.geometry import Pose2
from scm.records.city_map import CityMap
from vehicle_agent.bodies.simulated import Change, SimulatedBody
from vehicle_agent.body import Motion
from vehicle_agent.emulate.firmware import Firmware
from vehicle_agent.emulate.sketches import DEADBAND, Outputs

SLICE_NS = 50 * NS_PER_MS
LONGEST_NS = 10 * NS_PER_S
"""A real car continues to roll while a computer stalls: up to this stall is simulated."""


def throttle_of(pins: Outputs, deadband: float) -> float:
    """Return the effective throttle, -1 to 1, + forward."""
    live = pins.duty - min(pins.duty, deadband)
    return -live if pins.reverse else live


def wheel_angle(pins: Outputs, straight: Outputs) -> float | None:
    """Return the mean road-wheel angle [rad], + = left; None: the servos get no pulses.

    Args:
        pins: Present state.
        straight: State with the wheels straight ahead.
    """
    turned = [a - b for a, b in zip(pins.servos_deg, straight.servos_deg, strict=False)]
    if not turned:
        return None
    if len(turned) == 1:
        return math.radians(turned[0])
    left, right = (-math.radians(angle) for angle in turned)  # mounted the other way up
    if abs(math.sin(left) * math.sin(right)) < 1e-9:
        return (left + right) / 2.0
    return math.atan(2.0 / (1.0 / math.tan(left) + 1.0 / math.tan(right)))


class Wheels:
    """A simulated car moved by the pins of a board.

    Args:
        straight: The pins with its wheels straight ahead.
        car: Car file's name.
        deadband: Duty below which the motor does not turn.
        change: After which it is another car, as with a weaker motor; None: it stays as it is.
    """

    def __init__(
        self, straight: Outputs, car: str = "nigel", deadband: float = DEADBAND,
        change: Change | None = None,
    ) -> None:  # fmt: skip
        self._straight, self._deadband = straight, deadband
        self._body = SimulatedBody(car, 0, change)
        self._steering = 0.0
        self._now_ns: int | None = None

    def learn(self, city_map: CityMap, seed: int) -> None:
        """Receive the city's floor and wind."""
        self._body.learn(city_map, seed)

    def place(self, pose: Pose2, now_ns: int) -> None:
        """Place the car at rest."""
        self._now_ns = now_ns
        self._body.place(pose, now_ns)

    def advance(self, pins: Outputs, now_ns: int) -> None:
        """Move with constant pins to now; a servo without pulses stays where it is."""
        angle = wheel_angle(pins, self._straight)
        if angle is not None:
            self._steering = max(-1.0, min(1.0, angle / self._body.limits.steer_limit))
        self._body.command(throttle_of(pins, self._deadband), self._steering)
        begin_ns = now_ns if self._now_ns is None else max(self._now_ns, now_ns - LONGEST_NS)
        for t_ns in range(begin_ns, now_ns, SLICE_NS):
            self._body.advance(t_ns)
        self._body.advance(now_ns)
        self._now_ns = now_ns

    def follow(self, firmware: Firmware, now_ns: int) -> None:
        """Move to now, with each recorded pin state for its duration."""
        past, firmware.past = firmware.past, []
        for ended_ns, pins in past:
            if self._now_ns is None or ended_ns > self._now_ns:
                self.advance(pins, min(ended_ns, now_ns))
        self.advance(firmware.outputs, now_ns)

    def motion(self) -> Motion:
        """Return the car's true motion."""
        return self._body.motion()
