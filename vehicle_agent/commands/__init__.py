"""The commands of `vehicle-agent`, one file each."""
