"""What the sensors would have recorded of a simulated motion, faults of measurement included.

The pose is integrated from simulated body speeds along the measured heading, so a heading error of
the simulator does not turn the whole path; it shows in the yaw itself.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.mismatch.fit.rollouts import Motions
from scm.replay.drive import STEP_S, WHEELS, Drive
from scm.replay.numbers import COMMAND_CLOCK, NEUTRAL, POSE_CLOCK, Numbers, changes_in
from scm.vehicles.jit import array_kernel

POSES = ("pose.x", "pose.y", "pose.yaw")
_LATE = (COMMAND_CLOCK, POSE_CLOCK, "measure.pose_delay_s", "measure.clock_offset_s")
_POSE = (*_LATE, "measure.clock_rate", "measure.pose_scale", "measure.camera_tilt_x_per_m",
         "measure.camera_tilt_y_per_m", "measure.pose_heading_rad")  # fmt: skip
_POINT = ("measure.pose_point_x_m", "measure.pose_point_y_m")


class Prediction:
    """Predicts every stream of a drive."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self._taps = {s.name: (s.taps - drive.edges[0]) / STEP_S for s in drive.streams}
        x, y, yaw = (drive.smoothed[name] for name in POSES)
        values = np.stack((x.at(yaw.t), y.at(yaw.t), yaw.value))
        self._seen = yaw.t, values, np.stack((x.rate_at(yaw.t), y.rate_at(yaw.t), yaw.rate))
        self._counts = 0.0
        if any(s.name.startswith("encoder.") for s in drive.streams):
            self._counts = drive.car.value("encoder.counts_per_revolution") / (2.0 * np.pi)

    def residuals(self, motions: Motions, faults: Sequence[Numbers]) -> list[Floats]:
        """Return measured minus predicted of every stream, each (samples, sets)."""
        now = self._faults(faults)
        path = self._path(motions, now)
        found = []
        for stream in self.drive.streams:
            predicted = path.get(stream.name)
            if predicted is None:
                variable = self.sensor(stream.name, motions, now)
                at, late = self._taps[stream.name], now[COMMAND_CLOCK][0]
                predicted = np.empty((len(at), len(late)))
                _tapped(at, late / STEP_S, variable, predicted)
            found.append(stream.values[:, None] - predicted)
        return found

    def _faults(self, sets: Sequence[Numbers]) -> dict[str, Floats]:
        """Return each fault's number in each set, (1, sets); (edges, sets) where it changes."""
        now = {key: np.array([[n.get(key, value) for n in sets]]) for key, value in NEUTRAL.items()}
        edges = self.drive.edges
        for change in changes_in(sets):
            if change.key in now:
                if len(now[change.key]) == 1:
                    now[change.key] = np.repeat(now[change.key], len(edges), axis=0)
                left = 1.0 - change.done(edges, edges + STEP_S)
                now[change.key][:, change.column] += left * (change.before - change.after)
        return now

    def _path(self, motions: Motions, now: Mapping[str, Floats]) -> dict[str, Floats]:
        """Return what the camera records of each set's way from its start, (samples, sets).

        Each set is seen in its own camera's time, which may be late and run fast.
        """
        drive, edges = self.drive, self.drive.edges
        rows = max(len(now[key]) for key in (*_POSE, *_POINT))
        now = {key: _as_rows(now[key], rows) for key in (*_POSE, *_POINT)}
        late = np.sum([now[key] for key in _LATE], axis=0)
        rate, sets = now["measure.clock_rate"], late.shape[1]
        faulty = np.any([(now[key] != NEUTRAL[key]).any(axis=0) for key in _POSE], axis=0)
        tilt = np.stack((now["measure.camera_tilt_x_per_m"], now["measure.camera_tilt_y_per_m"]))
        arm = (drive.point[0] + now[_POINT[0]], drive.point[1] + now[_POINT[1]])
        way = np.empty((3, len(edges), sets))
        _drive_way(
            edges, late, rate, *self._seen, motions["speed"], motions["lateral_speed"],
            motions["yaw_rate"], *arm, now["measure.pose_heading_rad"], tilt,
            now["measure.pose_scale"], STEP_S, np.zeros(sets, np.int64), np.empty(3),
            np.zeros((3, sets)), way,
        )  # fmt: skip
        found = {}
        for name, variable in zip(POSES, way, strict=True):
            t = drive.stream(name).t
            found[name] = np.empty((len(t), sets))
            _seen_late(edges, t, late, rate, faulty, variable, found[name])
        return found

    def sensor(self, name: str, motions: Motions, now: Mapping[str, Floats]) -> Floats:
        """Return what any other sensor reads, on the drive's edges, (edges, sets)."""
        if name == "imu.gyro_z":
            rate = motions["yaw_rate"]
            return now["measure.gyro_scale"] * rate + now["measure.gyro_bias_rad_s"]
        if name.startswith("imu.accel_"):
            ax, ay = motions["accel_x"], motions["accel_y"]
            c, s = np.cos(now["measure.imu_angle_rad"]), np.sin(now["measure.imu_angle_rad"])
            if name.endswith("x"):
                return c * ax + s * ay + now["measure.accel_bias_x_m_s2"]
            return c * ay - s * ax + now["measure.accel_bias_y_m_s2"]
        counted = 1.0 - now["measure.encoder_loss"]
        if name.startswith("encoder."):
            return _counts(counted, self._counts * motions[f"wheel_angle.{WHEELS[name]}"])
        if name.startswith("wheel_speed."):
            return counted * np.gradient(motions[f"wheel_angle.{name[-2:]}"], STEP_S, axis=0)
        plain = {"speed": "speed", "velocity.x": "speed", "velocity.y": "lateral_speed"}
        variable = motions[plain.get(name, "yaw_rate")]
        return now["measure.speed_scale"] * variable if name == "speed" else variable


