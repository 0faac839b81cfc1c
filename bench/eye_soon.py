"""From exposure to a pose that others hear: a 1080p camera of 10 cars at 30 Hz, over the real bus.

The Eye runs as it does in a city, with a camera whose driver hands over finished pictures; who
listens stamps what arrives, on the same machine. Run: `python -m bench.eye_soon`.
"""

import multiprocessing
import threading
import time

import cv2
import msgspec
import numpy as np

from bench import eye_live
from scm.clock import WallClock
from scm.eye.part import EyePart
from scm.eye.sources.capture import Grabbed
from scm.eye.sources.live import LiveSource
from scm.runtime.live import run
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.mailbox import Mailbox
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.router import Router, free_endpoint

SECONDS, WARM_S = 12.0, 4.0
LIMIT_MS = 15.0


class Pictures:
    """A camera that exposes a picture 30 times a second and shares our clock."""

    def __init__(self, images):
        self._images, self._count = images, 0
        self._due_s = time.monotonic()

    def wait(self):
        """Wait for the next exposure."""
        self._due_s += 1.0 / eye_live.RATE_HZ
        time.sleep(max(0.0, self._due_s - time.monotonic()))

    def fetch(self):
        """Return it; it was exposed just now."""
        self._count += 1
        return Grabbed(self._images[self._count % len(self._images)], age_ns=0)

    def interrupt(self):
        """Nothing waits for long."""

    def close(self):
        """Nothing to let go of."""


def see(endpoint: str, camera, images) -> None:
    """Run an Eye for a while."""
    cv2.setNumThreads(1)
    source = LiveSource("pictures", lambda: Pictures(images))
    stop = threading.Event()
    threading.Timer(SECONDS, stop.set).start()
    part = EyePart(eye_live.city_with(camera), source=source)
    run(part, ZenohBus("city", part.name, endpoint), WallClock(), stop)


def main() -> None:
    """Print how old poses and tracks are when they are received."""
    shots = eye_live.film_of(0.0, 0)
    images = [cv2.cvtColor(shot.image, cv2.COLOR_GRAY2BGR) for shot in shots]
    images += images[::-1]  # there and back, so that no car leaps
    camera = msgspec.structs.replace(shots[0].camera.camera, rate_hz=eye_live.RATE_HZ)
    with Router(free_endpoint()) as router, ZenohBus("city", "ears", router.listen) as bus:
        poses, tracks = Mailbox(100_000), Mailbox(100_000)
        bus.subscribe(EyePose, {}, poses)
        bus.subscribe(EyeTrack, {}, tracks)
        eye = multiprocessing.get_context("spawn").Process(
            target=see, args=(router.listen, camera, images)
        )
        eye.start()
        eye.join()
        received = [(item.t_ns, item.message) for item in poses.drain()]
        estimated = [(item.t_ns, item.message) for item in tracks.drain()]
    began = min(t_ns for t_ns, _ in received) + WARM_S * 1e9
    late = np.array([(t - pose.t_ns) / 1e6 for t, pose in received if t > began])
    way = np.array([(t - track.t_ns) / 1e6 for t, track in estimated if t > began])
    print(f"{len(late)} poses of {eye_live.CARS} cars, colour frames, over the bus")
    print("| from | median ms | 95 % ms | 99 % ms |\n|---|---|---|---|")
    for name, values in (
        ("exposure to pose received", late),
        ("publishing a track to its receipt", way),
    ):
        middle, most, rare = np.percentile(values, [50, 95, 99])
        print(f"| {name} | {middle:.1f} | {most:.1f} | {rare:.1f} |")
    verdict = "holds" if np.median(late) < LIMIT_MS else "MISSED"
    print(
        f"asked: {LIMIT_MS:.0f} ms in the median: {verdict}, {np.median(late) / LIMIT_MS:.2f} of it"
    )


if __name__ == "__main__":
    main()
