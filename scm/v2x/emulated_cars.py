"""Emulated real cars, for rendered cameras: they see their true pose, not the reported one.

A real car's place in the world's snapshot is what its own program reports. An emulated one also
publishes its true pose, and that is rendered: its program learns it only by what cameras show, the
Eye's overhead and the car's own.
"""

import msgspec

from scm.clock import NS_PER_S, seconds
from scm.geometry import Pose2
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

GONE_NS = NS_PER_S
"""A car without a report for this long was removed."""
MAX_POSITION_M = 1000.0  # beyond: a broken report


class EmulatedCars:
    """The true poses of emulated cars."""

    def __init__(self) -> None:
        self._newest: dict[str, EmulatedPose] = {}

    def update(self, report: EmulatedPose) -> None:
        """Store a car's pose; poses beyond all maps are ignored."""
        if max(abs(report.x_m), abs(report.y_m)) < MAX_POSITION_M:
            self._newest[report.vehicle] = report

    def seen(self, light: WorldSnapshot) -> WorldSnapshot:
        """Return the snapshot with the true poses of emulated cars.

        Only real cars can be emulated ones. Cars that the city does not know yet are visible if
        they know their own tag.
        """
        if not self._newest:
            return light
        there = {name: report for name, report in self._newest.items()
                 if abs(light.t_ns - report.t_ns) < GONE_NS}  # fmt: skip
        known = {car.vehicle for car in light.vehicles}
        cars = []
        for car in light.vehicles:
            if car.kind != "real" or car.vehicle not in self._newest:
                cars.append(car)
            elif car.vehicle in there:
                cars.append(_drawn(there[car.vehicle], car.tag_id, light.t_ns))
        cars += [_drawn(report, report.tag_id, light.t_ns) for name, report in there.items()
                 if name not in known and report.tag_id is not None]  # fmt: skip
        return msgspec.structs.replace(light, vehicles=tuple(cars))


def _drawn(report: EmulatedPose, tag_id: int, t_ns: int) -> SnapshotVehicle:
    """Return a car at an instant; the published firmware has no lights."""
    pose = _carried(report, seconds(t_ns - report.t_ns))
    return SnapshotVehicle(
        vehicle=report.vehicle,
        kind="real",
        car=report.car,
        tag_id=tag_id if report.tag_id is None else report.tag_id,
        x_m=pose.x,
        y_m=pose.y,
        yaw_rad=pose.yaw,
        speed_mps=report.speed_mps,
        steering_rad=report.steering_rad,
    )


def _carried(report: EmulatedPose, dt_s: float) -> Pose2:
    """Return the pose some milliseconds later or earlier, extrapolated along its arc."""
    turned = report.yaw_rate_radps * dt_s
    half = Pose2(0.0, 0.0, turned / 2.0)
    forth = Pose2(report.speed_mps * dt_s, report.lateral_speed_mps * dt_s, 0.0)
    return Pose2(report.x_m, report.y_m, report.yaw_rad) @ half @ forth @ half
