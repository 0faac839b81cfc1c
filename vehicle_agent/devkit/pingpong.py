"""One packet, one reply: when the next may go, and when one is lost.

    all packets answered                the next may go
    none answered for `patience`        one more goes; each further time twice as long, 8 s at most
    some answered, then none            the others are waited for: half as long again as the first
                                        answer took, from `patience` to 30 s; then they are lost
    the others come after all           the script was slow: the patience doubles, 8 s at most
    a quick reply                       halves it, down to 1 s
    more replies than handlers that     the handler is waited for too, as long as for a reply: else
    returned                            a script that answers twice were given two for one it eats
So a script that answers late is not given more than it can eat, and one that lost a packet, or
failed on it, is asked again. The simulator would wait for ever.
"""

from scm.clock import NS_PER_S

PATIENCE_NS = NS_PER_S
LONGEST_NS = 8 * NS_PER_S
LONGEST_WAIT_NS = 30 * NS_PER_S
TOO_MANY = 3


class PingPong:
    """The state of one conversation.

    Args:
        gap_ns: Least time from one packet to the next; 0: as fast as the script answers.

    Attributes:
        replies: How many came.
        packets: How many went.
        again: How many packets went because no reply came.
    """

    def __init__(self, gap_ns: int = 0) -> None:
        self.replies = self.again = 0
        self._gap_ns = gap_ns
        self._next_ns: int | None = None
        self._under_way = 0
        self.packets = self._eaten = self._excess = self._counted = 0
        self._in_doubt = self._waits = False
        self._patience_ns = self._wait_ns = PATIENCE_NS
        self._first_ns = self._sent_ns = self._heard_ns = 0

    def due_ns(self, now_ns: int) -> int:
        """Return when the next packet may go; not after now: it may go now [ns]."""
        if self._under_way or (self._waits and self._eaten < self.packets):
            return max(self._sent_ns, self._heard_ns) + self._wait_ns
        return now_ns if self._next_ns is None else self._next_ns

    def sent(self, now_ns: int) -> None:
        """Note that a packet went out, because it was due."""
        if self._under_way:
            self._send_again(now_ns)
        else:
            self._waits = self._waits and self._eaten == self.packets
            self._under_way, self._first_ns = 1, now_ns
        self._sent_ns = now_ns
        self.packets += 1
        on_grid = self._next_ns is not None and now_ns - self._next_ns <= self._gap_ns
        self._next_ns = (self._next_ns if on_grid and self._next_ns else now_ns) + self._gap_ns

    def _send_again(self, now_ns: int) -> None:
        self.again += 1
        if self._in_doubt and self._heard_ns > self._sent_ns:
            self._under_way, self._first_ns, self._in_doubt = 1, now_ns, False
            self._patience_ns = min(2 * self._patience_ns, LONGEST_NS)
            self._wait_ns = self._patience_ns
        else:
            self._under_way, self._in_doubt = self._under_way + 1, True
            self._wait_ns = min(2 * self._wait_ns, LONGEST_NS)

    def eaten(self, number: int) -> None:
        """Note that the handler of a packet returned; the first is 1."""
        more = (self.replies - self._counted) - (number - self._eaten)
        self._excess = max(0, self._excess + more)
        self._eaten, self._counted = number, self.replies
        if self._excess >= TOO_MANY:
            self._waits, self._excess = True, 0

    def replied(self, now_ns: int) -> None:
        """Note that a reply came; one that nothing under way can have asked for changes nothing."""
        self.replies += 1
        if not self._under_way:
            return
        self._heard_ns = now_ns
        self._under_way -= 1
        if self._under_way:
            took_ns = min(3 * (now_ns - self._first_ns) // 2, LONGEST_WAIT_NS)
            self._wait_ns = max(self._patience_ns, took_ns)
            return
        if self._in_doubt:
            self._in_doubt = False
            self._patience_ns = min(2 * self._patience_ns, LONGEST_NS)
        elif 4 * (now_ns - self._sent_ns) < self._patience_ns:
            self._patience_ns = max(PATIENCE_NS, self._patience_ns // 2)
        self._wait_ns = self._patience_ns
