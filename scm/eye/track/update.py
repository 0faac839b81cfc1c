"""Processes a frame of one camera's sightings.

    seen = pose + offset of this camera + noise

A sighting that does not fit is stored as an outlier. When three outliers agree and no fitting
sighting came between, the car was carried there and the track jumps. When fitting ones do come
between, two places have the same id.

Two cameras never agree exactly on where a car is. To avoid a jump of the car when one appears or
disappears, a camera that joins is first fitted to the track (`_joins`).
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_S
from scm.eye.track.fleet import ARRAYS, KINDS, Fleet, first_covariance
from scm.eye.track.motion import STATES
from scm.eye.track.sighting import ROOF_TAG_SIZE, Sighting

GATE = 30.0
"""Squared Mahalanobis distance of three values, exceeded by noise once in a million."""
MIN_AGREEING = 3  # outliers in a row at one place: the car was moved
MAX_OUTLIER_GAP_NS = NS_PER_S // 2  # between two of them
NEAR_M, FASTEST_MPS = 0.03, 4.5
APART_M = 0.1
"""Outliers nearer than this are another camera's estimate, not another car."""
FLAG_NS = 2 * NS_PER_S  # for which a flag stays
STILL_M = 0.001
"""A tag that moves less between frames has nearly the same corner errors again."""


def updated(fleet: Fleet, frame: Sequence[Sighting]) -> Fleet:
    """Return the tracks after one frame of one camera."""
    of_camera = tuple(flag for flag in frame[0].flags if flag != ROOF_TAG_SIZE)
    fleet = fleet.with_camera(frame[0].camera, of_camera)
    known = {name: row for row, name in enumerate(fleet.vehicles)}
    first = {one.vehicle: one for one in reversed(frame) if one.vehicle not in known}
    fleet = fleet.with_new(list(first.values()))
    fleet = replace(fleet, **{name: getattr(fleet, name).copy() for name in ARRAYS})
    rows = {name: row for row, name in enumerate(fleet.vehicles)}
    for name, sighting in first.items():
        _begin(fleet, rows[name], sighting)
    others: dict[str, list[Sighting]] = {}
    for one in frame:
        if first.get(one.vehicle) is not one:
            others.setdefault(one.vehicle, []).append(one)
    chosen = [_nearest(fleet, rows[name], ones) for name, ones in others.items()]
    if chosen:
        _measure(fleet, np.array([rows[one.vehicle] for one in chosen]), chosen)
    for one in frame:
        if one.tag_id != fleet.tag_ids[rows[one.vehicle]]:
            _flag(fleet, rows[one.vehicle], "wrong_id", one.t_ns)
        if ROOF_TAG_SIZE in one.flags:
            _flag(fleet, rows[one.vehicle], ROOF_TAG_SIZE, one.t_ns)
    return fleet


def _flag(fleet: Fleet, row: int, kind: str, t_ns: int) -> None:
    fleet.flagged_until_ns[row, KINDS.index(kind)] = t_ns + FLAG_NS


def _begin(fleet: Fleet, row: int, sighting: Sighting) -> None:
    """Start a track, or restart it elsewhere."""
    camera = fleet.cameras.index(sighting.camera)
    place = fleet.place(camera)
    white, shared, common_mode = sighting.components()
    fleet.mean[row] = 0.0
    fleet.mean[row, :3] = sighting.pose
    fleet.covariance[row] = 0.0
    fleet.covariance[row, :STATES, :STATES] = first_covariance(white + shared)
    fleet.covariance[row, place, place] = shared
    fleet.covariance[row, :3, place] = -shared
    fleet.covariance[row, place, :3] = -shared
    fleet.shared[row, camera] = shared
    fleet.seen_ns[row] = 0
    fleet.seen_ns[row, camera] = fleet.t_ns[row] = fleet.came_ns[row] = sighting.t_ns
    fleet.common_mode[row] = common_mode
    fleet.count[row], fleet.outlier[row] = 1, 0


def _nearest(fleet: Fleet, row: int, ones: list[Sighting]) -> Sighting:
    """Return the sighting nearest to the track; distant ones in one frame are two tags."""
    if len(ones) == 1:
        return ones[0]
    dt = (ones[0].t_ns - int(fleet.t_ns[row])) * 1e-9
    x, y, yaw, v = fleet.mean[row, :4]
    x, y = x + v * dt * math.cos(yaw), y + v * dt * math.sin(yaw)
    ones = sorted(ones, key=lambda one: math.dist((x, y), one.pose[:2]))
    if math.dist(ones[0].pose[:2], ones[-1].pose[:2]) > APART_M:
        _flag(fleet, row, "duplicate", ones[0].t_ns)
    return ones[0]


