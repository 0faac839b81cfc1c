"""Where a car is on a map: a particle filter whose number of particles follows what is known.

Each particle is a pose. It moves as odometry says, with noise; its weight grows with how well the
echoes, seen from it, lie on faces of the map (likelihood field):

    p(echo) = hit exp(-d^2 / (2 sigma^2)) + stray        d: from the echo to the nearest face

Something that the map has not pulls no particle: away from all faces an echo is as likely anywhere.
A pose that the Eye measured weighs particles likewise: one that is far from all of them pulls none.
Echoes count less than they would if they were independent. Particles are drawn anew where few carry
most of the weight, as many as keep the error of their distribution below a bound (KLD sampling).
A car whose echoes do not fit the map any more is looked for everywhere: poses all over the floor
are compared with the echoes, first with wide faces, then with ever narrower ones.

In a room that looks the same from two places, a scanner alone cannot tell which it is: the filter
keeps both and says so (`alternative`), until clearly fewer of the echoes fit one of them: by chance
all particles of a place may go as they are drawn anew. Before a place is believed, more of the
echoes must fit than later: a map of another room fits half of them somewhere.
Source: Fox, "KLD-sampling: adaptive particle filters", NIPS 2001; likelihood field: Thrun, Burgard,
Fox, "Probabilistic Robotics", 2005, 6.4. The order of widths and the rule for lost cars are ours.
"""

import math
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats
from scm.geometry import TAU, Pose2, wrap_angle
from scm.vehicles.jit import array_kernel
from vehicle_agent.autonomy.grid_map import FREE, GridMap, value_at

FEWEST, MOST = 300, 3000  # particles
BEAMS = 60
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)  # steps that spread evenly over [0, 1)
KNOWN = (0.05, 0.05, 0.1)  # standard deviation of a start that is roughly known [m, m, rad]
TRIED = 200  # poses round one that may fit
STRAY = 0.05  # of an echo beside all faces, against one on a face
MAP_M = 0.01  # how far a face may be from where the map has it
INDEPENDENT = 0.3  # of what beams say: they share the map's errors
STEP = (0.002, 0.002, 0.003)  # noise of one motion [m, m, rad]
OF_WAY, OF_TURN = 0.05, 0.05  # of a motion is noise
TURN_OF_WAY = 0.1  # [rad/m]
BIN = (0.05, 0.05, 0.1)  # that a particle occupies
KLD_ERROR, KLD_QUANTILE = 0.05, 2.33  # bound with 99 %
OFF = 3.0  # spreads from a face, beyond which an echo is not of it
LOST_SHARE, LOST_AFTER = 0.56, 4  # of echoes on faces; so many sweeps in a row
FOUND_SHARE = 0.75  # of echoes on faces, before a place that was looked for is believed
START_SHARE = 0.65  # the same, where the start was known: things about may hide that many faces
ALTERNATIVE_SHARE = 0.05  # of the weight: less is not another place
AS_WELL = 0.025  # of the echoes: places that differ by less in what fits there fit alike
WIDTHS_M = (0.2, 0.1, 0.05)  # of faces, as a pose is looked for
SEARCHED = 200  # poses on each square metre ...
MOST_SEARCHED = 100_000
TOGETHER_M, TOGETHER_RAD = 0.25, 0.4  # from the best particle: they mean the same place


@dataclass(frozen=True, slots=True, eq=False)
class PoseMeasurement:
    """A pose measured otherwise than by the scanner: rear axle, map frame.

    Attributes:
        covariance: Of x, y and yaw, (3, 3) [m, m, rad].
    """

    pose: Pose2
    covariance: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Localised:
    """Where the car is, after one sweep.

    Attributes:
        pose: Of the rear axle, map frame; the mean of the particles about the best.
        covariance: Of x, y and yaw, (3, 3) [m, m, rad].
        particles: (n, 3), all of them; `weights`: (n,), their sum is 1.
        explained: (m,) which of the echoes lie on faces of the map, seen from `pose`.
        is_lost: The map does not explain the echoes: the pose is a guess.
        expected_share: Of echoes on faces, before the place is believed.
        alternative: Another place where the car may be as well; None: there is none.
    """

    pose: Pose2
    covariance: Floats
    particles: Floats
    weights: Floats
    explained: Bools
    is_lost: bool
    expected_share: float
    alternative: Pose2 | None


