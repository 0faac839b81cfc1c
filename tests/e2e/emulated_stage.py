"""Parts of a city and an emulated Nigel behind a cable, processes of their own, and the truth."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

from scm.runtime.parent_watch import with_parent
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.router import Router, free_endpoint


class EmulatedStage:
    """One car, and who sees it.

    Attributes:
        link: Where the car's cable is.
        truth: Where the car truly is, 50 times a second.
        car: The process that emulates it.
    """

    def __init__(
        self, endpoint: str, folder: Path, car: tuple[str, ...], parts: tuple[str, ...], **more: Any
    ) -> None:
        """Start all.

        Args:
            endpoint: Of the router.
            folder: For the link.
            car: Arguments of the emulator.
            parts: Of the city.
            more: How the emulator's process is started.
        """
        self.endpoint, self.link = endpoint, folder / "nigel"
        self.children: list[subprocess.Popen[str]] = []
        self.truth = Mailbox(50_000)
        self.bus = ZenohBus("city", "test", endpoint)
        self.bus.subscribe(EmulatedPose, {}, self.truth)
        for part in parts:
            self.start("scm", part, "driving_school", "--connect", endpoint)
        emulate = ("vehicle_agent", "emulate", "--link", str(self.link), "--connect", endpoint)
        self.car = self.start(*emulate, *car, **more)

    @classmethod
    @contextmanager
    def open(
        cls, folder: Path, *car: str, parts: tuple[str, ...] = ("world", "eye"), **more: Any
    ) -> Iterator[Self]:
        """Yield one at a router in this process, and end it."""
        with Router(free_endpoint()) as router:
            made = cls(router.listen, folder, car, parts, **more)
            try:
                yield made
            finally:
                made.close()

    def start(self, *command: str, **more: Any) -> subprocess.Popen[str]:
        """Start a module as a child that ends with us."""
        call = with_parent([sys.executable, "-m", *command])
        self.children.append(subprocess.Popen(call, text=True, **more))
        return self.children[-1]

    def close(self) -> None:
        """End all."""
        for child in self.children:
            child.kill()
            child.wait(timeout=5.0)
            if child.stdout is not None:
                child.stdout.close()
        self.bus.close()
