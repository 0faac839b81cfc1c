"""Groups of bodies that touch one another: each is solved by itself, whoever else is on the map.

Two bodies belong together while they overlap, and for `STEPS_IN_SPACE` steps after; walls join
nobody. What a step does to a group is a function of the motion of its bodies and of the groups that
these came from, bit for bit. So it comes out the same with any other cars around, in any order of
rows, and in a process that holds these cars alone.

    touches nobody           in one space with all others of that kind: walls are all they meet
    two or more              in a space of their own
    bodies join or part      a space stays with the group that has most of its bodies
"""

from collections import Counter
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.records.city_map import Box, CityMap
from scm.vehicles.jit import array_kernel
from scm.world.boxes import is_still, mass_of
from scm.world.broad_phase import TOUCH_M, Obstacles, walls_near
from scm.world.contact_space import Buffers, ContactSpace, Parts
from scm.world.solids import Hull, solids

ALLOWED_OVERLAP_M = 2e-4  # stays, so that a contact does not flicker
SHARE_CORRECTED = 0.2  # of a deeper overlap, in one step
ITERATIONS = 30
MAX_ITERATIONS = 300  # where bodies were stopped: a light one between heavy ones takes many
STEPS_IN_SPACE = 40  # a body stays after its last contact: entering costs ten microseconds
ROOM_M = 0.3  # a body of a group may move before it is looked which walls are near it
WALL = -1
KEY_BITS = 32


class Solution(NamedTuple):
    """What contacts do in one step.

    Attributes:
        dv: (n, 3) changes of velocity x, y and yaw rate.
        shift: (n, 2) ways out of overlaps [m].
        pairs: (k, 2) rows that touch, the lower first, in ascending order; -1: a wall.
        labels: (n,) the lowest row of each row's group.
    """

    dv: Floats
    shift: Floats
    pairs: Ints
    labels: Ints


class _Walk(NamedTuple):
    """In which order the batch calls walk through the bodies of all spaces.

    Attributes:
        spaces: Those with anybody inside.
        places: Key of each body, and -1 for the static one at each space's end.
        starts: Where in `places` each space begins, and the end.
        ids: Of the bodies, ascending.
        keys: Of the bodies, as `ids`.
    """

    spaces: list[ContactSpace]
    places: Ints
    starts: list[int]
    ids: Ints
    keys: Ints


