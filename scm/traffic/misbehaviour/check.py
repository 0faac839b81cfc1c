"""The contract of a check: its inputs, and the plausibility that it returns.

A check returns how plausible a claim is, 0..1, or None where it does not apply. An honest car makes
a claim of plausibility p with that probability at most.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from scm import registry
from scm.geometry import wrap_angle
from scm.traffic.misbehaviour.claim import Claim
from scm.traffic.misbehaviour.ground import Ground
from scm.traffic.misbehaviour.kalman import Kalman
from scm.traffic.misbehaviour.limits import Limits
from scm.v2x.messages.eye_track import EyeTrack

CHECKS = "scm.traffic.misbehaviour.checks"
SEEN_WITHIN_S, TRACK_LAG_S = 0.2, 1.0  # a camera's view that is fresh; how slowly a track stops
NEWCOMER_S = 3.0  # after a car came; the Eye still searches for its tag
HARD_DRIVING_S = 3.0  # after driving by hand or a stop of the city, hard limits still apply
CONFIRMED = 0.05  # plausibility from which the Eye confirms a position
Class = Literal["beacon", "static", "security", "position", "speed", "longAcc"]
"""The classes of observations of ETSI TS 103 759."""


class Strayed:
    """How far a station's path deviates from its speeds, with exponential forgetting.

    Attributes:
        last_m: Of the last claim alone, + = went farther than claimed.
        sum_m: Of the last `WINDOW_S`, faded; `over_s` is their faded time.
        variance_m2: Of `sum_m`, as the speed may change at any time between two claims: uniform,
            of width |v1 - v0| dt. Large where claims were lost.
    """

    WINDOW_S = 5.0
    __slots__ = ("last_m", "over_s", "sum_m", "variance_m2")

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Start anew."""
        self.last_m = self.sum_m = self.over_s = self.variance_m2 = 0.0

    def add(self, now: Claim, before: Claim, dt_s: float, front_share: float) -> None:
        """Add the path between two claims; restart where a heading or speed is missing."""
        (x1, y1), (x0, y0) = now.rear(front_share), before.rear(front_share)
        yaw0, yaw1, v0, v1 = before.yaw_rad, now.yaw_rad, before.speed_mps, now.speed_mps
        if yaw0 is None or yaw1 is None or v0 is None or v1 is None:
            self.begin()
            return
        yaw = yaw0 + wrap_angle(yaw1 - yaw0) / 2.0
        way = (x1 - x0) * math.cos(yaw) + (y1 - y0) * math.sin(yaw)
        self.last_m = way - (v1 + v0) / 2.0 * dt_s
        fade = math.exp(-dt_s / self.WINDOW_S)
        width = (v1 - v0) * dt_s
        self.variance_m2 = self.variance_m2 * fade * fade + width * width / 12.0
        self.sum_m, self.over_s = self.sum_m * fade + self.last_m, self.over_s * fade + dt_s


class Sender(NamedTuple):
    """What the city knows of the sender of a CAM, see `CamRx`; no sender can write it."""

    car: str = ""
    by_hand: bool = False
    stopped: bool = False
    touches: bool = False


class Standing(NamedTuple):
    """The score of a station, see `fusion`, and since when it is known [ns]."""

    score: float
    since_ns: int


@dataclass(slots=True)
class Case:
    """One claim and all that it may be compared with.

    Attributes:
        now: The claim to be judged.
        before: The station's claim before it; None: its first.
        dt_s: Between these two, by their time stamps; 0 for the first.
        driven_s: Of that, how long the car was moved: all of it, unless its computer was too slow.
        since_lost_s: Since time passed last without the car being moved; inf: it never did.
        gap_s: Between their arrivals.
        kalman: The station's filter, with `now` in it.
        neighbours: Newest claims of stations around it that are not older than a second or so.
        strayed: The station's path against its speeds, with `now` in it.
        standings: By station number.
        track: The Eye's track of this very car, fresh; None: it has none.
        is_tag_unseen: Whether it is a car of the city whose tag no camera has ever seen.
        is_new: Whether it is a car of the city that came within `NEWCOMER_S`.
        is_hard: Whether it is driven by hand, or the city is stopped, now or within
            `HARD_DRIVING_S`: by what the city knows. `limits` are the hard ones then.
        unseen_s: From when a camera last saw that car to the claim, either way.
        nearest_track_m: From the claimed rear axle to any fresh track; inf: there is none near.
        eye_sees: Whether the Eye works and overlooks the place.
        since_start_s: How long the detector has received CAMs.
        idle: Claims in a row that came fast although nothing had changed.
        is_own_number: Whether the number in the CAM is that of the station that sent it.
        touches: Whether another car, by its claim or by the Eye, is so near that they may push each
            other; costly, so call it only for an implausible claim.
    """

    now: Claim
    limits: Limits
    ground: Ground
    before: Claim | None = None
    dt_s: float = 0.0
    driven_s: float = 0.0
    since_lost_s: float = float("inf")
    gap_s: float = 0.0
    kalman: Kalman = field(default_factory=Kalman)
    neighbours: tuple[Claim, ...] = ()
    strayed: Strayed = field(default_factory=Strayed)
    standings: dict[int, Standing] = field(default_factory=dict)
    track: EyeTrack | None = None
    is_tag_unseen: bool = False
    is_new: bool = False
    is_hard: bool = False
    unseen_s: float = 0.0
    nearest_track_m: float = float("inf")
    eye_sees: bool = False
    since_start_s: float = 0.0
    idle: int = 0
    is_own_number: bool = True
    touches: Callable[[], bool] = lambda: False

    @property
    def eye_may_deny(self) -> bool:
        """Whether the Eye can contradict the car; an older view can only confirm it.

        The Eye predicts a track from its last view, and needs some more to see that a car stands.
        """
        return self.unseen_s <= SEEN_WITHIN_S and self.since_lost_s >= TRACK_LAG_S


@dataclass(frozen=True, slots=True)
class Check:
    """One check.

    Attributes:
        judge: Returns the plausibility of a case.
        kind: Its class of observations.
        floor: The least plausibility that counts: alone it must not cause a report.
        witnessed: Whether an Eye that confirms the position overrules it.
        name: Filled in by `load_checks`.
    """

    judge: Callable[[Case], float | None]
    kind: Class
    floor: float = 1e-9
    witnessed: bool = False
    name: str = ""


def load_checks() -> tuple[Check, ...]:
    """Return all checks, by name."""
    loaded = [
        (name, registry.load(CHECKS, name, "CHECK", Check)) for name in registry.names(CHECKS)
    ]
    return tuple(Check(one.judge, one.kind, one.floor, one.witnessed, name) for name, one in loaded)
