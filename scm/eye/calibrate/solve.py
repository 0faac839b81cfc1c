"""Fits a lens to views of a flat board, with its covariance.

OpenCV gives the start; from there damped Gauss-Newton over the nine lens parameters and the six of
every view finds the minimum. A view's own six are eliminated (Schur complement), which leaves the
information about the lens alone,

    I = sum over views of  A^T A - A^T B (B^T B)^-1 B^T A      A: by lens, B: by pose

and s^2 I^-1 is its covariance, where s is the noise of a corner coordinate, estimated from the
residuals. Outlier points and views are removed, the worst first. Corners of tags are then corrected
for the curvature of their sides, and everything is repeated. A distortion term that the views
determine no better than +-1 is left out: no lens has one that large, and it would diverge outside.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from scm.arrays import Bools, Floats
from scm.errors import EyeError
from scm.eye.calibrate.bend import along_sides, unbent
from scm.eye.calibrate.board import LEAST_POINTS, View
from scm.eye.calibration import LENS_NAMES, Calibration
from scm.eye.camera import LENS_PARAMETERS

LEAST_CORNER_STD_PX = 0.02
"""No board is printed and detected better than this, however small the residuals."""
OUTLIER_SIGMAS = 5.0  # residual at which a point is left out
OUTLIER_VIEW_RATIO = 3.0  # times the usual residual, at which a view is left out
MIN_OUTLIER_PX = 0.3  # smaller residuals are never outliers
MAX_OUTLIER_SHARE = 0.2  # of the views; more and the board is not flat, or not this one
_POINT_ROUNDS = 12
MAX_TERM_STD = 1.0  # of a distortion term that counts as determined
_ITERATIONS = 60
_CONVERGED = 1e-10
_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
_OPTIONAL = {"pinhole": (8, 5, 4), "fisheye": (7, 6, 5, 4)}
_FISHEYE_FOCALS = (0.32, 0.45, 0.65, 1.0)
"""Initial guesses of the focal length in widths of the frame."""


@dataclass(frozen=True, slots=True, eq=False)
class Lens:
    """Nine parameters in the order of `LENS_NAMES`, and which of them are estimated."""

    kind: str
    values: Floats
    free: Bools

    @property
    def matrix(self) -> Floats:
        """K, (3, 3) [px]."""
        fx, fy, cx, cy = self.values[:4]
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def see(self, points: Floats, pose: Floats) -> tuple[Floats, Floats, Floats]:
        """Return pixels (n, 2), their derivatives by lens (2n, 9) and by pose (2n, 6).

        Args:
            points: In the frame of the board, (n, 3) [m].
            pose: camera_T_board as rotation vector and shift, (6,).
        """
        if self.kind == "fisheye":
            pixels, by = cv2.fisheye.projectPoints(
                points[:, None], pose[:3], pose[3:], self.matrix, self.values[4:8]
            )
            by_lens = np.column_stack((by[:, :8], np.zeros(len(by))))
            by_pose = by[:, 8:14]
        else:
            pixels, by = cv2.projectPoints(
                points, pose[:3], pose[3:], self.matrix, self.values[4:]
            )[:2]
            by_lens, by_pose = by[:, 6:15], by[:, :6]
        flat = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        return flat, np.where(self.free, by_lens, 0.0), np.asarray(by_pose, dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The fitted lens and views.

    Attributes:
        poses: camera_T_board of each view as rotation vector and shift, (n, 6).
        views: Those used, without outlier points.
        size: Width and height of the frame [px].
        information: About the lens for corners of 1 px, (9, 9).
        corner_std_px: Noise of a corner's coordinate.
        depth_correlation: Of the focal length with the boards' mean distance.
        remarks: What was left out, in words.
    """

    lens: Lens
    poses: Floats
    views: tuple[View, ...]
    size: tuple[int, int]
    information: Floats = field(default_factory=lambda: np.zeros((9, 9)))
    corner_std_px: float = LEAST_CORNER_STD_PX
    depth_correlation: float = 0.0
    remarks: tuple[str, ...] = ()

    @property
    def covariance(self) -> Floats:
        """Of the lens, (9, 9); infinite where it is undetermined."""
        return self.corner_std_px**2 * inverse(self.information, self.lens.free)

    @property
    def errors(self) -> tuple[Floats, ...]:
        """Residuals at the points of each view, (n, 2) [px]."""
        return tuple(
            view.pixels - self.lens.see(view.points, pose)[0]
            for view, pose in zip(self.views, self.poses, strict=True)
        )

    @property
    def rms_px(self) -> float:
        """RMS residual, per point."""
        return float(np.sqrt((np.concatenate(self.errors) ** 2).sum(axis=1).mean()))

    def calibration(self) -> Calibration:
        """Return the lens as a calibration file."""
        fx, fy, cx, cy, a, b, c, d, e = (float(value) for value in self.lens.values)
        return Calibration(
            lens="fisheye" if self.lens.kind == "fisheye" else "pinhole",
            width_px=self.size[0],
            height_px=self.size[1],
            fx_px=fx,
            fy_px=fy,
            cx_px=cx,
            cy_px=cy,
            distortion=(a, b, c, d, e),
            covariance=tuple(tuple(float(v) for v in row) for row in self.covariance),
            rms_px=self.rms_px,
            views=len(self.views),
        )


