"""A station that sends too much: `python -m scm.selftest.flood ENDPOINT CITY RATE SECONDS`.

It talks on a key that those who drive and those who steer signals do not hear; the recorder and
the dashboard do.
"""

import sys
import threading

from scm.clock import NS_PER_S, WallClock, nanoseconds
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.eye_status import EyeStatus

AT_ONCE = 100


def main(endpoint: str, city: str, rate_hz: int, span_s: float) -> None:
    """Send as many messages a second for a while; print how many were sent."""
    clock, never, sent = WallClock(), threading.Event(), 0
    with ZenohBus(city, "flood", endpoint) as bus:
        began_ns = clock.now_ns()
        while clock.now_ns() - began_ns < nanoseconds(span_s):
            clock.wait_until(began_ns + sent * NS_PER_S // rate_hz, never)
            for _ in range(AT_ONCE):
                bus.publish(EyeStatus(camera="flood", t_ns=clock.now_ns(), good=True))
            sent += AT_ONCE
    sys.stdout.write(f"{sent}\n")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
