"""What hosted cars warn of on the air (DENM), as real stations would; asked ten times a second.

A car warns of a hit, of hard braking, and of itself while it stands where nobody should: within a
junction, given up by whoever drove it, or with dynamics that have broken down. Waiting at lines
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
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.denm import DenmTx
from scm.world.publish import states_of
from scm.world.slots import DRIVE
from scm.world.world import World

_CALLED = {
    (ACCIDENT, None): "an accident",
    (STATIONARY_VEHICLE, None): "a vehicle that stands",
    (DANGEROUS_SITUATION, EMERGENCY_BRAKE): "its hard braking",
}


def watch(world: World) -> None:
    """Note who brakes hard: at every step, since a Nigel stops within a tenth of a second."""
    slots = world.slots
    hard = world.garage.signal("accel_x") <= -HARD_BRAKING_MPS2
    hard &= slots.hosted & (slots.mode == DRIVE) & (slots.speed > MIN_BRAKING_MPS)
    world.dangers.braked.update(np.flatnonzero(hard).tolist())


def call_denms(world: World, now_ns: int) -> list[DenmTx]:
    """Return the DENMs that hosted cars send now."""
    slots, hosted, warners = world.slots, world.hosted, world.dangers.warners
    stranded = _stranded(world)
    braked = world.dangers.braked
    for gone in set(warners) - set(hosted):
        del warners[gone]
    busy = {name for name, one in warners.items() if one.is_busy}
    struck = {slots.names[n] for n in {*np.flatnonzero(stranded).tolist(), *braked}}
    names = sorted((busy | struck | set(world.dangers.hits)) & set(hosted))
    of = np.array([hosted[name].slot for name in names], np.int64)
    frames: list[DenmTx] = []
    for state in states_of(world, of, now_ns):
        name = state.vehicle
        bodies = warners.setdefault(name, CarWarnings(name)).step(
            state,
            _contacts(name, world.dangers.hits.get(name), now_ns),
            is_stranded=bool(stranded[hosted[name].slot]),
            has_braked=hosted[name].slot in braked,
        )
        frames += [DenmTx(station=name, t_ns=now_ns, body=body) for body in bodies]
    world.dangers.hits.clear()
    braked.clear()
    return frames


def tell(world: World, frame: DenmTx, now_ns: int) -> None:
    """Put what is new on the air into the log of the city, whoever warns."""
    found, situation = (
        world.dangers.told.receive(frame.body, now_ns),
        frame.body.situation_container,
    )
    if found == "new" and situation is not None:
        event = situation.event_type
        of_any_kind = _CALLED.get((event.cause, None), "a danger")
        what = _CALLED.get((event.cause, event.subcause), of_any_kind)
        text = f"{frame.station} warns of {what}"
        world.say("warning", "denm", text, now_ns, frame.station)
    elif found == "ended":
        text = f"{frame.station} says that its warning is over"
        world.say("info", "denm", text, now_ns, frame.station)


def _stranded(world: World) -> Bools:
    """Return by slot which hosted cars stand though they should not."""
    slots = world.slots
    stands: Bools = slots.hosted & (np.abs(slots.speed) < STANDSTILL_MPS)
    if world.stop.engaged:
        return stands & slots.diverged
    stranded = slots.hazard | slots.diverged
    inside = np.zeros_like(stands)
    of = np.flatnonzero(stands & slots.driven & ~slots.arrived)
    inside[of] = world.drivers.is_in_junction(of)
    return stands & (stranded | inside)


def _contacts(name: str, others: Iterable[str] | None, now_ns: int) -> tuple[Contact, ...]:
    if others is None:
        return ()
    hit = Contact(
        vehicle=name,
        t_ns=now_ns,
        dvx_mps=0.0,
        dvy_mps=0.0,
        dyaw_rate_radps=0.0,
        against=tuple(others),
    )
    return (hit,)