class ContactGroups:
    """Who belongs to whom, and the spaces of all groups; cars and boxes have keys, boxes first."""

    def __init__(self, city_map: CityMap, boxes: tuple[Box, ...], obstacles: Obstacles) -> None:
        self._parts = Parts(boxes, tuple(solids(city_map)))
        self._obstacles = obstacles
        self._loners = ContactSpace(self._parts, range(len(self._parts.solids)))
        self._groups: list[ContactSpace] = []
        self._homes: dict[int, ContactSpace] = {}
        self._buffers = Buffers()
        self._now = 0
        self._until: Ints = np.zeros(len(boxes), np.int64)
        self._walls_from: Floats = np.zeros((len(boxes), 2))
        self._lightness: Floats = np.array([1.0 / mass_of(box) for box in boxes], dtype=float)
        self._links: Ints = np.empty(0, np.int64)
        self._links_until: Ints = np.empty(0, np.int64)
        self._members = self._leads = self._grouped = np.empty(0, np.int64)
        self._walk: _Walk | None = None

    def add(self, key: int, hull: Hull) -> None:
        """Let a car take part."""
        if key >= len(self._until):
            more = max(64, 2 * key) - len(self._until)
            self._until = np.concatenate((self._until, np.zeros(more, np.int64)))
            self._walls_from = np.concatenate((self._walls_from, np.zeros((more, 2))))
            self._lightness = np.concatenate((self._lightness, np.zeros(more)))
        self._parts.hulls[key] = hull
        self._lightness[key] = 1.0 / hull.mass

    def remove(self, key: int) -> None:
        """Remove a car permanently."""
        del self._parts.hulls[key]
        self._until[key] = 0
        others = ((self._links >> KEY_BITS) != key) & ((self._links & (1 << KEY_BITS) - 1) != key)
        self._links, self._links_until = self._links[others], self._links_until[others]
        self._leave([key])

    def forget(self) -> None:
        """Take all bodies out of their spaces, with all that these remember of contacts."""
        if self.is_idle:
            return
        self._leave(list(self._homes))
        self._groups = []
        self._until[:] = 0
        self._links = self._links_until = np.empty(0, np.int64)
        self._members = self._leads = self._grouped = np.empty(0, np.int64)

    @property
    def is_idle(self) -> bool:
        """Whether nobody has touched anything lately."""
        return not self._homes

    def solve(
        self, keys: Ints, motion: Floats, reach: Floats, marks: Bools, overlaps: Ints,
        stopped: Bools,
    ) -> Solution:  # fmt: skip
        """Solve the contacts of this instant; to be called at every step that is not idle.

        Args:
            keys: (n,) who is in which row, in an order that stays.
            motion: (n, 6).
            reach: (n,) radius of a circle about each body [m].
            marks: (n,) those that touch something.
            overlaps: (k, 2) rows that touch each other, the lower first.
            stopped: (n,) those that could not make all of their last move.
        """
        self._now += 1
        row_of = np.full(len(self._until), -1)
        row_of[keys] = np.arange(len(keys))
        self._until[keys[marks]] = self._now + STEPS_IN_SPACE
        labels = self._label(keys[overlaps], row_of, len(keys))
        # They come in anew: pymunk begins with the impulses of its last step, and those that were
        # stopped need not touch all that they touched then.
        self._leave(keys[stopped].tolist())
        rows = np.flatnonzero(self._until[keys] > self._now)
        members, leads = keys[rows], keys[labels[rows]]
        is_same = np.array_equal(members, self._members) and np.array_equal(leads, self._leads)
        if self._walk is None or not is_same:
            self._regroup(keys, motion, rows, labels)
            self._members, self._leads = members, leads
            self._walk = _walk_of([self._loners, *self._groups])
        self._find_walls(motion, reach, row_of)
        dv = self._step(self._walk, motion, row_of, stopped)
        pairs, normals, depths = self._contacts(self._walk, row_of)
        lightness = np.append(self._lightness[keys], 0.0)  # a wall is row -1: the last one
        if self._parts.boxes:
            # A box that the floor holds is no way out: shifts would creep it along under any push.
            boxes = np.flatnonzero(keys < len(self._parts.boxes))
            lightness[boxes[is_still(motion[boxes, 3:] + dv[boxes])]] = 0.0
        return Solution(dv, _shifts(pairs, normals, depths, lightness), pairs, labels)

    def _label(self, overlaps: Ints, row_of: Ints, n: int) -> Ints:
        """Return the lowest row (n,) of each row's group, of those whose keys overlap (k, 2)."""
        until = self._now + STEPS_IN_SPACE
        links = np.sort(overlaps[:, 0] << KEY_BITS | overlaps[:, 1])
        if np.array_equal(links, self._links):
            self._links_until[:] = until
        else:
            both = np.concatenate((links, self._links))
            ends = np.concatenate((np.full(len(links), until), self._links_until))
            self._links, first = np.unique(both, return_index=True)
            self._links_until = ends[first]
            lasts = self._links_until > self._now
            self._links, self._links_until = self._links[lasts], self._links_until[lasts]
        labels = np.arange(n)
        one, other = self._links >> KEY_BITS, self._links & (1 << KEY_BITS) - 1
        join(labels, row_of[one], row_of[other])
        return labels

    def _regroup(self, keys: Ints, motion: Floats, rows: Ints, labels: Ints) -> None:
        """Bring all bodies (rows) into the spaces in which they belong now."""
        is_alone = np.bincount(labels[rows], minlength=1)[labels[rows]] == 1
        loners = keys[rows[is_alone]].tolist()
        together = rows[~is_alone]
        self._grouped = keys[together]
        together = together[np.argsort(labels[together], kind="stable")]
        ends = np.flatnonzero(np.diff(labels[together])) + 1
        groups = [part.tolist() for part in np.split(keys[together], ends) if len(part)]
        self._groups = self._heirs(groups)
        spaces = [self._loners, *self._groups]
        homes = {
            key: space
            for space, inside in zip(spaces, (loners, *groups), strict=True)
            for key in inside
        }
        for space in spaces:
            for key in [key for key in space.bodies if homes.get(key) is not space]:
                space.leave(key)
        poses = dict(zip(keys[rows].tolist(), motion[rows, :3].tolist(), strict=True))
        for key, space in homes.items():
            if key not in space.bodies:
                space.enter(key, *poses[key])
                self._walls_from[key] = np.inf
        self._homes = homes

    def _heirs(self, groups: list[list[int]]) -> list[ContactSpace]:
        """Return a space for each group: that with most of its bodies, or a new one."""
        firsts = {space: min(space.bodies) for space in self._groups if space.bodies}
        shared = Counter(
            (self._homes[key], i)
            for i, keys in enumerate(groups)
            for key in keys
            if self._homes.get(key, self._loners) is not self._loners
        )
        heirs: dict[int, ContactSpace] = {}
        left = set(firsts)
        for space, i in sorted(shared, key=lambda at: (-shared[at], firsts[at[0]], at[1])):
            if space in left and i not in heirs:
                heirs[i] = space
                left.remove(space)
        return [heirs.get(i) or ContactSpace(self._parts) for i in range(len(groups))]

    def _leave(self, keys: list[int]) -> None:
        """Take bodies out of their spaces; those that still belong somewhere come in anew."""
        for key in keys:
            if key in self._homes:
                self._homes.pop(key).leave(key)
                self._walk = None

    def _find_walls(self, motion: Floats, reach: Floats, row_of: Ints) -> None:
        """Add the walls that are near bodies of groups, where these have gone on."""
        members, rows = self._grouped, row_of[self._grouped]
        way = motion[rows, :2] - self._walls_from[members]
        gone = ~(np.hypot(way[:, 0], way[:, 1]) < ROOM_M)
        rows, members = rows[gone], members[gone]
        if not len(rows):
            return
        self._walls_from[members] = motion[rows, :2]
        near = walls_near(motion[rows], reach[rows] + ROOM_M + TOUCH_M, self._obstacles)
        for i, wall in near.tolist():
            self._homes[int(members[i])].add_walls((wall,))

    def _step(self, walk: _Walk, motion: Floats, row_of: Ints, stopped: Bools) -> Floats:
        """Solve all spaces; return changes of velocity (n, 3)."""
        rows = np.where(walk.places >= 0, row_of[walk.places], -1)
        inside = rows >= 0
        block = np.zeros((len(rows), 6))
        block[inside] = motion[rows[inside]]
        was_stopped = inside & np.append(stopped, False)[rows]
        self._buffers.clear()
        for space, (begin, end) in zip(walk.spaces, pairwise(walk.starts), strict=True):
            many = space is not self._loners and was_stopped[begin:end].any()
            space.solve(block[begin:end], MAX_ITERATIONS if many else ITERATIONS, self._buffers)
        dv = np.zeros((len(motion), 3))
        dv[rows[inside]] = (self._buffers.motion[:, 3:] - block[:, 3:])[inside]
        return dv

    def _contacts(self, walk: _Walk, row_of: Ints) -> tuple[Ints, Floats, Floats]:
        """Return rows that touch (k, 2), normals (k, 2) and depths (k,), in an order that stays."""
        ids, normals, depths = self._buffers.contacts
        if not len(ids):
            return ids, normals, depths
        places = np.minimum(np.searchsorted(walk.ids, ids), len(walk.ids) - 1)
        is_body = walk.ids[places] == ids
        pairs = np.where(is_body, row_of[walk.keys[places]], WALL)
        turned = pairs[:, 0] > pairs[:, 1]
        pairs[turned] = pairs[turned][:, ::-1]
        normals = np.where(turned[:, None], -normals, normals)
        # A car may touch two walls at once: the pairs are equal, so normals and depths decide.
        order = np.lexsort((depths, normals[:, 1], normals[:, 0], pairs[:, 1], pairs[:, 0]))
        return pairs[order], normals[order], depths[order]


