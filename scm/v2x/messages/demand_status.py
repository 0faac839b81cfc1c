"""How a demand table is served: who wanted to come, who came, who waits before the entries."""

from typing import ClassVar

from scm.v2x.message import Message


class DemandStatus(Message, kw_only=True, frozen=True):
    """Counts since the demand began.

    Attributes:
        time_of_day_s: Of the table, at `t_ns`.
        wanted: Cars whose time has come; `entered` those put onto the map, `arrived` those whose
            trip ended, `refused` those that the city would not have.
        queued: Cars that wait for room at their entry; `longest_queue` the most that ever did.
        waited_s: Mean wait at the entry of those that entered.
        travel_s: Mean time of the trips that ended.
    """

    KEY: ClassVar[str] = "demand/status"
    RATE_HZ: ClassVar[float | None] = 1.0

    t_ns: int
    time_of_day_s: float
    wanted: int
    entered: int
    arrived: int
    refused: int
    queued: int
    longest_queue: int
    waited_s: float
    travel_s: float


MESSAGE = DemandStatus
