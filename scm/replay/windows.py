"""Free runs of many windows of one drive by several cars, side by side in one fleet.

A window starts in the measured motion. The rest of the car's state, such as its servo, motor
temperature and time since power-on, comes from simulating the same car up to there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.geometry import Pose2
from scm.replay.camera import Camera, Moved
from scm.replay.drive import RUN_IN_S, STEP_S, Drive
from scm.replay.numbers import (
    COMMAND_CLOCK,
    MOTION_VARIABLES,
    STEERING_DELAY,
    TETHER_STEPS,
    THROTTLE_CLOCK,
    THROTTLE_DELAY,
    Numbers,
)
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet
from scm.vehicles.vehicle_status import VehicleStatus

BEYOND_STEPS = 3  # behind the last edge, for which commands hold
RECORDED_STATES = ("x", "y", *MOTION_VARIABLES, "yaw")


@dataclass(frozen=True, slots=True)
class Side:
    """A car to be driven: its numbers, and what the camera makes of its drive.

    Attributes:
        like: Number of the side whose memory it has at each window's start, its own if None.
        push: Further force along the body at a window's start, and further angle of the wheels
            [N, rad].
    """

    numbers: Numbers
    camera: Camera
    like: int | None = None
    push: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Runs:
    """What the sides did in their windows.

    Attributes:
        variables: (steps + 1, sides, windows).
        ok: Whether the car stayed within physical bounds, (sides, windows).
    """

    variables: Mapping[str, Floats]
    ok: Bools

    def __getitem__(self, name: str) -> Floats:
        return self.variables[name]


@dataclass(frozen=True, slots=True)
class _Leader:
    """A car that drives the whole recording: its commands, and its motion as measured."""

    side: Side
    commands: Floats
    moved: Moved


class Windows:
    """Drives windows of one recording again."""

    def __init__(self, drive: Drive, car: Car) -> None:
        self.drive, self.car, self._blind = drive, car, drive.is_blind(drive.edges)

    def run(self, sides: Sequence[Side], starts: Ints, steps: int) -> Runs:
        """Drive all windows.

        Args:
            sides: Cars; those that are like others follow them.
            starts: First edge of each window of each side, (sides, windows), rising.
            steps: Length of a window.
        """
        leaders = [i for i, side in enumerate(sides) if side.like is None]
        windows = starts.shape[1]
        fleet = Fleet(self.car, len(leaders) + len(sides) * windows)
        commands = [self._commands(side.numbers) for side in sides]
        leading = [
            _Leader(sides[i], commands[i], sides[i].camera.motion(self.drive.edges))
            for i in leaders
        ]
        self._lead(fleet, leading)
        rows = len(leaders) + np.arange(len(sides) * windows).reshape(len(sides), windows)
        moved = [
            side.camera.motion(self.drive.edges[s]) for side, s in zip(sides, starts, strict=True)
        ]
        due = sorted((int(starts[i, w]), i, w) for i in range(len(sides)) for w in range(windows))
        values = [self._values(fleet, side.numbers) for side in sides]
        now = 0
        for k, i, w in due:
            now = self._advance(fleet, leading, now, k)
            like = sides[i].like
            leader = leaders.index(i if like is None else like)
            row = int(rows[i, w])
            self._start(fleet, leader, row, k, values[i], moved[i], w)
            if any(sides[i].push):
                self._push(fleet, row, sides[i].push)
        fleet.alive[:] = True
        fleet.alive[: len(leaders)] = False
        return self._free(fleet, commands, starts, steps, len(leaders))

    def _commands(self, numbers: Numbers) -> Floats:
        """Return throttle and steering of each step, as late as the numbers say, (2, steps).

        They go on for a few steps behind the drive: its last window may end between two edges.
        """
        late = [
            sum(numbers.get(key, 0.0) for key in (COMMAND_CLOCK, *keys))
            for keys in ((THROTTLE_DELAY, THROTTLE_CLOCK), (STEERING_DELAY,))
        ]
        before = STEP_S * np.arange(-round(RUN_IN_S / STEP_S), 0)
        after = self.drive.edges[-1] + STEP_S * np.arange(1, BEYOND_STEPS + 1)
        edges = np.concatenate((self.drive.edges[0] + before, self.drive.edges, after))
        return np.stack([
            command.means(edges, np.array([delay]))[:, 0]
            for command, delay in zip((self.drive.throttle, self.drive.steering), late, strict=True)
        ])  # fmt: skip

    def _lead(self, fleet: Fleet, leading: Sequence[_Leader]) -> None:
        """Put one car of each side at the recording's start, its actuators run in."""
        for i, one in enumerate(leading):
            x, y, yaw = (float(v[0]) for v in (one.moved.x, one.moved.y, one.moved.yaw))
            fleet.add(Pose2(x, y, yaw))
            fleet.parameters[i] = self._values(fleet, one.side.numbers)
        run_in = round(RUN_IN_S / STEP_S)
        self._drive(fleet, [one.commands[:, :run_in] for one in leading])
        for i, one in enumerate(leading):
            _place(fleet, i, one.moved, 0)

    def _values(self, fleet: Fleet, numbers: Numbers) -> Floats:
        """Return a row's numbers: the car's own but for those named."""
        return np.array([
            self.car.value(key) if key in (THROTTLE_DELAY, STEERING_DELAY)
            else numbers.get(key, self.car.value(key))
            for key in (c.param.key for c in fleet.columns)
        ])  # fmt: skip

    def _drive(self, fleet: Fleet, commands: Sequence[Floats]) -> None:
        wide = np.zeros((2, commands[0].shape[1], fleet.capacity))
        for i, command in enumerate(commands):
            wide[:, :, i] = command
        fleet.rollout(wide[0], wide[1], STEP_S, ())

    def _advance(self, fleet: Fleet, leading: Sequence[_Leader], now: int, to: int) -> int:
        """Let the leaders drive on, carried to the measured pose from time to time."""
        run_in = round(RUN_IN_S / STEP_S)
        while now < to:
            then = min(now + TETHER_STEPS, to)
            if self.drive.battery is not None:
                fleet.battery[: len(leading)] = self.drive.battery[now]
            self._drive(fleet, [one.commands[:, run_in + now : run_in + then] for one in leading])
            now = then
            if not self._blind[now]:
                _carry(fleet, [one.moved for one in leading], now)
        return now

    def _start(
        self, fleet: Fleet, leader: int, row: int, now: int, values: Floats, moved: Moved,
        window: int,
    ) -> None:  # fmt: skip
        """Let a window's car stand where its leader is, in the measured motion."""
        fleet.copy_row(leader, row)
        fleet.parameters[row] = values
        _place(fleet, row, moved, window)
        fleet.time[row] = fleet.time[leader]
        turned = fleet.wheel_angle[leader]
        fleet.wheel_angle[row] = turned + np.tile(self.drive.turned[now] - turned[2:], 2)
        if self.drive.battery is not None:
            fleet.battery[row] = self.drive.battery[now]
        fleet.alive[row] = False

    def _push(self, fleet: Fleet, row: int, push: tuple[float, float]) -> None:
        """Push a row along its body, and turn its wheels, from now on."""
        yaw, column = float(fleet.yaw[row]), {c.param.key: j for j, c in enumerate(fleet.columns)}
        fleet.parameters[row, column["wind.force_x_n"]] += push[0] * np.cos(yaw)
        fleet.parameters[row, column["wind.force_y_n"]] += push[0] * np.sin(yaw)
        fleet.parameters[row, column["steering.trim_rad"]] += push[1]

    def _free(
        self, fleet: Fleet, commands: Sequence[Floats], starts: Ints, steps: int, leaders: int
    ) -> Runs:
        sides, windows = starts.shape
        run_in = round(RUN_IN_S / STEP_S)
        wide = np.zeros((2, steps, fleet.capacity))
        at = starts[:, None, :] + np.arange(steps)[:, None]
        for i, command in enumerate(commands):
            rows = slice(leaders + i * windows, leaders + (i + 1) * windows)
            wide[:, :, rows] = command[:, run_in + at[i]]
        first = {name: _signal(fleet, name)[leaders:] for name in RECORDED_STATES}
        got = self._rolled(fleet, wide, starts.ravel(), leaders)
        variables = {
            name: np.concatenate((first[name][None], got[name][:, leaders:])).reshape(
                steps + 1, sides, windows
            )
            for name in RECORDED_STATES
        }
        ok = fleet.status[leaders:].reshape(sides, windows) == VehicleStatus.OK
        return Runs(variables, ok)

    def _rolled(self, fleet: Fleet, wide: Floats, starts: Ints, leaders: int) -> dict[str, Floats]:
        """Drive all windows through their commands, at the voltage measured meanwhile."""
        battery = self.drive.battery
        if battery is None:
            return dict(fleet.rollout(wide[0], wide[1], STEP_S, RECORDED_STATES))
        parts = []
        for a in range(0, wide.shape[1], TETHER_STEPS):
            part = wide[:, a : a + TETHER_STEPS]
            fleet.battery[leaders:] = battery[np.minimum(starts + a, len(battery) - 1)]
            parts.append(fleet.rollout(part[0], part[1], STEP_S, RECORDED_STATES))
        return {name: np.concatenate([part[name] for part in parts]) for name in RECORDED_STATES}


