"""One tick of the world, on one page.

    receive -> drivers, guards -> [ dynamics, contacts ] x 4 -> watch -> sensors -> publish -> radio

Each stage is one file beside this one and returns the messages to send. All of them work on the
arrays of `vehicle_arrays.py`; none walks over all cars in Python.
"""

from collections.abc import Sequence

from scm.clock import seconds
from scm.v2x.exchange import Incoming, Outgoing
from scm.world.collide import collide
from scm.world.driving import steer
from scm.world.pace import CONTACT_STEP_NS
from scm.world.publish import publish
from scm.world.reception import receive
from scm.world.sensing import sense
from scm.world.transmission import send_radio
from scm.world.watch import watch
from scm.world.world import World


def tick(world: World, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
    """Bring the world to `now_ns`; return what it sends."""
    world.tick += 1
    world.subscribers.begin_tick()
    return [
        *receive(world, now_ns, inbox),  # requests, commands, reports, frames since the last tick
        *steer(world, now_ns),  # leaseholders through their guards, drivers all in one call
        *move(world, now_ns),
        *watch(world, now_ns),
        *sense(world, now_ns),
        *publish(world, now_ns),
        *send_radio(world, now_ns),
    ]


def move(world: World, now_ns: int) -> list[Outgoing]:
    """Advance all hosted cars at 1 kHz and solve the contacts of all cars at 200 Hz."""
    steps = world.pace.steps(now_ns)
    step_s = seconds(CONTACT_STEP_NS)
    world.impulses.accelerations.begin(steps * step_s)
    out: list[Outgoing] = []
    for left in range(steps, 0, -1):
        t_ns = now_ns - left * CONTACT_STEP_NS
        world.garage.advance(world.ground, t_ns, step_s)
        out += collide(world, t_ns + CONTACT_STEP_NS)
    world.garage.drain(steps * step_s)
    world.locate()
    return out
