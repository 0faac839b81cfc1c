"""A script's lights as an operator's wishes: it may ask for a colour and never sets one.

    3 green    hold and call: the group turns green when that is safe, and stays green
    1 red      omit and force off: the green ends when it may, and no other begins
    2 yellow   nothing: yellow comes by itself between the two
    0          no wish: what was wished is taken back

Heads of one group are one wish, red before green; a script that sets them against each other is
warned once. A wish is renewed while the script keeps to it,
lapses by itself within half a minute when it does not, and is taken back when the script goes.
What the junction refuses is told once, in its words.
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
LAPSE_S = 30.0
RENEW_NS = 10 * NS_PER_S
ASK_S = 1.0
REASON = "a Devkit script says so"
_VERBS: dict[int, tuple[Verb, ...]] = {GREEN: ("hold", "call"), RED: ("omit", "force_off")}

_log = logging.getLogger(__name__)


class Heads:
    """The lights TL1, TL2... of a script.

    Args:
        by: Who wishes: the bridge's station.
    """

    def __init__(self, by: str) -> None:
        self._by = by
        self._heads: tuple[tuple[str, str], ...] = ()
        self._wished: dict[tuple[str, str], int] = {}
        self._renew_ns = 0
        self._told: set[str] = set()

    def learn(self, heads: Sequence[tuple[str, str]]) -> None:
        """Know the lights, by junction and group."""
        self._heads = tuple(heads)

    def step(self, now_ns: int, states: Sequence[int | None]) -> list[Call]:
        """Return what is to be wished now.

        Args:
            now_ns: Now.
            states: By light, as the script numbers colours; None: it did not say.
        """
        wished: dict[tuple[str, str], int] = {}
        for head, state in zip(self._heads, states, strict=False):
            if state not in _VERBS:
                continue
            if wished.get(head, state) != state:
                junction, group = head
                self._warn(
                    f"lights of group {group} of {junction} are set to red and to green: they are "
                    "one group and show the same, so the red counts"
                )
            if wished.get(head) != RED:
                wished[head] = state
        changed = wished != self._wished
        if not changed and (not wished or now_ns < self._renew_ns):
            return []
        before, self._wished = self._wished, wished
        self._renew_ns = now_ns + RENEW_NS
        if not changed:
            return self._asks(wished)
        gone = {head: state for head, state in before.items() if wished.get(head) != state}
        return self._clears(gone) + self._asks(wished)

    def release(self) -> list[Call]:
        """Return what takes all wishes back."""
        out = self._clears(self._wished)
        self._wished = {}
        return out

    def replied(self, request: SignalRequest, reply: Message) -> None:
        """Hear what became of a wish."""
        if isinstance(reply, Refused):
            self._warn(reply.detail)

    def _warn(self, why: str) -> None:
        """Warn of something once."""
        if why not in self._told and len(self._told) < 100:
            self._told.add(why)
            event(_log, "devkit_light", level=logging.WARNING, why=repr(why))

    def _clears(self, wished: dict[tuple[str, str], int]) -> list[Call]:
        by_junction: dict[str, list[str]] = {}
        for junction, group in wished:
            by_junction.setdefault(junction, []).append(group)
        return [self._call(junction, "clear", groups) for junction, groups in by_junction.items()]

    def _asks(self, wished: dict[tuple[str, str], int]) -> list[Call]:
        """Reds first, so that a green is not asked for beside what must end for it."""
        out = []
        for colour in (RED, GREEN):
            for (junction, group), state in wished.items():
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
            expires_s=LAPSE_S,
        )
        return Call(request, ASK_S)
