"""Mapping from LIDAR sweeps: time a sweep, errors of walls and trajectory, fit of real drives.

Run with `python -m bench autonomy_mapping`. A car drives laps of a simulated room; its sweeps are
those of `scm/vehicles/rays`, beam after beam, with Gaussian noise. The map begins where the car
does, so it is compared after the rigid motion that fits the two trajectories best. Where evo's
`evo_ape` is on the path (`pip install evo`), it says the trajectory's error too.
"""

import math
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from scm.arrays import Floats, Ints
from scm.clock import NS_PER_S
from scm.geometry import TAU, Pose2
from scm.maps.load import load_map
from scm.maps.segments import wall_segments
from scm.recording.bag import messages
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.march import march
from scm.vehicles.rays.scene import Scene
from vehicle_agent.autonomy.faces import field_of
from vehicle_agent.autonomy.mapping import Mapper
from vehicle_agent.autonomy.scan_match import match
from vehicle_agent.autonomy.sweep import Sweep, Twist, deskewed, twist_of

RATE_HZ, BEAMS, REACH_M = 7.0, 360, 12.0
BEARINGS: Floats = TAU / BEAMS * np.arange(BEAMS, dtype=np.float64)
MOUNT = Pose2(0.1445, 0.0, 0.0)
NEAREST_M = 0.35  # of a person: they walk round the car
DRIVES = (
    ("parking_school", 0.01, 0, None),
    ("parking_school", 0.025, 0, None),
    ("parking_school_obstacles", 0.025, 0, None),
    ("parking_school_obstacles", 0.025, 2, None),
    ("parking_school_obstacles", 0.025, 2, 0.03),
)
BAGS = Path(__file__).parents[2] / "shared" / "recordings" / "nigel_real"
ASSOCIATED_M, STRAIGHT, FEWEST = 0.2, 0.01, 8  # points of one wall; its variances; how many
SCANNER = Pose2(0.0, 0.0, 0.0)  # in real drives poses are the scanner's own
PIECE = 15  # points in a row
STANDING_M, DRIVING_M, SPACING_M, THIN_OUT = 0.03, 0.1, 0.05, 23


@dataclass(frozen=True, slots=True)
class Lap:
    """An ellipse that a car drives counter-clockwise, again and again; it starts gently.

    Attributes:
        middle, half_axes: [m].
        time_s: Of one lap.
    """

    middle: tuple[float, float] = (-0.15, 0.0)
    half_axes: tuple[float, float] = (0.5, 0.34)
    time_s: float = 14.0

    def pose(self, t: float) -> Pose2:
        """Return the car's pose at a time [s]."""
        angle = TAU / self.time_s * (t - math.tanh(t))
        (x, y), (a, b) = self.middle, self.half_axes
        yaw = math.atan2(b * math.cos(angle), -a * math.sin(angle))
        return Pose2(x + a * math.cos(angle), y + b * math.sin(angle), yaw)


def _block(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, ...]]:
    return [(x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)]


HALL = np.array(
    _block(-7.2, -5.2, 7.2, 5.2) + _block(-3.8, -2.3, 3.8, 2.3) + _block(-6.9, -1.0, -6.5, -0.2)
    + _block(4.3, -3.0, 4.6, -2.6) + _block(0.0, 4.5, 1.0, 5.2)
)  # fmt: skip
HALL_LAP = Lap((0.0, 0.0), (5.6, 3.8), 50.0)


def drive(
    walls: Floats, lap: Lap, noise_m: float, duration_s: float, *, people: int = 0, seed: int = 0
) -> Iterator[tuple[Pose2, Sweep]]:
    """Yield true poses and sweeps of a car that drives laps among walls (k, 4), and people."""
    rng = np.random.default_rng(seed)
    grid, small = WallGrid(walls), 1e-4
    ago_s = np.arange(BEAMS - 1.0, -1.0, -1.0) / (BEAMS * RATE_HZ)
    for k in range(round(duration_s * RATE_HZ)):
        t = k / RATE_HZ
        pose, before, after = lap.pose(t), lap.pose(t - small) @ MOUNT, lap.pose(t + small) @ MOUNT
        twist = twist_of(before.inverse() @ after, 2.0 * small)
        motion = np.array([[twist.along_mps, twist.across_mps, twist.yaw_rate_radps]])
        legs = [_person(t, number) for number in range(people)]
        legs = [leg for leg in legs if math.dist(leg[:, :2].mean(axis=0), pose[:2]) > NEAREST_M]
        outlines = np.concatenate([np.zeros((0, 4)), *legs])
        ranges = march(
            Scene(grid, outlines, np.full(len(legs), -1)), np.array([pose @ MOUNT]), motion,
            np.array([-1]), (0.0, TAU / BEAMS, BEAMS), REACH_M, 1.0 / RATE_HZ,
        )[0]  # fmt: skip
        ranges += rng.normal(0.0, noise_m, BEAMS)
        yield pose, Sweep(round(t * NS_PER_S), BEARINGS, ranges, ago_s)


