"""One packet, one reply: when the next may be sent, and when one is lost.

    all packets answered                the next may be sent
    none answered for `patience`        one more is sent; each time twice as long, at most 8 s
    some answered, then none            wait 1.5 times as long as the first answer took, from
                                        `patience` to 30 s; then the others are lost
    the others arrive after all         the script was slow: the patience doubles, at most 8 s
    a quick reply                       halves the patience, down to 1 s
    more replies than handlers that     wait for the handler too, as long as for a reply: a script
    returned                            that replies twice would get two packets for each one

So a slow script is not sent more than it can handle, and one that lost a packet, or failed on it,
gets another. The simulator would wait for ever.
"""

from scm.clock import NS_PER_S

PATIENCE_NS = NS_PER_S
MAX_PATIENCE_NS = 8 * NS_PER_S
MAX_WAIT_NS = 30 * NS_PER_S
MAX_EXCESS_REPLIES = 3  # more and the script replies twice to each packet


class PingPong:
    """The state of one connection.

    Args:
        gap_ns: Minimum time from one packet to the next; 0: as fast as the script answers.

    Attributes:
        replies: Number received.
        packets: Number sent.
        again: Number of packets sent because no reply came.
    """

    def __init__(self, gap_ns: int = 0) -> None:
        self.replies = self.again = 0
        self._gap_ns = gap_ns
        self._next_ns: int | None = None
        self._under_way = 0
        self.packets = self._handled = self._excess = self._counted = 0
        self._is_ambiguous = self._waits = False
        self._patience_ns = self._wait_ns = PATIENCE_NS
        self._first_ns = self._sent_ns = self._reply_ns = 0

    def due_ns(self, now_ns: int) -> int:
        """Return when the next packet may be sent; not after now: at once [ns]."""
        if self._under_way or (self._waits and self._handled < self.packets):
            return max(self._sent_ns, self._reply_ns) + self._wait_ns
        return now_ns if self._next_ns is None else self._next_ns

    def sent(self, now_ns: int) -> None:
        """Note that a due packet was sent."""
        if self._under_way:
            self._send_again(now_ns)
        else:
            self._waits = self._waits and self._handled == self.packets
            self._under_way, self._first_ns = 1, now_ns
        self._sent_ns = now_ns
        self.packets += 1
        on_grid = self._next_ns is not None and now_ns - self._next_ns <= self._gap_ns
        self._next_ns = (self._next_ns if on_grid and self._next_ns else now_ns) + self._gap_ns

    def _send_again(self, now_ns: int) -> None:
        self.again += 1
        if self._is_ambiguous and self._reply_ns > self._sent_ns:
            self._under_way, self._first_ns, self._is_ambiguous = 1, now_ns, False
            self._patience_ns = min(2 * self._patience_ns, MAX_PATIENCE_NS)
            self._wait_ns = self._patience_ns
        else:
            self._under_way, self._is_ambiguous = self._under_way + 1, True
            self._wait_ns = min(2 * self._wait_ns, MAX_PATIENCE_NS)

    def handled(self, number: int) -> None:
        """Note that the handler of a packet returned; the first is 1."""
        more = (self.replies - self._counted) - (number - self._handled)
        self._excess = max(0, self._excess + more)
        self._handled, self._counted = number, self.replies
        if self._excess >= MAX_EXCESS_REPLIES:
            self._waits, self._excess = True, 0

    def replied(self, now_ns: int) -> None:
        """Note that a reply came; one without an outstanding packet changes nothing."""
        self.replies += 1
        if not self._under_way:
            return
        self._reply_ns = now_ns
        self._under_way -= 1
        if self._under_way:
            took_ns = min(3 * (now_ns - self._first_ns) // 2, MAX_WAIT_NS)
            self._wait_ns = max(self._patience_ns, took_ns)
            return
        if self._is_ambiguous:
            self._is_ambiguous = False
            self._patience_ns = min(2 * self._patience_ns, MAX_PATIENCE_NS)
        elif 4 * (now_ns - self._sent_ns) < self._patience_ns:
            self._patience_ns = max(PATIENCE_NS, self._patience_ns // 2)
        self._wait_ns = self._patience_ns
