"""A file that may grow while it is sent: as long as it was at the request, or a part of it."""

import re
from collections.abc import Iterator
from pathlib import Path

from fastapi import Request, Response
from fastapi.responses import StreamingResponse

BLOCK = 256 * 1024
_RANGE = re.compile(r"bytes=([0-9]{0,18})-([0-9]{0,18})")


def send_file(request: Request, path: Path, media_type: str) -> Response:
    """Return a file to be cached, whole or the one requested range (RFC 9110, 14)."""
    facts = path.stat()
    size, tag = facts.st_size, f'"{facts.st_mtime_ns:x}-{facts.st_size:x}"'
    headers = {
        "Accept-Ranges": "bytes",
        "Cache-Control": "no-cache",
        "Content-Disposition": f'attachment; filename="{path.name}"',
        "ETag": tag,
    }
    requested = request.headers.get("range", "")
    if requested and request.headers.get("if-range", tag) != tag:
        requested = ""  # the part would not fit to what the reader has
    span = _span(requested, size)
    if span is None:
        return Response(status_code=416, headers={**headers, "Content-Range": f"bytes */{size}"})
    start, end = span
    headers["Content-Length"] = str(end - start)
    status = 200
    if _RANGE.fullmatch(requested):
        status = 206
        headers["Content-Range"] = f"bytes {start}-{end - 1}/{size}"
    return StreamingResponse(_blocks(path, start, end), status, headers, media_type)


def _span(requested: str, size: int) -> tuple[int, int] | None:
    """Return begin and end of a range; the whole file for forms we do not know; None: no such."""
    match = _RANGE.fullmatch(requested)
    if match is None or match[0] == "bytes=-":
        return 0, size
    first, last = match.groups()
    if not first:
        start, end = max(0, size - int(last)), size
    else:
        start, end = int(first), min(size, int(last) + 1 if last else size)
    return (start, end) if start < end else None


def _blocks(path: Path, start: int, end: int) -> Iterator[bytes]:
    with path.open("rb") as stream:
        stream.seek(start)
        while start < end:
            block = stream.read(min(BLOCK, end - start))
            if not block:
                return
            start += len(block)
            yield block
