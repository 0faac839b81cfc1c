"""From what cars say and cameras see to cars before a stop line: one way of putting it for both.

A track and the CAMs of the same car count as one car, by its name. A tag that belongs to nobody is
a car of its own, unless it lies where a car that speaks is believed to be.
"""

import math

from scm.clock import NS_PER_S
from scm.traffic.signals.detectors import Seen
from scm.v2x.etsi.convert import ASSUMED_LENGTH_M, generated_ns, read_cam, station_id
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.eye_track import EyeTrack

NIGEL_FRONT_M = 0.23
SAME_M = 0.2
FRESH_NS = 2 * NS_PER_S
NOBODY = "tag-"


class Sightings:
    """Turns messages into `Seen`; knows who spoke lately."""

    def __init__(self) -> None:
        self._spoke: dict[int, Seen] = {}

    def of_cam(self, message: CamRx) -> Seen | None:
        """Return the car that a CAM tells of; None when it lacks a place, heading or speed."""
        claimed = read_cam(message.body)
        if claimed.place is None or claimed.yaw_rad is None or claimed.speed_mps is None:
            return None
        seen = Seen(
            claimed.station_id,
            generated_ns(message.body, message.t_ns),
            *claimed.place,
            claimed.yaw_rad,
            claimed.speed_mps,
            claimed.length_m or ASSUMED_LENGTH_M,
        )
        self._spoke[seen.who] = seen
        return seen

    def of_track(self, track: EyeTrack) -> Seen | None:
        """Return the car that a track tells of; None when it is stale, or speaks for itself."""
        if track.stale:
            return None
        who = station_id(track.vehicle)
        spoken = self._spoke.get(who)
        front_m = NIGEL_FRONT_M
        seen = Seen(
            who,
            track.t_ns,
            track.x_m + front_m * math.cos(track.yaw_rad),
            track.y_m + front_m * math.sin(track.yaw_rad),
            track.yaw_rad,
            track.speed_mps,
            ASSUMED_LENGTH_M if spoken is None else spoken.length_m,
        )
        is_known = track.vehicle.startswith(NOBODY) and self._is_somebody(seen)
        return None if is_known else seen

    def _is_somebody(self, seen: Seen) -> bool:
        """Return whether a car that spoke lately stands there; forget those who did not."""
        self._spoke = {
            who: one for who, one in self._spoke.items() if seen.t_ns - one.t_ns <= FRESH_NS
        }
        return any(
            math.dist((seen.x_m, seen.y_m), (one.x_m, one.y_m))
            < SAME_M + abs(one.speed_mps) * max(0, seen.t_ns - one.t_ns) / NS_PER_S
            for one in self._spoke.values()
        )