def solve(
    views: Sequence[View],
    size: tuple[int, int],
    fisheye: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> Solution:
    """Fit a lens to the views, without outliers.

    Args:
        views: Of one board, at least two.
        size: Width and height of the frame [px].
        fisheye: Whether to use OpenCV's fisheye for a wide lens.
        progress: Called with the present activity.

    Raises:
        EyeError: No lens fits, or too many views do not fit the same one.
    """
    solution = _solved(tuple(views), size, fisheye, progress)
    if not any(view.tags for view in views):
        return solution
    return _solved(_unbent(views, solution), size, fisheye, progress)


def _solved(
    views: tuple[View, ...], size: tuple[int, int], fisheye: bool, progress: Callable[[str], None]
) -> Solution:
    progress("solving")
    solution = _optimised(_start(views, size, fisheye))
    for term in _OPTIONAL[solution.lens.kind]:
        progress("solving")
        solution = _without_blunders(solution, len(views))
        if not np.sqrt(solution.covariance[term, term]) > MAX_TERM_STD:
            break
        solution = _optimised(_without(solution, term))
    solution = _without_blunders(solution, len(views))
    return replace(solution, remarks=(*solution.remarks, *_points_out(solution, views)))


def _unbent(views: Sequence[View], solution: Solution) -> tuple[View, ...]:
    """Return the views with tag corners corrected for curved sides, with the lens found so far.

    A view that was removed as a whole stays as it is.
    """
    poses = dict(zip((view.name for view in solution.views), solution.poses, strict=True))
    changed = []
    for view in views:
        if view.tags and view.name in poses:
            pose, sides = poses[view.name], along_sides(view.points.reshape(-1, 4, 3))
            corners = solution.lens.see(view.points, pose)[0]
            seen = solution.lens.see(sides.reshape(-1, 3), pose)[0]
            changed.append(unbent(view, corners, seen.reshape(*sides.shape[:3], 2)))
        else:
            changed.append(view)
    return tuple(changed)


def inverse(information: Floats, free: Bools) -> Floats:
    """Return the inverse over free parameters, (9, 9): 0 for others, infinite if undetermined."""
    found = np.zeros_like(information)
    chosen = np.ix_(free, free)
    size = np.sqrt(np.maximum(np.diag(information)[free], 1e-300))
    values, vectors = np.linalg.eigh(information[chosen] / np.outer(size, size))
    blind = values < 1e-13
    finite = vectors[:, ~blind] / np.sqrt(values[~blind])
    known = (finite @ finite.T) / np.outer(size, size)
    unknown = (vectors[:, blind] ** 2).sum(axis=1) > 1e-6
    known[np.ix_(unknown, unknown)] = np.inf
    found[chosen] = known
    return found


def eliminate(by_lens: Floats, by_pose: Floats) -> Floats:
    """Return one view's information about the lens, its pose eliminated, (9, 9)."""
    across = by_lens.T @ by_pose
    information: Floats = by_lens.T @ by_lens - across @ np.linalg.solve(
        by_pose.T @ by_pose, across.T
    )
    return information


def _optimised(solution: Solution) -> Solution:
    """Find the minimum, and evaluate the information there."""
    return _known(_descend(solution))


def _descend(solution: Solution) -> Solution:
    """Find the minimum by damped Gauss-Newton.

    Raises:
        LinAlgError: from a start that diverges.
    """
    lens, poses = solution.lens, solution.poses
    damping, cost = 1e-6, _cost(solution)
    for _ in range(_ITERATIONS):
        lens_step, pose_steps = _step(solution, damping)
        tried = replace(
            solution,
            lens=replace(lens, values=lens.values + lens_step),
            poses=poses + pose_steps,
        )
        new = _cost(tried)
        if not new < cost:
            damping *= 10.0
            if damping > 1e6 or abs(new - cost) <= _CONVERGED * cost:
                break
            continue
        gain = cost - new
        solution, lens, poses, cost = tried, tried.lens, tried.poses, new
        damping = max(damping / 10.0, 1e-12)
        if gain <= _CONVERGED * cost:
            break
    return solution


def _cost(solution: Solution) -> float:
    if solution.lens.values[:2].min() <= 0.0:
        return float("inf")
    with np.errstate(all="ignore"):
        cost = float(sum((error**2).sum() for error in solution.errors))
    return cost if np.isfinite(cost) else float("inf")


def _step(solution: Solution, damping: float) -> tuple[Floats, Floats]:
    """Return the steps of lens (9,) and poses (n, 6)."""
    lens, parts = solution.lens, []
    normal, right = np.zeros((9, 9)), np.zeros(9)
    for view, pose in zip(solution.views, solution.poses, strict=True):
        pixels, by_lens, by_pose = lens.see(view.points, pose)
        off = (view.pixels - pixels).ravel()
        own = by_pose.T @ by_pose
        own += damping * np.diag(np.diag(own))
        across = by_lens.T @ by_pose
        direct = by_lens.T @ by_lens
        direct += damping * np.diag(np.diag(direct))
        downhill = by_pose.T @ off
        normal += direct - across @ np.linalg.solve(own, across.T)
        right += by_lens.T @ off - across @ np.linalg.solve(own, downhill)
        parts.append((own, across, downhill))
    lens_step = np.zeros(LENS_PARAMETERS)
    chosen = np.ix_(lens.free, lens.free)
    size = np.sqrt(np.maximum(np.diag(normal)[lens.free], 1e-300))
    scaled = np.linalg.lstsq(normal[chosen] / np.outer(size, size), right[lens.free] / size)[0]
    lens_step[lens.free] = scaled / size
    pose_steps = [np.linalg.solve(own, down - across.T @ lens_step) for own, across, down in parts]
    return lens_step, np.array(pose_steps)


def _known(solution: Solution) -> Solution:
    """Return the solution with its information about the lens, and the corner noise."""
    lens, views = solution.lens, solution.views
    seen = [lens.see(v.points, pose) for v, pose in zip(views, solution.poses, strict=True)]
    information = np.sum([eliminate(by_lens, by_pose) for _, by_lens, by_pose in seen], axis=0)
    count = 2 * sum(len(view.points) for view in views)
    unknown = int(lens.free.sum()) + 6 * len(views)
    left = float(np.sqrt(_cost(solution) / max(count - unknown, 1)))
    noise = max(left, LEAST_CORNER_STD_PX)
    known = replace(solution, information=information, corner_std_px=noise)
    return replace(known, depth_correlation=_depth_correlation(known, seen))


def _depth_correlation(solution: Solution, seen: Sequence[tuple[Floats, Floats, Floats]]) -> float:
    """Return the correlation of focal length and the boards' mean distance, -1 to 1."""
    covariance = solution.covariance
    if not np.isfinite(covariance).all():
        return 1.0
    focal = np.zeros(LENS_PARAMETERS)
    focal[:2] = 0.5
    by_lens, own = np.zeros(LENS_PARAMETERS), 0.0
    for _, lens_part, pose_part in seen:
        normal = np.linalg.inv(pose_part.T @ pose_part)
        by_lens -= (normal @ pose_part.T @ lens_part)[5] / len(seen)
        own += solution.corner_std_px**2 * float(normal[5, 5]) / len(seen) ** 2
    depth = float(by_lens @ covariance @ by_lens) + own
    spread = float(focal @ covariance @ focal) * depth
    if not spread > 0.0:  # views without a pose do not separate the two
        return 1.0
    return float(focal @ covariance @ by_lens) / math.sqrt(spread)


def _without(solution: Solution, term: int) -> Solution:
    """Return a start without one distortion term."""
    lens = solution.lens
    values, free = lens.values.copy(), lens.free.copy()
    values[term], free[term] = 0.0, False
    name = LENS_NAMES[lens.kind][term]
    words = (
        f"distortion {name} left out: these views determine it no better than +-{MAX_TERM_STD:g}"
    )
    return replace(
        solution, lens=replace(lens, values=values, free=free), remarks=(*solution.remarks, words)
    )


def _without_blunders(solution: Solution, views: int) -> Solution:
    """Return the optimised solution without outlier points and views, the worst first."""
    while (worst := _worst_view(solution)) is not None:
        index, ratio = worst
        name = solution.views[index].name
        words = f"{name}: the whole view is an outlier, {ratio:.1f} times the usual error; removed"
        solution = _optimised(_drop(solution, index, words))
        if len(solution.views) < (1.0 - MAX_OUTLIER_SHARE) * views:
            raise EyeError(
                f"calibration: more than a fifth of {views} views do not fit one lens (last: "
                f"{name}); is the board flat, --squares right, the frame size and zoom the same?"
            )
    for _ in range(_POINT_ROUNDS):
        remaining = _without_points(solution)
        if remaining == solution.views:
            break
        solution = _optimised(replace(solution, views=remaining))
    return solution


def _without_points(solution: Solution) -> tuple[View, ...]:
    """Return the views without their worst outlier points.

    Only the worst, because outliers pull the view's pose, and make good points look bad.
    """
    remaining, errors = list(solution.views), solution.errors
    noise = 1.4826 * float(np.median(np.abs(np.concatenate(errors))))
    for i, (view, error) in enumerate(zip(solution.views, errors, strict=True)):
        off = np.hypot(error[:, 0], error[:, 1])
        good = off <= max(OUTLIER_SIGMAS * noise, MIN_OUTLIER_PX, 0.7 * float(off.max()))
        if not good.all() and good.sum() >= LEAST_POINTS:
            remaining[i] = replace(view, points=view.points[good], pixels=view.pixels[good])
    return tuple(remaining)


def _points_out(solution: Solution, views: Sequence[View]) -> list[str]:
    had = {view.name: len(view.points) for view in views}
    gone = {view.name: had[view.name] - len(view.points) for view in solution.views}
    return [f"{name}: {n} point{'s' * (n > 1)} removed" for name, n in gone.items() if n]


def _worst_view(solution: Solution) -> tuple[int, float] | None:
    typical = np.array([np.median(np.hypot(e[:, 0], e[:, 1])) for e in solution.errors])
    usual = float(np.median(typical))
    worst = int(np.argmax(typical))
    off = typical[worst] > max(OUTLIER_VIEW_RATIO * usual, MIN_OUTLIER_PX)
    return (worst, float(typical[worst] / max(usual, 1e-12))) if off else None


def _drop(solution: Solution, index: int, words: str) -> Solution:
    views = tuple(view for i, view in enumerate(solution.views) if i != index)
    poses = np.delete(solution.poses, index, axis=0)
    return replace(solution, views=views, poses=poses, remarks=(*solution.remarks, words))


def _start(views: tuple[View, ...], size: tuple[int, int], fisheye: bool) -> Solution:
    starts = _fisheye_starts(views, size) if fisheye else _pinhole_starts(views, size)
    good = [one for one in starts if np.isfinite(_cost(one))]
    if not good:
        raise EyeError(
            f"calibration: no lens could be fitted to {len(views)} views; add views in which the "
            "board is tilted 30 to 45 deg to different sides"
        )
    return min(good, key=_cost)


def _pinhole_starts(views: tuple[View, ...], size: tuple[int, int]) -> list[Solution]:
    points = [view.points.astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32) for view in views]
    free = np.ones(LENS_PARAMETERS, dtype=np.bool_)
    starts = []
    # with k3 free OpenCV fails on few views; our own steps include it
    for focal in (None, 0.9, 2.5):
        guess, flags = None, cv2.CALIB_FIX_K3
        if focal is not None:
            f = focal * size[0]
            guess = np.array([[f, 0, size[0] / 2 - 0.5], [0, f, size[1] / 2 - 0.5], [0, 0, 1.0]])
            flags |= cv2.CALIB_USE_INTRINSIC_GUESS
        try:
            _, matrix, terms, turns, shifts = cv2.calibrateCamera(
                points, pixels, size, guess, None, flags=flags, criteria=_UNTIL
            )
        except cv2.error:
            continue
        values = np.array([*matrix[[0, 1, 0, 1], [0, 1, 2, 2]], *np.ravel(terms)[:5]])
        poses = np.hstack([np.reshape(each, (-1, 3)) for each in (turns, shifts)])
        started = Lens("pinhole", values.astype(np.float64), free)
        starts.append(Solution(started, poses.astype(np.float64), views, size))
        if starts[-1].rms_px < 1e-3 * size[0]:
            break
    return starts


