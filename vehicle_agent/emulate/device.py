"""Board, cable and injected faults, advanced to now together."""

import logging

from scm.clock import NS_PER_MS
from scm.log import event
from vehicle_agent.emulate.faults import Event, FaultInjector, lasts_ns
from vehicle_agent.emulate.firmware import Firmware
from vehicle_agent.emulate.pty import Cable
from vehicle_agent.emulate.uart import received_bytes

BROWNOUT_NS = 200 * NS_PER_MS
"""How long the voltage is too low to run, before the bootloader starts."""
MAX_LINE_BACKLOG_NS = 4 * NS_PER_MS
"""Maximum backlog on the line; further bytes stay in the host's buffer."""

_log = logging.getLogger(__name__)


class Device:
    """The emulated Arduino at the end of its cable.

    It has its own power: unplugged, it continues with its last command.

    Args:
        firmware: The board.
        cable: To the host.
        injector: Injects faults.
    """

    def __init__(self, firmware: Firmware, cable: Cable, injector: FaultInjector) -> None:
        self.firmware, self._cable, self._injector = firmware, cable, injector
        self._was_open = False
        self._warned_baud = 0
        self._plug_ns: int | None = None

    def step(self, now_ns: int) -> None:
        """Receive from the host, run the board up to now, answer."""
        happens, noise = self._injector.due(now_ns)
        for one in happens:
            self._apply_fault(one, now_ns)
        if self._plug_ns is not None and now_ns >= self._plug_ns:
            self._plug_ns = None
            self._cable.plug()
            event(_log, "cable_plugged_back", link=self._cable.link)
        self._check_host(now_ns)
        data = self._from_host(now_ns)
        out = self.firmware.step(now_ns, self._injector.corrupt(data) + noise)
        if self._was_open:
            self._cable.write(self._to_host(self._injector.corrupt(out)) + noise)

    def close(self) -> None:
        """Remove the cable."""
        self._cable.pull()

    def _check_host(self, now_ns: int) -> None:
        """Check whether a host has opened the port, which resets the board, or closed it."""
        is_open = self._cable.is_open
        if is_open != self._was_open:
            event(_log, "host_opens_resets" if is_open else "host_closes", link=self._cable.link)
            self._warned_baud = 0
            if is_open:
                self.firmware.reset(now_ns)
        self._was_open = is_open

    def _from_host(self, now_ns: int) -> bytes:
        """Return what the board receives; a host that has closed is read to its last byte."""
        if self.firmware.backlog_ns(now_ns) > MAX_LINE_BACKLOG_NS:
            return b""
        data = self._cable.read(64)
        if not data:
            return b""
        ours, theirs = self.firmware.sketch.baud, self._cable.baud
        if theirs not in (ours, self._warned_baud):
            event(_log, "wrong_baud", level=logging.WARNING, got=theirs, expected=ours)
            self._warned_baud = theirs
        return received_bytes(data, theirs, ours)

    def _to_host(self, data: bytes) -> bytes:
        return received_bytes(data, self.firmware.sketch.baud, self._cable.baud)

    def _apply_fault(self, one: Event, now_ns: int) -> None:
        event(_log, f"fault_{one.kind}", level=logging.WARNING)
        if one.kind == "unplug":
            self._cable.pull()
            self._plug_ns = now_ns + lasts_ns(one)
        else:
            self.firmware.reset(now_ns + (BROWNOUT_NS if one.kind == "brownout" else 0))
