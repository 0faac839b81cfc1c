"""Smart City Manager for scaled cars.

errors, clock, geometry     what everybody may use
records     records that messages, REST, store and client share
store       what must outlive a process, in SQLite or PostgreSQL
maps        one city = one file: lanes, lights, tags, walls; routes through it
recording   recordings of any source, read through a `recording.yaml`
v2x         messages, keys, rights, and the bus (Zenoh, or in memory)
runtime     the contract of a part: step(now, inbox) -> outbox; live, in lockstep, whole cities
vehicles    cars: physical effects as terms, assembled into one compiled kernel; drivers; guard
world       the shared world: cars, walls, contacts, sensors, radio, leases
traffic     signals and their monitor, demand, observation, misbehaviour, parking
scenery     what the city looks like, for everything that draws it through a lens
eye         overhead camera: tags in frames become poses
camera      the cars' own cameras, rendered while somebody subscribes
recorder    everything on the bus into MCAP; written drives
data_quality, replay    recordings checked and repaired; driven again by the simulator
mismatch    what the simulator left out, found in recordings; blind trials
twin        since when a car is no longer what its file says
ros2        the city as ROS 2 sees it
selftest    faults injected into a running city
api, client     REST, event stream, dashboard; the typed client of it
study       one scenario in many cities: factors, seeds, engines, results, search
fleet       scripts that spawn, route and time cars, live or in lockstep
commands    the command line, one file per command
"""

__version__ = "0.2.0"
