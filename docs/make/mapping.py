"""Makes docs/pictures/mapping.png: the maps of a simulated and of a real drive.

Run with `python docs/make/mapping.py`, where the shared recordings are; needs
`pip install -e '.[docs]'`.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from drawing import plt

from bench.autonomy_mapping import BAGS, SCANNER, Lap, drive, mapped, recorded
from scm.maps.load import load_map
from scm.maps.segments import wall_segments
from vehicle_agent.autonomy.mapping import Mapper

OUT = Path(__file__).parents[1] / "pictures" / "mapping.png"


def main() -> None:
    """Draw cells, faces and drive of two maps."""
    walls = wall_segments(load_map("parking_school_obstacles"))
    simulated, _ = mapped(walls, drive(walls, Lap(), 0.025, 28.0, people=2))
    real = Mapper(SCANNER)
    for sweep in recorded(BAGS / "skidpad_lht_0_1.bag")[0]:
        real.add(sweep)
    figure, both = plt.subplots(1, 2, figsize=(11, 6))
    titles = "simulated: Parking School, two people, 25 mm noise", "real: skidpad_lht_0_1"
    for axes, mapper, title in zip(both, (simulated, real), titles, strict=True):
        grid = mapper.grid()
        rows, columns = grid.cells.shape
        right, top = grid.x_m + columns * grid.cell_m, grid.y_m + rows * grid.cell_m
        axes.imshow(np.where(grid.cells < 0, 50, grid.cells), cmap="Greys", origin="lower",
                    extent=(grid.x_m, right, grid.y_m, top), vmax=150)  # fmt: skip
        faces = mapper.faces()
        axes.plot(faces[:, ::2].T, faces[:, 1::2].T, "C0-", linewidth=1.5)
        axes.plot(*np.array(mapper.trajectory)[:, :2].T, "C3-", linewidth=1)
        axes.set(xlabel="x [m]", ylabel="y [m]", title=title)
    figure.tight_layout()
    figure.savefig(OUT, dpi=80)


if __name__ == "__main__":
    main()
