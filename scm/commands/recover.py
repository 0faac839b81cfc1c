"""`scm recover`: repair a recording whose writer was killed."""

import argparse
from pathlib import Path

from scm.command import Command
from scm.errors import RecordingError

MAGIC = b"\x89MCAP0\r\n"


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("recording", type=Path, metavar="FILE", help="the .mcap that was cut off")
    parser.add_argument("--out", type=Path, metavar="FILE", help="default: <name>.recovered.mcap")


def _run(arguments: argparse.Namespace) -> int:
    from scm.recorder.recover import recover

    if arguments.recording.is_dir():
        msg = f"{arguments.recording}: got a folder, expected the .mcap that was cut off"
        raise RecordingError(msg)
    _check(arguments.recording, arguments.out)
    result = recover(arguments.recording, arguments.out)
    state = "was whole" if result.whole else "was cut off"
    if result.grew:
        state = "is still being written; up to the start of this command"
    print(f"{arguments.recording} {state}: {result.messages} messages over {result.span_s:.1f} s")
    print(f"written to {result.path}")
    return 0


def _check(broken: Path, repaired: Path | None) -> None:
    """Refuse a file that is not a recording, and an output that exists.

    Raises:
        RecordingError: with the reason.
    """
    if broken.is_file():
        with broken.open("rb") as stream:
            begin = stream.read(len(MAGIC))
        if begin and not MAGIC.startswith(begin):
            msg = f"{broken}: got a file that does not begin as an .mcap, expected one cut off"
            raise RecordingError(msg)
    if repaired is not None and repaired.exists() and repaired.resolve() != broken.resolve():
        msg = f"--out: {repaired} already exists, expected a new name"
        raise RecordingError(msg)


COMMAND = Command(
    help="Repair a recording whose writer was killed.",
    example="scm recover runs/today.mcap",
    arguments=_arguments,
    run=_run,
)
