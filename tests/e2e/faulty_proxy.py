"""Harm done to a connection by a seed, through a proxy that delays, stalls, cuts and resets."""

import random
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from scm.selftest.proxy import FaultyProxy

__all__ = ["FaultyProxy", "trouble"]


@contextmanager
def trouble(proxy: FaultyProxy, seed: int) -> Iterator[None]:
    """Do one harm after the other to a proxy, until the end."""
    rng, over = random.Random(seed), threading.Event()

    def harm() -> None:
        while not over.wait(rng.uniform(0.1, 0.6)):
            match rng.choice(["delay", "stall", "cut", "reset"]):
                case "delay":
                    proxy.delay_s = rng.choice([0.0, 0.02, 0.2])
                case "stall":
                    proxy.stalled = True
                    over.wait(rng.uniform(0.1, 1.5))
                    proxy.stalled = False
                case "cut":
                    proxy.cut()
                case "reset":
                    proxy.cut(reset=True)

    thread = threading.Thread(target=harm, name="trouble")
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        proxy.delay_s, proxy.stalled = 0.0, False
