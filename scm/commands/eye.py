"""`scm eye`: one part of the city, on its own."""

import argparse
from pathlib import Path

from scm.command import Command, part_arguments, run_part, state_argument, state_of


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    state_argument(parser)
    parser.add_argument("--camera", help="which camera of the map; default: its first")
    parser.add_argument(
        "--frames",
        metavar="SOURCE",
        help="0 or /dev/video0, csi:0, rtsp://..., http://..., a film, a picture, a folder, "
        "bus:CAMERA; default: emulated",
    )
    parser.add_argument("--loop", action="store_true", help="repeat a film or folder")
    parser.add_argument(
        "--delay-ms",
        type=float,
        default=0.0,
        metavar="MS",
        help="least delay from exposure to arrival, if the camera's stamps do not show it",
    )
    parser.add_argument(
        "--calibration",
        type=Path,
        metavar="FILE",
        help="lens: a file of `scm eye calibrate`, a ROS camera_info YAML, or OpenCV's YAML or XML",
    )
    parser.add_argument(
        "--tags", type=Path, metavar="FILE", help="more tags on the floor, as for `scm eye locate`"
    )


def _run(arguments: argparse.Namespace) -> int:
    import cv2

    from scm.eye.calibrate.locate import known_tags
    from scm.eye.calibration_files import load_calibration
    from scm.eye.calibration_state import CalibrationHistory
    from scm.eye.camera import camera_of
    from scm.eye.part import EyePart
    from scm.eye.sources.choose import source_of
    from scm.eye.station import eye_station
    from scm.maps.load import load_map
    from scm.store.records import record

    cv2.setNumThreads(1)  # the city needs the other cores, and one frame at a time is fast enough
    city_map = load_map(arguments.map)
    camera = camera_of(city_map, arguments.camera)
    source = arguments.frames and source_of(
        arguments.frames,
        size_px=(camera.width_px, camera.height_px),
        rate_hz=camera.rate_hz,
        loop=arguments.loop,
        delay_s=arguments.delay_ms / 1e3,
    )
    size_px = camera.width_px, camera.height_px
    lens = load_calibration(arguments.calibration, size_px) if arguments.calibration else None
    more = known_tags(city_map, arguments.tags)
    more.pop(city_map.tag.tag_id)
    station = eye_station(camera.name, first=camera is city_map.cameras[0])
    with state_of(arguments) as state:
        restored = None
        if state is not None:
            restored = record(state, "calibrations", station, camera.name, CalibrationHistory)
        part = EyePart(
            city_map,
            camera.name,
            arguments.seed,
            source or None,
            lens=lens,
            tags=tuple(more.values()),
            restored=restored,
        )
        return run_part(part, arguments, state)


COMMAND = Command(
    help="Locate cars by their tags in an overhead camera's frames.",
    example="scm eye driving_school --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
