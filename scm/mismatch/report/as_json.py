"""A diagnosis as the fields of `report.json`; what is not a finite number is null."""

import json
from typing import Any

import msgspec
import numpy as np

from scm.mismatch.findings import Diagnosis


def json_text(diagnosis: Diagnosis) -> str:
    """Return the text of `report.json`."""
    return json.dumps(plain(diagnosis), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """Return a value as lists, mappings, text, and finite numbers or None."""
    return msgspec.json.decode(msgspec.json.encode(value, enc_hook=_of_numpy))


def _of_numpy(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    msg = f"{type(value)} has no form in JSON"
    raise NotImplementedError(msg)
