"""A station came or went: made by the bus from liveliness, never sent by a part."""

from typing import ClassVar

from scm.v2x.message import Delivery, Message


class Presence(Message, kw_only=True, frozen=True):
    """A station is there, or no longer.

    Attributes:
        role: `v` for vehicles, `part` for parts of the city, `client` for scripts and tools.
        station: Its name.
        session: Which run of it: two processes of one name have two sessions.
        alive: False when it left, died, or has been silent for longer than the transport's lease.
    """

    KEY: ClassVar[str] = "{role}/{station}/alive/{session}"
    DELIVERY: ClassVar[Delivery] = Delivery.PRESENCE

    role: str
    station: str
    session: str
    alive: bool


MESSAGE = Presence
