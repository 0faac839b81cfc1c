"""How the radio does: once a second what became of frames, and how busy the channel is."""

from typing import ClassVar

from scm.v2x.message import Message


class RadioStatus(Message, kw_only=True, frozen=True):
    """The last second of radio traffic, to all stations but hosted cars that drive themselves.

    Attributes:
        sent: Frames; one that two stations receive counts once here and twice in `delivered`.
        delivered: To a station that received it.
        out_of_range: Not received: too far away.
        by_chance: Lost whatever the distance.
        by_distance: Lost to fading and walls.
        by_load: Lost to collisions, or never sent because the channel is full.
        unknown: Frames of senders at an unknown place.
        late: Delivered later than at once.
        late_ms: Their mean delay; 0: none was late.
        waiting: On their way now.
        busy_mean: Share of time that the channel is busy, mean of all stations; 0: not measured.
        busy_most: Of the station that receives most.
        stations: Those that are not hosted cars that drive themselves; `busy` of each.
    """

    KEY: ClassVar[str] = "world/radio"
    RATE_HZ: ClassVar[float | None] = 1.0

    t_ns: int
    sent: int = 0
    delivered: int = 0
    out_of_range: int = 0
    by_chance: int = 0
    by_distance: int = 0
    by_load: int = 0
    unknown: int = 0
    late: int = 0
    late_ms: float = 0.0
    waiting: int = 0
    busy_mean: float = 0.0
    busy_most: float = 0.0
    stations: tuple[str, ...] = ()
    busy: tuple[float, ...] = ()


MESSAGE = RadioStatus
