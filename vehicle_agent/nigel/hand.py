"""The agent's own hand on the port, for when its keeper cannot say zero.

A keeper that is silent still holds the port: who opens it beside him resets nothing and may say the
zeros himself. One that is gone has closed it: opening it again resets the Arduino, whose motor
rests then.
"""

import os
import select
from contextlib import suppress

from vehicle_agent.nigel.cable import FAILURES, Port, open_serial

PULSE_S = 0.006
"""For so long DTR must have been low: the Arduino's reset hangs on 0.1 uF and 10 kOhm (1 ms)."""


class Hand:
    """One port by its path, not held as long as somebody else keeps it."""

    def __init__(self, path: str, baud: int) -> None:
        self._path, self._baud = path, baud
        self._beside: int | None = None
        self._port: Port | None = None

    def say(self, frames: bytes) -> None:
        """Write beside a keeper that holds the port; what finds no room is not kept."""
        with suppress(OSError):
            if self._beside is None:
                self._beside = os.open(self._path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            os.write(self._beside, frames)

    def hold(self) -> None:
        """Open the port of a keeper that is gone: that resets the Arduino."""
        if self._port is not None:
            return
        self.withdraw()
        select.select([], [], [], PULSE_S)
        with suppress(*FAILURES):
            self._port = open_serial(self._path, self._baud, exclusive=False)

    def withdraw(self) -> None:
        """Say nothing more beside the keeper: the port closes when he does."""
        if self._beside is not None:
            with suppress(OSError):
                os.close(self._beside)
            self._beside = None

    def release(self) -> None:
        """Let go of the port altogether."""
        self.withdraw()
        if self._port is not None:
            with suppress(*FAILURES):
                self._port.close()
            self._port = None
