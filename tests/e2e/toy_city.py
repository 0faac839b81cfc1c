"""A city of signals alone, run as a process: `toy_city.py CITY NEIGHBOUR MAP LISTEN LINK SOCKET`.

LINK is `join=ENDPOINT` or `admit=ENDPOINT`; empty: the city is alone.
"""

import sys
from pathlib import Path

from scm.clock import NS_PER_MS, WallClock
from scm.runtime.live import stop_on_signal
from scm.runtime.supervisor import Job, Supervisor
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.crossing import INNER, gateway_station
from scm.v2x.messages.presence import Presence
from scm.v2x.router import Router

SCM = (sys.executable, "-m", "scm")


def jobs_of(city, neighbour, city_map, listen, link, inner, parts):
    where = ("--connect", listen, "--city", city)
    jobs = [Job(name, "part", "", lambda n=name: [*SCM, n, city_map, *where]) for name in parts]
    if link:
        side, _, endpoint = link.partition("=")
        words = ("--neighbour", neighbour, f"--{side}", endpoint, "--inner", inner)
        command = [*SCM, "gateway", city_map, *where, *words]
        jobs.append(Job(gateway_station(neighbour), "part", "", lambda: command))
    return jobs


def main(city, neighbour, city_map, listen, link, socket, *parts):
    stop, clock, presences = stop_on_signal(), WallClock(), Mailbox(1000)
    inner = f"{INNER}/{socket}"
    Path(socket).unlink(missing_ok=True)  # of a city that was killed
    jobs = jobs_of(city, neighbour, city_map, listen, link, inner, parts)
    with Router(listen, gateways=inner), ZenohBus(city, "up", listen) as bus:
        bus.subscribe(Presence, {}, presences)
        supervisor = Supervisor(jobs, clock, print)
        while not clock.wait_until(clock.now_ns() + 50 * NS_PER_MS, stop):
            supervisor.poll()
            for item in presences.drain():
                supervisor.receive(item.message)
        supervisor.stop()


if __name__ == "__main__":
    main(*sys.argv[1:])
