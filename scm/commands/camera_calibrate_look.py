"""`scm camera calibrate-look`: fit the look of a car's rendered camera to real frames."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:  # the command line starts without what renders
    from scm.camera.calibrate.fit import Figures, Fitted
    from scm.camera.calibrate.real_frames import RealFrames
    from scm.camera.optics import Optics

TOGETHER = """What no frames of unknown poses can tell apart:
  exposure: the light in the room, the camera's gain, how dark the real floor is beside the map's
  white_balance: the colours of lamps and floor
  blur_px: the camera's motion while it is exposed; read_noise, shot_noise: the floor's fine texture
"""


def _arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("frames", type=Path, metavar="FRAMES", help="folder of the camera's frames, JPEG or PNG")
    add("--car", default="nigel", metavar="FILE", help="car file or name (%(default)s)")
    add("--map", default="driving_school", metavar="MAP", help="of the place (%(default)s)")
    add("--camera", choices=("front", "rear"), default="front", help="which one (%(default)s)")
    add("--out", type=Path, required=True, metavar="FILE", help="car file to write")
    add(
        "--sheet",
        type=Path,
        metavar="FILE",
        help="picture to write: frames before, after, real",
    )
    add("--seed", type=int, default=0, help="of all randomness (%(default)s)")


def _run(arguments: argparse.Namespace) -> int:
    import cv2

    from scm.camera.calibrate.car_file import write_look
    from scm.camera.calibrate.counterparts import Counterparts
    from scm.camera.calibrate.fit import fit
    from scm.camera.calibrate.real_frames import read_frames
    from scm.camera.optics import cameras_of, optics_of
    from scm.errors import CarError, EyeError
    from scm.maps.load import load_map
    from scm.vehicles.car import load_car

    sheet: Path | None = arguments.sheet
    if sheet and sheet.suffix.lower() not in {".jpg", ".jpeg", ".png"}:
        raise EyeError(f"--sheet {sheet}: expected a name that ends in .jpg or .png")
    car = load_car(arguments.car)
    if arguments.camera not in cameras_of(car):
        has = ", ".join(cameras_of(car)) or "no camera"
        raise CarError(f"{car.path}: expected a {arguments.camera} camera, the file has {has}")
    optics = optics_of(car, arguments.camera)
    city_map = load_map(arguments.map)
    real = read_frames(arguments.frames, (optics.width_px, optics.height_px))
    scene = Counterparts(city_map, optics, arguments.camera, arguments.seed)
    fitted = fit(real, scene, optics, _progress)
    _progress("")
    source = f"scm camera calibrate-look: {len(real.images)} frames of {arguments.frames}"
    write_look(arguments.out, car, fitted.optics, source)
    if sheet:
        sheet.parent.mkdir(parents=True, exist_ok=True)
        sheet.write_bytes(cv2.imencode(sheet.suffix, fitted.sheet)[1].tobytes())
    print(_report(real, optics, fitted))
    print(f"written to {arguments.out}")
    return 0


def _report(real: "RealFrames", before: "Optics", fitted: "Fitted") -> str:
    """Return the look before and after, the figures, and what is not determined."""
    from scm.camera.calibrate.car_file import KEYS

    height, width = real.images.shape[1:3]
    kind = "PNG" if real.jpeg_quality is None else f"JPEG of quality {real.jpeg_quality}"
    lines = [
        f"{real.folder}: {len(real.images)} of {real.count} frames, {width} x {height}, {kind}; "
        "every other one is held out", "", f"{'':26}{'before':>18}{'after':>18}",
    ]  # fmt: skip
    lines += [
        f"{key:26}{_shown(getattr(before, key)):>18}{_shown(getattr(fitted.optics, key)):>18}"
        for key in KEYS
    ]
    lines += ["", f"{'held-out frames':26}{'before':>18}{'after':>18}{'real':>18}"]
    rows = ("colour, off by [grey]", "noise [grey]", "sharpness of edges")
    sets = [_figures(one) for one in (fitted.before, fitted.after, fitted.real)]
    sets[2][0] = f"({sets[2][0]})"
    lines += [f"{row:26}" + "".join(f"{one[i]:>18}" for one in sets) for i, row in enumerate(rows)]
    lines += ["In brackets: by how much one half of the real frames differs from the other.", ""]
    lines += [f"Not determined by these frames: {remark}" for remark in fitted.remarks]
    return "\n".join(lines) + "\n" + TOGETHER


def _figures(one: "Figures") -> list[str]:
    return [
        "-" if figure is None else f"{figure:.2f}"
        for figure in (one.colour, one.noise, one.sharpness)
    ]


def _shown(value: float | tuple[float, ...]) -> str:
    numbers = value if isinstance(value, tuple) else (value,)
    return " ".join(f"{number:.4g}" for number in numbers)


def _progress(text: str) -> None:
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)


COMMAND = Command(
    help="Fit brightness, colour and noise of a car's rendered camera to a folder of real frames.",
    example="scm camera calibrate-look frames --car nigel --map driving_school --out car.toml",
    arguments=_arguments,
    run=_run,
)
