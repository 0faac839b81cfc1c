"""Signal phase and timing of a junction, native form: colours and guaranteed change times."""

from typing import ClassVar

from scm.records.signals import SignalGroup
from scm.v2x.message import Message


class Spat(Message, kw_only=True, frozen=True):
    """All groups of one junction at `t_ns`.

    Attributes:
        mode: `plan`, `start` (all red after start) or `flash` (monitor or operator).
        plan: Name of the plan in force.
        revision: Of the junction's map; cars compare it with theirs.
    """

    KEY: ClassVar[str] = "tl/{junction}/spat"
    RATE_HZ: ClassVar[float | None] = 10.0

    junction: str
    t_ns: int
    seq: int
    mode: str
    plan: str
    groups: tuple[SignalGroup, ...]
    revision: int = 1


MESSAGE = Spat
