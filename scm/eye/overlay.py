"""The preview of the Eye: the frame with the detections drawn over it."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from scm.arrays import Image
from scm.errors import EyeError
from scm.records.eye import TagSeen

JPEG_QUALITY = 80
FRACTION_BITS = 4
FOUND, SUSPECT, EDGE = (90, 220, 60), (40, 140, 255), (20, 20, 20)
FRONT = (255, 255, 255)
FONT = cv2.FONT_HERSHEY_SIMPLEX
TEXT_PX = 720.0
"""Height of a picture whose text has scale 0.5."""


def preview(
    image: Image,
    tags: Sequence[TagSeen],
    names: Mapping[int, str],
    complaints: Sequence[str] = (),
) -> bytes:
    """Return a frame as JPEG with its tags outlined, named, and the camera's faults.

    Args:
        image: (height, width, 3) blue, green, red, or (height, width) grey; not changed.
        tags: Found in it.
        names: Of the vehicles by tag id; others are shown by their id.
        complaints: Faults as sentences, one a line at the picture's foot.
    """
    grey = image.ndim == 2
    shown: Image = np.stack((image,) * 3, axis=-1) if grey else image.copy()
    scale = max(0.4, 0.5 * shown.shape[0] / TEXT_PX)
    thick = max(1, round(2.0 * scale))
    for tag in tags:
        _outline(shown, tag, SUSPECT if complaints else FOUND, thick)
        name = names.get(tag.tag_id, f"tag {tag.tag_id}")
        x, y = np.min(tag.corners_px, axis=0)
        _text(shown, name, (round(x), round(y) - 4), scale, thick)
    for line, sentence in enumerate(reversed(complaints)):
        _text(
            shown, sentence, (8, shown.shape[0] - 10 - round(line * 44 * scale)), 1.2 * scale, thick
        )
    return jpeg(shown)


def jpeg(image: Image) -> bytes:
    """Return a picture as a JPEG file.

    Raises:
        EyeError: It cannot be encoded.
    """
    good, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not good:
        raise EyeError(f"cannot encode a frame of shape {image.shape} as JPEG")
    return data.tobytes()


def _outline(shown: Image, tag: TagSeen, colour: tuple[int, int, int], thick: int) -> None:
    """Draw a tag's square, and a line from its middle to its front, which is its print's right."""
    corners = np.array(tag.corners_px)
    fixed = np.rint(corners * 2**FRACTION_BITS).astype(np.int32)
    cv2.polylines(shown, [fixed], True, colour, thick, cv2.LINE_AA, FRACTION_BITS)
    ends = np.array([corners.mean(axis=0), corners[1:3].mean(axis=0)])
    ends = np.rint(ends * 2**FRACTION_BITS).astype(np.int32)
    cv2.polylines(shown, [ends], False, FRONT, thick, cv2.LINE_AA, FRACTION_BITS)


def _text(shown: Image, text: str, at: tuple[int, int], scale: float, thick: int) -> None:
    """Write text with a dark edge, readable on any floor."""
    plain = text.encode("ascii", "replace").decode()
    cv2.putText(shown, plain, at, FONT, scale, EDGE, thick + 2, cv2.LINE_AA)
    cv2.putText(shown, plain, at, FONT, scale, FRONT, thick, cv2.LINE_AA)
