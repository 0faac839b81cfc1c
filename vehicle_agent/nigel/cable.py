"""A serial port that may be pulled, plugged back, busy, forbidden or not there yet; never waits.

What cannot be written at once is not kept, but for the rest of a frame that was begun: a command
that waited would be an old one.
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
"""So much unsent in the driver is 22 ms at 57600 baud: nothing is added."""

FAILURES = (OSError, ValueError, termios.error)
GONE = select.POLLHUP | select.POLLERR | select.POLLNVAL


class Port(Protocol):
    """What is used of pyserial's port."""

    fd: int
    out_waiting: int

    def close(self) -> None:
        """Close it."""
        ...

    def reset_output_buffer(self) -> None:
        """Throw away what was not sent yet."""
        ...


class Opens(Protocol):
    """How a port is opened."""

    def __call__(self, path: str, baud: int) -> Port:
        """Return an open port; serial.SerialException where that fails."""
        ...


def open_serial(path: str, baud: int, *, dtr: bool = True, exclusive: bool = True) -> Port:
    """Open a port: 8 data bits, no parity, 1 stop bit, no flow control.

    Args:
        path: Of the port.
        baud: Of the line.
        dtr: Whether to raise DTR, which resets an Arduino.
        exclusive: Whether for ourselves alone.
    """
    port = serial.Serial(baudrate=baud, timeout=0, write_timeout=0, exclusive=exclusive)
    port.port, port.dtr = path, dtr
    port.open()
    opened: Port = port
    return opened


class Cable:
    """One serial port by its path.

    Attributes:
        trouble: Why it is not open, in words; empty: it is.
        opened: How often it was opened: whoever talks over it begins anew at each change.
        held_back: Frames that found no room.
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
        """Open the port if that is due; return whether it is open."""
        if self._port is None and self._is_due(now_ns):
            self._tried_ns, self._rest = now_ns, b""
            try:
                self._port = self._opens(self._path, self._baud)
            except FAILURES as cause:
                self.trouble = f"{self._path}: {_said(cause, self._baud)}"
            else:
                self.trouble = ""
                self.opened += 1
        return self._port is not None

    def read(self) -> bytes:
        """Return what has come; nothing where the port was pulled just now."""
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
        """Send whole frames, in order; what finds no room is dropped and counted."""
        for at, frame in enumerate(frames):
            if not self._write_one(frame):
                self.held_back += len(frames) - at
                return

    def is_drained(self) -> bool:
        """Return whether all that was written has left the driver, as far as it says so."""
        return self._port is None or (not self._rest and self._unsent(self._port) == 0)

    def close(self) -> None:
        """Close at once; what the driver could not send by now is thrown away."""
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
        watch = select.poll()
        watch.register(fd, select.POLLIN)
        return any(event & GONE for _, event in watch.poll(0))

    @staticmethod
    def _unsent(port: Port) -> int:
        try:
            return port.out_waiting
        except OSError:
            return 0


def _said(cause: Exception, baud: int) -> str:
    """Return in words, with the way out, why a port does not open."""
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
