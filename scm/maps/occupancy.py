"""Turns a scanned grid (ROS map_server: a `.yaml` beside a `.pgm`) into walls."""

from pathlib import Path

from scm.maps.model import CityMap


def map_from_occupancy(yaml_path: Path) -> CityMap:
    """Return a map whose walls are the scan's."""
    raise NotImplementedError(yaml_path)
