"""Clear a latched monitor fault: by a person, with a reason."""

from typing import ClassVar

from scm.v2x.message import Message, Request
from scm.v2x.messages.monitor_status import MonitorStatus


class MonitorReset(Request, kw_only=True, frozen=True):
    """Request that the monitor of a junction clears its fault."""

    KEY: ClassVar[str] = "tl/{junction}/mon/reset"
    REPLY: ClassVar[type[Message]] = MonitorStatus
    SERVER: ClassVar[str] = "the monitor of junction {junction}"

    junction: str
    by: str
    reason: str


MESSAGE = MonitorReset
