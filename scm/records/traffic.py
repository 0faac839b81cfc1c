"""Counts of traffic, and violations."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.fields import (
    XM,
    YM,
    AtM,
    JunctionName,
    LaneName,
    Number,
    Passed,
    SourceName,
    SpeedMps,
    Text,
    TNs,
    VehicleName,
    VoidReasons,
    WindowS,
    YawRad,
)
from scm.records.signals import SignalGroup

Kind = Literal["red_light", "stop_line", "speed", "wrong_way", "collision"]


class LaneCount(msgspec.Struct, kw_only=True, frozen=True):
    """Cars that passed the counting place of a lane, in the window.

    Attributes:
        flow_hz: Cars a second; times 3600: an hour.
        headway_s: Mean time from one to the next.
        speed_mps: Mean, where they passed.
    """

    lane: LaneName
    passed: Passed
    flow_hz: float
    headway_s: float | None = None
    speed_mps: SpeedMps | None = None


class ApproachCount(msgspec.Struct, kw_only=True, frozen=True):
    """One lane that leads to a line before a junction; means are over the window.

    Attributes:
        flow_hz: Cars a second; times 3600: an hour.
        headway_s: Mean time from one car to the next [s].
        delay_s: Mean control delay: from entering the lane to leaving the junction, beyond what
            that takes at the limits.
        level: HCM's level of service of that delay, `A` to `F`; empty: no car passed yet.
        stops: Mean number of stops of a car.
        queue: Cars that stand before the line now; `queue_m`: from the line to the tail of the
            last; `queue_most`: 95 % of the time no more.
        queue_m: From the line to the tail of the last car that stands [m].
        queue_most: Cars in the queue: 95 % of the time no more.
        saturation_headway_s: Mean headway of cars that leave a queue one after another.
        saturation: Flow over what could pass in the green time; None: too few have queued.
    """

    junction: JunctionName
    lane: LaneName
    passed: Passed
    flow_hz: float
    headway_s: float | None = None
    speed_mps: SpeedMps | None = None
    delay_s: float | None = None
    level: Annotated[str, Meta(examples=["B"])] = ""
    stops: float = 0.0
    queue: int = 0
    queue_m: float = 0.0
    queue_most: int = 0
    saturation_headway_s: float | None = None
    saturation: float | None = None


class EvidencePose(msgspec.Struct, kw_only=True, frozen=True):
    """Where a car was seen: the rear axle, map frame."""

    t_ns: TNs
    x_m: XM
    y_m: YM
    yaw_rad: YawRad
    speed_mps: SpeedMps


class TrackPoint(EvidencePose, kw_only=True, frozen=True):
    """Where the car was estimated to be; `source` reported it."""

    source: SourceName


class TrafficCounts(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """All lanes on which somebody was counted, and all approaches; over the last `window_s`.

    Attributes:
        lanes: Lanes.
    """

    t_ns: TNs
    window_s: WindowS
    lanes: tuple[LaneCount, ...] = ()
    approaches: tuple[ApproachCount, ...] = ()


class Counts(TrafficCounts, kw_only=True, frozen=True):
    """Counts of the observer.

    Attributes:
        void: Why the window's counts, delays and queues do not count for plans; none: they
            do.
    """

    void: VoidReasons = ()


class Violation(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """One event: published once, however long it lasts.

    Attributes:
        number: Counts the violations of this observer, from 1.
        kind: Of which sort it is.
        lane: Where it happened; empty: on no lane.
        at_m: Where along that lane the rear axle was.
        text: One sentence with what was allowed and what was done.
        certainty: That it was beyond what is allowed, from the doubt of the poses; 0 to 1.
        sources: Sources of the poses, and of what was shown: `eye`, `self`, `spat`, `contact`.
        junction, signal: Whose signal, and what its group showed then.
        against: In a collision: names of cars, or `wall`.
        track: The seconds before, oldest first.
    """

    vehicle: VehicleName
    number: Number
    kind: Kind
    t_ns: TNs
    x_m: XM
    y_m: YM
    lane: LaneName = ""
    at_m: AtM = 0.0
    text: Text
    certainty: float
    sources: Annotated[tuple[str, ...], Meta(examples=[["eye", "spat"]])]
    junction: JunctionName = ""
    signal: SignalGroup | None = None
    against: Annotated[tuple[str, ...], Meta(examples=[["n2"]])] = ()
    track: tuple[TrackPoint, ...] = ()


class Violations(msgspec.Struct, kw_only=True, frozen=True):
    """Broken rules.

    Attributes:
        violations: Newest first.
    """

    violations: tuple[Violation, ...]
