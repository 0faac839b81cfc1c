"""The process that reads an upload's description: `python -m scm.api.upload_reader`.

It imports nothing of the server, for it is started for each upload.
"""

import resource
import sys
from collections.abc import Sequence
from pathlib import Path

import msgspec
import yaml

from scm.errors import RecordingError
from scm.recording.description import FILE_NAME, Description, read_description

MOST_NESTED = 20  # each level costs the reader all that follow
MOST_READING_S, MOST_READING_BYTES = 10, 2**30  # of a description, processor time and memory


class Read(msgspec.Struct, kw_only=True, frozen=True):
    """What the description names, or why it is refused."""

    vehicles: tuple[str, ...] = ()
    refusal: str = ""


def main(argv: Sequence[str]) -> None:
    """Read the description in the folder `argv[1]` in at most `argv[0]` s; print a `Read`."""
    most_s, folder, cars = int(argv[0]), Path(argv[1]), tuple(argv[2:])
    resource.setrlimit(resource.RLIMIT_CPU, (most_s, most_s))
    resource.setrlimit(resource.RLIMIT_AS, (MOST_READING_BYTES, MOST_READING_BYTES))
    try:
        _check_nesting(folder / FILE_NAME)
        read = Read(vehicles=_vehicles(read_description(folder / FILE_NAME), folder, cars))
    except RecordingError as cause:
        read = Read(refusal=str(cause).replace(f"{folder}/", ""))
    sys.stdout.buffer.write(msgspec.json.encode(read))


def _check_nesting(description: Path) -> None:
    """Refuse a description that would take minutes to read: deep, or one that unfolds."""
    depth = 0
    try:
        with description.open("rb") as text:
            for event in yaml.parse(text, Loader=getattr(yaml, "CLoader", yaml.Loader)):
                if isinstance(event, yaml.AliasEvent):
                    wanted = "got an alias (*name), expected everything written out"
                    raise RecordingError(f"{FILE_NAME}: {wanted}")
                depth += isinstance(event, yaml.CollectionStartEvent)
                depth -= isinstance(event, yaml.CollectionEndEvent)
                if depth > MOST_NESTED:
                    msg = f"{FILE_NAME}: lists within lists, more than {MOST_NESTED} deep"
                    raise RecordingError(msg)
    except yaml.YAMLError:
        return  # its reader reports what is wrong


def _vehicles(description: Description, folder: Path, cars: tuple[str, ...]) -> tuple[str, ...]:
    paths = [table.file for table in description.tables]
    paths += [table.definitions for table in description.tables if table.definitions is not None]
    for path in paths:
        lies = (folder / path).resolve()
        if not lies.is_relative_to(folder.resolve()) or not lies.exists():
            raise RecordingError(f"{FILE_NAME}: table {path!r}: no such file in the zip")
    named = [description.vehicle, *(table.vehicle for table in description.tables)]
    vehicles = tuple(dict.fromkeys(name for name in named if name))
    unknown = next((name for name in vehicles if name not in cars), None)
    if unknown is not None:
        known = ", ".join(cars)
        raise RecordingError(
            f"{FILE_NAME}: vehicle {unknown!r}: expected one of the city's: {known}"
        )
    return vehicles


if __name__ == "__main__":
    main(sys.argv[1:])
