"""Smart City Manager for scaled cars.

errors, clock, geometry     what everybody may use
maps        one city = one file: lanes, lights, tags, walls; routes through it
recording   anybody's recordings, read through a `recording.yaml`
v2x         messages, keys, and the bus (Zenoh, or in memory)
part        the contract of a part: step(now, inbox) -> outbox
vehicles    cars: physical effects as terms, assembled into one compiled kernel; drivers; guard
world       the shared world: cars, walls, contacts, sensors, radio, leases
traffic     signals: the safe kernel, plans, and the monitor that doubts them
scenery     what the city looks like, for whoever draws it through a lens
eye         overhead camera: tags in frames become poses
camera      the cars' own cameras: rendered while somebody looks
recorder    everything on the bus into MCAP
replay      a recording driven again by the simulator, and the error it makes
lockstep, live, up      parts on a stepped clock, on the real bus, and the whole city
api         REST, event stream, dashboard
fleet       scripts that spawn, route and time cars, live or in lockstep
commands    the command line, one file a command
"""

__version__ = "0.2.0"
