"""Pieces that several messages share: names of ASN.1 to those of the records, and back.

A row is (name of the record, name of ASN.1) or, with a third part, how the value is translated.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import msgspec

from scm.errors import MessageError


class Names(NamedTuple):
    """An enumeration: the place in the list is the number of the record."""

    names: Sequence[str]

    def to_asn(self, number: int) -> str:
        """Return the name of a number."""
        return self.names[number]

    def of_asn(self, name: str) -> int:
        """Return the number of a name."""
        return self.names.index(name)


class Bits(NamedTuple):
    """A bit string that is text of 0 and 1 in the record."""

    length: int

    def to_asn(self, text: str) -> tuple[int, int]:
        """Return (value, length)."""
        return int(text, 2), self.length

    def of_asn(self, value: tuple[int, int]) -> str:
        """Return it as text."""
        return format(value[0], f"0{value[1]}b")


class Flags(NamedTuple):
    """A bit string that is a list of the names of its set bits in the record."""

    names: Sequence[str]

    def to_asn(self, names: Sequence[str]) -> tuple[int, int]:
        """Return (value, length)."""
        return Bits(len(self.names)).to_asn("".join(str(int(n in names)) for n in self.names))

    def of_asn(self, value: tuple[int, int]) -> list[str]:
        """Return the names."""
        bits = Bits(len(self.names)).of_asn(value)
        return [name for name, bit in zip(self.names, bits, strict=False) if bit == "1"]


class Switches(NamedTuple):
    """A bit string that is a record of booleans."""

    names: Sequence[str]

    def to_asn(self, record: Mapping[str, bool]) -> tuple[int, int]:
        """Return (value, length)."""
        return Flags(self.names).to_asn([name for name in self.names if record[name]])

    def of_asn(self, value: tuple[int, int]) -> dict[str, bool]:
        """Return name to whether it is set."""
        on = Flags(self.names).of_asn(value)
        return {name: name in on for name in self.names}


class Chosen(NamedTuple):
    """A choice of which the record has one alternative."""

    name: str
    inner: Any = None

    def to_asn(self, value: Any) -> tuple[str, Any]:
        """Return (alternative, value)."""
        return self.name, value if self.inner is None else self.inner.to_asn(value)

    def of_asn(self, value: tuple[str, Any]) -> Any:
        """Return the value.

        Raises:
            MessageError: when it is another alternative.
        """
        if value[0] != self.name:
            msg = f"expected the choice {self.name}, got {value[0]}, which is not read here"
            raise MessageError(msg)
        return value[1] if self.inner is None else self.inner.of_asn(value[1])


class Only(NamedTuple):
    """A record of one field, which ASN.1 does without."""

    name: str
    inner: Any

    def to_asn(self, record: Mapping[str, Any]) -> Any:
        """Return the field's value."""
        return self.inner.to_asn(record[self.name])

    def of_asn(self, value: Any) -> dict[str, Any]:
        """Return the record."""
        return {self.name: self.inner.of_asn(value)}


class Each(NamedTuple):
    """A list."""

    inner: Any

    def to_asn(self, values: Sequence[Any]) -> list[Any]:
        """Return each translated."""
        return [self.inner.to_asn(value) for value in values]

    def of_asn(self, values: Sequence[Any]) -> list[Any]:
        """Return each translated."""
        return [self.inner.of_asn(value) for value in values]


class Fields:
    """A record."""

    def __init__(self, *rows: tuple[str, str] | tuple[str, str, Any], **given: Any) -> None:
        """Take the rows, and what ASN.1 requires though the record may leave it out."""
        self._rows = [(*row, None)[:3] for row in rows]
        self._given = given

    def to_asn(self, record: Mapping[str, Any]) -> dict[str, Any]:
        """Return the value of ASN.1; what the record leaves out is left out."""
        value = dict(self._given)
        for name, asn, inner in self._rows:
            if name in record:
                value[asn] = record[name] if inner is None else inner.to_asn(record[name])
        return value

    def of_asn(self, value: Mapping[str, Any]) -> dict[str, Any]:
        """Return the record; what we do not know is left out."""
        return {
            name: value[asn] if inner is None else inner.of_asn(value[asn])
            for name, asn, inner in self._rows
            if asn in value
        }


def plain(body: msgspec.Struct) -> dict[str, Any]:
    """Return a body as dictionaries, without what is absent."""
    fields: dict[str, Any] = msgspec.to_builtins(body)
    return fields


def header_of(record: Mapping[str, Any], message_id: int) -> dict[str, int]:
    """Return the header that all messages have, of a record."""
    return {
        "protocolVersion": record["protocol_version"],
        "messageID": message_id,
        "stationID": record["station_id"],
    }


def read_header(value: Mapping[str, Any]) -> dict[str, int]:
    """Return a record's header fields."""
    header = value["header"]
    return {"protocol_version": header["protocolVersion"], "station_id": header["stationID"]}


ALTITUDE_CONFIDENCE = Names(
    (
        *("alt-000-01", "alt-000-02", "alt-000-05", "alt-000-10", "alt-000-20", "alt-000-50"),
        *("alt-001-00", "alt-002-00", "alt-005-00", "alt-010-00", "alt-020-00", "alt-050-00"),
        *("alt-100-00", "alt-200-00", "outOfRange", "unavailable"),
    )
)
ALTITUDE = Fields(
    ("value", "altitudeValue"), ("confidence", "altitudeConfidence", ALTITUDE_CONFIDENCE)
)
HEADING = Fields(("value", "headingValue"), ("confidence", "headingConfidence"))
SPEED = Fields(("value", "speedValue"), ("confidence", "speedConfidence"))
PATH = Each(
    Fields(
        (
            "path_position",
            "pathPosition",
            Fields(
                ("delta_latitude", "deltaLatitude"),
                ("delta_longitude", "deltaLongitude"),
                ("delta_altitude", "deltaAltitude"),
            ),
        ),
        ("path_delta_time", "pathDeltaTime"),
    )
)
INTERSECTION_ID = Fields(("id", "id"), ("region", "region"))
POSITION_3D = Fields(("latitude", "lat"), ("longitude", "long"), ("elevation", "elevation"))


class _AccessPoint:
    """One of three in ASN.1, all three in the record: missing ones are 0."""

    def to_asn(self, record: Mapping[str, int]) -> tuple[str, int]:
        value = next((name for name in ("lane", "approach", "connection") if record[name]), "lane")
        return value, record[value]

    def of_asn(self, value: tuple[str, int]) -> dict[str, int]:
        return {"lane": 0, "approach": 0, "connection": 0, value[0]: value[1]}


ACCESS_POINT = _AccessPoint()
