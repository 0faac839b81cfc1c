"""The state of all cars as arrays by vehicle index; stages of a tick work on these, not on cars.

A vehicle index is a car's number in the whole world, hosted or remote, the lowest free one first.
Motion is read from the fleets once a tick; all else is read from them on demand.
"""

from collections.abc import Collection

import numpy as np

from scm.arrays import AnyArray
from scm.errors import RunError
from scm.geometry import Pose2
from scm.maps.room import distances_m

MODES = ("drive", "hold", "stop", "idle")
DRIVE, HOLD, STOP, IDLE = range(4)
CODES = {mode: code for code, mode in enumerate(MODES)}


class Numbers:
    """Assigns whole numbers from `first` on, the lowest free one first; none of `never`."""

    def __init__(self, first: int = 0, never: Collection[int] = ()) -> None:
        self._first = self._lowest = first
        self._never = frozenset(never)
        self._used: set[int] = set()

    def acquire(self) -> int:
        """Return a number and keep it from others."""
        while self._lowest in self._used or self._lowest in self._never:
            self._lowest += 1
        return self.claim(self._lowest)

    def is_free(self, number: int) -> bool:
        """Return whether nobody has a number."""
        return number not in self._used

    def is_reserved(self, number: int) -> bool:
        """Return whether a number is one of those that `acquire` never returns."""
        return number in self._never

    def claim(self, number: int) -> int:
        """Keep a number that nobody has from others, and return it."""
        self._used.add(number)
        return number

    def release(self, number: int) -> None:
        """Release a number for reuse."""
        self._used.discard(number)
        if number >= self._first:
            self._lowest = min(self._lowest, number)


class VehicleArrays:
    """Arrays of shape (capacity,).

    Attributes:
        names: Of the car with each index; empty where there is none.
        used: Whether a car has the index; `hosted`: and the world simulates it; `elsewhere`: in
            another process, which owns its region: only its motion is known here.
        x, y, yaw: Pose of the rear axle, map frame, at the end of the last tick.
        front: From the rear axle to the front bumper [m].
        speed, yaw_rate: Along the body, about the vertical; 0 for remote cars.
        driven: Whether its own driver drives it: at home, sent, and in one piece.
        throttle, steering: What the hosted cars are commanded.
        mode: Number in `MODES` of what `VehicleState` calls so.
        arrived: Whether it stands at the end of its trip.
        hazard: Whether the hazard lights must flash: its commander was lost.
        diverged: Whether its numbers left every physical range, and that was reported.
        seq: Reports sent.
    """

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self.names = [""] * capacity
        (
            self.used, self.hosted, self.elsewhere, self.driven, self.arrived, self.hazard,
            self.diverged,
        ) = (np.zeros(capacity, np.bool_) for _ in range(7))  # fmt: skip
        self.x, self.y, self.yaw, self.speed, self.yaw_rate, self.throttle, self.steering = (
            np.zeros(capacity) for _ in range(7)
        )
        self.front = np.zeros(capacity)
        self.mode = np.full(capacity, IDLE, np.int8)
        self.seq = np.zeros(capacity, np.int64)
        self._numbers = Numbers()

    def add(self, name: str, pose: Pose2, *, hosted: bool) -> int:
        """Give a car an index.

        Raises:
            RunError: when all are in use.
        """
        index = self._numbers.acquire()
        if index >= self.capacity:
            self._numbers.release(index)
            msg = f"the city is full: it holds {self.capacity} cars"
            raise RunError(msg)
        self.names[index], self.used[index], self.hosted[index] = name, True, hosted
        self.put(index, pose)
        return index

    def put(self, index: int, pose: Pose2) -> None:
        """Set the pose of a car."""
        self.x[index], self.y[index], self.yaw[index] = pose

    def remove(self, index: int) -> None:
        """Release an index and reset what its car was doing."""
        self.names[index] = ""
        for flags in (
            self.used, self.hosted, self.elsewhere, self.driven, self.arrived, self.hazard,
            self.diverged,
        ):  # fmt: skip
            flags[index] = False
        for values in (self.speed, self.yaw_rate, self.throttle, self.steering):
            values[index] = 0.0
        self.mode[index], self.seq[index] = IDLE, 0
        self._numbers.release(index)

    def memory(self, index: int) -> tuple[AnyArray, ...]:
        """Return views of what is stored of a hosted car, except its motion."""
        of = slice(index, index + 1)
        return (
            self.driven[of], self.arrived[of], self.hazard[of], self.diverged[of],
            self.throttle[of], self.steering[of], self.mode[of], self.seq[of],
        )  # fmt: skip

    def nearest_m(self, pose: Pose2, *, ahead_s: float = 0.0) -> float:
        """Return how far the nearest car is [m], as `maps.room` counts; infinity: there is none."""
        away = distances_m(pose, self.x, self.y, self.yaw, self.speed, ahead_s=ahead_s)[self.used]
        return float(away.min()) if len(away) else float("inf")
