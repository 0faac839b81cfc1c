"""The tasks: one file each, with `TASK`."""
