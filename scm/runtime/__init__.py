"""What runs parts: one alone against the bus, many in lockstep, or a whole city of processes."""
