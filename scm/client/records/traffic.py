"""Records of traffic.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec


class LaneCount(msgspec.Struct, kw_only=True, frozen=True):
    """Cars that passed the counting place of a lane, in the window.

    Attributes:
        lane: Name of a lane.
        passed: Cars that passed, in the window.
        flow_hz: Cars a second; times 3600: an hour.
        headway_s: Mean time from one to the next.
        speed_mps: Mean, where they passed.
    """

    lane: str
    passed: int
    flow_hz: float
    headway_s: float | None = None
    speed_mps: float | None = None


class ApproachCount(msgspec.Struct, kw_only=True, frozen=True):
    """One lane that leads to a line before a junction; means are over the window.

    Attributes:
        junction: Name of a junction.
        lane: Name of a lane.
        passed: Cars that passed, in the window.
        flow_hz: Cars a second; times 3600: an hour.
        headway_s: Mean time from one car to the next [s].
        speed_mps: Speed, + = forward [m/s].
        delay_s: Mean control delay: from entering the lane to leaving the junction, beyond what
            that takes at the limits.
        level: HCM's level of service of that delay, `A` to `F`; empty: nobody passed yet.
        stops: Mean number of stops of a car.
        queue: Cars that stand before the line now; `queue_m`: from the line to the tail of the
            last; `queue_most`: 95 % of the time no more.
        queue_m: From the line to the tail of the last car that stands [m].
        queue_most: Cars in the queue: 95 % of the time no more.
        saturation_headway_s: Mean headway of cars that leave a queue one after another.
        saturation: Flow over what could pass in the green time; None: too few have queued.
    """

    junction: str
    lane: str
    passed: int
    flow_hz: float
    headway_s: float | None = None
    speed_mps: float | None = None
    delay_s: float | None = None
    level: str = ""
    stops: float = 0.0
    queue: int = 0
    queue_m: float = 0.0
    queue_most: int = 0
    saturation_headway_s: float | None = None
    saturation: float | None = None


class Counts(msgspec.Struct, kw_only=True, frozen=True):
    """Counts of the observer.

    Attributes:
        t_ns: When it was true, by the clock of who tells it [ns].
        window_s: Over how long it was counted [s].
        lanes: Lanes.
        approaches: One lane that leads to a line before a junction; means are over the window.
        void: Why the window's counts, delays and queues say nothing of plans, in words; none: they
            do.
    """

    t_ns: int
    window_s: float
    lanes: tuple[LaneCount, ...] = ()
    approaches: tuple[ApproachCount, ...] = ()
    void: tuple[str, ...] = ()


class SignalGroup(msgspec.Struct, kw_only=True, frozen=True):
    """One group of heads that always show the same.

    Attributes:
        group: Name of a signal group: heads that always show the same.
        colour: Colour.
        since_ns: Since when [ns].
        min_end_ns: The colour will not change before; never moves earlier.
        max_end_ns: It will have changed by then, never moves later; None: not known.
        next_colour: What comes then; None: not known.
        likely_end_ns: A forecast between the two, no promise: it moves as cars come. None: nobody
            knows.
        likely_confidence: The share of such forecasts that come true within a second, 0 to 1.
    """

    group: str
    colour: Literal["dark", "flashing_red", "green", "red", "yellow"]
    since_ns: int
    min_end_ns: int
    max_end_ns: int | None = None
    next_colour: Literal["dark", "flashing_red", "green", "red", "yellow"] | None = None
    likely_end_ns: int | None = None
    likely_confidence: float | None = None


class TrackPoint(msgspec.Struct, kw_only=True, frozen=True):
    """Where the car was believed to be: rear axle, map frame; `source` says who told it.

    Attributes:
        t_ns: When it was true, by the clock of who tells it [ns].
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        speed_mps: Speed, + = forward [m/s].
        source: Who told it.
    """

    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    source: str


class Violation(msgspec.Struct, kw_only=True, frozen=True):
    """One event: told once, however long it lasts.

    Attributes:
        vehicle: Name of a car.
        number: Counts the violations that this observer has told, from 1.
        kind: Of which sort it is.
        t_ns: When it was true, by the clock of who tells it [ns].
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        lane: Where it happened; empty: on no lane.
        at_m: Where along that lane the rear axle was.
        text: One sentence with what was allowed and what was done.
        certainty: That it was beyond what is allowed, from the doubt of the poses; 0 to 1.
        sources: Who told the poses, and what was shown: `eye`, `self`, `spat`, `contact`.
        junction: Whose signal, and what its group showed then.
        signal: Whose signal, and what its group showed then.
        against: In a collision: names of cars, or `wall`.
        track: The seconds before, oldest first.
    """

    vehicle: str
    number: int
    kind: Literal["collision", "red_light", "speed", "stop_line", "wrong_way"]
    t_ns: int
    x_m: float
    y_m: float
    lane: str = ""
    at_m: float = 0.0
    text: str
    certainty: float
    sources: tuple[str, ...]
    junction: str = ""
    signal: SignalGroup | None = None
    against: tuple[str, ...] = ()
    track: tuple[TrackPoint, ...] = ()


class Violations(msgspec.Struct, kw_only=True, frozen=True):
    """Broken rules.

    Attributes:
        violations: Newest first.
    """

    violations: tuple[Violation, ...]
