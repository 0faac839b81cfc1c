"""The contract of a part of the city: a steppable object without thread, clock or bus.

A part says what it hears and what it serves; a runner (`scm.runtime.live` or
`scm.runtime.lockstep`) ties it to a bus and a clock. Because a part only ever sees `now_ns` and its
inbox, the same object runs live in a process of its own, and deterministically beside all the
others on a stepped clock.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.message import Message, Request


@dataclass(frozen=True, slots=True)
class Hears:
    """A wish to receive: a message class, and values for the variable parts of its key.

    A key part left out of `where` matches everything: `Hears(VehicleState)` hears every vehicle,
    `Hears(VehicleState, {"vehicle": "n7"})` hears one. With `once`, of copies that differ in the
    first variable part of their key alone (who received them), only the first is brought.
    """

    kind: type[Message]
    where: dict[str, str] = field(default_factory=dict)
    once: bool = False


@dataclass(frozen=True, slots=True)
class Serves:
    """An offer to answer requests of a class whose key parts match `where`."""

    kind: type[Request]
    where: dict[str, str] = field(default_factory=dict)


class IsWanted(Protocol):
    """Tells a part whether anybody would hear what it could send."""

    def __call__(self, kind: type[Message], where: Mapping[str, str]) -> bool:
        """Return whether anybody subscribes to messages of a class with these key parts.

        Key parts left out match everything, as in `Hears`.
        """
        ...


class Part(Protocol):
    """A steppable part of the city.

    One that also sets `hears_raw = True` gets every message of the city, unread, as `RawSample`;
    `hears_raw_too`, a list of `Hears`, adds those that come only to who names them. Without
    `hears_raw` it gets these alone.

    One that also has `learn_wishes(is_wanted)` is given an `IsWanted` before its first step: what
    is costly to make need not be made for nobody.
    """

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
    def hears(self) -> Sequence[Hears]:
        """What the runner subscribes to for it; when it changes, the runner follows."""
        ...

    @property
    def serves(self) -> Sequence[Serves]:
        """Which requests the runner brings to it."""
        ...

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Advance to `now_ns`, having received `inbox` in order of arrival; return what to send."""
        ...

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Say last words before the runner closes the bus; called once."""
        ...
