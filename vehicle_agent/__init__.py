"""The program of one car: its own process, its own dynamics or a real car, joined over the bus.

agent      the part: receives, decides, acts, reports     link      joining, lease, lost links
session    one visit to the city: body, guard, driver     leaving   goodbye before the process ends
body       the contract of a body, one file a kind        guard     before a real car's actuators
nigel/     a real Nigel: rosserial over a serial cable    firmware/  better Arduino firmware
emulate/   the published firmware without a car           calibrate/ identifies a car's parameters
devkit/    unchanged AutoDRIVE Devkit scripts             commands/ one file a command
May import v2x, vehicles and what is below; never the city's parts. Only `bodies/`, `emulate/` and
`calibrate/` load the physics.
"""
