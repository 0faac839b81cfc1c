"""Assesses whether views of a board determine a lens, and which further views would.

Based on the covariance. What matters to the Eye is the error of a pixel's ray, over the frame,
after the camera's rotation has absorbed what it can: a lens whose centre is off by a pixel with a
camera rotated accordingly gives the same result. A set is refused when the focal length, the centre
or those rays are too uncertain; the suggested shots are those that reduce the uncertainty most,
found by evaluating the information of a board held in each part of the frame, near and far, tilted
in each direction.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from scm.arrays import Floats, Ints
from scm.errors import EyeError
from scm.eye.calibrate.solve import Solution, eliminate, inverse
from scm.eye.camera import camera_model

MIN_VIEWS = 5  # fewer cannot separate a lens from its poses
FOCAL_SHARE = 0.01
"""Maximum standard deviation of fx or fy, over fx or fy."""
MIDDLE_SHARE = 0.01
"""Likewise of cx, cy, over the frame's width."""
RAY_SHARE = 1e-3
"""Likewise of any ray in the frame."""
GOOD_RAY_SHARE = 3e-4
"""Up to this ray std no further shots are suggested."""
RMS_SHARE = 5e-4
"""Maximum RMS residual at the points, over the frame's width."""
MIN_COVER = 0.35
"""Minimum share of the frame's cells with points of the board."""
MAX_CORRELATION = 0.9  # of two lens parameters that count as separable
COVER_CELLS = (8, 5)  # columns and rows of the picture whose cover is checked
MAX_SHOTS = 5  # further shots that are proposed
TILT_RAD = math.radians(35.0)
_PRIOR = np.array([0.5, 0.5, 0.25, 0.25, 2.0, 2.0, 0.2, 0.2, 2.0])
_PLACES = (0.2, 0.5, 0.8)
_ACROSS, _DOWN = ("left", "centre", "right"), ("upper", "middle", "lower")
_FOLDED = "show the board in the corners too, and use --fisheye for a wide lens"
_TILTS = {
    "its right edge towards the camera": (0.0, TILT_RAD, 0.0),
    "its left edge towards the camera": (0.0, -TILT_RAD, 0.0),
    "its upper edge towards the camera": (TILT_RAD, 0.0, 0.0),
    "its lower edge towards the camera": (-TILT_RAD, 0.0, 0.0),
}
_FILLS = {"a quarter": 0.25, "nearly half": 0.45}


@dataclass(frozen=True, slots=True, eq=False)
class ViewAssessment:
    """Assessment of a set of views.

    Attributes:
        refused: Why they determine no lens, in words; empty if they do.
        shots: Views to add, in words.
        cover: Points of the board in each cell of the frame, (rows, columns).
        ray_std_px: Standard deviation of the rays through the cells, (rows, columns) [px].
        tilts_rad: Between the board and the picture, of each view, (n,).
        fills: Share of the frame's width that each board spans, (n,).
    """

    refused: tuple[str, ...]
    shots: tuple[str, ...]
    cover: Ints
    ray_std_px: Floats
    tilts_rad: Floats
    fills: Floats


def assess(solution: Solution) -> ViewAssessment:
    """Return the assessment of a solution's views."""
    cover, (tilts, fills) = _cover(solution), _stances(solution)
    blind = np.full(cover.shape, np.inf)
    try:
        by_lens = _by_lens(solution)
    except EyeError as error:
        refused = [*_unknown_focus(solution, tilts), f"{error}: {_FOLDED}"]
        return ViewAssessment(tuple(refused), _general(), cover, blind, tilts, fills)
    covariance = solution.covariance
    rays = _ray_std(by_lens, covariance) if np.isfinite(covariance).all() else blind
    refused = _refusals(solution, cover, rays, tilts)
    shots = _shots(solution, by_lens, bool(refused))
    return ViewAssessment(tuple(refused), tuple(shots), cover, rays, tilts, fills)


