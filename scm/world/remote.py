"""A car with its own dynamics, as the world sees it: a body that follows its agent's reports.

Between reports the body is extrapolated. A contact changes the body at once and is sent to the
agent with a number; until a report confirms this number, the change is added to the reports, so
that one hit does not count twice, also while no report comes: pushing a silent car would otherwise
add up speed. The distance that the agent drove before it applied a hit is sent as a shift of
position. For agents that never confirm, a change lasts `ECHO_NS` of reports.
"""

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.geometry import Pose2
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import Car
from scm.vehicles.shape import shape_of
from scm.world.lease import Lease
from scm.world.pace import LONGEST_TICK_NS
from scm.world.solids import cog_motion

MAX_POSITION_M = 10_000.0  # beyond: a broken report
MAX_SPEED = 100.0  # m/s, rad/s and rad alike
STALE_NS = NS_PER_S  # without a report an agent is lost, and its car no longer extrapolated
ECHO_NS = 60 * NS_PER_MS  # of reports, in which an agent that confirms nothing applies a hit
ANSWER_NS = 300 * NS_PER_MS  # in which an agent confirms a hit, else it never will
REPORT_NS = 20 * NS_PER_MS  # between two reports of an agent
GONE_NS = 3 * NS_PER_S  # after which a lost car leaves the map


def is_plausible(state: VehicleState) -> bool:
    """Return whether a report can be of a car: one absurd number would blind the contact solver."""
    where = (state.x_m, state.y_m)
    speeds = (state.yaw_rad, state.speed_mps, state.lateral_speed_mps, state.yaw_rate_radps)
    return all(abs(v) <= MAX_POSITION_M for v in where) and all(abs(v) <= MAX_SPEED for v in speeds)


def missed_between(before: VehicleState, now: VehicleState) -> int:
    """Return the time between two reports that their car cannot have been moved in [ns].

    A simulated car moves by `LONGEST_TICK_NS` a step at most, and reports at each step. A real one
    drives on while its computer sleeps.
    """
    if now.source != "simulated":
        return 0
    driven_ns = (now.seq - before.seq) * LONGEST_TICK_NS
    return min(max(0, now.t_ns - before.t_ns - driven_ns), GONE_NS)


@dataclass(frozen=True, slots=True)
class Echo:
    """A push that the agent's reports do not show yet.

    Attributes:
        number: Of the contact that reports it.
        dv: (3,) change of velocity x, y and yaw rate.
        shift: (3,) change of x, y and yaw.
    """

    number: int
    hit_ns: int
    dv: Floats
    shift: Floats


