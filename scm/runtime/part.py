"""The contract of a part of the city: a steppable object without thread, clock or bus.

A part names its subscriptions and services; a runner (`scm.runtime.live` or `scm.runtime.lockstep`)
connects it to a bus and a clock. A part only ever sees `now_ns` and its inbox, so the same object
runs live in its own process, and deterministically next to all others on a stepped clock.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.message import Message, Request


@dataclass(frozen=True, slots=True)
class Subscription:
    """What a part receives: a message class, and values for the variable parts of its key.

    A key part left out of `where` matches everything: `Subscription(VehicleState)` is every
    vehicle, `Subscription(VehicleState, {"vehicle": "n7"})` is one.

    Attributes:
        kind: The message class.
        where: Values of variable key parts.
        once: Of copies that differ only in the first variable part of their key (the receiver),
            bring only the first.
        raw: Bring messages undecoded, as `RawSample`. `Subscription(Message, raw=True)` is every
            message of the city, except those with a verbatim chunk (`@camera`) in their key.
    """

    kind: type[Message]
    where: dict[str, str] = field(default_factory=dict)
    once: bool = False
    raw: bool = False


@dataclass(frozen=True, slots=True)
class Service:
    """The requests that a part answers: a class, and the key parts that must match `where`."""

    kind: type[Request]
    where: dict[str, str] = field(default_factory=dict)


class IsWanted(Protocol):
    """A function of the bus that reports whether a message has subscribers."""

    def __call__(self, kind: type[Message], where: Mapping[str, str]) -> bool:
        """Return whether anybody subscribes to messages of a class with these key parts.

        Key parts left out match everything, as in `Subscription`.
        """
        ...


class Part(Protocol):
    """A steppable part of the city; `BasePart` has the members that many parts do not need."""

    @property
    def name(self) -> str:
        """The station's name on the bus: `world`, `traffic`, `eye`, `n7`."""
        ...

    @property
    def role(self) -> str:
        """The first chunk of its presence key: `part`, or `v` for a vehicle."""
        ...

    @property
    def period_ns(self) -> int:
        """How often `step` is due [ns]."""
        ...

    @property
    def subscriptions(self) -> Sequence[Subscription]:
        """What the part receives; the runner follows changes at every step."""
        ...

    @property
    def services(self) -> Sequence[Service]:
        """Which requests the part answers."""
        ...

    def attach(self, is_wanted: IsWanted) -> None:
        """Learn, before the first step, how to check for subscribers: costly messages can wait."""
        ...

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Advance to `now_ns`, having received `inbox` in order of arrival; return what to send."""
        ...

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Return the last messages before the runner closes the bus; called once."""
        ...


class BasePart:
    """Defaults for a part that answers nothing, sends everything, and has no last messages."""

    services: Sequence[Service] = ()

    def attach(self, is_wanted: IsWanted) -> None:
        """Ignore who subscribes."""

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Leave without a message: presence reports it."""
        del now_ns
        return []
