"""Reads a picture file, or a JPEG from the network, as an image; damaged ones are refused."""

from pathlib import Path

import cv2
import numpy as np

from scm.arrays import Image
from scm.errors import EyeError

MIN_SIDE_PX = 16  # of a picture
_JPEG, _SCAN, _END = b"\xff\xd8", b"\xff\xda", b"\xff\xd9"


def read_picture(path: Path) -> Image:
    """Return a picture file, (height, width, 3) blue, green, red.

    Raises:
        EyeError: The file is missing, unreadable, no picture, truncated or smaller than any tag.
    """
    if not path.is_file():
        raise EyeError(f"{path}: expected a picture, found no file")
    try:
        data = path.read_bytes()
    except OSError as cause:
        raise EyeError(f"{path}: expected a picture, got {cause.strerror}") from cause
    return decode_picture(data, str(path))


def decode_picture(data: bytes, name: str) -> Image:
    """Return an encoded picture, (height, width, 3) blue, green, red.

    Args:
        data: The file's content: JPEG, PNG, or whatever else OpenCV reads.
        name: Source of the picture, for errors.

    Raises:
        EyeError: It is no picture, truncated or smaller than any tag.
    """
    # OpenCV fills the missing part of a JPEG with grey, and warns on stderr at most
    if data.startswith(_JPEG) and data.rfind(_END) < data.rfind(_SCAN):
        raise EyeError(f"{name}: expected a whole JPEG, got one truncated after {len(data)} bytes")
    image = _decoded(data)
    if image is None:
        raise EyeError(f"{name}: expected a picture that OpenCV reads, got {len(data)} bytes")
    height, width = image.shape[:2]
    if min(height, width) < MIN_SIDE_PX:
        least = f"{MIN_SIDE_PX} x {MIN_SIDE_PX}"
        raise EyeError(f"{name}: expected at least {least} px, got {width} x {height}")
    return image


def _decoded(data: bytes) -> Image | None:
    if not data:
        return None
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:  # its header claims more pixels than OpenCV makes room for
        return None
    return None if image is None else np.asarray(image, dtype=np.uint8)
