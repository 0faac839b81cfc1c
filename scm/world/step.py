"""One tick of the world, on one page.

    advance    receive -> border -> drivers, guards -> [ dynamics, contacts ] x 4 -> border
               -> watch -> warn
    report     sensors -> publish -> radio

Between the two halves all cars stand where this tick brings them: there the regions of a city that
is cut tell each other of their cars (`regions/`).

Each stage is one file beside this one and returns the messages to send. Stages work on the arrays
of `vehicle_arrays.py`; none loops over all cars in Python. Sensing and contacts get what they need;
the others answer requests, remove cars or report on everything, so they get the world.
"""

from collections.abc import Sequence

from scm.clock import seconds
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.contact import Contact
from scm.world.border import approach, report_cars
from scm.world.collide import collide
from scm.world.driving import steer
from scm.world.handover import depart
from scm.world.pace import CONTACT_STEP_NS
from scm.world.publish import publish
from scm.world.reception import receive
from scm.world.sensing import sense
from scm.world.transmission import send_radio
from scm.world.warnings import warn
from scm.world.watch import watch
from scm.world.world import World


def tick(world: World, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
    """Bring the world to `now_ns`; return what it sends."""
    return [*advance(world, now_ns, inbox), *report(world, now_ns)]


def advance(world: World, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
    """Handle what arrived and move all cars to `now_ns`; return what follows from it."""
    world.tick += 1
    world.subscribers.begin_tick()
    out = [
        *receive(world, now_ns, inbox),  # requests, commands, reports, frames since the last tick
        *approach(world, now_ns),  # cars wait at the border until the next city has room
        *steer(world, now_ns),  # leaseholders through their guards, drivers all in one call
        *move(world, now_ns),
        *depart(world, now_ns),  # cars over the border become transfers
        *report_cars(world, now_ns),
        *watch(world, now_ns),
    ]
    warn(world, now_ns)
    return out


def report(world: World, now_ns: int) -> list[Outgoing]:
    """Return what sensors measure, what cars and city report, and what goes over the radio."""
    return [
        *sense(world.cars, world.sensors, world.contacts.boxes, world.subscribers, now_ns),
        *publish(world, now_ns),
        *send_radio(world, now_ns),
    ]


def move(world: World, now_ns: int) -> list[Outgoing]:
    """Advance all hosted cars at 1 kHz and solve the contacts of all cars at 200 Hz."""
    steps = world.pace.steps(now_ns)
    step_s = seconds(CONTACT_STEP_NS)
    world.impulses.accelerations.begin(steps * step_s)
    world.contacts.forget()
    is_subscribed = world.subscribers.any(Contact)
    out: list[Outgoing] = []
    for left in range(steps, 0, -1):
        t_ns = now_ns - left * CONTACT_STEP_NS
        world.cars.garage.advance(world.ground, t_ns, step_s)
        end_ns = t_ns + CONTACT_STEP_NS
        out += collide(
            world.cars, world.contacts, world.impulses, world.alerts.stuck, end_ns,
            is_subscribed=is_subscribed,
        )  # fmt: skip
    world.cars.garage.drain(steps * step_s)
    world.cars.locate(world.sensors.external)
    return out
