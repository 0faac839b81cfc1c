"""One sweep of a car's LIDAR: raw float32 ranges with a small header."""

from typing import ClassVar

from scm.v2x.message import Message


class LidarScan(Message, kw_only=True, frozen=True):
    """Ranges counter-clockwise about the scanner.

    Attributes:
        t_ns: When the last of the beams looked.
        bearing_first_rad: Where beam 0 looks, 0 is straight ahead, + = left.
        bearing_step_rad: From each beam to the next; None: a full circle shared out evenly.
        sweep_ns: From when the first beam looked to when the next would after the last, so that
            `sweep_ns / beams` lie between two; 0: all look at once. None: not known.
        period_ns: From each sweep to the next; None: not known.
        clockwise: Whether the last beam of the payload looked first.
        payload: Little-endian float32, one range a beam [m]; infinity is a miss.
    """

    KEY: ClassVar[str] = "v/{vehicle}/scan"
    RATE_HZ: ClassVar[float | None] = 7.0

    vehicle: str
    t_ns: int
    beams: int
    range_min_m: float
    range_max_m: float
    payload: bytes
    bearing_first_rad: float = 0.0
    bearing_step_rad: float | None = None
    sweep_ns: int | None = None
    period_ns: int | None = None
    clockwise: bool = False

    @property
    def beam_ns(self) -> float:
        """From when one beam looked to when the next did; 0 where that is not known."""
        return max(0, self.sweep_ns or 0) / max(1, self.beams)


MESSAGE = LidarScan
