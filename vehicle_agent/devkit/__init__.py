"""Unchanged AutoDRIVE Devkit scripts drive cars of a city: this package is the simulator's side.

engineio   the script's socket.io server as its client sees it: the protocol, and one thread
deflate    a packet as pieces that are deflated once, for servers that inflate
pingpong   one packet, one reply; what happens when no reply comes
telemetry  the city's state of cars and lights as the script's packet
commands   the script's replies, read key by key
bridge     the part on the city's bus that connects them: leases, drive commands, resets
lease      the lease of one car      heads  a script's lights as requests   cosim  cars it places
"""
