"""The cable: a pseudo-terminal behind a constant path, like `/dev/ttyUSB0`."""

import errno
import fcntl
import os
import select
import struct
import tty
from pathlib import Path

from scm.errors import LinkError

READ_BYTES = 4096
TCGETS2 = 0x802C542A
TERMIOS2 = struct.Struct("=4IB19s2I")
"""Linux's ioctl for speeds without a name in termios, and its data structure."""


class Cable:
    """A pseudo-terminal and the link to it.

    The far end is only open while a host has it open, so that connections are detected.

    Args:
        link: Path for hosts. An existing link is replaced.

    Raises:
        LinkError: when the path exists as something else, or cannot be written.
    """

    def __init__(self, link: Path) -> None:
        if link.exists() and not link.is_symlink():
            msg = f"--link {link}: got a file that is there already, expected a free path or a link"
            raise LinkError(msg)
        self.link = link
        self._master: int | None = None
        self._poll = select.poll()
        self.target = ""
        self.plug()

    @property
    def is_plugged(self) -> bool:
        """Whether the cable is plugged in."""
        return self._master is not None

    @property
    def is_open(self) -> bool:
        """Whether a host has it open now."""
        return self._master is not None and not any(
            event & select.POLLHUP for _, event in self._poll.poll(0)
        )

    @property
    def baud(self) -> int:
        """The speed that the host has set."""
        if self._master is None:
            return 0
        filled = fcntl.ioctl(self._master, TCGETS2, bytes(TERMIOS2.size))
        speed: int = TERMIOS2.unpack(filled)[-1]
        return speed

    def plug(self) -> None:
        """Create a new pseudo-terminal and link the path to it."""
        if self._master is not None:
            return
        self._master, far = os.openpty()
        tty.setraw(far)
        self.target = os.ttyname(far)
        os.close(far)
        os.set_blocking(self._master, False)
        self._poll.register(self._master, select.POLLIN)
        try:
            self.link.unlink(missing_ok=True)
            self.link.symlink_to(self.target)
        except OSError as cause:
            self.pull()
            msg = f"--link {self.link}: {cause.strerror}"
            raise LinkError(msg) from cause

    def pull(self) -> None:
        """Unplug: a host that has it open gets an error, and the path is removed."""
        if self._master is None:
            return
        if self.link.is_symlink() and str(self.link.readlink()) == self.target:
            self.link.unlink()
        self._poll.unregister(self._master)
        os.close(self._master)
        self._master = None

    def read(self, most: int = READ_BYTES) -> bytes:
        """Return received bytes, if any."""
        if self._master is None or most <= 0:
            return b""
        try:
            return os.read(self._master, most)
        except OSError as none:
            if none.errno in (errno.EIO, errno.EAGAIN):
                return b""
            raise

    def write(self, data: bytes) -> None:
        """Send to the host; bytes beyond the terminal's buffer are lost."""
        if self._master is None or not data:
            return
        try:
            os.write(self._master, data)
        except OSError as full:
            if full.errno not in (errno.EIO, errno.EAGAIN):
                raise
