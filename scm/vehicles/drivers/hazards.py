"""Hazards from DENMs: a driver slows down near a hazard ahead.

A hazard counts for a driver from the first of its frames that reaches the driver until its event
ends. It only reduces speed: a car that stands there is seen by its own CAMs.
"""

import math

import numpy as np

from scm.arrays import Floats, Ints
from scm.clock import NS_PER_S
from scm.v2x.etsi.convert import place_of
from scm.v2x.etsi.denm import ActionId, DenmBody
from scm.v2x.etsi.events import DenmReceiver
from scm.vehicles.array_struct import ArrayStruct
from scm.vehicles.drivers.channel import IDEAL, Channel, has_arrived
from scm.vehicles.jit import kernel_function

MAX_HAZARDS = 32
MAX_DISTANCE_M = 1.5
MIN_COS = 0.7
MIN_DISTANCE_M = 0.3
CAUTIOUS_SHARE = 0.6
MAX_FRAMES = 8
_DENM_SALT = 40_000


class Hazards(ArrayStruct):
    """The arrays: e hazards.

    Attributes:
        at: (e, 2) where [m].
        ends_ns: (e,) until when; 0: none.
        frames: (e,) number of frames received.
        sent_ns: (e,) when the newest was sent.
        channel: The radio channel of DENMs.
    """

    at: Floats
    ends_ns: Ints
    frames: Ints
    sent_ns: Ints
    channel: Channel


class HazardTable:
    """The hazards reported by DENMs.

    Attributes:
        hazards: The arrays.
    """

    def __init__(self, channel: Channel) -> None:
        self._watch = DenmReceiver()
        self._rows: dict[ActionId, int] = {}
        self.hazards = Hazards(
            at=np.zeros((MAX_HAZARDS, 2)),
            ends_ns=np.zeros(MAX_HAZARDS, np.int64),
            frames=np.zeros(MAX_HAZARDS, np.int64),
            sent_ns=np.zeros(MAX_HAZARDS, np.int64),
            channel=channel,
        )

    def receive(self, body: DenmBody, now_ns: int) -> None:
        """Store a DENM sent now; if the table is full, replace the hazard that ends first.

        A DENM without a position warns no driver.
        """
        found, hazards = self._watch.receive(body, now_ns), self.hazards
        action = body.management_container.action_id
        event = body.management_container.event_position
        place = place_of(event.latitude, event.longitude)
        if found == "ignored" or (found != "ended" and place is None):
            return
        if found == "ended":
            if action in self._rows:
                hazards.ends_ns[self._rows.pop(action)] = 0
            return
        if action not in self._rows:
            row = int(np.argmin(hazards.ends_ns))
            self._rows = {name: at for name, at in self._rows.items() if at != row}
            self._rows[action], hazards.frames[row] = row, 0
        row = self._rows[action]
        hazards.at[row] = place
        hazards.frames[row] += 1
        hazards.sent_ns[row] = now_ns
        if found != "repetition":
            left_s = body.management_container.validity_duration
            hazards.ends_ns[row] = now_ns + left_s * NS_PER_S


@kernel_function
def has_received(hazards: Hazards, place: int, car: int, now_ns: int, seed: int) -> bool:
    """Return whether any of a hazard's newest frames has reached a car."""
    if hazards.channel.numbers[IDEAL] > 0.0:
        return True
    x, y = hazards.at[place, 0], hazards.at[place, 1]
    age_ns = now_ns - hazards.sent_ns[place]
    count = hazards.frames[place]
    for frame in range(max(0, count - MAX_FRAMES), count):
        if has_arrived(hazards.channel, seed, -_DENM_SALT - place, car, frame, x, y, age_ns):
            return True
    return False


@kernel_function
def speed_share(
    hazards: Hazards, car: int, x: float, y: float, yaw: float, now_ns: int, seed: int
) -> float:
    """Return the share of the speed limit that a car drives at near a hazard ahead."""
    for place in range(MAX_HAZARDS):
        if hazards.ends_ns[place] <= now_ns:
            continue
        dx, dy = hazards.at[place, 0] - x, hazards.at[place, 1] - y
        away = math.sqrt(dx * dx + dy * dy)
        if away > MAX_DISTANCE_M or away < MIN_DISTANCE_M:
            continue
        ahead = dx * math.cos(yaw) + dy * math.sin(yaw)
        if ahead >= MIN_COS * away and has_received(hazards, place, car, now_ns, seed):
            return CAUTIOUS_SHARE
    return 1.0