def _measure(fleet: Fleet, rows: Ints, frame: list[Sighting]) -> None:
    """Update these tracks with one sighting each."""
    camera = fleet.cameras.index(frame[0].camera)
    times = np.array([one.t_ns for one in frame])
    mean, covariance = fleet.predicted(rows, times)
    white, shared, common_mode = np.array([one.components() for one in frame]).swapaxes(0, 1)
    _grow_camera_covariance(fleet, rows, camera, covariance, shared)
    place = fleet.place(camera)
    seen = np.array([one.pose for one in frame])
    moved = np.hypot(*(mean[:, :2] - fleet.mean[rows, :2]).T) / STILL_M
    still = 1.0 + 1.0 / (1.0 + moved**2)
    noise = white * still[:, None, None]
    off = seen - mean[:, :3] - mean[:, place]
    off[:, 2] = np.remainder(off[:, 2] + math.pi, 2.0 * math.pi) - math.pi
    spread = covariance[:, :, :3] + covariance[:, :, place]
    innovation_covariance = spread[:, :3] + spread[:, place] + noise
    weighed = np.linalg.solve(
        innovation_covariance, np.concatenate((off[..., None], spread.swapaxes(1, 2)), -1)
    )
    fits = (off * weighed[..., 0]).sum(1) < GATE
    gain = weighed[..., 1:].swapaxes(1, 2)
    joins = _joins(fleet, rows, camera, times)
    gain[joins] = 0.0
    gain[joins, place] = np.eye(3)
    mean = mean + (gain @ off[..., None])[..., 0]
    change = gain @ spread.swapaxes(1, 2)
    covariance = (
        covariance
        - change
        - change.swapaxes(1, 2)
        + gain @ innovation_covariance @ gain.swapaxes(1, 2)
    )
    good = rows[fits]
    fleet.mean[good] = mean[fits]
    fleet.covariance[good] = ((covariance + covariance.swapaxes(1, 2)) / 2.0)[fits]
    fleet.shared[good, camera] = shared[fits]
    fleet.t_ns[good] = times[fits]
    fleet.seen_ns[good, camera] = times[fits]
    fleet.count[good] += 1
    fleet.outlier[good, 2] = 1
    fleet.common_mode[good] = common_mode[fits]
    _put_aside(fleet, rows, frame, fits)


def _joins(fleet: Fleet, rows: Ints, camera: int, times: Ints) -> Bools:
    """Return for which tracks this camera joins others that see the car already.

    Its first sighting then sets its own offset and leaves the car where it is: the average of two
    cameras would be slightly better, but a jump. It counts fully once the car has moved on.
    """
    ago = times[:, None] - fleet.seen_ns[rows]
    sees = (fleet.seen_ns[rows] > 0) & (ago < MAX_OUTLIER_GAP_NS)
    mine = sees[:, camera].copy()
    sees[:, camera] = False
    return np.asarray(sees.any(axis=1) & ~mine, dtype=np.bool_)


def _grow_camera_covariance(
    fleet: Fleet, rows: Ints, camera: int, covariance: Floats, shared: Floats
) -> None:
    """Set the covariance of a camera's offsets: the first time, and when the camera's grew."""
    place = fleet.place(camera)
    before = fleet.shared[rows, camera] * (fleet.seen_ns[rows, camera] > 0)[:, None, None]
    more = np.diagonal(shared - before, axis1=1, axis2=2)
    grew = (more > 0.2 * np.diagonal(before, axis1=1, axis2=2)).any(axis=1)
    if grew.any():
        values, vectors = np.linalg.eigh((shared - before)[grew])
        gained = (vectors * np.maximum(values, 0.0)[:, None]) @ vectors.swapaxes(1, 2)
        covariance[grew, place, place] += gained


def _put_aside(fleet: Fleet, rows: Ints, frame: list[Sighting], fits: Bools) -> None:
    """Store the sightings that do not fit; if enough agree, restart or flag the track."""
    for index in np.flatnonzero(~fits):
        row, one = int(rows[index]), frame[index]
        last_ns, count, _ = (int(value) for value in fleet.outlier[row])
        span = one.t_ns - last_ns
        reach = NEAR_M + FASTEST_MPS * abs(span) * 1e-9
        near = math.dist(one.pose[:2], fleet.outlier_pose[row, :2]) < reach
        if count and span < MAX_OUTLIER_GAP_NS and near:
            fleet.outlier[row, :2] = one.t_ns, count + 1
        else:
            fleet.outlier[row] = one.t_ns, 1, 0
        fleet.outlier_pose[row] = one.pose
        if fleet.outlier[row, 1] < MIN_AGREEING:
            continue
        if fleet.outlier[row, 2]:
            away = math.dist(one.pose[:2], fleet.mean[row, :2])
            _flag(fleet, row, "duplicate" if away > APART_M else "disagree", one.t_ns)
        else:
            _begin(fleet, row, one)
            _flag(fleet, row, "jumped", one.t_ns)
