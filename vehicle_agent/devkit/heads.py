"""A script's lights as an operator's requests: it may request a colour and never sets one.

    3 green    hold and call: the group turns green when that is safe, and stays green
    1 red      omit and force off: the green ends when it may, and no other begins
    2 yellow   nothing: yellow comes by itself between the two
    0          no request: an earlier one is cleared

Heads of one group are one request, red before green; a script that sets them against each other is
warned once. A request is renewed while the script maintains it, expires within half a minute when
it does not, and is cleared when the script leaves. A refusal by the junction is logged once.
"""

import logging
from collections.abc import Sequence

from scm.clock import NS_PER_S
from scm.log import event
from scm.records.signals import Verb
from scm.v2x.exchange import Call
from scm.v2x.message import Message, Refused
from scm.v2x.messages.signal_request import SignalRequest

RED, YELLOW, GREEN = 1, 2, 3
EXPIRES_S = 30.0
RENEW_NS = 10 * NS_PER_S
REQUEST_TIMEOUT_S = 1.0
REASON = "a Devkit script says so"
_VERBS: dict[int, tuple[Verb, ...]] = {GREEN: ("hold", "call"), RED: ("omit", "force_off")}

_log = logging.getLogger(__name__)


class Heads:
    """The lights TL1, TL2... of a script.

    Args:
        by: Who requests: the bridge's station.
    """

    def __init__(self, by: str) -> None:
        self._by = by
        self._heads: tuple[tuple[str, str], ...] = ()
        self._requested: dict[tuple[str, str], int] = {}
        self._renew_ns = 0
        self._warned: set[str] = set()

    def learn(self, heads: Sequence[tuple[str, str]]) -> None:
        """Set the lights, by junction and group."""
        self._heads = tuple(heads)

    def step(self, now_ns: int, states: Sequence[int | None]) -> list[Call]:
        """Return the requests that are due.

        Args:
            now_ns: Now.
            states: By light, as the script numbers colours; None: not set.
        """
        requested: dict[tuple[str, str], int] = {}
        for head, state in zip(self._heads, states, strict=False):
            if state not in _VERBS:
                continue
            if requested.get(head, state) != state:
                junction, group = head
                self._warn(
                    f"lights of group {group} of {junction} are set to red and to green: they are "
                    "one group and show the same, so the red counts"
                )
            if requested.get(head) != RED:
                requested[head] = state
        changed = requested != self._requested
        if not changed and (not requested or now_ns < self._renew_ns):
            return []
        before, self._requested = self._requested, requested
        self._renew_ns = now_ns + RENEW_NS
        if not changed:
            return self._requests(requested)
        gone = {head: state for head, state in before.items() if requested.get(head) != state}
        return self._clears(gone) + self._requests(requested)

    def release(self) -> list[Call]:
        """Return the requests that clear all."""
        out = self._clears(self._requested)
        self._requested = {}
        return out

    def replied(self, request: SignalRequest, reply: Message) -> None:
        """Process the reply to a request."""
        if isinstance(reply, Refused):
            self._warn(reply.detail)

    def _warn(self, why: str) -> None:
        """Log a warning once."""
        if why not in self._warned and len(self._warned) < 100:
            self._warned.add(why)
            event(_log, "devkit_light", level=logging.WARNING, why=repr(why))

    def _clears(self, requested: dict[tuple[str, str], int]) -> list[Call]:
        by_junction: dict[str, list[str]] = {}
        for junction, group in requested:
            by_junction.setdefault(junction, []).append(group)
        return [self._call(junction, "clear", groups) for junction, groups in by_junction.items()]

    def _requests(self, requested: dict[tuple[str, str], int]) -> list[Call]:
        """Request reds first, so that no green is requested beside what must end for it."""
        out = []
        for colour in (RED, GREEN):
            for (junction, group), state in requested.items():
                if state == colour:
                    out += [self._call(junction, verb, [group]) for verb in _VERBS[colour]]
        return out

    def _call(self, junction: str, verb: Verb, groups: Sequence[str]) -> Call:
        request = SignalRequest(
            junction=junction,
            verb=verb,
            groups=tuple(groups),
            by=self._by,
            reason=REASON,
            expires_s=EXPIRES_S,
        )
        return Call(request, REQUEST_TIMEOUT_S)
