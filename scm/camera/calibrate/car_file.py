"""A car file with a look that was fitted."""

from pathlib import Path

from scm.camera.optics import Optics
from scm.errors import CarError, reading
from scm.vehicles.car import Car, load_car
from scm.vehicles.car_text import number, quoted, set_entry

KEYS = (
    "exposure", "white_balance", "gamma", "vignetting", "blur_px", "read_noise", "shot_noise",
    "jpeg_quality",
)  # fmt: skip
_DIGITS = 4


def write_look(path: Path, car: Car, optics: Optics, source: str) -> None:
    """Write a car's file again, with another look of its cameras.

    Args:
        path: To write.
        car: Whose file it is; comments and all other numbers stay as they are there.
        optics: With the look.
        source: Where it is from.

    Raises:
        CarError: when it cannot be written, or would not load: effects of its own must lie beside.
    """
    text = car.path.read_text(encoding="utf-8")
    for key in KEYS:
        entry = f"{{ value = {_text(getattr(optics, key))}, source = {quoted(source)} }}"
        text = set_entry(text, "camera", key, entry)
    with reading(path, "a place for a car file", CarError):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    load_car(path)


def _text(value: float | tuple[float, ...]) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(number(one, _DIGITS) for one in value) + "]"
    return number(value, _DIGITS)
