"""What the parts store: one small record each, with its fields as they stand in the JSON.

leases   world/<car>          CarRecord        a car, and who may drive it
latches  world/stop           StopRecord       the red button
latches  world/epochs         EpochRecord      no lease may have an epoch as low as this again
latches  monitor/<junction>   FaultRecord      a fault that only a person resets
plans    traffic/<junction>   PlanRecord       the plan in force, and the wish for flash
answers  <station>/<digest>   StoredAnswer     see scm.v2x.answers
marks    <station>                             which batch of which run was written last
seen     event/<id>           Acknowledgement  who took note of an event (scm.api.acknowledgements)
calibrations  eye.../<camera>  SightRecord     what a camera sees by (scm.eye.sight)
twins    twin/version/<car>/<number>  TwinVersion  of a car's file (scm.v2x.messages.twin_status)
twins    twin/change/<car>/<t_ns>     TwinChange   of a car
handovers world/out/<car>           OutgoingRecord  a car on its way to the next city (scm.world)
handovers world/in/<city>/<car>     ArrivalRecord   the last transfer of a car from there
"""

from typing import TypeVar

import msgspec

from scm.errors import StoreError
from scm.records.signal_plans import SignalStage
from scm.store.repository import Repository, Table

R = TypeVar("R", bound=msgspec.Struct)


class CarRecord(msgspec.Struct, kw_only=True, frozen=True):
    """A car of the world and its lease.

    Attributes:
        hosted: Whether the world simulates it; others come back by themselves.
        x_m, y_m, yaw_rad: Where it was put, map frame.
        home: Who owns it when nobody else does.
        owner: Who owns it.
        epoch: Of this ownership.
        ttl_ms: How long the lease lives without renewal.
        tag_id: On its roof; None: kept before tags were.
        circulates: Whether it drives on by itself after a restart.
    """

    car_file: str
    hosted: bool
    x_m: float
    y_m: float
    yaw_rad: float
    home: str
    owner: str
    epoch: int
    ttl_ms: int
    tag_id: int | None = None
    circulates: bool = False


class StopRecord(msgspec.Struct, kw_only=True, frozen=True):
    """The city stop."""

    engaged: bool
    by: str = ""
    reason: str = ""


class EpochRecord(msgspec.Struct, kw_only=True, frozen=True):
    """The highest epoch of any car that left."""

    highest: int


class PlanRecord(msgspec.Struct, kw_only=True, frozen=True):
    """What a junction was last asked for.

    Attributes:
        plan: By name, to come into force at the next safe moment.
        flash: Whether a person asked for flashing red.
        by: Who asked, and why, in one sentence.
        stages: Of a plan that is none of the junction's own.
        offset_s: Of that plan; None: it is in step with nobody.
    """

    plan: str
    flash: bool = False
    by: str = ""
    stages: tuple[SignalStage, ...] = ()
    offset_s: float | None = None


class FaultRecord(msgspec.Struct, kw_only=True, frozen=True):
    """A fault that a monitor latched."""

    fault: str


def records(store: Repository, table: Table, station: str, kind: type[R]) -> dict[str, R]:
    """Return a station's records of a table by key, without the station's name.

    Raises:
        StoreError: naming the record that cannot be read.
    """
    prefix, found = f"{station}/", {}
    for name, value in store.items(table):
        if name.startswith(prefix):
            key = name.removeprefix(prefix)
            found[key] = _read(table, name, value, kind)
    return found


def record(store: Repository, table: Table, station: str, key: str, kind: type[R]) -> R | None:
    """Return one record of a station; None: there is none.

    Raises:
        StoreError: when it cannot be read.
    """
    name = f"{station}/{key}"
    value = store.get(table, name)
    return None if value is None else _read(table, name, value, kind)


def _read(table: Table, name: str, value: bytes, kind: type[R]) -> R:
    try:
        return msgspec.json.decode(value, type=kind)
    except msgspec.MsgspecError as cause:
        msg = f"state: {table} {name}: {cause}"
        raise StoreError(msg) from cause