class ParticleFilter:
    """The filter of one car.

    Args:
        grid: Map.
        noise_m: Standard deviation of a range.
        seed: Of all that is drawn.
    """

    def __init__(self, grid: GridMap, noise_m: float, seed: int = 0) -> None:
        self._grid = grid
        self.set_noise(noise_m)
        self._random = np.random.default_rng(seed)
        self._particles = np.empty((0, 3))
        self._log_weights = np.empty(0)
        self._unexplained = 0
        self._offset = 0.0
        self._is_believed, self._expected_share = False, FOUND_SHARE
        self._places: list[Pose2] = []
        self.is_global = True

    def set_noise(self, noise_m: float) -> None:
        """Set the standard deviation of a range."""
        self._sigma_m = math.hypot(noise_m, MAP_M, 0.3 * self._grid.cell_m)

    def begin(self, pose: Pose2) -> None:
        """Start at a pose that is known within `KNOWN`."""
        self._particles = np.array(pose) + self._random.standard_normal((MOST, 3)) * KNOWN
        self._log_weights, self.is_global = np.zeros(MOST), False
        self._is_believed, self._places = False, []
        self._expected_share = START_SHARE

    def begin_anywhere(self) -> None:
        """Look for the car on the whole floor at the next sweep."""
        self.is_global = True

    def update(
        self, moved: Pose2, echoes: Floats, seen: PoseMeasurement | None = None
    ) -> Localised:
        """Return where the car is.

        Args:
            moved: From the last sweep to this one, in the car's frame at the last.
            echoes: (m, 2) of this sweep, car frame [m].
            seen: The pose at this sweep, as somebody else measured it.
        """
        beams = self._chosen(echoes)
        if self.is_global and len(beams):
            self._search(beams)
        else:
            self._move(moved)
            self._places = [place @ moved for place in self._places]
        if len(beams):
            self._weigh(beams)
        if seen is not None:
            self._weigh_by(seen)
        weights = _normal(self._log_weights)
        found = self._localised(weights, echoes)
        self._unexplained = self._unexplained + 1 if found.is_lost else 0
        if self._unexplained >= LOST_AFTER:
            self.is_global, self._unexplained = True, 0
        if 1.0 / (weights @ weights) < 0.5 * len(weights):
            self._draw_anew(weights)
        return found

    def fits(self, pose: Pose2, echoes: Floats) -> float:
        """Return the share of echoes (m, 2) that lie on faces, from the best pose near this one."""
        off = np.vstack((np.zeros(3), self._random.standard_normal((TRIED, 3)) * KNOWN))
        tried = np.array(pose) + off
        grid, beams = self._grid, self._chosen(echoes)
        apart = _apart(tried, beams, grid.to_face_m, grid.cell_m, grid.x_m, grid.y_m)
        return float((apart < OFF * self._sigma_m).mean(axis=1).max()) if len(beams) else 0.0

    def _chosen(self, echoes: Floats) -> Floats:
        """Return at most `BEAMS` of the echoes, others each time, evenly along what they meet.

        The farther an echo, the longer the piece of wall that it stands for. Were they taken evenly
        by bearing, the wall beside the car would outvote all others, wherever it really stands.
        """
        if len(echoes) <= BEAMS:
            return echoes
        ranges = np.hypot(*echoes.T)
        self._offset = (self._offset + GOLDEN) % 1.0
        chosen: Floats = echoes[_systematic(ranges / ranges.sum(), BEAMS, self._offset)]
        return chosen

    def _move(self, moved: Pose2) -> None:
        way, turn = math.hypot(moved.x, moved.y), abs(moved.yaw)
        of_motion = OF_WAY * way, OF_WAY * way, OF_TURN * turn + TURN_OF_WAY * way
        std = np.add(STEP, of_motion)
        dx, dy, dyaw = np.array(moved)[:, None] + std[:, None] * self._random.standard_normal(
            (3, len(self._particles))
        )
        x, y, yaw = self._particles.T
        c, s = np.cos(yaw), np.sin(yaw)
        self._particles = np.column_stack((x + c * dx - s * dy, y + s * dx + c * dy, yaw + dyaw))

    def _weigh(self, beams: Floats) -> None:
        grid = self._grid
        apart = _apart(self._particles, beams, grid.to_face_m, grid.cell_m, grid.x_m, grid.y_m)
        likelihood = np.log(np.exp(-0.5 * (apart / self._sigma_m) ** 2) + STRAY)
        self._log_weights = self._log_weights + INDEPENDENT * likelihood.sum(axis=1)

    def _weigh_by(self, seen: PoseMeasurement) -> None:
        """Weigh particles by a measured pose; one that is far from all of them pulls none.

        Of several places that may be the car's, the one of that pose is left.
        """
        self._places = [one for one in self._places if is_near(one, seen.pose)] or self._places
        off = self._particles - np.array(seen.pose)
        off[:, 2] = np.remainder(off[:, 2] + math.pi, TAU) - math.pi
        squared = (off @ np.linalg.inv(seen.covariance) * off).sum(axis=1)
        self._log_weights = self._log_weights + np.log(np.exp(-0.5 * squared) + STRAY)

    def _search(self, beams: Floats) -> None:
        """Set particles to the poses, of the whole floor, that fit the echoes best."""
        grid = self._grid
        rows, columns = np.nonzero(grid.cells == FREE)
        area = len(rows) * grid.cell_m**2
        count = int(np.clip(SEARCHED * area * 36, 5 * MOST, MOST_SEARCHED))
        cell = self._random.integers(len(rows), size=count)
        off = self._random.random((count, 2))
        particles = np.column_stack((
            grid.x_m + (columns[cell] + off[:, 0]) * grid.cell_m,
            grid.y_m + (rows[cell] + off[:, 1]) * grid.cell_m,
            self._random.uniform(-math.pi, math.pi, count),
        ))  # fmt: skip
        for width in WIDTHS_M:
            apart = _apart(particles, beams, grid.to_face_m, grid.cell_m, grid.x_m, grid.y_m)
            scores = np.log(np.exp(-0.5 * (apart / width) ** 2) + STRAY).sum(axis=1)
            weights = _normal(INDEPENDENT * scores)
            drawn = _systematic(weights, MOST, self._random.random())
            spread = np.array((0.3 * width, 0.3 * width, 0.4 * width))
            particles = particles[drawn] + spread * self._random.standard_normal((MOST, 3))
        self._particles, self._log_weights, self.is_global = particles, np.zeros(MOST), False
        self._is_believed, self._places = False, _places(particles)
        self._expected_share = FOUND_SHARE

    def _draw_anew(self, weights: Floats) -> None:
        """Draw particles by their weights, as many as the places that they occupy need."""
        drawn = _systematic(weights, MOST, self._random.random())
        order = self._random.permutation(drawn)
        bins = np.floor(self._particles[order] / BIN).astype(np.int64)
        _, first = np.unique(bins, axis=0, return_index=True)
        count = _needed(np.sort(first))
        self._particles = self._particles[order[:count]]
        self._log_weights = np.zeros(count)

    def _localised(self, weights: Floats, echoes: Floats) -> Localised:
        particles = self._particles
        best = particles[np.argmax(weights)]
        near = _near(particles, best)
        pose, covariance = _mean(particles[near], weights[near], best)
        alternative: Pose2 | None = None
        if weights[~near].sum() > ALTERNATIVE_SHARE:
            others, theirs = particles[~near], weights[~near]
            other = others[np.argmax(theirs)]
            same = _near(others, other)
            alternative, _ = _mean(others[same], theirs[same], other)
        explained = self._explained(pose, echoes)
        share = float(explained.mean()) if len(echoes) else 0.0
        self._is_believed |= share >= self._expected_share
        if alternative is None and self._places and len(echoes):
            alternative = self._as_well(pose, share, echoes)
        is_lost = share < LOST_SHARE or not self._is_believed
        return Localised(
            pose, covariance, particles, weights, explained, is_lost, self._expected_share,
            alternative,
        )  # fmt: skip

    def _as_well(self, pose: Pose2, share: float, echoes: Floats) -> Pose2 | None:
        """Return a place of the last search that fits as well as a pose with a share of echoes."""
        others = [place for place in self._places if not _near(np.array([place]), np.array(pose))]
        least = share - AS_WELL
        fitting = [place for place in others if self._explained(place, echoes).mean() > least]
        self._places = [pose, *fitting] if fitting else []
        return fitting[0] if fitting else None

    def _explained(self, pose: Pose2, echoes: Floats) -> Bools:
        """Return which echoes lie on faces of the map, seen from a pose."""
        grid = self._grid
        apart = _apart(np.array([pose]), echoes, grid.to_face_m, grid.cell_m, grid.x_m, grid.y_m)
        explained: Bools = apart[0] < OFF * self._sigma_m
        return explained


