"""The program of one car: its own process, its own dynamics or a real car, joined over the bus.

agent      the part: hears, decides, acts, reports        link    joining, the lease, lost links
stay       one stay in the city: body, guard, driver      leaving goodbye before the process ends
body       the contract of a body, one file a kind        guard   before a real car's actuators
nigel/     rosserial: a real Nigel on a cable             firmware/  a better one for its Arduino
emulate/   the published firmware, where there is no car  calibrate/ a real car's own numbers
devkit/    AutoDRIVE Devkit scripts, unchanged            commands/  one file a command
May import v2x, vehicles and what is below; never the city's parts. The physics is opened by
`bodies/`, `emulate/` and `calibrate/` alone.
"""
