"""Bases of radio messages: the world carries what a station sends to those in range."""

from typing import Generic, TypeVar

from scm.v2x.message import Message

B = TypeVar("B")


class Sent(Message, Generic[B], kw_only=True, frozen=True):
    """A message leaves a station's antenna at `t_ns`."""

    station: str
    t_ns: int
    body: B


class Received(Message, Generic[B], kw_only=True, frozen=True):
    """A message reaches a station.

    Attributes:
        receiver: Who receives it.
        station: Who sent it.
        t_ns: When it was sent.
    """

    receiver: str
    station: str
    t_ns: int
    body: B
