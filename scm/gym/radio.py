"""What each car knows of the others of its world by radio: the newest frame that reached it.

Every car sends where it is and how it moves, once a step. The map's channel loses frames by
distance and walls; what was received last counts until the next arrives.
"""

import math

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.maps.segments import wall_segments
from scm.records.city_map import CityMap
from scm.vehicles.drivers.channel import Channel, channel_of, link_loss
from scm.vehicles.jit import array_kernel
from scm.vehicles.noise import GOLDEN, Keys, mix

AHEAD, LEFT, COS_TURN, SIN_TURN, SPEED, AGE = range(6)
"""Of another car, seen from the own: place of its rear axle, its direction, speed, frame's age."""
COLUMNS = 6
NEVER_S = 1e3  # the age of a frame that never came
_X, _Y, _YAW, _SPEED, _SENT = range(5)
_UNIT = 2.0**-53


class Radio:
    """The newest frames of all cars.

    Args:
        city_map: With its channel.
        worlds: How many, of `cars` cars each; a world's cars stand one after the other.

    Attributes:
        known: Of each car (rows,), of each other car of its world in order of their numbers
            (cars - 1,), the columns above.
    """

    def __init__(self, city_map: CityMap, worlds: int, cars: int) -> None:
        radio, rows = city_map.radio, worlds * cars
        reach = radio.range_m or city_map.radio_range_m
        self._channel = channel_of(radio, reach, 0, wall_segments(city_map))
        self._newest: Floats = np.zeros((rows, cars - 1, 5))
        self.known: Floats = np.zeros((rows, cars - 1, COLUMNS))

    def forget(self, rows: Ints) -> None:
        """Let cars know of nobody: their episode begins."""
        self._newest[rows] = math.nan

    def exchange(
        self, rows: Ints, motion: Floats, now_s: Floats, steps: Ints, keys: Keys, present: Bools
    ) -> None:
        """Let all cars that are present send, and some receive what reaches them.

        Args:
            rows: Which receive, (n,).
            motion: x, y, yaw of the rear axles and speed, map frame, (rows, 4).
            now_s: Since each car's episode began, (rows,).
            steps: Likewise, counted, (rows,).
            keys: Of the episodes, (rows,): what is lost follows from them.
            present: Who sends, (rows,).
        """
        _exchange(
            self._channel, rows, motion, now_s, steps, keys, present, self._newest, self.known
        )


@array_kernel
def _exchange(
    channel: Channel, rows: Ints, motion: Floats, now_s: Floats, steps: Ints, keys: Keys,
    present: Bools, newest: Floats, known: Floats,
) -> None:  # fmt: skip
    others = newest.shape[1]
    for n in range(len(rows)):
        row = rows[n]
        x, y, yaw = motion[row, 0], motion[row, 1], motion[row, 2]
        c, s = math.cos(yaw), math.sin(yaw)
        first = row - row % (others + 1)
        for k in range(others):
            other = first + k if first + k < row else first + k + 1
            if present[other]:
                lost = channel.numbers[1]
                link = link_loss(
                    channel.numbers, channel.walls, motion[other, 0], motion[other, 1], x, y
                )
                bits = mix(mix(keys[row] + np.uint64(k + 1) * GOLDEN) + np.uint64(steps[row]))
                if float(np.int64(bits >> np.uint64(11))) * _UNIT >= lost + (1.0 - lost) * link:
                    for column in range(4):
                        newest[row, k, column] = motion[other, column]
                    newest[row, k, _SENT] = now_s[row]
            frame, seen = newest[row, k], known[row, k]
            if math.isnan(frame[_SENT]):
                for column in range(AGE):
                    seen[column] = 0.0
                seen[AGE] = NEVER_S
                continue
            dx, dy = frame[_X] - x, frame[_Y] - y
            seen[AHEAD], seen[LEFT] = c * dx + s * dy, c * dy - s * dx
            seen[COS_TURN] = math.cos(frame[_YAW] - yaw)
            seen[SIN_TURN] = math.sin(frame[_YAW] - yaw)
            seen[SPEED], seen[AGE] = frame[_SPEED], now_s[row] - frame[_SENT]
