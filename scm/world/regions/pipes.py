"""The exchange of regions that are processes on one machine: a pipe between each two of them."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from multiprocessing import Pipe
from multiprocessing.connection import Connection

from scm.errors import RunError


class Pipes:
    """One region's ends of the pipes to all others; call it once a tick.

    Regions meet in pairs, in the same order everywhere, and the lower number sends first: a pipe
    holds less than a message, so two that both send would wait for each other.
    """

    def __init__(self, number: int, ends: Mapping[int, "Connection[bytes, bytes]"]) -> None:
        self._number, self._ends = number, dict(ends)

    def __call__(self, messages: Sequence[bytes]) -> list[bytes]:
        """Send a message to each region, by number; return one of each other region.

        Raises:
            RunError: when another region has ended.
        """
        received = []
        for meeting in range(len(messages)):
            other = (meeting - self._number) % len(messages)
            if other == self._number:
                continue
            try:
                if self._number < other:
                    self._ends[other].send_bytes(messages[other])
                received.append(self._ends[other].recv_bytes())
                if self._number > other:
                    self._ends[other].send_bytes(messages[other])
            except (EOFError, OSError) as cause:
                raise RunError(
                    f"region {other} has ended: {cause or 'its pipe is closed'}"
                ) from cause
        return received

    def close(self) -> None:
        """Close the ends in this process, so that the others notice when the region ends.

        To be called where the region's process was started, which has ends of its own.
        """
        for end in self._ends.values():
            end.close()


def pipes(regions: int) -> list[Pipes]:
    """Return the exchange of each region, to be given to its process."""
    ends: list[dict[int, Connection[bytes, bytes]]] = [{} for _ in range(regions)]
    for one, other in combinations(range(regions), 2):
        ends[one][other], ends[other][one] = Pipe()
    return [Pipes(number, own) for number, own in enumerate(ends)]
