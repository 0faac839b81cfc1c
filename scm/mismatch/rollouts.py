"""A drive driven again by many parameter sets at once: rows of one fleet, one compiled car.

The car has every listed effect at its neutral numbers, which leave the motion as it was bit for
bit, so one kernel serves all hypotheses. Motion of the body contracts under recorded commands and
needs no restart; the pose does not, and is carried back to the measured one twice a second.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats
from scm.geometry import Pose2
from scm.mismatch.commanded import Commanded
from scm.mismatch.drive import RUN_IN_S, STEP_S, Drive
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet, VehicleStatus
from scm.vehicles.fleet_rows import WHEELS, pool

ROWS, THREADS = 32, 2
TETHER_STEPS = 50
SIGNALS = (
    "speed", "lateral_speed", "yaw_rate", "accel_x", "accel_y", "steer_angle",
    "wheel_angle.fl", "wheel_angle.fr", "wheel_angle.rl", "wheel_angle.rr",
)  # fmt: skip
THROTTLE_DELAY, STEERING_DELAY = "drive.delay_s", "steering.delay_s"
COMMAND_CLOCK = "clock.commands_s"  # commands take effect so much later than they are stamped
Numbers = Mapping[str, float]
_Driven = tuple[dict[str, Floats], Bools]


@dataclass(frozen=True, slots=True)
class Motions:
    """What each parameter set did, on the drive's edges, (steps + 1, sets).

    Attributes:
        ok: Whether the car stayed within physical bounds, (sets,).
    """

    signals: Mapping[str, Floats]
    ok: Bools

    def __getitem__(self, name: str) -> Floats:
        return self.signals[name]


class Rollouts:
    """Drives one recording again."""

    def __init__(self, drive: Drive, car: Car) -> None:
        self.drive, self.car = drive, car
        self._fleets = [Fleet(car, ROWS) for _ in range(THREADS)]
        self.params = tuple(column.param for column in self._fleets[0].columns)
        self._column = {param.key: i for i, param in enumerate(self.params)}
        smoothed, edges = drive.smoothed, drive.edges
        psi = smoothed["pose.yaw"].at(edges)
        px, py = drive.point
        c, s = np.cos(psi), np.sin(psi)
        self._x = smoothed["pose.x"].at(edges) - c * px + s * py
        self._y = smoothed["pose.y"].at(edges) - s * px - c * py
        self._yaw = psi

    def run(self, sets: Sequence[Numbers]) -> Motions:
        """Drive all parameter sets; each is nominal but for the numbers it names by key."""
        chunks = [sets[i : i + ROWS] for i in range(0, len(sets), ROWS)]
        jobs = [(self._fleets[k % THREADS], chunk) for k, chunk in enumerate(chunks)]
        shares = [jobs[k::THREADS] for k in range(THREADS)]
        others = pool(THREADS).map(self._drive_all, shares[1:])
        done = [self._drive_all(shares[0]), *others]
        parts = [done[k % THREADS][k // THREADS] for k in range(len(chunks))]
        return Motions(
            {name: np.concatenate([p[0][name] for p in parts], axis=1) for name in SIGNALS},
            np.concatenate([p[1] for p in parts]),
        )

    def _drive_all(self, jobs: Sequence[tuple[Fleet, Sequence[Numbers]]]) -> list[_Driven]:
        return [self._run(fleet, sets) for fleet, sets in jobs]

    def _run(self, fleet: Fleet, sets: Sequence[Numbers]) -> _Driven:
        n, edges = len(sets), self.drive.edges
        delays = self._set(fleet, sets)
        self._begin(fleet, n, delays)
        commands = [
            means(command, edges, delays[k])
            for k, command in enumerate((self.drive.throttle, self.drive.steering))
        ]
        out, first = {s: np.empty((len(edges), n)) for s in SIGNALS}, _now(fleet)
        for name in SIGNALS:
            out[name][0] = first[name][:n]
        for a in range(0, len(edges) - 1, TETHER_STEPS):
            b = min(a + TETHER_STEPS, len(edges) - 1)
            if self.drive.battery is not None:
                fleet.battery[:n] = self.drive.battery[a]
            got = fleet.rollout(commands[0][a:b], commands[1][a:b], STEP_S, SIGNALS)
            for name in SIGNALS:
                out[name][a + 1 : b + 1] = got[name][:, :n]
            self._carry(fleet, n, b)
        return out, fleet.status[:n] == VehicleStatus.OK

    def _set(self, fleet: Fleet, sets: Sequence[Numbers]) -> Floats:
        """Give each row its numbers; return the commands' delays, (2, rows)."""
        delays = np.zeros((2, fleet.capacity))
        for row in range(fleet.capacity):
            fleet.remove(row)
        for numbers in sets:
            row = fleet.add(Pose2(self._x[0], self._y[0], self._yaw[0]))
            for key, value in numbers.items():
                if key == COMMAND_CLOCK:
                    delays[:, row] += value
                elif key in (THROTTLE_DELAY, STEERING_DELAY):
                    delays[int(key == STEERING_DELAY), row] += value
                elif key in self._column:
                    fleet.parameters[row, self._column[key]] = value
        return delays

    def _begin(self, fleet: Fleet, n: int, delays: Floats) -> None:
        """Start every row in the measured motion, its actuators run in by the commands before."""
        drive = self.drive
        before = drive.edges[0] + STEP_S * np.arange(-round(RUN_IN_S / STEP_S), 1)
        fleet.rollout(
            means(drive.throttle, before, delays[0]), means(drive.steering, before, delays[1]),
            STEP_S, (),
        )  # fmt: skip
        x, y, yaw = (drive.smoothed[f"pose.{n}"] for n in ("x", "y", "yaw"))
        psi = float(self._yaw[0])
        vx, vy = float(x.rate[0]), float(y.rate[0])
        c, s = np.cos(psi), np.sin(psi)
        pose = Pose2(float(self._x[0]), float(self._y[0]), psi)
        for row in range(n):
            fleet.place(row, pose, c * vx + s * vy, 0.0, float(yaw.rate[0]), keep_actuators=True)

    def _carry(self, fleet: Fleet, n: int, k: int) -> None:
        """Carry every row to the measured pose; its motion in its own frame stays."""
        rows = np.arange(n)
        now = fleet.planar_cogs(rows)
        turn = self._yaw[k] - fleet.yaw[:n]
        turn = np.arctan2(np.sin(turn), np.cos(turn))
        c, s = np.cos(turn), np.sin(turn)
        arm_x, arm_y = now[:, 0] - fleet.x[:n], now[:, 1] - fleet.y[:n]
        changes = np.stack(
            (
                c * now[:, 3] - s * now[:, 4] - now[:, 3],
                s * now[:, 3] + c * now[:, 4] - now[:, 4],
                np.zeros(n),
                self._x[k] + c * arm_x - s * arm_y - now[:, 0],
                self._y[k] + s * arm_x + c * arm_y - now[:, 1],
                turn,
            ),
            axis=1,
        )
        fleet.push_rows(rows, changes)


def _now(fleet: Fleet) -> dict[str, Floats]:
    """Return every signal of a fleet's cars as they are."""
    wheel = dict(zip(WHEELS, fleet.wheel_angle.T, strict=True))
    return {s: wheel[s[-2:]] if "." in s else getattr(fleet, s) for s in SIGNALS}


def means(command: Commanded, edges: Floats, delays: Floats) -> Floats:
    """Return a command for each row, computed once for each different delay."""
    different, which = np.unique(delays, return_inverse=True)
    values = command.means(edges, different)
    return values[:, 0] if len(different) == 1 else np.ascontiguousarray(values[:, which])
