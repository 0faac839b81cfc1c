"""The last minutes of a car's driving, as one recording from which spans are cut and written."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from scm.errors import RecordingError
from scm.recorder.driven import CarMessages
from scm.recording.description import FILE_NAME
from scm.recording.read import Channel, Recording
from scm.recording.units import UNITS

MEMORY_S = 900.0
BY_EYE = "eye"
UNIT = {dimension: unit for unit, (dimension, factor) in UNITS.items() if factor == 1.0}


@dataclass(frozen=True, slots=True)
class _Piece:
    """What was driven from `first_s` until before `last_s`; what comes after may follow."""

    first_s: float
    last_s: float
    recording: Recording
    cameras: Sequence[tuple[float, str]]


class CarMemory:
    """What was driven lately; what is older than `MEMORY_S` is forgotten.

    Attributes:
        last_s: Until when it has all of it.
    """

    def __init__(self) -> None:
        self._pieces = deque[_Piece]()
        self.last_s = -math.inf

    def add(
        self, recording: Recording, first_s: float, last_s: float,
        cameras: Sequence[tuple[float, str]] = (),
    ) -> None:  # fmt: skip
        """Add what was recorded from `first_s` on, on the recording's clock.

        Args:
            recording: May go on after `last_s`: that counts until the next is added.
            first_s: What was recorded before does not count.
            last_s: Until when all is there.
            cameras: By which the car was seen, each with its first moment; empty: by none.
        """
        self._pieces.append(_Piece(first_s, last_s, _from(recording, first_s, math.inf), cameras))
        self.last_s = last_s
        while self._pieces[0].last_s < last_s - MEMORY_S:
            self._pieces.popleft()

    def begin_after(self, first_s: float) -> float:
        """Return where driving goes on after a moment; the end of all if nothing follows."""
        later = (max(one.first_s, first_s) for one in self._pieces if one.last_s > first_s)
        return next(later, self.last_s)

    def camera_at(self, t_s: float) -> str:
        """Return which camera saw the car at a time, or last before it; empty: none."""
        piece = next((one for one in reversed(self._pieces) if one.first_s <= t_s), None)
        cameras = () if piece is None else piece.cameras
        return next((camera for first_s, camera in reversed(cameras) if first_s <= t_s), "")

    def between(self, first_s: float, last_s: float) -> Recording:
        """Return what was driven in a span.

        Raises:
            RecordingError: when nothing was.
        """
        pieces = [one for one in self._pieces if one.last_s > first_s and one.first_s < last_s]
        if not pieces:
            msg = f"nothing was driven from {first_s:.0f} to {last_s:.0f} s"
            raise RecordingError(msg)
        ends = [*(one.first_s for one in pieces[1:]), last_s]
        cut = [_from(one.recording, first_s, end) for one, end in zip(pieces, ends, strict=True)]
        names = dict.fromkeys(name for one in cut for name in one.channels)
        channels = {
            name: _joined([one.channels[name] for one in cut if name in one.channels])
            for name in names
        }
        return replace(pieces[-1].recording, channels=channels, begin_s=None, left_out=())


def _from(recording: Recording, first_s: float, before_s: float) -> Recording:
    channels = {
        name: channel.at((channel.t >= first_s) & (channel.t < before_s))
        for name, channel in recording.channels.items()
    }
    channels = {name: channel for name, channel in channels.items() if len(channel.t)}
    return replace(recording, channels=channels)


def _joined(channels: list[Channel]) -> Channel:
    t = np.concatenate([one.t for one in channels])
    values = np.concatenate([one.values for one in channels])
    return replace(channels[-1], t=t, values=values, source=None)


def write(recording: Recording, folder: Path) -> Path:
    """Write a recording as a folder that `scm mismatch` reads; return its description.

    Raises:
        RecordingError: when it cannot be written.
    """
    by_times = dict[bytes, list[str]]()
    for name, channel in recording.channels.items():
        by_times.setdefault(channel.t.tobytes(), []).append(name)
    tables = list[dict[str, Any]]()
    for names in by_times.values():
        described = {name: _described(name, recording.channels[name]) for name in names}
        file = f"{names[0].partition('.')[0]}_{len(tables)}.npz"
        tables.append({"file": file, "time": {"column": "t", "unit": "s"}, "channels": described})
    of_car = {"recording": 1, "vehicle": recording.vehicle, "frame": "world"}
    path = folder / FILE_NAME
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for table, names in zip(tables, by_times.values(), strict=True):
            t = recording.channels[names[0]].t
            columns: dict[str, Any] = {name: recording.channels[name].values for name in names}
            np.savez_compressed(folder / table["file"], t=t, **columns)
        path.write_bytes(msgspec.yaml.encode({**of_car, "tables": tables}))
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be written: {error}") from error
    return path


def _described(name: str, channel: Channel) -> dict[str, Any]:
    found: dict[str, Any] = {"column": name, "unit": UNIT[channel.dimension]}
    found |= {} if channel.std is None else {"std": channel.std}
    return found | ({} if channel.point == (0.0, 0.0) else {"point": list(channel.point)})


def seen_by_eye(messages: CarMessages) -> CarMessages:
    """Return a car's messages as those of one of which only the Eye knows where it is."""
    reports = [report._replace(source=BY_EYE) for report in messages.reports]
    return replace(messages, reports=reports)
