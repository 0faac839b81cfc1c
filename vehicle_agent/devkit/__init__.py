"""AutoDRIVE Devkit scripts, unchanged, drive cars of a city: our side is the simulator's.

engineio   the script's socket.io server as its client sees it: pure protocol, and one thread
deflate    a packet as pieces that are deflated once, for servers that inflate
pingpong   one packet, one reply; what is to be done when none comes
telemetry  what the city says of cars and lights, as the script's packet
commands   what the script says, read key by key
bridge     the part on the city's bus that ties them: leases, drive commands, resets
wheel      the lease of one car      heads  a script's lights as wishes      cosim  cars it places
"""
