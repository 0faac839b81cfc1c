"""Is there anything to see in a frame? Every 16th pixel of every 16th row tells."""

import numpy as np

from scm.arrays import Image
from scm.clock import NS_PER_S

STRIDE_PX = 16
FROZEN_NS = NS_PER_S
BLACK, BLACK_SHARE = 20, 0.995
WHITE, WHITE_SHARE = 252, 0.5
FLAT_LEVELS = 3


class FrameCheck:
    """Watches the frames of one live camera."""

    def __init__(self) -> None:
        self._last = np.empty((0, 0), dtype=np.uint8)
        self._since_ns = 0

    def look(self, image: Image, t_ns: int) -> str | None:
        """Return what is wrong with a frame that arrived at `t_ns`, None: nothing."""
        some = image[::STRIDE_PX, ::STRIDE_PX]
        some = np.ascontiguousarray(some if some.ndim == 2 else some[..., 1])
        if not np.array_equal(some, self._last):
            self._last, self._since_ns = some, t_ns
        return _empty(some) or self._frozen(t_ns)

    def _frozen(self, t_ns: int) -> str | None:
        still_ns = t_ns - self._since_ns
        if still_ns <= FROZEN_NS:
            return None
        return f"frames are frozen: the same picture for {still_ns / NS_PER_S:.1f} s"


def _empty(some: Image) -> str | None:
    if np.count_nonzero(some <= BLACK) >= BLACK_SHARE * some.size:
        return "frames are black"
    white = np.count_nonzero(some >= WHITE) / some.size
    if white > WHITE_SHARE:
        return f"frames are overexposed: {100.0 * white:.0f} % of the picture is white"
    if int(some.max()) - int(some.min()) < FLAT_LEVELS:
        return f"frames are one flat grey of {int(some.mean())}"
    return None
