"""Makes a map of a place while the car drives in it, from LIDAR sweeps, with odometry or without.

Each sweep is matched to the faces that the newest keyframes saw. A keyframe is added after a little
motion; the sweeps that follow are added to it, to average noise. Where the car comes back to old
keyframes, the newest is matched to those about it, and the pose graph of all keyframes is optimised
with that loop closure. Faces and cells are rendered from the keyframes anew.

Without odometry, range flow between two sweeps is the first guess, and the last motion where their
beams differ. Frame of the map: the car's pose at the first sweep.
Holds: a level scanner; half of what a sweep sees stays where it is. A beam without an echo says
nothing.
Source: keyframes and loop closures as in Hess et al., ICRA 2016, without their submaps.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_S
from scm.geometry import Pose2
from vehicle_agent.autonomy.faces import cells_of, faces_of, field_of
from vehicle_agent.autonomy.grid_map import FREE, OCCUPIED, GridMap, grid_of_cells
from vehicle_agent.autonomy.pose_graph import Edge, optimized
from vehicle_agent.autonomy.range_flow import range_flow
from vehicle_agent.autonomy.scan_match import FaceField, Match, Window, match
from vehicle_agent.autonomy.sweep import Sweep, Twist, deskewed, twist_of

KEY_M, KEY_RAD = 0.1, 0.2  # of motion, until the next keyframe
SWEEPS_EACH = 4  # more say little new
RECENT = 60  # keyframes that sweeps are matched to
FIELD_CELL_M = 0.02  # where sweeps are matched: a finer field is no more precise
MIN_SCORE = 0.35  # of a match, else the guess stands
LOOP_EVERY = 3  # keyframes
LOOP_AROUND = 12  # keyframes on each side of an old one, that the newest is matched to
LOOP_M, LOOP_PART = 1.0, 0.03  # how far an old one may be; and of the way since then
LOOP_SCORE = 0.7
LOOP_WINDOW = Window(0.5, 0.3)
EDGE_STD = 0.004, 0.004, 0.004  # of a match to newest keyframes, beside its own [m, m, rad]
LOOP_STD = 0.01, 0.01, 0.01
GUESS_STD = 0.05, 0.05, 0.05  # of what was not matched
NONE = Pose2(0.0, 0.0, 0.0)
GREY = {FREE: 254, OCCUPIED: 0}
UNKNOWN_GREY = 205


@dataclass(slots=True)
class _Keyframe:
    """What sweeps saw about one pose.

    Attributes:
        points, origins: (m, 2) where beams ended and began, in the keyframe's frame.
        way_m: Driven until then.
    """

    points: Floats
    origins: Floats
    way_m: float
    sweeps: int = 1


class Mapper:
    """A map in the making.

    Args:
        mount: Of the scanner on the car.
    """

    def __init__(self, mount: Pose2) -> None:
        self.loops = 0
        self._mount = mount
        self._keyframes: list[_Keyframe] = []
        self._poses: list[Pose2] = []
        self._edges: list[Edge] = []
        self._seen: list[tuple[int, Pose2]] = []
        self._old = range(0)
        self._field: FaceField | None = None
        self._sweep: Sweep | None = None
        self._odometry: Pose2 | None = None
        self._pose, self._motion = NONE, NONE
        self._way_m = 0.0

    @property
    def trajectory(self) -> list[Pose2]:
        """Poses of the car at all sweeps so far, as the map now has them."""
        return [self._poses[number] @ since for number, since in self._seen]

    def add(self, sweep: Sweep, odometry: Pose2 | None = None) -> Pose2:
        """Take a sweep and return the car's pose at its end, map frame.

        Args:
            sweep: Later than the last one.
            odometry: The car's pose at that time in any frame that does not jump.
        """
        last = self._sweep
        if last is None or self._field is None:
            self._add_keyframe(*self._points(sweep, Twist()), None)
        else:
            for motion in self._guesses(last, sweep, odometry):
                guess, found, points, origins = self._matched(last, sweep, motion)
                if found is not None:
                    break
            self._motion = self._pose.inverse() @ guess
            self._way_m += math.hypot(self._motion.x, self._motion.y)
            self._pose = guess
            self._include(points, origins, found)
        self._sweep, self._odometry = sweep, odometry
        self._seen.append((len(self._poses) - 1, self._poses[-1].inverse() @ self._pose))
        return self._pose

    def faces(self) -> Floats:
        """Return all faces seen, (k, 4) x0, y0, x1, y1, map frame [m]."""
        return faces_of(*self._beams(range(len(self._poses))))

    def grid(self) -> GridMap:
        """Return the map; distances to faces are those of `faces`, not of cells."""
        points, origins = self._beams(range(len(self._poses)))
        faces = faces_of(points, origins)
        field = field_of(faces)
        cells = cells_of(faces, points, origins, field)
        grid = grid_of_cells(cells, field.cell_m, field.x_m, field.y_m)
        return replace(grid, to_face_m=np.minimum(grid.to_face_m, field.to_face_m))

    def _points(self, sweep: Sweep, twist: Twist) -> tuple[Floats, Floats]:
        """Return where a sweep's beams ended and began, car frame."""
        zero = replace(sweep, ranges=np.where(np.isfinite(sweep.ranges), 0.0, np.inf))
        return deskewed(sweep, self._mount, twist), deskewed(zero, self._mount, twist)

    def _guesses(self, last: Sweep, sweep: Sweep, odometry: Pose2 | None) -> Iterator[Pose2]:
        """Yield how the car may have moved since the last sweep, before this one is matched."""
        if odometry is not None and self._odometry is not None:
            yield self._odometry.inverse() @ odometry
            return
        if len(last.ranges) == len(sweep.ranges) and last.bearings[0] == sweep.bearings[0]:
            before = self._mount.inverse() @ self._motion @ self._mount
            flow = range_flow(last, sweep, before)
            yield self._mount @ flow.motion @ self._mount.inverse()
        yield self._motion

    def _matched(
        self, last: Sweep, sweep: Sweep, motion: Pose2
    ) -> tuple[Pose2, Match | None, Floats, Floats]:
        """Return the pose, the match if there is one, and where beams ended and began."""
        duration_s = max(sweep.t_ns - last.t_ns, 1) / NS_PER_S
        guess, found = self._pose @ motion, None
        for window in (Window(), None):  # again, with the sweep as this motion bends it
            twist = twist_of(self._pose.inverse() @ guess, duration_s)
            points, origins = self._points(sweep, twist)
            found = match(points, self._field, guess, window) if self._field else None
            if found is None or found.score < MIN_SCORE:
                return self._pose @ motion, None, points, origins
            guess = found.pose
        return guess, found, points, origins

    def _include(self, points: Floats, origins: Floats, found: Match | None) -> None:
        """Add a sweep to the newest keyframe, or make it a new one."""
        since = self._poses[-1].inverse() @ self._pose
        if math.hypot(since.x, since.y) > KEY_M or abs(since.yaw) > KEY_RAD:
            self._add_keyframe(points, origins, found)
            if len(self._poses) % LOOP_EVERY == 0:
                self._close_loop()
        elif found is not None and self._keyframes[-1].sweeps < SWEEPS_EACH:
            newest = self._keyframes[-1]
            newest.points = np.vstack((newest.points, _placed(points, since)))
            newest.origins = np.vstack((newest.origins, _placed(origins, since)))
            newest.sweeps += 1
            if len(self._poses) == 1:
                self._render()

    def _add_keyframe(self, points: Floats, origins: Floats, found: Match | None) -> None:
        if self._poses:
            motion = self._poses[-1].inverse() @ self._pose
            std = GUESS_STD if found is None else EDGE_STD
            covariance = np.diag(np.square(std))
            if found is not None:
                covariance += _turned(found.covariance, -self._poses[-1].yaw)
            number = len(self._poses)
            self._edges.append(Edge(number - 1, number, motion, np.linalg.inv(covariance)))
        self._keyframes.append(_Keyframe(points, origins, self._way_m))
        self._poses.append(self._pose)
        self._render()

    def _beams(self, numbers: Sequence[int]) -> tuple[Floats, Floats]:
        """Return where beams of these keyframes ended and began, map frame."""
        some = [(self._keyframes[n], self._poses[n]) for n in numbers]
        return (
            np.concatenate([_placed(keyframe.points, pose) for keyframe, pose in some]),
            np.concatenate([_placed(keyframe.origins, pose) for keyframe, pose in some]),
        )

    def _render(self) -> None:
        """Make the field that sweeps are matched to, of newest keyframes and those just met."""
        count = len(self._poses)
        numbers = sorted({*range(max(0, count - RECENT), count), *self._old})
        self._field = field_of(faces_of(*self._beams(numbers)), FIELD_CELL_M)

    def _close_loop(self) -> None:
        """Match the newest keyframe to the nearest old ones; where that is sure, optimise."""
        newest, pose = self._keyframes[-1], self._poses[-1]
        old = self._poses[: max(0, len(self._poses) - RECENT)]
        if not old:
            return
        apart = np.hypot(*(np.array(old)[:, :2] - (pose.x, pose.y)).T)
        near = int(apart.argmin())
        if apart[near] > LOOP_M + LOOP_PART * (newest.way_m - self._keyframes[near].way_m):
            return
        about = range(max(0, near - LOOP_AROUND), min(len(old), near + LOOP_AROUND + 1))
        field = field_of(faces_of(*self._beams(about)), FIELD_CELL_M)
        found = match(newest.points, field, pose, LOOP_WINDOW)
        if found.score < LOOP_SCORE:
            return
        covariance = _turned(found.covariance, -old[near].yaw) + np.diag(np.square(LOOP_STD))
        self._edges.append(
            Edge(
                near, len(self._poses) - 1, old[near].inverse() @ found.pose,
                np.linalg.inv(covariance), is_loop=True,
            )
        )  # fmt: skip
        since = pose.inverse() @ self._pose
        self._poses = optimized(self._poses, self._edges)
        self._pose = self._poses[-1] @ since
        self._old, self.loops = about, self.loops + 1
        self._render()


def save_map(grid: GridMap, path: Path) -> None:
    """Write a map as ROS's map_server reads it: `path` with the endings `.yaml` and `.pgm`."""
    grey = np.full(grid.cells.shape, UNKNOWN_GREY, np.uint8)
    for state, shade in GREY.items():
        grey[grid.cells == state] = shade
    cv2.imwrite(str(path.with_suffix(".pgm")), grey[::-1])
    path.with_suffix(".yaml").write_text(
        f"image: {path.stem}.pgm\nmode: trinary\nresolution: {grid.cell_m!r}\n"
        f"origin: [{grid.x_m!r}, {grid.y_m!r}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )


def _placed(points: Floats, pose: Pose2) -> Floats:
    """Return points (m, 2) of a frame seen from the one that its pose is given in."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    return np.asarray(points @ np.array(((c, s), (-s, c))) + (pose.x, pose.y))


def _turned(covariance: Floats, yaw: float) -> Floats:
    """Return a pose's covariance in axes turned by an angle [rad]."""
    c, s = math.cos(yaw), math.sin(yaw)
    turn = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    return np.asarray(turn @ covariance @ turn.T)
