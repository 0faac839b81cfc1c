"""A station for tests, run as a process: `toy_station.py NAME ENDPOINT [behaviour]`."""

import sys

from scm.clock import NS_PER_MS, WallClock
from scm.runtime.live import run, stop_on_signal
from scm.runtime.part import BasePart, Subscription
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.plan_request import PlanRequest


class Toy(BasePart):
    role = "part"
    period_ns = 20 * NS_PER_MS
    subscriptions = (Subscription(PartStatus), Subscription(CityEvent))
    services = ()

    def __init__(self, name, behaviour):
        self.name = name
        self.behaviour = behaviour
        self.steps = 0

    def step(self, now_ns, inbox):
        self.steps += 1
        if self.behaviour == "fail" and self.steps == 10:
            msg = "toy broke"
            raise RuntimeError(msg)
        return []

    def finish(self, now_ns):
        return [CityEvent(severity="info", source=self.name, t_ns=now_ns, name="bye", text="bye")]


def main(name, endpoint, behaviour="run"):
    if behaviour.startswith("exit"):
        sys.exit(int(behaviour.removeprefix("exit")))
    bus = ZenohBus("city", name, endpoint)
    if behaviour == "leak":
        for kind in (PartStatus, CityEvent):
            bus.subscribe(kind, {}, Mailbox(10))
        bus.serve(PlanRequest, {}, Mailbox(10))
        bus.announce("part")
        msg = "nobody closes this bus"
        raise RuntimeError(msg)
    stop = stop_on_signal()
    if behaviour == "deaf":
        stop = type(stop)()
    run(Toy(name, behaviour), bus, WallClock(), stop)


if __name__ == "__main__":
    main(*sys.argv[1:])
