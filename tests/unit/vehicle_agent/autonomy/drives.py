"""Drives of a simulated car on a map: what its sensors measured, and where it was."""

import functools
from dataclasses import dataclass

import numpy as np

from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.world.part import WorldPart

ROUND = (
    (1.0, 0.0, 0.0), (6.0, 0.8, 0.9), (3.0, -0.6, -0.8), (4.0, 0.8, 0.5), (1.0, 0.0, 0.0)
)  # fmt: skip
"""Seconds, throttle, steering: it stands, drives forward, backward and forward, and stands."""


@dataclass(frozen=True, eq=False)
class Drive:
    """One drive; `messages` in the order of their times."""

    messages: list
    times: np.ndarray
    poses: np.ndarray

    def truth(self, t_ns):
        """Return where the car was."""
        return Pose2(*(float(np.interp(t_ns, self.times, c)) for c in self.poses.T))

    @property
    def scans(self):
        """The sweeps among the messages."""
        return [m for m in self.messages if isinstance(m, LidarScan)]


@functools.cache
def driven(map_name, start, commands=ROUND, seed=1):
    """Return a drive of nigel from a pose, by (seconds, throttle, steering)."""
    world, messages, times, poses = WorldPart(load_map(map_name), seed, ()), [], [], []
    with Lockstep([world]) as city:
        boxes = [
            city.subscribe(Subscription(kind, {"vehicle": "n1"}))
            for kind in (VehicleSensors, LidarScan)
        ]
        car = world.world.host("n1", "nigel", start, 0)
        lease = LeaseRequest(vehicle="n1", owner="script", verb="acquire", ttl_ms=60_000)
        epoch, seq = city.call(lease).epoch, 0
        for lasts_s, throttle, steering in commands:
            for _ in range(round(50 * lasts_s)):
                seq += 1
                city.publish(
                    DriveCommand(
                        vehicle="n1", t_ns=city.now_ns, epoch=epoch, seq=seq,
                        throttle=throttle, steering=steering,
                    )
                )  # fmt: skip
                city.run_for(0.02)
                times.append(city.now_ns)
                poses.append(car.pose)
        for box in boxes:
            messages += [item.message for item in box.drain()]
    messages.sort(key=lambda m: (m.t_ns, isinstance(m, LidarScan)))
    turned = np.array(poses)
    turned[:, 2] = np.unwrap(turned[:, 2])
    return Drive(messages, np.array(times), turned)


def way_m(drive):
    """Return the length that the car drove, both ways counted."""
    return float(np.hypot(*np.diff(drive.poses[:, :2], axis=0).T).sum())