def _fisheye_starts(views: tuple[View, ...], size: tuple[int, int]) -> list[Solution]:
    """Return starts from guessed focal lengths: OpenCV's own fisheye solver fails too easily."""
    free = np.arange(LENS_PARAMETERS) < 8
    starts = []
    for focal in _FISHEYE_FOCALS:
        f = focal * size[0]
        values = np.array([f, f, size[0] / 2 - 0.5, size[1] / 2 - 0.5, 0, 0, 0, 0, 0.0])
        lens = Lens("fisheye", values, free)
        poses = [_fisheye_pose(lens, view) for view in views]
        if any(pose is None for pose in poses):
            continue
        started = Solution(lens, np.array(poses), views, size)
        first = replace(started, lens=replace(lens, free=np.arange(LENS_PARAMETERS) < 5))
        try:
            descended = _descend(first)
        except np.linalg.LinAlgError:
            continue
        starts.append(replace(descended, lens=replace(descended.lens, free=free)))
    return starts


def _fisheye_pose(lens: Lens, view: View) -> Floats | None:
    ideal = cv2.fisheye.undistortPoints(view.pixels[:, None], lens.matrix, lens.values[4:8])
    good, turn, shift = cv2.solvePnP(view.points, ideal, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    return np.concatenate((np.ravel(turn), np.ravel(shift))) if good else None
