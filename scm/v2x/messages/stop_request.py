"""Request the city stop: every car stops; or release it."""

from typing import ClassVar

from scm.v2x.message import Message, Request
from scm.v2x.messages.city_stop import CityStop


class StopRequest(Request, kw_only=True, frozen=True):
    """Engage or release the city-wide stop; answered by the world with the new state."""

    KEY: ClassVar[str] = "world/stop_request"
    REPLY: ClassVar[type[Message]] = CityStop
    SERVER: ClassVar[str] = "the world"

    engaged: bool
    by: str
    reason: str = ""


MESSAGE = StopRequest
