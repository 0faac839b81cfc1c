"""Results as a table: for a terminal, and as Markdown."""

from collections.abc import Sequence


def text_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table of aligned columns."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    lines = [head, ["-" * width for width in widths], *rows]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def in_ms(span_ns: int | None) -> str:
    """Return a span for a person; None: there was none."""
    return "-" if span_ns is None else f"{span_ns / 1e6:.0f} ms"


def in_s(span_ns: int | None) -> str:
    """Return a longer span for a person; None: there was none."""
    return "-" if span_ns is None else f"{span_ns / 1e9:.1f} s"
