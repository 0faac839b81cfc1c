"""The commands of the command line: one file a command, named after it, with a `COMMAND`."""
