"""How a part of the city is doing: its own heartbeat, sent by the loop that does its work."""

from typing import ClassVar

from scm.v2x.message import Message


class PartStatus(Message, kw_only=True, frozen=True):
    """Vital signs of one part.

    Attributes:
        detail: One line for a person: `6 cars`, `plan calm`, `7 tags`.
        steps: Steps that were made, since its start; 0: not reported.
        late_steps: Steps that were due and left out, for the one before them took too long.
        dropped: Messages its mailboxes had to drop.
        cars: Of the world: how many are on the map.
        lost_s: Of the world: time that passed without being simulated, since its start.
    """

    KEY: ClassVar[str] = "part/{station}/status"
    RATE_HZ: ClassVar[float | None] = 1.0

    station: str
    t_ns: int
    detail: str = ""
    step_ms: float = 0.0
    steps: int = 0
    late_steps: int = 0
    dropped: int = 0
    cars: int = 0
    lost_s: float = 0.0


MESSAGE = PartStatus
