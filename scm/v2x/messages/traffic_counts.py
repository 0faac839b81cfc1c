"""Traffic as estimated poses show it: counts per lane, and per approach of a junction."""

from typing import ClassVar

from scm.records import traffic
from scm.v2x.message import Delivery, Message


class TrafficCounts(traffic.TrafficCounts, Message, kw_only=True, frozen=True):
    """All lanes on which somebody was counted, and all approaches; over the last `window_s`."""

    KEY: ClassVar[str] = "traffic/counts"
    RATE_HZ: ClassVar[float | None] = 0.2
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT


MESSAGE = TrafficCounts
