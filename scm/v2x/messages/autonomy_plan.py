"""The way that a car which drives itself without lanes has planned."""

from typing import ClassVar

from scm.records.fields import TNs, VehicleName
from scm.v2x.message import Message

PlannedPose = tuple[float, float, float]


class AutonomyPlan(Message, kw_only=True, frozen=True):
    """Path to the goal and the next stretch of it; sent when they change.

    Attributes:
        path: Poses of the rear axle from where it began to the goal: x [m], y [m], yaw [rad].
        trajectory: Likewise, the stretch that it follows now.
        particles: Poses at which the car may be, at most 100 of them, spread as the belief is.
        obstacles: Middles of what the map has not, x [m], y [m].
        candidates: Other stretches that it tried instead of the trajectory, as that.
    """

    KEY: ClassVar[str] = "v/{vehicle}/autonomy/plan"
    RATE_HZ: ClassVar[float | None] = 2.0

    vehicle: VehicleName
    t_ns: TNs
    path: tuple[PlannedPose, ...] = ()
    trajectory: tuple[PlannedPose, ...] = ()
    particles: tuple[PlannedPose, ...] = ()
    obstacles: tuple[tuple[float, float], ...] = ()
    candidates: tuple[tuple[PlannedPose, ...], ...] = ()


MESSAGE = AutonomyPlan
