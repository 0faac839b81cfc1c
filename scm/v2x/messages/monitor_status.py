"""What the second channel thinks of a junction's signals; a fault is latched until reset."""

from typing import ClassVar

from scm.records.fields import Detail, FaultName, JunctionName, TNs
from scm.v2x.message import Delivery, Message


class MonitorStatus(Message, kw_only=True, frozen=True):
    """The monitor's verdict, repeated at 2 Hz and at once on change.

    Attributes:
        fault: None while all is well; else `conflict`, `dark`, `short_yellow`, `short_clearance`,
            `short_green`, `skipped_yellow`, `stale`, `clock_jump`; or `overload`, which ends
            by itself.
        detail: What was seen, in words.
        since_ns: Of the fault, or of the last reset.
    """

    KEY: ClassVar[str] = "tl/{junction}/mon"
    RATE_HZ: ClassVar[float | None] = 2.0
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT

    junction: JunctionName
    t_ns: TNs
    fault: FaultName | None
    detail: Detail = ""
    since_ns: int


MESSAGE = MonitorStatus
