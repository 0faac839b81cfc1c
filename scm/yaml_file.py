"""Reads YAML files that people write: plain data in UTF-8, each key once."""

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from scm.errors import RecordingError, ScmError, reading

MAX_BYTES = 16 << 20  # longer than any description that people or programs write


def read_yaml(
    path: Path, error: type[ScmError] = RecordingError, hint: str = "", *, first: bool = False
) -> Any:
    """Return the content of a YAML file; OpenCV's header and matrices are read as plain data.

    Args:
        path: The file.
        error: What to raise.
        hint: What to do about a file that cannot be read.
        first: Whether the file may hold several documents, of which the first is returned.

    Raises:
        ScmError: an `error` that names the file: it cannot be read, is too large, is not YAML, or
            holds a key twice.
    """
    with reading(path, "a YAML file", error, hint):
        if path.stat().st_size > MAX_BYTES:
            raise error(
                f"{path}: a description of more than {MAX_BYTES >> 20} MiB: is it the data?"
            )
        text = path.read_text(encoding="utf-8-sig")
        if text.startswith("%YAML"):  # OpenCV writes "%YAML:1.0", which is no YAML
            text = text.partition("\n")[2]
        if first:
            return next(iter(yaml.load_all(text, Loader=_Loader)), None)
        return yaml.load(text, Loader=_Loader)


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """Plain YAML, but a key that stands twice is refused: the first one would be lost silently."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Return a mapping of distinct keys."""
        seen: set[str] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if key.value in seen:
                    msg = f"line {key.start_mark.line + 1}: the key {key.value!r} stands twice"
                    raise yaml.YAMLError(msg)
                seen.add(key.value)
        mapping: dict[Hashable, Any] = super().construct_mapping(node, deep)
        return mapping


def _construct_matrix(loader: _Loader, tag: str, node: yaml.MappingNode) -> dict[Hashable, Any]:
    del tag
    return loader.construct_mapping(node, deep=True)


_Loader.add_multi_constructor("tag:yaml.org,2002:opencv-", _construct_matrix)
