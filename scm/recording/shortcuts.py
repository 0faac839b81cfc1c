"""Names under `channels` that expand to the fields of a ROS message.

`odometry` stands for five channels of `nav_msgs/Odometry`, `scan` for `sensor_msgs/LaserScan`.
"""

from pathlib import Path
from typing import Any

from scm.errors import RecordingError, nearest

ODOMETRY, SCAN = "odometry", "scan"
RANGES = "ranges"
_QUATERNION = {axis: f"pose.pose.orientation.{axis}" for axis in "xyzw"}
_YAW = "atan2(2 * ({w} * {z} + {x} * {y}), 1 - 2 * ({y} * {y} + {z} * {z}))"
_POSES = ("pose.x", "pose.y")
ODOMETRY_CHANNELS: dict[str, dict[str, Any]] = {
    "pose.x": {"column": "pose.pose.position.x", "unit": "m", "variance": "pose.covariance[0]"},
    "pose.y": {"column": "pose.pose.position.y", "unit": "m", "variance": "pose.covariance[7]"},
    "pose.yaw": {
        "expression": _YAW.format(**_QUATERNION),
        "unit": "rad",
        "variance": "pose.covariance[35]",
    },
    "speed": {"column": "twist.twist.linear.x", "unit": "m/s", "variance": "twist.covariance[0]"},
    "yaw_rate": {
        "column": "twist.twist.angular.z",
        "unit": "rad/s",
        "variance": "twist.covariance[35]",
    },
}


def written_out(table: Any, path: Path) -> Any:
    """Return a table of a description with `odometry` and `scan` replaced by what they stand for.

    What the table itself says of a channel of `odometry` goes before what that stands for.

    Raises:
        RecordingError: for another word, or a key that a shortcut does not have.
    """
    if not isinstance(table, dict):
        return table
    channels, at = table.get("channels"), f"{path}: table {table.get('file')}"
    if isinstance(channels, str):
        if channels not in (ODOMETRY, SCAN):
            hint = nearest(channels, [ODOMETRY, SCAN]) or f", expected {ODOMETRY}, {SCAN} or a map"
            msg = f"{at}: channels: got {channels!r}{hint}"
            raise RecordingError(msg)
        channels = {channels: {}}
    if not isinstance(channels, dict):
        return table
    named = dict(channels)
    if ODOMETRY in named:
        point = _only(named.pop(ODOMETRY), ("point",), f"{at}: {ODOMETRY}")
        usual = {
            name: _merged(channel | (point if name in _POSES else {}), named.get(name, {}))
            for name, channel in ODOMETRY_CHANNELS.items()
        }
        named = named | usual
    if SCAN in named:
        _only(named[SCAN], (), f"{at}: {SCAN}")
        named[SCAN] = {"column": RANGES}
    return {**table, "channels": named}


def _merged(usual: dict[str, Any], own: Any) -> Any:
    """Return a channel of a shortcut with a table's own settings; its own column replaces it."""
    if not isinstance(own, dict) or own.keys() & {"column", "expression"}:
        return own
    return {k: v for k, v in usual.items() if k != "variance" or "std" not in own} | own


def _only(settings: Any, known: tuple[str, ...], at: str) -> dict[str, Any]:
    """Return the settings of a shortcut."""
    settings = {} if settings is None else settings
    if not isinstance(settings, dict) or not settings.keys() <= {*known}:
        but = f"nothing but {', '.join(known)}" if known else "nothing but {}"
        msg = f"{at}: expected {but}, got {settings}"
        raise RecordingError(msg)
    return settings
