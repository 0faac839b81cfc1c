"""Makes docs/pictures/lidar.png: a recorded scan of Tiny Town, and ours from the same place.

Run with `python docs/make/lidar.py`, where the shared recordings are; needs
`pip install -e '.[docs]'`.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from drawing import plt

from scm.vehicles.car import load_car
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensor import Surroundings
from scm.vehicles.sensors.lidar import scan
from tests.physics import tiny_town

OUT = Path(__file__).parents[1] / "pictures" / "lidar.png"
SHOWN = 60


def main() -> None:
    """Draw the walls, one scan over them, and how far all held-out beams are off."""
    drive = tiny_town.load()
    learn, rest = drive.fresh[::2], drive.fresh[1::2]
    lag = tiny_town.LAG_S
    walls = tiny_town.walls_of(drive.hits(learn, drive.scanners(learn, lag)))
    scanners = drive.scanners(rest, lag)
    scene = Scene(WallGrid(walls), np.zeros((0, 4)), np.zeros(0, np.int64))
    ours = scan(load_car("nigel"), scanners, Surroundings(scene, np.full(len(scanners), -1)))
    off = np.abs(ours - drive.ranges[rest]).ravel()
    figure, (plan, share) = plt.subplots(1, 2, figsize=(11, 5.5), width_ratios=(3, 2))
    for x0, y0, x1, y1 in walls:
        plan.plot((x0, x1), (y0, y1), color="0.75", linewidth=4, solid_capstyle="butt")
    hits = drive.hits(rest[SHOWN : SHOWN + 1], scanners[SHOWN : SHOWN + 1])[0]
    x, y, yaw = scanners[SHOWN]
    angle = yaw + np.radians(np.arange(360))
    plan.plot(x + ours[SHOWN] * np.cos(angle), y + ours[SHOWN] * np.sin(angle), "o",
              markersize=5, markerfacecolor="none", label="ours")  # fmt: skip
    plan.plot(hits[:, 0], hits[:, 1], ".", markersize=3, label="recorded")
    plan.plot(*drive.poses[:, :2].T, "k-", linewidth=1, label="the drive")
    plan.plot(x, y, "k^")
    plan.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title="one turn, and the walls (grey)")
    plan.legend(loc="lower right")
    share.semilogx(np.sort(off) * 1000.0, np.linspace(0.0, 100.0, len(off)))
    share.set(xlabel="difference of a beam [mm]", ylabel="share of beams below [%]",
              xlim=(0.01, 1000.0), title=f"{len(rest)} scans held out")  # fmt: skip
    share.grid(visible=True)
    figure.tight_layout()
    figure.savefig(OUT, dpi=90)


if __name__ == "__main__":
    main()