def _counts(share: Floats, turned: Floats) -> Floats:
    """Return what encoders count of wheels that turned, (edges, sets), if they count a share.

    A share that changes, (edges, sets), counts from when it does.
    """
    if share.shape != turned.shape:
        return np.asarray(share * turned)
    return np.cumsum(share * np.diff(turned, axis=0, prepend=0.0), axis=0)


def _as_rows(values: Floats, rows: int) -> Floats:
    """Return numbers of sets, (1 or rows, sets), as (rows, sets)."""
    return values if len(values) == rows else np.repeat(values, rows, axis=0)


@array_kernel
def _tapped(at: Floats, late: Floats, variable: Floats, out: Floats) -> None:
    """Take a variable (edges, sets) at places between its edges, each set as many steps late."""
    last = len(variable) - 2
    for k in range(len(at)):
        for b in range(len(late)):
            total = 0.0
            for j in range(at.shape[1]):
                place = at[k, j] - late[b]
                i = min(max(int(place), 0), last)
                total += variable[i, b] + (place - i) * (variable[i + 1, b] - variable[i, b])
            out[k, b] = total / at.shape[1]


@array_kernel
def _drive_way(
    edges: Floats, late: Floats, rate: Floats, t: Floats, values: Floats, rates: Floats,
    speed: Floats, lateral_speed: Floats, yaw_rate: Floats, arm_x: Floats, arm_y: Floats,
    heading: Floats, tilt: Floats, scale: Floats, step: float, row: Ints, seen: Floats,
    last: Floats, way: Floats,
) -> None:  # fmt: skip
    """Write each set's way in the measured frame, from its start, by trapezoids along its time.

    `t`, `values` and `rates`, (3, n), are the measured pose, smoothed; `way` is x, y and yaw, (3,
    edges, sets). Numbers of the sets are (1, sets), or (edges, sets) where any changes. `row`, all
    0, `seen` and `last` are room to work in.
    """
    c, s = 1.0, 0.0
    for k in range(len(edges)):
        n = k if len(late) > 1 else 0
        for b in range(late.shape[1]):
            if (
                b == 0
                or late[n, b] != late[n, b - 1]
                or rate[n, b] != rate[n, b - 1]
                or heading[n, b] != heading[n, b - 1]
            ):
                stamp = edges[k] + late[n, b] + rate[n, b] * (edges[k] - edges[0])
                stamp = min(max(stamp, t[0]), t[len(t) - 1])
                i = row[b]
                while i < len(t) - 2 and t[i + 1] <= stamp:
                    i += 1
                while i > 0 and t[i] > stamp:  # the stamps have become later
                    i -= 1
                row[b] = i
                _measured(stamp, i, t, values, rates, seen)
                c, s = np.cos(seen[2] - heading[n, b]), np.sin(seen[2] - heading[n, b])
            turning = yaw_rate[k, b]
            along = speed[k, b] - turning * arm_y[n, b]
            across = lateral_speed[k, b] + turning * arm_x[n, b]
            vx, vy = c * along - s * across, s * along + c * across
            if tilt[0, n, b] != 0.0 or tilt[1, n, b] != 0.0:
                size = 1.0 / (1.0 - tilt[0, n, b] * seen[0] - tilt[1, n, b] * seen[1])
                x, y = seen[0] * size, seen[1] * size
                depth = 1.0 + tilt[0, n, b] * x + tilt[1, n, b] * y
                turn = (tilt[0, n, b] * vx + tilt[1, n, b] * vy) / (depth * depth)
                vx, vy = vx / depth - x * turn, vy / depth - y * turn
            vx, vy = scale[n, b] * vx, scale[n, b] * vy
            if k == 0:
                way[0, k, b] = way[1, k, b] = way[2, k, b] = 0.0
            else:
                way[0, k, b] = way[0, k - 1, b] + 0.5 * step * (vx + last[0, b])
                way[1, k, b] = way[1, k - 1, b] + 0.5 * step * (vy + last[1, b])
                way[2, k, b] = way[2, k - 1, b] + 0.5 * step * (turning + last[2, b])
                if n > 0:
                    _leap(n, b, seen, c, s, arm_x, arm_y, heading, tilt, scale, way[:, k, b])
            last[0, b], last[1, b], last[2, b] = vx, vy, turning


