"""Close-ups: what a car reports of itself, at full rate, for as long as somebody looks at it.

All cars' positions come with the world's snapshot. Their commands and sensors are received
of one car alone, and only while its page is open.
"""

from collections import Counter, deque
from collections.abc import Iterator

import msgspec

from scm.clock import NS_PER_S
from scm.runtime.part import Subscription
from scm.v2x.messages.vehicle_state import VehicleState

DEPTH = 200  # reports: 4 s at 50 Hz, longer than any page takes to fetch them


class Sample(msgspec.Struct, frozen=True, array_like=True):
    """One report as a row of numbers, in this order.

    Attributes:
        t_s: When it was true, on the car's clock.
        throttle: The command in force, -1 to 1, + = forward.
        steering: The command in force, -1 to 1, + = left; None: unknown.
        speed_mps: Of the rear axle along the body.
        steering_rad: Mean road-wheel angle, + = left.
        yaw_rate_radps: + = counter-clockwise.
        accel_mps2: Along the body.
    """

    t_s: float
    throttle: float
    steering: float | None
    speed_mps: float
    steering_rad: float
    yaw_rate_radps: float
    accel_mps2: float


class CloseUps:
    """Who watches which cars, and their last reports; not safe between threads by itself."""

    def __init__(self) -> None:
        self._watched: Counter[str] = Counter()
        self._states: dict[str, deque[tuple[int, VehicleState]]] = {}
        self._count = 0

    def watch(self, vehicle: str, more: int) -> None:
        """Count `more` watchers of a car; without any its reports are forgotten."""
        self._watched[vehicle] += more
        if self._watched[vehicle] <= 0:
            del self._watched[vehicle]
            self._states.pop(vehicle, None)

    def receive(self, state: VehicleState, _t_ns: int) -> None:
        """Keep a report of a watched car."""
        if state.vehicle in self._watched:
            self._count += 1
            states = self._states.setdefault(state.vehicle, deque(maxlen=DEPTH))
            states.append((self._count, state))

    def after(self, vehicle: str, number: int) -> tuple[int, tuple[VehicleState, ...]]:
        """Return the number of a car's newest report, and all of its after `number`, in order."""
        states = self._states.get(vehicle, ())
        newer = tuple(state for count, state in states if count > number)
        return (states[-1][0] if states else number), newer

    def subscriptions(self) -> Iterator[Subscription]:
        """Yield the subscriptions that present viewers need."""
        return (Subscription(VehicleState, {"vehicle": vehicle}) for vehicle in self._watched)


def sample_of(state: VehicleState) -> Sample:
    """Return a report as a row."""
    return Sample(
        t_s=round(state.t_ns / NS_PER_S, 3),
        throttle=round(state.throttle, 3),
        steering=None if state.steering is None else round(state.steering, 3),
        speed_mps=round(state.speed_mps, 4),
        steering_rad=round(state.steering_rad, 4),
        yaw_rate_radps=round(state.yaw_rate_radps, 4),
        accel_mps2=round(state.accel_mps2, 3),
    )