@dataclass(slots=True)
class RemoteCar:
    """One remote or real car.

    Attributes:
        session: Of its agent; when this session ends, the car is lost.
        index: Its vehicle index, also in the contact space.
        pose: Of the rear axle, from the newest report, or where it was to start.
        received_ns: When that report arrived, on the world's clock.
        lost_ns: Since when its agent is known to be gone or silent; None while it is there.
        dead: Whether the session ended: its reports count only when it is there again.
        missed_ns: Time that its agent let pass without moving it, by the times of its reports.
    """

    name: str
    kind: str
    session: str
    car: Car
    car_file: str
    tag_id: int
    index: int
    lease: Lease
    pose: Pose2
    received_ns: int
    state: VehicleState | None = None
    lost_ns: int | None = None
    dead: bool = False
    missed_ns: int = 0
    _ahead: float = field(init=False)  # from the rear axle to the centre of gravity [m]
    _motion: tuple[VehicleState | None, Floats] | None = None  # reported, for all contact steps
    _echo: deque[Echo] = field(default_factory=deque)
    _contact_number: int = 0
    _dv: Floats = field(default_factory=lambda: np.zeros(3))
    _shift: Floats = field(default_factory=lambda: np.zeros(3))
    _against: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self._ahead = shape_of(self.car).cog_to_rear_axle

    @property
    def alive(self) -> bool:
        """Whether its agent is there."""
        return self.lost_ns is None

    @property
    def speed(self) -> float:
        """As reported [m/s]; 0 before the first report."""
        return self.state.speed_mps if self.state is not None else 0.0

    @property
    def battery_charge(self) -> float | None:
        """What is left in its battery, 0 to 1, as reported; None: unknown, or no such share."""
        charge = None if self.state is None else self.state.battery_charge
        return charge if charge is not None and 0.0 <= charge <= 1.0 else None

    def age_ns(self, now_ns: int) -> int:
        """Return how old its newest report is, on the world's clock."""
        return max(0, now_ns - self.received_ns)

    def follow(self, state: VehicleState, now_ns: int) -> bool:
        """Apply a report; return whether it was newer than the last one."""
        if self.dead or (self.state is not None and state.seq <= self.state.seq):
            return False
        if self.state is not None:
            self.missed_ns += missed_between(self.state, state)
        self.state, self.received_ns, self.lost_ns = state, now_ns, None
        self.pose = Pose2(state.x_m, state.y_m, state.yaw_rad)
        while self._echo and self._echo[0].number <= state.contacts:
            self._make_up(self._echo.popleft(), now_ns)
        return True

    def _make_up(self, felt: Echo, now_ns: int) -> None:
        """Correct the agent for the distance it drove before it applied a push.

        Its report comes one step after it felt it: that much of the way is in the report.
        """
        late = seconds(min(max(0, now_ns - felt.hit_ns - REPORT_NS), ANSWER_NS))
        if felt.dv.any() and late:
            self._shift += late * felt.dv
            self._echo.append(Echo(self._contact_number + 1, now_ns, np.zeros(3), late * felt.dv))

    def motion(self, now_ns: int) -> Floats:
        """Return x, y, yaw, vx, vy, yaw rate of the centre of gravity, (6,), map frame."""
        row = self._reported()
        row[:3] += row[3:] * seconds(min(self.age_ns(now_ns), STALE_NS))
        patience_ns = ANSWER_NS if self.state is not None and self.state.contacts else ECHO_NS
        while self._echo and self.received_ns - self._echo[0].hit_ns > patience_ns:
            self._echo.popleft()
        for echo in self._echo:
            since = seconds(min(max(0, now_ns - echo.hit_ns), STALE_NS))
            row[3:] += echo.dv
            row[:3] += echo.dv * since + echo.shift
        return row

    def _reported(self) -> Floats:
        """Return the motion as last reported, (6,), as in `motion`; one that is lost stands."""
        basis = self.state if self.alive else None
        if self._motion is None or self._motion[0] is not basis:
            speeds = (0.0, 0.0, 0.0)
            if basis is not None:
                speeds = (basis.speed_mps, basis.lateral_speed_mps, basis.yaw_rate_radps)
            self._motion = basis, cog_motion(self._ahead, np.array([[*self.pose, *speeds]]))[0]
        return self._motion[1].copy()

    def hit(self, dv: Floats, shift: Floats, against: set[str], now_ns: int) -> None:
        """Note what one contact step did to it: both changes are (3,), as in `Echo`."""
        self._echo.append(Echo(self._contact_number + 1, now_ns, dv, shift))
        self._dv += dv
        self._shift += shift
        self._against |= against

    def contact(self, now_ns: int) -> Contact | None:
        """Return the contact to be sent to its agent since the last time, if any."""
        if not (self._dv.any() or self._shift.any()):
            return None
        (dvx, dvy, rate), (dx, dy, turn) = self._dv.tolist(), self._shift.tolist()
        self._contact_number += 1
        contact = Contact(
            vehicle=self.name,
            t_ns=now_ns,
            number=self._contact_number,
            dvx_mps=dvx,
            dvy_mps=dvy,
            dyaw_rate_radps=rate,
            dx_m=dx,
            dy_m=dy,
            dyaw_rad=turn,
            against=tuple(sorted(self._against)),
        )
        self._dv, self._shift, self._against = np.zeros(3), np.zeros(3), set()
        return contact
