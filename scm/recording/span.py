"""Cuts a recording to the span between two times."""

import math
from dataclasses import replace

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError
from scm.recording.read import Channel, Recording

FEWEST_BEGUN = 3  # rows that stand alone before a long pause, and are no begin: stray stamps
LONG_PAUSE_S = 60.0


def part_of(recording: Recording, from_s: float | None, to_s: float | None) -> Recording:
    """Return what lies between two moments, seconds since the recording's begin; None: its end.

    It begins with its first row, or as a run of a city does; a few rows long before all others are
    stray stamps, and no begin. Times stay as they were recorded.

    Raises:
        RecordingError: when nothing lies there; with what there is.
    """
    if from_s is None and to_s is None:
        return recording
    times = [np.sort(channel.t) for channel in recording.channels.values() if len(channel.t)]
    starts = min((_begin_s(t) for t in times), default=0.0)
    begin_s = starts if recording.begin_s is None else recording.begin_s
    first = begin_s + (0.0 if from_s is None else from_s)
    last = math.inf if to_s is None else begin_s + to_s
    channels = {
        name: cut
        for name, channel in recording.channels.items()
        if len((cut := _between(channel, first, last)).t)
    }
    if not channels:
        ends = max((-_begin_s(-t[::-1]) for t in times), default=0.0)
        span = f"from {from_s or 0.0:g} s" + ("" if to_s is None else f" to {to_s:g} s")
        of = f" of {recording.name}" if recording.begin_s is not None else ""
        msg = f"{recording.path}: {span}: nothing{of} was recorded there that can be driven again; "
        msg += f"there is from {starts - begin_s:.1f} s to {ends - begin_s:.1f} s"
        raise RecordingError(msg)
    scans = recording.scans and recording.scans.between(first, last)
    return replace(recording, channels=channels, scans=scans)


def _begin_s(t: Floats) -> float:
    """Return the first of some rising stamps that is not one of a few long before the others."""
    pauses = np.flatnonzero(np.diff(t[: FEWEST_BEGUN + 1]) > LONG_PAUSE_S)
    few = len(pauses) and len(t) > 2 * FEWEST_BEGUN
    return float(t[pauses[-1] + 1] if few else t[0])


def _between(channel: Channel, first: float, last: float) -> Channel:
    return channel.at((channel.t >= first) & (channel.t <= last))
