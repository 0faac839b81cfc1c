"""A diagnosis as the fields of `report.json`; what is not a finite number is null."""

import dataclasses
import json
import math
from collections.abc import Mapping
from numbers import Real
from typing import Any

from scm.mismatch.findings import Diagnosis


def json_text(diagnosis: Diagnosis) -> str:
    """Return the text of `report.json`."""
    fields = report_fields(diagnosis)
    return json.dumps(fields, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def report_fields(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the fields as lists, mappings, text, and finite numbers or None."""
    return {
        field.name: plain(getattr(diagnosis, field.name)) for field in dataclasses.fields(diagnosis)
    }


def plain(value: Any) -> Any:
    """Return a value as lists, mappings, text, and finite numbers or None."""
    if dataclasses.is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, str):
        return str(value)
    if value is None or isinstance(value, (bool, int)):
        return value
    if isinstance(value, Real):
        number = float(value)
        return number if math.isfinite(number) else None
    return [plain(item) for item in value]
