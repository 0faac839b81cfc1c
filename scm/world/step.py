"""One tick of the world, on one page.

    hear -> drivers and guards -> [ dynamics, contacts ] x 4 -> watch -> sensors -> radio -> out

Read a stage by its name: each is one file beside this one.
"""

from collections.abc import Sequence

from scm.clock import seconds
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.air import transmit
from scm.world.collide import collide
from scm.world.driving import drive
from scm.world.hearing import hear
from scm.world.pace import CONTACT_STEP_NS
from scm.world.publish import cams_due, publish
from scm.world.sensing import sense
from scm.world.watch import watch
from scm.world.world import World


def tick(world: World, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
    """Bring the world to `now_ns`; return what it sends."""
    world.outbox = []
    world.tick += 1
    hear(world, now_ns, inbox)  # requests, commands, reports and radio frames since the last tick
    _steer(world, now_ns)
    _move(world, now_ns)
    watch(world, now_ns)
    world.outbox += sense(world, now_ns)
    publish(world, now_ns)
    _call_out(world, now_ns)
    return world.outbox


def _steer(world: World, now_ns: int) -> None:
    """Let whoever drives each hosted car set its throttle and steering."""
    for car in world.hosted.values():
        lost = drive(car, now_ns, stop=world.stop.engaged)
        if lost is not None:
            text = f"{car.name} stands: {lost}"
            world.say("warning", "lease_lost", text, now_ns, car.name)


def _move(world: World, now_ns: int) -> None:
    """Advance all hosted cars at 1 kHz and solve the contacts of all cars at 200 Hz."""
    steps = world.pace.steps(now_ns)
    world.impacts.begin(steps * seconds(CONTACT_STEP_NS))
    for left in range(steps - 1, -1, -1):
        for fleet in world.garage.fleets.values():
            world.ground.feel(fleet, now_ns - (left + 1) * CONTACT_STEP_NS)
        world.garage.advance(seconds(CONTACT_STEP_NS))
        collide(world, now_ns - left * CONTACT_STEP_NS)


def _call_out(world: World, now_ns: int) -> None:
    """Send the CAMs that hosted cars owe the air, and let the radio carry them."""
    states = [message for message in world.outbox if isinstance(message, VehicleState)]
    cams = cams_due(world, states, now_ns)
    world.outbox += cams
    transmit(world, cams, now_ns)