def _person(t: float, number: int) -> Floats:
    """Return the outline (4, 4) of a leg that walks to and fro."""
    along = 0.6 * math.sin(0.5 * t + 2.0 * number)
    x, y = (0.1 + along, 0.45 - 0.15 * number) if number % 2 else (0.3 + 0.1 * number, along * 0.8)
    square = np.array(((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)))
    turned = 0.05 * square + np.array((x, y))
    return np.hstack((turned, np.roll(turned, -1, axis=0)))


def fit(found: Floats, true: Floats) -> Pose2:
    """Return the pose of the map's frame that takes places (n, 2) found onto the true ones best."""
    a, b = found - found.mean(axis=0), true - true.mean(axis=0)
    yaw = math.atan2(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a * b).sum()))
    x, y = Pose2(0.0, 0.0, yaw).apply(*map(float, found.mean(axis=0)))
    return Pose2(float(true[:, 0].mean()) - x, float(true[:, 1].mean()) - y, yaw)


def from_walls(points: Floats, walls: Floats) -> Floats:
    """Return how far points (m, 2) are from the nearest of the walls (k, 4) [m]."""
    x, y = (points[:, None, axis] - walls[None, :, axis] for axis in (0, 1))
    dx, dy = walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1]
    part = np.clip((x * dx + y * dy) / (dx * dx + dy * dy), 0.0, 1.0)
    return np.asarray(np.hypot(x - part * dx, y - part * dy).min(axis=1))


@dataclass(frozen=True, slots=True)
class Errors:
    """Of a map and the trajectory it was made from, root mean squares [m] and times [s].

    Attributes:
        evo_m: Of the trajectory, as evo computes it; NaN without evo.
    """

    trajectory_m: float
    evo_m: float
    wall_m: float
    sweep_s: float
    longest_s: float


def mapped(
    walls: Floats, sweeps: Iterator[tuple[Pose2, Sweep]], drift: float | None = None
) -> tuple[Mapper, Errors]:
    """Return the map of a drive, and its errors.

    Args:
        walls: (k, 4) true faces.
        drift: Of the way and of turns, that odometry measures too much; None: no odometry.
    """
    mapper, true, times = Mapper(MOUNT), list[Pose2](), list[float]()
    odometry = Pose2(0.0, 0.0, 0.0)
    for pose, sweep in sweeps:
        if true and drift is not None:
            x, y, yaw = true[-1].inverse() @ pose
            odometry @= Pose2(*((1.0 + drift) * part for part in (x, y, yaw)))
        true.append(pose)
        start = time.process_time()
        mapper.add(sweep, None if drift is None else odometry)
        times.append(time.process_time() - start)
    found, truth = np.array(mapper.trajectory), np.array(true)
    frame = fit(found[:, :2], truth[:, :2])
    placed = np.array([frame.apply(x, y) for x, y in found[:, :2]])
    faces = mapper.faces()
    middles = np.array([frame.apply(x, y) for x, y in 0.5 * (faces[:, :2] + faces[:, 2:])])
    return mapper, Errors(
        trajectory_m=_rms(np.hypot(*(placed - truth[:, :2]).T)),
        evo_m=evo_error_m(found, truth),
        wall_m=_rms(from_walls(middles, walls)),
        sweep_s=float(np.median(times)),
        longest_s=max(times[3:]),
    )


def evo_error_m(found: Floats, true: Floats) -> float:
    """Return evo's absolute trajectory error, aligned, of poses (n, 3); NaN without evo."""
    program = shutil.which("evo_ape")
    if program is None:
        return math.nan
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder, name) for name in ("true.tum", "found.tum")]
        for path, poses in zip(files, (true, found), strict=True):
            x, y, yaw = poses.T
            zero = np.zeros(len(poses))
            half = 0.5 * yaw
            lines = (np.arange(len(poses)), x, y, zero, zero, zero, np.sin(half), np.cos(half))
            np.savetxt(path, np.column_stack(lines))
        command = [program, "tum", *map(str, files), "--align"]
        output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    rmse = re.search(r"rmse\s+([0-9.]+)", output)
    return math.nan if rmse is None else float(rmse[1])


def _rms(values: Floats) -> float:
    return math.sqrt(float(np.mean(values**2)))


