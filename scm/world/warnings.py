"""Warnings of hosted cars by radio (DENM), as real stations send them; checked ten times a second.

A car warns of a hit, of hard braking, and of itself while it stands where nobody should: within a
junction, without its leaseholder, or with diverged dynamics. Waiting at lines
and in queues, parking, and a stop of the whole city are no event of one car.
"""

from collections.abc import Iterable

import numpy as np

from scm.arrays import Bools
from scm.v2x.etsi.events import (
    ACCIDENT,
    DANGEROUS_SITUATION,
    EMERGENCY_BRAKE,
    HARD_BRAKING_MPS2,
    MIN_BRAKING_MPS,
    STANDSTILL_MPS,
    STATIONARY_VEHICLE,
    CarWarnings,
)
from scm.v2x.exchange import Outgoing
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.denm import DenmTx
from scm.world.alerts import city_event
from scm.world.publish import states_of
from scm.world.vehicle_arrays import DRIVE
from scm.world.world import World

_CALLED = {
    (ACCIDENT, None): "an accident",
    (STATIONARY_VEHICLE, None): "a vehicle that stands",
    (DANGEROUS_SITUATION, EMERGENCY_BRAKE): "its hard braking",
}


def warn(world: World, now_ns: int) -> None:
    """Find out what hosted cars have to warn of; `WarningState.due` holds it until it is sent."""
    note_hard_braking(world)
    if world.every["denm"].is_due(now_ns):
        world.radio.warnings.due = due_denms(world, now_ns)


def note_hard_braking(world: World) -> None:
    """Note who brakes hard; every tick, since a Nigel stops within a tenth of a second."""
    vehicles = world.cars.arrays
    hard = world.cars.garage.signal("accel_x") <= -HARD_BRAKING_MPS2
    hard &= vehicles.hosted & (vehicles.mode == DRIVE) & (vehicles.speed > MIN_BRAKING_MPS)
    world.radio.warnings.braked.update(np.flatnonzero(hard).tolist())


def due_denms(world: World, now_ns: int) -> list[DenmTx]:
    """Return the DENMs that hosted cars send now."""
    vehicles, hosted, warners = world.cars.arrays, world.cars.hosted, world.radio.warnings.warners
    stranded = _stranded(world)
    braked = world.radio.warnings.braked
    for gone in set(warners) - set(hosted):
        del warners[gone]
    busy = {name for name, one in warners.items() if one.is_busy}
    struck = {vehicles.names[n] for n in {*np.flatnonzero(stranded).tolist(), *braked}}
    names = sorted((busy | struck | set(world.impulses.hits)) & set(hosted))
    of = np.array([hosted[name].index for name in names], np.int64)
    frames: list[DenmTx] = []
    for state in states_of(world, of, now_ns):
        name = state.vehicle
        bodies = warners.setdefault(name, CarWarnings(name)).step(
            state,
            _contacts(name, world.impulses.hits.get(name), now_ns),
            is_stranded=bool(stranded[hosted[name].index]),
            has_braked=hosted[name].index in braked,
        )
        frames += [DenmTx(station=name, t_ns=now_ns, body=body) for body in bodies]
    world.impulses.hits.clear()
    braked.clear()
    return frames


def log_warning(world: World, frame: DenmTx, now_ns: int) -> list[Outgoing]:
    """Return an event for a warning that is new or over, whoever sent it."""
    found = world.radio.warnings.denms.receive(frame.body, now_ns)
    situation = frame.body.situation_container
    if found == "new" and situation is not None:
        event = situation.event_type
        of_any_kind = _CALLED.get((event.cause, None), "a danger")
        what = _CALLED.get((event.cause, event.subcause), of_any_kind)
        text = f"{frame.station} warns of {what}"
        return [city_event("warning", "denm", text, now_ns, frame.station)]
    if found == "ended":
        text = f"{frame.station} ends its warning"
        return [city_event("info", "denm", text, now_ns, frame.station)]
    return []


def _stranded(world: World) -> Bools:
    """Return by slot which hosted cars stand though they should not."""
    vehicles = world.cars.arrays
    stands: Bools = vehicles.hosted & ~vehicles.elsewhere
    stands &= np.abs(vehicles.speed) < STANDSTILL_MPS
    if world.stop.engaged:
        return stands & vehicles.diverged
    stranded = vehicles.hazard | vehicles.diverged
    inside = np.zeros_like(stands)
    of = np.flatnonzero(stands & vehicles.driven & ~vehicles.arrived)
    inside[of] = world.drivers.is_in_junction(of)
    return stands & (stranded | inside)


def _contacts(name: str, others: Iterable[str] | None, now_ns: int) -> tuple[Contact, ...]:
    if others is None:
        return ()
    hit = Contact(
        vehicle=name, t_ns=now_ns, dvx_mps=0.0, dvy_mps=0.0, dyaw_rate_radps=0.0,
        against=tuple(others),
    )  # fmt: skip
    return (hit,)