def _walk_of(spaces: list[ContactSpace]) -> _Walk:
    inside = [space for space in spaces if space.bodies]
    none = np.empty(0, np.int64)
    ids = np.concatenate([none, *(space.order[0] for space in inside)])
    keys = np.concatenate([none, *(space.order[1] for space in inside)])
    places = np.concatenate([none, *(np.append(space.order[1], -1) for space in inside)])
    starts = np.cumsum([0, *(len(space.bodies) + 1 for space in inside)]).tolist()
    sequence = np.argsort(ids)
    return _Walk(inside, places, starts, ids[sequence], keys[sequence])


@array_kernel
def join(labels: Ints, one: Ints, other: Ints) -> None:
    """Lower the labels (n,) of rows that are connected by links (k,) to the lowest row of theirs.

    Labels begin as each row's own.
    """
    for k in range(one.shape[0]):
        i, j = one[k], other[k]
        while labels[i] != i:
            labels[i] = labels[labels[i]]
            i = labels[i]
        while labels[j] != j:
            labels[j] = labels[labels[j]]
            j = labels[j]
        labels[max(i, j)] = min(i, j)
    for i in range(labels.shape[0]):
        labels[i] = labels[labels[i]]


def _shifts(pairs: Ints, normals: Floats, depths: Floats, lightness: Floats) -> Floats:
    """Return the way out of the overlaps (n, 2), shared by inverse mass."""
    way = np.zeros((len(lightness), 2))
    if len(pairs):
        a, b = pairs.T
        out = SHARE_CORRECTED * np.maximum(depths - ALLOWED_OVERLAP_M, 0.0)
        whole = lightness[a] + lightness[b]
        out /= np.where(whole > 0.0, whole, np.inf)
        np.add.at(way, a, -normals * (out * lightness[a])[:, None])
        np.add.at(way, b, normals * (out * lightness[b])[:, None])
    return way[:-1]