def is_near(one: Pose2, other: Pose2) -> bool:
    """Return whether two poses mean the same place."""
    return bool(_near(np.array([one]), np.array(other))[0])


def _near(particles: Floats, pose: Floats) -> Bools:
    """Return which particles mean the same place as a pose."""
    turned = np.remainder(particles[:, 2] - pose[2] + math.pi, TAU) - math.pi
    near = np.hypot(*(particles[:, :2] - pose[:2]).T) < TOGETHER_M
    return np.asarray(near & (np.abs(turned) < TOGETHER_RAD))


def _places(particles: Floats) -> list[Pose2]:
    """Return the places that more than a few of the particles mean."""
    found, left = [], particles
    while len(left) > ALTERNATIVE_SHARE * len(particles):
        near = _near(left, left[0])
        if near.sum() > ALTERNATIVE_SHARE * len(particles):
            found.append(_mean(left[near], np.ones(near.sum()), left[0])[0])
        left = left[~near]
    return found


def _mean(particles: Floats, weights: Floats, about: Floats) -> tuple[Pose2, Floats]:
    """Return mean and covariance of particles that lie near a pose."""
    off = particles - about
    off[:, 2] = np.remainder(off[:, 2] + math.pi, TAU) - math.pi
    share = weights / weights.sum()
    mean = share @ off
    covariance = (off - mean).T @ ((off - mean) * share[:, None])
    x, y, yaw = map(float, about + mean)
    return Pose2(x, y, wrap_angle(yaw)), covariance


