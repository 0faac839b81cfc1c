"""`scm eye render`: frames of an overhead camera with the truth beside each."""

import argparse
import json
import math
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scm.command import Command
from scm.errors import EyeError

if TYPE_CHECKING:  # the command line starts without what draws
    from scm.eye.render.shots import Look, Shot

CABLES_WITH_HANDS = 2
TRUTH, CAMERA = "truth.jsonl", "camera.toml"


def _arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("map", metavar="MAP", help="map name or file")
    add(
        "--out", type=Path, required=True, metavar="DIR", help="folder to write; created if missing"
    )
    add("--cars", type=int, default=6, help="how many (%(default)s)")
    add("--frames", type=int, default=30, help="how many (%(default)s)")
    add("--rate-hz", type=float, default=30.0, help="frames per second (%(default)s)")
    add("--speed-mps", type=float, default=0.5, help="of every car (%(default)s)")
    add(
        "--lanes",
        action="store_true",
        help="let the cars follow the map's lanes, not the edge of the floor",
    )
    add("--size", type=_size, default=(1920, 1080), help="COLUMNSxROWS (1920x1080)")
    add("--height-m", type=float, default=2.5, help="of the lens (%(default)s)")
    add("--focal-px", type=float, help="default: the longest that shows the whole floor")
    add("--tilt-deg", type=float, default=0.0, help="from straight down (%(default)s)")
    add("--fisheye", action="store_true", help="a fisheye lens; default: a pinhole with five terms")
    add("--exposure-ms", type=float, default=0.0, help="exposure time of each row")
    add("--rolling-ms", type=float, default=0.0, help="from the first row to the last")
    add("--blur-px", type=float, default=0.0, help="sideways blur of the whole picture")
    add("--defocus-px", type=float, default=0.0, help="radius of the disc that a point becomes")
    add("--vignetting", type=float, default=0.0, help="share of light missing at the corners")
    add("--gradient", type=float, default=0.0, help="how much brighter one side is, as a share")
    add("--lamps", type=int, default=0, help="number of lamps that brighten their surroundings")
    add("--noise-sigma", type=float, default=2.0, help="grey levels at grey 128 (%(default)s)")
    add("--glare", action="store_true", help="reflections of two lamps on floor and tags")
    add("--hands", action="store_true", help="a moving hand and two cables in the picture")
    add("--jpeg", type=int, metavar="QUALITY", help="write JPEG, not PNG")
    add("--grey", action="store_true", help="grey frames")
    add("--seed", type=int, default=0, help="of all randomness (%(default)s)")


def _size(text: str) -> tuple[int, int]:
    columns, _, rows = text.partition("x")
    try:
        return int(columns), int(rows)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected such as 1920x1080, got {text!r}") from None


def _run(arguments: argparse.Namespace) -> int:
    import cv2
    import msgspec
    import numpy as np

    from scm.clock import WallClock
    from scm.eye.render.scene import camera_over, camera_toml
    from scm.eye.render.shots import Studio
    from scm.eye.render.traffic import tours
    from scm.maps.load import load_map
    from scm.progress import Progress

    _refuse(arguments)
    city_map = load_map(arguments.map)
    model = camera_over(
        city_map, arguments.size, arguments.height_m, math.radians(arguments.tilt_deg),
        arguments.focal_px, fisheye=arguments.fisheye,
    )  # fmt: skip
    settings = {
        "rate_hz": arguments.rate_hz,
        "noise_sigma": arguments.noise_sigma,
        "rolling_s": arguments.rolling_ms * 1e-3,
    }
    camera = msgspec.structs.replace(model.camera, **settings)
    rng = np.random.default_rng([arguments.seed, *b"traffic"])
    cars = tours(
        city_map, arguments.cars, arguments.speed_mps, arguments.frames / arguments.rate_hz, rng,
        on_lanes=arguments.lanes,
    )  # fmt: skip
    studio = Studio(city_map, model, _look(arguments), arguments.seed)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / CAMERA).write_text(camera_toml(camera), encoding="utf-8")
    kind = "png" if arguments.jpeg is None else "jpg"
    how = [] if arguments.jpeg is None else [cv2.IMWRITE_JPEG_QUALITY, arguments.jpeg]
    progress = Progress(sys.stderr, WallClock())
    with closing(progress), (arguments.out / TRUTH).open("w", encoding="utf-8") as truth:
        for number in range(arguments.frames):
            progress.step("rendering frames", number, arguments.frames)
            t_ns = round(number * 1e9 / arguments.rate_hz)
            shot = studio.shoot([car.at(t_ns * 1e-9) for car in cars], t_ns)
            path = arguments.out / f"{number:06}.{kind}"
            _, packed = cv2.imencode(f".{kind}", shot.image, how)
            path.write_bytes(packed.tobytes())
            truth.write(json.dumps({"image": path.name, **_truth(shot)}) + "\n")
    print(f"{arguments.frames} frames, {TRUTH} and {CAMERA} in {arguments.out}")
    return 0