def _refusals(solution: Solution, cover: Ints, rays: Floats, tilts: Floats) -> list[str]:
    width, views, faults = solution.size[0], len(solution.views), []
    if views < MIN_VIEWS:
        faults.append(f"too few views: expected at least {MIN_VIEWS}, got {views}")
    if solution.rms_px > RMS_SHARE * width:
        faults.append(
            f"the points deviate by {solution.rms_px:.2f} px from any lens of this kind (at most "
            f"{RMS_SHARE * width:.2f}): a bent board, motion, or a wide lens without --fisheye"
        )
    faults += _unknown_focus(solution, tilts)
    middle = float(np.sqrt(np.diag(solution.covariance)[2:4]).max())
    if middle > MIDDLE_SHARE * width:
        faults.append(
            f"the picture's middle is known to +-{middle:.1f} px only (at most "
            f"{MIDDLE_SHARE * width:.1f}): the board is tilted too little, or always the same way"
        )
    covered = float((cover > 0).mean())
    if covered < MIN_COVER:
        seen = f"the board was seen in {covered:.0%} of the frame"
        faults.append(f"{seen} (at least {MIN_COVER:.0%}): the rest of the lens is extrapolated")
    if not rays.max() <= RAY_SHARE * width:
        faults.append(
            f"the ray through a pixel at the frame's {_darkest(rays)} is known to "
            f"+-{rays.max():.2f} px only (at most {RAY_SHARE * width:.2f})"
        )
    return faults


def _unknown_focus(solution: Solution, tilts: Floats) -> list[str]:
    focal = solution.lens.values[:2]
    deviations = np.sqrt(np.diag(solution.covariance)[:2])
    share, correlation = float((deviations / focal).max()), solution.depth_correlation
    if not share > FOCAL_SHARE:
        return []
    known = (
        f"fx is {focal[0]:.0f} +-{deviations[0]:.0f} px"
        if np.isfinite(share)
        else "fx could be anything"
    )
    if abs(correlation) < MAX_CORRELATION:
        return [f"the focal length is not known: {known} (at most {FOCAL_SHARE:.0%})"]
    tilt = f"{math.degrees(tilts.min()):.0f} to {math.degrees(tilts.max()):.0f} deg"
    return [
        f"focal length and distance cannot be separated: {known} (at most {FOCAL_SHARE:.0%}), and "
        f"goes with the boards' distance (correlation {correlation:.4f}), because every board "
        f"stands nearly parallel to the picture (its tilt seems to be {tilt})"
    ]


def _cover(solution: Solution) -> Ints:
    (columns, rows), (width, height) = COVER_CELLS, solution.size
    pixels = np.concatenate([view.pixels for view in solution.views])
    column = np.clip((pixels[:, 0] + 0.5) * columns / width, 0, columns - 1).astype(int)
    row = np.clip((pixels[:, 1] + 0.5) * rows / height, 0, rows - 1).astype(int)
    counts = np.bincount(row * columns + column, minlength=rows * columns)
    return counts.reshape(rows, columns)


def _stances(solution: Solution) -> tuple[Floats, Floats]:
    """Return each board's tilt [rad] and the share of the frame's width it spans."""
    normals = np.array([cv2.Rodrigues(pose[:3])[0][2, 2] for pose in solution.poses])
    spans = np.array([np.ptp(view.pixels, axis=0).max() for view in solution.views])
    return np.arccos(np.clip(np.abs(normals), 0.0, 1.0)), spans / solution.size[0]


def _by_lens(solution: Solution) -> Floats:
    """Return the derivative of the cells' rays by the lens, rotation removed, (2n, 9).

    Raises:
        EyeError: The lens is invalid.
    """
    (columns, rows), (width, height) = COVER_CELLS, solution.size
    across = (np.arange(columns) + 0.5) * width / columns - 0.5
    down = (np.arange(rows) + 0.5) * height / rows - 0.5
    pixels = np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2)
    ideal = camera_model(solution.calibration().camera()).undistort(pixels)
    shown = np.asarray(np.isfinite(ideal).all(axis=1))
    rays = np.column_stack((np.where(shown[:, None], ideal, 0.0), np.ones(len(ideal))))
    _, by_lens, by_pose = solution.lens.see(rays, np.zeros(6))
    by_turn = by_pose[:, :3]
    by_lens = by_lens - by_turn @ np.linalg.lstsq(by_turn, by_lens)[0]
    return np.where(np.repeat(shown, 2)[:, None], by_lens, 0.0)


