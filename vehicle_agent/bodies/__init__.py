"""Bodies: what an agent drives. One file a kind, each with `BODY`."""