@array_kernel
def _leap(
    n: int, b: int, seen: Floats, c: float, s: float, arm_x: Floats, arm_y: Floats,
    heading: Floats, tilt: Floats, scale: Floats, way: Floats,
) -> None:  # fmt: skip
    """Add to a pose, (3,), what a fault that changes at row `n` moves in the picture at once."""
    way[2] += heading[n, b] - heading[n - 1, b]
    along, aside = arm_x[n, b] - arm_x[n - 1, b], arm_y[n, b] - arm_y[n - 1, b]
    way[0] += scale[n, b] * (c * along - s * aside)
    way[1] += scale[n, b] * (s * along + c * aside)
    x, y = seen[0] / scale[n, b], seen[1] / scale[n, b]
    size = 1.0 / (1.0 - tilt[0, n, b] * x - tilt[1, n, b] * y)
    x, y = x * size, y * size
    now = scale[n, b] / (1.0 + tilt[0, n, b] * x + tilt[1, n, b] * y)
    before = scale[n - 1, b] / (1.0 + tilt[0, n - 1, b] * x + tilt[1, n - 1, b] * y)
    way[0] += (now - before) * x
    way[1] += (now - before) * y


@array_kernel
def _measured(stamp: float, i: int, t: Floats, values: Floats, rates: Floats, out: Floats) -> None:
    """Write the measured pose at a time within row `i`, by cubics as `Smooth.at`."""
    h = t[i + 1] - t[i]
    s = (stamp - t[i]) / h
    for n in range(3):
        a, b = values[n, i], values[n, i + 1]
        da, db = rates[n, i] * h, rates[n, i + 1] * h
        bend = 3.0 * (b - a) - 2.0 * da - db
        out[n] = a + s * (da + s * (bend + s * (2.0 * (a - b) + da + db)))


@array_kernel
def _seen_late(
    edges: Floats, t: Floats, late: Floats, rate: Floats, faulty: Bools, variable: Floats,
    out: Floats,
) -> None:  # fmt: skip
    """Take a variable (edges, sets) at stamps `t` of cameras with clocks of their own."""
    first, final = edges[0], edges[len(edges) - 1]
    step = edges[1] - edges[0]
    for k in range(len(t)):
        n = min(max(int((t[k] - first) / step), 0), len(late) - 1)
        for b in range(late.shape[1]):
            true = first + (t[k] - late[n, b] - first) / (1.0 + rate[n, b])
            if faulty[b]:
                true = min(max(true, first), final)
            at = (true - first) / step
            i = min(max(int(at), 0), len(edges) - 2)
            out[k, b] = variable[i, b] + (at - i) * (variable[i + 1, b] - variable[i, b])
