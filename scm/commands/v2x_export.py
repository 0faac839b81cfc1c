"""`scm v2x export`: the radio messages of a run, for other tools."""

import argparse
from collections.abc import Container
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command
from scm.errors import ScmError

if TYPE_CHECKING:
    from scm.recorder.on_air import OnAir


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("recording", type=Path, metavar="RECORDING", help="the .mcap of a run")
    parser.add_argument(
        "--pcap",
        type=Path,
        metavar="FILE",
        help="ITS-G5 frames with their times, for Wireshark; needs the extra scm[v2x]",
    )
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="envelopes of Orange's its-client, one a line"
    )


def _run(arguments: argparse.Namespace) -> int:
    if arguments.pcap is None and arguments.json is None:
        msg = "expected --pcap FILE, --json FILE or both, got neither"
        raise ScmError(msg)
    from scm.recorder.on_air import OnAir, write_json, write_pcap

    sent = OnAir(arguments.recording)
    for path, write in ((arguments.pcap, write_pcap), (arguments.json, write_json)):
        if path is not None:
            if not path.parent.is_dir():
                raise ScmError(f"{path}: cannot be written: no folder {path.parent}")
            with path.open("wb") as stream:
                count = write(sent, stream)
            without = ("cpm",) if write is write_pcap else ()
            print(f"{path}: {count} messages ({_counted(sent, without)})")
    if arguments.pcap is not None and sent.counts["cpm"]:
        print(f"{arguments.pcap}: {sent.counts['cpm']} CPMs are not in it: they have no UPER here")
    if sent.unreadable:
        print(f"{arguments.recording}: {sent.unreadable} messages cannot be read: left out")
    return 0


def _counted(sent: "OnAir", without: Container[str]) -> str:
    counts = sorted(sent.counts.items())
    return ", ".join(f"{count} {kind.upper()}" for kind, count in counts if kind not in without)


COMMAND = Command(
    help="Radio messages of a run as a capture for Wireshark, or as JSON.",
    example="scm v2x export runs/today.mcap --pcap today.pcap",
    arguments=_arguments,
    run=_run,
)