def at_times(variable: Floats, since: Floats) -> Floats:
    """Return variables (steps + 1, sides, windows) at times since the start, (sides, windows)."""
    at = since / STEP_S
    row = np.clip(at.astype(np.int64), 0, len(variable) - 2)
    low = np.take_along_axis(variable, row[None], axis=0)[0]
    high = np.take_along_axis(variable, row[None] + 1, axis=0)[0]
    return np.asarray(low + (at - row) * (high - low))


def _place(fleet: Fleet, row: int, moved: Moved, i: int) -> None:
    pose = Pose2(float(moved.x[i]), float(moved.y[i]), float(moved.yaw[i]))
    fleet.place(row, pose, float(moved.speed[i]), float(moved.lateral_speed[i]),
                float(moved.yaw_rate[i]), keep_actuators=True)  # fmt: skip


def _signal(fleet: Fleet, name: str) -> Floats:
    """Return a copy of a variable as it is now, (capacity,)."""
    if "." not in name:
        return np.array(getattr(fleet, name))
    whole, wheel = name.split(".")
    return np.array(getattr(fleet, whole)[:, ("fl", "fr", "rl", "rr").index(wheel)])


def _carry(fleet: Fleet, measured: Sequence[Moved], k: int) -> None:
    """Carry the first rows to poses measured at an edge; their motion in their own frames stays."""
    rows = np.arange(len(measured))
    x, y, yaw = (np.array([getattr(m, n)[k] for m in measured]) for n in ("x", "y", "yaw"))
    now = fleet.planar_cogs(rows)
    turn = yaw - fleet.yaw[rows]
    turn = np.arctan2(np.sin(turn), np.cos(turn))
    c, s = np.cos(turn), np.sin(turn)
    arm_x, arm_y = now[:, 0] - fleet.x[rows], now[:, 1] - fleet.y[rows]
    fleet.push_rows(rows, np.stack((
        c * now[:, 3] - s * now[:, 4] - now[:, 3],
        s * now[:, 3] + c * now[:, 4] - now[:, 4],
        np.zeros(len(rows)),
        x + c * arm_x - s * arm_y - now[:, 0],
        y + s * arm_x + c * arm_y - now[:, 1],
        turn,
    ), axis=1))  # fmt: skip
