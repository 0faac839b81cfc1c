"""Exports the radio messages of a run in the formats of other V2X tools."""

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from scm.errors import MessageError, RecordingError
from scm.recorder.mcap_file import MESSAGES, read_keys, read_run
from scm.registry import load
from scm.v2x.etsi.json_form import KINDS, Body, wrap
from scm.v2x.message import Message, decode
from scm.v2x.pcap import Positions, frame_of, write_capture
from scm.v2x.uper.codec import CODINGS, encode

_KEY = re.compile(r"scm/@v\d+/[^/]+/v2x/tx/([^/]+)/([^/]+)")


class RadioMessage(NamedTuple):
    """One radio message.

    Attributes:
        kind: Its message_type.
        station: Its sender.
        t_ns: Time sent, on the sender's clock.
        received_ns: Time recorded.
    """

    kind: str
    station: str
    t_ns: int
    received_ns: int
    body: Body


class OnAir:
    """The radio messages of one run.

    Attributes:
        counts: Number of each kind, complete after an iteration.
        unreadable: Number of messages in the format of older versions.
    """

    def __init__(self, path: Path) -> None:
        """Open a run.

        Raises:
            RecordingError: when the file is not a complete run or has no radio messages.
        """
        self._path = path
        self._keys = [
            key for key in read_keys(path) if (m := _KEY.fullmatch(key)) and m[2] in KINDS
        ]
        if not self._keys:
            msg = f"{path}: expected messages under v2x/tx/, got none: nobody spoke over the radio"
            raise RecordingError(msg)
        self.counts: Counter[str] = Counter()
        self.unreadable = 0

    def __iter__(self) -> Iterator[RadioMessage]:
        """Yield them in the order recorded; the counts start again."""
        self.counts, self.unreadable = Counter(), 0
        classes: dict[str, type[Message]] = {
            kind: load(MESSAGES, kind, "MESSAGES", tuple)[0] for kind in KINDS
        }
        for one in read_run(self._path, self._keys):
            match = _KEY.fullmatch(one.key)
            assert match is not None  # noqa: S101  only such keys were asked for
            station, kind = match[1], match[2]
            try:
                message = decode(classes[kind], one.body)
            except MessageError:
                self.unreadable += 1
                continue
            self.counts[kind] += 1
            yield RadioMessage(kind, station, message.t_ns, one.t_ns, message.body)  # type: ignore[attr-defined]


def write_pcap(messages: OnAir, stream: BinaryIO) -> int:
    """Write a run's messages as a capture of ITS-G5 frames; return their number.

    CPMs are left out: they are not encoded in UPER here.

    Raises:
        MessageError: when the extra for UPER is not installed.
    """
    positions = Positions()
    return write_capture(
        stream,
        (
            (
                one.received_ns,
                frame_of(one.kind, encode(one.body), positions.of(one.body), one.t_ns),
            )
            for one in messages
            if one.kind in CODINGS
        ),
    )


def write_json(messages: OnAir, stream: BinaryIO) -> int:
    """Write a run's messages in its-client's envelopes, one per line; return their number."""
    lines = 0
    for one in messages:
        stream.write(wrap(one.body, one.station, one.t_ns) + b"\n")
        lines += 1
    return lines
