"""The link to a neighbouring city, as its gateway sees it; the neighbour receives it, too."""

from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from scm.records.fields import TNs
from scm.v2x.message import Message

NeighbourState = Literal["waiting", "joined", "lost"]


class NeighbourStatus(Message, kw_only=True, frozen=True):
    """Repeated at 1 Hz and sent at once on change.

    Attributes:
        neighbour: The other city.
        state: `waiting`: not joined since the gateway started; `lost`: joined before, not now.
        since_ns: When this state began [ns].
        shows: What this city shows the neighbour, names of `messages` in its map.
        sees: What the neighbour shows, by its own report; empty: nothing, or it is not there.
        reason: Why it is not joined, as a sentence; empty: it is, or nothing is known.
    """

    KEY: ClassVar[str] = "neighbour/{neighbour}"
    RATE_HZ: ClassVar[float | None] = 1.0

    neighbour: str
    t_ns: TNs
    state: NeighbourState
    since_ns: int
    shows: Annotated[tuple[str, ...], Meta(examples=[["states", "cams"]])] = ()
    sees: Annotated[tuple[str, ...], Meta(examples=[["states"]])] = ()
    reason: str = ""


MESSAGE = NeighbourStatus
