"""The scans of the AutoDRIVE simulator's own Nigel in Tiny Town, and the walls that they imply.

No map of Tiny Town is published, but all its walls run along x or y. Pieces between neighbouring
hits that do so too are gathered by their coordinate, 3 cm apart at most, and by their extent.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats, Ints

FOLDER = Path(__file__).parents[3] / "shared" / "recordings" / "autodrive_sim_tinytown"
MOUNT_M = 0.1445
LAG_S = 0.045
APART_M, GAP_M, LONGEST_PIECE_M, SLOPE = 0.03, 0.25, 0.4, 0.12
FEWEST_PIECES = 60


class Drive(NamedTuple):
    """One recording: poses by time, and scans with the row that first held each."""

    t: Floats
    poses: Floats
    ranges: Floats
    fresh: Ints

    def scanners(self, rows: Ints, lag_s: float, mount_m: float = MOUNT_M) -> Floats:
        """Return where the scanner was when it took the scans of some rows, (k, 3)."""
        when = self.t[rows] - lag_s
        x, y, yaw = (np.interp(when, self.t, column) for column in self.poses.T)
        return np.column_stack((x + mount_m * np.cos(yaw), y + mount_m * np.sin(yaw), yaw))

    def hits(self, rows: Ints, scanners: Floats) -> Floats:
        """Return the points that the beams of some rows met, (k, beams, 2)."""
        angle = scanners[:, 2:] + np.radians(np.arange(360))
        u = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
        return scanners[:, None, :2] + self.ranges[rows][..., None] * u


def load() -> Drive:
    """Read the recording. The first few scans are those of the last pose: they are left out."""
    log = np.genfromtxt(FOLDER / "vehicle.csv", delimiter=",", names=True)
    ranges = np.load(FOLDER / "lidar.npz")["ranges"].astype(float)
    poses = np.column_stack((log["x"], log["y"], np.unwrap(log["yaw"])))
    fresh = 1 + np.flatnonzero((ranges[1:] != ranges[:-1]).any(axis=1))
    return Drive(log["t"], poses, ranges, fresh[6:])


def walls_of(hits: Floats) -> Floats:
    """Return the walls (m, 4) along x and y that pieces between neighbouring hits lie on."""
    ends = np.roll(hits, -1, axis=1)
    reach = ends - hits
    short = np.hypot(reach[..., 0], reach[..., 1]) < LONGEST_PIECE_M
    found = []
    for along in (0, 1):
        lies = short & (np.abs(reach[..., 1 - along]) < SLOPE * np.abs(reach[..., along]))
        level = 0.5 * (hits[..., 1 - along] + ends[..., 1 - along])[lies]
        low = np.minimum(hits[..., along], ends[..., along])[lies]
        high = np.maximum(hits[..., along], ends[..., along])[lies]
        for at, begin, end in _lines(level, low, high):
            found.append((begin, at, end, at) if along == 0 else (at, begin, at, end))
    return np.array(found)


def _lines(level: Floats, low: Floats, high: Floats) -> list[tuple[float, float, float]]:
    by_level = np.argsort(level)
    cuts = np.flatnonzero(np.diff(level[by_level]) > APART_M) + 1
    lines = []
    for group in np.split(by_level, cuts):
        inwards = group[np.argsort(low[group])]
        so_far = np.maximum.accumulate(high[inwards])
        gaps = np.flatnonzero(low[inwards][1:] > so_far[:-1] + GAP_M) + 1
        lines += [
            (float(np.median(level[part])), float(low[part].min()), float(high[part].max()))
            for part in np.split(inwards, gaps)
            if len(part) >= FEWEST_PIECES
        ]
    return lines
