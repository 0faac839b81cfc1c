"""One turn of a car's LIDAR: raw float32 ranges with a small header."""

from typing import ClassVar

from scm.v2x.message import Message


class LidarScan(Message, kw_only=True, frozen=True):
    """Ranges counter-clockwise from straight ahead, all of one instant.

    Attributes:
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


MESSAGE = LidarScan
