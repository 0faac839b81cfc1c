"""The part that watches a gateway: whether the neighbouring city is there, and why not."""

from collections.abc import Callable, Sequence

from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.runtime.part import BasePart, Subscription
from scm.v2x.crossing import common_name, gateway_station
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.gateway import Border
from scm.v2x.mailbox import Mailbox
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.neighbour_status import NeighbourState, NeighbourStatus
from scm.v2x.messages.part_status import PartStatus

LOST_NS = 3 * NS_PER_S  # three statuses
REOPEN_NS = 5 * NS_PER_S
EVERY_NS = NS_PER_S


class GatewayPart(BasePart):
    """Reports the state of one neighbour.

    The neighbour is there when its own status arrives, which takes both gateways, both routers and
    their access rules.

    Args:
        border: Of its gateway.
        received: Statuses that the neighbour's gateway publishes.
        far_names: Returns the common names of who is linked now.
        refusal: Returns why a link was refused lately; empty: none was.
        reopen: Makes the links anew; called when one is there over which nothing comes.
    """

    role = "part"
    period_ns = 200 * NS_PER_MS
    subscriptions: Sequence[Subscription] = ()

    def __init__(
        self,
        border: Border,
        received: Mailbox,
        far_names: Callable[[], list[str | None]],
        refusal: Callable[[], str] = lambda: "",
        reopen: Callable[[], None] = lambda: None,
    ) -> None:
        self.name = gateway_station(border.neighbour)
        self._border = border
        self._received = received
        self._far_names = far_names
        self._refusal = refusal
        self._reopen = reopen
        self._works_ns: int | None = None
        self._state: NeighbourState = "waiting"
        self._since_ns: int | None = None
        self._received_ns: int | None = None
        self._sees: tuple[str, ...] = ()
        self._reason = ""
        self._reason_ns = 0
        self._reported: tuple[str, str] | None = None
        self._due_ns = 0

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Publish the state once a second, and at once when it changes."""
        del inbox
        for item in self._received.drain():
            if isinstance(item.message, NeighbourStatus):
                self._received_ns, self._sees = item.t_ns, item.message.shows
        is_there = self._received_ns is not None and now_ns - self._received_ns < LOST_NS
        before = self._state
        if is_there:
            self._change("joined", now_ns)
        elif self._state == "joined":
            self._change("lost", now_ns)
        elif self._since_ns is None:
            self._since_ns = now_ns
        reason = "" if is_there else self._why()
        self._check_link(now_ns, is_silent=not is_there and bool(self._far_names()))
        if reason != self._reason:
            self._reason, self._reason_ns = reason, now_ns
        out: list[Outgoing] = []
        if self._state != before or now_ns >= self._due_ns:
            self._due_ns = now_ns + EVERY_NS
            out += [self._status(now_ns), self._vital_signs(now_ns)]
        # A link that is being made has a new reason at each step: only one that lasts is an event.
        lasts = now_ns - self._reason_ns >= LOST_NS
        if (lasts or self._state != before) and (self._state, self._reason) != self._reported:
            self._reported = (self._state, self._reason)
            out.append(self._event(now_ns))
        return out

    def _change(self, state: NeighbourState, now_ns: int) -> None:
        if state != self._state:
            self._state, self._since_ns = state, now_ns

    def _check_link(self, now_ns: int, *, is_silent: bool) -> None:
        """Make the links anew when one is there for a while and carries nothing."""
        if not is_silent or self._works_ns is None:
            self._works_ns = now_ns
        elif now_ns - self._works_ns >= REOPEN_NS:
            self._works_ns = now_ns
            self._reopen()

    def _why(self) -> str:
        """Return why the neighbour is not joined, as far as its link shows."""
        border = self._border
        names = self._far_names()
        refusal = self._refusal()
        if not names and refusal:
            return refusal
        if not names:
            how = "waits at" if border.listens else "does not answer at"
            who = "this city" if border.listens else border.neighbour
            return f"no link: {who} {how} {border.endpoint}"
        expected = common_name(border.neighbour)
        strange = [name for name in names if name not in (None, expected)]
        if strange:
            return f"refused: the certificate is of {strange[0]!r}, expected {expected!r}"
        return "linked, but its city sends nothing"

    def _status(self, now_ns: int) -> NeighbourStatus:
        return NeighbourStatus(
            neighbour=self._border.neighbour,
            t_ns=now_ns,
            state=self._state,
            since_ns=now_ns if self._since_ns is None else self._since_ns,
            shows=self._border.shows,
            sees=self._sees if self._state == "joined" else (),
            reason=self._reason,
        )

    def _vital_signs(self, now_ns: int) -> PartStatus:
        """Return the line that the dashboard shows beside this station."""
        sees = ", ".join(self._sees) or "nothing but cars handed over"
        detail = f"joined, sees {sees}" if self._state == "joined" else self._state
        why = f": {self._reason}" if self._reason else ""
        return PartStatus(station=self.name, t_ns=now_ns, detail=detail + why)

    def _event(self, now_ns: int) -> CityEvent:
        city = self._border.neighbour
        why = f": {self._reason}" if self._reason else ""
        since_s = seconds(now_ns - (self._received_ns or now_ns))
        text = {
            "joined": f"{city} is joined",
            "lost": f"{city} is lost, nothing for {since_s:.0f} s{why}",
            "waiting": f"{city} is not joined yet{why}",
        }[self._state]
        return CityEvent(
            severity="info" if self._state == "joined" else "warning",
            source=self.name,
            t_ns=now_ns,
            name=f"neighbour_{self._state}",
            text=text,
        )
