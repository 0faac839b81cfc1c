"""What DENMs warn drivers of: who comes near a place of danger ahead drives with caution.

A place counts for a driver from the first frame of it that reaches the driver, until the event is
over. Caution takes speed away and nothing else: who stands there is seen by its CAMs or not at all.
"""

import math
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.clock import NS_PER_S
from scm.v2x.etsi.convert import place_of
from scm.v2x.etsi.denm import ActionId, DenmBody
from scm.v2x.etsi.events import DenmWatch
from scm.vehicles.drivers.channel import IDEAL, Channel, has_arrived
from scm.vehicles.jit import law

PLACES = 32
NEAR_M = 1.5
AHEAD_COS = 0.7
NOT_OWN_M = 0.3
CAUTION = 0.6
FRAMES = 8
_SALT = 40_000


class Warned(NamedTuple):
    """The arrays: e places of danger.

    Attributes:
        at: (e, 2) where [m].
        ends_ns: (e,) until when; 0: nothing is there.
        frames: (e,) how many frames told of it.
        told_ns: (e,) when the newest was on the air.
        channel: What the air does to them on their way.
    """

    at: Floats
    ends_ns: Ints
    frames: Ints
    told_ns: Ints
    channel: Channel


class Warnings:
    """The warnings on the air.

    Attributes:
        warned: The arrays.
    """

    def __init__(self, channel: Channel) -> None:
        self._watch = DenmWatch()
        self._rows: dict[ActionId, int] = {}
        self.warned = Warned(
            at=np.zeros((PLACES, 2)),
            ends_ns=np.zeros(PLACES, np.int64),
            frames=np.zeros(PLACES, np.int64),
            told_ns=np.zeros(PLACES, np.int64),
            channel=channel,
        )

    def hear(self, body: DenmBody, now_ns: int) -> None:
        """Take a DENM that is on the air now; when all places are taken, the first to end goes.

        A DENM that does not say where its event is warns no driver.
        """
        found, warned = self._watch.hear(body, now_ns), self.warned
        action = body.management_container.action_id
        event = body.management_container.event_position
        place = place_of(event.latitude, event.longitude)
        if found == "ignored" or (found != "ended" and place is None):
            return
        if found == "ended":
            if action in self._rows:
                warned.ends_ns[self._rows.pop(action)] = 0
            return
        if action not in self._rows:
            row = int(np.argmin(warned.ends_ns))
            self._rows = {name: at for name, at in self._rows.items() if at != row}
            self._rows[action], warned.frames[row] = row, 0
        row = self._rows[action]
        warned.at[row] = place
        warned.frames[row] += 1
        warned.told_ns[row] = now_ns
        if found != "repetition":
            left_s = body.management_container.validity_duration
            warned.ends_ns[row] = now_ns + left_s * NS_PER_S


@law
def has_heard(warned: Warned, place: int, car: int, now_ns: int, seed: int) -> bool:
    """Return whether any of the newest frames of a place has reached a car."""
    if warned.channel.numbers[IDEAL] > 0.0:
        return True
    x, y = warned.at[place, 0], warned.at[place, 1]
    age_ns = now_ns - warned.told_ns[place]
    count = warned.frames[place]
    for frame in range(max(0, count - FRAMES), count):
        if has_arrived(warned.channel, seed, -_SALT - place, car, frame, x, y, age_ns):
            return True
    return False


@law
def cautious(
    warned: Warned, car: int, x: float, y: float, yaw: float, now_ns: int, seed: int
) -> float:
    """Return what share of the speed limit a car takes by the dangers close ahead of it."""
    for place in range(PLACES):
        if warned.ends_ns[place] <= now_ns:
            continue
        dx, dy = warned.at[place, 0] - x, warned.at[place, 1] - y
        away = math.sqrt(dx * dx + dy * dy)
        if away > NEAR_M or away < NOT_OWN_M:
            continue
        ahead = dx * math.cos(yaw) + dy * math.sin(yaw)
        if ahead >= AHEAD_COS * away and has_heard(warned, place, car, now_ns, seed):
            return CAUTION
    return 1.0
