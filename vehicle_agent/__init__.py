"""The program of one car: its own process, its own dynamics or a real car, joined over the bus.

agent      the part: hears, decides, acts, reports        link    joining, the lease, lost links
stay       one stay in the city: body, guard, driver      leaving goodbye before the process ends
body       the contract of a body, one file a kind
May import v2x, vehicles and what is below; never the city's parts. Only `bodies/` open the physics.
"""
