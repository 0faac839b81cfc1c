"""`scm eye detect`: every tag in pictures."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:  # the command line starts without what finds tags
    from scm.records.eye import TagSeen

_ORDER = (
    "Corners: lower left, lower right, upper right, upper left of the printed tag; the centre of "
    "the first pixel is (0, 0)."
)


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.description = f"{COMMAND.help} {_ORDER}"
    parser.add_argument(
        "image", nargs="+", type=Path, metavar="IMAGE", help="any picture that OpenCV reads"
    )
    parser.add_argument("--json", action="store_true", help="print one line of JSON per picture")


def _run(arguments: argparse.Namespace) -> int:
    from scm.eye.detect import detect_tags
    from scm.eye.find.causes import cause_of
    from scm.eye.picture import read_picture
    from scm.eye.source import grey_of

    for path in arguments.image:
        grey = grey_of(read_picture(path))
        tags = detect_tags(grey)
        cause = None if tags else cause_of(grey)
        why = "" if cause is None else cause.said
        print(_as_json(path, tags, why) if arguments.json else _as_text(path, tags, why))
    return 0


def _as_json(path: Path, tags: Sequence["TagSeen"], why: str) -> str:
    found = [
        {"id": tag.tag_id, "corners_px": tag.corners_px, "decision_margin": tag.margin}
        for tag in tags
    ]
    cause = {"cause": why} if why else {}
    return json.dumps({"image": str(path), "tags": found, **cause})


def _as_text(path: Path, tags: Sequence["TagSeen"], why: str) -> str:
    lines = [f"{path}: {len(tags)} tag{'' if len(tags) == 1 else 's'}" + (why and f": {why}")]
    for tag in tags:
        corners = "  ".join(f"({x:.2f}, {y:.2f})" for x, y in tag.corners_px)
        lines.append(f"  id {tag.tag_id:3}  margin {tag.margin:5.1f}  {corners}")
    return "\n".join(lines)


COMMAND = Command(
    help="List the AprilTags (tag36h11) in pictures: id, corners in pixels, decision margin.",
    example="scm eye detect overhead.jpg --json",
    arguments=_arguments,
    run=_run,
)
