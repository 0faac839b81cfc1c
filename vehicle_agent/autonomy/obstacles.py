"""What stands where, as the scanner sees it now: the map, corrected by the last sweeps.

Every cell near the car stores how far it is from the nearest face that beams through it have met, +
on their side (truncated signed distance), as a running mean: the map's faces first, then what is
measured. So the noise of single echoes averages out, a wall that stands elsewhere than on the map
moves there, and what is not on the map appears. A measurement that contradicts the mean is a
change: it counts as much as all before it. Something nearer is a matter of safety, and noise
averages out over cells side by side as well: where they agree that it has appeared, their mean is
taken at once.

    distance = range of the beam through the cell - distance of the cell, cut at +- some sigma

Holds: faces do not move, or so slowly that some sweeps see them at the same place.
Source: Curless and Levoy, "A volumetric method for building complex models from range images",
SIGGRAPH 1996; its use against changes is ours.
"""

import math
from dataclasses import replace

import cv2
import numpy as np

from scm.arrays import Bools, Floats
from scm.geometry import TAU, Pose2
from scm.vehicles.jit import array_kernel
from vehicle_agent.autonomy.grid_map import FREE, OCCUPIED, GridMap

CELL_M = 0.02
REACH_M = 2.5  # from the scanner, in which cells are updated
EDGE_M = 0.6  # more than any car needs beside it
SPREADS, LEAST_CUT_M, MOST_CUT_M = 2.0, 0.05, 0.1  # of a range's noise, at which distances are cut
UNMAPPED_M = 0.12  # from all that the map has
CHANGED = 3.0  # of a range's noise, from the mean: something else stands there now
APPEARED = 1.5  # the same for something nearer, as the mean over the cells about one
AROUND, LEAST_SEEN = (5, 5), 0.5  # of them, for a full vote
MAP_WEIGHT = 2.0  # of the map, in sweeps
LEAST_WEIGHT, MOST_WEIGHT, AVERAGE_STD_M = 4.0, 24.0, 0.012  # of a mean; its scatter
BEARINGS = 720


