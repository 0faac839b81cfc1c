"""Whether views of a board can tell a lens at all, and which further ones would.

Decided by the covariance. What it means for the Eye is how far a pixel may be off its true ray,
over the frame, once the camera's turn has taken up what it can: a lens whose middle is off by a
pixel and whose camera is turned by as much sees the same. A set is refused when the focal length,
the middle or those rays stay in the dark; the shots to add are those that would lighten them most,
found by trying the information of a board held in each part of the frame, near and far, leaning
each way.
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

LEAST_VIEWS = 5
FOCAL_SHARE = 0.01
"""Standard deviation of fx or fy, over fx or fy, from which a set is refused."""
MIDDLE_SHARE = 0.01
"""Likewise of cx, cy over the frame's width."""
RAY_SHARE = 1e-3
"""Likewise of a ray anywhere in the frame."""
GOOD_RAY_SHARE = 3e-4
"""Up to that no further shots are asked for."""
RMS_SHARE = 5e-4
"""What may be left at the points over the frame's width."""
LEAST_COVER = 0.35
"""Share of the frame's cells that must hold points of the board."""
NOT_SEPARABLE = 0.9
CELLS = (8, 5)
MOST_SHOTS = 5
LEAN_RAD = math.radians(35.0)
_PRIOR = np.array([0.5, 0.5, 0.25, 0.25, 2.0, 2.0, 0.2, 0.2, 2.0])
_PLACES = (0.2, 0.5, 0.8)
_ACROSS, _DOWN = ("left", "centre", "right"), ("upper", "middle", "lower")
_FOLDED = "show the board in the corners too, and tell a wide lens by --fisheye"
_LEANS = {
    "its right edge towards the camera": (0.0, LEAN_RAD, 0.0),
    "its left edge towards the camera": (0.0, -LEAN_RAD, 0.0),
    "its upper edge towards the camera": (LEAN_RAD, 0.0, 0.0),
    "its lower edge towards the camera": (-LEAN_RAD, 0.0, 0.0),
}
_FILLS = {"a quarter": 0.25, "nearly half": 0.45}


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """What a set of views is worth.

    Attributes:
        refused: Why no lens can be told from them, in words; empty: it can.
        shots: What to add, in words.
        cover: Points of the board in each cell of the frame, (rows, columns).
        ray_std_px: Doubt of the rays through the cells, (rows, columns) [px].
        tilts_rad: Between the board and the picture, of each view, (n,).
        fills: How much of the frame's width each board spans, (n,).
    """

    refused: tuple[str, ...]
    shots: tuple[str, ...]
    cover: Ints
    ray_std_px: Floats
    tilts_rad: Floats
    fills: Floats


def judge(solution: Solution) -> Verdict:
    """Return what the views of a solution are worth."""
    cover, (tilts, fills) = _cover(solution), _stances(solution)
    blind = np.full(cover.shape, np.inf)
    try:
        by_lens = _by_lens(solution)
    except EyeError as error:
        refused = [*_unknown_focus(solution, tilts), f"{error}: {_FOLDED}"]
        return Verdict(tuple(refused), _general(), cover, blind, tilts, fills)
    covariance = solution.covariance
    rays = _ray_std(by_lens, covariance) if np.isfinite(covariance).all() else blind
    refused = _refusals(solution, cover, rays, tilts)
    shots = _shots(solution, by_lens, bool(refused))
    return Verdict(tuple(refused), tuple(shots), cover, rays, tilts, fills)


def _refusals(solution: Solution, cover: Ints, rays: Floats, tilts: Floats) -> list[str]:
    width, views, said = solution.size[0], len(solution.views), []
    if views < LEAST_VIEWS:
        said.append(f"too few views: expected at least {LEAST_VIEWS}, got {views}")
    if solution.rms_px > RMS_SHARE * width:
        said.append(
            f"the points are {solution.rms_px:.2f} px off any lens of this kind (at most "
            f"{RMS_SHARE * width:.2f}): a bent board, motion, or a wide lens without --fisheye"
        )
    said += _unknown_focus(solution, tilts)
    middle = float(np.sqrt(np.diag(solution.covariance)[2:4]).max())
    if middle > MIDDLE_SHARE * width:
        said.append(
            f"the picture's middle is known to +-{middle:.1f} px only (at most "
            f"{MIDDLE_SHARE * width:.1f}): the board leans too little, or always the same way"
        )
    covered = float((cover > 0).mean())
    if covered < LEAST_COVER:
        seen = f"the board was seen in {covered:.0%} of the frame"
        said.append(f"{seen} (at least {LEAST_COVER:.0%}): the rest of the lens is guessed")
    if not rays.max() <= RAY_SHARE * width:
        said.append(
            f"the ray through a pixel at the frame's {_darkest(rays)} is known to "
            f"+-{rays.max():.2f} px only (at most {RAY_SHARE * width:.2f})"
        )
    return said


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
    if abs(correlation) < NOT_SEPARABLE:
        return [f"the focal length is not known: {known} (at most {FOCAL_SHARE:.0%})"]
    lean = f"{math.degrees(tilts.min()):.0f} to {math.degrees(tilts.max()):.0f} deg"
    return [
        f"focal length and distance cannot be told apart: {known} (at most {FOCAL_SHARE:.0%}), and "
        f"goes with the boards' distance (correlation {correlation:.4f}), because every board "
        f"stands nearly parallel to the picture (it seems to lean {lean})"
    ]


