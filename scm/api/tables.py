"""Lists as files: CSV for a spreadsheet, JSON Lines for a program; written while they are sent."""

import csv
import io
from collections.abc import Iterable, Iterator
from typing import Annotated, Literal

import msgspec
from fastapi import Path
from fastapi.responses import StreamingResponse

Form = Annotated[Literal["csv", "jsonl"], Path(description="of the file", examples=["csv"])]
_MEDIA = {"csv": "text/csv; charset=utf-8", "jsonl": "application/jsonl"}
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def table_response(
    rows: Iterable[msgspec.Struct], kind: type[msgspec.Struct], form: Form, name: str
) -> StreamingResponse:
    """Return rows of one kind as a download called `<name>.<form>`."""
    lines = _csv(rows, kind) if form == "csv" else _jsonl(rows)
    return StreamingResponse(
        lines,
        media_type=_MEDIA[form],
        headers={
            "Cache-Control": "no-store",
            "Content-Disposition": f'attachment; filename="{name}.{form}"',
        },
    )


def _jsonl(rows: Iterable[msgspec.Struct]) -> Iterator[bytes]:
    for row in rows:
        yield msgspec.json.encode(row) + b"\n"


def _csv(rows: Iterable[msgspec.Struct], kind: type[msgspec.Struct]) -> Iterator[str]:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(kind.__struct_fields__)
    for row in rows:
        writer.writerow([_cell(getattr(row, name)) for name in kind.__struct_fields__])
        if text.tell() > 16_384:
            yield text.getvalue()
            text.seek(0)
            text.truncate()
    yield text.getvalue()


def _cell(value: object) -> object:
    """Return what a cell holds; text that a spreadsheet would run as a formula is quoted."""
    if value is None:
        return ""
    if isinstance(value, dict):
        return msgspec.json.encode(value).decode()
    if isinstance(value, str) and value.startswith(_FORMULA):
        return f"'{value}"
    return value