class ObstacleLayer:
    """The map with what the scanner sees.

    Args:
        grid: Map.
        noise_m: Standard deviation of a range.

    Attributes:
        grid: The map as it is now; its arrays change with every sweep.
    """

    def __init__(self, grid: GridMap, noise_m: float) -> None:
        self._map = grid
        self.grid = replace(grid, cells=grid.cells.copy(), clearance_m=grid.clearance_m.copy())
        self._block = max(1, round(CELL_M / grid.cell_m))  # cells of the map along one of these
        block = self._block
        whole = [(0, -n % block) for n in grid.cells.shape]
        self._drawn = np.pad(_solid(grid), whole, "edge")[block // 2 :: block, block // 2 :: block]
        self.set_noise(noise_m)
        self._mean: Floats = np.clip(self._drawn, -self._cut_m, self._cut_m)
        self._weight: Floats = np.full(self._mean.shape, MAP_WEIGHT)

    def set_noise(self, noise_m: float) -> None:
        """Set the standard deviation of a range."""
        self._cut_m = float(np.clip(SPREADS * noise_m, LEAST_CUT_M, MOST_CUT_M))
        self._changed_m = CHANGED * noise_m
        self._appeared_m = float(np.clip(APPEARED * noise_m, CELL_M, self._cut_m))
        self._most = float(np.clip((noise_m / AVERAGE_STD_M) ** 2, LEAST_WEIGHT, MOST_WEIGHT))

    def update(self, scanner: Pose2, echoes: Floats) -> None:
        """Take one sweep.

        Args:
            scanner: Map frame.
            echoes: (m, 2), map frame [m].
        """
        grid, cell_m = self._map, self._block * self._map.cell_m
        off = echoes - (scanner.x, scanner.y)
        ranges = np.full(BEARINGS, np.nan)
        bearing = np.arctan2(off[:, 1], off[:, 0])
        number = np.round(bearing / TAU * BEARINGS).astype(np.int64) % BEARINGS
        far = np.hypot(*off.T)
        order = np.argsort(-far)
        ranges[number[order]] = far[order]  # the nearest of those in one direction
        x, y = (scanner.x - grid.x_m) / cell_m, (scanner.y - grid.y_m) / cell_m
        window = self._window(x, y, REACH_M / cell_m)
        mean = self._mean[window]
        if mean.size == 0:
            return
        seen = np.full(mean.shape, np.nan)
        _look(seen, x - window[1].start, y - window[0].start, cell_m, ranges, self._cut_m)
        self._average(mean, self._weight[window], seen)
        self._redraw(x, y, REACH_M / cell_m)

    def _average(self, mean: Floats, weight: Floats, seen: Floats) -> None:
        """Bring means and weights up to date with the distances of a sweep; NaN: none is known."""
        known = ~np.isnan(seen)
        more = np.where(known, seen - mean, 0.0)
        share = cv2.blur(known.astype(np.float64), AROUND)
        around = cv2.blur(more, AROUND) / np.maximum(share, LEAST_SEEN)
        appeared = known & (around < -self._appeared_m)
        changed = (more < -self._changed_m) | ((mean < 0.0) & (more > self._changed_m))
        np.minimum(weight, 1.0, out=weight, where=appeared | changed)
        step = more / (weight + 1.0)
        mean += np.where(appeared, np.minimum(step, around), step)
        np.minimum(weight + known, self._most, out=weight)

    def _window(self, x: float, y: float, reach: float) -> tuple[slice, slice]:
        """Return the rows and columns about a place; all in cells of the layer."""
        rows, columns = (
            slice(max(0, math.floor(at - reach)), max(0, min(count, math.ceil(at + reach))))
            for at, count in zip((y, x), self._mean.shape, strict=True)
        )
        return rows, columns

    def points(self) -> Floats:
        """Return middles of cells that are occupied now and free on the map (n, 2) [m]."""
        rows, columns = np.nonzero((self._mean < 0.0) & (self._drawn > UNMAPPED_M))
        middles = np.column_stack((columns + 0.5, rows + 0.5)) * self._block * self._map.cell_m
        points: Floats = middles + np.array((self._map.x_m, self._map.y_m))
        return points

    def _redraw(self, x: float, y: float, reach: float) -> None:
        """Bring the grid up to date about a place; all in cells of the layer.

        Clearances beyond `EDGE_M` are not needed exactly: faces outside the window count for none.
        """
        block = self._block
        wide = self._window(x, y, reach + EDGE_M / (block * self._map.cell_m))
        mean = self._mean[wide]
        if mean.size == 0:
            return
        size = mean.shape[1] * block, mean.shape[0] * block
        fine = cv2.resize(mean, size, interpolation=cv2.INTER_LINEAR)
        here = tuple(
            slice(one.start * block, min(one.stop * block, count))
            for one, count in zip(wide, self._map.cells.shape, strict=True)
        )
        solid = fine[: here[0].stop - here[0].start, : here[1].stop - here[1].start] < 0.0
        clearance = _clearance(solid, self._map.cell_m)
        far = np.maximum(self._map.clearance_m[here], EDGE_M)
        self.grid.clearance_m[here] = np.where(clearance < EDGE_M, clearance, far)
        known = np.where(self._map.cells[here] == OCCUPIED, FREE, self._map.cells[here])
        self.grid.cells[here] = np.where(solid, OCCUPIED, known)


def _solid(grid: GridMap) -> Floats:
    """Return a grid's clearance, negative on walls without thickness too."""
    solid = (grid.clearance_m < 0.0).astype(np.uint8)
    near_solid = cv2.dilate(solid, np.ones((5, 5), np.uint8)) > 0
    thin = ((grid.cells == OCCUPIED) & ~near_solid).astype(np.uint8)
    thick = cv2.dilate(thin, np.ones((3, 3), np.uint8)) > 0  # no gap where only some cells count
    return np.where(thick, -grid.cell_m, grid.clearance_m)


def _clearance(solid: Bools, cell_m: float) -> Floats:
    """Return the distance to the nearest solid cell; inside one, minus the way out [m]."""
    free = (~solid).astype(np.uint8)
    if free.all():
        return np.full(solid.shape, cell_m * math.hypot(*solid.shape))
    away = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    inside = cv2.distanceTransform(1 - free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(np.where(solid, 0.5 - inside, away - 0.5) * cell_m, dtype=np.float64)


@array_kernel
def _look(seen: Floats, x: float, y: float, cell_m: float, ranges: Floats, cut: float) -> None:
    """Write every cell's distance that a sweep shows; x and y of the scanner in cells.

    Where a direction has no echo, the nearest one beside it counts, if that is not farther than the
    directions of a scanner of 360 beams are from each other.
    """
    rows, columns = seen.shape
    count = len(ranges)
    for i in range(rows):
        for j in range(columns):
            dx, dy = (j + 0.5 - x) * cell_m, (i + 0.5 - y) * cell_m
            far = math.hypot(dx, dy)
            if far > REACH_M:
                continue
            k = round(math.atan2(dy, dx) / TAU * count)
            met = ranges[k % count]
            if math.isnan(met):
                before, after = ranges[(k - 1) % count], ranges[(k + 1) % count]
                met = after if math.isnan(before) or after < before else before
            if met - far >= -cut:
                seen[i, j] = min(met - far, cut)
