"""What the city looked like at one moment: a copy that the web may read without a lock."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import wraps
from typing import Generic, TypeVar

from scm.clock import seconds
from scm.disturbances import Disturbances
from scm.geometry import Pose2
from scm.records.eye import Residual, TagSeen
from scm.records.stations import StationRow
from scm.v2x.message import Message
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_status import EyeStatus
from scm.v2x.messages.eye_tags import EyeTags
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.neighbour_status import NeighbourStatus
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.v2x.messages.signal_site import SignalSite
from scm.v2x.messages.signal_status import SignalStatus
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.traffic_counts import TrafficCounts
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.violation import Violation
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import WorldSnapshot

M = TypeVar("M", bound=Message)
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Held(Generic[M]):
    """A message and when it reached this process [ns]."""

    message: M
    arrived_ns: int

    def age_s(self, now_ns: int) -> float:
        """Return how long ago it arrived [s]."""
        return seconds(now_ns - self.arrived_ns)


@dataclass(frozen=True, slots=True)
class SeenPose:
    """A pose the Eye measured, and how far it lay from the truth; None: no truth of that time."""

    held: Held[EyePose]
    residual: Residual | None


@dataclass(frozen=True, slots=True)
class TagSighting:
    """A tag when a camera saw it last: in the frame exposed at `t_ns`, received at `arrived_ns`."""

    tag: TagSeen
    t_ns: int
    arrived_ns: int


@dataclass(frozen=True, slots=True)
class Picture:
    """The newest of everything received, as of `now_ns`, the time of the view's last step.

    Attributes:
        spats, monitors, sites, signal_statuses: By junction.
        trips, autonomy, autonomy_plans, room_maps, twins: By vehicle.
        map_origins: By vehicle, where the frame of its `room_maps` lies in the city.
        traffic: The observer's newest counts; `violations` the last it reported, oldest first.
        frames, tags: By camera, the last few, oldest first; `eye_statuses` the newest.
        tags_seen: By (camera, tag id), all of the last minute.
        poses: By (camera, vehicle).
        stations: Everybody who is there, and who was lost lately.
        neighbours: By neighbouring city.
        disturbances: What makes measurements void; shared with the city.
        event_seq: Number of the newest event in the log; 0: none yet.
    """

    now_ns: int = 0
    snapshot: Held[WorldSnapshot] | None = None
    definition: WorldDefinition | None = None
    stop: CityStop | None = None
    spats: dict[str, Held[Spat]] = field(default_factory=dict)
    monitors: dict[str, Held[MonitorStatus]] = field(default_factory=dict)
    sites: dict[str, SignalSite] = field(default_factory=dict)
    signal_statuses: dict[str, Held[SignalStatus]] = field(default_factory=dict)
    trips: dict[str, Held[Trip]] = field(default_factory=dict)
    autonomy: dict[str, Held[AutonomyStatus]] = field(default_factory=dict)
    autonomy_plans: dict[str, Held[AutonomyPlan]] = field(default_factory=dict)
    room_maps: dict[str, Held[OccupancyMap]] = field(default_factory=dict)
    map_origins: dict[str, Pose2] = field(default_factory=dict)
    twins: dict[str, Held[TwinStatus]] = field(default_factory=dict)
    traffic: Held[TrafficCounts] | None = None
    violations: tuple[Violation, ...] = ()
    frames: dict[str, tuple[Held[EyeFrame], ...]] = field(default_factory=dict)
    tags: dict[str, tuple[Held[EyeTags], ...]] = field(default_factory=dict)
    tags_seen: dict[tuple[str, int], TagSighting] = field(default_factory=dict)
    eye_statuses: dict[str, Held[EyeStatus]] = field(default_factory=dict)
    poses: dict[tuple[str, str], SeenPose] = field(default_factory=dict)
    stations: tuple[StationRow, ...] = ()
    neighbours: dict[str, Held[NeighbourStatus]] = field(default_factory=dict)
    disturbances: Disturbances = field(default_factory=Disturbances)
    event_seq: int = 0


def once_a_picture(make: Callable[[Picture], T]) -> Callable[[Picture], T]:
    """Compute a view of a picture once, for any number of requests before the next one."""
    held: tuple[Picture, T] | None = None

    @wraps(make)
    def made(picture: Picture) -> T:
        nonlocal held
        known = held
        if known is not None and known[0] is picture:
            return known[1]
        shown = make(picture)
        held = (picture, shown)
        return shown

    return made