def _ray_std(by_lens: Floats, covariance: Floats) -> Floats:
    variance = np.einsum("ij,jk,ik->i", by_lens, covariance, by_lens)
    columns, rows = COVER_CELLS
    deviation: Floats = np.sqrt(variance.reshape(rows, columns, 2).mean(axis=2))
    return deviation


def _darkest(rays: Floats) -> str:
    row, column = divmod(int(np.argmax(rays)), rays.shape[1])
    return _place(column / (rays.shape[1] - 1), row / (rays.shape[0] - 1))


def _place(across: float, down: float) -> str:
    return f"{_DOWN[min(int(down * 3), 2)]} {_ACROSS[min(int(across * 3), 2)]}"


def _shots(solution: Solution, by_lens: Floats, refused: bool) -> list[str]:
    """Return the most informative shots, one after the other, until enough is known."""
    width, free = solution.size[0], solution.lens.free
    scale = np.where(np.arange(9) < 4, width, 1.0) * _PRIOR
    known = solution.information / solution.corner_std_px**2 + np.diag(scale**-2.0)
    tried = [
        (words, information / solution.corner_std_px**2)
        for words, information in _candidates(solution)
    ]
    shots: list[str] = []
    while tried and len(shots) < MAX_SHOTS:
        std_px = _ray_std(by_lens, inverse(known, free))
        if std_px.max() <= GOOD_RAY_SHARE * width and not (refused and len(shots) < 2):
            break
        left = [
            _ray_std(by_lens, inverse(known + information, free)).max() for _, information in tried
        ]
        words, information = tried.pop(int(np.argmin(left)))
        known = known + information
        shots.append(words)
    short = MIN_VIEWS - len(solution.views)
    return shots or (list(_general()) if refused or short > 0 else [])


def _candidates(solution: Solution) -> Iterator[tuple[str, Floats]]:
    """Yield shots in words, and each one's information on the lens for 1 px corners, (9, 9)."""
    lens, (width, height) = solution.lens, solution.size
    model = camera_model(solution.calibration().camera())
    points = max(solution.views, key=lambda view: len(view.points)).points
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    span = float(np.ptp(points[:, 0]))
    for across in _PLACES:
        for down in _PLACES:
            pixel = np.array([across * width, down * height])
            ideal = model.undistort(pixel)
            if not np.isfinite(ideal).all():
                continue
            for fill_text, fill in _FILLS.items():
                ray = np.array([*ideal, 1.0])
                far = ray / np.linalg.norm(ray) * lens.values[0] * span / (fill * width)
                for tilt_text, tilt in _TILTS.items():
                    turn = cv2.Rodrigues(np.array(tilt))[0]
                    pose = np.concatenate((tilt, far - turn @ middle))
                    pixels, by_lens, by_pose = lens.see(points, pose)
                    if not (np.all(pixels >= 0.0) and np.all(pixels < (width, height))):
                        continue
                    words = (
                        f"the board in the frame's {_place(across, down)}, {tilt_text} by "
                        f"{math.degrees(TILT_RAD):.0f} deg, spanning {fill_text} of its width"
                    )
                    yield words, eliminate(by_lens, by_pose)


def _general() -> tuple[str, ...]:
    return tuple(
        f"the board in the frame's {where}, {tilt} by {math.degrees(TILT_RAD):.0f} deg"
        for where, tilt in zip(
            ("lower left", "upper right", "lower right", "upper left"), _TILTS, strict=True
        )
    )
