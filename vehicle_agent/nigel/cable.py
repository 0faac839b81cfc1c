"""A serial port that may be unplugged, busy, forbidden or missing; nothing here blocks.

What cannot be written at once is dropped, except the rest of a frame that was begun: a delayed
command would be an old one.
"""

import errno
import os
import select
import termios
from collections.abc import Sequence
from contextlib import suppress
from typing import Protocol

import serial

from scm.clock import NS_PER_MS

REOPEN_NS = 500 * NS_PER_MS
READ_BYTES = 4096
FULL_BYTES = 128
"""Above this backlog in the driver nothing is added: 128 bytes take 22 ms at 57600 baud."""

FAILURES = (OSError, ValueError, termios.error)
GONE = select.POLLHUP | select.POLLERR | select.POLLNVAL


class Port(Protocol):
    """The part of pyserial's port that is used."""

    fd: int
    out_waiting: int

    def close(self) -> None:
        """Close it."""
        ...

    def reset_output_buffer(self) -> None:
        """Discard what was not sent yet."""
        ...


class Opens(Protocol):
    """Opens a port."""

    def __call__(self, path: str, baud: int) -> Port:
        """Return an open port; serial.SerialException where that fails."""
        ...


def open_serial(path: str, baud: int, *, dtr: bool = True, exclusive: bool = True) -> Port:
    """Open a port: 8 data bits, no parity, 1 stop bit, no flow control.

    Args:
        path: Of the port.
        baud: Of the line.
        dtr: Whether to raise DTR, which resets an Arduino.
        exclusive: Whether to lock the port for this process.
    """
    port = serial.Serial(baudrate=baud, timeout=0, write_timeout=0, exclusive=exclusive)
    port.port, port.dtr = path, dtr
    port.open()
    opened: Port = port
    return opened


class Cable:
    """One serial port by its path.

    Attributes:
        trouble: Why it is not open, in words; empty if it is open.
        opened: How often it was opened; protocols restart at each change.
        held_back: Number of frames dropped for lack of room.
    """

    def __init__(self, path: str, baud: int, opens: Opens = open_serial) -> None:
        self._path, self._baud, self._opens = path, baud, opens
        self._port: Port | None = None
        self._tried_ns: int | None = None
        self._rest = b""
        self.trouble = "not opened yet"
        self.opened = 0
        self.held_back = 0

    @property
    def fd(self) -> int | None:
        """The file descriptor to wait on; None while the port is not open."""
        return None if self._port is None else self._port.fd

    def keep_open(self, now_ns: int) -> bool:
        """Open the port if a retry is due; return whether it is open."""
        if self._port is None and self._is_due(now_ns):
            self._tried_ns, self._rest = now_ns, b""
            try:
                self._port = self._opens(self._path, self._baud)
            except FAILURES as cause:
                self.trouble = f"{self._path}: {_explain(cause, self._baud)}"
            else:
                self.trouble = ""
                self.opened += 1
        return self._port is not None

    def read(self) -> bytes:
        """Return received bytes; none if the port was just unplugged."""
        if self._port is None:
            return b""
        try:
            if self._is_gone(self._port.fd):
                self._pulled("hung up")
                return b""
            return os.read(self._port.fd, READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError as cause:
            self._pulled(str(cause))
            return b""

    def write(self, frames: Sequence[bytes]) -> None:
        """Send whole frames, in order; frames without room are dropped and counted."""
        for at, frame in enumerate(frames):
            if not self._write_one(frame):
                self.held_back += len(frames) - at
                return

    def is_drained(self) -> bool:
        """Return whether the driver reports that everything was sent."""
        return self._port is None or (not self._rest and self._unsent(self._port) == 0)

    def close(self) -> None:
        """Close at once; unsent bytes are discarded."""
        if self._port is not None:
            with suppress(*FAILURES):
                if not self.is_drained():
                    self._port.reset_output_buffer()
            with suppress(*FAILURES):
                self._port.close()
            self._port, self.trouble = None, "closed"

    def _write_one(self, frame: bytes) -> bool:
        """Send the rest of the last frame, then this one; return whether it was begun."""
        if self._port is None or self._unsent(self._port) > FULL_BYTES:
            return False
        try:
            if self._rest:
                self._rest = self._rest[os.write(self._port.fd, self._rest) :]
            if self._rest:
                return False
            self._rest = frame[os.write(self._port.fd, frame) :]
        except BlockingIOError:
            return False
        except OSError as cause:
            self._pulled(str(cause))
            return False
        return True

    def _pulled(self, why: str) -> None:
        self.close()
        self.trouble = f"{self._path}: unplugged ({why})"

    def _is_due(self, now_ns: int) -> bool:
        return self._tried_ns is None or now_ns - self._tried_ns >= REOPEN_NS

    @staticmethod
    def _is_gone(fd: int) -> bool:
        poll = select.poll()
        poll.register(fd, select.POLLIN)
        return any(event & GONE for _, event in poll.poll(0))

    @staticmethod
    def _unsent(port: Port) -> int:
        try:
            return port.out_waiting
        except OSError:
            return 0


def _explain(cause: Exception, baud: int) -> str:
    """Return why a port does not open, and what to do, in words."""
    number = cause.errno if isinstance(cause, OSError) else None
    if number in (errno.ENOENT, errno.ENXIO, errno.ENODEV):
        return "no such device: is the cable plugged in? `ls /dev/serial/by-id` shows what is"
    if number in (errno.EACCES, errno.EPERM):
        return (
            "permission denied: join the group dialout (`sudo usermod -aG dialout $USER`), "
            "then log in again"
        )
    if number in (errno.EBUSY, errno.EAGAIN):
        return "in use by another program: another agent, a serial monitor or ModemManager"
    if number in (errno.ENOTTY, errno.EISDIR):
        return "this is no serial port"
    if isinstance(cause, ValueError):
        return f"the port does not know {baud} baud: {cause}"
    return str(cause)
