"""Undo the gross faults that were found, and no others."""

from collections.abc import Iterable
from dataclasses import replace
from functools import reduce

import numpy as np

from scm.arrays import Floats
from scm.data_quality.suspicion import Quality, Repair
from scm.data_quality.track import POSE, Series, Track, grid, inside, long_gaps, track
from scm.recording.read import Channel, Recording

WIDTH_S = 0.1
STEP_S = 0.02
SHARED = 0.6  # of the stamps, where x, y and yaw are columns of one table with empty cells


def corrected(recording: Recording, quality: Quality) -> Recording:
    """Return the recording in right units and signs, its clocks together.

    Small offsets, scales and biases stay: they are for a fit to find.
    """
    return _whole_poses(repaired(recording, quality.repairs))


def _whole_poses(recording: Recording) -> Recording:
    """Return a recording whose poses are whole: without the rows that lack x, y or yaw.

    Where each comes at a rate of its own they stay as they are.
    """
    poses = {name: recording.channels[name] for name in POSE if name in recording.channels}
    if len(poses) < len(POSE):
        return recording
    common = reduce(np.intersect1d, (channel.t for channel in poses.values()))
    rows = [len(channel.t) for channel in poses.values()]
    if min(rows) == max(rows) == len(common) or len(common) < SHARED * max(rows):
        return recording
    cut = dict[str, Channel]()
    for name, channel in poses.items():
        keep = np.isin(channel.t, common)
        cut[name] = replace(channel, t=channel.t[keep], values=channel.values[keep])
    return replace(recording, channels={**recording.channels, **cut})


def repaired(recording: Recording, repairs: Iterable[Repair]) -> Recording:
    """Return the recording with repairs applied one after the other."""
    channels = dict(recording.channels)
    for repair in repairs:
        signs = (
            forward_speed(track(replace(recording, channels=channels))) if repair.signed else None
        )
        for name in repair.channels:
            if name in channels:
                channels[name] = _repaired(channels[name], repair, signs)
    return replace(recording, channels=channels)


def forward_speed(poses: Track | None) -> Series | None:
    """Return how fast the pose moves along its heading, backwards negative [m/s]."""
    if poses is None or len(poses.t) < 8:
        return None
    width = max(WIDTH_S, 1.5 * poses.period_s)
    step_s = max(STEP_S, 0.25 * poses.period_s)
    on = grid(poses.t[0], poses.t[-1], step_s, width, long_gaps(poses.t))
    if len(on.t) < 8:
        return None
    vx, vy = (on.smooth(Series(poses.t, values), 1) for values in (poses.x, poses.y))
    yaw = on.smooth(Series(poses.t, poses.yaw))
    return Series(on.t, np.cos(yaw) * vx + np.sin(yaw) * vy)


def _repaired(channel: Channel, repair: Repair, signs: Series | None) -> Channel:
    values: Floats = repair.factor * channel.values + repair.offset
    t = channel.t + repair.shift_s
    if signs is not None:
        values = np.abs(values) * np.where(signs.at(t) < 0.0, -1.0, 1.0)
    # Nobody knows in which unit a std beside a wrong unit was meant: the values tell it instead.
    std = channel.std if abs(repair.factor) == 1.0 else None
    changed = replace(channel, t=t, values=values, std=std)
    return changed.at(~inside(t, repair.out_s)) if repair.out_s else changed
