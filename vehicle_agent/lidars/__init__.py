"""LIDARs of real cars: one file a kind, each with `LIDAR`; see `vehicle_agent/lidar.py`."""
