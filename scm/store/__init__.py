"""State that must survive a restart, behind one small interface: a file, or a server."""
