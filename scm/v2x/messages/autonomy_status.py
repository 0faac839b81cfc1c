"""What a car that drives itself without lanes is doing, and where it thinks that it is."""

from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from scm.records.fields import TNs, VehicleName
from scm.v2x.message import Message


class AutonomyStatus(Message, kw_only=True, frozen=True):
    """State of one car's autonomy.

    Attributes:
        state: What it is doing: it waits for a goal, builds a map, looks for its place or for a
            path, drives, stands because of a difficulty, is parked, or has given up.
        reason: Why, in words; empty where there is nothing to say.
        goal_x_m, goal_y_m, goal_yaw_rad: Where it is to park, rear axle, map frame;
            None: it has no goal.
        x_m, y_m, yaw_rad: Where it thinks that it is; None: not known yet.
        position_std_m, yaw_std_rad: How well that is known.
        explained: Share of the last sweep's echoes that lie on walls of the map, 0 to 1.
        attempts: Paths driven towards this goal.
        compute_share: Of one processor core, over the last second.
    """

    KEY: ClassVar[str] = "v/{vehicle}/autonomy"
    RATE_HZ: ClassVar[float | None] = 5.0

    vehicle: VehicleName
    t_ns: TNs
    state: Literal["idle", "map", "localise", "plan", "drive", "recover", "parked", "failed"]
    reason: Annotated[str, Meta(examples=["something stands in the way"])] = ""
    goal_x_m: float | None = None
    goal_y_m: float | None = None
    goal_yaw_rad: float | None = None
    x_m: float | None = None
    y_m: float | None = None
    yaw_rad: float | None = None
    position_std_m: float | None = None
    yaw_std_rad: float | None = None
    explained: float | None = None
    attempts: int = 0
    compute_share: float = 0.0


MESSAGE = AutonomyStatus
