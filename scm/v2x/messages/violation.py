"""A rule of the road was broken, with the evidence for it."""

from typing import ClassVar

from scm.records import traffic
from scm.v2x.message import Delivery, Message


class Violation(traffic.Violation, Message, kw_only=True, frozen=True):
    """One event: published once, however long it lasts."""

    KEY: ClassVar[str] = "violation/{vehicle}"
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT
    HISTORY_DEPTH: ClassVar[int] = 20


MESSAGE = Violation