def recorded(path: Path) -> tuple[list[Sweep], Floats]:
    """Return a real drive's sweeps, and its odometry (m, 4): time [ns], x, y, yaw.

    The rays of these bags are read last one first, whatever their `time_increment` says: read
    so, straight walls stay straight while the car drives.
    """
    sweeps, odometry = [], []
    for _, _, message in messages(path, "/scan"):
        ranges, rays = np.array(message.ranges, np.float64), len(message.ranges)
        is_hit = (ranges >= message.range_min) & (ranges <= message.range_max)
        after = np.arange(rays) * message.time_increment
        end_ns = _stamp_ns(message) + round(NS_PER_S * after[-1])
        bearings = message.angle_min + message.angle_increment * np.arange(rays)
        sweeps.append(Sweep(end_ns, bearings, np.where(is_hit, ranges, np.inf), after))
    for _, _, message in messages(path, "/odom"):
        place, turn = message.pose.pose.position, message.pose.pose.orientation
        yaw = 2.0 * math.atan2(turn.z, turn.w)
        odometry.append((_stamp_ns(message), place.x, place.y, yaw))
    rays = max(len(sweep.ranges) for sweep in sweeps)
    return [one for one in sweeps if len(one.ranges) == rays], np.array(odometry, np.float64)


def _stamp_ns(message: Any) -> int:
    return int(message.header.stamp.sec) * NS_PER_S + int(message.header.stamp.nanosec)


@dataclass(frozen=True, slots=True)
class Fit:
    """How well the sweeps of a drive fit straight walls that the car saw before it drove off.

    Attributes:
        point_m: Median distance of their points.
        piece_m: Median of the distance of `PIECE` points together, which holds little noise.
    """

    point_m: float
    piece_m: float


