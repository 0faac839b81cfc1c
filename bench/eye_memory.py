"""What the finder's memory grows by over thousands of frames.

The AprilTag library is said to leak; the finder's strips and cut-outs both go through it. Tags come
and go, so that known, lost, searched and empty frames are all met. Resident memory is read after a
tenth of the calls has filled the caches. Run: `python -m bench.eye_memory [calls]`.
"""

import gc
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from bench.eye_find import frames
from scm.eye.detect import Settings, look_around
from scm.eye.find.finder import TagFinder

PAGE_BYTES = 4096
LIMIT_BYTES = 100
"""A call: at 60 frames/s half a gigabyte in a day."""
PART = (slice(200, 740), slice(300, 1260))


def resident_bytes() -> int:
    """Return what the process holds in memory."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE_BYTES


def growth(step: Callable[[int], None], count: int) -> tuple[float, float]:
    """Return growth [byte] a call in the first and in the second half, after a tenth to warm up."""
    for k in range(count // 10):
        step(k)
    half, marks = count // 2, [resident_bytes()]
    for k in range(2 * half):
        step(k)
        if (k + 1) % half == 0:
            marks.append(resident_bytes())
    return (marks[1] - marks[0]) / half, (marks[2] - marks[1]) / half


def main(count: int = 1000) -> None:
    cv2.setNumThreads(1)
    ((grey, true),) = frames(1920, 1)
    part = np.ascontiguousarray(grey[PART])
    corner = np.array([PART[1].start, PART[0].start])
    inside = {
        i: at - corner
        for i, at in true.items()
        if ((at - corner > 20) & (at - corner < np.array(part.shape[::-1]) - 20)).all()
    }
    empty = np.full_like(part, 90)
    few = part.copy()
    few[:, 480:] = 90
    finder, settings = TagFinder(), Settings()

    def find(k: int) -> None:
        shown = (part, part, few, part, few, empty, part, part)[k // 5 % 8]
        finder.find(shown, inside if k % 3 else {})

    def cut(k: int) -> None:
        ids = sorted(inside)
        look_around(part, settings, inside[ids[k % len(ids)]], 0.75)

    print(f"{count} calls, {len(inside)} tags in {part.shape[1]} x {part.shape[0]} px")
    for name, step in (("the finder", find), ("library's cut-out", cut)):
        first, second = growth(step, count)
        good = "pass" if second < LIMIT_BYTES else "FAIL"
        print(f"{name:18} {first:8.0f} then {second:8.0f} byte a call "
              f"(limit {LIMIT_BYTES}): {good}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