def _normal(log_weights: Floats) -> Floats:
    weights = np.exp(log_weights - log_weights.max())
    return np.asarray(weights / weights.sum())


def _systematic(weights: Floats, count: int, offset: float) -> Floats:
    """Return `count` indices, each as often as its weight says, by one random number."""
    places = (np.arange(count) + offset) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), places), len(weights) - 1)


def _needed(first: Floats) -> int:
    """Return how many particles are enough: `first` (k,) says when each bin was first occupied."""
    for k in range(2, len(first) + 1):
        a = 2.0 / (9.0 * (k - 1))
        enough = (k - 1) / (2.0 * KLD_ERROR) * (1.0 - a + math.sqrt(a) * KLD_QUANTILE) ** 3
        following = first[k] if k < len(first) else MOST
        if max(enough, FEWEST) <= following:
            return int(np.clip(enough, FEWEST, MOST))
    return FEWEST if len(first) < 2 else MOST


@array_kernel
def _apart(
    poses: Floats, echoes: Floats, field: Floats, cell_m: float, x_m: float, y_m: float
) -> Floats:
    """Return how far each echo (m, 2), seen from each pose (n, 3), is from a face, (n, m) [m].

    Off the field, as far as the nearest cell of its edge is, and the way to that.
    """
    apart = np.empty((len(poses), len(echoes)))
    rows, columns = field.shape
    for i in range(len(poses)):
        x, y, yaw = poses[i]
        c, s = math.cos(yaw), math.sin(yaw)
        for j in range(len(echoes)):
            ahead, left = echoes[j]
            column = (x + c * ahead - s * left - x_m) / cell_m
            row = (y + s * ahead + c * left - y_m) / cell_m
            on_row = min(max(row, 0.5), rows - 0.501)
            on_column = min(max(column, 0.5), columns - 0.501)
            away = cell_m * math.hypot(row - on_row, column - on_column)
            apart[i, j] = value_at(field, on_column, on_row) + away
    return apart