def _refuse(arguments: argparse.Namespace) -> None:
    """Refuse what cannot be, all of it in one message.

    Raises:
        EyeError: naming each option, with what was expected and got.
    """
    least = {
        "cars": 0, "frames": 1, "speed_mps": 0, "exposure_ms": 0, "rolling_ms": 0, "blur_px": 0,
        "defocus_px": 0, "gradient": 0, "lamps": 0, "noise_sigma": 0,
    }  # fmt: skip
    faults = [
        f"--{name.replace('_', '-')}: expected at least {low}, got {getattr(arguments, name)}"
        for name, low in least.items()
        if not getattr(arguments, name) >= low
    ]
    if not arguments.rate_hz > 0.0:
        faults.append(f"--rate-hz: expected above 0, got {arguments.rate_hz}")
    if not 0.0 <= arguments.vignetting <= 1.0:
        faults.append(f"--vignetting: expected a share from 0 to 1, got {arguments.vignetting}")
    if not abs(arguments.tilt_deg) <= 45.0:
        faults.append(f"--tilt-deg: expected up to 45 either way, got {arguments.tilt_deg}")
    if arguments.jpeg is not None and not 1 <= arguments.jpeg <= 100:
        faults.append(f"--jpeg: expected a quality from 1 to 100, got {arguments.jpeg}")
    if arguments.exposure_ms * arguments.rate_hz > 1e3:
        faults.append(f"--exposure-ms: expected no more than a frame lasts at {arguments.rate_hz}"
                      f" Hz, got {arguments.exposure_ms}")  # fmt: skip
    if faults:
        raise EyeError("; ".join(faults))


def _look(arguments: argparse.Namespace) -> "Look":
    from scm.eye.render.shots import Look

    return Look(
        exposure_s=arguments.exposure_ms * 1e-3,
        rolling_s=arguments.rolling_ms * 1e-3,
        blur_px=arguments.blur_px,
        defocus_px=arguments.defocus_px,
        vignetting=arguments.vignetting,
        gradient=arguments.gradient,
        lamps=arguments.lamps,
        glares=2 if arguments.glare else 0,
        noise_sigma=arguments.noise_sigma,
        hands=1 if arguments.hands else 0,
        cables=CABLES_WITH_HANDS if arguments.hands else 0,
        colour=not arguments.grey,
    )


def _truth(shot: "Shot") -> dict[str, Any]:
    """Return one line of the truth, as JSON has it."""
    cars = [
        {
            "vehicle": one.car.vehicle, "car": one.car.car, "tag_id": one.car.tag_id,
            "x_m": one.car.x_m, "y_m": one.car.y_m, "yaw_rad": one.car.yaw_rad,
            "speed_mps": one.car.speed_mps, "yaw_rate_rad_s": one.yaw_rate_rad_s,
        }
        for one in shot.cars
    ]  # fmt: skip
    tags = [
        {
            "id": tag_id, "corners_px": truth.corners_px.round(4).tolist(),
            "visible": round(truth.visible, 4), "smear_px": round(truth.smear_px, 3),
        }
        for tag_id, truth in shot.tags.items()
    ]  # fmt: skip
    return {"t_ns": shot.t_ns, "cars": cars, "tags": tags}


COMMAND = Command(
    help="Render frames of an overhead camera with the truth: blur, glare, noise, hands.",
    example="scm eye render driving_school --out film --cars 10 --exposure-ms 4 --noise-sigma 8",
    arguments=_arguments,
    run=_run,
)
