"""Board, cable and what goes wrong between them, brought up to now together."""

import logging

from scm.clock import NS_PER_MS
from scm.log import event
from vehicle_agent.emulate.faults import Event, Spoiler, lasts_ns
from vehicle_agent.emulate.firmware import Firmware
from vehicle_agent.emulate.line import heard
from vehicle_agent.emulate.pty import Cable

BROWNOUT_NS = 200 * NS_PER_MS
"""For which the voltage is too low to run, before the bootloader."""
WAITING_NS = 4 * NS_PER_MS
"""Of the host's bytes on the line, more are left in its own buffer."""

_log = logging.getLogger(__name__)


class Device:
    """The emulated Arduino at the end of its cable.

    It has power of its own: pulled from the cable it goes on as it was told last.

    Args:
        firmware: The board.
        cable: To the host.
        spoiler: What goes wrong.
    """

    def __init__(self, firmware: Firmware, cable: Cable, spoiler: Spoiler) -> None:
        self.firmware, self._cable, self._spoiler = firmware, cable, spoiler
        self._was_open = False
        self._told_baud = 0
        self._plug_ns: int | None = None

    def step(self, now_ns: int) -> None:
        """Hear the host, let the board run up to now, answer."""
        happens, noise = self._spoiler.due(now_ns)
        for one in happens:
            self._suffer(one, now_ns)
        if self._plug_ns is not None and now_ns >= self._plug_ns:
            self._plug_ns = None
            self._cable.plug()
            event(_log, "cable_plugged_back", link=self._cable.link)
        self._watch(now_ns)
        data = self._from_host(now_ns)
        out = self.firmware.step(now_ns, self._spoiler.spoil(data) + noise)
        if self._was_open:
            self._cable.write(self._to_host(self._spoiler.spoil(out)) + noise)

    def close(self) -> None:
        """Take the cable away for good."""
        self._cable.pull()

    def _watch(self, now_ns: int) -> None:
        """See whether a host has come, which resets the board, or gone."""
        is_open = self._cable.is_open
        if is_open != self._was_open:
            event(_log, "host_opens_resets" if is_open else "host_closes", link=self._cable.link)
            self._told_baud = 0
            if is_open:
                self.firmware.reset(now_ns)
        self._was_open = is_open

    def _from_host(self, now_ns: int) -> bytes:
        """Return what the board hears; a host that has closed is heard to its last byte."""
        if self.firmware.backlog_ns(now_ns) > WAITING_NS:
            return b""
        data = self._cable.read(64)
        if not data:
            return b""
        ours, theirs = self.firmware.sketch.baud, self._cable.baud
        if theirs not in (ours, self._told_baud):
            event(_log, "wrong_baud", level=logging.WARNING, got=theirs, expected=ours)
            self._told_baud = theirs
        return heard(data, theirs, ours)

    def _to_host(self, data: bytes) -> bytes:
        return heard(data, self.firmware.sketch.baud, self._cable.baud)

    def _suffer(self, one: Event, now_ns: int) -> None:
        event(_log, f"fault_{one.kind}", level=logging.WARNING)
        if one.kind == "unplug":
            self._cable.pull()
            self._plug_ns = now_ns + lasts_ns(one)
        else:
            self.firmware.reset(now_ns + (BROWNOUT_NS if one.kind == "brownout" else 0))