def fit_of(poses: list[Pose2], sweeps: list[Sweep], twists: list[Twist], lines: Floats) -> Fit:
    """Return how well sweeps fit lines (k, 4): a place, and its normal."""
    points, pieces = [], []
    for pose, sweep, twist in zip(poses, sweeps, twists, strict=True):
        seen = deskewed(sweep, SCANNER, twist)
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        seen = seen @ np.array(((c, s), (-s, c))) + (pose.x, pose.y)
        apart = np.hypot(*(seen[:, None] - lines[None, :, :2]).transpose(2, 0, 1))
        nearest = apart.argmin(axis=1)
        is_near = apart[np.arange(len(seen)), nearest] < ASSOCIATED_M
        line = lines[nearest[is_near]]
        off = ((seen[is_near] - line[:, :2]) * line[:, 2:]).sum(axis=1)
        points.append(off)
        pieces.append(np.median(off[: len(off) // PIECE * PIECE].reshape(-1, PIECE), axis=1))
    return Fit(*(float(np.median(np.abs(np.concatenate(some)))) for some in (points, pieces)))


def lines_of(sweeps: list[Sweep]) -> Floats:
    """Return straight pieces of wall (k, 4), places and normals, that a standing car saw."""
    ranges = np.median([sweep.ranges for sweep in sweeps], axis=0)
    still = replace(sweeps[0], ranges=ranges)
    points = deskewed(still, SCANNER, Twist())
    lines = []
    for point in points:
        near = points[np.hypot(*(points - point).T) < ASSOCIATED_M]
        if len(near) < FEWEST:
            continue
        values, axes = np.linalg.eigh(np.cov(near.T))
        if values[0] < STRAIGHT * values[1]:
            lines.append((*near.mean(axis=0), *axes[:, 0]))
    return np.array(lines)


def twists_of(poses: list[Pose2], sweeps: list[Sweep]) -> list[Twist]:
    """Return the motion during each sweep, from the pose before to its own."""
    found = [Twist()]
    for (a, b), (first, second) in zip(pairwise(poses), pairwise(sweeps), strict=True):
        found.append(twist_of(a.inverse() @ b, (second.t_ns - first.t_ns) / NS_PER_S))
    return found


def thickness_of(poses: list[Pose2], sweeps: list[Sweep], twists: list[Twist]) -> float:
    """Return the root mean square of points to lines through all that lie within 15 cm [m]."""
    placed, last = [], -math.inf
    for pose, sweep, twist in zip(poses, sweeps, twists, strict=True):
        if math.hypot(pose.x, pose.y) - last < SPACING_M:  # standing sweeps count once
            continue
        last = math.hypot(pose.x, pose.y)
        placed.append([pose.apply(x, y) for x, y in deskewed(sweep, SCANNER, twist)])
    points = np.concatenate(placed)
    squares = []
    for point in points[::THIN_OUT]:
        near = points[np.hypot(*(points - point).T) < 0.15]
        if len(near) >= 20:
            values = np.linalg.eigvalsh(np.cov(near.T))
            if values[0] < 0.25 * values[1]:
                squares.append(values[0])
    return math.sqrt(float(np.mean(squares)))


@dataclass(frozen=True, slots=True)
class Real:
    """One recorded drive: our trajectory, and the odometry that the bag holds.

    Attributes:
        placed: Each sweep moved to where it fits the lines best: what no trajectory can improve.
        standing: Before the car drove off: what the scanner's noise leaves.
    """

    ours: Fit
    theirs: Fit
    placed: Fit
    standing: Fit
    thickness_m: float


def real(path: Path) -> Real:
    """Return what a real drive's sweeps say of two trajectories.

    The bag's odometry is given the best of its readings: a pose holds for the begin, the middle or
    the end of the sweep, sweeps are deskewed or not.
    """
    sweeps, odometry = recorded(path)
    mapper = Mapper(SCANNER)
    for sweep in sweeps:
        mapper.add(sweep)
    poses = mapper.trajectory
    way = np.hypot(*np.array(poses)[:, :2].T)
    stood, drove = int(np.argmax(way > STANDING_M)) - 1, np.flatnonzero(way > DRIVING_M)
    lines = lines_of(sweeps[:stood])

    def fitted(some: list[Pose2], twists: list[Twist], which: Ints) -> Fit:
        chosen = [sweeps[k] for k in which]
        return fit_of([some[k] for k in which], chosen, [twists[k] for k in which], lines)

    theirs, still = [], [Twist()] * len(sweeps)
    columns = (*odometry[:, 1:3].T, np.unwrap(odometry[:, 3]))
    for share in (0.0, 0.5, 1.0):
        times = np.array([one.t_ns - (1.0 - share) * NS_PER_S * one.ago_s[-1] for one in sweeps])
        read = np.array([np.interp(times, odometry[:, 0], column) for column in columns]).T
        others = [Pose2(*map(float, row)) @ Pose2(0.0, 0.0, math.pi) for row in read]
        others = [others[stood // 2].inverse() @ other for other in others]
        both = still, twists_of(others, sweeps)
        theirs += [fitted(others, twists, drove) for twists in both]
    ours = twists_of(poses, sweeps)
    half = 0.5 * ASSOCIATED_M * np.column_stack((-lines[:, 3], lines[:, 2]))
    field = field_of(np.hstack((lines[:, :2] - half, lines[:, :2] + half)))
    placed = list(poses)
    for k in drove:
        placed[k] = match(deskewed(sweeps[k], SCANNER, ours[k]), field, poses[k], None).pose
    return Real(
        ours=fitted(poses, ours, drove),
        placed=fitted(placed, ours, drove),
        theirs=min(theirs, key=lambda fit: fit.piece_m),
        standing=fitted(poses, still, np.arange(stood)),
        thickness_m=thickness_of(poses, sweeps, ours),
    )


def main() -> None:
    """Print the tables."""
    print(f"{'map':25} noise  people  odometry   sweep  longest  trajectory   by evo    walls")
    for name, noise_m, people, drift in DRIVES:
        walls = wall_segments(load_map(name))
        _, errors = mapped(walls, drive(walls, Lap(), noise_m, 28.0, people=people), drift)
        print(f"{name:25} {1e3 * noise_m:2.0f} mm {people:7d}  {drift or '-':>8}"
              f" {1e3 * errors.sweep_s:5.1f} ms {1e3 * errors.longest_s:5.0f} ms"
              f" {1e3 * errors.trajectory_m:8.1f} mm {1e3 * errors.evo_m:5.1f} mm"
              f" {1e3 * errors.wall_m:4.1f} mm",
              flush=True)  # fmt: skip
    _, errors = mapped(HALL, drive(HALL, HALL_LAP, 0.025, 60.0), 0.03)
    print(f"hall of 14 x 10 m: trajectory {1e3 * errors.trajectory_m:.1f} mm, by evo"
          f" {1e3 * errors.evo_m:.1f} mm, walls"
          f" {1e3 * errors.wall_m:.1f} mm, longest {1e3 * errors.longest_s:.0f} ms")  # fmt: skip
    if not BAGS.is_dir():
        print(f"{BAGS} is not here: no real drives")
        return
    print(
        "\nreal drive          wall thickness  misfit: standing  ours  bag's odometry  best placed"
    )
    for path in sorted(BAGS.glob("*.bag")):
        found = real(path)
        print(f"{path.stem:20} {1e3 * found.thickness_m:9.1f} mm"
              f" {1e3 * found.standing.piece_m:15.1f} mm {1e3 * found.ours.piece_m:5.1f} mm"
              f" {1e3 * found.theirs.piece_m:11.1f} mm {1e3 * found.placed.piece_m:9.1f} mm",
              flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
