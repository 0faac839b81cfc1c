"""A device of our own behind a true pseudo-terminal, at a path that can vanish and come back."""

import os
import pty
import threading
import tty
from contextlib import suppress

from scm.clock import WallClock
from tests.unit.nigel.fake_device import NANO, Device


class PtyDevice:
    """Answers in a thread of its own for as long as it is plugged.

    Attributes:
        log: Every (t_ns, topic, payload) it was sent.
    """

    def __init__(self, path, topics=NANO):
        self.path, self.topics = path, topics
        self.clock, self.log = WallClock(), []
        self._master = self._thread = None
        self.plug()

    def plug(self):
        """Be there, as a device that has just started."""
        self._master, slave = pty.openpty()
        tty.setraw(slave)
        self.path.symlink_to(os.ttyname(slave))
        self.device = Device(self.topics)
        self._thread = threading.Thread(target=self._serve, args=(self._master, slave))
        self._thread.start()

    def pull(self):
        """Vanish."""
        if self._master is not None:
            self.path.unlink()
            master, self._master = self._master, None
            self._thread.join()
            os.close(master)

    def newest(self, topic):
        """Return the newest payload of a topic, or None."""
        return next((payload for _, number, payload in reversed(self.log) if number == topic), None)

    def _serve(self, master, slave):
        os.set_blocking(master, False)
        stop = threading.Event()
        while self._master is not None:
            with suppress(BlockingIOError, OSError):
                data = os.read(master, 4096)
                now_ns, before = self.clock.now_ns(), len(self.device.said)
                answer = self.device.hear(data, now_ns)
                self.log += [(now_ns, f.topic, f.payload) for f in self.device.said[before:]]
                os.write(master, answer)
            stop.wait(0.002)
        os.close(slave)
