"""What traffic does, counted from believed poses: per lane, and per approach of a junction."""

from typing import ClassVar

import msgspec

from scm.v2x.message import Delivery, Message


class LaneCount(msgspec.Struct, kw_only=True, frozen=True):
    """Cars that passed the counting place of a lane, in the window.

    Attributes:
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
        delay_s: Mean control delay: from entering the lane to leaving the junction, beyond what
            that takes at the limits.
        level: HCM's level of service of that delay, `A` to `F`; empty: nobody passed yet.
        stops: Mean number of stops of a car.
        queue: Cars that stand before the line now; `queue_m`: from the line to the tail of the
            last; `queue_most`: 95 % of the time no more.
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


class TrafficCounts(Message, kw_only=True, frozen=True):
    """All lanes on which somebody was counted, and all approaches; over the last `window_s`."""

    KEY: ClassVar[str] = "traffic/counts"
    RATE_HZ: ClassVar[float | None] = 0.2
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT

    t_ns: int
    window_s: float
    lanes: tuple[LaneCount, ...] = ()
    approaches: tuple[ApproachCount, ...] = ()


MESSAGE = TrafficCounts
