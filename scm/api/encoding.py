"""JSON for the web, from our records."""

from typing import SupportsFloat

import msgspec


def _as_float(value: object) -> float:
    """Numbers of numpy may come from a world in the same process, whose messages stay objects."""
    if isinstance(value, SupportsFloat):
        return float(value)
    msg = f"cannot be shown as JSON: {type(value).__name__}"
    raise NotImplementedError(msg)


encode = msgspec.json.Encoder(enc_hook=_as_float).encode
