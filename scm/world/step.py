"""One tick of the world, on one page.

    hear -> drivers and guards -> [ dynamics, contacts ] x 4 -> watch -> sensors -> out -> radio

Read a stage by its name: each is one file beside this one. All of them work on the arrays of
`slots.py`; none walks over all cars in Python.
"""

from collections.abc import Sequence

from scm.clock import seconds
from scm.v2x.exchange import Incoming, Outgoing
from scm.world.air import call_out
from scm.world.collide import collide
from scm.world.driving import steer
from scm.world.hearing import hear
from scm.world.pace import CONTACT_STEP_NS
from scm.world.publish import publish
from scm.world.sensing import sense
from scm.world.watch import watch
from scm.world.world import World


def tick(world: World, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
    """Bring the world to `now_ns`; return what it sends."""
    world.outbox = []
    world.tick += 1
    world.wishes.begin_tick()
    hear(world, now_ns, inbox)  # requests, commands, reports and radio frames since the last tick
    steer(world, now_ns)  # leaseholders through their guards, drivers all in one call
    move(world, now_ns)
    watch(world, now_ns)
    world.outbox += sense(world, now_ns)
    publish(world, now_ns)
    call_out(world, now_ns)
    return world.outbox


def move(world: World, now_ns: int) -> None:
    """Advance all hosted cars at 1 kHz and solve the contacts of all cars at 200 Hz."""
    steps = world.pace.steps(now_ns)
    world.impacts.begin(steps * seconds(CONTACT_STEP_NS))
    for left in range(steps, 0, -1):
        t_ns = now_ns - left * CONTACT_STEP_NS
        world.garage.advance(world.ground, t_ns, seconds(CONTACT_STEP_NS))
        collide(world, t_ns + CONTACT_STEP_NS)
    world.garage.drain(steps * seconds(CONTACT_STEP_NS))
    world.locate()
