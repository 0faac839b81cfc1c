"""The result of a calibration as plain data for programs: `--report FILE` writes it.

Lengths are metres, angles radians, places in a picture pixels; None stands for "not known".
"""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.errors import EyeError
from scm.eye.calibrate.assessment import COVER_CELLS, ViewAssessment
from scm.eye.calibrate.board import View
from scm.eye.calibrate.gather import Gathered
from scm.eye.calibrate.locate import NAMES, Located, off_px
from scm.eye.calibrate.solve import Solution
from scm.eye.calibration import LENS_NAMES, Calibration
from scm.eye.camera import CameraModel, camera_model
from scm.eye.picture import read_picture
from scm.eye.source import grey_of
from scm.records.city_map import Camera, MapTag
from scm.records.eye import TagSeen
from scm.scenery.board import Board

Report = dict[str, Any]


def write_report(report: Report, path: Path) -> None:
    """Write a report as JSON.

    Raises:
        EyeError: It cannot be written.
    """
    try:
        path.write_text(json.dumps(report, allow_nan=False), encoding="utf-8")
    except OSError as error:
        raise EyeError(f"{path}: cannot write the report: {error}") from error


def views_report(board: Board, gathered: Gathered) -> Report:
    """Return the pictures with the board, its place and sharpness."""
    return {
        "size_px": list(gathered.size),
        "views": [_view(board, view) for view in gathered.views],
        "said": list(gathered.remarks),
        "cover": _cover(gathered.views, gathered.size),
        "ray_std_px": None,
        "refused": [],
        "shots": [],
        "lens": None,
    }


def lens_report(
    board: Board, gathered: Gathered, solution: Solution, assessment: ViewAssessment
) -> Report:
    """Return the same, with the lens."""
    report = views_report(board, gathered)
    used = zip(solution.views, solution.errors, assessment.tilts_rad, strict=True)
    more = {
        view.name: {"rms_px": _rms(errors), "tilt_rad": float(tilt)} for view, errors, tilt in used
    }
    for view in report["views"]:
        view.update(more.get(view["name"], {}))
        view["used"] = view["name"] in more
    rays = [[_finite(float(ray)) for ray in row] for row in assessment.ray_std_px]
    return {
        **report,
        "said": [*gathered.remarks, *solution.remarks],
        "ray_std_px": rays,
        "refused": list(assessment.refused),
        "shots": list(assessment.shots),
        "lens": _lens(solution.calibration()),
    }


def place_report(
    camera: Camera,
    tags: Mapping[int, MapTag],
    seen: Sequence[TagSeen],
    located: Located,
    block: str,
) -> Report:
    """Return where a camera was located, compared with its map.

    Args:
        camera: As in force: of the map, with the map's own lens.
        tags: Tags with known places, by id.
        seen: In the picture.
        located: The result.
        block: Of the map file, with the result.
    """
    known = [tag for tag in seen if tag.tag_id in tags]
    before, after = camera_model(camera), located.places[0].model
    deviations = [_finite(float(one)) for one in located.places[0].deviations]
    return {
        "camera": camera.name,
        "size_px": [camera.width_px, camera.height_px],
        "names": list(NAMES),
        "before": _stance(camera),
        "after": _stance(after.camera),
        "deviations": deviations,
        "tags": [_tag(tags[tag.tag_id], tag, before, after, located) for tag in known],
        "places": [
            {"rms_px": place.rms_px, "weight": place.weight, **_stance(place.model.camera)}
            for place in located.places
        ],
        "is_sure": len(located.places) == 1 or located.is_sure,
        "toml": block,
    }


def _view(board: Board, view: View) -> Report:
    grey = grey_of(read_picture(Path(view.name))) if Path(view.name).is_file() else None
    outline = cv2.convexHull(view.pixels.astype(np.float32)).reshape(-1, 2)
    return {
        "name": view.name,
        "points": len(view.points),
        "outline_px": [[round(float(x), 1), round(float(y), 1)] for x, y in outline],
        "sharpness": None if grey is None else _sharpness(board, view, grey),
        "rms_px": None,
        "tilt_rad": None,
        "used": None,
    }


def _sharpness(board: Board, view: View, grey: Image) -> float:
    """Return the sharpness of the board's edges within a set: independent of size and light.

    The variance of the Laplacian over that of the picture, times the pixels of a square.
    """
    left, top = np.maximum(view.pixels.min(axis=0).astype(int), 0)
    right, bottom = view.pixels.max(axis=0).astype(int) + 1
    cut = grey[top:bottom, left:right].astype(np.float64)
    areas = [
        float(cv2.contourArea(cv2.convexHull(at.astype(np.float32))))
        for at in (view.pixels, view.points[:, :2])
    ]
    if cut.size == 0 or areas[1] <= 0.0:
        return 0.0
    square_px = math.sqrt(areas[0] / areas[1]) * board.square_m
    return float(cv2.Laplacian(cut, cv2.CV_64F).var() / max(float(cut.var()), 1.0)) * square_px


def _cover(views: Sequence[View], size: tuple[int, int]) -> list[list[int]]:
    columns, rows = COVER_CELLS
    points = np.vstack([view.pixels for view in views])
    counts, _, _ = np.histogram2d(
        points[:, 1], points[:, 0], bins=(rows, columns), range=((0, size[1]), (0, size[0]))
    )
    return [[int(count) for count in row] for row in counts]


def _lens(calibration: Calibration) -> Report:
    rows = zip(
        LENS_NAMES[calibration.lens], calibration.values, calibration.deviations, strict=True
    )
    numbers = [
        {"name": name, "value": float(value), "std": _finite(float(std))}
        for name, value, std in rows
        if name != "none"
    ]
    return {"lens": calibration.lens, "rms_px": calibration.rms_px, "numbers": numbers}


def _stance(camera: Camera) -> Report:
    return {name: float(getattr(camera, name)) for name in NAMES}


def _tag(
    tag: MapTag, seen: TagSeen, before: CameraModel, after: CameraModel, located: Located
) -> Report:
    corners = np.array(seen.corners_px)
    was, now = (_rms(off_px(model, tag, corners)) for model in (before, after))
    sides = np.hypot(*(corners - np.roll(corners, 1, axis=0)).T)
    mm_per_px = 1000.0 * tag.size_m / float(sides.mean())
    return {
        "tag_id": seen.tag_id,
        "before_px": was,
        "after_px": now,
        "before_mm": was * mm_per_px,
        "after_mm": now * mm_per_px,
        "left_out": seen.tag_id in located.wrong,
    }


def _rms(errors: Floats) -> float:
    """Return the RMS of deviations, (n, 2) [px]."""
    return math.sqrt(float((errors**2).sum(axis=1).mean()))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