def _cover(solution: Solution) -> Ints:
    (columns, rows), (width, height) = CELLS, solution.size
    pixels = np.concatenate([view.pixels for view in solution.views])
    column = np.clip((pixels[:, 0] + 0.5) * columns / width, 0, columns - 1).astype(int)
    row = np.clip((pixels[:, 1] + 0.5) * rows / height, 0, rows - 1).astype(int)
    counts = np.bincount(row * columns + column, minlength=rows * columns)
    return counts.reshape(rows, columns)


def _stances(solution: Solution) -> tuple[Floats, Floats]:
    """Return how far each board leans [rad] and how much of the frame's width it spans."""
    normals = np.array([cv2.Rodrigues(pose[:3])[0][2, 2] for pose in solution.poses])
    spans = np.array([np.ptp(view.pixels, axis=0).max() for view in solution.views])
    return np.arccos(np.clip(np.abs(normals), 0.0, 1.0)), spans / solution.size[0]


def _by_lens(solution: Solution) -> Floats:
    """Return how the rays through the cells change by the lens, the turn taken out, (2n, 9).

    Raises:
        EyeError: The lens cannot be one of a camera.
    """
    (columns, rows), (width, height) = CELLS, solution.size
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
    columns, rows = CELLS
    deviation: Floats = np.sqrt(variance.reshape(rows, columns, 2).mean(axis=2))
    return deviation


def _darkest(rays: Floats) -> str:
    row, column = divmod(int(np.argmax(rays)), rays.shape[1])
    return _place(column / (rays.shape[1] - 1), row / (rays.shape[0] - 1))


def _place(across: float, down: float) -> str:
    return f"{_DOWN[min(int(down * 3), 2)]} {_ACROSS[min(int(across * 3), 2)]}"


def _shots(solution: Solution, by_lens: Floats, refused: bool) -> list[str]:
    """Return the shots that would tell most, one after the other, until enough is known."""
    width, free = solution.size[0], solution.lens.free
    scale = np.where(np.arange(9) < 4, width, 1.0) * _PRIOR
    known = solution.information / solution.corner_std_px**2 + np.diag(scale**-2.0)
    tried = [(words, told / solution.corner_std_px**2) for words, told in _candidates(solution)]
    shots: list[str] = []
    while tried and len(shots) < MOST_SHOTS:
        doubt = _ray_std(by_lens, inverse(known, free))
        if doubt.max() <= GOOD_RAY_SHARE * width and not (refused and len(shots) < 2):
            break
        left = [_ray_std(by_lens, inverse(known + told, free)).max() for _, told in tried]
        words, told = tried.pop(int(np.argmin(left)))
        known = known + told
        shots.append(words)
    short = LEAST_VIEWS - len(solution.views)
    return shots or (list(_general()) if refused or short > 0 else [])


def _candidates(solution: Solution) -> Iterator[tuple[str, Floats]]:
    """Yield shots in words, and what each would tell of the lens for corners of 1 px, (9, 9)."""
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
            for fill_said, fill in _FILLS.items():
                ray = np.array([*ideal, 1.0])
                far = ray / np.linalg.norm(ray) * lens.values[0] * span / (fill * width)
                for lean_said, lean in _LEANS.items():
                    turn = cv2.Rodrigues(np.array(lean))[0]
                    pose = np.concatenate((lean, far - turn @ middle))
                    pixels, by_lens, by_pose = lens.see(points, pose)
                    if not (np.all(pixels >= 0.0) and np.all(pixels < (width, height))):
                        continue
                    words = (
                        f"the board in the frame's {_place(across, down)}, {lean_said} by "
                        f"{math.degrees(LEAN_RAD):.0f} deg, spanning {fill_said} of its width"
                    )
                    yield words, eliminate(by_lens, by_pose)


def _general() -> tuple[str, ...]:
    return tuple(
        f"the board in the frame's {where}, {lean} by {math.degrees(LEAN_RAD):.0f} deg"
        for where, lean in zip(
            ("lower left", "upper right", "lower right", "upper left"), _LEANS, strict=True
        )
    )
