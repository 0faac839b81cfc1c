"""`scm eye locate`: where a camera hangs, from tags on the map."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:  # the command line starts without what finds tags
    from scm.eye.calibrate.locate import Located, Place


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("image", type=Path, metavar="IMAGE", help="a frame of the camera")
    parser.add_argument("--map", required=True, metavar="MAP", help="map name or file")
    parser.add_argument(
        "--calibration",
        type=Path,
        metavar="FILE",
        help="lens file of `scm eye calibrate`, ROS or OpenCV; default: the map's",
    )
    parser.add_argument("--camera", metavar="NAME", help="camera of the map; default: its first")
    parser.add_argument(
        "--tags",
        type=Path,
        metavar="FILE",
        help="more tags: [[tags]] id, x_m, y_m, yaw_rad, size_m",
    )
    parser.add_argument(
        "--report", type=Path, metavar="FILE", help="write all results as JSON, for programs"
    )


def _run(arguments: argparse.Namespace) -> int:
    import numpy as np

    from scm.errors import EyeError
    from scm.eye.calibrate.locate import known_tags, locate, off_px
    from scm.eye.calibrate.report import place_report, write_report
    from scm.eye.calibration import calibrated
    from scm.eye.calibration_files import read_calibration
    from scm.eye.camera import camera_of
    from scm.eye.detect import Settings, detect_tags
    from scm.eye.find.causes import cause_of
    from scm.eye.picture import read_picture
    from scm.eye.source import grey_of
    from scm.maps.load import load_map

    city_map = load_map(arguments.map)
    grey = grey_of(read_picture(arguments.image))
    size_px = int(grey.shape[1]), int(grey.shape[0])
    file = arguments.calibration
    lens, remarks = read_calibration(file, size_px) if file else (None, tuple[str, ...]())
    if lens is not None and not city_map.cameras:
        camera = in_force = lens.camera(arguments.camera or "overhead")
    else:
        in_force = camera_of(city_map, arguments.camera)
        camera = in_force if lens is None else calibrated(in_force, lens)
    if size_px != (camera.width_px, camera.height_px):
        wanted = f"{camera.width_px} x {camera.height_px} px"
        got = f"{size_px[0]} x {size_px[1]}"
        raise EyeError(f"{arguments.image}: camera {camera.name!r} has {wanted}, got {got}")
    tags = known_tags(city_map, arguments.tags)
    seen = detect_tags(grey, Settings(quad_decimate=1.0))
    if not seen and (cause := cause_of(grey)):
        raise EyeError(f"{arguments.image}: no tag is found: {cause.said}")
    covariance = None if lens is None else lens.lens_covariance
    located = locate(camera, tags, seen, covariance)
    model = located.places[0].model
    for tag in seen:
        if tag.tag_id in tags:
            off = off_px(model, tags[tag.tag_id], np.array(tag.corners_px))
            left = float((off**2).sum(axis=1).mean()) ** 0.5
            note = "  left out: not at its stated place" * (tag.tag_id in located.wrong)
            print(f"# tag {tag.tag_id}: {left:.3f} px off{note}")
    print("\n".join((*_solution_lines(located), *(f"# the lens: {remark}" for remark in remarks))))
    if lens is None:
        print("# the lens is assumed exact; with --calibration the numbers include its uncertainty")
    block = _block(located.places[0])
    print(block)
    if arguments.report:
        write_report(place_report(in_force, tags, seen, located, block), arguments.report)
    return 0


def _solution_lines(located: "Located") -> list[str]:
    lines = [
        f"# solution {'AB'[i]}: {place.rms_px:.3f} px RMS, tilted "
        f"{math.degrees(place.tilt_rad):.2f} deg, weight {place.weight:.3g}"
        for i, place in enumerate(located.places)
    ]
    if len(located.places) == 1:
        lines.append("# no other pose above the floor explains these tags")
    elif not located.is_sure:
        other = located.places[1].model.camera
        lines.append(
            "# WARNING: the two solutions are indistinguishable; the other is "
            + ", ".join(
                f"{name} = {getattr(other, name):.4f}"
                for name in ("x_m", "y_m", "z_m", "yaw_rad", "tilt_x_rad", "tilt_y_rad")
            )
            + ". Lay out a second tag, far from the first (--tags)."
        )
    return lines


def _block(place: "Place") -> str:
    from scm.eye.calibrate.locate import NAMES

    camera = place.model.camera
    stated = [
        f"{name} = {getattr(camera, name):.6f}".ljust(28) + f"# +-{deviation:.6f}"
        for name, deviation in zip(NAMES, place.deviations, strict=True)
    ]
    place_std = ", ".join(f"{deviation:.3g}" for deviation in place.deviations)
    lens = [f'lens = "{camera.lens}"'] if camera.lens != "pinhole" else []
    numbers = [
        f"{name} = {getattr(camera, name)!r}"
        for name in ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px")
    ]
    rest = [f"{name} = {getattr(camera, name)!r}" for name in ("rate_hz", "noise_sigma")]
    bent = f"distortion = [{', '.join(repr(value) for value in camera.distortion)}]"
    return "\n".join(
        [
            *("[[cameras]]", f'name = "{camera.name}"', *stated, f"place_std = [{place_std}]"),
            *(*numbers, *lens, bent, *rest),
        ]
    )


COMMAND = Command(
    help="Locate a camera by tags on the map, and print its [[cameras]] block.",
    example="scm eye locate frame.png --map driving_school --calibration lens.toml",
    arguments=_arguments,
    run=_run,
)
